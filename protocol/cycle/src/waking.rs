//! The time at which a member asks to be woken, and host stalls.

use std::time::Duration;

use crate::schedule::Schedule;
use understudy_wire::Time;

/// The next wake-up of one member.
#[derive(Debug, Clone, Default, PartialEq, Eq, Hash)]
pub(crate) struct Waking {
    /// Time at which the member wants to be woken, as of its last input.
    asked: Time,
    /// Time that it had asked for when it last noticed a stall.
    stalled: Time,
}

impl Waking {
    /// Asks to be woken at `asked`.
    pub(crate) fn ask(&mut self, asked: Time) {
        self.asked = asked;
    }

    /// Time at which the member wants to be woken.
    pub(crate) fn asked(&self) -> Time {
        self.asked
    }

    /// Delay of the host if any input at `now` comes too late after the time that was asked for; once for each such
    /// time, and `None` up to [`Schedule::stall`].
    pub(crate) fn stall(&mut self, now: Time, schedule: &Schedule) -> Option<Duration> {
        let due = self.asked;
        if now <= due || due == self.stalled {
            return None;
        }
        let late = now.since(due);
        if late <= schedule.stall() {
            return None;
        }
        self.stalled = due;
        Some(late)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_stall_is_noticed_once() {
        let schedule = Schedule::new(Duration::from_millis(10), 2, 1, 1).expect("bounds");
        let mut waking = Waking::default();
        let mut check = |asked, now, expected: Option<u64>| {
            waking.ask(Time(asked));
            let late = waking.stall(Time(now), &schedule);
            assert_eq!(late, expected.map(Duration::from_nanos), "{asked} {now}");
        };
        check(5_000_000, 4_000_000, None);
        check(5_000_000, 7_000_000, None);
        check(5_000_000, 7_000_001, Some(2_000_001));
        check(5_000_000, 9_000_000, None);
        check(10_000_000, 13_000_000, Some(3_000_000));
    }
}
