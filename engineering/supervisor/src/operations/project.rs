use std::collections::{BTreeSet, HashMap};

use super::minstate::minstate;
use crate::alphabet::{Alphabet, Label};
use crate::automaton::{Automaton, Edge, State};
use crate::explicit::{Bounds, TooLarge};

/// `project`: what is seen of `automaton` when the events in `hidden` are not seen, with as few states as possible. A set of states is
/// marked when one of them is.
///
/// # Errors
/// Subsets of states can be exponentially many: past `bounds` the construction stops.
pub fn project(
    automaton: &Automaton,
    hidden: &[Label],
    bounds: Bounds,
) -> Result<Automaton, TooLarge> {
    Ok(minstate(&Subsets::of(automaton, hidden, bounds)?.automaton))
}

/// States of an observer that are named in its state's name, at most.
const MAXIMUM_NAMED: usize = 12;

/// The observer of `automaton`: each state is the set of states in which it may be after what was seen, where the events in `hidden` are
/// not. The name of a state is that set. A set is marked when one of its states is.
///
/// # Errors
/// As of [`project`].
pub fn observer(
    automaton: &Automaton,
    hidden: &[Label],
    bounds: Bounds,
) -> Result<Automaton, TooLarge> {
    let Subsets { automaton: observer, sets } = Subsets::of(automaton, hidden, bounds)?;
    let named = sets.iter().enumerate().map(|(number, set)| {
        let names = set.iter().take(MAXIMUM_NAMED);
        let names: Vec<_> = names.map(|&state| automaton.state_name(state)).collect();
        let names = names.join(",");
        match set.len() {
            0..=MAXIMUM_NAMED => format!("{{{names}}}"),
            count => format!("{{{names},…}}:{count}:{number}"),
        }
    });
    let names = named.collect();
    Ok(observer.named_states(names))
}

/// The automaton of the sets of states that cannot be told apart.
pub(super) struct Subsets {
    pub(super) automaton: Automaton,
    /// The states in each of its states, ascending.
    pub(super) sets: Vec<Box<[State]>>,
}

impl Subsets {
    pub(super) fn of(
        automaton: &Automaton,
        hidden: &[Label],
        bounds: Bounds,
    ) -> Result<Self, TooLarge> {
        let visible = automaton.alphabet().events().iter();
        let alphabet =
            Alphabet::new(visible.filter(|event| !hidden.contains(&event.label)).cloned());
        // The place in the projected alphabet of each event, where it is seen.
        let places: Vec<Option<u32>> =
            automaton.alphabet().labels().map(|label| alphabet.place(label)).collect();
        let Some(initial) = automaton.initial() else {
            let automaton = Automaton::empty(automaton.name(), alphabet);
            return Ok(Self { automaton, sets: Vec::new() });
        };
        let mut numbers: HashMap<Box<[State]>, u32> = HashMap::new();
        let mut sets: Vec<Box<[State]>> = Vec::new();
        let start = closure(automaton, &places, [initial]);
        numbers.insert(start.clone(), 0);
        sets.push(start);
        let mut bytes = 0;
        let mut first = vec![0];
        let mut edges = Vec::new();
        let mut next = 0;
        while next < sets.len() {
            let mut targets: Vec<BTreeSet<State>> = vec![BTreeSet::new(); alphabet.len()];
            for &state in &sets[next] {
                for edge in automaton.edges(state) {
                    if let Some(place) = places[edge.event as usize] {
                        targets[place as usize].insert(edge.target);
                    }
                }
            }
            for (event, targets) in targets.into_iter().enumerate() {
                if targets.is_empty() {
                    continue;
                }
                let set = closure(automaton, &places, targets);
                let number = *numbers.entry(set.clone()).or_insert_with(|| {
                    bytes += 2 * set.len() * size_of::<State>() + 64;
                    sets.push(set);
                    sets.len() as u32 - 1
                });
                edges.push(Edge { event: event as u32, target: State::new(number) });
            }
            first.push(edges.len() as u32);
            next += 1;
            if bytes + edges.len() * 12 > bounds.memory_bytes {
                return Err(TooLarge::Memory {
                    states: sets.len(),
                    transitions: edges.len(),
                    memory_bytes: bounds.memory_bytes,
                });
            }
        }
        let is_marked = |set: &[State]| set.iter().any(|&state| automaton.is_marked(state));
        let marked = sets.iter().map(|set| is_marked(set)).collect();
        let name = automaton.name().to_owned();
        let automaton = Automaton::from_parts(name, alphabet, marked, first, edges);
        Ok(Self { automaton, sets })
    }
}

/// The states that are reached from `states` by events that are not seen, ascending.
fn closure(
    automaton: &Automaton,
    places: &[Option<u32>],
    states: impl IntoIterator<Item = State>,
) -> Box<[State]> {
    let mut reached: BTreeSet<State> = states.into_iter().collect();
    let mut pending: Vec<State> = reached.iter().copied().collect();
    while let Some(state) = pending.pop() {
        for edge in automaton.edges(state) {
            if places[edge.event as usize].is_none() && reached.insert(edge.target) {
                pending.push(edge.target);
            }
        }
    }
    reached.into_iter().collect()
}
