//! Automata: deterministic generators G = (Q, Σ, δ, q0, Qm), as Ramadge and Wonham have them.
//!
//! The states are 0, 1, ...; state 0 is the initial one, as in TCT. An automaton without states is TCT's EMPTY, and a legal
//! result everywhere. The transitions lie in one array, ordered by source and then by label, 8 bytes each; so from every
//! state there is at most one transition of a label, and what leaves a state is a slice.

use std::borrow::Cow;
use std::fmt;
use std::sync::Arc;

use understudy_text::spelling;

use crate::alphabet::{Alphabet, Event, Label};

/// A state, by its number.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct State(u32);

impl State {
    /// The initial state of every automaton that has one.
    pub const INITIAL: Self = Self(0);

    /// The state number `number`.
    pub const fn new(number: u32) -> Self {
        Self(number)
    }

    /// Its number.
    pub const fn number(self) -> u32 {
        self.0
    }

    /// Its number, for indexing.
    pub const fn index(self) -> usize {
        self.0 as usize
    }
}

impl fmt::Display for State {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.fmt(formatter)
    }
}

/// What leaves a state.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Edge {
    /// The place of its event in the automaton's alphabet.
    pub event: u32,
    /// Where it leads.
    pub target: State,
}

/// A transition, TCT's triple [exit state, label, entrance state].
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Transition {
    /// The exit state.
    pub source: State,
    /// Its event.
    pub label: Label,
    /// The entrance state.
    pub target: State,
}

/// Why states and transitions do not make an automaton.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum AutomatonError {
    /// A state that does not exist.
    #[error("U0801: there is no state {state}: the automaton has {states} states, 0 the first")]
    NoSuchState {
        /// The state that was named.
        state: State,
        /// How many there are.
        states: usize,
    },
    /// Two transitions of one label leave one state for different ones.
    #[error(
        "U0802: from state {source_state} event {label} leads to state {first} and to state {second}; an automaton must be deterministic"
    )]
    Nondeterministic {
        /// The exit state.
        source_state: State,
        /// The event.
        label: Label,
        /// One entrance state.
        first: State,
        /// The other one.
        second: State,
    },
    /// More states or transitions than numbers for them.
    #[error("U0803: {count} states or transitions are more than the {limit} that can be numbered")]
    TooLarge {
        /// How many were given.
        count: usize,
        /// How many are possible.
        limit: usize,
    },
    /// An event that is not in the alphabet.
    #[error("U0809: {automaton} has no event `{event}`{hint}")]
    NoSuchEvent {
        /// The name or the number that was given.
        event: String,
        /// The automaton.
        automaton: String,
        /// The nearest name, as a question, or nothing.
        hint: String,
    },
    /// A list of state names that does not fit the states.
    #[error("U0804: {names} names for {states} states")]
    NamesDoNotFit {
        /// How many names were given.
        names: usize,
        /// How many states there are.
        states: usize,
    },
}

impl AutomatonError {
    /// Stable code for people.
    pub fn code(&self) -> &'static str {
        match self {
            Self::NoSuchState { .. } => "U0801",
            Self::Nondeterministic { .. } => "U0802",
            Self::TooLarge { .. } => "U0803",
            Self::NamesDoNotFit { .. } => "U0804",
            Self::NoSuchEvent { .. } => "U0809",
        }
    }
}

/// The parts of an automaton whose states have names, the initial one anywhere among them.
pub(crate) struct Named {
    pub(crate) name: String,
    pub(crate) events: Vec<Event>,
    pub(crate) states: Vec<String>,
    pub(crate) initial: usize,
    pub(crate) marked: Vec<bool>,
    pub(crate) transitions: Vec<Transition>,
}

impl Named {
    /// The automaton, with the initial state as state 0. `number` is the name that an unnamed state has in the format: where all
    /// states have these, they have no names.
    ///
    /// # Errors
    /// As of [`Automaton::new`].
    pub(crate) fn automaton(
        mut self,
        number: impl Fn(usize) -> String,
    ) -> Result<Automaton, AutomatonError> {
        let initial = self.initial as u32;
        let swap = |state: State| match state.number() {
            0 => State::new(initial),
            number if number == initial => State::INITIAL,
            _ => state,
        };
        for transition in &mut self.transitions {
            transition.source = swap(transition.source);
            transition.target = swap(transition.target);
        }
        self.states.swap(0, self.initial);
        self.marked.swap(0, self.initial);
        let has_names = self.states.iter().enumerate().any(|(place, name)| *name != number(place));
        let automaton = Automaton::new(self.name, self.events, self.marked, self.transitions)?;
        Ok(if has_names { automaton.named_states(self.states) } else { automaton })
    }
}

/// A deterministic automaton. Two are equal when they have the same states, alphabet and transitions under the same
/// numbers and names; whether they are the same but for the numbers says `isomorph`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Automaton {
    name: String,
    alphabet: Alphabet,
    marked: Vec<bool>,
    /// `edges[first[q]..first[q + 1]]` leave q; one longer than there are states.
    first: Vec<u32>,
    edges: Vec<Edge>,
    state_names: Option<Arc<[String]>>,
}

impl Automaton {
    /// An automaton of `marked.len()` states, 0 the initial one. Labels of `transitions` that `events` lacks are added; a
    /// transition that is given twice counts once. This is TCT's `create`.
    ///
    /// # Errors
    /// A transition between states that do not exist, nondeterminism, or too many of anything.
    pub fn new(
        name: impl Into<String>,
        events: impl IntoIterator<Item = Event>,
        marked: Vec<bool>,
        mut transitions: Vec<Transition>,
    ) -> Result<Self, AutomatonError> {
        let limit = u32::MAX as usize;
        let count = marked.len().max(transitions.len());
        if count >= limit {
            return Err(AutomatonError::TooLarge { count, limit });
        }
        let states = marked.len();
        let ends = transitions.iter().flat_map(|transition| [transition.source, transition.target]);
        if let Some(state) = ends.into_iter().find(|state| state.index() >= states) {
            return Err(AutomatonError::NoSuchState { state, states });
        }
        transitions.sort_unstable();
        transitions.dedup();
        let clash = transitions
            .windows(2)
            .find(|pair| (pair[0].source, pair[0].label) == (pair[1].source, pair[1].label));
        if let Some(pair) = clash {
            return Err(AutomatonError::Nondeterministic {
                source_state: pair[0].source,
                label: pair[0].label,
                first: pair[0].target,
                second: pair[1].target,
            });
        }
        let mut used: Vec<Label> = transitions.iter().map(|transition| transition.label).collect();
        used.sort_unstable();
        used.dedup();
        let used = used.into_iter().map(Event::unnamed);
        let alphabet = Alphabet::new(events.into_iter().chain(used));
        let mut first = Vec::with_capacity(states + 1);
        let mut edges = Vec::with_capacity(transitions.len());
        first.push(0);
        let mut rest = transitions.as_slice();
        for state in 0..states {
            let leaving = rest.partition_point(|transition| transition.source.index() <= state);
            let (here, later) = rest.split_at(leaving);
            edges.extend(here.iter().filter_map(|transition| {
                let event = alphabet.place(transition.label)?;
                Some(Edge { event, target: transition.target })
            }));
            first.push(edges.len() as u32);
            rest = later;
        }
        Ok(Self::from_parts(name.into(), alphabet, marked, first, edges))
    }

    /// The same with another label for each event, in the order of its alphabet.
    pub(crate) fn relabelled(&self, events: Vec<Event>) -> Self {
        let transitions = self.states().flat_map(|source| {
            let of = |edge: &Edge| Transition {
                source,
                label: events[edge.event as usize].label,
                target: edge.target,
            };
            self.edges(source).iter().map(of).collect::<Vec<_>>()
        });
        let transitions: Vec<Transition> = transitions.collect();
        let made = Self::new(self.name.clone(), events, self.marked.clone(), transitions);
        // The caller knows that the labels are different ones.
        let mut made = made.unwrap_or_else(|_| self.clone());
        made.state_names.clone_from(&self.state_names);
        made
    }

    /// TCT's EMPTY: no state, and the alphabet of what was asked for.
    pub fn empty(name: impl Into<String>, alphabet: Alphabet) -> Self {
        Self::from_parts(name.into(), alphabet, Vec::new(), vec![0], Vec::new())
    }

    /// The caller has ordered `edges` and knows that they are deterministic.
    pub(crate) fn from_parts(
        name: String,
        alphabet: Alphabet,
        marked: Vec<bool>,
        first: Vec<u32>,
        edges: Vec<Edge>,
    ) -> Self {
        debug_assert_eq!(first.len(), marked.len() + 1);
        debug_assert_eq!(first.last().copied(), Some(edges.len() as u32));
        Self { name, alphabet, marked, first, edges, state_names: None }
    }

    /// The caller knows that there is a name for each state.
    pub(crate) fn named_states(mut self, names: Vec<String>) -> Self {
        debug_assert_eq!(names.len(), self.state_count());
        self.state_names = Some(names.into());
        self
    }

    /// `first` and `edges`: what leaves state q is `edges[first[q]..first[q + 1]]`.
    pub(crate) fn arrays(&self) -> (&[u32], &[Edge]) {
        (&self.first, &self.edges)
    }

    /// The same under another name.
    #[must_use]
    pub fn with_name(mut self, name: impl Into<String>) -> Self {
        self.name = name.into();
        self
    }

    /// The same with names for its states, one each.
    ///
    /// # Errors
    /// More or fewer names than states.
    pub fn with_state_names(mut self, names: Vec<String>) -> Result<Self, AutomatonError> {
        if names.len() != self.state_count() {
            return Err(AutomatonError::NamesDoNotFit {
                names: names.len(),
                states: self.state_count(),
            });
        }
        self.state_names = Some(names.into());
        Ok(self)
    }

    /// The same with the event names that `names` has for its labels.
    #[must_use]
    pub fn with_event_names(mut self, names: &Alphabet) -> Self {
        let renamed = self.alphabet.events().iter().map(|event| Event {
            label: event.label,
            name: names
                .place(event.label)
                .map_or_else(|| event.name.clone(), |place| names.event(place).name.clone()),
        });
        self.alphabet = Alphabet::new(renamed);
        self
    }

    /// Its name.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The event of that name or number.
    ///
    /// # Errors
    /// U0809: there is none in its alphabet.
    pub fn event(&self, name: &str) -> Result<Label, AutomatonError> {
        let events = self.alphabet.events();
        let number = name.parse().map(Label::new);
        let labels = number.into_iter().filter(|label| self.alphabet.contains(*label));
        let mut named = events.iter().filter(|event| event.name == name).map(|event| event.label);
        named.next().or_else(|| labels.into_iter().next()).ok_or_else(|| {
            let names = events.iter().map(|event| event.name.as_str());
            let hint = spelling::question(name, names).map(|hint| format!(": {hint}"));
            AutomatonError::NoSuchEvent {
                event: name.to_owned(),
                automaton: self.name.clone(),
                hint: hint.unwrap_or_default(),
            }
        })
    }

    /// Σ.
    pub fn alphabet(&self) -> &Alphabet {
        &self.alphabet
    }

    /// Whether it has no state at all: TCT's EMPTY.
    pub fn is_empty(&self) -> bool {
        self.marked.is_empty()
    }

    /// |Q|.
    pub fn state_count(&self) -> usize {
        self.marked.len()
    }

    /// How many transitions.
    pub fn transition_count(&self) -> usize {
        self.edges.len()
    }

    /// q0; none in EMPTY.
    pub fn initial(&self) -> Option<State> {
        (!self.is_empty()).then_some(State::INITIAL)
    }

    /// Q, ascending.
    pub fn states(&self) -> impl ExactSizeIterator<Item = State> + use<> {
        (0..self.marked.len() as u32).map(State)
    }

    /// Whether `state` is in Qm.
    pub fn is_marked(&self, state: State) -> bool {
        self.marked.get(state.index()).copied().unwrap_or(false)
    }

    /// Qm, ascending.
    pub fn marked(&self) -> impl Iterator<Item = State> + '_ {
        self.states().filter(|state| self.marked[state.index()])
    }

    /// What leaves `state`, by ascending label.
    ///
    /// # Panics
    /// `state` is not one of its states.
    pub fn edges(&self, state: State) -> &[Edge] {
        let index = state.index();
        &self.edges[self.first[index] as usize..self.first[index + 1] as usize]
    }

    /// All transitions, by source and then by label.
    pub fn transitions(&self) -> impl Iterator<Item = Transition> + '_ {
        self.states().flat_map(move |source| {
            self.edges(source).iter().map(move |edge| Transition {
                source,
                label: self.label(*edge),
                target: edge.target,
            })
        })
    }

    /// The label of an edge of this automaton.
    pub fn label(&self, edge: Edge) -> Label {
        self.alphabet.event(edge.event).label
    }

    /// δ(`state`, the event at `event` of its alphabet).
    pub fn successor(&self, state: State, event: u32) -> Option<State> {
        let edges = self.edges(state);
        let found = edges.binary_search_by_key(&event, |edge| edge.event).ok()?;
        Some(edges[found].target)
    }

    /// δ(`state`, `label`).
    pub fn step(&self, state: State, label: Label) -> Option<State> {
        self.successor(state, self.alphabet.place(label)?)
    }

    /// δ(q0, `word`).
    pub fn run(&self, word: &[Label]) -> Option<State> {
        let mut word = word.iter();
        word.try_fold(self.initial()?, |state, &label| self.step(state, label))
    }

    /// Events of its alphabet without a transition: TCT's "blocked events".
    pub fn blocked_events(&self) -> Vec<Label> {
        let mut used = vec![false; self.alphabet.len()];
        for edge in &self.edges {
            used[edge.event as usize] = true;
        }
        let labels = self.alphabet.labels().zip(used);
        labels.filter(|(_, used)| !used).map(|(label, _)| label).collect()
    }

    /// The names of its states, where they have names.
    pub fn state_names(&self) -> Option<&[String]> {
        self.state_names.as_deref()
    }

    /// The name of `state`, or its number.
    pub fn state_name(&self, state: State) -> Cow<'_, str> {
        match self.state_names().and_then(|names| names.get(state.index())) {
            Some(name) => Cow::Borrowed(name),
            None => Cow::Owned(state.to_string()),
        }
    }
}
