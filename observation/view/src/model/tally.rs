//! The deadlines of one program by the source of its outputs, up to each cycle that is remembered.
//!
//! The rule is that of the report: each cycle counts once, from the origin of the run on; without an origin from the first record on.

use std::collections::VecDeque;

use understudy_journal::SourceCounts;
use understudy_wire::Source;

/// Cycles in a row with one source.
#[derive(Debug, Clone, Copy)]
struct Row {
    from: i64,
    to: i64,
    source: Source,
    /// The deadlines before `from`.
    before: SourceCounts,
}

impl Row {
    /// The deadlines before `cycle`, which is in this row or behind it.
    fn before(&self, cycle: i64) -> SourceCounts {
        let mut counts = self.before;
        let cycles = self.to.min(cycle).saturating_sub(self.from);
        counts.add(self.source, u64::try_from(cycles).unwrap_or(0));
        counts
    }
}

#[derive(Debug, Clone)]
pub(crate) struct Tally {
    rows: VecDeque<Row>,
    most: usize,
    /// The deadlines before the origin.
    before_origin: SourceCounts,
}

impl Tally {
    pub(crate) fn new(most: usize) -> Self {
        Self {
            rows: VecDeque::new(),
            most: most.max(1),
            before_origin: SourceCounts::default(),
        }
    }

    /// The source in cycle `at`. A second record of a cycle, or one of an earlier cycle, is ignored.
    pub(crate) fn push(&mut self, at: i64, source: Source) {
        match self.rows.back_mut() {
            Some(last) if at < last.to => return,
            Some(last) if at == last.to && last.source == source => last.to = at.saturating_add(1),
            last => {
                let before = last.map_or_else(SourceCounts::default, |last| last.before(at));
                if self.rows.len() == self.most {
                    self.rows.pop_front();
                }
                self.rows.push_back(Row {
                    from: at,
                    to: at.saturating_add(1),
                    source,
                    before,
                });
            }
        }
        if at < 0 {
            self.before_origin = self.until(at);
        }
    }

    /// The deadlines from the origin up to and including `cycle`.
    pub(crate) fn counts(&self, cycle: i64) -> SourceCounts {
        self.until(cycle).since(self.before_origin)
    }

    /// The first cycle of those in a row that have the source of `cycle`.
    pub(crate) fn since(&self, cycle: i64) -> Option<i64> {
        let row = self.row_at(cycle)?;
        (cycle < row.to).then_some(row.from)
    }

    fn row_at(&self, cycle: i64) -> Option<&Row> {
        let place = self.rows.partition_point(|row| row.from <= cycle);
        self.rows.get(place.checked_sub(1)?)
    }

    fn until(&self, cycle: i64) -> SourceCounts {
        match self.row_at(cycle) {
            Some(row) => row.before(cycle.saturating_add(1)),
            None => self
                .rows
                .front()
                .map_or_else(SourceCounts::default, |row| row.before),
        }
    }

    /// Cycles are counted from somewhere else from now on.
    pub(crate) fn shift(&mut self, by: i64) {
        for row in &mut self.rows {
            row.from = row.from.saturating_add(by);
            row.to = row.to.saturating_add(by);
        }
        self.before_origin = self.until(-1);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SOURCES: [Source; 2] = [Source::Direct, Source::Held];

    #[test]
    fn a_tally_counts_each_cycle_once_from_the_origin() {
        // Every sequence of six cycles, each without a deadline, direct or held, and every origin among them, against plain loops.
        for pattern in 0..3_u32.pow(6) {
            let source = |cycle: u32| SOURCES.get(pattern as usize / 3_usize.pow(cycle) % 3);
            for origin in 0..6 {
                let mut tally = Tally::new(100);
                for cycle in 0..6 {
                    if let Some(source) = source(cycle) {
                        tally.push(i64::from(cycle), *source);
                        tally.push(i64::from(cycle), Source::FailSafe);
                    }
                }
                tally.shift(-i64::from(origin));
                for until in origin..6 {
                    let mut expected = SourceCounts::default();
                    for source in (origin..=until).filter_map(source) {
                        expected.add(*source, 1);
                    }
                    assert_eq!(tally.counts(i64::from(until) - i64::from(origin)), expected);
                }
            }
        }
    }

    #[test]
    fn what_is_forgotten_stays_counted() {
        let mut tally = Tally::new(2);
        for cycle in -3..10 {
            tally.push(cycle, SOURCES[cycle.rem_euclid(2) as usize]);
        }
        let counts = tally.counts(9);
        assert_eq!((counts.direct, counts.held), (5, 5));
        assert_eq!(tally.since(9), Some(9));
        assert_eq!(tally.since(10), None);
    }
}
