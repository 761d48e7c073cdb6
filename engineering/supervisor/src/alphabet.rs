//! Events: what may happen, under a number for TCT and a name for people.
//!
//! The rule of TCT holds throughout: an event is controllable exactly when its label is odd. Two automata mean the same
//! event when they use the same label; the name is for people.

use std::fmt;
use std::sync::Arc;

/// The number of an event; odd ones are controllable.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Label(u32);

impl Label {
    /// The event number `number`.
    pub const fn new(number: u32) -> Self {
        Self(number)
    }

    /// Its number.
    pub const fn number(self) -> u32 {
        self.0
    }

    /// Whether a supervisor may disable it.
    pub const fn is_controllable(self) -> bool {
        self.0 % 2 == 1
    }
}

impl fmt::Display for Label {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.fmt(formatter)
    }
}

/// An event of an alphabet.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Event {
    /// Unique in the alphabet.
    pub label: Label,
    /// For people; the label's number where nothing better is known.
    pub name: String,
}

impl Event {
    /// An event that is called by its number.
    pub fn unnamed(label: Label) -> Self {
        Self { label, name: label.to_string() }
    }
}

/// The events of an automaton in ascending order of their labels; an event may be in it and on no transition, and is then
/// permanently forbidden.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Alphabet(Arc<[Event]>);

impl Alphabet {
    /// The alphabet of `events`; of two with one label the first stays.
    pub fn new(events: impl IntoIterator<Item = Event>) -> Self {
        let mut events: Vec<Event> = events.into_iter().collect();
        events.sort_by_key(|event| event.label);
        events.dedup_by_key(|event| event.label);
        Self(events.into())
    }

    /// How many events.
    pub fn len(&self) -> usize {
        self.0.len()
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// The events, by ascending label.
    pub fn events(&self) -> &[Event] {
        &self.0
    }

    /// The labels, ascending.
    pub fn labels(&self) -> impl ExactSizeIterator<Item = Label> + '_ {
        self.0.iter().map(|event| event.label)
    }

    /// The event at `place`, which an [`Edge`](crate::Edge) names.
    ///
    /// # Panics
    /// `place` is not below [`Self::len`].
    pub fn event(&self, place: u32) -> &Event {
        &self.0[place as usize]
    }

    /// Position of the event `label`.
    pub fn place(&self, label: Label) -> Option<u32> {
        let place = self.0.binary_search_by_key(&label, |event| event.label);
        place.ok().map(|place| place as u32)
    }

    /// Whether `label` is one of its events.
    pub fn contains(&self, label: Label) -> bool {
        self.place(label).is_some()
    }

    /// Name of `label`, or its number if it is not an event of the alphabet.
    pub fn name(&self, label: Label) -> String {
        match self.place(label) {
            Some(place) => self.event(place).name.clone(),
            None => label.to_string(),
        }
    }

    /// The events of this one and of `others`; where several name an event, a name counts more than a number, and an earlier
    /// one more than a later one.
    pub fn union<'a>(&self, others: impl IntoIterator<Item = &'a Alphabet>) -> Self {
        let others = others.into_iter().flat_map(|other| other.0.iter());
        let mut events: Vec<Event> = self.0.iter().chain(others).cloned().collect();
        events.sort_by_key(|event| (event.label, event.name == event.label.to_string()));
        events.dedup_by_key(|event| event.label);
        Self(events.into())
    }
}
