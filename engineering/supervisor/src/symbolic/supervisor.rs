//! The supremal controllable and nonblocking supervisor as a set of states.

use std::collections::HashMap;

use understudy_logic::bdd::{BddError, Diagram};

use super::order::force;
use super::saturation::{Moves, Saturation, predecessors};
use super::space::Space;
use super::{SymbolicBounds, TooComplex};
use crate::alphabet::{Alphabet, Label};
use crate::automaton::{Automaton, Edge, State};
use crate::explicit::{Bounds, TooLarge};

/// A supervisor that is not listed but asked.
pub struct SymbolicSupervisor<'a> {
    pub(super) parts: Vec<&'a Automaton>,
    pub(super) alphabet: Alphabet,
    pub(super) space: Space,
    /// The component on each level.
    pub(super) order: Vec<usize>,
    /// By the place of the event in the alphabet.
    pub(super) events: Vec<Moves>,
    states: Diagram,
    /// Tuples that are not good by themselves: where a specification is violated, or from which no marked one is reached.
    pub(super) causes: Diagram,
    pub(super) bounds: SymbolicBounds,
}

/// What the supervisor says about an event.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Verdict {
    /// It may happen.
    Enabled,
    /// The plant could do it, and the supervisor or a specification forbids it.
    Disabled,
    /// The plant cannot do it now.
    Impossible,
}

/// Synthesis as [`synthesise`](crate::synthesise) does it, on sets: the sync of `plants` under all `specifications`, each restraining
/// only what it knows.
///
/// # Errors
/// The diagrams pass the bounds.
pub fn synthesise_symbolically<'a>(
    plants: &[&'a Automaton],
    specifications: &[&'a Automaton],
    bounds: SymbolicBounds,
) -> Result<SymbolicSupervisor<'a>, TooComplex> {
    let made = SymbolicSupervisor::make(plants, specifications, bounds);
    made.map_err(|error| TooComplex::of(&error, bounds))
}

/// Whether from everything that `automata` reach together a state can be reached in which all are marked; as
/// [`nonconflict`](crate::operations::nonconflict) says it, and without the word.
///
/// # Errors
/// The diagrams pass the bounds.
pub fn nonconflicting_symbolically(
    automata: &[&Automaton],
    bounds: SymbolicBounds,
) -> Result<bool, TooComplex> {
    let decide = || {
        let made = SymbolicSupervisor::prepare(automata, bounds)?;
        if automata.iter().any(|part| part.is_empty()) {
            return Ok(true);
        }
        let tuples = made.space.tuples()?;
        let reached = made.reached_within(&tuples)?;
        Ok(reached == made.live_within(&reached)?)
    };
    decide().map_err(|error| TooComplex::of(&error, bounds))
}

impl<'a> SymbolicSupervisor<'a> {
    fn make(
        plants: &[&'a Automaton],
        specifications: &[&'a Automaton],
        bounds: SymbolicBounds,
    ) -> Result<Self, BddError> {
        let parts: Vec<&Automaton> = plants.iter().chain(specifications).copied().collect();
        let mut made = Self::prepare(&parts, bounds)?;
        if made.parts.iter().all(|part| !part.is_empty()) {
            (made.states, made.causes) = made.fixed_point(plants.len())?;
        }
        Ok(made)
    }

    /// The space and the events of `parts`, and no states yet.
    fn prepare(parts: &[&'a Automaton], bounds: SymbolicBounds) -> Result<Self, BddError> {
        let parts: Vec<&Automaton> = parts.to_vec();
        let alphabet = Alphabet::new([]).union(parts.iter().map(|part| part.alphabet()));
        let order = force(&parts);
        // A level has at least one state; the set of states of an empty component is empty below.
        let sizes: Vec<usize> =
            order.iter().map(|&part| parts[part].state_count().max(1)).collect();
        let space = Space::new(&sizes, bounds.nodes)?;
        let events = alphabet.labels().map(|label| moves(&parts, &order, label)).collect();
        let (states, causes) = (space.nothing(), space.nothing());
        Ok(Self { parts, alphabet, space, order, events, states, causes, bounds })
    }

    /// What is reached from the initial tuple within `within`.
    fn reached_within(&self, within: &Diagram) -> Result<Diagram, BddError> {
        let initial = self.each_level(|_, state| state == 0)?;
        let initial = self.space.and(&initial, within)?;
        Saturation::new(&self.space, self.events.clone()).closure(&initial, within)
    }

    /// From where a marked tuple can be reached within `within`.
    fn live_within(&self, within: &Diagram) -> Result<Diagram, BddError> {
        let marked = self.each_level(|part, state| part.is_marked(State::new(state)))?;
        let marked = self.space.and(&marked, within)?;
        Saturation::new(&self.space, self.reversed(|_| true)).closure(&marked, within)
    }

    /// What is good and reached, and the causes of all that is not.
    fn fixed_point(&self, plants: usize) -> Result<(Diagram, Diagram), BddError> {
        let space = &self.space;
        let tuples = space.tuples()?;
        let violated = self.violated(plants)?;
        let violated = space.and(&violated, &tuples)?;
        let mut causes = violated.clone();
        let mut bad = self.uncontrollably_backwards().closure(&violated, &tuples)?;
        loop {
            let good = space.without(&tuples, &bad)?;
            let reached = self.reached_within(&good)?;
            let live = self.live_within(&reached)?;
            let blocked = space.without(&reached, &live)?;
            // Each round removes at least one state.
            if blocked.is_constant(false) {
                return Ok((reached, causes));
            }
            causes = space.or(&causes, &blocked)?;
            let mut drawn = self.uncontrollably_backwards();
            bad = space.or(&bad, &drawn.closure(&blocked, &reached)?)?;
        }
    }

    /// The tuples that are on every level as `holds` asks.
    fn each_level(&self, holds: impl Fn(&Automaton, u32) -> bool) -> Result<Diagram, BddError> {
        let levels = 0..self.space.levels();
        levels.rev().try_fold(self.space.everything(), |all, level| {
            let part = self.parts[self.order[level]];
            let local = self.space.where_local(level, |state| holds(part, state))?;
            self.space.and(&local, &all)
        })
    }

    /// Where the plants enable an uncontrollable event that a specification forbids.
    fn violated(&self, plants: usize) -> Result<Diagram, BddError> {
        let space = &self.space;
        let mut violated = space.nothing();
        for (event, label) in self.alphabet.labels().enumerate() {
            if label.is_controllable() {
                continue;
            }
            let mut by_plants = space.everything();
            let mut by_all = space.everything();
            for (level, pairs) in self.events[event].levels.iter().rev() {
                let enables = |state| pairs.iter().any(|&(from, _)| from == state);
                let local = space.where_local(*level, enables)?;
                by_all = space.and(&local, &by_all)?;
                if self.order[*level] < plants {
                    by_plants = space.and(&local, &by_plants)?;
                }
            }
            let forbidden = space.without(&by_plants, &by_all)?;
            violated = space.or(&violated, &forbidden)?;
        }
        Ok(violated)
    }

    fn uncontrollably_backwards(&self) -> Saturation<'_> {
        Saturation::new(&self.space, self.reversed(|label| !label.is_controllable()))
    }

    fn reversed(&self, wanted: impl Fn(Label) -> bool) -> Vec<Moves> {
        let labelled = self.alphabet.labels().zip(&self.events);
        let wanted = labelled.filter(|(label, _)| wanted(*label));
        wanted.map(|(_, moves)| moves.reversed()).collect()
    }

    /// Whether there is no supervisor.
    pub fn is_empty(&self) -> bool {
        self.states.is_constant(false)
    }

    /// How many states it has; `None` past 2^128.
    pub fn state_count(&self) -> Option<u128> {
        self.space.count(&self.states)
    }

    /// How many transitions it has; `None` past 2^128.
    ///
    /// # Errors
    /// The diagrams pass the bounds.
    pub fn transition_count(&self) -> Result<Option<u128>, TooComplex> {
        let mut sum = Some(0_u128);
        for event in &self.events {
            let sources = predecessors(&self.space, event, &self.states)
                .and_then(|sources| self.space.and(&sources, &self.states))
                .map_err(|error| TooComplex::of(&error, self.bounds))?;
            let count = self.space.count(&sources);
            sum = sum.zip(count).and_then(|(sum, count)| sum.checked_add(count));
        }
        Ok(sum)
    }

    /// Nodes of the diagram of its states.
    pub fn node_count(&self) -> usize {
        self.states.node_count()
    }

    /// The events of all its components.
    pub fn alphabet(&self) -> &Alphabet {
        &self.alphabet
    }

    /// The tuple of initial states: plants first, then specifications, in the order in which they were given.
    pub fn initial(&self) -> Option<Vec<State>> {
        (!self.is_empty()).then(|| vec![State::INITIAL; self.parts.len()])
    }

    /// Whether a tuple is one of its states.
    pub fn contains(&self, states: &[State]) -> bool {
        self.space.contains(&self.states, |level| states[self.order[level]].number())
    }

    /// Where `event` leads from the tuple `states`, if all components allow it.
    pub fn next(&self, states: &[State], event: Label) -> Option<Vec<State>> {
        let moved = self.parts.iter().zip(states).map(|(part, &state)| {
            if part.alphabet().contains(event) { part.step(state, event) } else { Some(state) }
        });
        self.alphabet.contains(event).then(|| moved.collect())?
    }

    /// Decision of the supervisor on `event` in the tuple `states`; the first `plants` components are plants.
    pub fn verdict(&self, states: &[State], event: Label, plants: usize) -> Verdict {
        let knows = |part: &Automaton| part.alphabet().contains(event);
        let mut of_plants = self.parts.iter().zip(states).take(plants);
        if !of_plants.all(|(part, &state)| !knows(part) || part.step(state, event).is_some()) {
            return Verdict::Impossible;
        }
        match self.next(states, event) {
            Some(next) if self.contains(&next) => Verdict::Enabled,
            _ => Verdict::Disabled,
        }
    }

    /// All its states and transitions, where they can be listed after all.
    ///
    /// # Errors
    /// They cannot.
    pub fn to_automaton(&self, bounds: Bounds) -> Result<Automaton, TooLarge> {
        let mut numbers: HashMap<Vec<State>, u32> = HashMap::new();
        let mut tuples: Vec<Vec<State>> = self.initial().into_iter().collect();
        numbers.extend(tuples.first().map(|initial| (initial.clone(), 0)));
        let mut first = vec![0];
        let mut edges = Vec::new();
        let mut at = 0;
        while at < tuples.len() {
            for (event, label) in self.alphabet.labels().enumerate() {
                let next = self.next(&tuples[at], label).filter(|next| self.contains(next));
                let Some(next) = next else { continue };
                let number = *numbers.entry(next).or_insert_with_key(|next| {
                    tuples.push(next.clone());
                    tuples.len() as u32 - 1
                });
                edges.push(Edge { event: event as u32, target: State::new(number) });
            }
            first.push(edges.len() as u32);
            at += 1;
            let state_bytes = 2 * self.parts.len() * size_of::<State>() + 100;
            if tuples.len() * state_bytes + edges.len() * 12 > bounds.memory_bytes {
                return Err(TooLarge::Memory {
                    states: tuples.len(),
                    transitions: edges.len(),
                    memory_bytes: bounds.memory_bytes,
                });
            }
        }
        let all_marked = |tuple: &Vec<State>| {
            self.parts.iter().zip(tuple).all(|(part, &state)| part.is_marked(state))
        };
        let marked = tuples.iter().map(all_marked).collect();
        let alphabet = self.alphabet.clone();
        Ok(Automaton::from_parts("SUPER".to_owned(), alphabet, marked, first, edges))
    }
}

/// How `label` moves the components that know it, by level.
fn moves(parts: &[&Automaton], order: &[usize], label: Label) -> Moves {
    let knowing = order.iter().enumerate();
    let knowing = knowing.filter_map(|(level, &part)| {
        let event = parts[part].alphabet().place(label)?;
        let pairs = parts[part].states().filter_map(|state| {
            let target = parts[part].successor(state, event)?;
            Some((state.number(), target.number()))
        });
        Some((level, pairs.collect()))
    });
    Moves { levels: knowing.collect() }
}
