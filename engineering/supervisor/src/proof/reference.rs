//! What one scan may do, said from the automata alone.
//!
//! In a scan the events E occur in an order that nobody sees, and then at most one command C. Allowed is every end of
//!
//! ```text
//! q --e1--> ... --en--> q' --c--> q''      {e1 ... en} ⊆ E, as many as any order admits, c as the mode wants it
//! ```
//!
//! where all automata step together on a shared event. Of more than two events at once it is asked only that what happens is
//! possible and that something happens where something can: a PLC cannot do better without trying all orders.
//!
//! Where events wait for their turn, E joins those that wait. The first of them that the automata can do occurs; where they can do
//! none, all are forgotten. A command needs that none waits any more.

use std::collections::{BTreeMap, BTreeSet};

use crate::ladder::{InputOutputMap, Meaning, Mode, Modules, Partition};
use crate::{Automaton, Label, State};

/// The state of all automata; `None` before the start.
pub(super) type Joint = Option<Box<[State]>>;

/// What a scan does that can be seen: where it leads, and the commands in it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Allowed {
    pub(super) state: Joint,
    /// The position of each switch.
    pub(super) positions: Box<[u8]>,
    /// The pulse that is on.
    pub(super) pulse: Option<usize>,
    /// Events that wait for their turn after it, ascending.
    pub(super) waiting: Vec<Label>,
    /// The order of events, and the command.
    pub(super) word: Vec<Label>,
}

/// What happened in a scan, seen from outside.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(super) struct Happening {
    pub(super) start: bool,
    /// Ascending.
    pub(super) events: Vec<Label>,
    /// Commands that the operator asks for, ascending.
    pub(super) requests: Vec<Label>,
}

/// The automata with the meaning of their events.
pub(super) struct Reference<'a> {
    automata: Vec<&'a Automaton>,
    supervisors: usize,
    map: &'a InputOutputMap,
    partition: &'a Partition,
    mode: Mode,
    /// For each event the automata that know it, with its place in their alphabets.
    knowing: BTreeMap<Label, Vec<(usize, u32)>>,
}

impl<'a> Reference<'a> {
    pub(super) fn new(
        modules: &Modules<'a>,
        map: &'a InputOutputMap,
        partition: &'a Partition,
        mode: Mode,
    ) -> Self {
        let automata: Vec<&Automaton> = modules.all().collect();
        let mut knowing: BTreeMap<Label, Vec<(usize, u32)>> = BTreeMap::new();
        for (index, automaton) in automata.iter().enumerate() {
            for (place, label) in (0..).zip(automaton.alphabet().labels()) {
                knowing.entry(label).or_default().push((index, place));
            }
        }
        Self { supervisors: modules.supervisors.len(), automata, map, partition, mode, knowing }
    }

    pub(super) fn automata(&self) -> &[&'a Automaton] {
        &self.automata
    }

    /// All automata in their initial states.
    pub(super) fn initial(&self) -> Box<[State]> {
        self.automata.iter().map(|_| State::INITIAL).collect()
    }

    /// δ of the synchronous product.
    pub(super) fn step(&self, state: &[State], label: Label) -> Option<Box<[State]>> {
        let mut next: Box<[State]> = state.into();
        for &(index, place) in self.knowing.get(&label)? {
            next[index] = self.automata[index].successor(state[index], place)?;
        }
        Some(next)
    }

    /// A supervisor that forbids an uncontrollable event which all plants can generate.
    pub(super) fn forbids(&self, state: &[State], label: Label) -> Option<usize> {
        let knowing = self.knowing.get(&label)?;
        if label.is_controllable() || self.supervisors == self.automata.len() {
            return None;
        }
        let (supervisors, plants): (Vec<_>, Vec<_>) =
            knowing.iter().partition(|(index, _)| *index < self.supervisors);
        let can = |&&(index, place): &&(usize, u32)| {
            self.automata[index].successor(state[index], place).is_some()
        };
        if plants.is_empty() || !plants.iter().all(&can) {
            return None;
        }
        let forbidding = supervisors.iter().find(|supervisor| !can(supervisor));
        forbidding.map(|(index, _)| *index)
    }

    /// Every end that a scan may have, from `state` with the switches in `positions` while the events `waiting` wait for their
    /// turn.
    pub(super) fn scan(
        &self,
        state: &Joint,
        positions: &[u8],
        waiting: &[Label],
        happening: &Happening,
    ) -> Vec<Allowed> {
        let started = match state {
            Some(state) => state.clone(),
            None if happening.start => self.initial(),
            None => return vec![self.quiet(state.clone(), positions, Vec::new())],
        };
        if !self.partition.queue().is_empty() {
            let (state, word, waiting) = self.turn(started, waiting, &happening.events);
            if waiting.is_empty() {
                return self.commands(&state, positions, &happening.requests, &word);
            }
            let mut end = self.quiet(Some(state), positions, word);
            end.waiting = waiting;
            return vec![end];
        }
        let mut ends = Vec::new();
        let mut seen = BTreeSet::new();
        self.orders(started, &happening.events, Vec::new(), &mut seen, &mut ends);
        let longest = ends.iter().map(|(_, word)| word.len()).max().unwrap_or(0);
        if happening.events.len() <= 2 {
            ends.retain(|(_, word)| word.len() == longest);
        } else {
            ends.retain(|(_, word)| !word.is_empty() || longest == 0);
        }
        let commands = ends
            .into_iter()
            .flat_map(|(state, word)| self.commands(&state, positions, &happening.requests, &word));
        commands.collect()
    }

    /// The state after the first possible one of the events that wait and `events`, that event, and those that wait on.
    fn turn(
        &self,
        state: Box<[State]>,
        waiting: &[Label],
        events: &[Label],
    ) -> (Box<[State]>, Vec<Label>, Vec<Label>) {
        let queue = self.partition.queue();
        let mut waiting: BTreeSet<Label> = waiting.iter().chain(events).copied().collect();
        waiting.retain(|label| queue.contains(label));
        for &label in queue.iter().filter(|label| waiting.contains(label)) {
            if let Some(next) = self.step(&state, label) {
                waiting.remove(&label);
                return (next, vec![label], waiting.into_iter().collect());
            }
        }
        (state, Vec::new(), Vec::new())
    }

    /// All orders of all sets of `events` that the automata admit, with where they lead; only orders after which nothing
    /// more is possible.
    fn orders(
        &self,
        state: Box<[State]>,
        events: &[Label],
        word: Vec<Label>,
        seen: &mut BTreeSet<(Vec<Label>, Box<[State]>)>,
        ends: &mut Vec<(Box<[State]>, Vec<Label>)>,
    ) {
        let mut used = word.clone();
        used.sort_unstable();
        if !seen.insert((used, state.clone())) {
            return;
        }
        let mut is_end = true;
        for &event in events.iter().filter(|event| !word.contains(event)) {
            if let Some(next) = self.step(&state, event) {
                is_end = false;
                let longer = word.iter().copied().chain([event]).collect();
                self.orders(next, events, longer, seen, ends);
            }
        }
        if is_end || events.len() > 2 {
            ends.push((state, word));
        }
    }

    fn commands(
        &self,
        state: &[State],
        positions: &[u8],
        requests: &[Label],
        word: &[Label],
    ) -> Vec<Allowed> {
        let controllable = self.knowing.keys().filter(|label| label.is_controllable());
        let enabled: Vec<(Label, Box<[State]>)> =
            controllable.filter_map(|&label| Some((label, self.step(state, label)?))).collect();
        let asks = match self.mode {
            Mode::Automatic => false,
            Mode::Manual => self.automata.len() > 1 || enabled.len() > 1,
            Mode::Requested => true,
        };
        let mut allowed = Vec::new();
        for (label, next) in enabled {
            if asks && !requests.contains(&label) {
                continue;
            }
            let mut end = self.quiet(Some(next), positions, word.to_vec());
            end.word.push(label);
            let mut acts = true;
            match self.partition.meaning(label) {
                Some(Meaning::Switch { switch, position }) => {
                    acts = end.positions[switch] as usize != position;
                    end.positions[switch] = position as u8;
                }
                Some(Meaning::Pulse(pulse)) => end.pulse = Some(pulse),
                Some(Meaning::Input(_) | Meaning::Timer(_)) | None => {}
            }
            // A switch that is told to stay where it is has not been commanded. One automaton alone may still go on by it.
            let moves = self.automata.len() == 1 && end.state.as_deref() != Some(state);
            if acts || moves {
                allowed.push(end);
            }
        }
        if allowed.is_empty() {
            allowed.push(self.quiet(Some(state.into()), positions, word.to_vec()));
        }
        allowed
    }

    fn quiet(&self, state: Joint, positions: &[u8], word: Vec<Label>) -> Allowed {
        Allowed { state, positions: positions.into(), pulse: None, waiting: Vec::new(), word }
    }

    /// How many switches the map has.
    pub(super) fn switch_count(&self) -> usize {
        self.map.switches.len()
    }
}
