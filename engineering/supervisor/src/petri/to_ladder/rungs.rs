//! The rungs of a net's ladder, from the top of the scan to its end.

use std::collections::{BTreeMap, BTreeSet};

use understudy_ladder::{Block, BlockKind, Coil, Element, Name};

use super::{HybridLadder, Maker};
use crate::ladder::rung::{any, closed, open, reset, rising, rung, set, write};
use crate::ladder::{When, avalanche_events};
use crate::petri::net::{Action, Condition, NetTransition};
use crate::petri::tokens::Tokens;

impl Maker<'_> {
    fn push(&mut self, title: impl Into<String>, network: Vec<Element>, coils: Vec<Coil>) {
        self.program.rungs.push(rung(title, network, coils));
    }

    pub(super) fn make(mut self) -> HybridLadder {
        self.timers();
        self.begin();
        self.detect_edges();
        for number in 0..self.net.transitions().len() {
            self.transition(number);
            self.follow(number);
        }
        if !self.left.is_empty() {
            let coils = self.left.iter().map(reset).collect();
            self.push("reset events that moved no supervisor", Vec::new(), coils);
        }
        for (tokens, place) in self.tokens.iter().zip(self.net.places()) {
            self.program.rungs.extend(tokens.count(&place.name));
        }
        let firsts = self.tokens.iter().filter_map(|tokens| match tokens {
            Tokens::Counter { first, .. } => first.clone(),
            Tokens::Flags(_) => None,
        });
        let firsts: Vec<Coil> = firsts.map(|first| reset(&first)).collect();
        if !firsts.is_empty() {
            self.push("load the counters", Vec::new(), firsts);
        }
        self.levels();
        let places = self.tokens.iter().map(|tokens| match tokens {
            Tokens::Flags(flags) => (flags.clone(), None),
            Tokens::Counter { counter, .. } => (Vec::new(), Some(counter.clone())),
        });
        let (places, counters) = places.unzip();
        let timers = (0..self.fires.len()).map(|number| {
            let delay = self.delays.get(&number);
            delay.map(|(timer, _)| timer.clone())
        });
        HybridLadder {
            timers: timers.collect(),
            places,
            counters,
            program: self.program,
            states: self.states,
            fires: self.fires,
        }
    }

    fn timers(&mut self) {
        for (number, (timer, done)) in self.delays.clone() {
            let transition = &self.net.transitions()[number];
            let Some(delay) = transition.delay else {
                continue;
            };
            let mut network = self.enabled(transition);
            for arc in &transition.takes {
                network.extend(self.fresh.get(&arc.place).map(closed));
            }
            network.extend(self.condition(&transition.condition));
            network.push(closed(&done));
            network.push(Element::Block(Block {
                name: timer,
                kind: BlockKind::Ton(delay),
                pins: Vec::new(),
            }));
            self.push(format!("delay of {}", transition.name), network, Vec::new());
        }
    }

    fn begin(&mut self) {
        let mut coils: Vec<Coil> = self.fresh.values().map(reset).collect();
        coils.extend(self.delays.values().map(|(_, done)| reset(done)));
        let mut impulses = BTreeSet::new();
        for place in self.net.places() {
            for action in &place.actions {
                if let Action::Impulse(signal) = action
                    && impulses.insert(signal.to_string())
                {
                    coils.push(reset(signal));
                }
            }
        }
        for (tokens, place) in self.tokens.clone().iter().zip(self.net.places()) {
            if let Tokens::Counter { comes, goes, busy, .. } = tokens {
                let moved = any([comes, goes]).into_iter().collect();
                self.push(format!("{}: counter updated", place.name), moved, vec![write(busy)]);
                coils.extend([reset(comes), reset(goes)]);
            }
        }
        if !coils.is_empty() {
            self.push("start of the scan", Vec::new(), coils);
        }
    }

    fn detect_edges(&mut self) {
        for ((signal, rises), bit) in self.edges.clone() {
            let signal = Name::from(signal);
            if rises {
                self.push(format!("{signal} rises"), vec![rising(&signal)], vec![write(&bit)]);
            } else {
                let last = self.memory(&[&signal, "last"], false);
                let network = vec![open(&last), closed(&signal)];
                self.push(format!("{signal} falls"), network, vec![write(&bit)]);
                let title = format!("{signal}: value for the next scan");
                self.push(title, vec![open(&signal)], vec![write(&last)]);
            }
        }
    }

    /// Enabling rules 1 to 3, capacities, and what counters wait for.
    fn enabled(&self, transition: &NetTransition) -> Vec<Element> {
        let mut network = Vec::new();
        for (index, place) in self.net.places().iter().enumerate() {
            let tokens = &self.tokens[index];
            let (taken, given) = (transition.taken(index), transition.given(index));
            network.extend(tokens.at_least(taken));
            let mut reads = transition.enablers.iter().chain(&transition.inhibitors);
            if taken + given > 0 || reads.any(|arc| arc.place == index) {
                network.extend(tokens.ready());
            }
            if let Some(capacity) = place.capacity.filter(|_| given > taken) {
                network.extend(match (capacity + 1).checked_sub(given - taken) {
                    None | Some(0) => tokens.never(),
                    Some(count) => tokens.fewer(count),
                });
            }
        }
        for arc in &transition.enablers {
            network.extend(self.tokens[arc.place].at_least(arc.weight));
        }
        for arc in &transition.inhibitors {
            network.extend(self.tokens[arc.place].fewer(arc.weight));
        }
        network
    }

    fn condition(&self, condition: &Condition) -> Vec<Element> {
        match condition {
            Condition::Always => Vec::new(),
            Condition::Signal(signal, When::High | When::Pulse) => vec![open(signal)],
            Condition::Signal(signal, When::Low) => vec![closed(signal)],
            Condition::Signal(signal, when) => {
                let key = (signal.to_string(), *when == When::Rising);
                self.edges.get(&key).map(open).into_iter().collect()
            }
            Condition::All(parts) => parts.iter().flat_map(|part| self.condition(part)).collect(),
            Condition::Any(parts) => {
                let branches: Vec<_> = parts.iter().map(|part| self.condition(part)).collect();
                match branches.len() {
                    // One that always holds makes all of them hold.
                    _ if branches.iter().any(Vec::is_empty) => Vec::new(),
                    0 | 1 => branches.into_iter().flatten().collect(),
                    _ => vec![Element::Branches(branches)],
                }
            }
        }
    }

    fn transition(&mut self, number: usize) {
        let transition = &self.net.transitions()[number];
        let mut network = self.enabled(transition);
        for (index, bit) in &self.fresh {
            if !self.rests(*index, transition) {
                continue;
            }
            // Enough tokens may have been there before, however many have come.
            let givers = self.net.transitions().iter();
            let come: u32 = givers.map(|giver| giver.given(*index)).sum();
            let enough = (transition.taken(*index) + come) as usize;
            let older = match &self.tokens[*index] {
                Tokens::Flags(flags) => flags.get(enough - 1),
                Tokens::Counter { .. } => None,
            };
            network.push(match older {
                Some(older) => Element::Branches(vec![vec![closed(bit)], vec![open(older)]]),
                None => closed(bit),
            });
        }
        match self.delays.get(&number) {
            Some((timer, _)) => network.push(open(&Name::from(format!("{timer}.Q")))),
            None => network.extend(self.condition(&transition.condition)),
        }
        if let Some(label) = transition.label.filter(|label| label.is_controllable()) {
            for (supervisor, bits) in self.supervisors.iter().zip(&self.states) {
                let Some(event) = supervisor.alphabet().place(label) else {
                    continue;
                };
                // The control data as inhibitor arcs.
                let disabling = supervisor
                    .states()
                    .filter(|&state| supervisor.successor(state, event).is_none());
                network.extend(disabling.map(|state| closed(&bits[state.index()])));
            }
        }
        let fires = self.fires[number].clone();
        let mut coils = vec![write(&fires)];
        let mut shifts = Vec::new();
        for (index, place) in self.net.places().iter().enumerate() {
            let (taken, given) = (transition.taken(index), transition.given(index));
            let change = i64::from(given) - i64::from(taken);
            coils.extend(self.tokens[index].coils(change));
            shifts.extend(self.tokens[index].shift(&place.name, change, &fires));
            if given > 0 {
                coils.extend(self.fresh.get(&index).map(set));
                coils.extend(place.actions.iter().filter_map(|action| match action {
                    Action::Impulse(signal) => Some(set(signal)),
                    Action::Level(_) => None,
                }));
            }
        }
        coils.extend(self.delays.get(&number).map(|(_, done)| set(done)));
        // Tokens go before they come, so that a place that does both keeps them.
        coils[1..].sort_by_key(|coil| coil.kind != understudy_ladder::CoilKind::Reset);
        self.push(transition.name.clone(), network, coils);
        self.program.rungs.extend(shifts);
    }

    /// The supervisors move on the event of a transition that has fired.
    fn follow(&mut self, number: usize) {
        let transition = &self.net.transitions()[number];
        let Some(label) = transition.label else {
            return;
        };
        for (index, supervisor) in self.supervisors.iter().enumerate() {
            let mut bit = self.fires[number].clone();
            let consumes = avalanche_events(supervisor).contains(&label);
            if consumes {
                let own = self.memory(&[&transition.name, supervisor.name()], false);
                let title = format!("{} for {}", transition.name, supervisor.name());
                self.push(title, vec![open(&bit)], vec![set(&own)]);
                self.left.push(own.clone());
                bit = own;
            }
            for step in supervisor.transitions() {
                if step.label != label || step.source == step.target {
                    continue;
                }
                let source = self.states[index][step.source.index()].clone();
                let target = self.states[index][step.target.index()].clone();
                let mut coils = vec![reset(&source), set(&target)];
                if consumes {
                    coils.push(reset(&bit));
                }
                let title = format!(
                    "{}: {} -- {} --> {}",
                    supervisor.name(),
                    supervisor.state_name(step.source),
                    transition.name,
                    supervisor.state_name(step.target)
                );
                self.push(title, vec![open(&bit), open(&source)], coils);
            }
        }
    }

    fn levels(&mut self) {
        let mut places: BTreeMap<String, Vec<Vec<Element>>> = BTreeMap::new();
        for (place, tokens) in self.net.places().iter().zip(&self.tokens) {
            for action in &place.actions {
                if let Action::Level(signal) = action {
                    places.entry(signal.to_string()).or_default().push(tokens.at_least(1));
                }
            }
        }
        for (signal, holding) in places {
            let network = if holding.len() > 1 {
                vec![Element::Branches(holding)]
            } else {
                holding.into_iter().flatten().collect()
            };
            let signal = Name::from(signal);
            self.push(format!("action {signal}"), network, vec![write(&signal)]);
        }
    }
}
