//! Continuous-time Markov chains: states, rates per hour, where it starts, and which states are failures.
//!
//! Invariant: a [`Chain`] has only positive finite rates between different states, no state that cannot be reached, and states that
//! are numbered as they were named. Failure states may be left again (a repaired system); the mean time to failure and the reliability
//! ask for the *first* failure and do not look past it.

use std::collections::HashMap;

use crate::error::ReliabilityError;
use crate::quantity::{is_rate, rate};

/// States of one chain, at most.
pub const MAXIMUM_STATES: usize = 4_000_000;

/// A checked chain. Rates are in compressed rows: `targets[rows[i]..rows[i + 1]]` are the successors of state i.
#[derive(Debug, Clone, PartialEq)]
pub struct Chain {
    names: Names,
    rows: Vec<usize>,
    targets: Vec<u32>,
    rates: Vec<f64>,
    failures: Vec<bool>,
    start: usize,
}

/// Collects a chain; every fault is reported at the end, all at once.
#[derive(Debug, Clone, Default)]
pub struct ChainBuilder {
    names: Names,
    failures: Vec<bool>,
    transitions: Vec<Transition>,
    start: usize,
}

/// From a state to a state, with a rate per hour.
type Transition = (u32, u32, f64);

/// Names of states, one behind the other.
#[derive(Debug, Clone, Default, PartialEq)]
struct Names {
    text: String,
    ends: Vec<usize>,
}

impl Names {
    fn push(&mut self, name: &str) {
        self.text.push_str(name);
        self.ends.push(self.text.len());
    }

    /// The name of a state; its place where it has none.
    fn shown(&self, place: usize) -> String {
        let start = place.checked_sub(1).map_or(0, |before| self.ends[before]);
        match &self.text[start..self.ends[place]] {
            "" => format!("#{place}"),
            name => name.to_owned(),
        }
    }
}

/// For each state the states from which a transition leads to it, in compressed rows.
pub(crate) struct Sources {
    rows: Vec<usize>,
    sources: Vec<u32>,
}

impl Sources {
    /// `transitions` are pairs of places, the same ones each time.
    pub(crate) fn new<Pairs: Iterator<Item = (usize, usize)>>(
        states: usize,
        transitions: impl Fn() -> Pairs,
    ) -> Self {
        let mut rows = vec![0; states + 1];
        for (_, to) in transitions() {
            rows[to + 1] += 1;
        }
        add_up(&mut rows);
        let mut next = rows.clone();
        let mut sources = vec![0; rows[states]];
        for (from, to) in transitions() {
            sources[next[to]] = from as u32;
            next[to] += 1;
        }
        Self { rows, sources }
    }

    pub(crate) fn of(&self, place: usize) -> impl Iterator<Item = usize> + '_ {
        let row = &self.sources[self.rows[place]..self.rows[place + 1]];
        row.iter().map(|source| *source as usize)
    }
}

/// Where rows begin, from the number of entries of each in the place behind it.
fn add_up(rows: &mut [usize]) {
    for place in 1..rows.len() {
        rows[place] += rows[place - 1];
    }
}

impl ChainBuilder {
    /// An empty chain that starts in its first state.
    pub fn new() -> Self {
        Self::default()
    }

    /// Adds a state and returns its index. Names need not be unique; an empty name is replaced by the index.
    pub fn state(&mut self, name: impl AsRef<str>) -> usize {
        self.names.push(name.as_ref());
        self.failures.push(false);
        self.failures.len() - 1
    }

    /// Adds a state in which the system has failed.
    pub fn failure(&mut self, name: impl AsRef<str>) -> usize {
        let place = self.state(name);
        self.fails(place);
        place
    }

    /// Makes a state of this builder a failure.
    pub(crate) fn fails(&mut self, place: usize) {
        self.failures[place] = true;
    }

    /// Room for this number of transitions.
    pub(crate) fn reserve(&mut self, transitions: usize) {
        self.transitions.reserve_exact(transitions);
    }

    /// Adds a transition of `per_hour`; rates between the same two states add up.
    pub fn transition(&mut self, from: usize, to: usize, per_hour: f64) -> &mut Self {
        // More states than this cannot be, and such a place is refused at the end.
        let place = |place| u32::try_from(place).unwrap_or(u32::MAX);
        self.transitions.push((place(from), place(to), per_hour));
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
        let states = self.failures.len();
        if states > MAXIMUM_STATES {
            return Err(vec![ReliabilityError::TooManyStates { maximum: MAXIMUM_STATES }]);
        }
        let mut errors = Vec::new();
        if self.start >= states {
            errors.push(ReliabilityError::NoSuchState { place: self.start, states });
        }
        for &(from, to, per_hour) in &self.transitions {
            let (from, to) = (from as usize, to as usize);
            if let Some(&place) = [from, to].iter().find(|place| **place >= states) {
                errors.push(ReliabilityError::NoSuchState { place, states });
                continue;
            }
            if from == to {
                let state = self.names.shown(from);
                errors.push(ReliabilityError::SelfLoop { state });
            }
            if !is_rate(per_hour) {
                let (from, to) = (self.names.shown(from), self.names.shown(to));
                errors.extend(rate(&format!("the rate {from} -> {to}"), per_hour).err());
            }
        }
        if !errors.is_empty() {
            return Err(errors);
        }
        let chain =
            Chain::from_transitions(self.names, self.failures, self.start, self.transitions);
        let level = chain.levels();
        match level.iter().position(|level| *level == u32::MAX) {
            Some(place) => Err(vec![ReliabilityError::Unreachable { state: chain.name(place) }]),
            None => Ok(chain),
        }
    }
}

impl Chain {
    fn from_transitions(
        names: Names,
        failures: Vec<bool>,
        start: usize,
        transitions: Vec<Transition>,
    ) -> Self {
        let mut rows = vec![0; failures.len() + 1];
        for &(from, _, _) in &transitions {
            rows[from as usize + 1] += 1;
        }
        add_up(&mut rows);
        let mut next = rows.clone();
        let mut targets = vec![0; transitions.len()];
        let mut rates = vec![0.0; transitions.len()];
        for (from, to, rate) in transitions {
            let place = &mut next[from as usize];
            (targets[*place], rates[*place]) = (to, rate);
            *place += 1;
        }
        let mut chain = Self { names, rows, targets, rates, failures, start };
        chain.sort_rows();
        chain
    }

    /// Orders each row by its targets, and adds up rates between the same two states.
    fn sort_rows(&mut self) {
        let mut row: Vec<(u32, f64)> = Vec::new();
        let (mut first, mut kept) = (0, 0);
        for place in 0..self.failures.len() {
            let end = self.rows[place + 1];
            row.clear();
            row.extend((first..end).map(|entry| (self.targets[entry], self.rates[entry])));
            row.sort_by_key(|&(to, _)| to);
            row.dedup_by(|next, before| {
                let same = next.0 == before.0;
                if same {
                    before.1 += next.1;
                }
                same
            });
            for &(to, rate) in &row {
                (self.targets[kept], self.rates[kept]) = (to, rate);
                kept += 1;
            }
            first = end;
            self.rows[place + 1] = kept;
        }
        self.targets.truncate(kept);
        self.rates.truncate(kept);
    }

    /// Number of states.
    pub fn states(&self) -> usize {
        self.failures.len()
    }

    /// The name of a state, or its place where it has none.
    pub fn name(&self, place: usize) -> String {
        self.names.shown(place)
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
        targets.map(|target| *target as usize).zip(self.rates[row].iter().copied())
    }

    /// Rate of leaving a state, per hour.
    pub fn leaving(&self, place: usize) -> f64 {
        self.rates[self.rows[place]..self.rows[place + 1]].iter().sum()
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
        let sources = Sources::new(self.states(), || {
            let leaving = |&state: &usize| self.successors(state).map(move |(to, _)| (state, to));
            alive.iter().flat_map(leaving)
        });
        let mut doomed: Vec<usize> =
            (0..self.states()).filter(|state| self.failures[*state]).collect();
        let mut reaches = self.failures.clone();
        while let Some(state) = doomed.pop() {
            for source in sources.of(state) {
                if !std::mem::replace(&mut reaches[source], true) {
                    doomed.push(source);
                }
            }
        }
        match alive.iter().find(|state| !reaches[**state]) {
            Some(&state) => Err(ReliabilityError::NeverFails { state: self.name(state) }),
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
