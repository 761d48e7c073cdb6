//! Which states a cell can be merged with at all, found for all states at once by sets of them.
//!
//! What a state alone asks for, its cell asks for as well, and a closed cell never changes. So whoever is left out here would be refused in
//! the first step of an attempt. Of plants without structure that is nearly everybody.

use super::cells::{Cells, bits};
use super::demands::Demands;
use crate::automaton::{Automaton, State};

/// Sets of states as bits by their places in the order of the attempts.
pub(super) struct Sieve {
    /// Words of a set.
    words: usize,
    order: Vec<State>,
    /// The place of each state.
    places: Vec<u32>,
    /// For each contested event who enables it, and who disables it.
    enabling: Vec<u64>,
    disabling: Vec<u64>,
    /// For each event who has a target, and whose target is in a closed cell.
    defined: Vec<u64>,
    into_closed: Vec<u64>,
    /// The events into each state with their sources, from `first[state]` on.
    sources: Vec<(u32, u32)>,
    first: Vec<usize>,
    /// Cells that can still change, as far as it is known.
    open: Vec<u64>,
    /// What is left.
    left: Vec<u64>,
    /// One of the sets that are left out.
    out: Vec<u64>,
}

impl Sieve {
    pub(super) fn new(supervisor: &Automaton, demands: &Demands, order: &[State]) -> Self {
        let states = order.len();
        let words = states.div_ceil(64);
        let events = supervisor.alphabet().len();
        let half = demands.words / 2;
        let mut places = vec![0; states];
        for (place, state) in (0..).zip(order) {
            places[state.index()] = place;
        }
        let mut sieve = Self {
            words,
            order: order.to_vec(),
            places,
            enabling: vec![0; 64 * half * words],
            disabling: vec![0; 64 * half * words],
            defined: vec![0; events * words],
            into_closed: vec![0; events * words],
            sources: Vec::new(),
            first: vec![0; states + 1],
            open: vec![0; words],
            left: vec![0; words],
            out: vec![0; words],
        };
        let mut sources = Vec::with_capacity(supervisor.transition_count());
        for state in supervisor.states() {
            let place = sieve.places[state.index()] as usize;
            insert(&mut sieve.open, place);
            let asked = &demands.sets[state.index() * demands.words..][..demands.words];
            for word in 0..half {
                for bit in bits(asked[word]) {
                    insert(&mut sieve.enabling[(64 * word + bit) * words..], place);
                }
                for bit in bits(asked[half + word]) {
                    insert(&mut sieve.disabling[(64 * word + bit) * words..], place);
                }
            }
            for edge in supervisor.edges(state) {
                insert(&mut sieve.defined[edge.event as usize * words..], place);
                sources.push((edge.target, edge.event, state.number()));
            }
        }
        sources.sort_unstable();
        for (target, ..) in &sources {
            sieve.first[target.index() + 1] += 1;
        }
        for state in 0..states {
            sieve.first[state + 1] += sieve.first[state];
        }
        let sources = sources
            .into_iter()
            .map(|(_, event, source)| (event, source));
        sieve.sources = sources.collect();
        sieve
    }

    /// Words that [`Self::sift`] looks at, at least.
    pub(super) fn words(&self) -> usize {
        self.words
    }

    /// Finds whom the cell of `root` can be merged with; [`Self::state`] tells them.
    pub(super) fn sift(&mut self, cells: &Cells, root: u32) {
        let words = self.words;
        self.left.copy_from_slice(&self.open);
        let (enables, disables) = cells.demands_of(root);
        for (asked, against) in [(enables, &self.disabling), (disables, &self.enabling)] {
            for (word, &asked) in asked.iter().enumerate() {
                for bit in bits(asked) {
                    leave_out(&mut self.left, &against[(64 * word + bit) * words..]);
                }
            }
        }
        for (event, target) in cells.targets_of(root) {
            if !cells.is_closed(target) {
                leave_out(&mut self.left, &self.into_closed[event * words..]);
                continue;
            }
            // Whoever has the event goes elsewhere, but for those who go to the same cell.
            self.out
                .copy_from_slice(&self.defined[event * words..][..words]);
            for member in cells.members(target) {
                let all =
                    &self.sources[self.first[member as usize]..self.first[member as usize + 1]];
                let begin = all.partition_point(|(known, _)| (*known as usize) < event);
                let same = all[begin..].iter();
                for (_, source) in same.take_while(|(known, _)| *known as usize == event) {
                    let place = self.places[*source as usize] as usize;
                    self.out[place / 64] &= !(1 << (place % 64));
                }
            }
            leave_out(&mut self.left, &self.out);
        }
    }

    /// The states of word `word` of those who are left.
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
            for &(event, source) in
                &self.sources[self.first[member as usize]..self.first[member as usize + 1]]
            {
                let set = &mut self.into_closed[event as usize * self.words..];
                insert(set, self.places[source as usize] as usize);
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
