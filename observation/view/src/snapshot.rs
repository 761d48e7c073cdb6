//! The state of a run in one cycle, with the names of the cluster. Everything that shows a run shows this: `top`, the page, metrics,
//! Modbus, OPC UA, Zenoh and `--json`.

mod taken;

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::Serialize;
use serde_json::Value;
use understudy_bus::Quantiles;
use understudy_cluster::same_point;
use understudy_executable::Interface;
use understudy_journal::{ClocksApart, PointsInEffect, TimeOfDay};
use understudy_typed::Point;
use understudy_wire::{Force, ProgramId};

use crate::alarm::Alarm;
use crate::online_change::ChangeSnapshot;
use crate::process_alarm::ProcessAlarm;
use crate::protection::{LostState, Protection};
use crate::station::StationState;
use crate::value::stored;

/// Progress of a run.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum RunState {
    /// No deadline was reported yet.
    Starting,
    /// Cycles are run.
    Running,
    /// Its last record was read.
    Finished,
    /// It was ended early: on request, or because the process that wrote its journal ended.
    Interrupted,
}

impl RunState {
    /// The state as JSON writes it.
    pub const fn word(self) -> &'static str {
        match self {
            Self::Starting => "starting",
            Self::Running => "running",
            Self::Finished => "finished",
            Self::Interrupted => "interrupted",
        }
    }
}

/// A run in one cycle.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Snapshot {
    /// The cluster's name.
    pub cluster: String,
    /// Progress of the run.
    pub run: RunState,
    /// The cycle, from the origin; nothing before the first deadline. The newest is the newest complete one: every member that reports
    /// has reported it.
    pub cycle: Option<i64>,
    /// Time of day of the cycle; nothing where no wall clock was recorded, as in a simulated run.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub at: Option<TimeOfDay>,
    /// The member whose wall clock differs most from the one that tells the times of cycles, where it differs by more than 500 ms.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub clocks_apart: Option<ClocksApart>,
    /// Cycles after it that only some members have reported.
    pub behind: u64,
    /// Whether cycles are counted from the origin of the run; otherwise as the cluster counts them.
    pub from_origin: bool,
    /// `full` or `paper`.
    pub mode: &'static str,
    /// Period of a cycle.
    pub period_us: u64,
    /// The station that starts the cycles.
    pub cycle_master: Option<String>,
    /// What the scenario came to, where it is over and the cluster stays up.
    pub scenario_over: Option<String>,
    /// Stations, by rank.
    pub stations: Vec<StationSnapshot>,
    /// The points by which the inputs and outputs of this cycle are named.
    #[serde(skip)]
    pub points: PointsInEffect,
    /// Programs at their remote I/Os.
    pub programs: Vec<ProgramSnapshot>,
    /// Remote I/Os, by program.
    pub remote_ios: Vec<RemoteIoSnapshot>,
    /// Simulated plants.
    pub plants: Vec<PlantSnapshot>,
    /// The remaining redundancy.
    pub margin: MarginSnapshot,
    /// The networks and the direct links of a cluster with more than one network; none of a cluster with one.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub networks: Vec<NetworkSnapshot>,
    /// Times of the newest cycle whose times are known.
    pub timing: Option<TimingSnapshot>,
    /// Spares that have reported to a member, in the present cycle.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub spares: Vec<SpareSnapshot>,
    /// The online change in progress.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub change: Option<ChangeSnapshot>,
    /// Late wake-ups of all members so far.
    pub host_stalls: u64,
    /// Alarms that last or are not acknowledged, without the shelved ones.
    pub alarms: Vec<Alarm>,
    /// Alarms of the cluster file, each with its state.
    pub process_alarms: Vec<ProcessAlarm>,
    /// Events so far; the number of the newest.
    pub events: u64,
    /// The first cycle whose records were read: events, trends, counters and some alarms of before are missing. Nothing where the journal was
    /// read from its first record.
    pub read_from: Option<i64>,
    /// Records read so far.
    pub records: u64,
    /// Records that were gone or could not be read, at least.
    pub left_out: u64,
}

impl Snapshot {
    /// What two networks and direct links have left, in words; nothing where that is one network in order.
    pub fn networks_text(&self) -> Option<String> {
        let networks = self.networks.iter().filter(|network| network.network <= 2);
        let may_fail = networks.clone().count() == 2 && networks.clone().all(|it| it.in_order);
        let either = may_fail.then_some("either network may fail");
        let faults = self.networks.iter().filter(|network| !network.in_order);
        let texts: Vec<&str> =
            either.into_iter().chain(faults.map(|network| network.text.as_str())).collect();
        (!texts.is_empty()).then(|| texts.join("; "))
    }

    /// The links of every member, by its name.
    pub fn links(&self) -> impl Iterator<Item = (&str, &LinkSnapshot)> {
        let stations = self.stations.iter().map(|of| (of.name.as_str(), &of.link));
        let remote_ios = self.remote_ios.iter();
        let remote_ios = remote_ios.map(|of| (of.name.as_str(), &of.link));
        let plants = self.plants.iter().map(|of| (of.name.as_str(), &of.link));
        stations.chain(remote_ios).chain(plants)
    }
}

/// The inputs or the outputs of a program.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ImageSide {
    /// As last sampled.
    Inputs,
    /// As driven.
    Outputs,
}

impl Snapshot {
    /// The stored value of a point of a program; nothing where it is not known, and where the program has no point of that name and type in this cycle.
    pub fn stored(&self, program: ProgramId, side: ImageSide, point: &Point) -> Option<u64> {
        let of = self.programs.get(program.index())?;
        let Interface { inputs, outputs } = &self.points.controller(program)?.interface;
        let (points, bits) = match side {
            ImageSide::Inputs => (inputs, of.inputs.as_deref()?),
            ImageSide::Outputs => (outputs, of.outputs.as_deref()?),
        };
        stored(same_point(point, points)?, bits)
    }
}

/// Links of a member.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, JsonSchema)]
pub struct LinkSnapshot {
    /// Members that do not receive its frames.
    pub cut_from: Vec<String>,
    /// Whether no member receives its frames.
    pub isolated: bool,
    /// Whether its journal is not received here, so that its state is known from others only.
    pub detached: bool,
}

/// A controller or an understudy.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, JsonSchema)]
pub struct StationSnapshot {
    /// Its name.
    pub name: String,
    /// Its rank, from 0.
    pub rank: u8,
    /// Whether it is generated from the others.
    pub understudy: bool,
    /// Its state.
    pub state: StationState,
    /// Whether a remote I/O has closed its slot, θ = 1.
    pub flagged: bool,
    /// The programs that it publishes for.
    pub publishes_for: Vec<String>,
    /// The programs whose remote I/O has excluded it.
    pub excluded_from: Vec<String>,
    /// The last action on it.
    pub done: Option<String>,
    /// The parity words that it sent in this cycle.
    pub words: Vec<WordSnapshot>,
    /// Its links.
    pub link: LinkSnapshot,
}

/// A parity word.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, JsonSchema)]
pub struct WordSnapshot {
    /// The programs in its mask.
    pub mask: Vec<String>,
    /// The sum of their outputs, element 1 first.
    pub sum: String,
}

/// State of a remote I/O.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum RemoteIoState {
    /// It drives outputs at every deadline.
    Serving,
    /// It has reported no deadline of this cycle, or does not know the history of its program yet.
    Listening,
    /// The operator has to release its outputs.
    AwaitsRelease,
    /// No living station can prove the state of its program.
    StateLost,
    /// Its process is suspended.
    Suspended,
    /// Its process was killed.
    Killed,
    /// Its process ended unexpectedly.
    Ended,
    /// It has reported nothing for a while: it is down or suspended, or its journal is not received.
    NotReporting,
}

impl RemoteIoState {
    /// Every state.
    pub const ALL: [Self; 8] = [
        Self::Serving,
        Self::Listening,
        Self::AwaitsRelease,
        Self::StateLost,
        Self::Suspended,
        Self::Killed,
        Self::Ended,
        Self::NotReporting,
    ];

    /// The state as JSON and the page write it.
    pub fn word(self) -> &'static str {
        match self {
            Self::Serving => "serving",
            Self::Listening => "listening",
            Self::AwaitsRelease => "awaits-release",
            Self::StateLost => "state-lost",
            Self::Suspended => "suspended",
            Self::Killed => "killed",
            Self::Ended => "ended",
            Self::NotReporting => "not-reporting",
        }
    }
}

/// A remote I/O.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, JsonSchema)]
pub struct RemoteIoSnapshot {
    /// Its name.
    pub name: String,
    /// Its state.
    pub state: RemoteIoState,
    /// The second remote I/O of its program.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub twin: Option<TwinSnapshot>,
    /// Its links.
    pub link: LinkSnapshot,
    /// From its samples to the outputs that are proved for them, since it runs; in the newest cycle only.
    pub sample_to_output: Option<Quantiles>,
    /// How late the system woke it meanwhile.
    pub wakeups: Option<Quantiles>,
}

/// The second remote I/O of a program.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, JsonSchema)]
pub struct TwinSnapshot {
    /// Its name.
    pub name: String,
    /// Whether this one is the author, which samples and drives; otherwise the first one is, or neither.
    pub drives: bool,
    /// Its state: `serving` where its process executes.
    pub process: RemoteIoState,
    /// Its links.
    pub link: LinkSnapshot,
}

/// State of a simulated plant.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum PlantState {
    /// It runs.
    Moving,
    /// Its process is suspended.
    Suspended,
    /// Its process was killed.
    Killed,
    /// Its process ended unexpectedly.
    Ended,
}

impl PlantState {
    /// The state as JSON and the page write it.
    pub fn word(self) -> &'static str {
        match self {
            Self::Moving => "moving",
            Self::Suspended => "suspended",
            Self::Killed => "killed",
            Self::Ended => "ended",
        }
    }
}

/// A simulated plant.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, JsonSchema)]
pub struct PlantSnapshot {
    /// Its name.
    pub name: String,
    /// The controller of its program.
    pub program: String,
    /// Its state.
    pub state: PlantState,
    /// Its links.
    pub link: LinkSnapshot,
}

/// A program at its remote I/O, with its plant.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, JsonSchema)]
pub struct ProgramSnapshot {
    /// The controller's name.
    pub program: String,
    /// The remote I/O's name.
    pub remote_io: String,
    /// The simulated plant's name.
    pub plant: Option<String>,
    /// `direct`, `reconstructed`, `held` or `fail-safe`; nothing where no deadline of this cycle was reported.
    pub source: Option<&'static str>,
    /// The first cycle of those in a row with this source.
    pub since: Option<i64>,
    /// The station whose parity word the outputs were reconstructed from.
    pub word_of: Option<String>,
    /// Why there was no provable output, in a missed cycle.
    pub missing: Option<&'static str>,
    /// The program fault that has stopped it, with its line and its values; of a program with numbers.
    pub fault: Option<String>,
    /// The version of the program by whose points this cycle is named, where they are not known: nothing is shown of its inputs and outputs.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub unknown_points: Option<String>,
    /// u(i) as last sampled, element 1 first.
    pub inputs: Option<String>,
    /// y(i) as driven, element 1 first.
    pub outputs: Option<String>,
    /// Inputs as last sampled and outputs as driven, by name: a BOOL as true or false, a number as a number, null where it is not finite, a
    /// time in nanoseconds.
    pub values: BTreeMap<String, Value>,
    /// Deadlines with direct outputs, from the origin of the run on; so are the following.
    pub direct: u64,
    /// Deadlines with reconstructed outputs.
    pub reconstructed: u64,
    /// Deadlines with held outputs.
    pub held: u64,
    /// Deadlines with fail-safe outputs.
    pub fail_safe: u64,
    /// Whether the operator has to release the outputs.
    pub awaits_release: bool,
    /// Signals that are forced, in words.
    pub forced: Vec<String>,
    /// Signals that are forced, each with the cycle since which it is.
    #[serde(skip)]
    pub forces: Vec<(Force, i64)>,
    /// Whether signals of other programs are valid in this sample, by the first bit of their inputs; those that its remote I/O has reported.
    #[serde(skip)]
    pub validity: BTreeMap<u16, bool>,
    /// Whether the failure of one station would be masked; nothing while its remote I/O has not reported it, or does not report.
    pub protection: Option<Protection>,
    /// Cycles since the last deadline that its remote I/O reported, where that does not report any more.
    pub silent_cycles: Option<u64>,
    /// What is available where no living station can prove its state.
    pub lost: Option<LostState>,
    /// Parts that the plant has finished.
    pub finished: Option<u64>,
    /// Plant faults.
    pub plant_faults: Option<u64>,
}

impl Snapshot {
    /// Whether a program is protected, and why not; where that is not known, since when.
    pub fn protection_text(&self, program: &ProgramSnapshot) -> String {
        match (&program.protection, program.silent_cycles) {
            (Some(protection), _) => protection.text(),
            (None, Some(cycles)) => {
                let seconds = cycles as f64 * self.period_us as f64 / 1e6;
                let name = &program.remote_io;
                format!(
                    "not known: {name} has reported nothing for {cycles} cycles ({seconds:.1} s)"
                )
            }
            (None, None) => format!("{} has not reported it yet", program.remote_io),
        }
    }
}

/// The remaining redundancy: which further failures would be masked.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, JsonSchema)]
pub struct MarginSnapshot {
    /// Stations that publish, as remote I/Os report, and of which nothing is received here: what they cover is not known.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub unknown: Vec<String>,
    /// Further failures of stations that are masked whichever they are: 0, 1, or 2 and perhaps more. 0 while a remote I/O does not report:
    /// what would be masked is not known of its program.
    pub survives: u8,
    /// Programs with provable outputs.
    pub served: Vec<String>,
    /// Each station that publishes, and each remote I/O, alone.
    pub singles: Vec<OutcomeSnapshot>,
    /// Each pair of stations that publish.
    pub pairs: Vec<OutcomeSnapshot>,
}

/// One of two networks, or the direct links between the remote I/Os of each program.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, JsonSchema)]
pub struct NetworkSnapshot {
    /// 1 or 2; 3 for the direct links.
    pub network: u8,
    /// `network 1`, `network 2` or `direct link`.
    pub name: String,
    /// Whether every member that reports receives over it what it receives over another one.
    pub in_order: bool,
    /// What is wrong; empty where nothing is.
    pub text: String,
}

/// Consequence of a failure.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, JsonSchema)]
pub struct OutcomeSnapshot {
    /// The members that fail at once.
    pub failed: Vec<String>,
    /// Whether every program that has provable outputs keeps them.
    pub masked: bool,
    /// The programs that would lose them.
    pub lost: Vec<String>,
    /// Why, in words; empty where the failure is masked.
    pub why: String,
}

/// A spare that watches the cluster.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, JsonSchema)]
pub struct SpareSnapshot {
    /// Its name in the plant file.
    pub name: String,
    /// Whether a member receives its reports.
    pub received: bool,
    /// The group in which it is awake, as it reports.
    pub serves: Option<String>,
    /// Slots that were flagged since it has reported that.
    pub flagged_slots: Vec<String>,
}

/// Times of one cycle, in microseconds.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
pub struct TimingSnapshot {
    /// The cycle.
    pub cycle: i64,
    /// Time from the first sample to the last turn.
    pub token_us: f64,
    /// Time from the last turn to the deadline.
    pub margin_us: f64,
    /// Time from the start of the previous cycle to the start of this one.
    pub cycle_us: Option<f64>,
}
