//! When the wall clock is recorded beside the monotonic time of the records, so that they can be matched with other systems.
//!
//! Both clocks of a host run at one rate, which NTP adjusts; only a step moves one against the other.

use crate::host_event::HostEvent;

/// What differs by more was set. The two clocks are read within a millisecond.
const STEP_NS: i64 = 20_000_000;

/// Between two records, so that one is left where the oldest records were deleted.
const BETWEEN_NS: u64 = 600_000_000_000;

/// The last record of the wall clock.
#[derive(Debug, Default)]
pub(crate) struct Anchors {
    /// When, and by how much the wall clock was ahead of the monotonic one.
    last: Option<(u64, i64)>,
}

impl Anchors {
    /// Both clocks, in nanoseconds; an event where one is due.
    pub(crate) fn look(&mut self, monotonic_ns: u64, unix_ns: u64) -> Option<HostEvent> {
        let ahead = unix_ns.wrapping_sub(monotonic_ns).cast_signed();
        let step_ns = self.last.map_or(0, |(_, last)| ahead.wrapping_sub(last));
        let stepped = step_ns.unsigned_abs() > STEP_NS.unsigned_abs();
        let due = |(at, _): (u64, i64)| monotonic_ns.saturating_sub(at) >= BETWEEN_NS;
        if !stepped && !self.last.is_none_or(due) {
            return None;
        }
        self.last = Some((monotonic_ns, ahead));
        Some(if stepped {
            HostEvent::WallClockStepped { unix_ns, step_ns }
        } else {
            HostEvent::WallClock { unix_ns }
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_wall_clock_is_said_at_the_start_after_a_step_and_now_and_then() {
        const SECOND: u64 = 1_000_000_000;
        let said = |unix_ns| Some(HostEvent::WallClock { unix_ns });
        let set = |unix_ns, step_ns| Some(HostEvent::WallClockStepped { unix_ns, step_ns });
        let mut anchors = Anchors::default();
        for (monotonic_ns, unix_ns, expected) in [
            (5, 100 * SECOND, said(100 * SECOND)),
            (6, 100 * SECOND + 1, None),
            // Both clocks are not read at once.
            (7, 100 * SECOND + 900_000, None),
            (SECOND + 5, 90 * SECOND, set(90 * SECOND, -11_000_000_000)),
            (2 * SECOND + 5, 91 * SECOND, None),
            (3 * SECOND + 5, 93 * SECOND, set(93 * SECOND, 1_000_000_000)),
            (602 * SECOND, 692 * SECOND, None),
            (604 * SECOND, 694 * SECOND, said(694 * SECOND)),
        ] {
            assert_eq!(anchors.look(monotonic_ns, unix_ns), expected, "{unix_ns}");
        }
    }
}
