//! What the signals of a map cannot tell: commands that are latched twice, and events that come faster than scans.

use std::collections::hash_map::Entry;
use std::collections::{BTreeMap, HashMap, VecDeque};

use super::closed_loop::{ClosedLoop, in_states};
use super::{Finding, FindingKind, FindingSeverity};
use crate::ladder::{
    InputOutputMap, Meaning, Modules, OneEvent, Partition, Positions, repetitions,
};
use crate::{Label, State};

impl ClosedLoop {
    /// Assumption 4 of the thesis: a signal is unlatched before it is latched again, because otherwise it has no edge.
    pub(super) fn latched_again(
        &self,
        modules: &Modules,
        map: &InputOutputMap,
        partition: &Partition,
    ) -> Vec<Finding> {
        if map.switches.is_empty() {
            return Vec::new();
        }
        let possible = Positions::of(&self.automaton, map, partition);
        let mut again: BTreeMap<Label, Vec<State>> = BTreeMap::new();
        for source in self.automaton.states() {
            for (label, _) in self.edges(source, true).filter(|(_, target)| *target != source) {
                if let Some(Meaning::Switch { switch, position: position @ 1.. }) =
                    partition.meaning(label)
                    && possible.possible(source, switch, position)
                {
                    again.entry(label).or_default().push(source);
                }
            }
        }
        let findings = again.into_iter().filter_map(|(label, mut states)| {
            let Some(Meaning::Switch { switch, position }) = partition.meaning(label) else {
                return None;
            };
            let (state, run) = self.run_to_again(label, switch, position, partition)?;
            let first = states.iter().position(|&known| known == state)?;
            states.swap(0, first);
            let signal = &map.switches[switch].positions[position - 1].signal;
            let name = self.name(label);
            let effect = if modules.len() == 1 {
                format!(
                    "{name} then occurs without an edge of `{signal}`, which the plant cannot see"
                )
            } else {
                format!("{name} is then not generated")
            };
            let words: Vec<String> = run.iter().map(|&label| self.name(label)).collect();
            let message = format!(
                "{} {name} is enabled while its signal `{signal}` is on, as after {}; {effect}",
                in_states(&states),
                words.join(" ")
            );
            let (kind, severity) = (FindingKind::LatchedAgain, FindingSeverity::Warning);
            Some(Finding { kind, severity, message, states, events: vec![label], run })
        });
        findings.collect()
    }

    /// The same for pulses: a command that follows itself at once is on in two scans one after the other.
    pub(super) fn pulsed_again(&self, map: &InputOutputMap, partition: &Partition) -> Vec<Finding> {
        let findings = repetitions(&self.automaton).into_iter().filter_map(|repetition| {
            let label = repetition.label;
            let Some(Meaning::Pulse(pulse)) = partition.meaning(label) else {
                return None;
            };
            let (kind, severity) = (FindingKind::LatchedAgain, FindingSeverity::Warning);
            let (states, events) = (vec![repetition.source], vec![label]);
            let mut found = self.finding(kind, severity, String::new(), states, events);
            found.run.push(label);
            found.states = vec![repetition.middle];
            let words: Vec<String> = found.run.iter().map(|&label| self.name(label)).collect();
            found.message = format!(
                "{} can follow itself at once, as after {}; its signal `{}` is then on in two scans one after the other and has one edge",
                self.name(label),
                words.join(" "),
                map.pulses[pulse].signal
            );
            Some(found)
        });
        findings.collect()
    }

    /// The shortest run to a state in which `label` leads on while its switch is in its position already.
    fn run_to_again(
        &self,
        label: Label,
        switch: usize,
        position: usize,
        partition: &Partition,
    ) -> Option<(State, Vec<Label>)> {
        let start = (self.automaton.initial()?, 0);
        let mut parents = HashMap::from([(start, None)]);
        let mut pending = VecDeque::from([start]);
        while let Some(node) = pending.pop_front() {
            let (state, at) = node;
            let leads_on = self.automaton.step(state, label).is_some_and(|target| target != state);
            if at == position && leads_on {
                let mut run = Vec::new();
                let mut last = node;
                while let Some(&Some((parent, label))) = parents.get(&last) {
                    run.push(label);
                    last = parent;
                }
                run.reverse();
                return Some((state, run));
            }
            for edge in self.automaton.edges(state) {
                let event = self.automaton.label(*edge);
                let next = match partition.meaning(event) {
                    Some(Meaning::Switch { switch: moved, position }) if moved == switch => {
                        position
                    }
                    _ => at,
                };
                let next = (edge.target, next);
                if let Entry::Vacant(place) = parents.entry(next) {
                    place.insert(Some((node, event)));
                    pending.push_back(next);
                }
            }
        }
        None
    }

    /// How far apart events have to be for a ladder that processes one of them in a scan.
    pub(super) fn one_event(&self, one_event: &OneEvent, queue: &[Label]) -> Option<Finding> {
        let labels = self.automaton.alphabet().labels();
        let seen: Vec<Label> = labels.filter(|label| !label.is_controllable()).collect();
        let message = match one_event {
            OneEvent::Assumed if seen.len() > 1 => format!(
                "the ladder is right only if at most one of its {} events occurs in a scan: any two of them must be at least one period apart",
                seen.len()
            ),
            OneEvent::Queued(_) if !queue.is_empty() => {
                let names: Vec<String> = queue.iter().map(|&label| self.name(label)).collect();
                let count = queue.len();
                format!(
                    "a scan processes one event, the first possible one of {}; if none of them comes twice within {count} scans, each waits at most {} and none is lost; no command is generated while an event waits",
                    names.join(", "),
                    count - 1
                )
            }
            OneEvent::Assumed | OneEvent::Queued(_) => return None,
        };
        let (kind, severity) = (FindingKind::OneEvent, FindingSeverity::Warning);
        let events = if queue.is_empty() { seen } else { queue.to_vec() };
        Some(Finding { kind, severity, message, states: Vec::new(), events, run: Vec::new() })
    }
}
