//! How often each duration was measured, in bounded memory: counts in ranges that are wider for longer times, as HDR histograms have them.
//!
//! A time below 64 ns has a range of its own; each longer one a range of at most a 64th of it, so a quantile is at most 1.6 % above a time that
//! was measured. Nothing is allocated after the start.

use std::time::Duration;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Ranges in each doubling.
const FINE: u64 = 64;
const FINE_BITS: u32 = FINE.ilog2();
/// Longer times, from 18 minutes, count as this one in a range; the longest is kept too.
const LONGEST_NS: u64 = (1 << 40) - 1;
const RANGES: usize = range_of(LONGEST_NS) + 1;

/// Counts of durations.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(from = "Sparse", into = "Sparse")]
pub struct Distribution {
    counts: Box<[u64]>,
    count: u64,
    longest_ns: u64,
}

/// Half, 99 and 99.9 of 100 durations were at most so long, in nanoseconds.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
pub struct Quantiles {
    /// Durations that were measured.
    pub count: u64,
    /// Half of them.
    pub p50_ns: u64,
    /// 99 %.
    pub p99_ns: u64,
    /// 99.9 %.
    pub p999_ns: u64,
    /// The longest.
    pub maximum_ns: u64,
}

impl Default for Distribution {
    fn default() -> Self {
        Self { counts: vec![0; RANGES].into(), count: 0, longest_ns: 0 }
    }
}

impl Distribution {
    /// Counts a duration.
    pub fn note(&mut self, duration: Duration) {
        let ns = u64::try_from(duration.as_nanos()).unwrap_or(u64::MAX);
        self.counts[range_of(ns.min(LONGEST_NS))] += 1;
        self.count += 1;
        self.longest_ns = self.longest_ns.max(ns);
    }

    /// Counts what another one counted.
    pub fn add(&mut self, other: &Self) {
        for (count, more) in self.counts.iter_mut().zip(&other.counts) {
            *count += more;
        }
        self.count += other.count;
        self.longest_ns = self.longest_ns.max(other.longest_ns);
    }

    /// Number of durations.
    pub fn count(&self) -> u64 {
        self.count
    }

    /// `per_mille` of 1000 durations were at most so long; zero where none was measured.
    pub fn quantile(&self, per_mille: u32) -> Duration {
        let wanted = self.count.saturating_mul(u64::from(per_mille)).div_ceil(1000);
        let mut passed = 0;
        let range = self.counts.iter().position(|count| {
            passed += count;
            passed >= wanted
        });
        let ns = range.map_or(self.longest_ns, |range| last_of(range).min(self.longest_ns));
        Duration::from_nanos(if range == Some(RANGES - 1) { self.longest_ns } else { ns })
    }

    /// The quantiles that are published.
    pub fn quantiles(&self) -> Quantiles {
        let at = |per_mille| self.quantile(per_mille).as_nanos() as u64;
        Quantiles {
            count: self.count,
            p50_ns: at(500),
            p99_ns: at(990),
            p999_ns: at(999),
            maximum_ns: self.longest_ns,
        }
    }
}

/// The range of a time.
const fn range_of(ns: u64) -> usize {
    if ns < FINE {
        return ns as usize;
    }
    let doublings = ns.ilog2() - FINE_BITS;
    (doublings as u64 * FINE + (ns >> doublings)) as usize
}

/// The longest time of a range.
const fn last_of(range: usize) -> u64 {
    let range = range as u64;
    if range < FINE {
        return range;
    }
    let doublings = range / FINE - 1;
    ((range - doublings * FINE + 1) << doublings) - 1
}

/// The ranges that have counts, and the longest time.
#[derive(Serialize, Deserialize)]
struct Sparse {
    counts: Vec<(usize, u64)>,
    longest_ns: u64,
}

impl From<Distribution> for Sparse {
    fn from(all: Distribution) -> Self {
        let counted = all.counts.iter().copied().enumerate().filter(|(_, count)| *count > 0);
        Self { counts: counted.collect(), longest_ns: all.longest_ns }
    }
}

impl From<Sparse> for Distribution {
    fn from(sparse: Sparse) -> Self {
        let mut all = Self { longest_ns: sparse.longest_ns, ..Self::default() };
        for (range, count) in sparse.counts {
            if let Some(place) = all.counts.get_mut(range) {
                *place += count;
                all.count += count;
            }
        }
        all
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranges_follow_each_other_and_are_narrow() {
        let mut first = 0;
        for range in 0..RANGES {
            let last = last_of(range);
            assert_eq!((range_of(first), range_of(last)), (range, range));
            assert!(last - first <= first / FINE);
            first = last + 1;
        }
        assert_eq!(first, LONGEST_NS + 1);
    }

    /// Against the sorted list.
    #[test]
    fn a_quantile_is_that_of_the_sorted_times() {
        let mut times: Vec<u64> = (1..=5000).map(|it: u64| it * it * 37 % 1_000_003).collect();
        let (mut left, mut right) = (Distribution::default(), Distribution::default());
        for (place, ns) in times.iter().enumerate() {
            let half = if place % 3 == 0 { &mut left } else { &mut right };
            half.note(Duration::from_nanos(*ns));
        }
        left.add(&right);
        times.sort_unstable();
        for per_mille in [1, 500, 990, 999, 1000] {
            let exact = times[(5000 * per_mille as usize).div_ceil(1000) - 1];
            let found = left.quantile(per_mille).as_nanos() as u64;
            assert!(
                found >= exact && found <= exact + exact / FINE,
                "{per_mille}: {exact} {found}"
            );
        }
        assert_eq!(left.quantiles().maximum_ns, times[4999]);
        assert_eq!(left.count(), 5000);
    }

    #[test]
    fn none_and_a_very_long_one() {
        let mut distribution = Distribution::default();
        assert_eq!(distribution.quantiles(), Quantiles::default());
        distribution.note(Duration::MAX);
        assert_eq!(distribution.quantile(500), Duration::from_nanos(u64::MAX));
    }

    #[test]
    fn it_is_the_same_after_the_journal() {
        let mut distribution = Distribution::default();
        for ns in [0, 5, 5, 1_000_000, u64::MAX] {
            distribution.note(Duration::from_nanos(ns));
        }
        let text = serde_json::to_string(&distribution).expect("text");
        assert_eq!(serde_json::from_str::<Distribution>(&text).expect("the same"), distribution);
    }
}
