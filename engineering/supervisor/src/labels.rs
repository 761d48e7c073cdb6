//! Labels of events that a file knows by names alone: of Supremica and libFAUDES.
//!
//! An event is its label, so equal names in two files must get equal labels, and different names different ones:
//! [`agree_on_events`] sees to that before automata of several files meet. A name that is a number N, or `eN`, as TCT's event N is
//! written for Supremica, gets label N where that fits; others get the lowest free one, in the order of the files.

use std::collections::{HashMap, HashSet};

use crate::ads::MAXIMUM_LABEL;
use crate::alphabet::{Alphabet, Event, Label};
use crate::automaton::Automaton;

/// The lowest labels that are free, of either parity.
#[derive(Default)]
pub(crate) struct FreeLabels([u32; 2]);

impl FreeLabels {
    /// The next one of the right parity.
    pub(crate) fn take(&mut self, controllable: bool, is_taken: impl Fn(u32) -> bool) -> Label {
        let next = &mut self.0[usize::from(controllable)];
        loop {
            let number = *next * 2 + u32::from(controllable);
            *next += 1;
            if !is_taken(number) {
                return Label::new(number);
            }
        }
    }
}

/// The label that a name asks for: N of `N` and of `eN`.
fn wanted(name: &str, controllable: bool) -> Option<Label> {
    let digits = name.strip_prefix('e').unwrap_or(name);
    let number: u32 = digits.parse().ok()?;
    let label = Label::new(number);
    let fits = number <= MAXIMUM_LABEL && number.to_string() == digits;
    (fits && label.is_controllable() == controllable).then_some(label)
}

/// Labels for events by their names, in their order; each name once. `known` are labels that stand already.
pub(crate) fn labels(names: &[(String, bool)], known: &Alphabet) -> Vec<Label> {
    let by_name: HashMap<&str, Label> =
        known.events().iter().map(|event| (event.name.as_str(), event.label)).collect();
    let is_other = |label: Label| {
        let place = known.place(label);
        place.is_some_and(|place| known.event(place).name != label.to_string())
    };
    let mut taken: HashSet<u32> = known.labels().map(Label::number).collect();
    let mut given: HashSet<Label> = HashSet::new();
    let sure: Vec<Option<Label>> = names
        .iter()
        .map(|(name, controllable)| {
            let known = by_name.get(name.as_str()).copied();
            let wanted = || wanted(name, *controllable).filter(|label| !is_other(*label));
            known.or_else(wanted).filter(|label| given.insert(*label))
        })
        .collect();
    taken.extend(given.iter().map(|label| label.number()));
    let mut free = FreeLabels::default();
    let labels = names.iter().zip(sure).map(|((_, controllable), sure)| {
        sure.unwrap_or_else(|| free.take(*controllable, |number| taken.contains(&number)))
    });
    labels.collect()
}

/// The automata of a file that meet those of others.
#[derive(Debug)]
pub struct EventSource<'a> {
    /// The file.
    pub file: String,
    /// Its automata.
    pub automata: Vec<&'a mut Automaton>,
    /// Whether it knows events by names alone, so that their labels are not the file's own.
    pub is_by_name: bool,
}

/// Why the events of several files do not fit together.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum EventsDisagree {
    /// One name for events that a supervisor may forbid and may not.
    #[error("U0839: event {name} is controllable in {one} and uncontrollable in {other}")]
    Controllability {
        /// The name.
        name: String,
        /// Where it is controllable.
        one: String,
        /// Where it is not.
        other: String,
    },
    /// One name under two labels.
    #[error(
        "U0839: event {name} has label {first} in {one} and label {second} in {other}: give it the same `label` in both files"
    )]
    TwoLabels {
        /// The name.
        name: String,
        /// Its label in `one`.
        first: Label,
        /// A file.
        one: String,
        /// Its label in `other`.
        second: Label,
        /// Another file.
        other: String,
    },
    /// Two names for one label.
    #[error(
        "U0839: label {label} is event {first} in {one} and event {second} in {other}: give each of them a `label` of its own"
    )]
    TwoNames {
        /// The label.
        label: Label,
        /// Its name in `one`.
        first: String,
        /// A file.
        one: String,
        /// Its name in `other`.
        second: String,
        /// Another file.
        other: String,
    },
}

impl EventsDisagree {
    /// Stable code for people.
    pub fn code(&self) -> &'static str {
        "U0839"
    }
}

/// Makes the labels of several files those of one alphabet: equal names get equal labels. `known` are events that stand already, such as
/// those of a net.
///
/// # Errors
/// A name that is controllable in one file only, or files that give labels themselves and differ in them.
pub fn agree_on_events(
    known: &Alphabet,
    sources: &mut [EventSource<'_>],
) -> Result<(), EventsDisagree> {
    let mut known = known.clone();
    let mut named: HashMap<String, (Label, String)> = HashMap::new();
    let mut labelled: HashMap<Label, (String, String)> = HashMap::new();
    for source in sources.iter().filter(|source| !source.is_by_name) {
        for event in events(source).filter(|event| event.name != event.label.to_string()) {
            let place = (event.label, source.file.clone());
            let (first, one) = named.entry(event.name.clone()).or_insert(place);
            if *first != event.label && *one != source.file {
                return Err(EventsDisagree::TwoLabels {
                    name: event.name.clone(),
                    first: *first,
                    one: one.clone(),
                    second: event.label,
                    other: source.file.clone(),
                });
            }
            let place = (event.name.clone(), source.file.clone());
            let (first, one) = labelled.entry(event.label).or_insert(place);
            if *first != event.name && *one != source.file {
                return Err(EventsDisagree::TwoNames {
                    label: event.label,
                    first: first.clone(),
                    one: one.clone(),
                    second: event.name.clone(),
                    other: source.file.clone(),
                });
            }
        }
        known = known.union(source.automata.iter().map(|automaton| automaton.alphabet()));
    }
    let mut names: Vec<(String, bool)> = Vec::new();
    let mut kinds: HashMap<String, (bool, String)> = HashMap::new();
    for event in known.events() {
        let file = named.get(&event.name).map_or("another file", |(_, file)| file);
        kinds.insert(event.name.clone(), (event.label.is_controllable(), file.to_owned()));
    }
    for source in sources.iter().filter(|source| source.is_by_name) {
        let mut own: HashSet<&str> = HashSet::new();
        for event in events(source).filter(|event| own.insert(&event.name)) {
            let controllable = event.label.is_controllable();
            let place = (controllable, source.file.clone());
            let (before, file) = kinds.entry(event.name.clone()).or_insert(place).clone();
            if before != controllable {
                let (one, other) = (file, source.file.clone());
                let (one, other) = if before { (one, other) } else { (other, one) };
                return Err(EventsDisagree::Controllability {
                    name: event.name.clone(),
                    one,
                    other,
                });
            }
            names.push((event.name.clone(), controllable));
        }
    }
    let mut seen = HashSet::new();
    names.retain(|(name, _)| seen.insert(name.clone()));
    let labels = labels(&names, &known);
    let labels: HashMap<String, Label> =
        names.into_iter().map(|(name, _)| name).zip(labels).collect();
    for source in sources.iter_mut().filter(|source| source.is_by_name) {
        for automaton in &mut source.automata {
            let events = automaton.alphabet().events().iter();
            let events: Vec<Event> = events
                .map(|event| Event { label: labels[&event.name], name: event.name.clone() })
                .collect();
            **automaton = automaton.relabelled(events);
        }
    }
    Ok(())
}

/// The events of a file, those of several automata more than once.
fn events<'a>(source: &'a EventSource<'_>) -> impl Iterator<Item = &'a Event> {
    source.automata.iter().flat_map(|automaton| automaton.alphabet().events())
}
