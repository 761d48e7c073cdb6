//! The slots of a cycle of period T, which every member computes for itself from the same configuration.
//!
//! ```text
//! 0        0.12 T                    0.45 T        0.55 T     0.65 T    0.70 T        T
//! ├ Sync, Samples ┼ slots of controllers ┼ understudies ┼ copies ┼ deadline ┼ rest ────┤
//!                                                      last call
//! ```
//!
//! A station publishes when its slot starts, or earlier when those have published that its [`Turns`] let it wait for. A
//! station that does not know its outputs by then, because a sample is late, waits for it until the last call. Copies of
//! a frame follow it `copy_spacing` apart, and the last copy of the last turn leaves before the deadline.

use std::time::Duration;

use serde::{Deserialize, Serialize};
use understudy_wire::{MAXIMUM_PROGRAMS, MAXIMUM_STATIONS, StationId, StationSet};

/// Whom a station waits for before it publishes in its turn; its slot ends the wait in either case.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Turns {
    /// The token of the paper: each controller waits for the one before it, an understudy for all stations of lower rank. The
    /// exchange of a cycle is a chain of N + S turns.
    #[default]
    Token,
    /// A controller does not wait for others, an understudy waits for the controllers: the exchange of a cycle has four hops for any
    /// number of controllers. A controller that received no understudy in the last cycle waits as with the token, because it
    /// learns from the understudies, or else from the chain, who published.
    Parallel,
}

/// The timing of a cluster. All offsets are from the start of a cycle.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Schedule {
    period: Duration,
    controllers: usize,
    understudies: usize,
    copies: u32,
    /// Slots by rank, computed once, because every frame needs them.
    slots: Vec<Duration>,
    last_call: Duration,
    copy_spacing: Duration,
    deadline: Duration,
    rest: Duration,
    guard: Duration,
    grace: Duration,
    stall: Duration,
    turns: Turns,
    /// Stations that are normally absent.
    spare_slots: StationSet,
}

/// Reason why a schedule is refused.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum ScheduleError {
    /// The period is out of bounds.
    #[error("a period of {period:?} is outside 200us to 10s")]
    Period {
        /// Requested period.
        period: Duration,
    },
    /// Too many or too few stations.
    #[error(
        "{controllers} controllers and {understudies} understudies: there must be 1 to {MAXIMUM_PROGRAMS} controllers, \
         and at most {MAXIMUM_STATIONS} stations"
    )]
    Stations {
        /// Number of controllers, N.
        controllers: usize,
        /// Number of understudies, S.
        understudies: usize,
    },
    /// Too many copies.
    #[error("{copies} copies of each frame: there must be 1 to 4")]
    Copies {
        /// Requested number of copies.
        copies: u32,
    },
}

const FIRST_SLOT_PER_MILLE: u32 = 120;
const UNDERSTUDIES_PER_MILLE: u32 = 450;
const TURNS_END_PER_MILLE: u32 = 550;
const DEADLINE_PER_MILLE: u32 = 650;
const REST_PER_MILLE: u32 = 700;
const GUARD_PER_MILLE: u32 = 100;
const STALL_PER_MILLE: u32 = 200;
const COPIES_SPAN_PER_MILLE: u32 = 75;

impl Schedule {
    /// Checks the bounds: 200 µs to 10 s, 1 to 64 controllers, at most 72 stations, 1 to 4 copies.
    pub fn new(
        period: Duration,
        controllers: usize,
        understudies: usize,
        copies: u32,
    ) -> Result<Self, ScheduleError> {
        if !(Duration::from_micros(200)..=Duration::from_secs(10)).contains(&period) {
            return Err(ScheduleError::Period { period });
        }
        if !(1..=MAXIMUM_PROGRAMS).contains(&controllers)
            || controllers + understudies > MAXIMUM_STATIONS
        {
            return Err(ScheduleError::Stations { controllers, understudies });
        }
        if !(1..=4).contains(&copies) {
            return Err(ScheduleError::Copies { copies });
        }
        let share = |per_mille: u32| period * per_mille / 1000;
        let slots = (0..controllers).map(|rank| {
            let span = share(UNDERSTUDIES_PER_MILLE - FIRST_SLOT_PER_MILLE);
            share(FIRST_SLOT_PER_MILLE) + span * rank as u32 / controllers as u32
        });
        let last_slots = (0..understudies).map(|rank| {
            let span = share(TURNS_END_PER_MILLE - UNDERSTUDIES_PER_MILLE);
            share(UNDERSTUDIES_PER_MILLE) + span * rank as u32 / understudies as u32
        });
        Ok(Self {
            period,
            controllers,
            understudies,
            copies,
            slots: slots.chain(last_slots).collect(),
            last_call: share(TURNS_END_PER_MILLE),
            copy_spacing: share(COPIES_SPAN_PER_MILLE) / (copies - 1).max(1),
            deadline: share(DEADLINE_PER_MILLE),
            rest: share(REST_PER_MILLE),
            guard: share(GUARD_PER_MILLE),
            grace: (share(GUARD_PER_MILLE) * (controllers + understudies) as u32).min(period),
            stall: share(STALL_PER_MILLE),
            turns: Turns::default(),
            spare_slots: StationSet::EMPTY,
        })
    }

    /// The same schedule, in which these stations are the slots of spares: their absence is no loss.
    #[must_use]
    pub fn with_spare_slots(mut self, slots: StationSet) -> Self {
        self.spare_slots = slots;
        self
    }

    /// The same schedule, with these turns.
    #[must_use]
    pub fn with_turns(self, turns: Turns) -> Self {
        Self { turns, ..self }
    }

    /// Whom a station waits for before it publishes.
    pub fn turns(&self) -> Turns {
        self.turns
    }

    /// Stations that are the slots of spares.
    pub fn spare_slots(&self) -> StationSet {
        self.spare_slots
    }

    /// Stations that a complete cluster has: all but the slots of spares.
    pub fn expected(&self) -> StationSet {
        StationSet::first(self.stations()).without(self.spare_slots)
    }

    /// The period T.
    pub fn period(&self) -> Duration {
        self.period
    }

    /// Number of controllers, N.
    pub fn controllers(&self) -> usize {
        self.controllers
    }

    /// Number of understudies, S.
    pub fn understudies(&self) -> usize {
        self.understudies
    }

    /// Number of stations, N + S.
    pub fn stations(&self) -> usize {
        self.controllers + self.understudies
    }

    /// Whether a station is one of the understudies.
    pub fn is_understudy(&self, station: StationId) -> bool {
        station.index() >= self.controllers
    }

    /// Number of times that each cyclic frame is sent.
    pub fn copies(&self) -> u32 {
        self.copies
    }

    /// Start of the slot of `station`, after which it no longer waits for its predecessors.
    ///
    /// # Panics
    /// If it is not in the cluster; only frames of the cluster's members are admitted.
    pub fn slot(&self, station: StationId) -> Duration {
        self.slots[station.index()]
    }

    /// Last call: a station publishes the outputs that it knows.
    pub fn last_call(&self) -> Duration {
        self.last_call
    }

    /// Time between a frame and its copy, and between copies.
    pub fn copy_spacing(&self) -> Duration {
        self.copy_spacing
    }

    /// Deadline: a remote I/O selects outputs and drives them.
    pub fn deadline(&self) -> Duration {
        self.deadline
    }

    /// Start of the rest: stations ask for the states that they lack.
    pub fn rest(&self) -> Duration {
        self.rest
    }

    /// Time for which the next rank waits for a cycle master that is not received.
    pub fn guard(&self) -> Duration {
        self.guard
    }

    /// Maximum time that a new cycle master may need to replace silent stations, at most a period.
    pub fn grace(&self) -> Duration {
        self.grace
    }

    /// Whether a cycle that lasted so long took its time. One that a member finds in its buffers after it stood still does not: nothing could arrive in
    /// it, and nothing was driven.
    pub fn took_time(&self, lasted: Duration) -> bool {
        lasted >= self.period / 2
    }

    /// Delay of a wake-up from which a member reports a host stall.
    pub fn stall(&self) -> Duration {
        self.stall
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every cluster within the bounds: slots ascend by rank, and the last copy is sent before the deadline.
    #[test]
    fn slots_ascend_and_copies_leave_in_time() {
        for controllers in 1..=MAXIMUM_PROGRAMS {
            for understudies in 0..=(MAXIMUM_STATIONS - controllers).min(4) {
                for copies in 1..=4 {
                    let period = Duration::from_millis(10);
                    let schedule = Schedule::new(period, controllers, understudies, copies)
                        .expect("within the bounds");
                    let slots: Vec<Duration> = (0..schedule.stations())
                        .map(|rank| schedule.slot(StationId(rank as u8)))
                        .collect();
                    assert!(slots.is_sorted_by(|earlier, later| earlier < later));
                    let last = schedule.last_call();
                    assert!(slots.iter().all(|slot| *slot < last));
                    assert!(last + schedule.copy_spacing() * (copies - 1) < schedule.deadline());
                    assert!(schedule.deadline() < schedule.rest() && schedule.rest() < period);
                }
            }
        }
    }

    #[test]
    fn what_is_out_of_bounds_is_refused() {
        let period = Duration::from_millis(10);
        assert!(Schedule::new(Duration::from_micros(1), 1, 1, 1).is_err());
        assert!(Schedule::new(period, 0, 1, 1).is_err());
        assert!(Schedule::new(period, 64, 9, 1).is_err());
        assert!(Schedule::new(period, 2, 1, 0).is_err());
        assert!(Schedule::new(period, 2, 1, 5).is_err());
    }
}
