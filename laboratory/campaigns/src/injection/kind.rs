//! The kinds of faults that a campaign injects, the roles that they strike, and the phases of the cycle in which they do.

use std::fmt;
use std::time::Duration;

use serde::{Deserialize, Serialize};
use understudy_cycle::Schedule;
use understudy_simulator::Network;
use understudy_wire::{Member, StationId};

/// What is injected. Every kind but the last five strikes one member.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Kind {
    /// An operator writes a value: not a fault, but to be right beside all of them.
    Write,
    /// A member is gone, and restarted later.
    Crash,
    /// It crashes and restarts several times in a row.
    RestartStorm,
    /// It is restarted on a host whose wall clock has jumped, so that it would found an epoch of long ago or of a far future.
    ClockJump,
    /// It stands still, and goes on later.
    Stop,
    /// It and what it is told are late for a while.
    Slow,
    /// It is restarted with another configuration for a while.
    Misconfiguration,
    /// A remote I/O and one of its stations are restarted with one and the same wrong program for a while.
    WrongProgram,
    /// One member does not hear another for a while.
    OneWayCut,
    /// The link from one member to another is broken for long, then a station crashes.
    BrokenLink,
    /// Two members do not hear each other for a while.
    Cut,
    /// What one member sends comes late to another for a while.
    LateLink,
    /// A member hears nobody and is heard by nobody for a while.
    Isolation,
    /// Of two networks one fails, or the cable of one member to it is pulled, for a while.
    NetworkFailure,
    /// An input module of one of two remote I/Os shows a fixed value for a while.
    StuckInput,
    /// Bits of some of its frames flip on their way.
    CorruptFrames,
    /// An old frame of it comes once more.
    Replay,
    /// A stranger speaks in its name, without its key.
    Forgery,
    /// A bit of a state flips in its memory.
    FlippedState,
    /// A bit of a sample flips where it is made or taken in.
    FlippedSample,
    /// A bit of an output word flips on its way out.
    FlippedWord,
    /// Everybody is gone within two cycles, and starts again later, in any order.
    PowerFailure,
    /// Frames of everybody are lost for a while.
    Loss,
    /// Frames of everybody arrive twice.
    Duplication,
    /// Frames of everybody overtake each other.
    Jitter,
    /// Bits of everybody's frames flip.
    Corruption,
}

impl Kind {
    /// In the order in which they are explained.
    pub const ALL: [Self; 26] = [
        Self::Write,
        Self::Crash,
        Self::RestartStorm,
        Self::ClockJump,
        Self::Stop,
        Self::Slow,
        Self::Misconfiguration,
        Self::WrongProgram,
        Self::OneWayCut,
        Self::BrokenLink,
        Self::Cut,
        Self::LateLink,
        Self::Isolation,
        Self::NetworkFailure,
        Self::StuckInput,
        Self::CorruptFrames,
        Self::Replay,
        Self::Forgery,
        Self::FlippedState,
        Self::FlippedSample,
        Self::FlippedWord,
        Self::PowerFailure,
        Self::Loss,
        Self::Duplication,
        Self::Jitter,
        Self::Corruption,
    ];

    /// As tables and the command line write it.
    pub fn word(self) -> &'static str {
        match self {
            Self::Write => "write",
            Self::Crash => "crash",
            Self::RestartStorm => "restart-storm",
            Self::ClockJump => "clock-jump",
            Self::Stop => "stop",
            Self::Slow => "slow",
            Self::Misconfiguration => "misconfiguration",
            Self::WrongProgram => "wrong-program",
            Self::OneWayCut => "one-way-cut",
            Self::BrokenLink => "broken-link",
            Self::Cut => "cut",
            Self::LateLink => "late-link",
            Self::Isolation => "isolation",
            Self::NetworkFailure => "network-failure",
            Self::StuckInput => "stuck-input",
            Self::CorruptFrames => "corrupt-frames",
            Self::Replay => "replay",
            Self::Forgery => "forgery",
            Self::FlippedState => "flipped-state",
            Self::FlippedSample => "flipped-sample",
            Self::FlippedWord => "flipped-word",
            Self::PowerFailure => "power-failure",
            Self::Loss => "loss",
            Self::Duplication => "duplication",
            Self::Jitter => "jitter",
            Self::Corruption => "corruption",
        }
    }

    /// Whom it can strike.
    pub fn roles(self) -> &'static [Role] {
        match self {
            Self::FlippedState | Self::FlippedWord | Self::ClockJump => {
                &[Role::Controller, Role::Understudy]
            }
            Self::Loss | Self::Duplication | Self::Jitter | Self::Corruption => &[Role::Network],
            Self::Write | Self::WrongProgram | Self::StuckInput => &[Role::RemoteIo],
            _ => &[Role::Controller, Role::Understudy, Role::RemoteIo],
        }
    }

    /// The kinds that disturb a network, ascending.
    pub(super) fn of_network(network: &Network) -> impl Iterator<Item = Self> + use<> {
        let there = [
            (Self::Loss, network.loss > 0.0),
            (Self::Duplication, network.duplicate > 0.0),
            (Self::Jitter, !network.jitter.is_zero()),
            (Self::Corruption, network.corruption > 0.0),
        ];
        there.into_iter().filter(|(_, there)| *there).map(|(kind, _)| kind)
    }

    /// The kinds of which nothing wrong may come in a cluster with so many understudies.
    pub fn masked_by(understudies: usize) -> Vec<Self> {
        let kinds = Self::ALL.into_iter();
        kinds.filter(|kind| understudies > 0 || !kind.is_value_fault()).collect()
    }

    /// Whether bits flip behind the back of every checksum, so that only words that differ can show it.
    pub fn is_value_fault(self) -> bool {
        matches!(self, Self::FlippedState | Self::FlippedSample | Self::FlippedWord)
    }
}

impl fmt::Display for Kind {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.pad(self.word())
    }
}

/// Whom a fault strikes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Role {
    /// A controller.
    Controller,
    /// An understudy.
    Understudy,
    /// A remote I/O.
    RemoteIo,
    /// Everybody's frames.
    Network,
}

impl Role {
    /// In order.
    pub const ALL: [Self; 4] = [Self::Controller, Self::Understudy, Self::RemoteIo, Self::Network];

    /// As tables write it.
    pub fn word(self) -> &'static str {
        match self {
            Self::Controller => "controller",
            Self::Understudy => "understudy",
            Self::RemoteIo => "remote-io",
            Self::Network => "network",
        }
    }

    /// Its members, in order; none of the network.
    pub(super) fn members(self, schedule: &Schedule) -> impl Iterator<Item = Member> + use<> {
        let controllers = schedule.controllers() as u8;
        let stations = schedule.stations() as u8;
        let (range, station) = match self {
            Self::Controller => (0..controllers, true),
            Self::Understudy => (controllers..stations, true),
            Self::RemoteIo => (0..controllers, false),
            Self::Network => (0..0, false),
        };
        range.map(move |index| {
            if station {
                Member::Station(StationId(index))
            } else {
                Member::RemoteIo(understudy_wire::ProgramId(index))
            }
        })
    }
}

impl fmt::Display for Role {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.pad(self.word())
    }
}

/// A part of the cycle, by who speaks in it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Phase {
    /// The Sync and the samples.
    Samples,
    /// The controllers' turns.
    Controllers,
    /// The understudies' turns.
    Understudies,
    /// Copies, up to the deadline.
    Copies,
    /// From the deadline on.
    Rest,
}

impl Phase {
    /// In the order of the cycle.
    pub const ALL: [Self; 5] =
        [Self::Samples, Self::Controllers, Self::Understudies, Self::Copies, Self::Rest];

    /// As tables write it.
    pub fn word(self) -> &'static str {
        match self {
            Self::Samples => "samples",
            Self::Controllers => "controllers",
            Self::Understudies => "understudies",
            Self::Copies => "copies",
            Self::Rest => "rest",
        }
    }

    /// The phase at `part` of a cycle, from 0 to below 1.
    pub fn at(part: f64, schedule: &Schedule) -> Self {
        let offset = schedule.period().mul_f64(part.clamp(0.0, 1.0));
        let first = |rank: usize| -> Option<Duration> {
            (rank < schedule.stations()).then(|| schedule.slot(StationId(rank as u8)))
        };
        let last_call = schedule.last_call();
        let controllers = first(0).unwrap_or(last_call);
        let understudies = first(schedule.controllers()).unwrap_or(last_call);
        match offset {
            offset if offset < controllers => Self::Samples,
            offset if offset < understudies => Self::Controllers,
            offset if offset < last_call => Self::Understudies,
            offset if offset < schedule.deadline() => Self::Copies,
            _ => Self::Rest,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Phases ascend, each is met, and they change where the schedule says.
    #[test]
    fn the_cycle_has_all_phases_in_order() {
        for understudies in 0..3 {
            let schedule = Schedule::new(Duration::from_millis(10), 2, understudies, 2)
                .expect("within bounds");
            let phases: Vec<Phase> =
                (0..1000).map(|part| Phase::at(f64::from(part) / 1000.0, &schedule)).collect();
            assert!(phases.is_sorted());
            for phase in Phase::ALL {
                let met = phases.contains(&phase);
                assert_eq!(met, phase != Phase::Understudies || understudies > 0);
            }
            let before = Phase::at(0.6499, &schedule);
            assert_eq!((before, Phase::at(0.65, &schedule)), (Phase::Copies, Phase::Rest));
        }
    }

    #[test]
    fn every_member_has_one_role() {
        let schedule = Schedule::new(Duration::from_millis(10), 3, 2, 2).expect("within bounds");
        let members: Vec<Member> =
            Role::ALL.into_iter().flat_map(|role| role.members(&schedule)).collect();
        assert_eq!(members.len(), 3 + 2 + 3);
        let distinct: std::collections::BTreeSet<_> = members.iter().collect();
        assert_eq!(distinct.len(), members.len());
    }

    #[test]
    fn the_table_of_faults_has_every_kind() {
        let page = include_str!("../../../../docs/how-to/campaign.md");
        let rows: Vec<&str> = page.lines().filter(|line| line.starts_with("| `")).collect();
        for kind in Kind::ALL {
            let word = format!("`{kind}`");
            assert!(rows.iter().any(|row| row.contains(&word)), "{word}");
        }
    }
}
