//! What the figure shows: signals over cycles, as lists of changes.

use understudy_wire::Image;

/// Cycles that are kept for the figure.
pub(crate) const TRACED_CYCLES: u64 = 5_000;

/// A signal that is at times not there.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Trace<T> {
    changes: Vec<(u64, Option<T>)>,
    /// The first cycle that nothing is known of.
    end: u64,
}

impl<T> Default for Trace<T> {
    fn default() -> Self {
        Self { changes: Vec::new(), end: 0 }
    }
}

impl<T: Clone + PartialEq> Trace<T> {
    /// The value in cycle `at`; an older one than the last is ignored, and so is one past the bound.
    pub(crate) fn push(&mut self, at: u64, value: &T) {
        if at >= TRACED_CYCLES || at < self.end {
            return;
        }
        if at > self.end {
            self.change(self.end, None);
        }
        if self.changes.last().is_none_or(|(_, last)| last.as_ref() != Some(value)) {
            self.change(at, Some(value.clone()));
        }
        self.end = at + 1;
    }

    fn change(&mut self, at: u64, value: Option<T>) {
        self.changes.push((at, value));
    }

    /// Ranges of cycles with their values; gaps are left out.
    pub(crate) fn spans(&self) -> impl Iterator<Item = (u64, u64, &T)> {
        let ends = self.changes.iter().skip(1).map(|(at, _)| *at).chain([self.end]);
        self.changes
            .iter()
            .zip(ends)
            .filter_map(|((from, value), to)| value.as_ref().map(|value| (*from, to, value)))
    }
}

/// The signals of a run.
#[derive(Debug, Clone, Default)]
pub(crate) struct Traces {
    /// By program: sensors and positions.
    pub(crate) plants: Vec<PlantTrace>,
    /// By rank: a controller's outputs, or an understudy's widest word.
    pub(crate) stations: Vec<Trace<Image>>,
}

/// Of one plant.
#[derive(Debug, Clone, Default)]
pub(crate) struct PlantTrace {
    /// Sensors; u(i) where the program has other inputs as well.
    pub(crate) sensors: Trace<Image>,
    pub(crate) positions: Trace<Vec<u16>>,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_trace_keeps_changes_and_gaps() {
        let mut trace = Trace::default();
        for (at, value) in [(1, 'a'), (2, 'a'), (3, 'b'), (2, 'x'), (6, 'b'), (7, 'c')] {
            trace.push(at, &value);
        }
        let spans: Vec<_> = trace.spans().map(|(from, to, value)| (from, to, *value)).collect();
        assert_eq!(spans, [(1, 3, 'a'), (3, 4, 'b'), (6, 7, 'b'), (7, 8, 'c')]);
    }
}
