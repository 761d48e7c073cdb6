//! What of the events of stations and remote I/Os concerns a campaign; the same in both worlds.

use understudy_node::Event as StationEvent;
use understudy_remote_io::Event as RemoteIoEvent;
use understudy_wire::{Member, Part, ProgramId, Source, StationId, Time, Via};

/// What a campaign has to answer, in the order in which it was seen.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Seen {
    Crashed(StationId),
    Restarted(StationId),
    Flagged(StationId),
    Cleared(StationId),
    Adopted(StationId, ProgramId),
    Synchronised(StationId, ProgramId),
    /// A remote I/O has failed.
    Gone(Member),
    /// A remote I/O starts again.
    Back(Member),
    /// The part of one of two remote I/Os.
    Part(Member, Part),
    /// Whether a network works.
    Network(Via, bool),
    /// The first deadline of a remote I/O with nothing true to apply.
    Missed,
    /// A remote I/O is at its fail-safe; the first deadline with nothing true to apply.
    Lost(Time),
    /// The host stood still.
    Stalled,
    Violation(String),
}

impl Seen {
    /// The station that it is about.
    pub(super) fn station(&self) -> Option<StationId> {
        match self {
            Self::Crashed(station)
            | Self::Restarted(station)
            | Self::Flagged(station)
            | Self::Cleared(station)
            | Self::Adopted(station, _)
            | Self::Synchronised(station, _) => Some(*station),
            Self::Gone(_) | Self::Back(_) | Self::Part(..) | Self::Network(..) => None,
            Self::Missed | Self::Lost(_) | Self::Stalled | Self::Violation(_) => None,
        }
    }
}

/// Since when each remote I/O has had nothing true to apply.
#[derive(Debug)]
pub(super) struct Deadlines(Vec<Option<Time>>);

impl Deadlines {
    pub(super) fn new(programs: usize) -> Self {
        Self(vec![None; programs])
    }

    /// What of an event of a remote I/O concerns a campaign.
    pub(super) fn look(
        &mut self,
        now: Time,
        member: Member,
        event: &RemoteIoEvent,
    ) -> Option<Seen> {
        let (Member::RemoteIo(program) | Member::Twin(program)) = member else {
            return None;
        };
        let source = match event {
            RemoteIoEvent::Flagged { station, .. } => return Some(Seen::Flagged(*station)),
            RemoteIoEvent::Cleared { station, .. } => return Some(Seen::Cleared(*station)),
            RemoteIoEvent::Stalled { .. } => return Some(Seen::Stalled),
            RemoteIoEvent::PartChanged { part, .. } => return Some(Seen::Part(member, *part)),
            RemoteIoEvent::Applied { source, .. } => *source,
            _ => return None,
        };
        let since = &mut self.0[program.index()];
        match source {
            Source::Direct | Source::Reconstructed => {
                *since = None;
                None
            }
            Source::Held if since.is_some() => None,
            Source::Held => {
                *since = Some(now);
                Some(Seen::Missed)
            }
            Source::FailSafe => Some(Seen::Lost(since.unwrap_or(now))),
        }
    }
}

/// What of an event of a station concerns a campaign.
pub(super) fn of_station(station: StationId, event: &StationEvent) -> Option<Seen> {
    match event {
        StationEvent::Flagged { station, .. } => Some(Seen::Flagged(*station)),
        StationEvent::Cleared { station, .. } => Some(Seen::Cleared(*station)),
        StationEvent::Adopted { program, .. } => Some(Seen::Adopted(station, *program)),
        StationEvent::Synchronised { program, .. } => Some(Seen::Synchronised(station, *program)),
        StationEvent::Stalled { .. } => Some(Seen::Stalled),
        _ => None,
    }
}
