//! What of the state is kept over a restart: retentive variables.
//!
//! ```text
//! cold start    x(0)
//! warm start    the slots of retentive variables and the scans since the cold start, all else as in x(0)
//! ```
//!
//! Since a warm start keeps the count of scans, `TIME()` goes on: it is the time that the program has run since its cold start, and a moment that a
//! retentive variable holds is never one of the future. A fault is not kept. A program without retentive variables keeps nothing.

use std::ops::Range;

use crate::form::Program;
use crate::naming::indices;
use crate::scan::SCANS;
use crate::types::Type;

impl Program {
    /// Makes slots of the state retentive.
    pub fn retain(&mut self, slots: Range<u32>) {
        if slots.is_empty() {
            return;
        }
        let first = self.retained.partition_point(|known| known.end < slots.start);
        let behind = self.retained.partition_point(|known| known.start <= slots.end);
        let met = &self.retained[first..behind];
        let start = met.first().map_or(slots.start, |known| known.start.min(slots.start));
        let end = met.last().map_or(slots.end, |known| known.end.max(slots.end));
        self.retained.splice(first..behind, std::iter::once(start..end));
    }

    /// The same program, all of whose variables are retentive.
    pub(crate) fn all_retentive(&self) -> Self {
        let mut whole = self.clone();
        for variable in self.named() {
            let end = variable.slot.saturating_add(variable.of.slots() as u32);
            // What lives in the frames of one scan is no state.
            whole.retain(variable.slot..end.min(self.state));
        }
        whole
    }

    /// Whether each slot of the state is one of a variable that has a name, but for the program's own; what has none cannot be found in a changed
    /// program.
    pub fn has_names_for_all(&self) -> bool {
        let mut whole = self.clone();
        whole.retained.clear();
        whole.retain(Self::HEADER..self.state);
        !whole.has_unnamed_retentive()
    }

    /// Whether a restart keeps anything.
    pub fn is_retentive(&self) -> bool {
        !self.retained.is_empty()
    }

    /// Whether a slot of the state is of a retentive variable.
    pub fn retains(&self, slot: u32) -> bool {
        let behind = self.retained.partition_point(|known| known.start <= slot);
        behind > 0 && self.retained[behind - 1].contains(&slot)
    }

    /// Whether a slot among these is of a retentive variable.
    pub(crate) fn retains_any(&self, slots: Range<u32>) -> bool {
        let behind = self.retained.partition_point(|known| known.end <= slots.start);
        self.retained.get(behind).is_some_and(|known| known.start < slots.end)
    }

    /// Whether a slot is retentive that no variable has.
    pub(crate) fn has_unnamed_retentive(&self) -> bool {
        let mut named = Self { state: self.state, ..Self::default() };
        for variable in self.named() {
            named.retain(variable.slot..variable.slot.saturating_add(variable.of.slots() as u32));
        }
        let is_named = |slots: &Range<u32>| {
            let behind = named.retained.partition_point(|known| known.end <= slots.start);
            named
                .retained
                .get(behind)
                .is_some_and(|known| known.start <= slots.start && slots.end <= known.end)
        };
        !self.retained.iter().all(is_named)
    }

    /// The bits of the state that a warm start keeps; none where no variable is retentive.
    pub fn retentive_mask(&self) -> Vec<u64> {
        let mut mask = vec![0; self.state as usize];
        for known in &self.retained {
            mask[known.start as usize..known.end as usize].fill(u64::MAX);
        }
        if self.is_retentive() {
            mask[SCANS] = u64::MAX;
        }
        mask
    }

    /// The state of a warm start from a state.
    pub fn restarted(&self, state: &[u64]) -> Vec<u64> {
        let kept = self.retentive_mask().into_iter().zip(state);
        let initial = self.initial_state().into_iter();
        initial.zip(kept).map(|(word, (mask, kept))| word & !mask | kept & mask).collect()
    }

    /// The retentive variables, in their order; of one that is retentive in part, each part that is, by its full name.
    pub fn retentive_names(&self) -> Vec<String> {
        let mut names = Vec::new();
        for variable in &self.variables {
            self.add_retentive(&variable.name, &variable.of, variable.slot, &mut names);
        }
        names
    }

    fn add_retentive(&self, name: &str, of: &Type, slot: u32, names: &mut Vec<String>) {
        let end = slot.saturating_add(of.slots() as u32);
        let behind = self.retained.partition_point(|known| known.end <= slot);
        let Some(known) = self.retained.get(behind).filter(|known| known.start < end) else {
            return;
        };
        if known.start <= slot && end <= known.end {
            names.push(name.to_owned());
            return;
        }
        match of {
            Type::Structure(id, _) => {
                for field in &self.structures[id.0 as usize].fields {
                    if !field.is_reference {
                        let name = format!("{name}.{}", field.name);
                        self.add_retentive(&name, &field.of, slot + field.slot, names);
                    }
                }
            }
            Type::Array(array) => {
                let slots = array.element.slots() as u32;
                for element in 0..array.length() {
                    if let Some(indices) = indices(array, element) {
                        let slot = slot + element as u32 * slots;
                        self.add_retentive(
                            &format!("{name}{indices}"),
                            &array.element,
                            slot,
                            names,
                        );
                    }
                }
            }
            _ => {}
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranges_of_slots_are_in_order_and_apart() {
        let slots = 12_u32;
        // Every order of three ranges among all, against a row of flags.
        let ranges: Vec<Range<u32>> =
            (4..slots).flat_map(|start| (start..=slots).map(move |end| start..end)).collect();
        for (at, first) in ranges.iter().enumerate() {
            for (second, third) in ranges.iter().zip(ranges[at..].iter().chain(&ranges[..at])) {
                let mut program = Program { state: slots, ..Program::default() };
                let mut flags = vec![false; slots as usize];
                for range in [first, second, third] {
                    program.retain(range.clone());
                    flags[range.start as usize..range.end as usize].fill(true);
                }
                let found: Vec<bool> = (0..slots).map(|slot| program.retains(slot)).collect();
                assert_eq!(found, flags, "{first:?} {second:?} {third:?}");
                let apart = program.retained.windows(2).all(|pair| pair[0].end < pair[1].start);
                assert!(apart, "{:?}", program.retained);
                flags[SCANS] = program.is_retentive();
                let mask: Vec<bool> =
                    program.retentive_mask().iter().map(|word| *word == u64::MAX).collect();
                assert_eq!(mask, flags);
            }
        }
    }
}
