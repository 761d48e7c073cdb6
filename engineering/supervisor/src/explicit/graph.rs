//! What is reached from where.

use std::collections::VecDeque;

use super::Product;
use crate::alphabet::Label;
use crate::automaton::{Automaton, Edge, State};

/// The transitions backwards: who leads to a state, and whether uncontrollably. 4 bytes each.
pub(crate) struct Predecessors {
    first: Vec<u32>,
    /// The source, its top bit set where the event is uncontrollable.
    sources: Vec<u32>,
}

const UNCONTROLLABLE: u32 = 1 << 31;

impl Predecessors {
    pub(crate) fn new(first: &[u32], edges: &[Edge], is_controllable: &[bool]) -> Self {
        let states = first.len() - 1;
        let mut ends = vec![0_u32; states + 1];
        for edge in edges {
            ends[edge.target.index() + 1] += 1;
        }
        for state in 0..states {
            ends[state + 1] += ends[state];
        }
        let mut sources = vec![0; edges.len()];
        let mut next = ends.clone();
        for source in 0..states {
            for edge in &edges[first[source] as usize..first[source + 1] as usize] {
                let flag = if is_controllable[edge.event as usize] { 0 } else { UNCONTROLLABLE };
                let place = &mut next[edge.target.index()];
                sources[*place as usize] = source as u32 | flag;
                *place += 1;
            }
        }
        Self { first: ends, sources }
    }

    pub(crate) fn of(automaton: &Automaton) -> Self {
        let controllable: Vec<bool> =
            automaton.alphabet().labels().map(Label::is_controllable).collect();
        let (first, edges) = automaton.arrays();
        Self::new(first, edges, &controllable)
    }

    /// The sources of what leads to `state`, and whether uncontrollably.
    pub(crate) fn of_state(&self, state: usize) -> impl Iterator<Item = (usize, bool)> + '_ {
        let range = self.first[state] as usize..self.first[state + 1] as usize;
        self.sources[range]
            .iter()
            .map(|&source| ((source & !UNCONTROLLABLE) as usize, source & UNCONTROLLABLE != 0))
    }
}

/// The states of `within` from which a state of `marked` in `within` can be reached without leaving `within`.
pub(crate) fn coreachable(
    predecessors: &Predecessors,
    marked: &[bool],
    within: &[bool],
) -> Vec<bool> {
    let mut reached = vec![false; marked.len()];
    let mut pending: Vec<usize> =
        (0..marked.len()).filter(|&state| marked[state] && within[state]).collect();
    for &state in &pending {
        reached[state] = true;
    }
    while let Some(state) = pending.pop() {
        for (source, _) in predecessors.of_state(state) {
            if within[source] && !reached[source] {
                reached[source] = true;
                pending.push(source);
            }
        }
    }
    reached
}

/// What is left of an automaton in the states of `keep` that are reached within it, numbered in breadth-first order, and the old
/// number of each. EMPTY where the initial state is not kept.
pub(crate) fn restrict(
    automaton: &Automaton,
    name: String,
    keep: &[bool],
) -> (Automaton, Vec<State>) {
    let unnumbered = u32::MAX;
    let mut numbers = vec![unnumbered; automaton.state_count()];
    let mut order = Vec::new();
    if let Some(initial) = automaton.initial()
        && keep[initial.index()]
    {
        numbers[initial.index()] = 0;
        order.push(initial);
    }
    let mut first = vec![0];
    let mut edges = Vec::new();
    let mut next = 0;
    while let Some(&state) = order.get(next) {
        for edge in automaton.edges(state) {
            let target = edge.target.index();
            if !keep[target] {
                continue;
            }
            if numbers[target] == unnumbered {
                numbers[target] = order.len() as u32;
                order.push(edge.target);
            }
            edges.push(Edge { event: edge.event, target: State::new(numbers[target]) });
        }
        first.push(edges.len() as u32);
        next += 1;
    }
    let marked = order.iter().map(|&state| automaton.is_marked(state)).collect();
    let kept = Automaton::from_parts(name, automaton.alphabet().clone(), marked, first, edges);
    let kept = match automaton.state_names() {
        Some(names) => {
            let names = order.iter().map(|state| names[state.index()].clone()).collect();
            kept.named_states(names)
        }
        None => kept,
    };
    (kept, order)
}

/// A shortest word of `allowed` events from the initial state to one that is `wanted`, and that state.
pub(crate) fn breadth_first_word(
    product: &Product,
    wanted: impl Fn(usize) -> bool,
    allowed: impl Fn(Label) -> bool,
) -> Option<(Vec<Label>, usize)> {
    let none = u32::MAX;
    let mut arrived: Vec<(u32, u32)> = vec![(none, none); product.state_count()];
    let mut pending = VecDeque::new();
    if product.state_count() > 0 {
        pending.push_back(0);
    }
    while let Some(state) = pending.pop_front() {
        if wanted(state) {
            let mut word = Vec::new();
            let mut at = state;
            while at != 0 {
                let (source, event) = arrived[at];
                word.push(product.alphabet.event(event).label);
                at = source as usize;
            }
            word.reverse();
            return Some((word, state));
        }
        for edge in product.edges(state) {
            let target = edge.target.index();
            let label = product.alphabet.event(edge.event).label;
            if allowed(label) && target != 0 && arrived[target].0 == none {
                arrived[target] = (state as u32, edge.event);
                pending.push_back(target);
            }
        }
    }
    None
}
