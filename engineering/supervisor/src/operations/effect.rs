//! Whether two supervisors have the same effect on a plant: both products are walked at once, and nothing else is used.

use rustc_hash::FxHashSet;

use crate::alphabet::Label;
use crate::automaton::{Automaton, State};
use crate::explicit::{Bounds, TooLarge};

/// Bytes of a place in the walk: its states twice, how it was reached, and room in the table.
const PLACE_BYTES: usize = 48;

/// A sequence of events after which two supervisors have different effects.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct OtherEffect {
    /// The shortest one.
    pub word: Vec<Label>,
    /// What the plant can do there and only one of them allows; nothing where only one of them marks.
    pub event: Option<Label>,
}

/// The states of the plant and of both supervisors; nothing of one that is EMPTY.
type Place = (State, Option<State>, Option<State>);

/// Compares the effects of two supervisors on `plant`: what they allow of that which it can do, as in [`meet`](super::meet), and where
/// both it and they are marked. Nothing where they are equal. As many places are visited as the larger product has states where `right`
/// is a reduction of `left`.
///
/// # Errors
/// The walk passes the bounds.
pub fn compare_effects(
    plant: &Automaton,
    left: &Automaton,
    right: &Automaton,
    bounds: Bounds,
) -> Result<Option<OtherEffect>, TooLarge> {
    let Some(initial) = plant.initial() else {
        return Ok(None);
    };
    let mut walk = Walk::new((initial, left.initial(), right.initial()));
    let mut next = 0;
    while let Some(&(at, one, other)) = walk.places.get(next) {
        let marks = |supervisor: &Automaton, state: Option<State>| {
            plant.is_marked(at) && state.is_some_and(|state| supervisor.is_marked(state))
        };
        if one.is_some() != other.is_some() || marks(left, one) != marks(right, other) {
            return Ok(Some(walk.difference(next, None)));
        }
        for &edge in plant.edges(at) {
            let label = plant.label(edge);
            let step =
                |supervisor: &Automaton, state: Option<State>| supervisor.step(state?, label);
            match (step(left, one), step(right, other)) {
                (None, None) => {}
                (Some(one), Some(other)) => {
                    walk.reach((edge.target, Some(one), Some(other)), next, label);
                }
                _ => return Ok(Some(walk.difference(next, Some(label)))),
            }
        }
        next += 1;
        if walk.places.len().saturating_mul(PLACE_BYTES) > bounds.memory_bytes {
            return Err(TooLarge::Memory {
                states: walk.places.len(),
                transitions: 0,
                memory_bytes: bounds.memory_bytes,
            });
        }
    }
    Ok(None)
}

/// Places in breadth-first order.
struct Walk {
    known: FxHashSet<Place>,
    places: Vec<Place>,
    /// For each place but the first, from which one it was reached, and by which event.
    reached: Vec<(usize, Label)>,
}

impl Walk {
    fn new(first: Place) -> Self {
        Self { known: FxHashSet::from_iter([first]), places: vec![first], reached: Vec::new() }
    }

    fn reach(&mut self, place: Place, from: usize, label: Label) {
        if self.known.insert(place) {
            self.places.push(place);
            self.reached.push((from, label));
        }
    }

    fn difference(&self, mut place: usize, event: Option<Label>) -> OtherEffect {
        let mut word = Vec::new();
        while let Some(&(from, label)) = place.checked_sub(1).map(|index| &self.reached[index]) {
            word.push(label);
            place = from;
        }
        word.reverse();
        OtherEffect { word, event }
    }
}
