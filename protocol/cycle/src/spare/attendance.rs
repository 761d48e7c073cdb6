//! What a remote I/O tells the spares that follow it: for how many of its deadlines it has missed each station.
//!
//! The report goes out once a second, and at once while a station is missed, so that a spare which waits costs little and one that is needed
//! loses no time. It is complete in itself: a report that is lost costs nothing but the time to the next one.

use std::time::Duration;

use serde::{Deserialize, Serialize};
use understudy_wire::{StationId, StationSet};

use crate::Schedule;

/// Time between two reports while nothing changes.
pub const REPORTED_EVERY: Duration = Duration::from_secs(1);

/// Deadlines for which a station that is missed causes reports at once; after that all spares know of it.
const AT_ONCE: u32 = 1_000;

/// The same for the slot of a spare: until every other spare takes it for empty.
const SLOT_AT_ONCE: u32 = 100;

/// The stations that a remote I/O misses.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct AttendanceReport {
    /// Deadlines since the remote I/O started.
    pub deadlines: u64,
    /// By rank: deadlines in a row without a turn of the station, up to now.
    pub silent: Vec<u32>,
    /// By rank: the most of them at any deadline since the report before.
    pub longest: Vec<u32>,
}

/// Counts the deadlines of a remote I/O for its reports.
#[derive(Debug, Clone)]
pub struct AttendanceCount {
    report: AttendanceReport,
    /// Stations that are missed when they send nothing: all but the slots of spares.
    expected: StationSet,
    /// Deadlines that pass between two reports while nothing changes.
    every: u64,
    /// Deadlines at the report before.
    told: u64,
    /// Whether a station is missed, or is received again, since the report before.
    is_urgent: bool,
}

impl AttendanceCount {
    /// No deadline has passed.
    pub fn new(schedule: &Schedule) -> Self {
        let every = REPORTED_EVERY.as_nanos() / schedule.period().as_nanos().max(1);
        let stations = schedule.stations();
        Self {
            report: AttendanceReport {
                deadlines: 0,
                silent: vec![0; stations],
                longest: vec![0; stations],
            },
            expected: schedule.expected(),
            every: u64::try_from(every).unwrap_or(u64::MAX).max(1),
            told: 0,
            is_urgent: true,
        }
    }

    /// A deadline has passed, at which these stations had been received.
    pub fn deadline(&mut self, heard: StationSet) {
        self.report.deadlines += 1;
        let counts = self.report.silent.iter_mut().zip(&mut self.report.longest);
        for (rank, (silent, longest)) in counts.enumerate() {
            let before = *silent;
            let station = StationId(rank as u8);
            let is_present = heard.contains(station);
            *silent = if is_present { 0 } else { silent.saturating_add(1) };
            *longest = (*longest).max(*silent);
            let limit = if self.expected.contains(station) { AT_ONCE } else { SLOT_AT_ONCE };
            let is_missed = (1..=limit).contains(silent);
            // The station of a slot begins, or ends.
            let is_changed = is_present != (before == 0);
            self.is_urgent |= is_missed || is_changed;
        }
    }

    /// The report, where it is due.
    pub fn take(&mut self) -> Option<AttendanceReport> {
        let passed = self.report.deadlines - self.told;
        if passed == 0 || !self.is_urgent && passed < self.every {
            return None;
        }
        let report = self.report.clone();
        self.report.longest.clone_from(&self.report.silent);
        self.told = self.report.deadlines;
        self.is_urgent = false;
        Some(report)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PERIOD: Duration = Duration::from_millis(10);

    /// Two stations, and the slot of a spare.
    fn count() -> AttendanceCount {
        let schedule = Schedule::new(PERIOD, 1, 2, 2).expect("a schedule");
        AttendanceCount::new(&schedule.with_spare_slots(set(&[2])))
    }

    fn set(ranks: &[u8]) -> StationSet {
        ranks.iter().map(|rank| StationId(*rank)).collect()
    }

    #[test]
    fn a_report_is_due_once_a_second_and_at_once_while_a_station_is_missed() {
        let mut count = count();
        for _ in 0..SLOT_AT_ONCE {
            count.deadline(set(&[0, 1]));
            assert!(count.take().is_some(), "the slot is empty since a moment ago");
        }
        for _ in 0..99 {
            count.deadline(set(&[0, 1]));
            assert_eq!(count.take(), None);
        }
        count.deadline(set(&[0, 1]));
        assert_eq!(count.take().expect("due").deadlines, 200);
        count.deadline(set(&[0]));
        assert_eq!(count.take().expect("one is missed").silent, [0, 1, 201]);
        count.deadline(set(&[0]));
        count.deadline(set(&[0, 1]));
        let back = count.take().expect("it is back");
        assert_eq!((back.silent, back.longest), (vec![0, 0, 203], vec![0, 2, 203]));
        assert_eq!(count.take(), None);
        count.deadline(set(&[0, 1, 2]));
        assert_eq!(count.take().expect("the spare is awake").silent, [0, 0, 0]);
    }

    #[test]
    fn a_station_that_is_missed_for_long_is_reported_once_a_second() {
        let mut count = count();
        let mut told = 0;
        for _ in 0..AT_ONCE + 1_000 {
            count.deadline(set(&[0]));
            told += u32::from(count.take().is_some());
        }
        assert_eq!(told, AT_ONCE + 1_000 / 100);
    }
}
