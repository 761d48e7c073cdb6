//! The clock of records that this process writes.

use std::time::Duration;

use nix::time::{ClockId, clock_gettime};

/// The host's CLOCK_MONOTONIC in nanoseconds, as in the records of members.
pub fn monotonic_ns() -> u64 {
    // It exists on every Linux; a journal without times is still a journal.
    clock_gettime(ClockId::CLOCK_MONOTONIC).map_or(0, |now| {
        let nanoseconds = Duration::new(
            u64::try_from(now.tv_sec()).unwrap_or(0),
            u32::try_from(now.tv_nsec()).unwrap_or(0),
        );
        u64::try_from(nanoseconds.as_nanos()).unwrap_or(u64::MAX)
    })
}
