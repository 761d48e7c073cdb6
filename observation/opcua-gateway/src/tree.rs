//! The variables and their values: one table for the server, for `understudy-opcua nodes` and for the tests.
//!
//! ```text
//!   CLUSTER
//!   ├─ Run, Margin, Alarms, Events
//!   ├─ Alarms/Signals/ALARM
//!   ├─ Stations/STATION
//!   └─ Programs/PROGRAM ── Inputs/SIGNAL, Outputs/SIGNAL, Markers/SIGNAL
//! ```
//!
//! The identifier of a node is its path with `/` between the names, in the namespace `urn:understudy:CLUSTER`.

mod alarms;
mod signals;

use std::borrow::Cow;

use opcua::types::{DataTypeId, StatusCode, UAString, Variant};
use understudy_cluster::{CardFacts, Cluster, Controller};
use understudy_gateway::{Feed, Observation};
use understudy_journal::TimeOfDay;
use understudy_typed::Point;
use understudy_view::{Event, ImageSide, ProgramSnapshot, StationSnapshot};
use understudy_wire::{Image, Member, ProgramId};

use crate::trust;

/// Type of a variable.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// One bit.
    Boolean,
    /// A number that may be negative.
    Int64,
    /// A number.
    UInt64,
    /// A number with a fraction.
    Double,
    /// A text.
    String,
    /// A list of texts.
    Strings,
}

impl Kind {
    /// Name of the type in OPC UA.
    pub fn word(self) -> &'static str {
        match self {
            Self::Boolean => "Boolean",
            Self::Int64 => "Int64",
            Self::UInt64 => "UInt64",
            Self::Double => "Double",
            Self::String => "String",
            Self::Strings => "String[]",
        }
    }

    pub(crate) fn data_type(self) -> DataTypeId {
        match self {
            Self::Boolean => DataTypeId::Boolean,
            Self::Int64 => DataTypeId::Int64,
            Self::UInt64 => DataTypeId::UInt64,
            Self::Double => DataTypeId::Double,
            Self::String | Self::Strings => DataTypeId::String,
        }
    }
}

/// What the variables are read from.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Seen<'a> {
    pub(crate) observation: &'a Observation,
    pub(crate) feed: Feed,
}

impl Seen<'_> {
    fn program(&self, place: usize) -> Option<&ProgramSnapshot> {
        self.observation.snapshot.programs.get(place)
    }

    /// The stored value of a point; nothing where the program has no point of that name and type any more, after an online change.
    fn stored(&self, place: usize, side: ImageSide, point: &Point) -> Option<u64> {
        let program = ProgramId(u8::try_from(place).ok()?);
        self.observation.snapshot.stored(program, side, point)
    }

    /// A value in the state of a program before its last sample.
    fn in_state(&self, place: usize, read: impl Fn(&Image) -> Option<Variant>) -> Reading {
        let state = self.observation.states.get(place).and_then(Option::as_ref);
        let own = self.program(place).map(trust::state);
        self.present(state.and_then(read), own.unwrap_or_default())
    }

    fn station(&self, rank: usize) -> Option<&StationSnapshot> {
        self.observation.snapshot.stations.get(rank)
    }

    /// A present value.
    fn present(&self, value: Option<Variant>, own: StatusCode) -> Reading {
        let own = match value {
            Some(_) => own,
            None => StatusCode::BadNoDataAvailable,
        };
        Reading { value, status: trust::present(self.feed, own) }
    }

    /// A value that depends on everything that was recorded.
    fn recorded(&self, read: impl Fn(&Observation) -> Option<Variant>) -> Reading {
        match self.observation.past_percent {
            Some(_) => Reading::WAITING,
            None => self.counted(read(self.observation)),
        }
    }

    /// A counted value.
    fn counted(&self, value: Option<Variant>) -> Reading {
        let status = match value {
            Some(_) => trust::counted(self.feed),
            None => StatusCode::BadWaitingForInitialData,
        };
        Reading { value, status }
    }
}

/// Value of a variable at one moment, with its status.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Reading {
    pub(crate) value: Option<Variant>,
    pub(crate) status: StatusCode,
}

impl Reading {
    /// Answer while the journal is being read.
    pub(crate) const WAITING: Self =
        Self { value: None, status: StatusCode::BadWaitingForInitialData };
}

/// An operator input.
#[derive(Debug, Clone)]
pub(crate) struct WritableInput {
    /// Remote I/O of its program.
    pub(crate) member: Member,
    /// The input.
    pub(crate) point: Point,
}

type Read = Box<dyn Fn(&Seen<'_>) -> Reading + Send + Sync>;

/// One variable.
pub struct Variable {
    folders: Vec<String>,
    name: String,
    kind: Kind,
    meaning: Cow<'static, str>,
    /// How a signal is shown.
    card: CardFacts,
    writable: Option<WritableInput>,
    /// The names of the values of an enumeration, by number from 0; empty for a number without a name.
    names: Vec<String>,
    read: Read,
}

impl Variable {
    /// Its folders, the outermost first.
    pub fn folders(&self) -> &[String] {
        &self.folders
    }

    /// Its own name.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Its identifier.
    pub fn path(&self) -> String {
        format!("{}/{}", self.folders.join("/"), self.name)
    }

    /// Its type.
    pub fn kind(&self) -> Kind {
        self.kind
    }

    /// Its meaning.
    pub fn meaning(&self) -> &str {
        &self.meaning
    }

    /// How a signal is shown; nothing of any other variable.
    pub fn card(&self) -> &CardFacts {
        &self.card
    }

    /// Whether it is an operator input.
    pub fn is_writable(&self) -> bool {
        self.writable.is_some()
    }

    pub(crate) fn names(&self) -> &[String] {
        &self.names
    }

    pub(crate) fn writable(&self) -> Option<&WritableInput> {
        self.writable.as_ref()
    }

    /// Its value in an observation of a live run; nothing where it has none.
    pub fn value(&self, observation: &Observation) -> Option<Variant> {
        let feed = Feed::Live;
        self.read(&Seen { observation, feed }).value
    }

    pub(crate) fn read(&self, seen: &Seen<'_>) -> Reading {
        (self.read)(seen)
    }
}

/// All variables of a cluster.
pub fn variables(cluster: &Cluster) -> Vec<Variable> {
    let mut tree = Tree { folders: Vec::new(), variables: Vec::new() };
    tree.run();
    for (place, declared) in cluster.alarms().iter().enumerate() {
        tree.alarm(place, declared);
    }
    let programs = cluster.controllers().iter().map(|program| &program.name);
    let understudies = cluster.understudies().iter();
    let stations = programs.chain(understudies.map(|understudy| &understudy.name));
    for (rank, name) in stations.enumerate() {
        tree.station(rank, name);
    }
    let programs = cluster.controllers().iter().zip(cluster.remote_ios());
    for (place, (controller, remote_io)) in programs.enumerate() {
        tree.program(place, controller);
        let card = |name: &str| cluster.card(ProgramId(place as u8), name);
        tree.signals(place, controller, &remote_io.inputs, card);
    }
    tree.variables
}

/// Adds variables: name, kind, meaning, and the function that reads the value.
macro_rules! rows {
    ($tree:ident; $($name:literal $kind:ident $meaning:tt => $read:expr;)*) => {
        $($tree.add($name, Kind::$kind, $meaning, $read);)*
    };
}

struct Tree {
    folders: Vec<String>,
    variables: Vec<Variable>,
}

impl Tree {
    fn enter(&mut self, folders: &[&str]) {
        self.folders = folders.iter().map(|name| (*name).to_owned()).collect();
    }

    fn add(
        &mut self,
        name: &str,
        kind: Kind,
        meaning: &'static str,
        read: impl Fn(&Seen<'_>) -> Reading + Send + Sync + 'static,
    ) {
        self.variables.push(Variable {
            folders: self.folders.clone(),
            name: name.to_owned(),
            kind,
            meaning: meaning.into(),
            card: CardFacts::default(),
            writable: None,
            names: Vec::new(),
            read: Box::new(read),
        });
    }

    fn run(&mut self) {
        let counted = |read: fn(&Observation) -> Option<Variant>| {
            move |seen: &Seen<'_>| seen.counted(read(seen.observation))
        };
        let present = |read: fn(&Observation) -> Variant| {
            move |seen: &Seen<'_>| seen.present(Some(read(seen.observation)), StatusCode::Good)
        };
        let recorded =
            |read: fn(&Observation) -> Option<Variant>| move |seen: &Seen<'_>| seen.recorded(read);
        self.enter(&["Run"]);
        rows! { self;
            "State" String "starting, running, not-current, finished or interrupted" => |seen: &Seen<'_>| seen.counted(Some(text(seen.observation.state(seen.feed))));
            "Cycle" Int64 "newest cycle, from the origin of the run" => counted(|of| of.snapshot.cycle.map(Variant::from));
            "Period" UInt64 "period of a cycle, in microseconds" => counted(|of| Some(of.snapshot.period_us.into()));
            "Mode" String "full or paper" => counted(|of| Some(text(of.snapshot.mode)));
            "Records" UInt64 "records of the journal that were read" => recorded(|of| Some(of.snapshot.records.into()));
            "LeftOut" UInt64 "records that were gone or could not be read" => counted(|of| Some(of.snapshot.left_out.into()));
        }
        self.enter(&["Margin"]);
        rows! { self;
            "Survives" UInt64 "remaining redundancy: any further failures of stations that would be masked"
                => present(|of| u64::from(of.snapshot.margin.survives).into());
            "Served" Strings "programs with provable outputs" => present(|of| texts(&of.snapshot.margin.served));
        }
        self.enter(&["Alarms"]);
        rows! { self;
            "Open" UInt64 "alarms that last or are not acknowledged" => recorded(|of| Some((of.snapshot.alarms.len() as u64).into()));
            "Texts" Strings "open alarms, in words" => recorded(|of| {
                let alarms = of.snapshot.alarms.iter();
                let alarms = alarms.map(|alarm| format!("{}cycle {}: {}: {}", time(alarm.raised_at), alarm.cycle, alarm.name, alarm.text));
                Some(texts(&alarms.collect::<Vec<_>>()))
            });
        }
        self.enter(&["Events"]);
        rows! { self;
            "Count" UInt64 "events so far" => recorded(|of| Some(of.snapshot.events.into()));
            "Recent" Strings "the newest 20 events, in words, the newest last" => recorded(|of| {
                let recent = of.recent.iter();
                let recent = recent.map(|event| format!("{}cycle {}: {}: {}", time(event.at), event.cycle, event.name, message(event)));
                Some(texts(&recent.collect::<Vec<_>>()))
            });
        }
    }

    fn station(&mut self, rank: usize, name: &str) {
        self.enter(&["Stations", name]);
        let of = move |read: fn(&StationSnapshot) -> Variant| {
            move |seen: &Seen<'_>| seen.present(seen.station(rank).map(read), StatusCode::Good)
        };
        rows! { self;
            "State" String "publishing, not-received, flagged, joining, shadow-mode, refused, suspended, killed, ended or not-started" => of(|station| text(station.state.word()));
            "Understudy" Boolean "whether it is generated from the controllers" => of(|station| station.understudy.into());
            "Flagged" Boolean "whether a remote I/O has closed its slot" => of(|station| station.flagged.into());
            "PublishesFor" Strings "programs that it publishes for" => of(|station| texts(&station.publishes_for));
            "ExcludedFrom" Strings "programs whose remote I/O has excluded it" => of(|station| texts(&station.excluded_from));
        }
    }

    fn program(&mut self, place: usize, controller: &Controller) {
        let name = controller.name.as_str();
        self.enter(&["Programs", name]);
        let of = move |read: fn(&ProgramSnapshot) -> Option<Variant>| {
            move |seen: &Seen<'_>| {
                seen.present(seen.program(place).and_then(read), StatusCode::Good)
            }
        };
        let count = move |read: fn(&ProgramSnapshot) -> Option<u64>| {
            move |seen: &Seen<'_>| {
                seen.counted(seen.program(place).and_then(read).map(Variant::from))
            }
        };
        rows! { self;
            "Source" String "source of the outputs: direct, reconstructed, held or fail-safe" => of(|program| program.source.map(text));
            "Since" Int64 "first cycle of those in a row with this source" => of(|program| program.since.map(Variant::from));
            "WordOf" String "station whose parity word the outputs were reconstructed from, or empty" => of(|program| Some(text(program.word_of.as_deref().unwrap_or_default())));
            "Missing" String "why there was no provable output in a missed cycle, or empty" => of(|program| Some(text(program.missing.unwrap_or_default())));
            "Fault" String "program fault that has stopped it, with the line of its text and the values, or empty" => of(|program| Some(text(program.fault.as_deref().unwrap_or_default())));
            "AwaitsRelease" Boolean "whether the operator has to release the outputs" => of(|program| Some(program.awaits_release.into()));
            "Forced" Strings "forced signals, with owner and reason" => of(|program| Some(texts(&program.forced)));
            "Protected" Boolean "whether the failure of one station would be masked" => of(|program| Some(program.protection.as_ref()?.protected.into()));
            "Protection" String "protected; otherwise the first cycle without protection, and the reason" => of(|program| Some(text(&program.protection.as_ref()?.text())));
            "StateLost" Boolean "whether no living station can prove its state" => of(|program| Some(program.lost.is_some().into()));
            "LostState" String "newest available state where the state is lost, or empty" => of(|program| {
                let lost = program.lost.as_ref().map(understudy_view::LostState::text);
                Some(text(&lost.unwrap_or_default()))
            });
            "LostStateCycle" UInt64 "the cycle of that state, as the operator's choice names it; 0 where no state is lost, or none is available" => of(|program| Some(program.lost.as_ref().and_then(|lost| lost.newest).unwrap_or(0).into()));
            "LostStateAge" UInt64 "age of that state in cycles; 0 where no state is lost" => of(|program| {
                let age = program.lost.as_ref().map_or(Some(0), |lost| lost.age_cycles);
                age.map(Variant::from)
            });
        }
        let deadlines = "deadlines with this source, from the origin of the run on";
        rows! { self;
            "Direct" UInt64 deadlines => count(|of| Some(of.direct));
            "Reconstructed" UInt64 deadlines => count(|of| Some(of.reconstructed));
            "Held" UInt64 deadlines => count(|of| Some(of.held));
            "FailSafe" UInt64 deadlines => count(|of| Some(of.fail_safe));
            "Finished" UInt64 "finished parts of a simulated plant" => count(|of| of.finished);
            "PlantFaults" UInt64 "plant faults of a simulated plant" => count(|of| of.plant_faults);
        }
    }
}

/// An event in words, with its cause.
pub(crate) fn message(event: &Event) -> String {
    match &event.cause {
        None => event.text.clone(),
        Some(cause) => format!("{}: {cause}", event.text),
    }
}

fn text(text: &str) -> Variant {
    Variant::from(UAString::from(text))
}

fn texts(texts: &[String]) -> Variant {
    let texts: Vec<UAString> = texts.iter().map(|text| text.as_str().into()).collect();
    Variant::from(texts)
}

/// A time of day before a text.
fn time(at: Option<TimeOfDay>) -> String {
    at.map_or_else(String::new, |at| format!("{at}, "))
}

#[cfg(test)]
mod tests;
