//! The rungs of module 2, phase by phase.

use std::collections::{BTreeMap, BTreeSet};

use understudy_ladder::{Coil, CoilKind, Element, Name};

use super::{Writer, any, coil, contact, exactly, off, on, patterns};
use crate::mega::{Label, failed_channels};
use crate::signals::Bits;

impl Writer<'_> {
    fn open_phase(&mut self, title: &str) {
        let moved = coil(CoilKind::Reset, &self.names.moved);
        self.program.push_titled(title, Vec::new(), vec![moved]);
    }

    /// From a latched state to another one, or out of the model.
    fn transition(&mut self, from: usize, to: Option<usize>, mut when: Vec<Element>) {
        let source = self.latched[&from].clone();
        let target = to.map_or(&self.names.lost, |to| &self.latched[&to]).clone();
        let mut network = vec![on(&source), off(&self.names.moved)];
        network.append(&mut when);
        let mut coils = vec![coil(CoilKind::Set, &self.names.moved)];
        if to != Some(from) {
            coils.insert(0, coil(CoilKind::Reset, &source));
            coils.insert(1, coil(CoilKind::Set, &target));
        }
        self.program.push_rung(network, coils);
    }

    fn latched_places(&self) -> Vec<usize> {
        self.latched.keys().copied().collect()
    }

    /// Break and repair of one channel, steps 4 and 5.
    pub(super) fn channel(&mut self, bit: usize) {
        let channel = self.controller.signals.inputs[self.question.channels[bit]].clone();
        let status = self.names.failed[bit].clone();
        self.open_phase(&format!("module 2: channel {channel} fails or is repaired"));
        for place in self.latched_places() {
            if self.mega.states[place].failed >> bit & 1 == 0 {
                let target = self.mega.follow(place, &Label::Break(bit));
                self.transition(place, target, vec![on(&status)]);
                continue;
            }
            for value in [false, true] {
                let label = Label::Repair(bit, Some(value));
                let target = self.mega.follow(place, &label);
                self.transition(place, target, vec![off(&status), contact(&channel, value)]);
            }
        }
    }

    /// What the working channels show, step 3, and ω.
    pub(super) fn follow(&mut self) {
        self.open_phase("module 2: input changes");
        let mega = self.mega;
        for place in self.latched_places() {
            let state = &mega.states[place];
            let shown = &self.controller.states()[state.members[0] as usize].inputs.0;
            let failed: BTreeSet<usize> =
                failed_channels(&self.question.channels, state.failed).collect();
            let working: Vec<usize> =
                (0..shown.len()).filter(|input| !failed.contains(input)).collect();
            let inputs = &self.controller.signals.inputs;
            let mut found = Vec::new();
            for (label, target) in &mega.edges[place] {
                let Label::Seen(events) = label else { continue };
                if events.is_empty() {
                    // The ladder is in the next state already.
                    let next = mega.states[*target].members.iter();
                    let at = next.filter_map(|&member| self.at.get(&(member as usize)));
                    if let Some(when) = any(at.map(|name| vec![on(name)]).collect()) {
                        found.push((Some(*target), when));
                    }
                    continue;
                }
                let value = |input: usize| {
                    shown[input] ^ events.iter().any(|event| event.channel() == Some(input))
                };
                let when = working.iter().map(|&input| contact(&inputs[input], value(input)));
                found.push((Some(*target), when.collect()));
            }
            let differs = working.iter().map(|&input| vec![contact(&inputs[input], !shown[input])]);
            if let Some(when) = any(differs.collect()) {
                found.push((None, when));
            }
            for (target, when) in found {
                self.transition(place, target, when);
            }
        }
    }

    pub(super) fn give_back(&mut self) {
        let held = coil(CoilKind::Reset, &self.names.held);
        for place in self.latched_places() {
            let state = &self.mega.states[place];
            if state.command.is_some() {
                continue;
            }
            let Some(at) = self.at.get(&(state.members[0] as usize)) else {
                continue;
            };
            let latch = self.latched[&place].clone();
            let network = vec![on(&latch), on(at)];
            self.program.push_rung(network, vec![coil(CoilKind::Reset, &latch), held.clone()]);
        }
        let mut network = vec![on(&self.names.release)];
        network.extend(self.names.failed.iter().map(off));
        let mut coils: Vec<Coil> =
            self.latched.values().map(|latch| coil(CoilKind::Reset, latch)).collect();
        coils.push(coil(CoilKind::Reset, &self.names.lost));
        coils.push(held);
        self.program.push_titled("module 2: release by the operator", network, coils);
    }

    /// From transparent into Θ.
    pub(super) fn enter(&mut self) {
        let mega = self.mega;
        let channels = self.question.channels.len();
        let states: Vec<(usize, Name)> =
            self.at.iter().map(|(&state, name)| (state, name.clone())).collect();
        for failed in patterns(channels, self.question.simultaneous) {
            for (state, at) in &states {
                let seed = [*state as u32];
                let fresh = mega.find(&seed, 0).and_then(|home| {
                    let bits = (0..channels).filter(|bit| failed >> bit & 1 == 1);
                    bits.into_iter()
                        .try_fold(home, |place, bit| mega.follow(place, &Label::Break(bit)))
                });
                let stale = mega.settled(&seed, failed).or(fresh);
                let fresh = mega.entry(seed[0], failed, true).or(fresh);
                let stale = mega.entry(seed[0], failed, false).or(stale);
                let mut network = vec![off(&self.names.held), on(at)];
                let pattern = self.names.failed.iter().enumerate();
                network.extend(pattern.map(|(bit, name)| contact(name, failed >> bit & 1 == 1)));
                if fresh == stale {
                    self.entry(fresh, network);
                } else {
                    let mut freshly = network.clone();
                    freshly.push(on(&self.names.fresh));
                    self.entry(fresh, freshly);
                    network.push(off(&self.names.fresh));
                    self.entry(stale, network);
                }
            }
        }
        // More channels than were asked about, or a ladder outside of the model.
        let failed: Vec<Vec<Element>> =
            self.names.failed.iter().map(|name| vec![on(name)]).collect();
        let mut outside = Vec::new();
        for pattern in exactly(channels, self.question.simultaneous + 1) {
            let bits = (0..channels).filter(|bit| pattern >> bit & 1 == 1);
            outside.push(bits.map(|bit| on(&self.names.failed[bit])).collect());
        }
        if let Some(mut one) = any(failed) {
            one.push(off(&self.names.known));
            outside.push(one);
        }
        if let Some(mut network) = any(outside) {
            network.insert(0, off(&self.names.held));
            let coils =
                vec![coil(CoilKind::Set, &self.names.lost), coil(CoilKind::Set, &self.names.held)];
            self.program.push_titled("module 2: outside of the model", network, coils);
        }
        for (was, failed) in self.names.was.clone().iter().zip(self.names.failed.clone()) {
            self.program.push_rung(vec![on(&failed)], vec![coil(CoilKind::Plain, was)]);
        }
    }

    fn entry(&mut self, target: Option<usize>, network: Vec<Element>) {
        let Some(target) = target else { return };
        if self.mega.states[target].command.is_none() {
            return;
        }
        let latch = self.latched[&target].clone();
        let held = coil(CoilKind::Set, &self.names.held);
        self.program.push_rung(network, vec![coil(CoilKind::Set, &latch), held]);
    }

    /// Writes the commands over the outputs, and where Θ is down to one state, that state's memory into the ladder's.
    pub(super) fn command(&mut self, lost_outputs: &Bits) {
        let mut writes: BTreeMap<(usize, bool), Vec<Vec<Element>>> = BTreeMap::new();
        let mut restores: BTreeMap<(usize, bool), Vec<Vec<Element>>> = BTreeMap::new();
        for (&place, latch) in &self.latched {
            let state = &self.mega.states[place];
            let single = &self.controller.states()[state.members[0] as usize];
            let outputs =
                state.command.as_ref().map_or(&single.outputs, |command| &command.outputs);
            for (output, &value) in outputs.0.iter().enumerate() {
                writes.entry((output, value)).or_default().push(vec![on(latch)]);
            }
            if let ([memory], [_], None) = (&single.memory[..], &state.members[..], &state.command)
            {
                for (bit, &value) in memory.0.iter().enumerate() {
                    restores.entry((bit, value)).or_default().push(vec![on(latch)]);
                }
            }
        }
        for (output, &value) in lost_outputs.0.iter().enumerate() {
            writes.entry((output, value)).or_default().push(vec![on(&self.names.lost)]);
        }
        let outputs = &self.controller.signals.outputs;
        let memory = &self.controller.memory;
        let named = |writes: BTreeMap<(usize, bool), Vec<Vec<Element>>>, names: &[String]| {
            let named = writes.into_iter().map(|((place, value), latches)| {
                (Name::from(names[place].clone()), value, latches)
            });
            named.collect::<Vec<_>>()
        };
        let all = named(writes, outputs).into_iter().chain(named(restores, memory));
        for (target, value, latches) in all.collect::<Vec<_>>() {
            let kind = if value { CoilKind::Set } else { CoilKind::Reset };
            let title = format!("module 2: {target} {}", if value { "on" } else { "off" });
            if let Some(network) = any(latches) {
                self.program.push_titled(&title, network, vec![coil(kind, &target)]);
            }
        }
    }
}
