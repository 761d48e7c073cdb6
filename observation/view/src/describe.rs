//! Records as sentences.

use std::collections::BTreeSet;

use understudy_cluster::{AlarmDeclaration, Controller};
use understudy_journal::{AlarmTransition, Cycles, Happening, Members, Record, source_word};
use understudy_remote_io::Missing;
use understudy_typed::Fault;
use understudy_wire::{Element, Member, ProgramId, ProgramSet, Set, Source, StationId, StationSet};

use crate::event::Level;
pub(crate) use members::odd_configuration_text;
pub(crate) use processes::fault_text;
pub(crate) use signals::{Writes, force_text, modules_text};

/// A table of descriptions: each kind of event with its name, its level and its text. It makes the function that describes an event,
/// and the list of the names.
macro_rules! descriptions {
    ($function:ident: $event:ident, $members:ident: $names:ty;
     $($kind:ident $({ $($fields:tt)* })? $(($($values:tt)*))? => $name:literal $level:ident $text:expr;)*) => {
        pub(super) mod $function {
            /// Name of each kind of event.
            pub(in crate::describe) const NAMES: &[&str] = &[$($name),*];
        }

        pub(super) fn $function(event: &$event, $members: &$names) -> Words {
            match event {
                $($event::$kind $({ $($fields)* })? $(($($values)*))? => {
                    ($name, crate::event::Level::$level, String::from($text))
                })*
            }
        }
    };
}

mod fault_lines;
mod members;
mod processes;
mod signals;

/// A record as a sentence.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Description {
    /// Kind of event, as in the journal.
    pub(crate) event: &'static str,
    /// Severity of the event.
    pub(crate) level: Level,
    /// The event in words.
    pub(crate) text: String,
    /// Whether it occurs in every cycle.
    pub(crate) is_ordinary: bool,
}

/// Every value of [`Description::event`], each once.
pub(crate) fn event_names() -> BTreeSet<&'static str> {
    let all = [
        members::station::NAMES,
        members::remote_io::NAMES,
        members::plant::NAMES,
        processes::host::NAMES,
        processes::run::NAMES,
    ];
    // A listing shows a deadline whose source changed, at which a program was found stopped, or with which an alarm changed, as an event of its own.
    let names = all.into_iter().flatten().copied();
    let names = names.chain(["source", PROGRAM_FAULT, ALARM_RAISED, ALARM_OVER]);
    names.collect()
}

/// Describes a record with the names of its cluster, and with the writes and the count of cycles of the records before it.
pub(crate) fn describe(
    record: &Record,
    names: &Members,
    writes: &Writes,
    cycles: &Cycles,
) -> Description {
    let own = signals::Names { members: names, writes, cycles, by: record.member };
    let (event, level, text) = match &record.event {
        Happening::Station(event) => members::station(event, names),
        Happening::RemoteIo(event) => members::remote_io(event, &own),
        Happening::Plant(event) => members::plant(event, &own),
        Happening::Host(event) => processes::host(event, names),
        Happening::Run(event) => processes::run(event, names),
    };
    Description {
        event,
        level,
        text,
        is_ordinary: matches!(
            event,
            "published"
                | "holds"
                | "sampled"
                | "applied"
                | "stepped"
                | "checkpoint"
                | "continues"
                | "in-effect"
                | "timed"
                | "wall-clock"
                | "points"
        ),
    }
}

pub(crate) type Words = (&'static str, Level, String);

/// The event of an alarm on a signal that is active.
pub(crate) const ALARM_RAISED: &str = "alarm-raised";

/// The event of an alarm on a signal that is over.
pub(crate) const ALARM_OVER: &str = "alarm-over";

/// The event of a program fault.
pub(crate) const PROGRAM_FAULT: &str = "program-fault";

/// The event of an online change that a program fault has taken back.
pub(crate) const CHANGE_TAKEN_BACK: &str = "change-taken-back";

/// An alarm on a signal that was raised or is over, as an event with its level and its text.
pub(crate) fn alarm_event(declared: &AlarmDeclaration, transition: AlarmTransition) -> Words {
    let (event, level, what) = match transition {
        AlarmTransition::Raised { since_before } => {
            let since = if since_before { ", perhaps since an earlier cycle" } else { "" };
            let text = &declared.text;
            (ALARM_RAISED, Level::Alarm, format!("is active{since}: {text}"))
        }
        AlarmTransition::Over => (ALARM_OVER, Level::Notice, "is over".to_owned()),
    };
    let (name, priority) = (&declared.name, declared.priority.word());
    (event, level, format!("the alarm {name} ({priority}) {what}"))
}

/// A program fault in words: the program, and where it stopped and why, as far as that is known.
pub(crate) fn program_fault_text(controller: Option<&Controller>, fault: Option<&Fault>) -> String {
    let name = controller.map_or("an unknown program", |controller| controller.name.as_str());
    let typed = controller.map(|controller| controller.code.typed());
    match typed.zip(fault) {
        Some((typed, fault)) => {
            let assigned = fault_lines::assigned_text(typed, fault);
            format!("program fault in {name}: {}{assigned}", fault.describe(typed))
        }
        None => format!("program fault in {name}"),
    }
}

/// Why there was no provable output.
pub(crate) fn missing_text(missing: Missing) -> &'static str {
    match missing {
        Missing::NoCycle => "no station started a cycle",
        Missing::TooLate => "the host woke the remote I/O more than a period after the deadline",
        Missing::BadQuality => "the sensors cannot be read",
        Missing::NoHistory => "the remote I/O does not know its program's history yet",
        Missing::StateLost => "it is open from which state the program starts",
        Missing::NotReleased => "the operator has to release the outputs",
        Missing::ValueFault => "stations disagree and no majority exists",
        Missing::ProgramFault => "a program fault has stopped the program",
        Missing::NotSynchronised => "no synchronised station published for it",
        Missing::TwoErasures => {
            "another output in the parity word's mask was not received (two erasures)"
        }
        Missing::SecondFailure => "two stations have failed (S2)",
    }
}

/// The source of applied outputs in words: where they came from, or why no output was provable.
pub(crate) fn source_text(
    source: Source,
    word_of: Option<StationId>,
    missing: Option<Missing>,
    members: &Members,
) -> String {
    let mut text = source_word(source).to_owned();
    if let Some(station) = word_of {
        let name = members.name(Member::Station(station));
        text += &format!(" from a parity word of {name}");
    }
    if let Some(missing) = missing {
        text += &format!(": {}", missing_text(missing));
    }
    text
}

/// A program has the name of its controller.
pub(crate) fn program_name(program: ProgramId, members: &Members) -> &str {
    members.name(Member::Station(program.controller()))
}

fn programs(set: ProgramSet, members: &Members) -> String {
    names(set, |program: ProgramId| program_name(program, members).to_owned())
}

pub(crate) fn stations(set: StationSet, members: &Members) -> String {
    names(set, |station: StationId| members.name(Member::Station(station)).to_owned())
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
