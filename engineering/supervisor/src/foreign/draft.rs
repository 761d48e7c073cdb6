//! Events, states and transitions as a reader meets them.

use std::collections::{BTreeSet, HashMap, HashSet};
use std::ops::Range;

use understudy_text::{Diagnostic, MAXIMUM_FINDINGS, has_errors, spelling};

use super::ReadForeign;
use crate::alphabet::{Alphabet, Event, Label};
use crate::automaton::{Automaton, Named, State, Transition};
use crate::labels::labels;
use crate::model::Model;

pub(super) type Place = Range<usize>;

/// The findings of a file, up to their bound.
#[derive(Default)]
pub(super) struct Findings(Vec<Diagnostic>);

impl Findings {
    pub(super) fn push(&mut self, diagnostic: Diagnostic) {
        match self.0.len() {
            MAXIMUM_FINDINGS => self.0.push(Diagnostic::too_many(diagnostic.span.start)),
            count if count > MAXIMUM_FINDINGS => {}
            _ => self.0.push(diagnostic),
        }
    }

    pub(super) fn error(&mut self, code: &'static str, message: impl Into<String>, place: Place) {
        self.push(Diagnostic::error(code, message, place));
    }

    /// U0834: something that an automaton cannot say.
    pub(super) fn unsupported(&mut self, what: impl Into<String>, place: Place) {
        self.error("U0834", what, place);
    }

    /// U0835: something that the format does not allow there.
    pub(super) fn malformed(&mut self, what: impl Into<String>, place: Place) {
        self.error("U0835", what, place);
    }

    /// U0838: something that is read otherwise than it may be meant.
    pub(super) fn remark(&mut self, what: impl Into<String>, place: Place) {
        self.push(Diagnostic::warning("U0838", what, place));
    }

    /// The answer of a reader.
    pub(super) fn answer(mut self, model: Model, unobservable: Vec<Label>) -> ReadForeign {
        self.0.sort_by_key(|diagnostic| diagnostic.span.start);
        let model = (!has_errors(&self.0)).then_some(model);
        ReadForeign { model, unobservable, diagnostics: self.0 }
    }
}

/// Whether a word of a model file can hold a character.
fn is_of_a_word(character: char) -> bool {
    !character.is_whitespace() && !character.is_control() && !matches!(character, '"' | '\'')
}

/// `names` with the characters that are `allowed`; another one becomes `_`, an empty name too, and a name that is taken gets a number.
pub(super) fn distinct<'n>(
    names: impl IntoIterator<Item = &'n str>,
    allowed: impl Fn(char) -> bool,
) -> Vec<String> {
    let mut taken: HashSet<String> = HashSet::new();
    let mut next: HashMap<String, usize> = HashMap::new();
    let names = names.into_iter().map(|name| {
        let letters = name.chars().map(|letter| if allowed(letter) { letter } else { '_' });
        let mut word: String = letters.collect();
        if word.is_empty() {
            word.push('_');
        }
        let mut free = word.clone();
        while !taken.insert(free.clone()) {
            let number = next.entry(word.clone()).or_insert(1);
            *number += 1;
            free = format!("{word}_{number}");
        }
        free
    });
    names.collect()
}

/// The events that a file declares, by their names in it.
#[derive(Default)]
pub(super) struct Declared {
    names: Vec<(String, bool)>,
    places: HashMap<String, usize>,
    unobservable: BTreeSet<usize>,
}

impl Declared {
    /// Declares an event; whether the name is a new one.
    pub(super) fn declare(&mut self, name: &str, controllable: bool, observable: bool) -> bool {
        let number = self.names.len();
        if self.places.contains_key(name) {
            return false;
        }
        self.places.insert(name.to_owned(), number);
        self.names.push((name.to_owned(), controllable));
        if !observable {
            self.unobservable.insert(number);
        }
        true
    }

    pub(super) fn is_empty(&self) -> bool {
        self.names.is_empty()
    }

    /// The number of an event, or U0836.
    pub(super) fn find(&self, name: &str, place: Place, findings: &mut Findings) -> Option<usize> {
        let found = self.places.get(name).copied();
        if found.is_none() {
            let mut diagnostic =
                Diagnostic::error("U0836", format!("there is no event {name}"), place);
            diagnostic.help = spelling::question(name, self.places.keys().map(String::as_str));
            findings.push(diagnostic);
        }
        found
    }

    /// The events with their labels, in the order of their declarations.
    pub(super) fn events(&self) -> Vec<Event> {
        let words = distinct(self.names.iter().map(|(name, _)| name.as_str()), is_of_a_word);
        let controllable = self.names.iter().map(|(_, controllable)| *controllable);
        let names: Vec<(String, bool)> = words.into_iter().zip(controllable).collect();
        let labels = labels(&names, &Alphabet::default());
        let events = names.into_iter().zip(labels);
        events.map(|((name, _), label)| Event { label, name }).collect()
    }

    /// The labels of those that cannot be observed, with a remark on what that changes.
    pub(super) fn unobservable(&self, events: &[Event], findings: &mut Findings) -> Vec<Label> {
        let labels: Vec<Label> =
            self.unobservable.iter().map(|&number| events[number].label).collect();
        if let Some(first) = self.unobservable.first() {
            let message = format!(
                "unobservable events: {}, the first is {}; only `des observer` uses that",
                labels.len(),
                self.names[*first].0
            );
            findings.remark(message, 0..0);
        }
        labels
    }
}

/// A transition by the numbers of states and events.
struct Edge {
    source: usize,
    event: usize,
    target: usize,
    place: Place,
}

/// What begins the key of a state that is called by its number: a name that is a number is another key.
pub(super) const INDEX: char = '\u{0}';

/// An automaton that is being read.
#[derive(Default)]
pub(super) struct Draft {
    pub(super) name: String,
    states: Vec<String>,
    numbers: HashMap<String, usize>,
    initial: Option<(usize, Place)>,
    marked: Vec<bool>,
    /// The numbers of its events, those without a transition included.
    pub(super) alphabet: BTreeSet<usize>,
    edges: Vec<Edge>,
}

impl Draft {
    pub(super) fn of(name: &str) -> Self {
        Self { name: name.to_owned(), ..Self::default() }
    }

    pub(super) fn state_count(&self) -> usize {
        self.states.len()
    }

    /// Adds a state that the file calls by each of `keys`; its number, or none where one of them is taken.
    pub(super) fn add_state(&mut self, name: &str, keys: &[&str]) -> Option<usize> {
        let number = self.states.len();
        if keys.iter().any(|key| self.numbers.contains_key(*key)) {
            return None;
        }
        self.numbers.extend(keys.iter().map(|key| ((*key).to_owned(), number)));
        self.states.push(name.to_owned());
        self.marked.push(false);
        Some(number)
    }

    pub(super) fn known(&self, name: &str) -> Option<usize> {
        self.numbers.get(name).copied()
    }

    /// The number of a state, or U0836.
    pub(super) fn state(&self, name: &str, place: Place, findings: &mut Findings) -> Option<usize> {
        let found = self.known(name);
        if found.is_none() {
            let name = name.trim_start_matches(INDEX);
            let message = format!("{} has no state {name}", self.name);
            let mut diagnostic = Diagnostic::error("U0836", message, place);
            diagnostic.help = spelling::question(name, self.states.iter().map(String::as_str));
            findings.push(diagnostic);
        }
        found
    }

    pub(super) fn mark(&mut self, state: usize) {
        self.marked[state] = true;
    }

    pub(super) fn mark_all(&mut self) {
        self.marked.fill(true);
    }

    /// Makes a state the initial one, or U0837 where there is one already.
    pub(super) fn begin(&mut self, state: usize, place: Place, findings: &mut Findings) {
        match &self.initial {
            Some((other, before)) if *other != state => {
                let message = format!(
                    "{} has the initial states {} and {}; an automaton must be deterministic",
                    self.name, self.states[*other], self.states[state]
                );
                let diagnostic = Diagnostic::error("U0837", message, place);
                findings.push(diagnostic.with_related(before.clone(), "the other one"));
            }
            _ => self.initial = Some((state, place)),
        }
    }

    pub(super) fn connect(&mut self, source: usize, event: usize, target: usize, place: Place) {
        self.alphabet.insert(event);
        self.edges.push(Edge { source, event, target, place });
    }

    /// The automaton; `place` is that of a finding about the whole, and `number` the name of an unnamed state.
    pub(super) fn finish(
        self,
        events: &[Event],
        place: Place,
        findings: &mut Findings,
        number: impl Fn(usize) -> String,
    ) -> Option<Automaton> {
        let own: Vec<Event> = self.alphabet.iter().map(|&event| events[event].clone()).collect();
        let Some((initial, _)) = self.initial else {
            if !self.states.is_empty() {
                let message = format!("{} has no initial state: it is EMPTY", self.name);
                findings.remark(message, place);
            }
            return Some(Automaton::empty(self.name, Alphabet::new(own)));
        };
        self.check_edges(events, findings);
        let parts = Named {
            states: distinct(self.states.iter().map(String::as_str), is_of_a_word),
            transitions: self.edges.iter().map(|edge| edge.transition(events)).collect(),
            name: self.name,
            events: own,
            initial,
            marked: self.marked,
        };
        // What else can be wrong has been reported with its place.
        parts.automaton(number).ok()
    }

    /// U0837 for each event that leads from one state to two.
    fn check_edges(&self, events: &[Event], findings: &mut Findings) {
        let mut known: HashMap<(usize, usize), &Edge> = HashMap::new();
        for edge in &self.edges {
            let first = known.entry((edge.source, edge.event)).or_insert(edge);
            if first.target != edge.target {
                let message = format!(
                    "{}: from state {} event {} leads to state {} and to state {}; an automaton must be deterministic",
                    self.name,
                    self.states[edge.source],
                    events[edge.event].name,
                    self.states[first.target],
                    self.states[edge.target]
                );
                let diagnostic = Diagnostic::error("U0837", message, edge.place.clone());
                findings.push(diagnostic.with_related(first.place.clone(), "the other one"));
            }
        }
    }
}

impl Edge {
    fn transition(&self, events: &[Event]) -> Transition {
        Transition {
            source: State::new(self.source as u32),
            label: events[self.event].label,
            target: State::new(self.target as u32),
        }
    }
}
