//! What the page shows of one cycle, as JSON: who works, what is driven from which source, what could fail, what somebody has to look at.

mod members;

use std::time::Instant;

use serde::Serialize;
use understudy_journal::source_word;
use understudy_remote_io::Missing;
use understudy_view::{Alarm, LostState, Margin, Outcome, Protection};
use understudy_wire::{Member, ProgramId, ProgramSet, SignalPlace, Source, StationId};

use self::members::{ShownMember, words_of};
use crate::changes::Standing;
use crate::model::{Known, Model};

/// Failures that are listed, at most.
const LISTED_FAILURES: usize = 40;

/// One cycle.
#[derive(Debug, Serialize)]
pub(crate) struct State {
    /// Of the newest record, in milliseconds, when this was written.
    age_ms: u64,
    pub(crate) cycle: i64,
    pub(crate) oldest: i64,
    pub(crate) newest: i64,
    finished: bool,
    /// What the scenario came to, where it is over and the cluster stays up.
    scenario_over: Option<String>,
    cycle_master: Option<String>,
    members: Vec<ShownMember>,
    programs: Vec<ShownProgram>,
    timing: Timing,
    survival: Survival,
    alarms: Vec<ShownAlarm>,
    event_count: u64,
}

#[derive(Debug, Serialize)]
struct ShownProgram {
    index: usize,
    name: String,
    source: &'static str,
    word_of: Option<String>,
    /// Why nothing true was there.
    missing: Option<String>,
    inputs: Option<String>,
    outputs: Option<String>,
    /// What its own controller said.
    said: Option<String>,
    forced: Vec<ShownForce>,
    /// Nothing while the remote I/O has not reported it.
    protection: Option<ShownProtection>,
    lost: Option<ShownLost>,
    counts: Counts,
}

#[derive(Debug, Serialize)]
struct ShownProtection {
    #[serde(flatten)]
    protection: Protection,
    words: String,
}

#[derive(Debug, Serialize)]
struct ShownLost {
    #[serde(flatten)]
    lost: LostState,
    words: String,
}

#[derive(Debug, Serialize)]
struct ShownForce {
    kind: &'static str,
    index: u16,
    value: bool,
    seconds: u32,
    owner: String,
    reason: String,
}

#[derive(Debug, Default, Serialize)]
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
    stalls: usize,
}

#[derive(Debug, Serialize)]
struct Survival {
    level: &'static str,
    words: String,
    failures: Vec<Failure>,
}

#[derive(Debug, Serialize)]
struct Failure {
    names: Vec<String>,
    masked: bool,
    why: String,
}

#[derive(Debug, Serialize)]
struct ShownAlarm {
    id: u64,
    cycle: i64,
    who: String,
    what: String,
    lasts: bool,
    acknowledged: Option<String>,
    acknowledged_in: Option<i64>,
}

/// The newest state while nothing is known.
pub(crate) const NOTHING: &str = "null";

/// The newest state as JSON; [`NOTHING`] where nothing is known yet.
pub(crate) fn newest_state(model: &Model) -> String {
    let mut state = model
        .known()
        .and_then(|known| state(known, known.newest()?));
    if let Some(state) = &mut state {
        let age = model.progress.age(Instant::now()).unwrap_or_default();
        state.age_ms = u64::try_from(age.as_millis()).unwrap_or(u64::MAX);
    }
    serde_json::to_string(&state).unwrap_or_else(|_| NOTHING.to_owned())
}

/// The state of a cycle; nothing where it is not remembered.
pub(crate) fn state(known: &Known, cycle: i64) -> Option<State> {
    let (oldest, newest) = (known.oldest()?, known.newest()?);
    if !(oldest.min(newest)..=newest).contains(&cycle) {
        return None;
    }
    let run = &known.run;
    let standing = known.changes.at(cycle);
    let excluded: Vec<_> = known
        .programs()
        .map(|program| standing.excluded(program))
        .collect();
    let margin = known.margin(cycle, &excluded);
    let cycle_master = members::cycle_master(known, &standing, cycle);
    let stations = known
        .stations()
        .map(|station| members::station(known, &standing, station, cycle));
    let remote_ios = known
        .programs()
        .map(|program| members::remote_io(known, &standing, program, cycle));
    let plants = known
        .programs()
        .filter_map(|program| members::plant(known, &standing, program));
    Some(State {
        age_ms: 0,
        cycle,
        oldest,
        newest,
        finished: known.has_ended(),
        scenario_over: run.scenario_over(cycle).map(str::to_owned),
        cycle_master: cycle_master.map(|station| name(known, Member::Station(station))),
        members: stations.chain(remote_ios).chain(plants).collect(),
        programs: known
            .programs()
            .map(|program| shown_program(known, &standing, program, cycle))
            .collect(),
        timing: timing(known, cycle),
        survival: survival(known, &margin),
        alarms: run
            .alarms()
            .rev()
            .filter(|alarm| alarm.cycle <= cycle)
            .take(100)
            .map(shown_alarm)
            .collect(),
        event_count: run.event_count(),
    })
}

pub(crate) fn name(known: &Known, member: Member) -> String {
    known.run.members().name(member).to_owned()
}

/// A program has the name of its controller.
pub(crate) fn program_name(known: &Known, program: ProgramId) -> String {
    name(known, Member::Station(StationId(program.0)))
}

fn program_names(known: &Known, programs: ProgramSet) -> Vec<String> {
    let names = programs.iter().map(|program| program_name(known, program));
    names.collect()
}

fn shown_program(
    known: &Known,
    standing: &Standing,
    program: ProgramId,
    cycle: i64,
) -> ShownProgram {
    let run = &known.run;
    let step = run.history(program).and_then(|steps| steps.at(cycle));
    let driven = step.and_then(|step| step.driven.as_ref());
    let sampled = step.and_then(|step| step.sampled.as_ref());
    let own = words_of(known, StationId(program.0), cycle);
    let protected = standing.protection(program);
    ShownProgram {
        index: program.index(),
        name: program_name(known, program),
        source: driven.map_or("unknown", |driven| source_word(driven.source)),
        word_of: driven
            .and_then(|driven| driven.word_of)
            .map(|station| name(known, Member::Station(station))),
        missing: driven.and_then(|driven| driven.missing).map(missing_words),
        inputs: sampled.map(|sampled| sampled.inputs.to_string()),
        outputs: driven.map(|driven| driven.outputs.to_string()),
        said: own.into_iter().next().map(|word| word.sum),
        forced: standing
            .forced(program)
            .map(|force| {
                let (kind, index) = match force.signal {
                    SignalPlace::Input(index) => ("input", index),
                    SignalPlace::Output(index) => ("output", index),
                };
                ShownForce {
                    kind,
                    index,
                    value: force.value,
                    seconds: force.seconds,
                    owner: force.owner.clone(),
                    reason: force.reason.clone(),
                }
            })
            .collect(),
        protection: protected.protection.map(|protection| ShownProtection {
            words: protection.text(),
            protection,
        }),
        lost: protected.lost.map(|lost| ShownLost {
            words: lost.text(),
            lost,
        }),
        counts: counts(known, program, cycle),
    }
}

/// As the journal says it, for people.
pub(crate) fn missing_words(missing: Missing) -> String {
    let word = serde_json::to_value(missing).ok();
    let word = word.as_ref().and_then(|word| word.as_str());
    word.unwrap_or_default().replace('-', " ")
}

fn counts(known: &Known, program: ProgramId, cycle: i64) -> Counts {
    let mut counts = Counts::default();
    let Some(sources) = known.run.series().sources(program) else {
        return counts;
    };
    // As the report counts: not before everybody was synchronised.
    let first = if known.run.has_origin() { 0 } else { i64::MIN };
    for span in sources.spans(first, cycle + 1) {
        let cycles = u64::try_from(span.to - span.from).unwrap_or(0);
        match span.value {
            Source::Direct => counts.direct += cycles,
            Source::Reconstructed => counts.reconstructed += cycles,
            Source::Held => counts.held += cycles,
            Source::FailSafe => counts.fail_safe += cycles,
        }
    }
    counts
}

fn timing(known: &Known, cycle: i64) -> Timing {
    let until = || known.run.timings().filter(|timing| timing.cycle <= cycle);
    let least = until().map(|timing| timing.margin_ns).min();
    // The newest cycles are not closed yet.
    let own = until().next_back();
    let stalls = known.run.events();
    Timing {
        cycle_us: own
            .and_then(|timing| timing.cycle_ns)
            .map(|cycle_ns| cycle_ns / 1000),
        margin_us: own.map(|timing| timing.margin_ns / 1000),
        least_margin_us: least.map(|least| least / 1000),
        stalls: stalls
            .filter(|event| event.event == "stalled" && event.cycle <= cycle)
            .count(),
    }
}

fn survival(known: &Known, margin: &Margin) -> Survival {
    let of_stations = |outcome: &&Outcome| {
        let mut failed = outcome.failed.iter();
        failed.all(|member| matches!(member, Member::Station(_)))
    };
    let singles: Vec<&Outcome> = margin.singles.iter().filter(of_stations).collect();
    let masked = singles.iter().filter(|outcome| outcome.is_masked()).count();
    let (level, words) = match (margin.survives, masked) {
        _ if margin.served.is_empty() => ("none", "no program has true outputs now".to_owned()),
        (0, 0) => (
            "none",
            "no further failure of a station would be masked".to_owned(),
        ),
        (0, _) => (
            "some",
            format!(
                "{masked} of {} failures of a single station would be masked",
                singles.len()
            ),
        ),
        (1, _) => (
            "all",
            "any one further failure of a station would be masked".to_owned(),
        ),
        _ => (
            "all",
            "any two further failures of stations would be masked".to_owned(),
        ),
    };
    // A program that has lost its outputs already is no good sign, whatever else would be masked.
    let lost = known
        .programs()
        .filter(|program| !margin.served.contains(*program));
    let lost = program_names(known, lost.collect());
    let (level, words) = match (lost.is_empty(), level) {
        (true, _) | (_, "none") => (level, words),
        _ => (
            "some",
            format!(
                "{} has no true outputs now; of the others: {words}",
                lost.join(" and ")
            ),
        ),
    };
    let unmasked_pairs = margin.pairs.iter().filter(|pair| !pair.is_masked());
    let failures = singles.into_iter().chain(unmasked_pairs);
    Survival {
        level,
        words,
        failures: failures
            .take(LISTED_FAILURES)
            .map(|outcome| failure(known, outcome))
            .collect(),
    }
}

fn failure(known: &Known, outcome: &Outcome) -> Failure {
    let lost = outcome.lost.iter().map(|loss| {
        let program = program_name(known, loss.program);
        match loss.missing {
            Some(missing) => format!("{program} loses its outputs ({})", missing_words(missing)),
            None => format!("{program} loses its outputs"),
        }
    });
    let failed = outcome.failed.iter();
    Failure {
        names: failed.map(|&member| name(known, member)).collect(),
        masked: outcome.is_masked(),
        why: lost.collect::<Vec<_>>().join("; "),
    }
}

fn shown_alarm(alarm: &Alarm) -> ShownAlarm {
    ShownAlarm {
        id: alarm.number,
        cycle: alarm.cycle,
        who: alarm.name.clone(),
        what: alarm.text.clone(),
        lasts: alarm.over.is_none(),
        acknowledged: alarm.acknowledged_by.clone(),
        acknowledged_in: alarm.acknowledged_in,
    }
}
