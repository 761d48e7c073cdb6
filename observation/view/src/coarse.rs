//! The least and the greatest value of each signal over ranges of cycles: trends of hours from a bounded memory.
//!
//! ```text
//!   cycles ──► 32 a range ──► 128 ──► 512 ──► … ──► 131072, the newest MOST ranges of each length
//! ```
//!
//! Invariant: the value of every cycle lies between the least and the greatest value of each range that contains the cycle, so no peak is lost.

use std::collections::VecDeque;

use understudy_typed::{Elementary, Point, Points};
use understudy_wire::Image;

use crate::value::real_of;

/// Cycles of the shortest range.
const SHORTEST: i64 = 32;

/// The length of a range, as a multiple of the next shorter length.
const RATIO: i64 = 4;

/// Lengths of ranges.
const LEVELS: usize = 7;

/// Ranges of each length that are kept, at most.
const MOST: usize = 512;

/// The least and the greatest value.
pub type Extremes = (f64, f64);

/// The extremes of both.
pub(crate) fn widened(one: Extremes, other: Extremes) -> Extremes {
    (one.0.min(other.0), one.1.max(other.1))
}

/// Columns of a trend, at most.
pub const MAXIMUM_COLUMNS: usize = 2000;

/// The images of one program, as ranges.
#[derive(Debug, Clone)]
pub(crate) struct Coarse {
    /// The points that are no BOOL.
    numbers: Vec<Point>,
    levels: Vec<Level>,
    last: Option<Last>,
}

/// The newest image, with its numbers.
#[derive(Debug, Clone)]
struct Last {
    cycle: i64,
    image: Image,
    numbers: Box<[f64]>,
}

/// The ranges of one length.
#[derive(Debug, Clone)]
struct Level {
    length: i64,
    closed: VecDeque<Range>,
    open: Option<Range>,
    /// Whether ranges have gone.
    is_cut: bool,
}

#[derive(Debug, Clone)]
struct Range {
    from: i64,
    /// The first cycle behind it.
    to: i64,
    /// Bits that were 1 in all images, and in any.
    all: Box<[u64]>,
    any: Box<[u64]>,
    /// Least and greatest value of each number. A value that is no number counts for nothing.
    numbers: Box<[Extremes]>,
}

impl Range {
    fn merge(&mut self, later: &Self) {
        self.to = later.to;
        for (own, other) in self.all.iter_mut().zip(&later.all) {
            *own &= other;
        }
        for (own, other) in self.any.iter_mut().zip(&later.any) {
            *own |= other;
        }
        for (own, other) in self.numbers.iter_mut().zip(&later.numbers) {
            *own = widened(*own, *other);
        }
    }
}

impl Level {
    /// Takes the next piece; the answer is a range that is complete with it.
    fn take(&mut self, piece: Range) -> Option<Range> {
        match &mut self.open {
            Some(open) if piece.from < open.from.saturating_add(self.length) => {
                open.merge(&piece);
                None
            }
            open => {
                let complete = open.replace(piece)?;
                if self.closed.len() == MOST {
                    self.closed.pop_front();
                    self.is_cut = true;
                }
                self.closed.push_back(complete.clone());
                Some(complete)
            }
        }
    }

    fn begins(&self) -> Option<i64> {
        self.closed.front().or(self.open.as_ref()).map(|range| range.from)
    }
}

impl Coarse {
    pub(crate) fn new(points: &Points) -> Self {
        let mut length = SHORTEST;
        let levels = std::iter::repeat_with(|| {
            let level = Level { length, closed: VecDeque::new(), open: None, is_cut: false };
            length *= RATIO;
            level
        });
        let numbers = points.iter().filter(|point| point.of != Elementary::Bool);
        Self {
            numbers: numbers.cloned().collect(),
            levels: levels.take(LEVELS).collect(),
            last: None,
        }
    }

    /// The image of a cycle. One of a cycle that is not newer is ignored.
    pub(crate) fn push(&mut self, cycle: i64, image: &Image) {
        match &mut self.last {
            Some(last) if cycle <= last.cycle => return,
            Some(last) if last.image == *image => last.cycle = cycle,
            last => {
                let numbers = self.numbers.iter().map(|point| real_of(point, image.words()));
                *last = Some(Last { cycle, image: image.clone(), numbers: numbers.collect() });
            }
        }
        let Some(Last { numbers, .. }) = &self.last else {
            return;
        };
        let mut piece = Some(Range {
            from: cycle,
            to: cycle.saturating_add(1),
            all: image.words().into(),
            any: image.words().into(),
            numbers: numbers.iter().map(|&value| (value, value)).collect(),
        });
        for level in &mut self.levels {
            let Some(next) = piece else {
                break;
            };
            piece = level.take(next);
        }
    }

    /// The least and the greatest value of a point in each of `count` columns of `width` cycles, from a cycle on; nothing where no value is known.
    pub(crate) fn columns(
        &self,
        point: &Point,
        from: i64,
        width: i64,
        count: usize,
    ) -> Vec<Option<Extremes>> {
        let count = count.min(MAXIMUM_COLUMNS);
        let width = width.max(1);
        let mut columns: Vec<Option<Extremes>> = vec![None; count];
        let place = |cycle: i64| cycle.saturating_sub(from).div_euclid(width);
        for range in self.ranges(from) {
            let Some(found) = self.extremes(range, point) else {
                continue;
            };
            let last = place(range.to - 1).min(count as i64 - 1);
            for column in place(range.from).max(0)..=last {
                let known = columns[column as usize].get_or_insert(found);
                *known = widened(*known, found);
            }
        }
        columns
    }

    /// The shortest ranges that reach back to a cycle, oldest first, and what is not complete of them.
    fn ranges(&self, from: i64) -> impl Iterator<Item = &Range> {
        let reaches =
            |level: &Level| !level.is_cut || level.begins().is_some_and(|begins| begins <= from);
        let finest = self.levels.iter().position(reaches).unwrap_or(LEVELS - 1);
        let closed = self.levels.get(finest).into_iter().flat_map(|level| &level.closed);
        let open =
            self.levels.iter().take(finest + 1).rev().filter_map(|level| level.open.as_ref());
        closed.chain(open)
    }

    fn extremes(&self, range: &Range, point: &Point) -> Option<Extremes> {
        if point.of == Elementary::Bool {
            let bit = |words: &[u64]| {
                let word = words.get(point.bit as usize / 64)?;
                Some(f64::from((word >> (point.bit % 64) & 1) as u8))
            };
            return Some((bit(&range.all)?, bit(&range.any)?));
        }
        let place = self.numbers.iter().position(|number| number.bit == point.bit)?;
        let (least, greatest) = *range.numbers.get(place)?;
        (least <= greatest).then_some((least, greatest))
    }

    pub(crate) fn shift(&mut self, by: i64) {
        if let Some(last) = &mut self.last {
            last.cycle = last.cycle.saturating_add(by);
        }
        for level in &mut self.levels {
            for range in level.closed.iter_mut().chain(&mut level.open) {
                range.from = range.from.saturating_add(by);
                range.to = range.to.saturating_add(by);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn points() -> Points {
        let mut points = Points::default();
        points.push("on", Elementary::Bool, 0);
        points.push("level", Elementary::Real, 0);
        points.push("count", Elementary::Int, 0);
        points
    }

    fn image(points: &Points, stored: [u64; 3]) -> Image {
        let mut image = Image::zero(points.width());
        for (point, value) in points.iter().zip(stored) {
            point.set(image.words_mut(), value);
        }
        image
    }

    /// The value of a cycle: a peak of one cycle each 10,000, a sawtooth, and a gap.
    fn value(cycle: i64) -> Option<(u64, f32, i16)> {
        let is_gap = (50_000..60_000).contains(&cycle);
        let level = (cycle % 1_000) as f32 / 10.0 - 20.0;
        let value = (u64::from(cycle % 10_000 == 77), level, (cycle / 1_000) as i16 - 50);
        (!is_gap).then_some(value)
    }

    #[test]
    fn no_peak_is_lost_and_no_value_is_invented_over_a_million_cycles() {
        let points = points();
        let mut coarse = Coarse::new(&points);
        let all = 1_000_000;
        for cycle in 0..all {
            if let Some((on, level, count)) = value(cycle) {
                let stored = [on, level.to_bits().into(), count as u16 as u64];
                coarse.push(cycle, &image(&points, stored));
            }
        }
        let kept: usize = coarse.levels.iter().map(|level| level.closed.len()).sum();
        assert!(kept <= LEVELS * MOST, "{kept}");
        let [on, level, count] = [0, 1, 2].map(|place| points.iter().nth(place).expect("a point"));
        for (from, to) in [(0, all), (all - 3_000, all), (all - 100_000, all), (40_000, 70_000)] {
            let columns = 100;
            let width = (to - from) / columns as i64;
            let found = |point: &Point| coarse.columns(point, from, width, columns);
            let (ons, levels, counts) = (found(on), found(level), found(count));
            for column in 0..columns {
                let begins = from + column as i64 * width;
                let values: Vec<_> = (begins..begins + width).filter_map(value).collect();
                let Some((least, greatest)) = levels[column] else {
                    assert!(values.is_empty(), "{from} to {to}: column {column} is known");
                    continue;
                };
                for (on, level, count) in values {
                    let within = |range: Option<Extremes>, value: f64| {
                        range.is_some_and(|(least, greatest)| least <= value && value <= greatest)
                    };
                    assert!(within(ons[column], on as f64), "{from} to {to}: column {column}");
                    assert!(within(levels[column], level.into()), "column {column}");
                    assert!(within(counts[column], count.into()), "column {column}");
                }
                assert!(least >= -20.0 && greatest < 80.0, "{least} to {greatest}");
            }
        }
        // What was before the first cycle is not known.
        assert_eq!(coarse.columns(on, -10_000, 1_000, 10), vec![None; 10]);
    }

    #[test]
    fn a_number_that_is_none_counts_for_nothing() {
        let points = points();
        let mut coarse = Coarse::new(&points);
        let level = points.iter().nth(1).expect("a point");
        coarse.push(0, &image(&points, [0, f32::NAN.to_bits().into(), 0]));
        assert_eq!(coarse.columns(level, 0, 10, 1), [None]);
        coarse.push(1, &image(&points, [0, 1.5f32.to_bits().into(), 0]));
        coarse.shift(100);
        assert_eq!(coarse.columns(level, 100, 10, 1), [Some((1.5, 1.5))]);
    }
}
