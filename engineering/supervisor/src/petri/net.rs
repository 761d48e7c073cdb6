//! Automation Petri nets, (1) and (2).
//!
//! Invariant of a [`Net`]: arcs end at places that exist and weigh at least 1, names are given once, M0 keeps the capacities, and
//! no delay waits for an edge.

use std::collections::HashSet;
use std::time::Duration;

use understudy_ladder::Name;

use crate::Label;
use crate::ladder::When;

/// p, with its tokens at first and the actions of Q that it has.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Place {
    /// Its name.
    pub name: String,
    /// M0(p).
    pub initial: u32,
    /// A transition that would bring more tokens is not enabled; `None` where any number may come.
    pub capacity: Option<u32>,
    /// What its tokens do.
    pub actions: Vec<Action>,
}

/// An action of a place.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Action {
    /// The output is 1 while there is a token.
    Level(Name),
    /// The output is 1 for the scan in which a token has come.
    Impulse(Name),
}

/// An arc between a transition and a place.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Arc {
    /// The place's index.
    pub place: usize,
    /// Its weight.
    pub weight: u32,
}

/// χ: when an enabled transition is allowed to fire.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub enum Condition {
    /// χ = 1.
    #[default]
    Always,
    /// A level or an edge of an input.
    Signal(Name, When),
    /// All of them.
    All(Vec<Condition>),
    /// One of them, of which there is one at least.
    Any(Vec<Condition>),
}

impl Condition {
    /// Calls `see` with every signal in it.
    pub(crate) fn visit<'c>(&'c self, see: &mut impl FnMut(&'c Name, When)) {
        match self {
            Self::Always => {}
            Self::Signal(name, when) => see(name, *when),
            Self::All(parts) | Self::Any(parts) => {
                for part in parts {
                    part.visit(see);
                }
            }
        }
    }
}

/// t.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct NetTransition {
    /// Its name.
    pub name: String,
    /// The event that it is to supervisors; none for one that they do not know.
    pub label: Option<Label>,
    /// Pre: tokens that it takes.
    pub takes: Vec<Arc>,
    /// Post: tokens that it gives.
    pub gives: Vec<Arc>,
    /// In: it is enabled while there are fewer tokens than the weight.
    pub inhibitors: Vec<Arc>,
    /// En: it is enabled while there are at least as many tokens as the weight; they stay.
    pub enablers: Vec<Arc>,
    /// χ.
    pub condition: Condition,
    /// τ: time for which it must be enabled, with its condition, before it fires.
    pub delay: Option<Duration>,
}

impl NetTransition {
    pub(crate) fn taken(&self, place: usize) -> u32 {
        weight(&self.takes, place)
    }

    pub(crate) fn given(&self, place: usize) -> u32 {
        weight(&self.gives, place)
    }
}

fn weight(arcs: &[Arc], place: usize) -> u32 {
    let arcs = arcs.iter().filter(|arc| arc.place == place);
    arcs.map(|arc| arc.weight).sum()
}

/// Why places and transitions do not make a net.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum NetError {
    /// A duplicate name.
    #[error("U0891: `{name}` is the name of two places or two transitions")]
    Duplicate {
        /// The name.
        name: String,
    },
    /// An arc to a place that does not exist.
    #[error(
        "U0892: `{transition}` has an arc to place number {place}, and there are {places} places"
    )]
    NoSuchPlace {
        /// The transition.
        transition: String,
        /// The place's number.
        place: usize,
        /// How many there are.
        places: usize,
    },
    /// An arc without weight.
    #[error("U0893: `{transition}` has an arc of weight 0 to `{place}`")]
    Weightless {
        /// The transition.
        transition: String,
        /// The place.
        place: String,
    },
    /// A delay lasts while its condition holds, and an edge holds for one scan.
    #[error(
        "U0890: `{transition}` has a delay and a condition on an edge, which holds for one scan only"
    )]
    EdgeWithDelay {
        /// The transition.
        transition: String,
    },
    /// More tokens at first than the capacity.
    #[error("U0894: `{place}` begins with {initial} tokens, its capacity is {capacity}")]
    Overfull {
        /// The place.
        place: String,
        /// M0.
        initial: u32,
        /// The capacity.
        capacity: u32,
    },
}

impl NetError {
    /// Stable code for people.
    pub fn code(&self) -> &'static str {
        match self {
            Self::EdgeWithDelay { .. } => "U0890",
            Self::Duplicate { .. } => "U0891",
            Self::NoSuchPlace { .. } => "U0892",
            Self::Weightless { .. } => "U0893",
            Self::Overfull { .. } => "U0894",
        }
    }
}

/// An automation Petri net.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Net {
    name: String,
    places: Vec<Place>,
    transitions: Vec<NetTransition>,
}

impl Net {
    /// Checks the invariant.
    ///
    /// # Errors
    /// All that breaks it.
    pub fn new(
        name: impl Into<String>,
        places: Vec<Place>,
        transitions: Vec<NetTransition>,
    ) -> Result<Self, Vec<NetError>> {
        let mut errors = Vec::new();
        let mut unique = |names: Vec<&String>| {
            let mut seen = HashSet::new();
            for name in names {
                if !seen.insert(name) {
                    errors.push(NetError::Duplicate { name: name.clone() });
                }
            }
        };
        unique(places.iter().map(|place| &place.name).collect());
        unique(transitions.iter().map(|transition| &transition.name).collect());
        for transition in &transitions {
            let arcs = transition.takes.iter().chain(&transition.gives);
            for arc in arcs.chain(&transition.inhibitors).chain(&transition.enablers) {
                match places.get(arc.place) {
                    None => errors.push(NetError::NoSuchPlace {
                        transition: transition.name.clone(),
                        place: arc.place,
                        places: places.len(),
                    }),
                    Some(place) if arc.weight == 0 => errors.push(NetError::Weightless {
                        transition: transition.name.clone(),
                        place: place.name.clone(),
                    }),
                    Some(_) => {}
                }
            }
        }
        for transition in transitions.iter().filter(|transition| transition.delay.is_some()) {
            let mut has_edge = false;
            transition.condition.visit(&mut |_, when| has_edge |= when.is_edge());
            if has_edge {
                errors.push(NetError::EdgeWithDelay { transition: transition.name.clone() });
            }
        }
        for place in &places {
            if let Some(capacity) = place.capacity.filter(|&capacity| place.initial > capacity) {
                errors.push(NetError::Overfull {
                    place: place.name.clone(),
                    initial: place.initial,
                    capacity,
                });
            }
        }
        if errors.is_empty() {
            Ok(Self { name: name.into(), places, transitions })
        } else {
            Err(errors)
        }
    }

    /// Its name.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// P.
    pub fn places(&self) -> &[Place] {
        &self.places
    }

    /// T.
    pub fn transitions(&self) -> &[NetTransition] {
        &self.transitions
    }

    /// M0.
    pub fn initial(&self) -> Box<[u32]> {
        self.places.iter().map(|place| place.initial).collect()
    }

    /// The marking after `transition` has fired; `None` where `marking` does not enable it: enabling rules 1 to 3, and
    /// capacities. Conditions and delays are ignored.
    pub fn fire(&self, marking: &[u32], transition: &NetTransition) -> Option<Box<[u32]>> {
        let has = |arc: &Arc| marking[arc.place] >= arc.weight;
        if !transition.enablers.iter().all(has) || transition.inhibitors.iter().any(has) {
            return None;
        }
        let mut next: Box<[u32]> = marking.into();
        for arc in &transition.takes {
            next[arc.place] = next[arc.place].checked_sub(arc.weight)?;
        }
        for arc in &transition.gives {
            next[arc.place] = next[arc.place].checked_add(arc.weight)?;
            let capacity = self.places[arc.place].capacity;
            if capacity.is_some_and(|capacity| next[arc.place] > capacity) {
                return None;
            }
        }
        Some(next)
    }
}
