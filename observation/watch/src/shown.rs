//! What the page shows of one cycle, as JSON: a presentation of the snapshot of the run.

mod members;
mod redundancy;

use std::time::Instant;

use serde::Serialize;
use serde_json::Value;
use understudy_bus::Quantiles;
use understudy_cluster::{Controller, Priority};
use understudy_journal::{ClocksApart, PointsInEffect, TimeOfDay};
use understudy_remote_io::SignalInput;
use understudy_typed::{Point, Points};
use understudy_view::{
    Alarm, ChangeSnapshot, LostState, Model as RunModel, ProcessAlarm, ProgramSnapshot, Protection,
    RemoteIoSnapshot, Snapshot, forced_point, forced_value, value_of,
};
use understudy_wire::{Force, Member, ProgramId, SignalPlace};

use self::members::{ShownMember, members};
use self::redundancy::{Redundancy, redundancy};
use crate::model::{Known, Model};

/// Alarms that are listed, at most.
const LISTED_ALARMS: usize = 100;

/// One cycle.
#[derive(Debug, Serialize)]
pub(crate) struct State {
    /// Of the shown cycle, in milliseconds, when this was written.
    age_ms: u64,
    cycle: i64,
    /// Time of day of the cycle; nothing where no wall clock was recorded.
    at: Option<TimeOfDay>,
    /// Wall clocks of the cluster that differ, in words.
    clocks_apart: Option<String>,
    oldest: i64,
    newest: i64,
    finished: bool,
    /// It was ended early, on request or by the end of the process that wrote it.
    interrupted: bool,
    /// What is missing while the past of a long journal is being read.
    past: Option<Past>,
    /// What the scenario came to, where it is over and the cluster stays up.
    scenario_over: Option<String>,
    /// The online change in progress, in words.
    change: Option<String>,
    cycle_master: Option<String>,
    members: Vec<ShownMember>,
    programs: Vec<ShownProgram>,
    timing: Timing,
    redundancy: Redundancy,
    /// Alarms that last or are not acknowledged.
    open_alarms: usize,
    /// Those of them that are not acknowledged.
    unacknowledged_alarms: usize,
    alarms: Vec<ShownAlarm>,
    process_alarms: Vec<ProcessAlarm>,
    event_count: u64,
}

/// Events, trends, counters and some alarms of the cycles before `from` are not read yet.
#[derive(Debug, Serialize)]
struct Past {
    from: i64,
    /// How much of the journal is read.
    percent: u8,
}

#[derive(Debug, Serialize)]
struct ShownProgram {
    index: usize,
    name: String,
    /// Hash of the program that runs: with another one, its text and its variables are others.
    hash: Option<String>,
    /// Hash of the version of the program by whose points this cycle is shown: the facts of the program have to be those of it.
    points: Option<String>,
    source: &'static str,
    /// The station whose parity word the outputs were reconstructed from.
    word_of: Option<String>,
    /// Why there was no provable output, in a missed cycle.
    missing: Option<&'static str>,
    /// The program fault that has stopped it.
    fault: Option<String>,
    inputs: Option<String>,
    outputs: Option<String>,
    /// The outputs that its own controller published.
    published: Option<String>,
    /// Values in the order of the run's facts; nothing where they are not known. So are the following.
    input_values: Option<Vec<Value>>,
    output_values: Option<Vec<Value>>,
    published_values: Option<Vec<Value>>,
    /// Inputs that are outputs of other programs.
    signals: Vec<ShownSignal>,
    awaits_release: bool,
    forced: Vec<ShownForce>,
    /// Nothing while the remote I/O has not reported it, or does not report.
    protection: Option<ShownProtection>,
    /// The same in words, also while it is not known.
    protection_words: String,
    lost: Option<ShownLost>,
    counts: Counts,
}

#[derive(Debug, Serialize)]
struct ShownProtection {
    #[serde(flatten)]
    protection: Protection,
    words: String,
    /// Time of day of the first cycle.
    since_at: Option<TimeOfDay>,
}

#[derive(Debug, Serialize)]
struct ShownLost {
    #[serde(flatten)]
    lost: LostState,
    words: String,
}

/// Input that is an output of another program.
#[derive(Debug, Serialize)]
struct ShownSignal {
    /// Its place in the run's facts.
    input: usize,
    /// Whether the sampled value is that of the other program, not the default one; nothing where that is not known.
    valid: Option<bool>,
}

#[derive(Debug, Serialize)]
struct ShownForce {
    kind: &'static str,
    /// Its place in the run's facts; nothing for an unknown signal.
    index: Option<usize>,
    /// Its first bit in the image.
    bit: u16,
    value: serde_json::Value,
    seconds: u32,
    /// Seconds until it ends by itself.
    left_s: u64,
    owner: String,
    reason: String,
}

#[derive(Debug, Serialize)]
struct Counts {
    direct: u64,
    reconstructed: u64,
    held: u64,
    fail_safe: u64,
}

/// In microseconds.
#[derive(Debug, Serialize)]
struct Timing {
    cycle_us: Option<u64>,
    margin_us: Option<i64>,
    least_margin_us: Option<i64>,
    /// Cycles of which that is the least.
    least_of: usize,
    stalls: u64,
    slowest: Option<Slowest>,
}

/// The remote I/O that takes longest from its samples to its outputs, and how late it is woken.
#[derive(Debug, Serialize)]
struct Slowest {
    name: String,
    sample_to_output: Quantiles,
    wakeups: Quantiles,
}

#[derive(Debug, Serialize)]
struct ShownAlarm {
    id: u64,
    cycle: i64,
    /// Times of day at which it was raised, over and acknowledged.
    at: Option<TimeOfDay>,
    over_at: Option<TimeOfDay>,
    acknowledged_at: Option<TimeOfDay>,
    who: String,
    /// The programs concerned.
    programs: Vec<String>,
    what: String,
    lasts: bool,
    /// The cycle in which it was over.
    over: Option<i64>,
    acknowledged: Option<String>,
    acknowledged_in: Option<i64>,
    /// `unacknowledged`, `acknowledged`, `returned` or `normal`.
    state: &'static str,
    /// Of an alarm on a signal.
    priority: Option<&'static str>,
    action: Option<String>,
    since_before: bool,
}

/// The newest state while nothing is known.
pub(crate) const NOTHING: &str = "null";

/// The newest state as JSON; [`NOTHING`] where nothing is known yet.
pub(crate) fn newest_state(model: &Model) -> String {
    let mut state =
        model.known().and_then(|known| state(&known.run, known.run.newest()?, known.has_ended()));
    if let (Some(state), Some(known)) = (&mut state, model.known()) {
        state.past_is(known);
        // The shown cycle is older than the newest record.
        let period = known.run.cluster().agreement().schedule.period();
        let behind = u32::try_from(known.run.behind()).unwrap_or(u32::MAX);
        let age = model.progress.age(Instant::now()).unwrap_or_default();
        let age = age.saturating_add(period.saturating_mul(behind));
        state.age_ms = u64::try_from(age.as_millis()).unwrap_or(u64::MAX);
    }
    serde_json::to_string(&state).unwrap_or_else(|_| NOTHING.to_owned())
}

/// The answer of `/api/state` for a cycle of a run; null for a cycle that is not remembered.
pub fn page_state(run: &RunModel, cycle: i64) -> serde_json::Value {
    let state = state(run, cycle, run.is_finished());
    serde_json::to_value(state).unwrap_or_default()
}

impl State {
    /// The alarms, the events and the newest cycle are those of a model that has read more than the one of this cycle.
    pub(crate) fn rest_is(&mut self, known: &Known) {
        self.newest = known.run.newest().map_or(self.newest, |newest| newest.max(self.newest));
        let (open, process) = known.run.open_alarms_at(self.cycle);
        self.open_alarms = open.len();
        self.unacknowledged_alarms = unacknowledged(&open);
        self.alarms = shown_alarms(&known.run, self.cycle);
        self.process_alarms = process;
        self.event_count = known.run.event_count();
        self.past_is(known);
    }

    /// What this model has not read.
    pub(crate) fn past_is(&mut self, known: &Known) {
        self.past = known.past().map(|(from, percent)| Past { from, percent });
    }
}

/// The state of a cycle; nothing where it is not remembered.
pub(crate) fn state(run: &RunModel, cycle: i64, finished: bool) -> Option<State> {
    let snapshot = run.snapshot_at(cycle)?;
    let (oldest, newest) = (run.oldest()?, run.newest()?);
    let programs = snapshot.programs.iter().enumerate();
    Some(State {
        past: None,
        age_ms: 0,
        cycle,
        at: snapshot.at,
        clocks_apart: snapshot.clocks_apart.as_ref().map(ClocksApart::text),
        oldest,
        newest,
        finished,
        interrupted: run.is_interrupted(),
        members: members(&snapshot),
        programs: programs
            .map(|(index, program)| shown_program(run, &snapshot, index, program))
            .collect(),
        timing: timing(run, &snapshot),
        redundancy: redundancy(&snapshot),
        open_alarms: snapshot.alarms.len(),
        unacknowledged_alarms: unacknowledged(&snapshot.alarms),
        alarms: shown_alarms(run, cycle),
        process_alarms: snapshot.process_alarms,
        event_count: snapshot.events,
        cycle_master: snapshot.cycle_master,
        scenario_over: snapshot.scenario_over,
        change: snapshot.change.as_ref().map(ChangeSnapshot::text),
    })
}

/// A program has the name of its controller.
pub(crate) fn program_name(run: &RunModel, program: ProgramId) -> String {
    let controller = Member::Station(program.controller());
    run.members().name(controller).to_owned()
}

fn shown_program(
    run: &RunModel,
    snapshot: &Snapshot,
    index: usize,
    program: &ProgramSnapshot,
) -> ShownProgram {
    let of = ProgramId(index as u8);
    let points = snapshot.points.versions().get(index);
    let interface = snapshot.points.controller(of).map(|controller| &controller.interface);
    let none = Points::default();
    let inputs = interface.map_or(&none, |it| &it.inputs);
    let outputs = interface.map_or(&none, |it| &it.outputs);
    let values = |points: &Points, bits: Option<&str>| {
        let bits = bits?;
        let values = points.iter();
        Some(values.map(|point| value_of(point, bits).unwrap_or_default()).collect())
    };
    let controller = snapshot.stations.get(index);
    let published = controller.and_then(|controller| controller.words.first());
    ShownProgram {
        index,
        name: program.program.clone(),
        hash: run.controller_at(of, snapshot.cycle).map(|controller| controller.hash.to_string()),
        points: points.map(ToString::to_string),
        source: program.source.unwrap_or("unknown"),
        word_of: program.word_of.clone(),
        missing: program.missing,
        fault: program.fault.clone(),
        inputs: program.inputs.clone(),
        outputs: program.outputs.clone(),
        published: published.map(|word| word.sum.clone()),
        input_values: values(inputs, program.inputs.as_deref()),
        output_values: values(outputs, program.outputs.as_deref()),
        published_values: values(outputs, published.map(|word| word.sum.as_str())),
        signals: signals(&snapshot.points, of, program),
        awaits_release: program.awaits_release,
        forced: program
            .forces
            .iter()
            .map(|(force, since)| {
                let cycles = snapshot.cycle.unwrap_or(*since).saturating_sub(*since).max(0);
                let passed_us = cycles.unsigned_abs().saturating_mul(snapshot.period_us);
                let whole_us = u64::from(force.seconds) * 1_000_000;
                let left_s = whole_us.saturating_sub(passed_us).div_ceil(1_000_000);
                shown_force(snapshot.points.controller(of), force, left_s)
            })
            .collect(),
        protection: program.protection.clone().map(|protection| ShownProtection {
            words: protection.text(),
            since_at: run.time_of(protection.since),
            protection,
        }),
        protection_words: snapshot.protection_text(program),
        lost: program.lost.clone().map(|lost| ShownLost { words: lost.text(), lost }),
        counts: Counts {
            direct: program.direct,
            reconstructed: program.reconstructed,
            held: program.held,
            fail_safe: program.fail_safe,
        },
    }
}

/// The signals of a program, as its newest sample has them.
fn signals(points: &PointsInEffect, of: ProgramId, program: &ProgramSnapshot) -> Vec<ShownSignal> {
    let Some((controller, remote_io)) = points.controller(of).zip(points.remote_io(of)) else {
        return Vec::new();
    };
    let interface = &controller.interface;
    let declared = remote_io.signals();
    let shown = declared.filter_map(|signal| {
        let SignalInput { place, valid, .. } = signal.input;
        let sampled = program.inputs.as_deref();
        Some(ShownSignal {
            input: interface.inputs.iter().position(|point| point.bit == u32::from(place.bit))?,
            valid: sampled.and_then(|sampled| match valid {
                Some(valid) => Some(*sampled.as_bytes().get(usize::from(valid))? == b'1'),
                None => program.validity.get(&place.bit).copied(),
            }),
        })
    });
    shown.collect()
}

fn shown_force(controller: Option<&Controller>, force: &Force, left_s: u64) -> ShownForce {
    let point = controller.and_then(|controller| forced_point(controller, force));
    let interface = controller.map(|controller| &controller.interface);
    let (kind, points) = match force.signal {
        SignalPlace::Input(_) => ("input", interface.map(|of| &of.inputs)),
        SignalPlace::Output(_) => ("output", interface.map(|of| &of.outputs)),
    };
    let place = |point: &Point| points?.iter().position(|other| other.bit == point.bit);
    ShownForce {
        kind,
        index: point.and_then(place),
        bit: force.signal.first_bit(),
        value: match point {
            Some(point) => forced_value(point, force),
            None => force.value.stored().into(),
        },
        seconds: force.seconds,
        left_s,
        owner: force.owner.clone(),
        reason: force.reason.clone(),
    }
}

fn timing(run: &RunModel, snapshot: &Snapshot) -> Timing {
    let until = snapshot.cycle.unwrap_or(i64::MAX);
    let timings = || run.timings().filter(|timing| timing.cycle <= until);
    let least = timings().map(|timing| timing.margin_ns).min();
    // The newest cycles are not closed yet.
    let own = timings().next_back();
    Timing {
        cycle_us: own.and_then(|timing| timing.cycle_ns).map(|cycle_ns| cycle_ns / 1000),
        margin_us: own.map(|timing| timing.margin_ns / 1000),
        least_margin_us: least.map(|least| least / 1000),
        least_of: timings().count(),
        stalls: snapshot.host_stalls,
        slowest: snapshot.remote_ios.iter().filter_map(timed).max_by_key(Slowest::longest),
    }
}

fn timed(remote_io: &RemoteIoSnapshot) -> Option<Slowest> {
    let (name, sample_to_output) = (remote_io.name.clone(), remote_io.sample_to_output?);
    Some(Slowest { name, sample_to_output, wakeups: remote_io.wakeups? })
}

impl Slowest {
    fn longest(&self) -> u64 {
        self.sample_to_output.p999_ns
    }
}

fn unacknowledged(alarms: &[Alarm]) -> usize {
    alarms.iter().filter(|alarm| alarm.acknowledged_by.is_none()).count()
}

/// The alarms up to a cycle: first those that wait for a person, then those that last, then the others; of each the critical and the newest first.
fn shown_alarms(run: &RunModel, cycle: i64) -> Vec<ShownAlarm> {
    let alarms = run.alarms_at(cycle).rev();
    let mut alarms: Vec<Alarm> = alarms.filter(|alarm| alarm.repeated_in.is_none()).collect();
    let is_critical = |alarm: &Alarm| alarm.priority == Some(Priority::Critical);
    alarms.sort_by_key(|alarm| {
        (alarm.acknowledged_by.is_some(), alarm.over.is_some(), !is_critical(alarm))
    });
    alarms.into_iter().take(LISTED_ALARMS).map(shown_alarm).collect()
}

fn shown_alarm(alarm: Alarm) -> ShownAlarm {
    ShownAlarm {
        state: alarm.state().word(),
        priority: alarm.priority.map(Priority::word),
        action: alarm.action,
        since_before: alarm.since_before,
        id: alarm.number,
        cycle: alarm.cycle,
        at: alarm.raised_at,
        over_at: alarm.over_at,
        acknowledged_at: alarm.acknowledged_at,
        who: alarm.name,
        programs: alarm.programs,
        what: alarm.text,
        lasts: alarm.over.is_none(),
        over: alarm.over,
        acknowledged: alarm.acknowledged_by,
        acknowledged_in: alarm.acknowledged_in,
    }
}
