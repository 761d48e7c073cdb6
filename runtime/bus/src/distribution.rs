//! How often each duration was measured, in bounded memory: an HDR histogram, and the longest duration as it was.
//!
//! A quantile is at most 1 % above a time that was measured. Nothing is allocated after the start.

use std::time::Duration;

use hdrhistogram::Histogram;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Longer times, from 18 minutes, count as this one; the longest is kept too.
const LONGEST_NS: u64 = (1 << 40) - 1;
/// Significant decimal digits of a time.
const DIGITS: u8 = 2;

/// Counts of durations.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(from = "Sparse", into = "Sparse")]
pub struct Distribution {
    counts: Histogram<u64>,
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

// Counts and bounds are whole numbers.
impl Eq for Distribution {}

impl Default for Distribution {
    #[allow(clippy::expect_used, reason = "the bounds are constants, and tests make one")]
    fn default() -> Self {
        let counts = Histogram::new_with_bounds(1, LONGEST_NS, DIGITS);
        Self { counts: counts.expect("bounds of a histogram"), longest_ns: 0 }
    }
}

impl Distribution {
    /// Counts a duration.
    pub fn note(&mut self, duration: Duration) {
        let ns = u64::try_from(duration.as_nanos()).unwrap_or(u64::MAX);
        self.counts.saturating_record(ns);
        self.longest_ns = self.longest_ns.max(ns);
    }

    /// Counts what another one counted.
    pub fn add(&mut self, other: &Self) {
        // Both have the same bounds.
        let _ = self.counts.add(&other.counts);
        self.longest_ns = self.longest_ns.max(other.longest_ns);
    }

    /// Number of durations.
    pub fn count(&self) -> u64 {
        self.counts.len()
    }

    /// `per_mille` of 1000 durations were at most so long; zero where none was measured.
    pub fn quantile(&self, per_mille: u32) -> Duration {
        let ns = self.counts.value_at_quantile(f64::from(per_mille) / 1000.0);
        // The longest is known better than its range.
        let ns = if ns < self.counts.max() { ns } else { self.longest_ns };
        Duration::from_nanos(ns)
    }

    /// The quantiles that are published.
    pub fn quantiles(&self) -> Quantiles {
        let at = |per_mille| self.quantile(per_mille).as_nanos() as u64;
        Quantiles {
            count: self.count(),
            p50_ns: at(500),
            p99_ns: at(990),
            p999_ns: at(999),
            maximum_ns: self.longest_ns,
        }
    }
}

/// The times that were counted, and the longest one.
#[derive(Serialize, Deserialize)]
struct Sparse {
    counts: Vec<(u64, u64)>,
    longest_ns: u64,
}

impl From<Distribution> for Sparse {
    fn from(all: Distribution) -> Self {
        let counted = all.counts.iter_recorded();
        let counts = counted.map(|of| (of.value_iterated_to(), of.count_at_value())).collect();
        Self { counts, longest_ns: all.longest_ns }
    }
}

impl From<Sparse> for Distribution {
    fn from(sparse: Sparse) -> Self {
        let mut all = Self { longest_ns: sparse.longest_ns, ..Self::default() };
        for (ns, count) in sparse.counts {
            all.counts.saturating_record_n(ns, count);
        }
        all
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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
            assert!(found >= exact && found <= exact + exact / 64, "{per_mille}: {exact} {found}");
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
