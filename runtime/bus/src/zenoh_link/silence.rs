//! When a session that receives no peer is opened anew.

use std::time::Duration;

use understudy_wire::Time;

/// A member that receives none of its peers during so many pulses, which take a second, opens its session anew. Not by the clock: on a
/// machine without time for its pulses, the peers have none for theirs, and new sessions would cost all of them more.
pub(super) const SILENT_PULSES: u32 = 4;

/// The longest pause between two openings: a member whose peers are all switched off opens its session no more often.
const MOST_SILENT_PULSES: u32 = 128;

/// How long no peer was received, and when that is long enough to open the session anew.
pub(super) struct Silence {
    since: Time,
    pulses: u32,
    /// After so many pulses the session is opened anew.
    patience: u32,
}

impl Silence {
    pub(super) fn new(now: Time) -> Self {
        Self {
            since: now,
            pulses: 0,
            patience: SILENT_PULSES,
        }
    }

    /// At each pulse: whether the session is to be opened anew.
    pub(super) fn look(&mut self, now: Time, heard: bool) -> bool {
        if heard {
            *self = Self::new(now);
            return false;
        }
        self.pulses += 1;
        let due = self.pulses >= self.patience;
        if due {
            self.pulses = 0;
            self.patience = (self.patience * 2).min(MOST_SILENT_PULSES);
        }
        due
    }

    pub(super) fn lasts(&self, now: Time) -> Duration {
        now.since(self.since)
    }
}

#[cfg(test)]
mod tests {
    use super::super::PULSE;
    use super::*;

    #[test]
    fn a_session_is_opened_anew_after_a_second_and_then_less_often() {
        let start = Time::default();
        let mut silence = Silence::new(start);
        let mut opened = Vec::new();
        for tick in 1..=40_u32 {
            if silence.look(start + PULSE * tick, false) {
                opened.push(tick);
            }
        }
        // Seconds 1, 3, and 7: pauses of 1, 2 and 4 s.
        assert_eq!(opened, [4, 12, 28]);
        assert_eq!(silence.lasts(start + PULSE * 40), PULSE * 40);
        assert!(!silence.look(start + PULSE * 41, true));
        let next = (42..60).find(|&tick| silence.look(start + PULSE * tick, false));
        assert_eq!(next, Some(45));
    }
}
