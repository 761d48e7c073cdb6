//! How long the field of a remote I/O that is reached over the link has shown nothing.

use std::time::Duration;

use understudy_wire::Time;

/// A field that has never been heard may still be started.
const START: u32 = 5;

/// Parts of the patience: a member that was suspended itself has slept through one of them at most.
const PARTS: u32 = 4;

/// Silence of a field. Only time counts in which this member was awake and could have heard it.
#[derive(Debug, Default)]
pub(crate) struct Silence {
    looked: Time,
    lasted: Duration,
    is_heard: bool,
    is_reported: bool,
    is_stale: bool,
}

impl Silence {
    /// Something was heard; whether a silence that was reported ends with it.
    pub(crate) fn ends(&mut self) -> bool {
        self.lasted = Duration::ZERO;
        self.is_heard = true;
        self.is_stale = false;
        std::mem::replace(&mut self.is_reported, false)
    }

    /// Notes that nothing has been heard up to `now`; for how long, once, when that has lasted for longer than `patience`.
    pub(crate) fn lasts(&mut self, now: Time, patience: Duration) -> Option<Duration> {
        self.lasted += now.since(self.looked).min(patience / PARTS);
        self.looked = now;
        let limit = if self.is_heard { patience } else { patience * START };
        if self.is_reported || self.lasted <= limit {
            return None;
        }
        self.is_reported = true;
        Some(limit)
    }

    /// Whether it has lasted for longer than `limit`; true once.
    pub(crate) fn is_stale_after(&mut self, limit: Duration) -> bool {
        self.lasted > limit && !std::mem::replace(&mut self.is_stale, true)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PATIENCE: Duration = Duration::from_secs(1);

    /// Looks every 10 ms for so long; the times of the reports.
    fn looks(silence: &mut Silence, from_ms: u64, for_ms: u64) -> Vec<u64> {
        let times = (from_ms..=from_ms + for_ms).step_by(10);
        let at = |ms: &u64| silence.lasts(Time(0) + Duration::from_millis(*ms), PATIENCE).is_some();
        times.filter(at).collect()
    }

    #[test]
    fn a_plant_that_ceases_to_send_is_reported_once_and_its_return_once() {
        let mut silence = Silence::default();
        assert_eq!(looks(&mut silence, 0, 4_900), [0; 0], "it may still be started");
        assert!(!silence.ends(), "nothing was reported");
        let [at] = looks(&mut silence, 4_910, 9_000)[..] else {
            panic!("one report");
        };
        assert!((5_900..=6_000).contains(&at), "{at} ms");
        assert!(silence.ends());
        assert!(!silence.ends());
        assert_eq!(looks(&mut silence, 14_000, 900), [0; 0]);
    }

    #[test]
    fn a_member_that_was_suspended_itself_reports_nothing() {
        let mut silence = Silence::default();
        silence.ends();
        assert_eq!(looks(&mut silence, 0, 500), [0; 0]);
        silence.ends();
        // What it slept through waits to be read.
        assert_eq!(looks(&mut silence, 60_000, 500), [0; 0]);
        silence.ends();
        assert_eq!(looks(&mut silence, 60_510, 500), [0; 0]);
        assert_eq!(looks(&mut silence, 61_020, 2_000).len(), 1);
    }

    #[test]
    fn sensors_are_stale_once_in_each_silence_and_not_before() {
        let mut silence = Silence::default();
        let limit = Duration::from_millis(30);
        for _ in 0..2 {
            silence.ends();
            looks(&mut silence, 0, 30);
            assert!(!silence.is_stale_after(limit));
            looks(&mut silence, 30, 10);
            assert!(silence.is_stale_after(limit));
            assert!(!silence.is_stale_after(limit));
            silence.looked = Time(0);
        }
    }

    #[test]
    fn a_plant_that_is_never_heard_is_reported() {
        assert_eq!(looks(&mut Silence::default(), 0, 20_000).len(), 1);
    }
}
