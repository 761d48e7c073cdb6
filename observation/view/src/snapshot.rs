//! What is the case now, with the names of the cluster: for a table, a page, or a machine.

use schemars::JsonSchema;
use serde::Serialize;
use understudy_journal::source_word;
use understudy_wire::{Member, ProgramId, StationId};

use crate::alarm::Alarm;
use crate::describe::missing_text;
use crate::margin::{Margin, Outcome};
use crate::model::Model;
use crate::protection::{LostState, Protection};
use crate::station::StationState;

/// How far a run is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum RunState {
    /// Nothing has been decided yet.
    Starting,
    /// Cycles are run.
    Running,
    /// Its last record was read.
    Finished,
    /// It was asked to end early, and did.
    Interrupted,
}

/// A run as it is now.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Snapshot {
    /// The cluster's name.
    pub cluster: String,
    /// How far it is.
    pub run: RunState,
    /// The newest cycle, from the origin; nothing before the first deadline.
    pub cycle: Option<i64>,
    /// Whether cycles are counted from the origin of the run; otherwise from where the cluster did.
    pub from_origin: bool,
    /// `full` or `paper`.
    pub mode: &'static str,
    /// Of one cycle.
    pub period_us: u64,
    /// By rank.
    pub stations: Vec<StationSnapshot>,
    /// By program.
    pub programs: Vec<ProgramSnapshot>,
    /// What would be survived.
    pub margin: MarginSnapshot,
    /// Of the newest cycle whose times are known.
    pub timing: Option<TimingSnapshot>,
    /// Alarms that last, or that nobody has acknowledged.
    pub alarms: Vec<Alarm>,
    /// Events so far; the number of the newest.
    pub events: u64,
    /// Records read so far.
    pub records: u64,
    /// Records that were gone or could not be read, at least.
    pub left_out: u64,
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
    /// What it is.
    pub state: StationState,
    /// Whether a remote I/O has closed its slot, θ = 1.
    pub flagged: bool,
    /// The programs that it speaks for.
    pub speaks_for: Vec<String>,
    /// The programs whose remote I/O has found its state faulty.
    pub excluded_from: Vec<String>,
    /// What was last done to it.
    pub done: Option<String>,
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
    /// `direct`, `reconstructed`, `held` or `fail-safe`; nothing before the first deadline.
    pub source: Option<&'static str>,
    /// Since which cycle.
    pub since: i64,
    /// Whose word restored it.
    pub word_of: Option<String>,
    /// Why nothing true is driven, where that is so.
    pub missing: Option<&'static str>,
    /// u(i) as last sampled, element 1 first.
    pub inputs: Option<String>,
    /// y(i) as last driven, element 1 first.
    pub outputs: Option<String>,
    /// Deadlines with direct outputs.
    pub direct: u64,
    /// Deadlines with reconstructed outputs.
    pub reconstructed: u64,
    /// Deadlines with held outputs.
    pub held: u64,
    /// Deadlines with fail-safe outputs.
    pub fail_safe: u64,
    /// Whether an operator has to release the outputs.
    pub awaits_release: bool,
    /// Signals that are forced.
    pub forced: Vec<String>,
    /// Whether the failure of one station would be masked; nothing while its remote I/O has not reported it.
    pub protection: Option<Protection>,
    /// What is available where no living station can prove its state.
    pub lost: Option<LostState>,
    /// Parts that the plant has finished.
    pub finished: Option<u64>,
    /// Things that must not happen to the plant and did.
    pub plant_faults: Option<u64>,
}

/// Which further failures would be masked now.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, JsonSchema)]
pub struct MarginSnapshot {
    /// Further failures of stations that are masked whichever they are: 0, 1, or 2 and perhaps more.
    pub survives: u8,
    /// Programs with true outputs now.
    pub served: Vec<String>,
    /// Each station that speaks, and each remote I/O, alone.
    pub singles: Vec<OutcomeSnapshot>,
    /// Each pair of stations that speak.
    pub pairs: Vec<OutcomeSnapshot>,
}

/// What a failure would do.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, JsonSchema)]
pub struct OutcomeSnapshot {
    /// Who fails, all at once.
    pub failed: Vec<String>,
    /// Whether every program that has true outputs now keeps them.
    pub masked: bool,
    /// The programs that would lose them.
    pub lost: Vec<String>,
}

/// Times of one cycle, in microseconds.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
pub struct TimingSnapshot {
    /// Which.
    pub cycle: i64,
    /// From the first sample to the last turn.
    pub token_us: f64,
    /// From the last turn to the deadline.
    pub margin_us: f64,
    /// From the start of the cycle before.
    pub cycle_us: Option<f64>,
}

impl Model {
    /// What is the case now. The margin is calculated anew: see [`Self::snapshot_with`].
    pub fn snapshot(&self) -> Snapshot {
        self.snapshot_with(&self.holders().margin())
    }

    /// The same with a margin that was calculated before, of the same [`Self::holders`].
    pub fn snapshot_with(&self, margin: &Margin) -> Snapshot {
        let agreement = self.cluster.agreement();
        let (records, left_out) = self.records();
        let run = match (self.finished, self.interrupted, self.cycle()) {
            (true, true, _) => RunState::Interrupted,
            (true, false, _) => RunState::Finished,
            (false, _, None) => RunState::Starting,
            (false, _, Some(_)) => RunState::Running,
        };
        Snapshot {
            cluster: self.cluster.name().to_owned(),
            run,
            cycle: self.cycle(),
            from_origin: self.has_origin(),
            mode: match agreement.mode {
                understudy_wire::Mode::Full => "full",
                understudy_wire::Mode::Paper => "paper",
            },
            period_us: u64::try_from(agreement.schedule.period().as_micros()).unwrap_or(u64::MAX),
            stations: (0..self.stations.len() as u8)
                .map(|rank| self.station_snapshot(StationId(rank)))
                .collect(),
            programs: (0..self.programs.len() as u8)
                .map(|program| self.program_snapshot(ProgramId(program)))
                .collect(),
            margin: self.margin_snapshot(margin),
            timing: self.timings().next_back().map(|timing| TimingSnapshot {
                cycle: timing.cycle,
                token_us: timing.token_ns as f64 / 1e3,
                margin_us: timing.margin_ns as f64 / 1e3,
                cycle_us: timing.cycle_ns.map(|cycle| cycle as f64 / 1e3),
            }),
            alarms: self
                .alarms()
                .filter(|alarm| alarm.is_open())
                .cloned()
                .collect(),
            events: self.event_count(),
            records,
            left_out,
        }
    }

    fn station_snapshot(&self, station: StationId) -> StationSnapshot {
        let track = &self.stations[station.index()];
        let state = track.state(self.cycle(), 1);
        let names = |programs: understudy_wire::ProgramSet| {
            programs
                .iter()
                .map(|program| self.program_name(program).to_owned())
                .collect()
        };
        StationSnapshot {
            name: self.members.name(Member::Station(station)).to_owned(),
            rank: station.0,
            understudy: self.cluster.agreement().schedule.is_understudy(station),
            state,
            flagged: track.is_flagged(),
            speaks_for: if state == StationState::Speaking {
                names(track.covers)
            } else {
                Vec::new()
            },
            excluded_from: names(track.excluded),
            done: track
                .done
                .as_ref()
                .map(|(what, cycle)| format!("{what} in cycle {cycle}")),
        }
    }

    fn program_snapshot(&self, program: ProgramId) -> ProgramSnapshot {
        let track = &self.programs[program.index()];
        let plant = Member::Plant(program);
        let has_plant = self.cluster.member_name(plant).is_some();
        let [direct, reconstructed, held, fail_safe] = track.counts;
        ProgramSnapshot {
            program: self.program_name(program).to_owned(),
            remote_io: self.members.name(Member::RemoteIo(program)).to_owned(),
            plant: has_plant.then(|| self.members.name(plant).to_owned()),
            source: track.source.map(source_word),
            since: track.since,
            word_of: track
                .word_of
                .map(|station| self.members.name(Member::Station(station)).to_owned()),
            missing: track.missing.map(missing_text),
            inputs: track.inputs.as_ref().map(ToString::to_string),
            outputs: track.outputs.as_ref().map(ToString::to_string),
            direct,
            reconstructed,
            held,
            fail_safe,
            awaits_release: track.awaits_release,
            forced: track
                .forced
                .iter()
                .map(|force| {
                    let name = self.signal_name(program, force.signal);
                    format!(
                        "{name} = {} by {}: {}",
                        u8::from(force.value),
                        force.owner,
                        force.reason
                    )
                })
                .collect(),
            protection: track.protection.clone(),
            lost: track.lost.clone(),
            finished: track.plant.as_ref().map(|field| field.finished),
            plant_faults: track.plant.as_ref().map(|field| field.plant_faults),
        }
    }

    fn margin_snapshot(&self, margin: &Margin) -> MarginSnapshot {
        let name = |program: ProgramId| self.program_name(program).to_owned();
        let outcome = |outcome: &Outcome| OutcomeSnapshot {
            failed: outcome
                .failed
                .iter()
                .map(|member| self.members.name(*member).to_owned())
                .collect(),
            masked: outcome.is_masked(),
            lost: outcome.lost.iter().map(|loss| name(loss.program)).collect(),
        };
        MarginSnapshot {
            survives: margin.survives,
            served: margin.served.iter().map(name).collect(),
            singles: margin.singles.iter().map(outcome).collect(),
            pairs: margin.pairs.iter().map(outcome).collect(),
        }
    }
}
