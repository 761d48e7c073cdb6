//! How late this host wakes who sleeps, and the period that it can keep.

use std::fmt;
use std::time::Duration;

use nix::poll::ppoll;
use nix::sys::time::TimeSpec;

use crate::clock::Clock;
use crate::distribution::{Distribution, Quantiles};
use crate::rights::{CYCLE_PRIORITY, run_in_real_time, sleep_exactly};

/// Threads that sleep at the same time: a member of a small cluster is never alone.
const SLEEPERS: usize = 4;
const SLEEP: Duration = Duration::from_millis(1);
/// What each of them does between two sleeps, as a member does.
const WORK: Duration = Duration::from_micros(50);

/// Periods to choose from.
const PERIODS: [Duration; 4] = [
    Duration::from_millis(10),
    Duration::from_millis(20),
    Duration::from_millis(50),
    Duration::from_millis(100),
];

/// A late wake-up takes a share of the period of one in this, at most: a cycle waits for several members in turn.
const SHARE: u32 = 5;

/// How late sleepers were woken.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Wakefulness {
    /// How late each sleep ended.
    pub late: Distribution,
    /// Whether they slept with real-time rights.
    pub real_time: bool,
}

impl Wakefulness {
    /// Measures for `span`, with the real-time rights that a member would have here where `real_time` is wanted.
    pub fn measure(span: Duration, real_time: bool) -> Self {
        let sleepers: Vec<_> =
            (0..SLEEPERS).map(|_| std::thread::spawn(move || sleep_for(span, real_time))).collect();
        let (mut late, mut granted) = (Distribution::default(), real_time);
        for sleeper in sleepers {
            let (measured, rights) = sleeper.join().unwrap_or_default();
            late.add(&measured);
            granted &= rights;
        }
        Self { late, real_time: granted }
    }

    /// The latest that a sleep ended.
    pub fn latest(&self) -> Duration {
        self.late.quantile(1000)
    }

    /// Whether cycles of `period` can be kept.
    pub fn keeps(&self, period: Duration) -> bool {
        self.latest().saturating_mul(SHARE) <= period
    }

    /// The shortest of 10, 20, 50 and 100 ms that can be kept; 100 ms where none can.
    pub fn period(&self) -> Duration {
        let mut periods = PERIODS.into_iter();
        let last = PERIODS[PERIODS.len() - 1];
        periods.find(|period| self.keeps(*period)).unwrap_or(last)
    }
}

impl fmt::Display for Wakefulness {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let late = |ns: u64| ns as f64 / 1e6;
        let Quantiles { count, p50_ns, p99_ns, p999_ns, maximum_ns } = self.late.quantiles();
        write!(
            formatter,
            "of {count} sleeps of 1 ms half ended at most {:.2} ms late, 99 % at most {:.2} ms, 99.9 % at most {:.2} ms, the latest {:.2} ms",
            late(p50_ns),
            late(p99_ns),
            late(p999_ns),
            late(maximum_ns)
        )
    }
}

/// How late each sleep of one thread ended, and whether it had real-time rights.
fn sleep_for(span: Duration, real_time: bool) -> (Distribution, bool) {
    sleep_exactly();
    let granted = real_time && run_in_real_time(CYCLE_PRIORITY).is_ok();
    let clock = Clock::start();
    let end = clock.now() + span;
    let mut late = Distribution::default();
    while clock.now() < end {
        let due = clock.now() + SLEEP;
        // Interrupted or not, what counts is when it comes back.
        let _ = ppoll(&mut [], Some(TimeSpec::from_duration(SLEEP)), None);
        let woken = clock.now();
        late.note(woken.since(due));
        while clock.now().since(woken) < WORK {}
    }
    (late, granted)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_period_grows_with_the_latest_wake_up() {
        let late = |milliseconds| {
            let mut wakefulness = Wakefulness { late: Distribution::default(), real_time: false };
            wakefulness.late.note(Duration::from_millis(milliseconds));
            wakefulness.period().as_millis()
        };
        let periods: Vec<u128> = [0, 2, 3, 4, 5, 10, 11, 20, 500].map(late).into();
        assert_eq!(periods, [10, 10, 20, 20, 50, 50, 100, 100, 100]);
    }

    #[test]
    fn a_measurement_is_in_order() {
        let measured = Wakefulness::measure(Duration::from_millis(20), false);
        let Quantiles { count, p50_ns, p99_ns, p999_ns, maximum_ns } = measured.late.quantiles();
        assert!(count >= SLEEPERS as u64 && !measured.real_time);
        assert!([p50_ns, p99_ns, p999_ns, maximum_ns].is_sorted());
    }
}
