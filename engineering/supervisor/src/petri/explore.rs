//! The markings of a net: its bounds, and its automaton.

use std::collections::HashMap;

use crate::petri::net::Net;
use crate::{Automaton, AutomatonError, Event, Label, State, Transition};

/// Tokens by place.
pub type Marking = Box<[u32]>;

/// Why a net's markings are not known.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum ExplorationError {
    /// A run that can be repeated indefinitely with more tokens each time.
    #[error("U0895: place `{place}` is not bounded: after {} it holds more, and nothing is missing", run.join(" "))]
    Unbounded {
        /// A place that grows.
        place: String,
        /// The run: transitions from M0.
        run: Vec<String>,
    },
    /// More markings than asked for.
    #[error("U0896: more than {limit} markings")]
    TooLarge {
        /// The limit.
        limit: usize,
    },
}

impl ExplorationError {
    /// Stable code for people.
    pub fn code(&self) -> &'static str {
        match self {
            Self::Unbounded { .. } => "U0895",
            Self::TooLarge { .. } => "U0896",
        }
    }
}

/// All markings that a net can reach, whatever its conditions are.
#[derive(Debug, Clone)]
pub struct Exploration<'a> {
    net: &'a Net,
    markings: Vec<Marking>,
    /// Source, transition, target.
    firings: Vec<(usize, usize, usize)>,
}

impl Net {
    /// Follows all firings from M0, breadth first.
    ///
    /// # Errors
    /// More than `limit` markings; or a marking that covers one before it strictly, which without inhibitor arcs and
    /// capacities proves that the net is not bounded (Karp and Miller).
    pub fn explore(&self, limit: usize) -> Result<Exploration<'_>, ExplorationError> {
        let transitions = self.transitions();
        let is_monotone = transitions.iter().all(|transition| transition.inhibitors.is_empty())
            && self.places().iter().all(|place| place.capacity.is_none());
        let mut markings = vec![self.initial()];
        let mut parents: Vec<Option<(usize, usize)>> = vec![None];
        let mut places = HashMap::from([(self.initial(), 0)]);
        let mut firings = Vec::new();
        let mut source = 0;
        while source < markings.len() {
            for (number, transition) in transitions.iter().enumerate() {
                let Some(next) = self.fire(&markings[source], transition) else {
                    continue;
                };
                let target = match places.get(&next) {
                    Some(&known) => known,
                    None => {
                        if is_monotone {
                            let parent = (source, number);
                            self.covers(&next, parent, &markings, &parents)?;
                        }
                        places.insert(next.clone(), markings.len());
                        markings.push(next);
                        parents.push(Some((source, number)));
                        markings.len() - 1
                    }
                };
                firings.push((source, number, target));
            }
            if markings.len() > limit {
                return Err(ExplorationError::TooLarge { limit });
            }
            source += 1;
        }
        Ok(Exploration { net: self, markings, firings })
    }

    /// Looks for a marking on the way to `next` that it covers strictly.
    fn covers(
        &self,
        next: &[u32],
        parent: (usize, usize),
        markings: &[Marking],
        parents: &[Option<(usize, usize)>],
    ) -> Result<(), ExplorationError> {
        let mut run = Vec::new();
        let mut at = Some(parent);
        let mut grows = None;
        while let Some((marking, transition)) = at {
            run.push(self.transitions()[transition].name.clone());
            let before = &markings[marking];
            if grows.is_none() && before.iter().zip(next).all(|(before, next)| before <= next) {
                // It is another marking, so one of its places has more.
                grows = before.iter().zip(next).position(|(before, next)| before < next);
            }
            at = parents[marking];
        }
        run.reverse();
        match grows {
            None => Ok(()),
            Some(place) => {
                Err(ExplorationError::Unbounded { place: self.places()[place].name.clone(), run })
            }
        }
    }
}

impl Exploration<'_> {
    /// The markings, M0 first.
    pub fn markings(&self) -> &[Marking] {
        &self.markings
    }

    /// For each place the most tokens that it ever holds.
    pub fn bounds(&self) -> Vec<u32> {
        let places = 0..self.net.places().len();
        let most = |place: usize| self.markings.iter().map(|marking| marking[place]).max();
        places.map(|place| most(place).unwrap_or(0)).collect()
    }

    /// The transitions that no marking enables.
    pub fn dead_transitions(&self) -> Vec<&str> {
        let mut fires = vec![false; self.net.transitions().len()];
        for &(_, transition, _) in &self.firings {
            fires[transition] = true;
        }
        let transitions = self.net.transitions().iter().zip(fires);
        let dead = transitions.filter(|(_, fires)| !fires);
        dead.map(|(transition, _)| transition.name.as_str()).collect()
    }

    /// Markings that enable nothing, whatever the conditions are.
    pub fn dead_markings(&self) -> Vec<&[u32]> {
        let mut goes_on = vec![false; self.markings.len()];
        for &(source, _, _) in &self.firings {
            goes_on[source] = true;
        }
        let markings = self.markings.iter().zip(goes_on);
        let dead = markings.filter(|(_, goes_on)| !goes_on);
        dead.map(|(marking, _)| &**marking).collect()
    }

    /// The markings as states, M0 marked; the transitions' events as its events.
    ///
    /// # Errors
    /// Two transitions of one event that lead from one marking to different ones. A transition without an event is an event of
    /// its own: an even number above all others.
    pub fn automaton(&self) -> Result<Automaton, AutomatonError> {
        let events = self.net.events();
        let transitions = self.firings.iter().map(|&(source, transition, target)| Transition {
            source: State::new(source as u32),
            label: events[transition].label,
            target: State::new(target as u32),
        });
        let mut marked = vec![false; self.markings.len()];
        marked[0] = true;
        let names = self.markings.iter().map(|marking| self.net.name_of(marking));
        let automaton =
            Automaton::new(self.net.name(), events.iter().cloned(), marked, transitions.collect())?;
        automaton.with_state_names(names.collect())
    }
}

impl Net {
    /// A marking in one word: the places that hold tokens, and how many where there are several.
    pub fn name_of(&self, marking: &[u32]) -> String {
        let places = marking.iter().zip(self.places());
        let held = places.filter(|(tokens, _)| **tokens > 0);
        let names = held.map(|(tokens, place)| match tokens {
            1 => place.name.clone(),
            _ => format!("{}{tokens}", place.name),
        });
        names.collect::<Vec<_>>().join("_")
    }

    /// The event of each transition.
    pub(crate) fn events(&self) -> Vec<Event> {
        let labels = self.transitions().iter().filter_map(|transition| transition.label);
        let mut free = labels.map(Label::number).max().map_or(0, |most| most / 2 * 2 + 2);
        let events = self.transitions().iter().map(|transition| {
            let label = transition.label.unwrap_or_else(|| {
                let label = Label::new(free);
                free += 2;
                label
            });
            Event { label, name: transition.name.clone() }
        });
        events.collect()
    }
}
