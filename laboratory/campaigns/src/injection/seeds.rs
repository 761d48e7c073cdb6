//! The seeds of which all runs have been made.

use std::fmt;

use serde::{Deserialize, Serialize};

/// A set of seeds, as ranges from the first to the last seed: ascending, disjoint, with a gap between two of them.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(from = "Vec<(u64, u64)>", into = "Vec<(u64, u64)>")]
pub struct Seeds(Vec<(u64, u64)>);

impl Seeds {
    /// All from `first` to `last`; none if `last` is below `first`.
    pub fn range(first: u64, last: u64) -> Self {
        vec![(first, last)].into()
    }

    /// The first and the last seed.
    pub fn ends(&self) -> Option<(u64, u64)> {
        Some((self.0.first()?.0, self.0.last()?.1))
    }

    /// The first seed.
    pub fn first(&self) -> Option<u64> {
        self.ends().map(|(first, _)| first)
    }

    /// Whether a seed is in the set.
    pub fn has(&self, seed: u64) -> bool {
        self.0.iter().any(|&(first, last)| (first..=last).contains(&seed))
    }

    /// Whether all seeds of another set are in this one.
    pub fn has_all(&self, other: &Self) -> bool {
        let within = |&(first, last): &(u64, u64)| {
            self.0.iter().any(|&(from, to)| from <= first && last <= to)
        };
        other.0.iter().all(within)
    }

    /// Number of seeds.
    pub fn count(&self) -> u64 {
        self.0
            .iter()
            .map(|(first, last)| (last - first).saturating_add(1))
            .fold(0, u64::saturating_add)
    }

    /// Adds the seeds of another set.
    pub fn add(&mut self, other: &Self) {
        *self = [&self.0[..], &other.0[..]].concat().into();
    }

    /// The seeds that are not in the set, ascending.
    pub fn absent(&self) -> impl Iterator<Item = u64> + '_ {
        let starts =
            std::iter::once(Some(0)).chain(self.0.iter().map(|range| range.1.checked_add(1)));
        let ends = self.0.iter().map(|range| range.0).chain([u64::MAX]);
        starts.zip(ends).flat_map(|(start, end)| start.map_or(0..0, |start| start..end))
    }
}

impl From<Vec<(u64, u64)>> for Seeds {
    fn from(mut ranges: Vec<(u64, u64)>) -> Self {
        ranges.retain(|(first, last)| first <= last);
        ranges.sort_unstable();
        let mut joined: Vec<(u64, u64)> = Vec::with_capacity(ranges.len());
        for (first, last) in ranges {
            match joined.last_mut() {
                Some(before) if first <= before.1.saturating_add(1) => {
                    before.1 = before.1.max(last)
                }
                _ => joined.push((first, last)),
            }
        }
        Self(joined)
    }
}

impl From<Seeds> for Vec<(u64, u64)> {
    fn from(seeds: Seeds) -> Self {
        seeds.0
    }
}

/// Such as `seed 5`, `seeds 0 to 11`, `40 seeds from 3 to 90`.
impl fmt::Display for Seeds {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.0[..] {
            [] => formatter.write_str("no seeds"),
            [(first, last)] if first == last => write!(formatter, "seed {first}"),
            [(first, last)] => write!(formatter, "seeds {first} to {last}"),
            [(first, _), .., (_, last)] => {
                write!(formatter, "{} seeds from {first} to {last}", self.count())
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;

    /// Every way to add ranges of small numbers, compared with sets of numbers.
    #[test]
    fn ranges_are_sets() {
        const END: u64 = 6;
        let ranges = (0..END).flat_map(|first| (0..END).map(move |last| (first, last)));
        let ranges: Vec<(u64, u64)> = ranges.collect();
        for &one in &ranges {
            for &two in &ranges {
                let numbers = |range: (u64, u64)| range.0..=range.1;
                let expected: BTreeSet<u64> = numbers(one).chain(numbers(two)).collect();
                let mut seeds = Seeds::range(one.0, one.1);
                seeds.add(&Seeds::range(two.0, two.1));
                let found: BTreeSet<u64> = (0..END).filter(|seed| seeds.has(*seed)).collect();
                assert_eq!(found, expected, "{one:?} {two:?}");
                assert_eq!(seeds.count(), expected.len() as u64);
                let absent: Vec<u64> = seeds.absent().take_while(|seed| *seed < END).collect();
                assert_eq!(
                    absent,
                    (0..END).filter(|it| !expected.contains(it)).collect::<Vec<_>>()
                );
                let whole = Seeds::range(0, END - 1);
                assert!(whole.has_all(&seeds));
                assert_eq!(seeds.has_all(&whole), expected.len() as u64 == END);
            }
        }
    }

    #[test]
    fn the_largest_seed_is_one_too() {
        let seeds = Seeds::range(0, u64::MAX);
        assert_eq!((seeds.count(), seeds.absent().next()), (u64::MAX, None));
    }
}
