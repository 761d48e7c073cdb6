//! How a snapshot is taken from the model of a run.

use std::collections::{BTreeMap, BTreeSet};

use serde_json::Value;
use understudy_cluster::Controller;
use understudy_cycle::Mode;
use understudy_executable::Interface;
use understudy_journal::{PointsInEffect, Process, SourceCounts, source_word};
use understudy_remote_io::Missing;
use understudy_typed::Elementary;
use understudy_wire::{Member, ProgramId, ProgramSet, StationId};

use super::{
    LinkSnapshot, MarginSnapshot, OutcomeSnapshot, PlantSnapshot, PlantState, ProgramSnapshot,
    RemoteIoSnapshot, RemoteIoState, RunState, Snapshot, StationSnapshot, TimingSnapshot,
    TwinSnapshot, WordSnapshot,
};
use crate::alarm::{Alarm, AlarmState, PROCESS};
use crate::describe::{missing_text, program_fault_text};
use crate::history::Driven;
use crate::margin::{Margin, Outcome};
use crate::model::{ForcedSignal, Model, Standing};
use crate::process_alarm::ProcessAlarm;
use crate::protection::Protection;
use crate::station::StationState;
use crate::value::{forced_point, forced_value, named};

impl Model {
    /// The present: the newest cycle that every member that reports has reported.
    pub fn snapshot(&self) -> Snapshot {
        let cycle = self.newest();
        let standing = self.standing(cycle.unwrap_or(i64::MAX));
        Picture { model: self, standing: &standing, cycle }.taken()
    }

    /// The state of a cycle; nothing where it is not remembered. The newest cycle is the present.
    pub fn snapshot_at(&self, cycle: i64) -> Option<Snapshot> {
        let (oldest, newest) = (self.oldest()?, self.newest()?);
        if !(oldest.min(newest)..=newest).contains(&cycle) {
            return None;
        }
        let picture = Picture { model: self, standing: &self.standing(cycle), cycle: Some(cycle) };
        Some(picture.taken())
    }

    /// The alarms as they were in a cycle, oldest first; all of them in the newest.
    pub fn alarms_at(&self, cycle: i64) -> impl DoubleEndedIterator<Item = Alarm> {
        let until = self.recorded_until(cycle);
        self.alarms().filter_map(move |alarm| Some(alarm.at(until)?.timed(&self.times)))
    }

    /// The alarms as they were in a cycle, and those of the cluster file with their states.
    /// Alarms that last or are not acknowledged in a cycle, without the shelved ones, and those of the cluster file, each with its state.
    pub fn open_alarms_at(&self, cycle: i64) -> (Vec<Alarm>, Vec<ProcessAlarm>) {
        let (alarms, process) = self.process_alarms_at(cycle);
        (open_alarms(alarms, &process), process)
    }

    fn process_alarms_at(&self, cycle: i64) -> (Vec<Alarm>, Vec<ProcessAlarm>) {
        let alarms: Vec<Alarm> = self.alarms_at(cycle).collect();
        let until = self.recorded_until(cycle);
        let cycle = cycle.min(self.newest().unwrap_or(0));
        let mut process = self
            .process_alarms
            .at(cycle, until, &alarms, |alarm| self.program_name(alarm.program).to_owned());
        for shelved in process.iter_mut().filter_map(|alarm| alarm.shelved.as_mut()) {
            shelved.until_at = self.times.of_cycle(shelved.until);
        }
        (alarms, process)
    }

    /// The newest cycle is the present, with everything that was recorded since.
    fn recorded_until(&self, cycle: i64) -> i64 {
        let is_present = self.newest().is_none_or(|newest| newest <= cycle);
        if is_present { i64::MAX } else { cycle }
    }
}

/// Inputs as last sampled and outputs as driven, by name.
fn values(version: &Controller, driven: &Driven) -> BTreeMap<String, Value> {
    let Interface { inputs, outputs } = &version.interface;
    let sampled = driven.inputs.iter().flat_map(|image| named(inputs, image));
    sampled.chain(named(outputs, &driven.outputs)).collect()
}

/// Alarms that last or are not acknowledged, without the shelved ones.
fn open_alarms(alarms: Vec<Alarm>, process: &[ProcessAlarm]) -> Vec<Alarm> {
    let shelved = process.iter().filter(|alarm| alarm.state == AlarmState::Shelved);
    let shelved: BTreeSet<&str> = shelved.map(|alarm| alarm.name.as_str()).collect();
    let is_shelved =
        |alarm: &Alarm| alarm.alarm == PROCESS && shelved.contains(alarm.name.as_str());
    let alarms = alarms.into_iter();
    alarms.filter(|alarm| alarm.is_open() && !is_shelved(alarm)).collect()
}

/// A cycle that a snapshot is taken of.
struct Picture<'m> {
    model: &'m Model,
    standing: &'m Standing,
    cycle: Option<i64>,
}

impl Picture<'_> {
    fn taken(&self) -> Snapshot {
        let model = self.model;
        let agreement = model.cluster().agreement();
        let (records, left_out) = model.records();
        let cycle = self.cycle.unwrap_or(i64::MAX);
        let margin = model.margin_in(self.standing, self.cycle.unwrap_or(0));
        let master = self.cycle.and_then(|cycle| model.cycle_master(self.standing, cycle));
        let (alarms, process_alarms) = model.open_alarms_at(cycle);
        let timing = model.timings().rfind(|timing| timing.cycle <= cycle);
        let points = model.points_in(self.cycle);
        Snapshot {
            cluster: model.cluster().name().to_owned(),
            run: self.run(),
            cycle: self.cycle,
            at: self.cycle.and_then(|cycle| model.times.of_cycle(cycle)),
            clocks_apart: model.times.apart(),
            behind: if self.cycle == model.newest() { model.behind() } else { 0 },
            from_origin: model.has_origin(),
            mode: match agreement.mode {
                Mode::Full => "full",
                Mode::Paper => "paper",
            },
            period_us: u64::try_from(agreement.schedule.period().as_micros()).unwrap_or(u64::MAX),
            cycle_master: master.map(|station| self.name(Member::Station(station))),
            scenario_over: self.standing.scenario_over.clone(),
            stations: model.station_ids().map(|id| self.station(id)).collect(),
            programs: model.program_ids().map(|id| self.program(&points, id)).collect(),
            points,
            remote_ios: model.program_ids().map(|id| self.remote_io(id)).collect(),
            plants: model.program_ids().filter_map(|id| self.plant(id)).collect(),
            margin: self.margin(&margin),
            networks: model.networks_at(cycle),
            timing: timing.map(|timing| TimingSnapshot {
                cycle: timing.cycle,
                token_us: timing.token_ns as f64 / 1e3,
                margin_us: timing.margin_ns as f64 / 1e3,
                cycle_us: timing.cycle_ns.map(|cycle| cycle as f64 / 1e3),
            }),
            spares: match self.cycle == model.newest() {
                true => model.spares_in(self.standing),
                false => Vec::new(),
            },
            change: model.change_in(self.standing, self.cycle),
            host_stalls: self.host_stalls(),
            alarms,
            process_alarms,
            events: model.event_count(),
            read_from: model.read_from(),
            records,
            left_out,
        }
    }

    fn run(&self) -> RunState {
        match (self.model.finished, self.model.interrupted, self.cycle) {
            (true, true, _) => RunState::Interrupted,
            (true, false, _) => RunState::Finished,
            (false, _, None) => RunState::Starting,
            (false, _, Some(_)) => RunState::Running,
        }
    }

    /// Of a cycle of the past those are left out that came later.
    fn host_stalls(&self) -> u64 {
        let is_later = |cycle: i64| self.cycle.is_some_and(|own| own < cycle);
        let is_present = self.cycle >= self.model.newest();
        let events = self.model.events();
        let later = events.filter(|event| event.event == "stalled" && is_later(event.cycle));
        let later = if is_present { 0 } else { later.count() as u64 };
        self.model.counters().stalls().saturating_sub(later)
    }

    fn name(&self, member: Member) -> String {
        self.model.members().name(member).to_owned()
    }

    fn program_names(&self, programs: ProgramSet) -> Vec<String> {
        let programs = programs.iter();
        let names = programs.map(|program| self.model.program_name(program).to_owned());
        names.collect()
    }

    /// Whether a member lives, as others report, and its own journal is not received. A station that no remote I/O receives is shown as that.
    fn is_unreported(&self, member: Member) -> bool {
        let is_received = |station| {
            let cycle = self.cycle.into_iter();
            cycle.into_iter().any(|cycle| self.model.received(cycle).contains(station))
        };
        let process = self.standing.process(member);
        self.standing.is_silent(member)
            && process.is_none_or(Process::is_running)
            && match member {
                Member::Station(station) => is_received(station),
                Member::RemoteIo(_) | Member::Twin(_) => true,
                Member::Plant(_) => false,
            }
    }

    fn reports(&self, program: ProgramId) -> bool {
        self.standing.reports(Member::RemoteIo(program))
    }

    fn link(&self, member: Member) -> LinkSnapshot {
        let cut_from = self.standing.cut_from(member);
        let cut_from: Vec<String> = cut_from.map(|other| self.name(other)).collect();
        LinkSnapshot {
            isolated: !cut_from.is_empty() && self.model.is_isolated(self.standing, member),
            cut_from,
            detached: self.standing.is_detached(member) || self.is_unreported(member),
        }
    }

    fn station(&self, station: StationId) -> StationSnapshot {
        let model = self.model;
        let own = self.standing.station(station).cloned().unwrap_or_default();
        let state = model.station_state_in(self.standing, station, self.cycle);
        let schedule = &model.cluster().agreement().schedule;
        let is_slot = schedule.spare_slots().contains(station);
        let state = if is_slot { state.of_slot() } else { state };
        let covers = match (state, self.cycle) {
            (StationState::Publishing, Some(cycle)) => model.covers(station, cycle),
            _ => ProgramSet::EMPTY,
        };
        let cycle = self.cycle.into_iter();
        let words = cycle.flat_map(|cycle| model.words(station, cycle));
        StationSnapshot {
            name: self.name(Member::Station(station)),
            rank: station.0,
            understudy: schedule.is_understudy(station),
            state,
            flagged: own.is_flagged() && state != StationState::Standby,
            publishes_for: self.program_names(covers),
            excluded_from: self.program_names(self.standing.excluded_from(station)),
            done: own.done.map(|(what, cycle)| format!("{what} in cycle {cycle}")),
            words: words
                .map(|word| WordSnapshot {
                    mask: self.program_names(word.mask),
                    sum: word.sum.to_string(),
                })
                .collect(),
            link: self.link(Member::Station(station)),
        }
    }

    /// The deadline of the cycle, as its remote I/O reported it. A remote I/O without a process drives nothing.
    fn driven(&self, program: ProgramId) -> Option<&Driven> {
        if self.standing.is_down(self.standing.driver(program)) {
            return None;
        }
        let step = self.model.deadline(program, self.cycle?)?;
        step.driven.as_ref()
    }

    fn program(&self, points: &PointsInEffect, program: ProgramId) -> ProgramSnapshot {
        let model = self.model;
        let driven = self.driven(program);
        let own = self.standing.program(program).cloned().unwrap_or_default();
        let plant = Member::Plant(program);
        let has_plant = model.cluster().member_name(plant).is_some();
        let SourceCounts { direct, reconstructed, held, fail_safe } =
            model.source_counts(program, self.cycle);
        let version = points.controller(program);
        let unknown = points.versions().get(program.index()).filter(|_| version.is_none());
        let named = driven.filter(|_| version.is_some());
        let source = driven.map(|driven| driven.source);
        let since = self.cycle.and_then(|cycle| model.since(program, cycle));
        ProgramSnapshot {
            program: model.program_name(program).to_owned(),
            remote_io: self.name(Member::RemoteIo(program)),
            plant: has_plant.then(|| self.name(plant)),
            source: source.map(source_word),
            since: source.and(since),
            word_of: driven
                .and_then(|driven| driven.word_of)
                .map(|station| self.name(Member::Station(station))),
            missing: driven.and_then(|driven| driven.missing).map(missing_text),
            fault: self.fault(program),
            unknown_points: unknown.map(ToString::to_string),
            inputs: named.and_then(|driven| driven.inputs.as_ref()).map(ToString::to_string),
            outputs: named.map(|driven| driven.outputs.to_string()),
            values: named.zip(version).map(|(driven, of)| values(of, driven)).unwrap_or_default(),
            direct,
            reconstructed,
            held,
            fail_safe,
            awaits_release: own.awaits_release,
            forced: self.forced(program),
            forces: own.forced.into_iter().map(|it| (it.force, it.since)).collect(),
            validity: self
                .cycle
                .map_or_else(BTreeMap::new, |cycle| self.model.validity(program, cycle)),
            protection: self.protection(program),
            silent_cycles: model.silent_cycles(self.standing, program, self.cycle),
            lost: own.lost,
            finished: own.plant.map(|(finished, _)| finished),
            plant_faults: own.plant.map(|(_, plant_faults)| plant_faults),
        }
    }

    fn protection(&self, program: ProgramId) -> Option<Protection> {
        let cycle = self.cycle.filter(|_| self.reports(program))?;
        self.model.protection_in(self.standing, program, cycle)
    }

    fn fault(&self, program: ProgramId) -> Option<String> {
        let step = self.model.deadline(program, self.cycle?)?;
        let fault = step.sampled.as_ref()?.fault?;
        let controller = self.model.controller_at(program, Some(step.cycle));
        Some(program_fault_text(controller, Some(&fault)))
    }

    fn forced(&self, program: ProgramId) -> Vec<String> {
        let own = self.standing.program(program);
        let forced = own.into_iter().flat_map(|own| &own.forced);
        let texts = forced.map(|ForcedSignal { force, points, .. }| {
            let controller = self.model.present().controller_of(program, *points);
            let point = controller.and_then(|controller| forced_point(controller, force));
            let (name, value) = match point {
                Some(point) if point.of == Elementary::Bool => {
                    (point.name.as_str(), force.value.stored().to_string())
                }
                Some(point) => {
                    let cycle = self.cycle.unwrap_or(i64::MAX);
                    let card = self.model.card(program, &point.name, cycle);
                    let value = forced_value(point, force).to_string();
                    (point.name.as_str(), card.with_unit(value))
                }
                None => ("an unknown signal", force.value.stored().to_string()),
            };
            format!("{name} = {value} by {}: {}", force.owner, force.reason)
        });
        texts.collect()
    }

    fn remote_io(&self, program: ProgramId) -> RemoteIoSnapshot {
        let member = Member::RemoteIo(program);
        let driven = self.driven(program);
        let missing = driven.and_then(|driven| driven.missing);
        let state = match (self.standing.process(member), missing) {
            (Some(Process::Killed), _) => RemoteIoState::Killed,
            (Some(Process::Ended), _) => RemoteIoState::Ended,
            (Some(Process::Suspended), _) => RemoteIoState::Suspended,
            (_, Some(Missing::NotReleased)) => RemoteIoState::AwaitsRelease,
            (_, Some(Missing::StateLost)) => RemoteIoState::StateLost,
            (_, Some(Missing::NoHistory)) => RemoteIoState::Listening,
            _ if driven.is_none() && self.standing.is_silent(member) => RemoteIoState::NotReporting,
            _ if driven.is_none() => RemoteIoState::Listening,
            _ => RemoteIoState::Serving,
        };
        let is_present = self.cycle >= self.model.newest();
        let timed = self.model.counters().member(member).timed.filter(|_| is_present);
        RemoteIoSnapshot {
            name: self.name(member),
            state,
            twin: self.twin(program),
            link: self.link(member),
            sample_to_output: timed.map(|(taken, _)| taken),
            wakeups: timed.map(|(_, late)| late),
        }
    }

    fn twin(&self, program: ProgramId) -> Option<TwinSnapshot> {
        let member = Member::Twin(program);
        self.model.cluster().member_name(member)?;
        Some(TwinSnapshot {
            name: self.name(member),
            drives: self.standing.driver(program) == member,
            process: match self.standing.process(member) {
                Some(Process::Killed) => RemoteIoState::Killed,
                Some(Process::Ended) => RemoteIoState::Ended,
                Some(Process::Suspended) => RemoteIoState::Suspended,
                Some(Process::Running) | None => RemoteIoState::Serving,
            },
            link: self.link(member),
        })
    }

    fn plant(&self, program: ProgramId) -> Option<PlantSnapshot> {
        let member = Member::Plant(program);
        self.model.cluster().member_name(member)?;
        Some(PlantSnapshot {
            name: self.name(member),
            program: self.model.program_name(program).to_owned(),
            state: match self.standing.process(member) {
                Some(Process::Killed) => PlantState::Killed,
                Some(Process::Ended) => PlantState::Ended,
                Some(Process::Suspended) => PlantState::Suspended,
                Some(Process::Running) | None => PlantState::Moving,
            },
            link: self.link(member),
        })
    }

    fn margin(&self, margin: &Margin) -> MarginSnapshot {
        let is_known = self.model.program_ids().all(|program| self.reports(program));
        let publishes = |station: &StationId| {
            let state = self.model.station_state_in(self.standing, *station, self.cycle);
            state == StationState::Publishing
        };
        let unknown = self.model.station_ids().filter(publishes).map(Member::Station);
        let unknown = unknown.filter(|member| !self.standing.reports(*member));
        MarginSnapshot {
            unknown: unknown.map(|member| self.name(member)).collect(),
            survives: if is_known { margin.survives } else { 0 },
            served: self.program_names(margin.served),
            singles: margin.singles.iter().map(|of| self.outcome(of)).collect(),
            pairs: margin.pairs.iter().map(|of| self.outcome(of)).collect(),
        }
    }

    fn outcome(&self, outcome: &Outcome) -> OutcomeSnapshot {
        let name = |program| self.model.program_name(program).to_owned();
        let lost = outcome.lost.iter();
        let why = lost.clone().map(|loss| {
            let program = name(loss.program);
            match loss.missing {
                Some(missing) => format!("{program} loses its outputs ({})", missing_text(missing)),
                None => format!("{program} loses its outputs"),
            }
        });
        OutcomeSnapshot {
            failed: outcome.failed.iter().map(|of| self.name(*of)).collect(),
            masked: outcome.is_masked(),
            lost: lost.clone().map(|loss| name(loss.program)).collect(),
            why: why.collect::<Vec<_>>().join("; "),
        }
    }
}
