//! Cycles as a scenario counts them: from the first in which everybody was synchronised, whatever number the cluster gives it.

use std::time::Duration;

use understudy_wire::{Epoch, Moment, Time};

/// First moment of the epoch that is founded as the `count`-th one of a run; `base` is that of the settings.
pub(crate) fn founds(base: Moment, count: u64) -> Moment {
    Moment { epoch: Epoch(base.epoch.0.saturating_add(count)), ..base }
}

/// Counts the cycles of a run. A period without any cycle, because nobody is there to pace, counts as one.
#[derive(Debug, Clone, Hash)]
pub(crate) struct Pace {
    period: Duration,
    /// After which a cycle without a cycle master is counted.
    patience: Duration,
    newest: Moment,
    /// When the newest cycle started.
    started: Time,
    /// Cycles since the origin; none before it.
    count: Option<u64>,
}

impl Pace {
    pub(crate) fn new(period: Duration) -> Self {
        Self {
            period,
            patience: period * 2,
            newest: Moment::default(),
            started: Time::default(),
            count: None,
        }
    }

    /// The cycle after this one is the scenario's cycle 0.
    pub(crate) fn set_origin(&mut self) {
        self.count = Some(0);
    }

    /// The scenario's cycle; none before its cycle 0 has started.
    pub(crate) fn cycle(&self) -> Option<u64> {
        self.count?.checked_sub(1)
    }

    /// When the scenario's current cycle started.
    pub(crate) fn started(&self) -> Time {
        self.started
    }

    /// A frame of `moment` was sent at `now`. True where a new cycle starts with it.
    pub(crate) fn saw(&mut self, now: Time, moment: Moment) -> bool {
        if moment <= self.newest {
            return false;
        }
        let cycles = if moment.epoch == self.newest.epoch {
            moment.cycle.0 - self.newest.cycle.0
        } else {
            1
        };
        self.newest = moment;
        self.started = now;
        self.count = self.count.map(|count| count + cycles);
        true
    }

    /// When a cycle without a cycle master has to be counted.
    pub(crate) fn overdue_at(&self) -> Time {
        self.started + self.patience
    }

    /// Counts one.
    pub(crate) fn count_overdue(&mut self) {
        self.started = self.started + self.period;
        self.count = self.count.map(|count| count + 1);
    }
}
