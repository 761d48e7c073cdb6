//! Several automata side by side: a command needs all that know it, and each moves on a shared event by itself.
//!
//! A group of rungs for each event begins with the rung that recognises it: the event has occurred, and the plants (or the
//! supervisors, where there are no plants) can generate it now. A bit of an event is used by all; an automaton in which it
//! could go through two transitions has a bit of its own, which its rungs reset.

use super::super::omega::action;
use super::super::rung::{any, closed, open, reset, set, write};
use super::single::changes;
use super::{Coil, Converter, Element, Label, Name, repeats};

/// The bits of one event.
#[derive(Debug, Clone, Default)]
struct Bits {
    /// For each automaton that knows the event its bit, and whether it is its own.
    of: Vec<Option<(Name, bool)>>,
    shared: Option<Name>,
    /// All of them, and whether rungs reset it.
    distinct: Vec<(Name, bool)>,
}

impl Converter<'_> {
    pub(super) fn several(&mut self) {
        let groups = self.groups.clone();
        for group in groups.iter().filter(|group| group.again) {
            // Seen once, it is used by the group at which it can occur.
            let occurs = self.detect(group.label, true);
            self.bits.insert(group.label, occurs);
            self.consumed.insert(group.label);
        }
        let mut recognised = std::collections::BTreeMap::<Label, Bits>::new();
        for group in &groups {
            let label = group.label;
            let known = recognised.entry(label);
            let bits = known.or_insert_with(|| self.own_bits(label)).clone();
            self.recognise(label, &bits, group.again);
            self.transitions(label, &bits, group.again);
        }
        let alphabets = self.automata.iter().flat_map(|automaton| automaton.alphabet().labels());
        let commands: std::collections::BTreeSet<Label> =
            alphabets.filter(|label| label.is_controllable()).collect();
        for label in commands {
            self.command(label);
        }
    }

    /// The bit that the rungs of each automaton read; automata that need none of their own share one.
    fn own_bits(&mut self, label: Label) -> Bits {
        let event = self.event_name(label);
        // A repeated event is announced twice, which requires a bit that is set and reset.
        let has_bit = self.bits.contains_key(&label);
        let word = if has_bit { "now" } else { "" };
        let mut bits = Bits::default();
        for automaton in self.automata.clone() {
            let bit = if !automaton.alphabet().contains(label) {
                None
            } else if repeats(automaton, label) {
                self.consumed.insert(label);
                let own = self.memory(&[&event, automaton.name()], "");
                bits.distinct.push((own.clone(), true));
                Some((own, true))
            } else {
                let shared =
                    bits.shared.clone().unwrap_or_else(|| self.memory(&[&event, word], ""));
                if bits.shared.is_none() {
                    bits.shared = Some(shared.clone());
                    bits.distinct.push((shared.clone(), has_bit));
                }
                Some((shared, false))
            };
            bits.of.push(bit);
        }
        bits
    }

    /// Passes power while automaton `index` allows `label`; nothing where it always does.
    pub(super) fn allows(&self, index: usize, label: Label) -> Vec<Element> {
        let automaton = self.automata[index];
        let Some(event) = automaton.alphabet().place(label) else {
            return Vec::new();
        };
        let bits = &self.states[index];
        let (able, unable): (Vec<_>, Vec<_>) =
            automaton.states().partition(|&state| automaton.successor(state, event).is_some());
        if unable.is_empty() {
            return Vec::new();
        }
        if able.is_empty() {
            // One state is on and off at once: never.
            return vec![open(&bits[0]), closed(&bits[0])];
        }
        if able.len() <= unable.len() {
            any(able.iter().map(|state| &bits[state.index()])).into_iter().collect()
        } else {
            unable.iter().map(|state| closed(&bits[state.index()])).collect()
        }
    }

    fn recognise(&mut self, label: Label, bits: &Bits, again: bool) {
        let event = self.event_name(label);
        let mut network = match self.bits.get(&label) {
            Some(occurs) => vec![open(occurs)],
            None => self.occurrence(label),
        };
        let last = match (self.bits.contains_key(&label), network.as_slice()) {
            (false, [Element::Contact(last), Element::Contact(signal)]) => {
                Some((last.operand.clone(), signal.operand.clone()))
            }
            _ => None,
        };
        for index in self.modules.witnesses(label) {
            network.extend(self.allows(index, label));
        }
        network.extend(self.started.iter().map(open));
        if again {
            let coils = bits.distinct.iter().map(|(bit, _)| reset(bit)).collect();
            self.push(&format!("{event} can occur after another event"), Vec::new(), coils);
        }
        let mut coils = self.announcements(bits);
        coils.extend(self.bits.get(&label).map(reset));
        let again = if again { " after another event" } else { "" };
        self.push(&format!("{event} occurs{again}"), network, coils);
        if let Some((last, signal)) = last {
            let title = format!("{signal}: value for the next scan");
            self.push(&title, vec![open(&signal)], vec![write(&last)]);
        }
    }

    fn announcements(&mut self, bits: &Bits) -> Vec<Coil> {
        let bits = bits.distinct.iter();
        bits.map(|(bit, is_consumed)| self.announce(bit, *is_consumed)).collect()
    }

    /// The rungs that move the automata.
    fn transitions(&mut self, label: Label, bits: &Bits, again: bool) {
        let again = if again { ", after another event" } else { "" };
        for (index, automaton) in self.automata.clone().into_iter().enumerate() {
            let Some((bit, is_own)) = &bits.of[index] else {
                continue;
            };
            for transition in automaton.transitions() {
                if transition.label != label || transition.source == transition.target {
                    continue;
                }
                let source = self.states[index][transition.source.index()].clone();
                let target = self.states[index][transition.target.index()].clone();
                let mut coils = vec![reset(&source), set(&target)];
                if *is_own {
                    coils.push(reset(bit));
                }
                let title = format!(
                    "{}: {} -- {} --> {}{again}",
                    automaton.name(),
                    self.shown(index, transition.source),
                    automaton.alphabet().name(label),
                    self.shown(index, transition.target)
                );
                self.push(&title, vec![open(&source), open(bit)], coils);
            }
        }
    }

    fn command(&mut self, label: Label) {
        let event = self.event_name(label);
        let bits = self.own_bits(label);
        let mut network = Vec::new();
        if self.mode.asks(true) {
            let request = self.ask(label, &Name::from(format!("request_{event}")));
            network.push(open(&request));
        }
        network.extend(self.commanded.iter().chain(&self.queued).map(closed));
        network.extend(self.started.iter().map(open));
        network.extend(changes(self.map, self.partition.meaning(label)));
        for index in 0..self.automata.len() {
            network.extend(self.allows(index, label));
        }
        let (latch, unlatch) = action(self.map, self.partition, label, |_, _| true);
        let mut coils = self.announcements(&bits);
        coils.extend(unlatch.iter().map(reset));
        coils.extend(latch.iter().map(set));
        coils.extend(self.commanded.iter().map(set));
        self.push(&format!("{event}: command"), network, coils);
        self.transitions(label, &bits, false);
    }
}
