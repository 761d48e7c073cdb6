//! Step 3: smaller nets that do the same, by the rules that keep boundedness, liveness and reversibility (Murata, section V).
//!
//! Only what has no part in control is taken away: no place with an action, no transition with an event, condition or delay.

use std::fmt;

use super::net::{Condition, Net, NetTransition, Place};

/// What was taken away.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Reduction {
    /// A place that always holds what another one holds.
    ParallelPlace(String),
    /// A place that never disables anything: its transitions give back what they take, and it has enough.
    ImpliedPlace(String),
    /// A transition that moves one token from one place to another, and the place that only it empties.
    Series {
        /// The transition.
        transition: String,
        /// The place.
        place: String,
    },
    /// A transition that does the same as another one.
    ParallelTransition(String),
}

impl fmt::Display for Reduction {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::ParallelPlace(place) => {
                write!(formatter, "place {place} holds what another one holds")
            }
            Self::ImpliedPlace(place) => write!(formatter, "place {place} never disables anything"),
            Self::Series { transition, place } => write!(
                formatter,
                "transition {transition} only hands on what comes to place {place}"
            ),
            Self::ParallelTransition(transition) => {
                write!(formatter, "transition {transition} does what another one does")
            }
        }
    }
}

/// Applies the rules until none applies.
pub fn reduce(net: &Net) -> (Net, Vec<Reduction>) {
    let mut places = net.places().to_vec();
    let mut transitions = net.transitions().to_vec();
    let mut reductions = Vec::new();
    while let Some(reduction) = step(&mut places, &mut transitions) {
        reductions.push(reduction);
    }
    // What is left of a net keeps the invariant of a net.
    let reduced = Net::new(net.name(), places, transitions).unwrap_or_else(|_| net.clone());
    (reduced, reductions)
}

fn step(places: &mut Vec<Place>, transitions: &mut Vec<NetTransition>) -> Option<Reduction> {
    for place in 0..places.len() {
        let is_plain = places[place].actions.is_empty() && !is_watched(transitions, place);
        if !is_plain {
            continue;
        }
        if is_implied(&places[place], transitions, place) {
            return Some(Reduction::ImpliedPlace(remove_place(places, transitions, place)));
        }
        let twin = (0..places.len()).find(|&other| {
            other != place
                && places[other].initial == places[place].initial
                && places[other].capacity == places[place].capacity
                && transitions.iter().all(|transition| {
                    transition.taken(other) == transition.taken(place)
                        && transition.given(other) == transition.given(place)
                })
        });
        if twin.is_some() {
            return Some(Reduction::ParallelPlace(remove_place(places, transitions, place)));
        }
        if let Some((transition, target)) = series(places, transitions, place) {
            let name = transitions.remove(transition).name;
            for transition in transitions.iter_mut() {
                for arc in transition.gives.iter_mut().filter(|arc| arc.place == place) {
                    arc.place = target;
                }
            }
            places[target].initial += places[place].initial;
            let place = remove_place(places, transitions, place);
            return Some(Reduction::Series { transition: name, place });
        }
    }
    let twin = (0..transitions.len()).find(|&number| {
        let transition = &transitions[number];
        is_silent(transition)
            && transitions[..number].iter().any(|other| {
                is_silent(other)
                    && (0..places.len()).all(|place| {
                        other.taken(place) == transition.taken(place)
                            && other.given(place) == transition.given(place)
                    })
                    && other.inhibitors == transition.inhibitors
                    && other.enablers == transition.enablers
            })
    });
    twin.map(|number| Reduction::ParallelTransition(transitions.remove(number).name))
}

fn is_silent(transition: &NetTransition) -> bool {
    transition.label.is_none()
        && transition.condition == Condition::Always
        && transition.delay.is_none()
}

/// Whether an inhibitor or enabling arc reads the place.
fn is_watched(transitions: &[NetTransition], place: usize) -> bool {
    transitions.iter().any(|transition| {
        let mut arcs = transition.inhibitors.iter().chain(&transition.enablers);
        arcs.any(|arc| arc.place == place)
    })
}

fn is_implied(place: &Place, transitions: &[NetTransition], index: usize) -> bool {
    let mut touching = transitions
        .iter()
        .filter(|transition| transition.taken(index) + transition.given(index) > 0);
    place.capacity.is_none_or(|capacity| capacity >= place.initial)
        && touching.all(|transition| {
            let taken = transition.taken(index);
            taken == transition.given(index) && taken <= place.initial
        })
}

/// The silent transition that alone empties `place` and only hands each token on, with the place that gets it.
fn series(places: &[Place], transitions: &[NetTransition], place: usize) -> Option<(usize, usize)> {
    let mut takers = (0..transitions.len()).filter(|&number| transitions[number].taken(place) > 0);
    let taker = takers.next()?;
    let transition = &transitions[taker];
    let [taken] = transition.takes.as_slice() else {
        return None;
    };
    let [given] = transition.gives.as_slice() else {
        return None;
    };
    let is_plain = takers.next().is_none()
        && is_silent(transition)
        && transition.inhibitors.is_empty()
        && transition.enablers.is_empty()
        && (taken.weight, given.weight) == (1, 1)
        && given.place != place
        && places[place].capacity.is_none()
        && places[given.place].capacity.is_none()
        // A token that comes there by another way may be told from one that is on its way.
        && places[given.place].actions.is_empty()
        && !is_watched(transitions, given.place);
    is_plain.then_some((taker, given.place))
}

fn remove_place(
    places: &mut Vec<Place>,
    transitions: &mut [NetTransition],
    place: usize,
) -> String {
    for transition in transitions {
        for arcs in [
            &mut transition.takes,
            &mut transition.gives,
            &mut transition.inhibitors,
            &mut transition.enablers,
        ] {
            arcs.retain(|arc| arc.place != place);
            for arc in arcs.iter_mut().filter(|arc| arc.place > place) {
                arc.place -= 1;
            }
        }
    }
    places.remove(place).name
}
