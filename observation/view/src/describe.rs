//! Records in words.

mod members;
mod processes;

use understudy_journal::{Happening, Members, Record};
use understudy_remote_io::Missing;
use understudy_wire::{Element, Member, ProgramId, ProgramSet, Set, StationId, StationSet};

use crate::event::Level;
pub(crate) use processes::fault_text;

/// A record as a person reads it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Description {
    /// What, in one word, as the journal has it.
    pub event: &'static str,
    /// How much a person should care.
    pub level: Level,
    /// What happened.
    pub text: String,
    /// Whether it belongs to the ordinary course of every cycle.
    pub is_ordinary: bool,
}

/// Every word that [`Description::event`] can be.
pub(crate) const EVENTS: [&str; 66] = [
    "acknowledged",
    "adopted",
    "adopted-lineage",
    "applied",
    "attached",
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
    "exchange",
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
    "synchronised",
    "interrupted",
    "joins",
    "journal",
    "journal-lost",
    "link-failed",
    "link-reopened",
    "new-life",
    "no-new-life",
    "origin",
    "became-cycle-master",
    "protected",
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
    "published",
    "stalled",
    "started",
    "started-cold",
    "state-lost",
    "state-recovered",
    "stepped",
    "stopped",
    "syndrome",
    "unforced",
    "unknown-command",
    "unprotected",
    "unsendable-frames",
    "value-fault",
    "voided",
];

/// A record in words, with the names of its cluster.
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

/// Why nothing true was there.
pub(crate) fn missing_text(missing: Missing) -> &'static str {
    match missing {
        Missing::NoCycle => "nobody started a cycle",
        Missing::TooLate => "the host woke the remote I/O more than a period after the deadline",
        Missing::BadQuality => "the sensors cannot be seen",
        Missing::NoHistory => "the remote I/O does not know its program's history yet",
        Missing::StateLost => "no living station can prove the program's state",
        Missing::NotReleased => "an operator has to release the outputs",
        Missing::ValueFault => "stations disagree, and nobody can say who is right",
        Missing::NotSynchronised => "nobody who is synchronised published for it",
        Missing::TwoErasures => "a word was there, and another member of it was not",
        Missing::SecondFailure => "two stations have failed, S2",
    }
}

/// A program is called by its controller.
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
        [] => "nobody".to_owned(),
        [one] => one.clone(),
        [first @ .., last] => format!("{} and {last}", first.join(", ")),
    }
}
