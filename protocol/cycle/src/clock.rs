//! In which cycle a member is, and when that cycle started on its own clock.
//!
//! Any frame of a later cycle starts that cycle, so a lost Sync costs nothing. A member never goes back, with one
//! exception: a member that has received no other one in its epoch for a few periods gives that epoch up for an epoch
//! with several members. So a restarted station whose link comes up late does not renumber the cluster's cycles, and no
//! member waits indefinitely in an epoch that its founder has left.

use std::time::Duration;

use understudy_wire::{Body, Frame, Moment, Time};

/// The current cycle of one member.
#[derive(Debug, Clone, Default, PartialEq, Eq, Hash)]
pub struct CycleClock {
    moment: Option<Moment>,
    anchor: Time,
    /// Time at which another member was received last in this epoch.
    company: Option<Time>,
    alone: bool,
    /// Whether this member started the current cycle itself.
    founder: bool,
}

/// Periods without a frame of another member after which an epoch no longer binds this member.
const LONELY_PERIODS: u32 = 4;

/// Meaning of a frame's moment for this member.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Arrival {
    /// Of a cycle that is over, or of an epoch that does not bind this member.
    Stale,
    /// Of the current cycle.
    Present,
    /// Its cycle starts with it, and started on this member's clock at the time given; [`CycleClock::begin`] makes it
    /// so.
    Begins(Time),
}

impl CycleClock {
    /// The current cycle; none before the first frame.
    pub fn moment(&self) -> Option<Moment> {
        self.moment
    }

    /// When the current cycle started.
    pub fn anchor(&self) -> Time {
        self.anchor
    }

    /// Whether no other member was received in this epoch for some periods.
    pub fn alone(&self) -> bool {
        self.alone
    }

    /// Counts from `now`, until there is a cycle.
    pub fn start(&mut self, now: Time) {
        self.anchor = now;
    }

    /// What an admitted frame that comes at `now` means.
    pub fn arrival(&mut self, now: Time, frame: &Frame, period: Duration) -> Arrival {
        let header = &frame.header;
        let Some(moment) = self.moment else {
            return Arrival::Begins(now);
        };
        if header.moment.epoch == moment.epoch {
            self.company = Some(now);
            self.alone = false;
            return match header.moment.cycle.cmp(&moment.cycle) {
                std::cmp::Ordering::Less => Arrival::Stale,
                std::cmp::Ordering::Equal => Arrival::Present,
                std::cmp::Ordering::Greater => {
                    Arrival::Begins(self.estimated_anchor(now, frame, moment, period))
                }
            };
        }
        self.look_around(now, period);
        let binds = match (self.alone, header.alone) {
            (true, false) => true,
            (false, true) => false,
            // No member follows one that does not start cycles, so it follows.
            (true, true) if !self.founder => true,
            (true, true) | (false, false) => header.moment.epoch > moment.epoch,
        };
        if binds { Arrival::Begins(now) } else { Arrival::Stale }
    }

    /// Enters a cycle that a frame has started, which arrived at `now`.
    pub fn begin(&mut self, now: Time, moment: Moment, anchor: Time) {
        self.moment = Some(moment);
        self.anchor = anchor;
        self.company = Some(now);
        self.alone = false;
        self.founder = false;
    }

    /// Starts the next cycle at `now`, or the first one of a new epoch where there is none yet, as the cycle master does.
    pub fn pace(&mut self, now: Time, founds: Moment, anchor: Time, period: Duration) -> Moment {
        let next = self.moment.map_or(founds, |moment| moment.plus(1));
        self.look_around(now, period);
        self.moment = Some(next);
        self.anchor = anchor;
        self.founder = true;
        next
    }

    fn look_around(&mut self, now: Time, period: Duration) {
        let patience = period * LONELY_PERIODS;
        self.alone = self.company.is_none_or(|heard| now.since(heard) > patience);
    }

    /// A Sync starts its cycle now. Another frame that comes first means that the Sync was lost: the cycle started
    /// one period after the last, if that fits.
    fn estimated_anchor(&self, now: Time, frame: &Frame, moment: Moment, period: Duration) -> Time {
        let expected = self.anchor + period;
        let consecutive = frame.header.moment == moment.plus(1);
        let fits = consecutive && expected <= now && now.since(expected) < period / 2;
        if fits && frame.body != Body::Sync { expected } else { now }
    }
}
