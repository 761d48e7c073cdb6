//! In which positions the switches can be when a supervisor is in a state.

use super::map::InputOutputMap;
use super::partition::{MAXIMUM_POSITIONS, Meaning, Partition};
use crate::{Automaton, State};

/// For each state and switch the set of positions that some path from the start brings it to; bit k is position k.
///
/// Only what the events of this automaton do is counted, so the automaton must know all events of the switches.
#[derive(Debug)]
pub(crate) struct Positions {
    sets: Vec<Vec<u64>>,
}

impl Positions {
    /// Follows all transitions from the initial state until nothing is new.
    pub(crate) fn of(automaton: &Automaton, map: &InputOutputMap, partition: &Partition) -> Self {
        const { assert!(MAXIMUM_POSITIONS < 64) };
        let mut sets = vec![vec![0_u64; map.switches.len()]; automaton.state_count()];
        let mut pending = Vec::new();
        if let Some(initial) = automaton.initial() {
            sets[initial.index()].fill(1);
            pending.push(initial);
        }
        while let Some(source) = pending.pop() {
            for &edge in automaton.edges(source) {
                let mut arriving = sets[source.index()].clone();
                if let Some(Meaning::Switch { switch, position }) =
                    partition.meaning(automaton.label(edge))
                {
                    arriving[switch] = 1 << position;
                }
                let target = &mut sets[edge.target.index()];
                let mut is_new = false;
                for (known, arriving) in target.iter_mut().zip(arriving) {
                    is_new |= arriving & !*known != 0;
                    *known |= arriving;
                }
                if is_new {
                    pending.push(edge.target);
                }
            }
        }
        Self { sets }
    }

    /// Whether `switch` can be in `position` in `state`.
    pub(crate) fn possible(&self, state: State, switch: usize, position: usize) -> bool {
        self.sets[state.index()][switch] >> position & 1 == 1
    }
}
