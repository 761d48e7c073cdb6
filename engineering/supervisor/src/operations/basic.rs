use crate::alphabet::{Alphabet, Event, Label};
use crate::automaton::{Automaton, Edge, State};
use crate::explicit::{Predecessors, coreachable, restrict};

/// An event that an automaton has already cannot be made to pass it by.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error(
    "U0807: {automaton} has event {event} already; a self-loop at every state would make it nondeterministic"
)]
pub struct AlreadyKnown {
    /// The automaton.
    pub automaton: String,
    /// The event's name.
    pub event: String,
}

impl AlreadyKnown {
    /// Stable code for people.
    pub fn code(&self) -> &'static str {
        "U0807"
    }
}

/// `selfloop`: a transition of each of `events` from every state to itself, so that they pass the automaton by.
///
/// # Errors
/// It knows one of the events already.
pub fn selfloop(automaton: &Automaton, events: &[Event]) -> Result<Automaton, AlreadyKnown> {
    let known = events.iter().find(|event| automaton.alphabet().contains(event.label));
    if let Some(event) = known {
        return Err(AlreadyKnown {
            automaton: automaton.name().to_owned(),
            event: automaton.alphabet().name(event.label),
        });
    }
    let added = Alphabet::new(events.iter().cloned());
    let alphabet = automaton.alphabet().union([&added]);
    // The union holds every event of both.
    let place = |label: Label| alphabet.place(label).unwrap_or_default();
    let places: Vec<u32> = automaton.alphabet().labels().map(place).collect();
    let loops: Vec<u32> = added.labels().map(place).collect();
    let mut first = vec![0];
    let mut edges =
        Vec::with_capacity(automaton.transition_count() + automaton.state_count() * loops.len());
    for state in automaton.states() {
        let start = edges.len();
        edges.extend(
            automaton
                .edges(state)
                .iter()
                .map(|edge| Edge { event: places[edge.event as usize], target: edge.target }),
        );
        edges.extend(loops.iter().map(|&event| Edge { event, target: state }));
        edges[start..].sort_unstable_by_key(|edge: &Edge| edge.event);
        first.push(edges.len() as u32);
    }
    let marked = automaton.states().map(|state| automaton.is_marked(state)).collect();
    let looped =
        Automaton::from_parts(automaton.name().to_owned(), alphabet.clone(), marked, first, edges);
    Ok(match automaton.state_names() {
        Some(names) => looped.named_states(names.to_vec()),
        None => looped,
    })
}

/// `allevents`: one marked state that allows every event of `alphabet`.
pub fn allevents(alphabet: &Alphabet) -> Automaton {
    let edges = (0..alphabet.len() as u32).map(|event| Edge { event, target: State::INITIAL });
    let edges: Vec<Edge> = edges.collect();
    let first = vec![0, edges.len() as u32];
    Automaton::from_parts("ALLEVENTS".to_owned(), alphabet.clone(), vec![true], first, edges)
}

/// What can be reached from the initial state.
pub fn reachable(automaton: &Automaton) -> Automaton {
    let all = vec![true; automaton.state_count()];
    restrict(automaton, automaton.name().to_owned(), &all).0
}

/// `trim`: what can be reached and from where a marked state can be reached; EMPTY where that leaves no initial state.
pub fn trim(automaton: &Automaton) -> Automaton {
    let marked: Vec<bool> = automaton.states().map(|state| automaton.is_marked(state)).collect();
    let all = vec![true; marked.len()];
    let keep = coreachable(&Predecessors::of(automaton), &marked, &all);
    restrict(automaton, automaton.name().to_owned(), &keep).0
}
