//! Whether what was folded from a journal is the present.
//!
//! ```text
//!   opened ──► Reading { percent } ──(end of the journal reached)──► current
//!                       ▲                                              │
//!                       └──(end not reached again within BEHIND)───────┘      (a run that has ended does not grow old)
//! ```
//!
//! Invariant: what is current contains every record that was in the journal [`BEHIND`] ago. Every view asks here before it shows a value.

use std::time::{Duration, Instant};

/// A reader that has not reached the end of its journal for so long is reading the past.
pub const BEHIND: Duration = Duration::from_secs(2);

/// How far a reader is, after its last poll. It is to be published after the records of that poll are folded.
#[derive(Debug, Clone, Copy, Default)]
pub struct Progress {
    /// When the poll began that last reached the end.
    pub(super) at_end: Option<Instant>,
    /// Of the bytes of the journal.
    pub(super) percent: u8,
    /// When a member last reported, as far as this is known.
    pub(super) reported: Option<Instant>,
    /// The run has ended and all of it was read: this does not grow old.
    over: bool,
}

/// The journal is still being read: what is known so far is the past.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("reading the journal: {percent} %; the present state is not known yet")]
pub struct Reading {
    /// Share of the journal that has been read.
    pub percent: u8,
}

impl Reading {
    /// The stable code of this answer.
    pub const CODE: &str = "U0688";
}

impl Progress {
    /// Whether what was read is the present at `now`.
    ///
    /// # Errors
    /// [`Reading`].
    pub fn current(&self, now: Instant) -> Result<(), Reading> {
        if self.over {
            return Ok(());
        }
        let behind = |end: Instant| now.saturating_duration_since(end) > BEHIND;
        if self.at_end.is_none_or(behind) {
            return Err(Reading { percent: self.percent });
        }
        Ok(())
    }

    /// The same, where the run is known to have ended.
    #[must_use]
    pub fn of_ended(mut self, has_ended: bool) -> Self {
        self.over = has_ended && self.is_at_end();
        self
    }

    /// Whether the last poll reached the end of the journal, so that all that was read is to be shown.
    pub fn is_at_end(&self) -> bool {
        self.percent == 100
    }

    /// How much of the journal was read, in percent.
    pub(crate) fn percent(&self) -> u8 {
        self.percent
    }

    /// The age of the newest record of a member; nothing where there is no record. What a run records itself, for example that no member is received
    /// any more, makes the reports of the members no younger.
    pub fn age(&self, now: Instant) -> Option<Duration> {
        Some(now.saturating_duration_since(self.reported?))
    }

    /// Notes a poll that began at `began`, with the bytes read so far and those that are known to follow.
    pub(super) fn polled(&mut self, began: Instant, read: u64, ahead: u64) {
        let all = read.saturating_add(ahead).max(1);
        // Not 100 before the end.
        let percent = u128::from(read) * 100 / u128::from(all);
        self.percent = u8::try_from(percent).unwrap_or(99).min(99);
        if ahead == 0 {
            self.percent = 100;
            self.at_end = Some(began);
        }
    }
}

#[cfg(test)]
#[allow(clippy::disallowed_methods, reason = "any time to begin with")]
mod tests {
    use super::*;

    #[test]
    fn only_who_has_been_at_the_end_lately_knows_the_present() {
        let start = Instant::now();
        let after = |ms| start + Duration::from_millis(ms);
        let mut progress = Progress::default();
        let percent = |progress: &Progress, ms| progress.current(after(ms)).map_err(|r| r.percent);
        assert_eq!(percent(&progress, 0), Err(0));
        progress.polled(after(10), 30, 70);
        assert_eq!(percent(&progress, 10), Err(30));
        progress.polled(after(20), 999_999, 1);
        assert_eq!(percent(&progress, 20), Err(99), "not all of it");
        progress.polled(after(30), 1_000_000, 0);
        assert_eq!(percent(&progress, 30), Ok(()));
        // A poll that does not reach the end is ordinary while the journal grows.
        progress.polled(after(1_000), 1_000_000, 1_000_000);
        assert_eq!(percent(&progress, 2_030), Ok(()));
        assert_eq!(percent(&progress, 2_031), Err(50), "it fell behind");
        assert_eq!(percent(&progress.of_ended(true), 20_000), Err(50));
        progress.polled(after(9_000), 2_000_000, 0);
        assert_eq!(percent(&progress, 9_000), Ok(()));
        assert_eq!(percent(&progress, 20_000), Err(100), "it was suspended");
        assert_eq!(percent(&progress.of_ended(false), 20_000), Err(100));
        assert_eq!(percent(&progress.of_ended(true), 20_000), Ok(()));
    }
}
