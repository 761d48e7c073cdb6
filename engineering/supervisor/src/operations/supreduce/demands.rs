//! What each state of a supervisor asks for: E(x) and D(x) of Su and Wonham.

use crate::automaton::Automaton;
use crate::explicit::{Bounds, Joint, Product, TooLarge};

/// For each state what it enables, then what it disables, as bit sets over the *contested* events: those that some state enables and
/// another one disables. Marking is one more such event: a state that marks where the plant does enables it; one that does not where
/// the plant does disables it.
pub(super) struct Demands {
    /// Words of a state.
    pub(super) words: usize,
    pub(super) sets: Vec<u64>,
}

impl Demands {
    pub(super) fn new(
        plant: &Automaton,
        supervisor: &Automaton,
        bounds: Bounds,
    ) -> Result<Self, TooLarge> {
        let all = Self::of_all_events(plant, supervisor, bounds)?;
        Ok(all.contested(supervisor.alphabet().len() + 1))
    }

    fn of_all_events(
        plant: &Automaton,
        supervisor: &Automaton,
        bounds: Bounds,
    ) -> Result<Self, TooLarge> {
        let product = Product::explore(&[plant, supervisor], &[], Joint::Meet, bounds)?;
        let alphabet = supervisor.alphabet();
        let marking = alphabet.len();
        let words = 2 * (marking + 1).div_ceil(64);
        let mut demands = Self { words, sets: vec![0; supervisor.state_count() * words] };
        for number in 0..product.state_count() {
            let of_plant = product.component_state(number, 0);
            let state = product.component_state(number, 1);
            for edge in plant.edges(of_plant) {
                if let Some(event) = alphabet.place(plant.label(*edge)) {
                    let allowed = supervisor.successor(state, event).is_some();
                    demands.set(state.index(), event as usize, allowed);
                }
            }
            if plant.is_marked(of_plant) {
                demands.set(state.index(), marking, supervisor.is_marked(state));
            }
        }
        for state in supervisor.states() {
            for edge in supervisor.edges(state) {
                demands.set(state.index(), edge.event as usize, true);
            }
        }
        Ok(demands)
    }

    /// The same over the contested ones of `count` events: no two states clash about any other.
    fn contested(&self, count: usize) -> Self {
        let states = self.sets.len() / self.words;
        let some =
            |event: usize, enabled: bool| (0..states).any(|state| self.has(state, event, enabled));
        let contested: Vec<usize> =
            (0..count).filter(|&event| some(event, true) && some(event, false)).collect();
        let words = 2 * contested.len().div_ceil(64).max(1);
        let mut found = Self { words, sets: vec![0; states * words] };
        for state in 0..states {
            for (place, &event) in contested.iter().enumerate() {
                for enabled in [true, false] {
                    if self.has(state, event, enabled) {
                        found.set(state, place, enabled);
                    }
                }
            }
        }
        found
    }

    fn place(&self, state: usize, event: usize, enabled: bool) -> usize {
        let half = if enabled { 0 } else { self.words / 2 };
        state * self.words + half + event / 64
    }

    fn has(&self, state: usize, event: usize, enabled: bool) -> bool {
        self.sets[self.place(state, event, enabled)] >> (event % 64) & 1 != 0
    }

    fn set(&mut self, state: usize, event: usize, enabled: bool) {
        let place = self.place(state, event, enabled);
        self.sets[place] |= 1 << (event % 64);
    }
}
