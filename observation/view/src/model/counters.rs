//! Events that are counted from the first record on.

use std::collections::BTreeMap;
use std::time::Duration;

use understudy_bus::{HostEvent, Quantiles};
use understudy_journal::{Happening, Record};
use understudy_node::Event as StationEvent;
use understudy_remote_io::Event as RemoteIoEvent;
use understudy_wire::{Member, ProgramId, ProgramSet, StationId};

/// Counts of one member.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct MemberCounters {
    /// Equal histories with unequal states, as the member reports them.
    pub digest_differences: u64,
    /// Stations that the member flagged.
    pub flagged: u64,
    /// Datagrams that are not frames of this cluster.
    pub refused_frames: u64,
    /// Late wake-ups of the member.
    pub stalls: u64,
    /// Total delay of its late wake-ups.
    pub stalled: Duration,
    /// Records that the member could not write.
    pub records_lost: u64,
    /// How long a remote I/O took from its samples to its outputs, and how late it was woken, as it said last.
    pub timed: Option<(Quantiles, Quantiles)>,
}

/// Counts of one program.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct ProgramCounters {
    /// Samples that no station received, and that are void.
    pub voided_samples: u64,
    /// Changes of the channels that its remote I/O diagnoses as failed.
    pub substituted_inputs: u64,
    /// Outputs that differ in one history, or whose syndrome is not 0.
    pub value_faults: u64,
    /// Losses of protection.
    pub protection_losses: u64,
    /// Losses of its state.
    pub state_losses: u64,
}

/// Counts of a run from its first record on; they never decrease.
#[derive(Debug, Clone, Default)]
pub struct Counters {
    members: BTreeMap<Member, MemberCounters>,
    programs: Vec<ProgramCounters>,
    stations: u8,
    /// Programs whose state is lost.
    lost: ProgramSet,
    not_received: BTreeMap<(StationId, ProgramId), u64>,
}

impl Counters {
    pub(super) fn new(stations: usize, programs: usize) -> Self {
        Self {
            programs: vec![ProgramCounters::default(); programs],
            stations: u8::try_from(stations).unwrap_or(u8::MAX),
            ..Self::default()
        }
    }

    /// The counts of a member.
    pub fn member(&self, member: Member) -> MemberCounters {
        self.members.get(&member).copied().unwrap_or_default()
    }

    /// The counts of a program.
    pub fn program(&self, program: ProgramId) -> ProgramCounters {
        let counted = self.programs.get(program.index());
        counted.copied().unwrap_or_default()
    }

    /// Turns of a station that the remote I/O of a program did not receive, for those pairs that have any.
    pub fn turns_not_received(&self) -> impl Iterator<Item = (StationId, ProgramId, u64)> {
        let counts = self.not_received.iter();
        counts.map(|((station, program), count)| (*station, *program, *count))
    }

    /// Late wake-ups of all members.
    pub fn stalls(&self) -> u64 {
        self.members.values().map(|member| member.stalls).sum()
    }

    pub(super) fn note(&mut self, record: &Record) {
        let Some(member) = record.member else {
            return;
        };
        match &record.event {
            Happening::RemoteIo(event) => self.remote_io(member, event),
            Happening::Station(event) => self.station(member, event),
            Happening::Host(event) => self.host(member, event),
            _ => {}
        }
    }

    fn of(&mut self, member: Member) -> &mut MemberCounters {
        self.members.entry(member).or_default()
    }

    fn stalled(&mut self, member: Member, late: Duration) {
        let own = self.of(member);
        own.stalls += 1;
        own.stalled = own.stalled.saturating_add(late);
    }

    fn station(&mut self, member: Member, event: &StationEvent) {
        match event {
            StationEvent::DigestDiffers { .. } => self.of(member).digest_differences += 1,
            StationEvent::Flagged { .. } => self.of(member).flagged += 1,
            StationEvent::Stalled { late, .. } => self.stalled(member, *late),
            _ => {}
        }
    }

    fn host(&mut self, member: Member, event: &HostEvent) {
        let own = self.of(member);
        match event {
            HostEvent::RefusedBytes { datagrams, .. }
            | HostEvent::RefusedFrames { datagrams, .. } => own.refused_frames += datagrams,
            HostEvent::JournalLost { records } => own.records_lost += records,
            HostEvent::Timed { sample_to_output, wakeups } => {
                own.timed = Some((*sample_to_output, *wakeups));
            }
            _ => {}
        }
    }

    fn remote_io(&mut self, member: Member, event: &RemoteIoEvent) {
        let Some(program) = member.sampled_program() else {
            return;
        };
        match event {
            RemoteIoEvent::DigestDiffers { .. } => self.of(member).digest_differences += 1,
            RemoteIoEvent::Flagged { .. } => self.of(member).flagged += 1,
            RemoteIoEvent::Stalled { late, .. } => self.stalled(member, *late),
            _ => {}
        }
        let Some(own) = self.programs.get_mut(program.index()) else {
            return;
        };
        match event {
            RemoteIoEvent::Applied { heard, .. } => {
                let stations = (0..self.stations).map(StationId);
                for station in stations.filter(|station| !heard.contains(*station)) {
                    *self.not_received.entry((station, program)).or_default() += 1;
                }
            }
            RemoteIoEvent::Voided { samples, .. } => own.voided_samples += *samples as u64,
            RemoteIoEvent::Diagnosed { .. } => own.substituted_inputs += 1,
            RemoteIoEvent::ValueFault { .. } | RemoteIoEvent::Syndrome { .. } => {
                own.value_faults += 1;
            }
            RemoteIoEvent::Unprotected { .. } => own.protection_losses += 1,
            // It is reported again where another state has become the newest.
            RemoteIoEvent::StateLost { .. } => {
                own.state_losses += u64::from(!self.lost.contains(program));
                self.lost.insert(program);
            }
            RemoteIoEvent::StateRecovered { .. }
            | RemoteIoEvent::AdoptedLineage { .. }
            | RemoteIoEvent::StartedCold { .. }
            | RemoteIoEvent::StartedWarm { .. } => self.lost.remove(program),
            _ => {}
        }
    }
}
