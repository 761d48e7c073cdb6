//! A value over cycles, run-length coded, with gaps where it is not known.

use std::collections::VecDeque;

use serde::Serialize;

/// A range of cycles in which something was the same.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct Span<T> {
    /// The first cycle.
    pub from: i64,
    /// The first cycle after it.
    pub to: i64,
    /// What was the same.
    pub value: T,
}

/// Spans in ascending order; at the bound the oldest goes.
#[derive(Debug, Clone)]
pub struct Timeline<T> {
    spans: VecDeque<Span<T>>,
    most: usize,
    /// Whether spans have gone.
    cut: bool,
}

impl<T: Clone + PartialEq> Timeline<T> {
    pub(crate) fn new(most: usize) -> Self {
        Self { spans: VecDeque::new(), most: most.max(1), cut: false }
    }

    /// The value in cycle `at`. A second value of a cycle, or one of an earlier cycle, is ignored.
    pub(crate) fn push(&mut self, at: i64, value: &T) {
        if let Some(last) = self.spans.back_mut() {
            if at < last.to {
                return;
            }
            if at == last.to && last.value == *value {
                last.to = at.saturating_add(1);
                return;
            }
        }
        if self.spans.len() == self.most {
            self.spans.pop_front();
            self.cut = true;
        }
        self.spans.push_back(Span { from: at, to: at.saturating_add(1), value: value.clone() });
    }

    /// Cycles are counted from somewhere else from now on.
    pub(crate) fn shift(&mut self, by: i64) {
        for span in &mut self.spans {
            span.from = span.from.saturating_add(by);
            span.to = span.to.saturating_add(by);
        }
    }

    /// The value in a cycle; binary search.
    pub fn at(&self, cycle: i64) -> Option<&T> {
        let place = self.spans.partition_point(|span| span.to <= cycle);
        let span = self.spans.get(place)?;
        (span.from <= cycle).then_some(&span.value)
    }

    /// What is known of the cycles `from` to below `to`, cut to them.
    pub fn spans(&self, from: i64, to: i64) -> impl Iterator<Item = Span<&T>> {
        let first = self.spans.partition_point(|span| span.to <= from);
        self.spans.range(first..).take_while(move |span| span.from < to).map(move |span| Span {
            from: span.from.max(from),
            to: span.to.min(to),
            value: &span.value,
        })
    }

    /// The first cycle that is known, and the first one behind the last.
    pub fn extent(&self) -> Option<(i64, i64)> {
        Some((self.spans.front()?.from, self.spans.back()?.to))
    }

    /// Whether older cycles were known once.
    pub fn is_cut(&self) -> bool {
        self.cut
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_timeline_is_what_was_pushed() {
        // Every sequence of six cycles, each unknown, 0 or 1, against a plain list.
        for pattern in 0..3_u32.pow(6) {
            let value = |cycle: u32| match pattern / 3_u32.pow(cycle) % 3 {
                2 => None,
                bit => Some(bit),
            };
            let mut timeline = Timeline::new(100);
            for cycle in 0..6 {
                if let Some(value) = value(cycle) {
                    timeline.push(i64::from(cycle), &value);
                    // A second value: the first counts.
                    timeline.push(i64::from(cycle), &7);
                }
            }
            for cycle in 0..6 {
                assert_eq!(timeline.at(i64::from(cycle)).copied(), value(cycle));
            }
            let listed: u32 = timeline
                .spans(1, 5)
                .map(|span| u32::try_from(span.to - span.from).unwrap_or(0))
                .sum();
            assert_eq!(listed, (1..5).filter(|&cycle| value(cycle).is_some()).count() as u32);
        }
    }

    #[test]
    fn the_oldest_go_at_the_bound() {
        let mut timeline = Timeline::new(3);
        for cycle in 0..10 {
            timeline.push(cycle, &(cycle % 2));
        }
        assert_eq!(timeline.extent(), Some((7, 10)));
        assert!(timeline.is_cut());
        assert_eq!(timeline.at(6), None);
    }
}
