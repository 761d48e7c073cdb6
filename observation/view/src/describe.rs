//! Records as sentences.

mod members;
mod processes;

use understudy_journal::{Happening, Members, Record};
use understudy_remote_io::Missing;
use understudy_wire::{Element, Member, ProgramId, ProgramSet, Set, StationId, StationSet};

use crate::event::Level;
pub(crate) use processes::fault_text;

/// A record as a sentence.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Description {
    /// Kind of event, as in the journal.
    pub event: &'static str,
    /// Severity of the event.
    pub level: Level,
    /// The event in words.
    pub text: String,
    /// Whether it occurs in every cycle.
    pub is_ordinary: bool,
}

/// Every value of [`Description::event`].
pub(crate) const EVENTS: [&str; 65] = [
    "acknowledged",
    "adopted",
    "adopted-lineage",
    "applied",
    "attached",
    "became-cycle-master",
    "channel-failed",
    "channel-opened",
    "choice-refused",
    "cleared",
    "commanded",
    "detached",
    "diagnosed",
    "digest-differs",
    "disputed",
    "duplicate-found",
    "duplicate-gone",
    "ended",
    "excluded",
    "fault",
    "field-contested",
    "field-lost",
    "field-regained",
    "field-uncontested",
    "finished",
    "flagged",
    "forced",
    "holds",
    "interrupted",
    "joins",
    "journal",
    "journal-lost",
    "link-failed",
    "link-reopened",
    "new-life",
    "no-new-life",
    "origin",
    "protected",
    "published",
    "readmitted",
    "ready",
    "recalled-exclusion",
    "refused",
    "refused-bytes",
    "refused-connections",
    "refused-frames",
    "released",
    "sampled",
    "scenario-over",
    "source",
    "stalled",
    "started",
    "started-cold",
    "state-lost",
    "state-recovered",
    "stepped",
    "stopped",
    "synchronised",
    "syndrome",
    "unforced",
    "unknown-command",
    "unprotected",
    "unsendable-frames",
    "value-fault",
    "voided",
];

/// Describes a record with the names of its cluster.
pub fn describe(record: &Record, names: &Members) -> Description {
    let (event, level, text) = match &record.event {
        Happening::Station(event) => members::station(event, names),
        Happening::RemoteIo(event) => members::remote_io(event, names),
        Happening::Plant(event) => members::plant(event, names),
        Happening::Host(event) => processes::host(event, names),
        Happening::Run(event) => processes::run(event, names),
    };
    Description {
        event,
        level,
        text,
        is_ordinary: matches!(
            event,
            "published" | "holds" | "sampled" | "applied" | "stepped"
        ),
    }
}

type Words = (&'static str, Level, String);

/// Why there was no provable output.
pub(crate) fn missing_text(missing: Missing) -> &'static str {
    match missing {
        Missing::NoCycle => "no station started a cycle",
        Missing::TooLate => "the host woke the remote I/O more than a period after the deadline",
        Missing::BadQuality => "the sensors cannot be read",
        Missing::NoHistory => "the remote I/O does not know its program's history yet",
        Missing::StateLost => "no living station can prove the program's state",
        Missing::NotReleased => "the operator has to release the outputs",
        Missing::ValueFault => "stations disagree and no majority exists",
        Missing::NotSynchronised => "no synchronised station published for it",
        Missing::TwoErasures => {
            "another output in the parity word's mask was not received (two erasures)"
        }
        Missing::SecondFailure => "two stations have failed (S2)",
    }
}

/// A program has the name of its controller.
pub(crate) fn program_name(program: ProgramId, members: &Members) -> &str {
    members.name(Member::Station(StationId(program.0)))
}

fn programs(set: ProgramSet, members: &Members) -> String {
    names(set, |program: ProgramId| {
        program_name(program, members).to_owned()
    })
}

pub(crate) fn stations(set: StationSet, members: &Members) -> String {
    names(set, |station: StationId| {
        members.name(Member::Station(station)).to_owned()
    })
}

fn names<E: Element>(set: Set<E>, name: impl Fn(E) -> String) -> String {
    let names: Vec<String> = set.iter().map(name).collect();
    list(&names)
}

/// `a, b and c`.
pub(crate) fn list(names: &[String]) -> String {
    match names {
        [] => "no station".to_owned(),
        [one] => one.clone(),
        [first @ .., last] => format!("{} and {last}", first.join(", ")),
    }
}
