use crate::alphabet::Label;
use crate::automaton::{Automaton, State};

/// Where two automata are not one but for the numbers of their states.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Difference {
    /// They have different numbers of states.
    StateCounts(usize, usize),
    /// After `word` one of them enables `event` and the other does not.
    Enabled {
        /// A shortest sequence that leads there.
        word: Vec<Label>,
        /// The event.
        event: Label,
    },
    /// After `word` one of them is in a marked state and the other is not.
    Marked {
        /// A shortest sequence that leads there.
        word: Vec<Label>,
    },
    /// Two words lead to one state in one of them, and to two in the other.
    Merged {
        /// One word.
        word: Vec<Label>,
        /// The other one.
        other: Vec<Label>,
    },
    /// One of them has states that are not reached; nothing can tell them apart but a search through all numberings.
    Unreachable {
        /// Its name.
        name: String,
        /// How many states are reached.
        reached: usize,
    },
}

/// `isomorph`: the state of `right` for each state of `left`, where the two are one but for the numbers of their states; 0 stays 0.
/// Both must be reachable.
///
/// # Errors
/// A first difference.
pub fn isomorph(left: &Automaton, right: &Automaton) -> Result<Vec<State>, Difference> {
    if left.state_count() != right.state_count() {
        return Err(Difference::StateCounts(left.state_count(), right.state_count()));
    }
    let Some(initial) = left.initial() else {
        return Ok(Vec::new());
    };
    let states = left.state_count();
    let mut forward: Vec<Option<State>> = vec![None; states];
    let mut backward: Vec<Option<State>> = vec![None; states];
    // How each state of the left one was reached first.
    let mut arrived: Vec<Option<(State, Label)>> = vec![None; states];
    forward[0] = Some(initial);
    backward[0] = Some(initial);
    let mut order = vec![initial];
    let mut next = 0;
    while let Some(&state) = order.get(next) {
        next += 1;
        let Some(image) = forward[state.index()] else {
            continue;
        };
        if left.is_marked(state) != right.is_marked(image) {
            return Err(Difference::Marked { word: word(&arrived, state) });
        }
        if let Some(event) = enabled_difference(left, state, right, image) {
            return Err(Difference::Enabled { word: word(&arrived, state), event });
        }
        for (edge, other) in left.edges(state).iter().zip(right.edges(image)) {
            let (target, image) = (edge.target, other.target);
            let label = left.label(*edge);
            match (forward[target.index()], backward[image.index()]) {
                (None, None) => {
                    forward[target.index()] = Some(image);
                    backward[image.index()] = Some(target);
                    arrived[target.index()] = Some((state, label));
                    order.push(target);
                }
                (Some(known), _) if known == image => {}
                (known, back) => {
                    let mut other = word(&arrived, state);
                    other.push(label);
                    let first = known.map_or(back, |_| Some(target)).unwrap_or(target);
                    return Err(Difference::Merged { word: word(&arrived, first), other });
                }
            }
        }
    }
    if order.len() < states {
        let name = left.name().to_owned();
        return Err(Difference::Unreachable { name, reached: order.len() });
    }
    Ok(forward.into_iter().flatten().collect())
}

/// The first event that only one of the two states enables.
fn enabled_difference(
    left: &Automaton,
    state: State,
    right: &Automaton,
    image: State,
) -> Option<Label> {
    let mut lefts = left.edges(state).iter().map(|edge| left.label(*edge));
    let mut rights = right.edges(image).iter().map(|edge| right.label(*edge));
    loop {
        match (lefts.next(), rights.next()) {
            (None, None) => return None,
            (Some(one), Some(two)) if one == two => {}
            (one, two) => return one.into_iter().chain(two).min(),
        }
    }
}

fn word(arrived: &[Option<(State, Label)>], state: State) -> Vec<Label> {
    let mut word = Vec::new();
    let mut at = state;
    while let Some((source, label)) = arrived[at.index()] {
        word.push(label);
        at = source;
    }
    word.reverse();
    word
}
