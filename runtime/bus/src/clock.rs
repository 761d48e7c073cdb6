//! The one clock of a process: CLOCK_MONOTONIC, which no one can set.
//!
//! The cores are given nanoseconds since the process started ([`Time`]); the journal is given CLOCK_MONOTONIC itself, so that
//! the records of all processes of one host can be put in order.

use nix::time::{ClockId, clock_gettime};
use understudy_wire::Time;

/// Monotonic time of this process.
#[derive(Debug, Clone, Copy)]
pub struct Clock {
    start_ns: u64,
}

impl Clock {
    /// Starts at 0 now.
    pub fn start() -> Self {
        Self { start_ns: monotonic_ns() }
    }

    /// Nanoseconds since the start.
    pub fn now(&self) -> Time {
        Time(monotonic_ns().saturating_sub(self.start_ns))
    }

    /// `time` as nanoseconds of the host's CLOCK_MONOTONIC, which all processes of one host share.
    pub fn host_ns(&self, time: Time) -> u64 {
        self.start_ns.saturating_add(time.0)
    }
}

/// CLOCK_MONOTONIC and the wall clock in nanoseconds, read within a millisecond; nothing where the host took longer.
pub(crate) fn wall_clock() -> Option<(u64, u64)> {
    let before = monotonic_ns();
    let wall = clock_gettime(ClockId::CLOCK_REALTIME).ok()?;
    let after = monotonic_ns();
    let seconds = u64::try_from(wall.tv_sec()).ok()?;
    let unix_ns = seconds.checked_mul(1_000_000_000)?;
    let unix_ns = unix_ns.checked_add(u64::try_from(wall.tv_nsec()).ok()?)?;
    (after - before < 1_000_000).then_some((after, unix_ns))
}

/// # Panics
/// Never on Linux: CLOCK_MONOTONIC has existed since 2.6.
fn monotonic_ns() -> u64 {
    let now = clock_gettime(ClockId::CLOCK_MONOTONIC).expect("CLOCK_MONOTONIC exists");
    u64::try_from(now.tv_sec()).unwrap_or(0) * 1_000_000_000
        + u64::try_from(now.tv_nsec()).unwrap_or(0)
}
