//! Whether new cycles of a run arrive: one rule for metrics and OPC UA.

use std::time::{Duration, Instant};

use understudy_view::RunState;

use crate::followed::Observation;

/// Minimum time without a record or a new cycle after which a run is not current.
const SILENCE: Duration = Duration::from_secs(2);

/// Minimum number of cycles for the same.
const SILENT_CYCLES: u32 = 20;

/// Whether new cycles of a run arrive.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Feed {
    /// The run has not begun.
    Waiting,
    /// Records and new cycles arrive.
    Live,
    /// No record, or no new cycle, has arrived for 2 s and 20 cycles.
    Silent,
    /// The run has ended.
    Ended,
}

/// The states of a run that [`Observation::state`] distinguishes.
pub(crate) const STATES: [&str; 5] = [
    RunState::Starting.word(),
    RunState::Running.word(),
    NOT_CURRENT,
    RunState::Finished.word(),
    RunState::Interrupted.word(),
];

const NOT_CURRENT: &str = "not-current";

impl Observation {
    /// Whether new cycles of the run arrive at `now`.
    pub fn feed(&self, now: Instant) -> Feed {
        let period = Duration::from_micros(self.snapshot.period_us);
        let is_old = |since: Instant| {
            now.saturating_duration_since(since) > SILENCE.max(period * SILENT_CYCLES)
        };
        match self.snapshot.run {
            RunState::Finished | RunState::Interrupted => Feed::Ended,
            RunState::Starting if is_old(self.heard) => Feed::Silent,
            RunState::Starting => Feed::Waiting,
            // A remote I/O reports every deadline, so the cycle advances as long as one is received.
            RunState::Running if is_old(self.heard) || is_old(self.advanced) => Feed::Silent,
            RunState::Running => Feed::Live,
        }
    }

    /// State of the run in one word: that of the snapshot, or `not-current` where `feed` is silent.
    pub fn state(&self, feed: Feed) -> &'static str {
        match feed {
            Feed::Silent => NOT_CURRENT,
            Feed::Waiting | Feed::Live | Feed::Ended => self.snapshot.run.word(),
        }
    }
}
