//! Records in words.

use understudy_bus::HostEvent;
use understudy_node::Event as StationEvent;
use understudy_remote_io::{Event as RemoteIoEvent, Missing};
use understudy_scenarios::{Action, Happening, Parties, Record, RunEvent, source_word};
use understudy_wire::{
    Member, Party, ProgramId, ProgramSet, Set, SignalPlace, StationId, StationSet,
};

use crate::event::Level;

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
pub(crate) const EVENTS: [&str; 46] = [
    "adopted",
    "adopted-lineage",
    "applied",
    "channel-failed",
    "channel-opened",
    "cleared",
    "commanded",
    "diagnosed",
    "digest-differs",
    "disputed",
    "ended",
    "exchange",
    "excluded",
    "fault",
    "field-lost",
    "field-regained",
    "finished",
    "flagged",
    "forced",
    "in-step",
    "interrupted",
    "joins",
    "journal-lost",
    "origin",
    "paces",
    "readmitted",
    "ready",
    "recalled-exclusion",
    "refused",
    "refused-bytes",
    "refused-frames",
    "released",
    "sampled",
    "source",
    "spoke",
    "stalled",
    "started",
    "started-cold",
    "stepped",
    "stopped",
    "syndrome",
    "unforced",
    "unknown-command",
    "unsendable-frames",
    "value-fault",
    "voided",
];

/// A record in words, with the names of its cluster.
pub fn describe(record: &Record, parties: &Parties) -> Description {
    let (event, level, text) = match &record.event {
        Happening::Station(event) => station(event, parties),
        Happening::RemoteIo(event) => remote_io(event, parties),
        Happening::Plant(event) => plant(event, parties),
        Happening::Host(event) => host(event),
        Happening::Run(event) => run(event, parties),
    };
    Description {
        event,
        level,
        text,
        is_ordinary: matches!(event, "spoke" | "sampled" | "applied" | "stepped"),
    }
}

type Words = (&'static str, Level, String);

fn station(event: &StationEvent, parties: &Parties) -> Words {
    use Level::{Alarm, Info, Notice, Warning};
    match event {
        StationEvent::Spoke { words, .. } => {
            let words: Vec<String> = words
                .iter()
                .map(|word| format!("{} {}", programs(word.members, parties), word.sum))
                .collect();
            ("spoke", Info, format!("says {}", list(&words)))
        }
        StationEvent::Paces { .. } => ("paces", Notice, "starts the cycles from now on".to_owned()),
        StationEvent::Flagged { station, .. } => flagged(*station, parties),
        StationEvent::Cleared { station, .. } => cleared(*station, parties),
        StationEvent::Joins { wants, .. } => {
            let text = if wants.is_empty() {
                "listens".to_owned()
            } else {
                format!(
                    "listens, and asks for the state of {}",
                    programs(*wants, parties)
                )
            };
            ("joins", Notice, text)
        }
        StationEvent::Adopted {
            program,
            from,
            lineage,
            ..
        } => {
            let whose = program_name(*program, parties);
            let text = match from {
                Some(from) => {
                    let from = parties.name(Party::Station(*from));
                    format!("has the state of {whose} from {from}, at lineage {lineage}")
                }
                None => format!("starts {whose} from its initial state"),
            };
            ("adopted", Notice, text)
        }
        StationEvent::InStep { program, .. } => {
            let whose = program_name(*program, parties);
            (
                "in-step",
                Notice,
                format!("is in step with {whose}, and speaks for it"),
            )
        }
        StationEvent::DigestDiffers {
            program, station, ..
        } => {
            let other = parties.name(Party::Station(*station));
            let whose = program_name(*program, parties);
            (
                "digest-differs",
                Warning,
                format!("has another state of {whose} than {other}, after the same inputs"),
            )
        }
        StationEvent::Excluded { program, .. } => {
            let whose = program_name(*program, parties);
            (
                "excluded",
                Alarm,
                format!("says nothing of {whose}: its state was found faulty"),
            )
        }
        StationEvent::Readmitted { program, .. } => {
            let whose = program_name(*program, parties);
            ("readmitted", Notice, format!("begins again with {whose}"))
        }
        StationEvent::Refused {
            party,
            theirs,
            ours,
        } => refused(*party, theirs.to_string(), ours.to_string(), parties),
        StationEvent::Stalled { late, .. } => stalled(*late),
    }
}

fn remote_io(event: &RemoteIoEvent, parties: &Parties) -> Words {
    use Level::{Alarm, Info, Notice, Warning};
    match event {
        RemoteIoEvent::Sampled { inputs, .. } => ("sampled", Info, format!("samples {inputs}")),
        RemoteIoEvent::Applied {
            outputs,
            source,
            word_of,
            missing,
            ..
        } => {
            let mut text = format!("drives {outputs}, {}", source_word(*source));
            if let Some(station) = word_of {
                text += &format!(" from a word of {}", parties.name(Party::Station(*station)));
            }
            if let Some(missing) = missing {
                text += &format!(": {}", missing_text(*missing));
            }
            ("applied", Info, text)
        }
        RemoteIoEvent::StartedCold { awaits_release, .. } => {
            let release = if *awaits_release {
                "; an operator has to release its outputs"
            } else {
                ""
            };
            (
                "started-cold",
                Notice,
                format!("starts its program from the initial state{release}"),
            )
        }
        RemoteIoEvent::AdoptedLineage { lineage, from, .. } => {
            let from = parties.name(Party::Station(*from));
            (
                "adopted-lineage",
                Notice,
                format!("goes on from the state that {from} has, at lineage {lineage}"),
            )
        }
        RemoteIoEvent::Disputed { stations: who, .. } => {
            let who = stations(*who, parties);
            (
                "disputed",
                Alarm,
                format!(
                    "{who} hold different states of one cycle: an operator has to decide by releasing its outputs"
                ),
            )
        }
        RemoteIoEvent::Voided {
            samples, lineage, ..
        } => (
            "voided",
            Warning,
            format!(
                "{samples} samples that nobody heard are void; it goes on from lineage {lineage}"
            ),
        ),
        RemoteIoEvent::Released { .. } => (
            "released",
            Notice,
            "an operator has released its outputs and whom it had accused".to_owned(),
        ),
        RemoteIoEvent::RecalledExclusion { stations: who, .. } => {
            let who = stations(*who, parties);
            let text = format!(
                "{who} stays excluded, as other stations recall, until an operator releases it"
            );
            ("recalled-exclusion", Alarm, text)
        }
        RemoteIoEvent::Diagnosed { failed, .. } => {
            let text = format!("its diagnosis finds these channels failed: {failed}");
            ("diagnosed", Warning, text)
        }
        RemoteIoEvent::Flagged { station, .. } => flagged(*station, parties),
        RemoteIoEvent::Cleared { station, .. } => cleared(*station, parties),
        RemoteIoEvent::Syndrome {
            syndrome, accused, ..
        } => {
            let who = stations(*accused, parties);
            (
                "syndrome",
                Warning,
                format!("the words do not add up, syndrome {syndrome}: one of {who} is wrong"),
            )
        }
        RemoteIoEvent::ValueFault {
            accused,
            located,
            answer,
            ..
        } => {
            let who = stations(*accused, parties);
            let text = if *located {
                format!("{who} is wrong by majority, and excluded until an operator releases it")
            } else {
                format!("one of {who} is wrong, and nobody can say who; the answer is {answer:?}")
            };
            ("value-fault", Alarm, text)
        }
        RemoteIoEvent::DigestDiffers {
            program, accused, ..
        } => {
            let who = stations(*accused, parties);
            let whose = program_name(*program, parties);
            (
                "digest-differs",
                Warning,
                format!("{who} have different states of {whose} after the same inputs"),
            )
        }
        RemoteIoEvent::Refused {
            party,
            theirs,
            ours,
        } => refused(*party, theirs.to_string(), ours.to_string(), parties),
        RemoteIoEvent::Stalled { late, .. } => stalled(*late),
        RemoteIoEvent::Forced { force, .. } => {
            let text = format!(
                "{} is forced to {} for {} s by {}: {}",
                place(force.signal),
                u8::from(force.value),
                force.seconds,
                force.owner,
                force.reason
            );
            ("forced", Alarm, text)
        }
        RemoteIoEvent::Unforced {
            signal, expired, ..
        } => {
            let why = if *expired {
                "its time is over"
            } else {
                "taken back"
            };
            (
                "unforced",
                Notice,
                format!("{} is its own again: {why}", place(*signal)),
            )
        }
    }
}

fn place(signal: SignalPlace) -> String {
    match signal {
        SignalPlace::Input(place) => format!("input {}", place + 1),
        SignalPlace::Output(place) => format!("output {}", place + 1),
    }
}

fn plant(event: &understudy_plant::Event, parties: &Parties) -> Words {
    match event {
        understudy_plant::Event::Stepped { field, .. } => {
            let text = format!(
                "its sensors see {}, {} finished",
                field.sensors, field.finished
            );
            ("stepped", Level::Info, text)
        }
        understudy_plant::Event::Refused {
            party,
            theirs,
            ours,
        } => refused(*party, theirs.to_string(), ours.to_string(), parties),
    }
}

fn host(event: &HostEvent) -> Words {
    use Level::{Alarm, Info, Notice, Warning};
    match event {
        HostEvent::Ready {
            process, address, ..
        } => (
            "ready",
            Info,
            format!("listens as process {process} at {address}"),
        ),
        HostEvent::RefusedBytes { datagrams, reason } => (
            "refused-bytes",
            Warning,
            format!("{datagrams} datagrams were no frames: {reason}"),
        ),
        HostEvent::RefusedFrames {
            datagrams, reason, ..
        } => (
            "refused-frames",
            Warning,
            format!("{datagrams} frames did not count: {reason}"),
        ),
        HostEvent::ChannelOpened { address, .. } => (
            "channel-opened",
            Info,
            format!("operators can call at {address}"),
        ),
        HostEvent::ChannelFailed { reason } => (
            "channel-failed",
            Warning,
            format!("operators cannot call: {reason}"),
        ),
        HostEvent::UnsendableFrames { frames, reason } => (
            "unsendable-frames",
            Warning,
            format!("{frames} frames could not be sent: {reason}"),
        ),
        HostEvent::FieldLost { reason } => (
            "field-lost",
            Alarm,
            format!("its equipment cannot be seen: {reason}"),
        ),
        HostEvent::FieldRegained => (
            "field-regained",
            Notice,
            "its equipment can be seen again".to_owned(),
        ),
        HostEvent::JournalLost { records } => (
            "journal-lost",
            Warning,
            format!("{records} records are lost"),
        ),
        HostEvent::UnknownCommand { line } => (
            "unknown-command",
            Warning,
            format!("was told what is no command: {line}"),
        ),
        HostEvent::Exchange(exchange) => (
            "exchange",
            Info,
            format!("{} complete cycles", exchange.complete_cycles),
        ),
        HostEvent::Stopped(_) => ("stopped", Info, "ended as it was told to".to_owned()),
    }
}

fn run(event: &RunEvent, parties: &Parties) -> Words {
    use Level::{Info, Notice, Warning};
    match event {
        RunEvent::Started { party } => (
            "started",
            Notice,
            format!("{} is started", parties.name(*party)),
        ),
        RunEvent::Fault { action, party, .. } => {
            ("fault", Notice, fault_text(*action, *party, parties))
        }
        RunEvent::Commanded {
            party,
            command,
            owner,
            reason,
            refused,
        } => {
            let what = serde_json::to_value(command).unwrap_or_default();
            let what = what["command"].as_str().unwrap_or("command").to_owned();
            let refused = refused
                .as_ref()
                .map_or(String::new(), |why| format!("; not done: {why}"));
            let text = format!(
                "{owner} commands {what} of {}: {reason}{refused}",
                parties.name(*party)
            );
            ("commanded", Notice, text)
        }
        RunEvent::Ended { party, how } => (
            "ended",
            Warning,
            format!("{} has ended by itself: {how}", parties.name(*party)),
        ),
        RunEvent::Origin { .. } => (
            "origin",
            Info,
            "everybody is in step: cycles are counted from here".to_owned(),
        ),
        RunEvent::Interrupted => (
            "interrupted",
            Notice,
            "the run was asked to end early".to_owned(),
        ),
        RunEvent::Finished => ("finished", Info, "the run is over".to_owned()),
    }
}

/// What was done to a party.
pub(crate) fn fault_text(action: Action, party: Party, parties: &Parties) -> String {
    let name = parties.name(party);
    match action {
        Action::Crash => format!("{name} is killed"),
        Action::Restart => format!("{name} is started again"),
        Action::Stop => format!("{name} is stopped"),
        Action::Continue => format!("{name} goes on"),
        Action::Cut { to } => format!("{name} is cut off from {}", parties.name(to)),
        Action::Heal { to } => format!("{name} is connected to {} again", parties.name(to)),
        Action::Delay { to, by } => format!("{} hears {name} {by:?} later", parties.name(to)),
        Action::Release => format!("{name} is released"),
        other => format!("{} is done to {name}", other.word()),
    }
}

fn flagged(station: StationId, parties: &Parties) -> Words {
    let name = parties.name(Party::Station(station));
    (
        "flagged",
        Level::Warning,
        format!("{name} has been silent for too long, and its slot is closed"),
    )
}

fn cleared(station: StationId, parties: &Parties) -> Words {
    let name = parties.name(Party::Station(station));
    ("cleared", Level::Notice, format!("{name} speaks again"))
}

fn refused(party: Party, theirs: String, ours: String, parties: &Parties) -> Words {
    let name = parties.name(party);
    (
        "refused",
        Level::Warning,
        format!("{name} runs configuration {theirs}, not {ours}; its frames are dropped"),
    )
}

fn stalled(late: std::time::Duration) -> Words {
    (
        "stalled",
        Level::Notice,
        format!("the host woke it {late:.1?} late"),
    )
}

/// Why nothing true was there.
pub(crate) fn missing_text(missing: Missing) -> &'static str {
    match missing {
        Missing::NoCycle => "nobody started a cycle",
        Missing::TooLate => "the host woke the remote I/O more than a period after the deadline",
        Missing::BadQuality => "the sensors cannot be seen",
        Missing::NoHistory => "the remote I/O does not know its program's history yet",
        Missing::NotReleased => "an operator has to release the outputs",
        Missing::ValueFault => "stations disagree, and nobody can say who is right",
        Missing::NobodyInStep => "nobody who is in step spoke for it",
        Missing::TwoErasures => "a word was there, and another member of it was not",
        Missing::SecondFailure => "two stations have failed, S2",
    }
}

/// A program is called by its controller.
pub(crate) fn program_name(program: ProgramId, parties: &Parties) -> &str {
    parties.name(Party::Station(StationId(program.0)))
}

fn programs(set: ProgramSet, parties: &Parties) -> String {
    names(set, |program: ProgramId| {
        program_name(program, parties).to_owned()
    })
}

pub(crate) fn stations(set: StationSet, parties: &Parties) -> String {
    names(set, |station: StationId| {
        parties.name(Party::Station(station)).to_owned()
    })
}

fn names<M: Member>(set: Set<M>, name: impl Fn(M) -> String) -> String {
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
