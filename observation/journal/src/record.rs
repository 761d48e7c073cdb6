//! What the journal holds: one record a line, of every member and of whoever runs the scenario.
//!
//! The same records come from the laboratory's processes and from the simulator, so that one account judges both.

use serde::de::{self, DeserializeOwned};
use serde::{Deserialize, Deserializer, Serialize};
use serde_json::Value;
use serde_json::value::RawValue;
use understudy_bus::{HostEvent, RefusedOrder};
use understudy_cluster::ChangeTexts;
use understudy_simulator::Action;
use understudy_wire::{Member, Moment, StationId};

use crate::continuation::Continuation;
use crate::members::Members;
use crate::operator::{Acknowledgement, Command, Shelving, Unshelving};

/// One line of `journal.jsonl`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Record {
    /// Nanoseconds, on the clock of the host that the member runs on (CLOCK_MONOTONIC); virtual in the simulator.
    pub at_ns: u64,
    /// The member's name; `laboratory` for whoever runs the scenario.
    pub name: String,
    /// Nothing for whoever runs the scenario.
    pub member: Option<Member>,
    /// What happened.
    pub event: Happening,
}

/// What happened, in the words of the member that says it.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(untagged)]
pub enum Happening {
    /// To a controller or an understudy.
    Station(understudy_node::Event),
    /// To a remote I/O.
    RemoteIo(understudy_remote_io::Event),
    /// To a plant.
    Plant(understudy_plant::Event),
    /// To the process that carries a member; never to a simulated one.
    Host(HostEvent),
    /// To the run as a whole.
    Run(RunEvent),
}

/// What whoever runs the scenario does and sees.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "event", rename_all = "kebab-case")]
pub enum RunEvent {
    /// The first record of each file of a journal.
    Journal {
        /// Version of the records that follow.
        version: u32,
        /// The number that the file has when it is closed, since version 3.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        segment: Option<u64>,
    },
    /// Where a reader can begin that looks for a cycle: once in so many bytes, since version 3.
    Checkpoint {
        /// A moment of the cluster.
        moment: Moment,
        /// Which cycle of the run it is.
        cycle: i64,
        /// Whether online changes were loaded or done before it: programs and points are then those that the beginning of its segment says.
        #[serde(rename = "changed", default, skip_serializing_if = "is_false")]
        is_changed: bool,
    },
    /// The second record of a file that continues a run, since version 3: what the files before have counted.
    Continues(Box<Continuation>),
    /// A record of a file before that is still in effect. They follow [`Self::Continues`], oldest first.
    InEffect {
        /// The cycle of the run that it belongs to.
        cycle: i64,
        /// The record.
        #[serde(deserialize_with = "of_value")]
        record: Box<Record>,
    },
    /// A member was started, for the first time or again.
    Started {
        /// Who.
        member: Member,
    },
    /// A step of the scenario was done.
    Fault {
        /// What.
        action: Action,
        /// To whom.
        member: Member,
        /// The first cycle that was to feel it, counted from the origin.
        asked: u64,
    },
    /// Somebody gave a command; what it did stands before it.
    Commanded {
        /// To whom.
        member: Member,
        /// What.
        command: Command,
        /// Who.
        owner: String,
        /// Why.
        reason: String,
        /// Why it was not done, where it was not.
        refused: Option<String>,
    },
    /// The texts of an online change were given to members: from here on the programs can change to these.
    ChangeLoaded {
        /// The texts.
        texts: Box<ChangeTexts>,
    },
    /// An order of a person was refused before it was a command to a member: it names something that does not exist, or the person has no right to it.
    CommandRefused(RefusedOrder),
    /// Somebody has seen an alarm.
    Acknowledged(Acknowledgement),
    /// An alarm on a signal was shelved.
    Shelved(Shelving),
    /// It was taken back from there.
    Unshelved(Unshelving),
    /// What a member of a cluster elsewhere says is heard from now on.
    Attached {
        /// Who.
        member: Member,
    },
    /// What a member of a cluster elsewhere says is not heard; what it does is another matter.
    Detached {
        /// Who.
        member: Member,
        /// Why, in words.
        reason: String,
    },
    /// The process of a member ended unexpectedly.
    Ended {
        /// Which member.
        member: Member,
        /// By which signal or exit status, such as `signal: 9 (SIGKILL)`.
        how: String,
        /// Its last lines on standard error.
        #[serde(default, skip_serializing_if = "Vec::is_empty")]
        said: Vec<String>,
    },
    /// Everybody is synchronised: from here on cycles are counted.
    Origin {
        /// A moment of the cluster.
        moment: Moment,
        /// Which cycle of the run it is; 0 but for a run of which it is known later.
        cycle: u64,
    },
    /// The scenario is over, and the cluster stays up.
    ScenarioOver {
        /// What it came to, such as `passed: every expectation was met`.
        verdict: String,
    },
    /// The run was asked to end early.
    Interrupted,
    /// The last record.
    Finished,
}

/// The name of whoever runs the scenario.
pub const LABORATORY: &str = "laboratory";

impl Record {
    /// Of whoever runs the scenario.
    pub fn of_run(at_ns: u64, event: RunEvent) -> Self {
        Self { at_ns, name: LABORATORY.to_owned(), member: None, event: Happening::Run(event) }
    }

    /// Record of a member.
    pub fn of_member(at_ns: u64, member: Member, members: &Members, event: Happening) -> Self {
        Self { at_ns, name: members.name(member).to_owned(), member: Some(member), event }
    }

    /// The station that the member has flagged, as the record says.
    pub fn flagged(&self) -> Option<StationId> {
        match &self.event {
            Happening::Station(understudy_node::Event::Flagged { station, .. })
            | Happening::RemoteIo(understudy_remote_io::Event::Flagged { station, .. }) => {
                Some(*station)
            }
            _ => None,
        }
    }
}

/// Moment of an event, where it has one.
pub fn moment(event: &Happening) -> Option<Moment> {
    use understudy_node::Event as Station;
    use understudy_remote_io::Event as RemoteIo;
    match event {
        Happening::Station(event) => match event {
            Station::Published { moment, .. }
            | Station::Holds { moment, .. }
            | Station::BecameCycleMaster { moment }
            | Station::Flagged { moment, .. }
            | Station::Cleared { moment, .. }
            | Station::Joins { moment, .. }
            | Station::Adopted { moment, .. }
            | Station::Synchronised { moment, .. }
            | Station::DigestDiffers { moment, .. }
            | Station::Excluded { moment, .. }
            | Station::Readmitted { moment, .. }
            | Station::SamplesMissing { moment, .. }
            | Station::SamplesReturned { moment, .. }
            | Station::NotPrepared { moment, .. }
            | Station::Stalled { moment, .. } => Some(*moment),
            Station::Refused { .. }
            | Station::RefusalEnded { .. }
            | Station::Outvoted { .. }
            | Station::Configured(_) => None,
        },
        Happening::RemoteIo(event) => match event {
            RemoteIo::Sampled { moment, .. }
            | RemoteIo::Applied { moment, .. }
            | RemoteIo::AdoptedLineage { moment, .. }
            | RemoteIo::Voided { moment, .. }
            | RemoteIo::StateLost { moment, .. }
            | RemoteIo::StateRecovered { moment, .. }
            | RemoteIo::ChoiceRefused { moment, .. }
            | RemoteIo::Protected { moment }
            | RemoteIo::Unprotected { moment, .. }
            | RemoteIo::RecalledExclusion { moment, .. }
            | RemoteIo::Diagnosed { moment, .. }
            | RemoteIo::Released { moment }
            | RemoteIo::Forced { moment, .. }
            | RemoteIo::Unforced { moment, .. }
            | RemoteIo::ForceRefused { moment, .. }
            | RemoteIo::UnforceRefused { moment, .. }
            | RemoteIo::Written { moment, .. }
            | RemoteIo::WriteInEffect { moment, .. }
            | RemoteIo::WriteRefused { moment, .. }
            | RemoteIo::WriteVoid { moment, .. }
            | RemoteIo::SignalValidity { moment, .. }
            | RemoteIo::Flagged { moment, .. }
            | RemoteIo::Cleared { moment, .. }
            | RemoteIo::Syndrome { moment, .. }
            | RemoteIo::DigestDiffers { moment, .. }
            | RemoteIo::ValueFault { moment, .. }
            | RemoteIo::Disputed { moment, .. }
            | RemoteIo::ConfigurationDisputed { moment, .. }
            | RemoteIo::ProgramChanged { moment, .. }
            | RemoteIo::ChangeTakenBack { moment, .. }
            | RemoteIo::PointsChanged { moment, .. }
            | RemoteIo::PointsUnknown { moment, .. }
            | RemoteIo::PartChanged { moment, .. }
            | RemoteIo::PartnerLost { moment, .. }
            | RemoteIo::PartnerReceived { moment }
            | RemoteIo::SecondAuthor { moment }
            | RemoteIo::InputsDiffer { moment, .. }
            | RemoteIo::InputExcluded { moment, .. }
            | RemoteIo::InputsAgree { moment, .. }
            | RemoteIo::Stalled { moment, .. } => Some(*moment),
            RemoteIo::StartedCold { born, .. } | RemoteIo::StartedWarm { born, .. } => Some(*born),
            RemoteIo::Refused { .. }
            | RemoteIo::RefusalEnded { .. }
            | RemoteIo::Outvoted { .. }
            | RemoteIo::Points { .. }
            | RemoteIo::Configured(_) => None,
        },
        Happening::Plant(understudy_plant::Event::Stepped { moment, .. }) => Some(*moment),
        Happening::Plant(_) | Happening::Host(_) | Happening::Run(_) => None,
    }
}

fn is_false(value: &bool) -> bool {
    !value
}

/// As it stands in a line, before the member has decided of which kind the event is.
#[derive(Deserialize)]
struct Line {
    at_ns: u64,
    name: String,
    member: Option<Member>,
    event: Box<RawValue>,
}

impl<'de> Deserialize<'de> for Record {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let line = Line::deserialize(deserializer)?;
        let event = happening(line.member, line.event.get()).map_err(de::Error::custom)?;
        Ok(Self { at_ns: line.at_ns, name: line.name, member: line.member, event })
    }
}

/// A record within a record: the outer one is buffered, and [`RawValue`] cannot be taken from there.
fn of_value<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Box<Record>, D::Error> {
    let value = Value::deserialize(deserializer)?;
    let record: Record = serde_json::from_str(&value.to_string()).map_err(de::Error::custom)?;
    // One within it would be written by nobody, and nested without end by somebody.
    match record.event {
        Happening::Run(RunEvent::InEffect { .. }) => Err(de::Error::custom("nested")),
        _ => Ok(Box::new(record)),
    }
}

fn happening(member: Option<Member>, event: &str) -> Result<Happening, serde_json::Error> {
    match member {
        None => serde_json::from_str(event).map(Happening::Run),
        Some(Member::Station(_)) => of_member(event, Happening::Station),
        Some(Member::RemoteIo(_) | Member::Twin(_)) => of_member(event, Happening::RemoteIo),
        Some(Member::Plant(_)) => of_member(event, Happening::Plant),
    }
}

/// Nearly all events are of the member and not of its process, so these are tried first: no name is of both.
fn of_member<E: DeserializeOwned>(
    event: &str,
    of_member: fn(E) -> Happening,
) -> Result<Happening, serde_json::Error> {
    serde_json::from_str(event).map(of_member).or_else(|error| {
        let of_host = serde_json::from_str(event).map(Happening::Host);
        of_host.map_err(|_| error)
    })
}
