//! The press cell of section V as parts of a simulation.
#![allow(dead_code, reason = "each test uses a part of it")]

use std::sync::Arc;
use std::time::Duration;

use understudy_cycle::{Mode, Turns};
use understudy_remote_io::{Event, PairSettings, PairedInput, Wiring};
use understudy_simulator::{Action, Fault, Parts, Record};
use understudy_wire::{Member, ProgramId, Source, StationId, Time};

pub(crate) const PERIOD: Duration = Duration::from_millis(10);
pub(crate) const HOLD_CYCLES: u32 = 3;
pub(crate) const DISCREPANCY_CYCLES: u32 = 10;

/// The robot, the press, their understudy, and the remote I/Os of both programs.
pub(crate) const MEMBERS: [Member; 5] = [
    Member::Station(StationId(0)),
    Member::Station(StationId(1)),
    Member::Station(StationId(2)),
    Member::RemoteIo(ProgramId(0)),
    Member::RemoteIo(ProgramId(1)),
];

/// A robot and its press.
pub(crate) fn parts(mode: Mode, understudies: usize) -> Parts {
    line(2, mode, understudies)
}

/// Gives each program a second remote I/O, which takes over after this number of cycles.
pub(crate) fn pair(parts: &mut Parts, take_over_after: u32) {
    pair_as(parts, PairSettings::exclusive(take_over_after));
}

/// The same where both are wired to the plant; two readings of an input may differ for [`DISCREPANCY_CYCLES`].
pub(crate) fn pair_parallel(parts: &mut Parts, take_over_after: u32) {
    let wiring = Wiring::Parallel { discrepancy_cycles: DISCREPANCY_CYCLES };
    pair_as(parts, PairSettings { wiring, ..PairSettings::exclusive(take_over_after) });
}

/// How the two remote I/Os of each program are wired.
pub(crate) type Wire = fn(&mut Parts, u32);
pub(crate) const WIRINGS: [Wire; 2] = [pair, pair_parallel];

pub(crate) fn fault(at_cycle: u64, phase: f64, member: Member, action: Action) -> Fault {
    Fault { at_cycle, phase, member, action }
}

/// Whether outputs of its program are applied that are proved.
pub(crate) fn applies_proved(record: &Record<'_>) -> bool {
    let Record::RemoteIo(Event::Applied { source, .. }) = record else { return false };
    matches!(source, Source::Direct | Source::Reconstructed)
}

/// The longest time in which the outputs of a program were not driven.
#[derive(Default)]
pub(crate) struct Gap {
    last: Option<Time>,
    longest: Duration,
}

impl Gap {
    /// They are driven.
    pub(crate) fn driven(&mut self, now: Time) {
        let last = self.last.replace(now).unwrap_or(now);
        self.longest = self.longest.max(now.since(last));
    }

    /// In periods in a row, up to the last time that they were driven.
    pub(crate) fn periods(&self) -> u32 {
        let periods = self.longest.as_secs_f64() / PERIOD.as_secs_f64();
        periods.round() as u32 - 1
    }

    /// The same up to `end`.
    pub(crate) fn periods_until(mut self, end: Time) -> u32 {
        let since = self.last.map_or(Duration::MAX, |last| end.since(last));
        self.longest = self.longest.max(since.saturating_sub(PERIOD));
        self.periods()
    }
}

/// The same stations and remote I/Os with these turns.
pub(crate) fn take_turns(parts: &mut Parts, turns: Turns) {
    let stations = parts.stations.iter_mut().map(|it| &mut it.agreement);
    let remote_ios = parts.remote_ios.iter_mut().map(|it| &mut it.agreement);
    for agreement in stations.chain(remote_ios) {
        let agreement = Arc::make_mut(agreement);
        agreement.schedule = agreement.schedule.clone().with_turns(turns);
    }
}

fn pair_as(parts: &mut Parts, pair: PairSettings) {
    for remote_io in &mut parts.remote_ios {
        remote_io.pair = Some(pair);
        remote_io.paired_inputs = PairedInput::exact(&remote_io.layout.input_points);
    }
}

/// A robot, the press that it feeds, a robot, and so on: `programs` in all.
pub(crate) fn line(programs: usize, mode: Mode, understudies: usize) -> Parts {
    understudy_simulator::parts(&understudy_testing::line(programs, understudies, mode))
}
