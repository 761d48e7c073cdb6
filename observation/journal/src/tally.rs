//! The deadlines of one program by the source of its outputs, up to each cycle that is remembered.
//!
//! The rule is that of the report: each cycle counts once, from the origin of the run on; without an origin from the first record on.

use std::collections::VecDeque;

use serde::{Deserialize, Serialize};
use understudy_wire::Source;

use crate::rules::SourceCounts;

/// The deadlines of a program up to now, as a journal tells them that continues another.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Deadlines {
    /// The first cycle of the newest ones in a row with one source.
    pub since: i64,
    /// The time of its record.
    pub since_ns: u64,
    /// The cycle after the newest one.
    pub until: i64,
    /// The source of all of these.
    pub source: Source,
    /// The deadlines from the origin up to `since`; none where that is before the origin.
    pub before: SourceCounts,
}

/// Cycles in a row with one source.
#[derive(Debug, Clone, Copy)]
struct Row {
    from: i64,
    from_ns: u64,
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

/// The deadlines of one program by source.
#[derive(Debug, Clone)]
pub struct Tally {
    rows: VecDeque<Row>,
    most: usize,
    /// The deadlines before the origin.
    before_origin: SourceCounts,
}

impl Tally {
    /// A tally that remembers so many rows; those before stay counted.
    pub fn new(most: usize) -> Self {
        Self { rows: VecDeque::new(), most: most.max(1), before_origin: SourceCounts::default() }
    }

    /// Goes on from deadlines that were counted before.
    pub fn continues(&mut self, counted: &Deadlines) {
        self.before_origin = SourceCounts::default();
        let before = counted.until.min(0).saturating_sub(counted.since);
        self.before_origin.add(counted.source, u64::try_from(before).unwrap_or(0));
        self.rows.clear();
        self.rows.push_back(Row {
            from: counted.since,
            from_ns: counted.since_ns,
            to: counted.until,
            source: counted.source,
            before: counted.before,
        });
    }

    /// The deadlines so far; nothing before the first.
    pub fn deadlines(&self) -> Option<Deadlines> {
        let last = self.rows.back()?;
        Some(Deadlines {
            since: last.from,
            since_ns: last.from_ns,
            until: last.to,
            source: last.source,
            before: match last.from {
                ..0 => SourceCounts::default(),
                _ => last.before.since(self.before_origin),
            },
        })
    }

    /// The source in cycle `at`, by a record of the time `at_ns`. A second record of a cycle, or one of an earlier cycle, is ignored.
    pub fn push(&mut self, at: i64, source: Source, at_ns: u64) {
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
                    from_ns: at_ns,
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
    pub fn counts(&self, cycle: i64) -> SourceCounts {
        self.until(cycle).since(self.before_origin)
    }

    /// The first cycle of those in a row that have the source of `cycle`.
    pub fn since(&self, cycle: i64) -> Option<i64> {
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
            None => self.rows.front().map_or_else(SourceCounts::default, |row| row.before),
        }
    }

    /// Cycles are counted from somewhere else from now on.
    pub fn shift(&mut self, by: i64) {
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
                        tally.push(i64::from(cycle), *source, 0);
                        tally.push(i64::from(cycle), Source::FailSafe, 0);
                    }
                }
                tally.shift(-i64::from(origin));
                for cut in 0..6 {
                    // Cut anywhere, and continued.
                    let mut first = Tally::new(100);
                    let mut rest = Tally::new(100);
                    for cycle in 0..6 {
                        let to = if cycle < cut { &mut first } else { &mut rest };
                        if cycle == cut {
                            to.shift(0);
                            if let Some(deadlines) = first.deadlines() {
                                rest.continues(&deadlines);
                            }
                        }
                        let to = if cycle < cut { &mut first } else { &mut rest };
                        if let Some(source) = source(cycle) {
                            to.push(i64::from(cycle) - i64::from(origin), *source, 0);
                        }
                    }
                    let last = i64::from(5 - origin);
                    assert_eq!(rest.counts(last), tally.counts(last), "cut at {cut}");
                    assert_eq!(rest.since(last), tally.since(last), "cut at {cut}");
                }
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
            tally.push(cycle, SOURCES[cycle.rem_euclid(2) as usize], 0);
        }
        let counts = tally.counts(9);
        assert_eq!((counts.direct, counts.held), (5, 5));
        assert_eq!(tally.since(9), Some(9));
        assert_eq!(tally.since(10), None);
    }
}
