//! Continuous-time Markov chains: states, rates per hour, where it starts, and which states are failures.
//!
//! Invariant: a [`Chain`] has only positive finite rates between different states, no state that cannot be reached, and states that
//! are numbered as they were named. Failure states may be left again (a repaired system); the mean time to failure and the reliability
//! ask for the *first* failure and do not look past it.

use std::collections::HashMap;

use crate::error::ReliabilityError;
use crate::quantity::rate;

/// States of one chain, at most.
pub const MAXIMUM_STATES: usize = 4_000_000;

/// A checked chain. Rates are in compressed rows: `targets[rows[i]..rows[i + 1]]` are the successors of state i.
#[derive(Debug, Clone, PartialEq)]
pub struct Chain {
    names: Vec<String>,
    rows: Vec<usize>,
    targets: Vec<u32>,
    rates: Vec<f64>,
    failures: Vec<bool>,
    start: usize,
}

/// Collects a chain; every fault is reported at the end, all at once.
#[derive(Debug, Clone, Default)]
pub struct ChainBuilder {
    names: Vec<String>,
    failures: Vec<bool>,
    transitions: Vec<(usize, usize, f64)>,
    start: usize,
}

impl ChainBuilder {
    /// An empty chain that starts in its first state.
    pub fn new() -> Self {
        Self::default()
    }

    /// Adds a state and returns its index. Names need not be unique; an empty name is replaced by the index.
    pub fn state(&mut self, name: impl Into<String>) -> usize {
        self.names.push(name.into());
        self.failures.push(false);
        self.names.len() - 1
    }

    /// Adds a state in which the system has failed.
    pub fn failure(&mut self, name: impl Into<String>) -> usize {
        let place = self.state(name);
        self.failures[place] = true;
        place
    }

    /// Adds a transition of `per_hour`; rates between the same two states add up.
    pub fn transition(&mut self, from: usize, to: usize, per_hour: f64) -> &mut Self {
        self.transitions.push((from, to, per_hour));
        self
    }

    /// Starts in this state instead of the first.
    pub fn start(&mut self, state: usize) -> &mut Self {
        self.start = state;
        self
    }

    /// The chain.
    ///
    /// # Errors
    /// Every fault: rates that are not positive and finite, states that are not there, loops from a state to itself, states that
    /// cannot be reached (one is named), too many states.
    pub fn build(self) -> Result<Chain, Vec<ReliabilityError>> {
        let states = self.names.len();
        if states > MAXIMUM_STATES {
            return Err(vec![ReliabilityError::TooManyStates {
                maximum: MAXIMUM_STATES,
            }]);
        }
        let mut errors = Vec::new();
        if self.start >= states {
            errors.push(ReliabilityError::NoSuchState {
                place: self.start,
                states,
            });
        }
        for &(from, to, per_hour) in &self.transitions {
            if let Some(&place) = [from, to].iter().find(|place| **place >= states) {
                errors.push(ReliabilityError::NoSuchState { place, states });
                continue;
            }
            let name = |place| state_name(&self.names, place);
            if from == to {
                errors.push(ReliabilityError::SelfLoop { state: name(from) });
            }
            if let Err(error) = rate(
                &format!("the rate {} -> {}", name(from), name(to)),
                per_hour,
            ) {
                errors.push(error);
            }
        }
        if !errors.is_empty() {
            return Err(errors);
        }
        let chain =
            Chain::from_transitions(self.names, self.failures, self.start, self.transitions);
        let level = chain.levels();
        match level.iter().position(|level| *level == u32::MAX) {
            Some(place) => Err(vec![ReliabilityError::Unreachable {
                state: chain.name(place),
            }]),
            None => Ok(chain),
        }
    }
}

fn state_name(names: &[String], place: usize) -> String {
    match names.get(place) {
        Some(name) if !name.is_empty() => name.clone(),
        _ => format!("#{place}"),
    }
}

impl Chain {
    fn from_transitions(
        names: Vec<String>,
        failures: Vec<bool>,
        start: usize,
        mut transitions: Vec<(usize, usize, f64)>,
    ) -> Self {
        transitions.sort_by_key(|&(from, to, _)| (from, to));
        transitions.dedup_by(|next, kept| {
            let same = (next.0, next.1) == (kept.0, kept.1);
            if same {
                kept.2 += next.2;
            }
            same
        });
        let mut rows = vec![0; names.len() + 1];
        for &(from, _, _) in &transitions {
            rows[from + 1] += 1;
        }
        for place in 0..names.len() {
            rows[place + 1] += rows[place];
        }
        Self {
            names,
            rows,
            targets: transitions.iter().map(|&(_, to, _)| to as u32).collect(),
            rates: transitions.iter().map(|&(_, _, rate)| rate).collect(),
            failures,
            start,
        }
    }

    /// Number of states.
    pub fn states(&self) -> usize {
        self.failures.len()
    }

    /// The name of a state, or its place where it has none.
    pub fn name(&self, place: usize) -> String {
        state_name(&self.names, place)
    }

    /// The state in which the chain starts.
    pub fn start(&self) -> usize {
        self.start
    }

    /// Whether a state is a failure.
    pub fn is_failure(&self, place: usize) -> bool {
        self.failures[place]
    }

    /// Successors of a state and the rates per hour.
    pub fn successors(&self, place: usize) -> impl Iterator<Item = (usize, f64)> + '_ {
        let row = self.rows[place]..self.rows[place + 1];
        let targets = self.targets[row.clone()].iter();
        targets
            .map(|target| *target as usize)
            .zip(self.rates[row].iter().copied())
    }

    /// Rate of leaving a state, per hour.
    pub fn leaving(&self, place: usize) -> f64 {
        self.rates[self.rows[place]..self.rows[place + 1]]
            .iter()
            .sum()
    }

    /// Steps from the start to each state; `u32::MAX` where it cannot be reached.
    pub(crate) fn levels(&self) -> Vec<u32> {
        let mut level = vec![u32::MAX; self.states()];
        let mut queue = vec![self.start];
        level[self.start] = 0;
        let mut next = 0;
        while let Some(&state) = queue.get(next) {
            next += 1;
            for (to, _) in self.successors(state) {
                if level[to] == u32::MAX {
                    level[to] = level[state] + 1;
                    queue.push(to);
                }
            }
        }
        level
    }

    /// Fails where some state that is reached before any failure cannot come to one.
    ///
    /// # Errors
    /// No failure state, or a state from which none can be reached.
    pub(crate) fn check_fails(&self) -> Result<(), ReliabilityError> {
        if !self.failures.contains(&true) {
            return Err(ReliabilityError::NoFailureState);
        }
        let alive = self.alive();
        let mut sources: Vec<Vec<u32>> = vec![Vec::new(); self.states()];
        let mut doomed: Vec<usize> = Vec::new();
        let mut reaches = vec![false; self.states()];
        for &state in &alive {
            for (to, _) in self.successors(state) {
                if self.failures[to] {
                    if !reaches[state] {
                        reaches[state] = true;
                        doomed.push(state);
                    }
                } else {
                    sources[to].push(state as u32);
                }
            }
        }
        while let Some(state) = doomed.pop() {
            for &source in &sources[state] {
                if !std::mem::replace(&mut reaches[source as usize], true) {
                    doomed.push(source as usize);
                }
            }
        }
        match alive.iter().find(|state| !reaches[**state]) {
            Some(&state) => Err(ReliabilityError::NeverFails {
                state: self.name(state),
            }),
            None => Ok(()),
        }
    }

    /// States that can be reached before any failure, in the order in which they are found; the start is the first.
    pub(crate) fn alive(&self) -> Vec<usize> {
        let mut seen = vec![false; self.states()];
        let mut found = Vec::new();
        if !self.failures[self.start] {
            seen[self.start] = true;
            found.push(self.start);
        }
        let mut next = 0;
        while let Some(&state) = found.get(next) {
            next += 1;
            for (to, _) in self.successors(state) {
                if !self.failures[to] && !std::mem::replace(&mut seen[to], true) {
                    found.push(to);
                }
            }
        }
        found
    }
}

/// Makes a chain by following transitions from a first state, so that only states that occur are made. `successors` gives, for a
/// state, the next one (nothing: the failure) and the rate of going there.
///
/// # Errors
/// More than `maximum` states, or whatever [`ChainBuilder::build`] finds.
pub(crate) fn explore<State: Clone + Eq + std::hash::Hash>(
    first: State,
    maximum: usize,
    name: impl Fn(&State) -> String,
    mut successors: impl FnMut(&State, &mut Vec<(Option<State>, f64)>),
) -> Result<(Chain, Vec<State>), Vec<ReliabilityError>> {
    let mut builder = ChainBuilder::new();
    let mut places: HashMap<State, usize> = HashMap::new();
    let mut states = vec![first.clone()];
    places.insert(first, 0);
    let mut transitions = Vec::new();
    let mut failures = Vec::new();
    let mut found = Vec::new();
    let mut next = 0;
    while next < states.len() {
        found.clear();
        successors(&states[next].clone(), &mut found);
        for (to, per_hour) in found.drain(..) {
            match to {
                None => failures.push((next, per_hour)),
                Some(to) => {
                    let place = *places.entry(to).or_insert_with_key(|state| {
                        states.push(state.clone());
                        states.len() - 1
                    });
                    transitions.push((next, place, per_hour));
                }
            }
        }
        next += 1;
        if states.len() > maximum {
            return Err(vec![ReliabilityError::TooManyStates { maximum }]);
        }
    }
    for state in &states {
        builder.state(name(state));
    }
    for (from, to, per_hour) in transitions {
        builder.transition(from, to, per_hour);
    }
    if !failures.is_empty() {
        let failed = builder.failure("failed");
        for (from, per_hour) in failures {
            builder.transition(from, failed, per_hour);
        }
    }
    Ok((builder.build()?, states))
}
