//! Time of day of records and cycles, from the wall clocks that the journal has recorded.
//!
//! ```text
//!   at_ns of a record ──(newest record `wall-clock` of its member)──► time of day
//!   cycle ──(deadlines of one remote I/O, a period apart)──────────► time of day
//! ```
//!
//! Invariant: the answers follow from the records alone. A run without recorded wall clocks, such as a simulated one, has no time of day.

use std::collections::{BTreeMap, VecDeque};
use std::fmt;
use std::time::{Duration, UNIX_EPOCH};

use schemars::JsonSchema;
use serde::{Serialize, Serializer};
use time::{OffsetDateTime, UtcOffset};
use understudy_bus::HostEvent;

use crate::record::{Happening, Record, RunEvent};
use crate::run_directory::time_text;

/// A deadline that is further from the one before than its cycles take begins a new stretch: the clock was set, or the cluster paused.
const TOLERANCE_NS: u64 = 20_000_000;

/// Clocks that differ by more are said.
const APART_NS: u64 = 500_000_000;

/// Stretches that are kept, at most.
const MOST_STRETCHES: usize = 10_000;

/// Time in which the remote I/O that tells the times of cycles may be silent before another one takes its place.
const SILENT_NS: u64 = 2_000_000_000;

/// A time of day, in nanoseconds since 1970-01-01 UTC. As JSON and as text it is like `2026-11-21T02:30:00.250Z`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, JsonSchema)]
#[schemars(with = "String")]
pub struct TimeOfDay(pub u64);

impl fmt::Display for TimeOfDay {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(&time_text(UNIX_EPOCH + Duration::from_nanos(self.0)))
    }
}

impl Serialize for TimeOfDay {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

impl TimeOfDay {
    /// Date and time with milliseconds, so many seconds ahead of UTC.
    pub fn at_offset(self, seconds: i32) -> (String, String) {
        let utc = OffsetDateTime::from(UNIX_EPOCH + Duration::from_nanos(self.0));
        let offset = UtcOffset::from_whole_seconds(seconds).unwrap_or(UtcOffset::UTC);
        let local = utc.checked_to_offset(offset).unwrap_or(utc);
        let (hour, minute, second, millisecond) = local.to_hms_milli();
        (local.date().to_string(), format!("{hour:02}:{minute:02}:{second:02}.{millisecond:03}"))
    }

    /// Seconds since 1970-01-01 UTC.
    pub fn unix_seconds(self) -> i64 {
        i64::try_from(self.0 / 1_000_000_000).unwrap_or(i64::MAX)
    }
}

/// Two clocks of a cluster that differ.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, JsonSchema)]
pub struct ClocksApart {
    /// The member whose clock differs most.
    pub name: String,
    /// The member whose clock tells the times of cycles.
    pub from: String,
    /// By how many milliseconds it is ahead.
    pub ahead_ms: i64,
}

impl ClocksApart {
    /// The difference in words.
    pub fn text(&self) -> String {
        let Self { name, from, ahead_ms } = self;
        let seconds = ahead_ms.unsigned_abs() as f64 / 1e3;
        let word = if *ahead_ms < 0 { "behind" } else { "ahead of" };
        format!("{name} is {seconds:.1} s {word} {from}")
    }
}

/// The recorded wall clocks of a run, and the times of its cycles.
#[derive(Debug, Clone)]
pub struct TimesOfDay {
    period_ns: u64,
    /// By how much the wall clock of each member is ahead of the time of its records.
    ahead: BTreeMap<String, i128>,
    /// The member whose deadlines tell the times of cycles.
    reference: Option<String>,
    /// The first cycle of each stretch of cycles that are a period apart, with its time.
    stretches: VecDeque<(i64, u64)>,
    newest: i64,
    /// By how much the deadlines of other members seem later.
    apart: BTreeMap<String, i128>,
}

impl TimesOfDay {
    /// Those of a cluster with cycles of this period, before its first record.
    pub fn new(period: Duration) -> Self {
        Self {
            period_ns: u64::try_from(period.as_nanos()).unwrap_or(u64::MAX).max(1),
            ahead: BTreeMap::new(),
            reference: None,
            stretches: VecDeque::new(),
            newest: i64::MIN,
            apart: BTreeMap::new(),
        }
    }

    /// Takes the wall clock from a record that has one.
    pub fn note(&mut self, record: &Record) {
        if let Happening::Host(
            HostEvent::WallClock { unix_ns } | HostEvent::WallClockStepped { unix_ns, .. },
        ) = record.event
        {
            let ahead = i128::from(unix_ns) - i128::from(record.at_ns);
            self.ahead.insert(record.name.clone(), ahead);
        }
    }

    /// The same, also from a record of before that is in effect.
    pub fn note_all(&mut self, record: &Record) {
        match &record.event {
            Happening::Run(RunEvent::InEffect { record, .. }) => self.note(record),
            _ => self.note(record),
        }
    }

    /// The time of day of a record of a member; nothing while its wall clock is not known.
    pub fn of_record(&self, name: &str, at_ns: u64) -> Option<TimeOfDay> {
        let unix_ns = self.ahead.get(name)?.checked_add(i128::from(at_ns))?;
        u64::try_from(unix_ns).ok().map(TimeOfDay)
    }

    /// The time of day of a record of the laboratory, whose members run on one host with it.
    pub fn of_host(&self, at_ns: u64) -> Option<TimeOfDay> {
        self.of_record(self.reference.as_deref()?, at_ns)
    }

    /// A remote I/O has passed the deadline of a cycle.
    pub fn passed(&mut self, name: &str, cycle: i64, at_ns: u64) {
        let Some(TimeOfDay(unix_ns)) = self.of_record(name, at_ns) else {
            return;
        };
        if self.reference.as_deref() != Some(name) {
            if self.reference.is_some() {
                let silent = self.cycles_in(SILENT_NS);
                if cycle.saturating_sub(self.newest) <= silent {
                    if let Some(TimeOfDay(of_cycle)) = self.of_cycle(cycle) {
                        let apart = i128::from(unix_ns) - i128::from(of_cycle);
                        self.apart.insert(name.to_owned(), apart);
                    }
                    return;
                }
            }
            self.apart.remove(name);
            self.reference = Some(name.to_owned());
        }
        if cycle <= self.newest {
            return;
        }
        let expected = self.stretches.back().and_then(|_| self.of_cycle(cycle));
        if expected.is_none_or(|TimeOfDay(of)| of.abs_diff(unix_ns) > TOLERANCE_NS) {
            if self.stretches.len() == MOST_STRETCHES {
                self.stretches.pop_front();
            }
            self.stretches.push_back((cycle, unix_ns));
        }
        self.newest = cycle;
    }

    fn cycles_in(&self, time_ns: u64) -> i64 {
        i64::try_from(time_ns.div_ceil(self.period_ns)).unwrap_or(i64::MAX)
    }

    /// The time of day of the deadline of a cycle, also of one that is still to come; nothing where no wall clock was recorded.
    pub fn of_cycle(&self, cycle: i64) -> Option<TimeOfDay> {
        let after = self.stretches.partition_point(|(first, _)| *first <= cycle);
        let (first, unix_ns) = self.stretches.get(after.saturating_sub(1))?;
        let cycles = i128::from(cycle) - i128::from(*first);
        let since = cycles.checked_mul(i128::from(self.period_ns))?;
        u64::try_from(i128::from(*unix_ns).checked_add(since)?).ok().map(TimeOfDay)
    }

    /// The first cycles of stretches with their times, from the one that a cycle is of: between them cycles are a period apart.
    pub fn stretches(&self, from: i64) -> impl Iterator<Item = (i64, TimeOfDay)> {
        let after = self.stretches.partition_point(|(first, _)| *first <= from);
        let stretches = self.stretches.iter().skip(after.saturating_sub(1));
        stretches.map(|(first, unix_ns)| (*first, TimeOfDay(*unix_ns)))
    }

    /// The clock that differs most from the one that tells the times of cycles, where it differs noticeably.
    pub fn apart(&self) -> Option<ClocksApart> {
        let most = self.apart.iter().max_by_key(|(_, apart)| apart.unsigned_abs());
        let (name, apart) = most.filter(|(_, apart)| apart.unsigned_abs() > APART_NS.into())?;
        Some(ClocksApart {
            name: name.clone(),
            from: self.reference.clone()?,
            ahead_ms: i64::try_from(apart / 1_000_000).unwrap_or(i64::MAX),
        })
    }

    /// Moves every cycle that was taken so far.
    pub fn shift(&mut self, by: i64) {
        for (cycle, _) in &mut self.stretches {
            *cycle = cycle.saturating_add(by);
        }
        self.newest = self.newest.saturating_add(by);
    }
}

#[cfg(test)]
mod tests {
    use understudy_wire::{Member, StationId};

    use super::*;

    /// 2026-11-26 13:03:12 UTC.
    const NOON: u64 = 1_795_698_192_000_000_000;
    const MS: u64 = 1_000_000;

    fn clock(name: &str, at_ns: u64, unix_ns: u64) -> Record {
        Record {
            at_ns,
            name: name.to_owned(),
            member: Some(Member::Station(StationId(0))),
            event: Happening::Host(HostEvent::WallClock { unix_ns }),
        }
    }

    fn times() -> TimesOfDay {
        let mut times = TimesOfDay::new(Duration::from_millis(10));
        times.note(&clock("robot-io", 5 * MS, NOON));
        times.note(&clock("press-io", 5 * MS, NOON + 3_200 * MS));
        times
    }

    #[test]
    fn a_simulated_run_has_no_time_of_day() {
        let mut times = TimesOfDay::new(Duration::from_millis(10));
        times.passed("robot-io", 7, 70 * MS);
        assert_eq!((times.of_cycle(7), times.of_record("robot-io", 70 * MS)), (None, None));
        assert_eq!((times.apart(), times.stretches(0).count()), (None, 0));
    }

    #[test]
    fn cycles_have_the_times_of_their_deadlines_and_later_ones_those_they_will_have() {
        let mut times = times();
        times.passed("robot-io", 0, 5 * MS);
        times.passed("robot-io", 1, 16 * MS);
        let seconds = |cycle| times.of_cycle(cycle).map(|time| (time.0 - NOON) / MS);
        assert_eq!((seconds(0), seconds(1), seconds(500)), (Some(0), Some(10), Some(5000)));
        assert_eq!(times.of_record("robot-io", 16 * MS), Some(TimeOfDay(NOON + 11 * MS)));
        assert_eq!(times.of_cycle(-1).map(|time| NOON - time.0), Some(10 * MS));
        let json = serde_json::to_string(&times.of_cycle(0)).expect("JSON");
        assert_eq!(json, "\"2026-11-26T13:03:12.000Z\"");
    }

    #[test]
    fn a_clock_that_is_set_begins_a_new_stretch_and_changes_nothing_before() {
        let mut times = times();
        for cycle in 0..100i64 {
            if cycle == 50 {
                // An hour back.
                times.note(&clock("robot-io", 505 * MS, NOON + 500 * MS - 3_600_000 * MS));
            }
            times.passed("robot-io", cycle, (5 + 10 * cycle.unsigned_abs()) * MS);
        }
        let of = |cycle| times.of_cycle(cycle).map(|time| time.to_string());
        assert_eq!(of(49).as_deref(), Some("2026-11-26T13:03:12.490Z"));
        assert_eq!(of(50).as_deref(), Some("2026-11-26T12:03:12.500Z"));
        assert_eq!(times.stretches(0).count(), 2);
        assert_eq!(times.stretches(60).count(), 1);
    }

    #[test]
    fn one_clock_tells_the_cycles_and_another_that_differs_is_said() {
        let mut times = times();
        for cycle in 0..20i64 {
            let at_ns = (5 + 10 * cycle.unsigned_abs()) * MS;
            times.passed("robot-io", cycle, at_ns);
            times.passed("press-io", cycle, at_ns);
        }
        assert_eq!(times.stretches(0).count(), 1, "the two do not take turns");
        let apart = times.apart().expect("they differ");
        assert_eq!((apart.name.as_str(), apart.from.as_str()), ("press-io", "robot-io"));
        assert_eq!(apart.ahead_ms, 3200);
        // It ends, and the other one goes on.
        for cycle in 20..400i64 {
            times.passed("press-io", cycle, (5 + 10 * cycle.unsigned_abs()) * MS);
        }
        assert_eq!((times.stretches(0).count(), times.apart()), (2, None));
        times.shift(-20);
        assert_eq!(times.of_cycle(-20), Some(TimeOfDay(NOON)));
    }

    #[test]
    fn a_zone_is_only_a_way_to_show_it() {
        let time = TimeOfDay(NOON + 345 * MS);
        assert_eq!(time.at_offset(0), ("2026-11-26".to_owned(), "13:03:12.345".to_owned()));
        assert_eq!(time.at_offset(12 * 3600), ("2026-11-27".to_owned(), "01:03:12.345".to_owned()));
        assert_eq!(time.at_offset(i32::MAX).1, "13:03:12.345", "no zone is so far away");
    }
}
