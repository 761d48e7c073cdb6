//! Which members report, and the newest cycle of which all of them have reported.
//!
//! ```text
//!   awaited ──(first line)──► reporting ──(down, or no line for SILENT_AFTER)──► not reporting
//!                                 ▲                                                  │
//!                                 └──────────────────(a line)────────────────────────┘
//! ```
//!
//! The lines of members reach a viewer of a remote cluster in batches and in any order. Time is counted in cycles that any member reported, not by
//! a clock: a viewer that pauses finds no member silent, and a replay gives the same answers.
//!
//! Invariant: a complete cycle has the deadline of every remote I/O that reports, and the turn of every station that a remote I/O received in it and
//! that reports. It never goes back.

use std::collections::BTreeMap;
use std::time::Duration;

use understudy_cycle::Schedule;
use understudy_wire::{Member, ProgramId, ProgramSet, StationId};

use super::cycle::Received;

/// A member without a line for this time does not report: cycles are shown without it.
const SILENT_AFTER: Duration = Duration::from_secs(1);

/// Time limit for the turn of a station that no remote I/O received.
const UNRECEIVED_AFTER: Duration = Duration::from_millis(200);

#[derive(Debug, Clone, Copy)]
enum Report {
    /// No line yet.
    Awaited,
    /// The first and the newest cycle that it reported without a pause, and the count of cycles at its newest line.
    Reporting { first: i64, newest: i64, at: u64 },
    /// It is down, or has been silent for too long.
    Silent,
}

#[derive(Debug, Clone)]
pub(super) struct Reports {
    silent_after: u64,
    unreceived_after: u64,
    /// Cycles that were reported first by any member.
    count: u64,
    furthest: Option<i64>,
    complete: Option<i64>,
    members: BTreeMap<Member, Report>,
    /// By program: the count of cycles at the last sign of its remote I/O, of itself or of a station that has a sample of it.
    signs: Vec<u64>,
    /// Programs whose remote I/O gives no sign.
    without_sign: ProgramSet,
}

/// Changes by a line of a member.
#[derive(Debug, Default)]
pub(super) struct Reported {
    /// It did not report before.
    pub(super) is_back: bool,
    /// Members that do not report any more.
    pub(super) silent: Vec<Member>,
    /// Programs whose remote I/O gives no sign any more.
    pub(super) without_sign: Vec<ProgramId>,
}

impl Reports {
    pub(super) fn new(schedule: &Schedule, programs: usize) -> Self {
        let cycles = |time: Duration| {
            let cycles = time.as_nanos().div_ceil(schedule.period().as_nanos().max(1));
            u64::try_from(cycles).unwrap_or(u64::MAX).max(2)
        };
        let stations = (0..).map(StationId).take(schedule.stations());
        let remote_ios = (0..).map(ProgramId).take(programs);
        let members = stations.map(Member::Station).chain(remote_ios.map(Member::RemoteIo));
        Self {
            silent_after: cycles(SILENT_AFTER),
            unreceived_after: cycles(UNRECEIVED_AFTER),
            count: 0,
            furthest: None,
            complete: None,
            members: members.map(|member| (member, Report::Awaited)).collect(),
            signs: vec![0; programs],
            without_sign: ProgramSet::EMPTY,
        }
    }

    /// Cycles by which the complete one may be behind the newest that any member reported.
    pub(super) fn most_behind(schedule: &Schedule) -> usize {
        usize::try_from(Self::new(schedule, 0).silent_after.saturating_mul(2)).unwrap_or(usize::MAX)
    }

    /// The newest cycle of which every member that reports has reported.
    pub(super) fn complete(&self) -> Option<i64> {
        self.complete
    }

    /// The newest cycle that any member has reported.
    pub(super) fn furthest(&self) -> Option<i64> {
        self.furthest
    }

    /// Notes that a member has reported the cycle, and the programs of which it has samples.
    pub(super) fn note(&mut self, member: Member, cycle: i64, signs: ProgramSet) -> Reported {
        let mut reported = Reported::default();
        if self.furthest.is_none_or(|furthest| furthest < cycle) {
            self.furthest = Some(cycle);
            self.count += 1;
        }
        for program in signs.iter() {
            if let Some(sign) = self.signs.get_mut(program.index()) {
                *sign = self.count;
                self.without_sign.remove(program);
            }
        }
        if let Some(report) = self.members.get_mut(&member) {
            reported.is_back = matches!(report, Report::Silent);
            let (first, newest) = match report {
                Report::Reporting { first, newest, .. } => (*first, (*newest).max(cycle)),
                Report::Awaited | Report::Silent => (cycle, cycle),
            };
            *report = Report::Reporting { first, newest, at: self.count };
        }
        for (member, report) in &mut self.members {
            let at = match report {
                Report::Awaited => 0,
                Report::Reporting { at, .. } => *at,
                Report::Silent => continue,
            };
            if self.count - at > self.silent_after {
                *report = Report::Silent;
                reported.silent.push(*member);
            }
        }
        for (program, sign) in (0..).map(ProgramId).zip(&self.signs) {
            if self.count - sign > self.silent_after && !self.without_sign.contains(program) {
                self.without_sign.insert(program);
                reported.without_sign.push(program);
            }
        }
        reported
    }

    /// Notes that the process of a member does not execute.
    pub(super) fn down(&mut self, member: Member) {
        if let Some(report) = self.members.get_mut(&member) {
            *report = Report::Silent;
        }
    }

    /// Notes what the segments before have counted: the newest cycle of a remote I/O.
    pub(super) fn goes_on(&mut self, program: ProgramId, newest: i64) {
        let report = Report::Reporting { first: newest, newest, at: self.count };
        self.members.insert(Member::RemoteIo(program), report);
        self.furthest = self.furthest.max(Some(newest));
    }

    /// Finds the newest complete cycle.
    pub(super) fn find_complete(&mut self, received: &Received) {
        let (Some(furthest), Some(of_remote_ios)) = (self.furthest, self.of_remote_ios()) else {
            return;
        };
        let mut complete = of_remote_ios;
        for (member, report) in &self.members {
            let Member::Station(station) = *member else {
                continue;
            };
            let (newest, at) = match *report {
                Report::Silent => continue,
                Report::Awaited => (None, None),
                Report::Reporting { newest, at, .. } => (Some(newest), Some(at)),
            };
            let unread = newest.map_or(i64::MIN, |newest| newest.saturating_add(1));
            let next = received.first_of(station, unread).filter(|next| *next <= complete);
            if at.is_some_and(|at| self.count - at <= self.unreceived_after) {
                complete = newest.map_or(complete, |newest| newest.min(complete));
            } else if let Some(next) = next {
                complete = next.saturating_sub(1);
            }
        }
        let begins = self.members.values().filter_map(|report| match report {
            Report::Reporting { first, .. } => Some(*first),
            Report::Awaited | Report::Silent => None,
        });
        if begins.max().is_none_or(|begins| begins <= complete) {
            let last = furthest.saturating_sub(cycles(self.silent_after.saturating_mul(2)));
            self.complete = self.complete.max(Some(complete.max(last)));
        }
    }

    /// The newest cycle of which every remote I/O that reports has reported; nothing while one is awaited.
    fn of_remote_ios(&self) -> Option<i64> {
        let mut newest = self.furthest?;
        for (member, report) in &self.members {
            match (member, report) {
                (Member::RemoteIo(_), Report::Awaited) => return None,
                (Member::RemoteIo(_), Report::Reporting { newest: own, .. }) => {
                    newest = newest.min(*own);
                }
                _ => {}
            }
        }
        Some(newest)
    }

    pub(super) fn shift(&mut self, by: i64) {
        for cycle in [&mut self.furthest, &mut self.complete] {
            *cycle = cycle.map(|cycle| cycle.saturating_add(by));
        }
        for report in self.members.values_mut() {
            if let Report::Reporting { first, newest, .. } = report {
                *first = first.saturating_add(by);
                *newest = newest.saturating_add(by);
            }
        }
    }
}

fn cycles(count: u64) -> i64 {
    i64::try_from(count).unwrap_or(i64::MAX)
}
