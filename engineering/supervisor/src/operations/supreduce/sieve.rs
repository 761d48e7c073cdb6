//! Which states a cell can be merged with at all, found for all states at once by sets of them.
//!
//! What a state alone asks for, its cell asks for as well, and a closed cell never changes. So every state that is left out here would be
//! refused in the first step of an attempt. In plants without structure that is nearly all of them.

use understudy_logic::ones_in;

use super::cells::Cells;
use super::demands::Demands;
use crate::automaton::{Automaton, State};
use crate::explicit::Predecessors;

/// Sets of states as bits by their places in the order of the attempts.
pub(super) struct Sieve<'a> {
    supervisor: &'a Automaton,
    predecessors: Predecessors,
    order: &'a [State],
    /// The place of each state.
    places: Vec<u32>,
    /// Words of a set.
    words: usize,
    /// For each contested event the states that enable it, and those that disable it.
    enabling: Vec<u64>,
    disabling: Vec<u64>,
    /// For each event the states that have a target, and those whose target is in a closed cell.
    defined: Vec<u64>,
    into_closed: Vec<u64>,
    /// Cells that can still change, as far as it is known.
    open: Vec<u64>,
    /// The result of [`Self::sift`].
    left: Vec<u64>,
    /// One of the sets that are left out.
    out: Vec<u64>,
}

impl<'a> Sieve<'a> {
    pub(super) fn new(supervisor: &'a Automaton, demands: &Demands, order: &'a [State]) -> Self {
        let states = order.len();
        let words = states.div_ceil(64);
        let events = supervisor.alphabet().len();
        let half = demands.words / 2;
        let mut places = vec![0; states];
        for (place, state) in (0..).zip(order) {
            places[state.index()] = place;
        }
        let mut sieve = Self {
            supervisor,
            predecessors: Predecessors::of(supervisor),
            order,
            places,
            words,
            enabling: vec![0; 64 * half * words],
            disabling: vec![0; 64 * half * words],
            defined: vec![0; events * words],
            into_closed: vec![0; events * words],
            open: vec![0; words],
            left: vec![0; words],
            out: vec![0; words],
        };
        for (place, state) in order.iter().enumerate() {
            insert(&mut sieve.open, place);
            let asked = &demands.sets[state.index() * demands.words..][..demands.words];
            let (enabled, disabled) = asked.split_at(half);
            for (asked, sets) in [(enabled, &mut sieve.enabling), (disabled, &mut sieve.disabling)]
            {
                for event in ones_in(asked) {
                    insert(&mut sets[event * words..], place);
                }
            }
            for edge in supervisor.edges(*state) {
                insert(&mut sieve.defined[edge.event as usize * words..], place);
            }
        }
        sieve
    }

    /// Words of a set.
    pub(super) fn words(&self) -> usize {
        self.words
    }

    /// Finds the states with which the cell of `root` can be merged: [`Self::left`].
    pub(super) fn sift(&mut self, cells: &Cells, root: u32) {
        let words = self.words;
        self.left.copy_from_slice(&self.open);
        let (enables, disables) = cells.demands_of(root);
        for (asked, against) in [(enables, &self.disabling), (disables, &self.enabling)] {
            for event in ones_in(asked) {
                leave_out(&mut self.left, &against[event * words..]);
            }
        }
        for (event, target) in cells.targets_of(root) {
            if !cells.is_closed(target) {
                leave_out(&mut self.left, &self.into_closed[event * words..]);
                continue;
            }
            // The states that have the event go elsewhere, except those that go to the same cell.
            self.out.copy_from_slice(&self.defined[event * words..][..words]);
            for member in cells.members(target) {
                for (source, _) in self.predecessors.of_state(member as usize) {
                    let source = State::new(source as u32);
                    let reached = self.supervisor.successor(source, event as u32);
                    if reached == Some(State::new(member)) {
                        let place = self.places[source.index()] as usize;
                        self.out[place / 64] &= !(1 << (place % 64));
                    }
                }
            }
            leave_out(&mut self.left, &self.out);
        }
    }

    /// A word of the set of states that [`Self::sift`] has left.
    pub(super) fn left(&self, word: usize) -> u64 {
        self.left[word]
    }

    /// The state at a place of the order.
    pub(super) fn state(&self, place: usize) -> State {
        self.order[place]
    }

    /// The state at this place is no cell that can change any more.
    pub(super) fn forget(&mut self, place: usize) {
        self.open[place / 64] &= !(1 << (place % 64));
    }

    /// The cell of `root` was closed.
    pub(super) fn close(&mut self, cells: &Cells, root: u32) {
        for member in cells.members(root) {
            self.forget(self.places[member as usize] as usize);
            for (source, _) in self.predecessors.of_state(member as usize) {
                let edges = self.supervisor.edges(State::new(source as u32)).iter();
                for edge in edges.filter(|edge| edge.target.number() == member) {
                    let set = &mut self.into_closed[edge.event as usize * self.words..];
                    insert(set, self.places[source] as usize);
                }
            }
        }
    }
}

fn insert(set: &mut [u64], place: usize) {
    set[place / 64] |= 1 << (place % 64);
}

fn leave_out(left: &mut [u64], out: &[u64]) {
    for (left, out) in left.iter_mut().zip(out) {
        *left &= !out;
    }
}
