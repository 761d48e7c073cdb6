//! How far a list of states goes.

/// Numbers of states, each with inputs.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Extent {
    /// So many, whatever they are.
    any: usize,
    /// So many, as long as they are [steady](Depths::are_steady).
    steady: usize,
}

impl Extent {
    pub(crate) fn of(states: usize) -> Self {
        Self { any: states, steady: states }
    }

    /// The same, and up to `states` while a scan more finds about as many new states as one before it: timers that begin each other have runs of
    /// many scans and few states, and those that run side by side have more new states with each scan.
    pub(crate) fn while_steady(self, states: usize) -> Self {
        Self { steady: self.any.max(states), ..self }
    }

    /// The bound on the states, while `known` of them are known.
    pub(super) fn bound(self, known: usize, depths: &Depths) -> usize {
        if known > self.any && depths.are_steady() { self.steady } else { self.any }
    }
}

/// How many x are reached within each number of scans.
#[derive(Debug, Default)]
pub(super) struct Depths(Vec<usize>);

impl Depths {
    /// `next` is the x that is scanned next, of `known` ones: with the first x past those of a depth, all of the next depth are known.
    pub(super) fn note(&mut self, next: usize, known: usize) {
        if self.0.last().is_none_or(|&last| next >= last) {
            self.0.push(known);
        }
    }

    /// Whether the last half of the scans found at most 2.5 times as many x as the quarter before them: 2 times where each scan finds as many as the one
    /// before, 4 times where what each finds grows with their number.
    pub(super) fn are_steady(&self) -> bool {
        let Some(last) = self.0.len().checked_sub(1) else {
            return true;
        };
        let [all, half, quarter] = [last, last / 2, last / 4].map(|depth| self.0[depth]);
        2 * (all - half) <= 5 * (half - quarter)
    }
}

#[cfg(test)]
mod tests {
    use super::{Depths, Extent};

    /// The bound after `scans` scans where the scan number n finds `found(n)` states.
    fn bound(scans: usize, found: fn(usize) -> usize) -> usize {
        let (mut depths, mut known) = (Depths::default(), 1_usize);
        for scan in 0..scans {
            depths.note(known.saturating_sub(1), known);
            known += found(scan);
            depths.note(known - 1, known);
        }
        Extent::of(10).while_steady(1000).bound(known, &depths)
    }

    #[test]
    fn a_list_goes_on_where_each_scan_finds_as_many_states() {
        assert_eq!(bound(64, |_| 7), 1000);
        assert_eq!(bound(64, |scan| if scan < 8 { scan } else { 8 }), 1000);
    }

    #[test]
    fn a_list_ends_where_each_scan_finds_more_states() {
        assert_eq!(bound(64, |scan| scan), 10);
        assert_eq!(bound(64, |scan| scan * scan), 10);
    }
}
