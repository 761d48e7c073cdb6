//! What stations, remote I/Os and plants say of themselves.

use understudy_journal::{Members, source_word};
use understudy_node::Event as StationEvent;
use understudy_remote_io::{Event as RemoteIoEvent, Lacking, LackingReason};
use understudy_wire::{Member, SignalPlace, StationId};

use super::{Words, list, missing_text, program_name, programs, stations};
use crate::event::Level;

pub(super) fn station(event: &StationEvent, members: &Members) -> Words {
    use Level::{Alarm, Info, Notice, Warning};
    match event {
        StationEvent::Published { words, .. } => {
            let words: Vec<String> = words
                .iter()
                .map(|word| format!("{} {}", programs(word.mask, members), word.sum))
                .collect();
            ("published", Info, format!("says {}", list(&words)))
        }
        StationEvent::Holds {
            program, lineage, ..
        } => {
            let whose = program_name(*program, members);
            (
                "holds",
                Info,
                format!("holds the state of {whose} at lineage {lineage}"),
            )
        }
        StationEvent::BecameCycleMaster { .. } => (
            "became-cycle-master",
            Notice,
            "starts the cycles from now on".to_owned(),
        ),
        StationEvent::Flagged { station, .. } => flagged(*station, members),
        StationEvent::Cleared { station, .. } => cleared(*station, members),
        StationEvent::Joins { wants, .. } => {
            let text = if wants.is_empty() {
                "listens".to_owned()
            } else {
                format!(
                    "listens, and asks for the state of {}",
                    programs(*wants, members)
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
            let whose = program_name(*program, members);
            let text = match from {
                Some(from) => {
                    let from = members.name(Member::Station(*from));
                    format!("has the state of {whose} from {from}, at lineage {lineage}")
                }
                None => format!("starts {whose} from its initial state"),
            };
            ("adopted", Notice, text)
        }
        StationEvent::Synchronised { program, .. } => {
            let whose = program_name(*program, members);
            (
                "synchronised",
                Notice,
                format!("is synchronised with {whose}, and speaks for it"),
            )
        }
        StationEvent::DigestDiffers {
            program, station, ..
        } => {
            let other = members.name(Member::Station(*station));
            let whose = program_name(*program, members);
            (
                "digest-differs",
                Warning,
                format!("has another state of {whose} than {other}, after the same inputs"),
            )
        }
        StationEvent::Excluded { program, .. } => {
            let whose = program_name(*program, members);
            (
                "excluded",
                Alarm,
                format!("says nothing of {whose}: its state was found faulty"),
            )
        }
        StationEvent::Readmitted { program, .. } => {
            let whose = program_name(*program, members);
            ("readmitted", Notice, format!("begins again with {whose}"))
        }
        StationEvent::Refused {
            member,
            theirs,
            ours,
        } => refused(*member, theirs.to_string(), ours.to_string(), members),
        StationEvent::Stalled { late, .. } => stalled(*late),
    }
}

pub(super) fn remote_io(event: &RemoteIoEvent, members: &Members) -> Words {
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
                text += &format!(
                    " from a word of {}",
                    members.name(Member::Station(*station))
                );
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
            let from = members.name(Member::Station(*from));
            (
                "adopted-lineage",
                Notice,
                format!("goes on from the state that {from} has, at lineage {lineage}"),
            )
        }
        RemoteIoEvent::Disputed { stations: who, .. } => {
            let who = stations(*who, members);
            (
                "disputed",
                Alarm,
                format!(
                    "{who} hold different states of one cycle: an operator has to decide by releasing its outputs"
                ),
            )
        }
        RemoteIoEvent::StateLost {
            applied,
            newest,
            holder,
            asks,
            ..
        } => {
            let holder = members.name(Member::Station(*holder));
            let behind = applied.map_or_else(
                || "it cannot know whether newer outputs were applied".to_owned(),
                |applied| format!("outputs of cycle {} were applied", applied.cycle.0),
            );
            let next = if *asks {
                "the operator chooses this state (accept-state) or a cold start (cold-start)"
            } else {
                "the program starts cold, as configured"
            };
            let text = format!(
                "the state of its program is lost: the newest available state, of {holder}, is from cycle {} of the cluster, and {behind}; {next}",
                newest.cycle.0
            );
            ("state-lost", Alarm, text)
        }
        RemoteIoEvent::StateRecovered { from, .. } => {
            let from = members.name(Member::Station(*from));
            let text = format!("{from} has returned with the state of its program");
            ("state-recovered", Notice, text)
        }
        RemoteIoEvent::ChoiceRefused { newest, .. } => {
            let text = match newest {
                Some(newest) => format!(
                    "refuses the operator's choice: the newest available state is from cycle {}",
                    newest.cycle.0
                ),
                None => {
                    "refuses the operator's choice: the state of its program is not lost".to_owned()
                }
            };
            ("choice-refused", Warning, text)
        }
        RemoteIoEvent::Protected { .. } => (
            "protected",
            Notice,
            "its program is protected: the failure of one station would be masked".to_owned(),
        ),
        RemoteIoEvent::Unprotected { lacking, .. } => {
            let reasons: Vec<String> = lacking
                .iter()
                .map(|one| lacking_text(one, members))
                .collect();
            let text = format!("its program is not protected: {}", reasons.join(", "));
            ("unprotected", Alarm, text)
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
            let who = stations(*who, members);
            let text = format!(
                "{who} stays excluded, as other stations recall, until an operator releases it"
            );
            ("recalled-exclusion", Alarm, text)
        }
        RemoteIoEvent::Diagnosed { failed, .. } => {
            let text = format!("its diagnosis finds these channels failed: {failed}");
            ("diagnosed", Warning, text)
        }
        RemoteIoEvent::Flagged { station, .. } => flagged(*station, members),
        RemoteIoEvent::Cleared { station, .. } => cleared(*station, members),
        RemoteIoEvent::Syndrome {
            syndrome, accused, ..
        } => {
            let who = stations(*accused, members);
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
            let who = stations(*accused, members);
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
            let who = stations(*accused, members);
            let whose = program_name(*program, members);
            (
                "digest-differs",
                Warning,
                format!("{who} have different states of {whose} after the same inputs"),
            )
        }
        RemoteIoEvent::Refused {
            member,
            theirs,
            ours,
        } => refused(*member, theirs.to_string(), ours.to_string(), members),
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

pub(super) fn plant(event: &understudy_plant::Event, members: &Members) -> Words {
    match event {
        understudy_plant::Event::Stepped { field, .. } => {
            let text = format!(
                "its sensors see {}, {} finished",
                field.sensors, field.finished
            );
            ("stepped", Level::Info, text)
        }
        understudy_plant::Event::Refused {
            member,
            theirs,
            ours,
        } => refused(*member, theirs.to_string(), ours.to_string(), members),
    }
}

fn flagged(station: StationId, members: &Members) -> Words {
    let name = members.name(Member::Station(station));
    (
        "flagged",
        Level::Warning,
        format!("{name} has been silent for too long, and its slot is closed"),
    )
}

fn cleared(station: StationId, members: &Members) -> Words {
    let name = members.name(Member::Station(station));
    ("cleared", Level::Notice, format!("{name} speaks again"))
}

fn refused(member: Member, theirs: String, ours: String, members: &Members) -> Words {
    let name = members.name(member);
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

/// Why a station cannot stand in for a program.
fn lacking_text(lacking: &Lacking, members: &Members) -> String {
    let name = members.name(Member::Station(lacking.station));
    match lacking.reason {
        LackingReason::NotReceived => {
            format!("{name} is not received (it is down, or the link from it)")
        }
        LackingReason::Joining => format!("{name} is joining"),
        LackingReason::Behind { stepped } => {
            format!("the state of {name} is too old (cycle {})", stepped.cycle.0)
        }
        LackingReason::Excluded => format!("{name} is excluded"),
        LackingReason::Failed => {
            format!("{name} has failed, and the paper's mode masks one failure")
        }
    }
}
