//! Chosen signals over the cycles, with the source of each program's outputs, what was done to the cluster, and its alarms.
//!
//! Up to [`EXACT_CYCLES`] each value is there. Of more cycles there are columns, each with the least and the greatest value of its cycles.

use std::collections::BTreeMap;
use std::sync::Arc;

use axum::Json;
use axum::extract::rejection::QueryRejection;
use axum::extract::{Query, State};
use serde::{Deserialize, Serialize};
use serde_json::Value;
use understudy_cluster::{AlarmCondition, AlarmDeclaration};
use understudy_journal::{TimeOfDay, source_word};
use understudy_typed::Point;
use understudy_view::{Images, StateSignal, number_of};
use understudy_wire::ProgramId;

use super::Answered;
use super::facts::known;
use super::signals::{Signal, Signals, identifiers};
use crate::app::App;
use crate::error::Problem;
use crate::model::Known;
use crate::shown;

/// Signals in one answer, at most.
const MAXIMUM_SIGNALS: usize = 32;

/// Cycles in one answer, at most.
const MAXIMUM_CYCLES: i64 = 1_000_000_000_000;

/// Cycles of which each value is in one answer, at most.
const EXACT_CYCLES: i64 = 20_000;

/// Columns of one answer, where its cycles are more.
const COLUMNS: i64 = 600;

/// Alarms in one answer, at most.
const MAXIMUM_ALARMS: usize = 200;

/// Changes of one signal, at most; what is older is left out.
const MAXIMUM_CHANGES: usize = 20_000;

/// Cycles of which the states of the programs are recomputed for one answer, at most: the newest.
const MAXIMUM_SCANS: usize = 2000;

/// Steps of the wall clock and pauses of the cluster in one answer, at most.
const MAXIMUM_TIMES: usize = 1000;

/// Faults in one answer, at most.
const MAXIMUM_FAULTS: usize = 200;

#[derive(Debug, Deserialize)]
pub(super) struct Wanted {
    /// Identifiers with commas between.
    #[serde(default)]
    signals: String,
    from: i64,
    /// The last cycle.
    to: i64,
}

#[derive(Debug, Serialize)]
pub(super) struct Trends {
    from: i64,
    to: i64,
    /// Cycles of a column; nothing where each value is there.
    column: Option<i64>,
    signals: Vec<Trend>,
    sources: Vec<Band>,
    faults: Vec<Fault>,
    alarms: Vec<Marked>,
    /// From this cycle on cycles are a period apart, up to the next one, with its time of day; none where no wall clock was recorded.
    times: Vec<(i64, TimeOfDay)>,
}

#[derive(Debug, Serialize)]
struct Trend {
    name: String,
    /// From this cycle on it is this value, up to the next one; nothing where it is not known.
    runs: Vec<(i64, Option<Value>)>,
    /// The least and the greatest value in each column; nothing where none is known.
    columns: Vec<Option<(f64, f64)>>,
    /// Limits of the alarms on this signal.
    limits: Vec<f64>,
}

/// An alarm that was active in the cycles.
#[derive(Debug, Serialize)]
struct Marked {
    cycle: i64,
    /// The cycle in which it was over; nothing while it lasts.
    over: Option<i64>,
    name: String,
    words: String,
}

#[derive(Debug, Serialize)]
struct Band {
    name: String,
    /// First cycle, last cycle, source.
    runs: Vec<(i64, i64, &'static str)>,
}

#[derive(Debug, Serialize)]
struct Fault {
    cycle: i64,
    words: String,
}

pub(super) async fn trends(
    State(app): State<Arc<App>>,
    wanted: Result<Query<Wanted>, QueryRejection>,
) -> Answered<Json<Trends>> {
    let Query(Wanted { signals, from, to }) = wanted?;
    let cycles = to.checked_sub(from).filter(|cycles| *cycles >= 0);
    if cycles.is_none_or(|cycles| cycles >= MAXIMUM_CYCLES) {
        return Err(Problem::bad(format!(
            "from {from} to {to}: a trend has 1 to {MAXIMUM_CYCLES} cycles"
        )));
    }
    let names = identifiers(&signals, MAXIMUM_SIGNALS)?;
    let model = app.model();
    let known = known(&model)?;
    let sources = known.run.program_ids().map(|program| band(known, program, from, to));
    let faults = known.run.events().filter(|event| {
        let done = matches!(event.event, "fault" | "ended" | "forced" | "unforced");
        done && (from..=to).contains(&event.cycle)
    });
    let column = (to - from >= EXACT_CYCLES).then(|| (to - from) / COLUMNS + 1);
    let alarms = known.run.alarms_at(to).filter(|alarm| alarm.over.is_none_or(|over| over >= from));
    let alarms = alarms.map(|alarm| Marked {
        cycle: alarm.cycle,
        over: alarm.over,
        name: alarm.name,
        words: alarm.text,
    });
    Ok(Json(Trends {
        from,
        to,
        column,
        alarms: alarms.take(MAXIMUM_ALARMS).collect(),
        signals: trends_of(known, &names, (from, to), column)?,
        times: known.run.times(from, to).take(MAXIMUM_TIMES).collect(),
        sources: sources.collect(),
        faults: faults
            .take(MAXIMUM_FAULTS)
            .map(|event| Fault { cycle: event.cycle, words: event.text.clone() })
            .collect(),
    }))
}

fn trends_of(
    known: &Known,
    names: &[&str],
    (from, to): (i64, i64),
    column: Option<i64>,
) -> Answered<Vec<Trend>> {
    let mut signals = Signals::default();
    let mut trends = Vec::new();
    let mut of_states: BTreeMap<u8, (Vec<usize>, Vec<StateSignal>)> = BTreeMap::new();
    for name in names {
        let (program, signal) = signals.find(known, name)?;
        let series = known.run.series();
        let of_program = shown::program_name(&known.run, program);
        let trend = |label: &str| Trend {
            name: format!("{of_program}.{label}"),
            runs: Vec::new(),
            columns: Vec::new(),
            limits: Vec::new(),
        };
        let mut of_point = |point: &Point, images: Option<&Images>, is_output: bool| {
            let limits = limits(known, program, point, is_output);
            let trend = Trend { limits, ..trend(&point.name) };
            trends.push(match column {
                None => {
                    let runs = images.map(|images| runs(images, point, from, to));
                    Trend { runs: runs.unwrap_or_default(), ..trend }
                }
                Some(width) => {
                    let count = usize::try_from((to - from) / width + 1).unwrap_or(0);
                    let columns = images.map(|images| images.columns(point, from, width, count));
                    Trend { columns: columns.unwrap_or_default(), ..trend }
                }
            });
        };
        match signal {
            Signal::Input(point) => of_point(&point, series.inputs(program), false),
            Signal::Output(point) => of_point(&point, series.outputs(program), true),
            Signal::State(signal) => {
                let own = of_states.entry(program.0).or_default();
                own.0.push(trends.len());
                trends.push(trend(&signal.name));
                own.1.push(signal);
            }
        }
    }
    // The states of the programs are recomputed, which takes too long for many cycles.
    if column.is_some() {
        return Ok(trends);
    }
    for (program, (places, own)) in of_states {
        let program = ProgramId(program);
        let scans = known.run.state_trend(program, (from, to), &own, MAXIMUM_SCANS);
        for (number, place) in places.into_iter().enumerate() {
            let values = scans.iter().map(|(cycle, values)| {
                let drawn = match &values[number] {
                    Value::Bool(on) => u8::from(*on).into(),
                    other => other.clone(),
                };
                (*cycle, drawn)
            });
            trends[place].runs = state_runs(values, from, to);
        }
    }
    Ok(trends)
}

/// The limits of the alarms on a point.
fn limits(known: &Known, program: ProgramId, point: &Point, is_output: bool) -> Vec<f64> {
    let alarms = known.run.cluster().alarms().iter().filter(|alarm| {
        let own = (alarm.program, alarm.is_output, &alarm.point.name, alarm.point.of);
        own == (program, is_output, &point.name, point.of)
    });
    let limit = |alarm: &AlarmDeclaration| match alarm.condition {
        AlarmCondition::Above { limit, .. } | AlarmCondition::Below { limit, .. } => {
            Some(point.of.number(limit))
        }
        AlarmCondition::Is(_) => None,
    };
    alarms.filter_map(limit).filter(|limit| limit.is_finite()).collect()
}

/// Values of single cycles as runs; what lies between them is not known.
fn state_runs(
    values: impl Iterator<Item = (i64, Value)>,
    from: i64,
    to: i64,
) -> Vec<(i64, Option<Value>)> {
    let mut runs: Vec<(i64, Option<Value>)> = Vec::new();
    let mut known_up_to = from;
    let mut push = |cycle, value| {
        if runs.last().is_none_or(|(_, last)| *last != value) {
            runs.push((cycle, value));
        }
    };
    for (cycle, value) in values {
        if cycle > known_up_to {
            push(known_up_to, None);
        }
        push(cycle, Some(value));
        known_up_to = cycle + 1;
    }
    if known_up_to <= to {
        push(known_up_to, None);
    }
    runs
}

fn runs(images: &Images, point: &Point, from: i64, to: i64) -> Vec<(i64, Option<Value>)> {
    let mut runs: Vec<(i64, Option<Value>)> = Vec::new();
    let mut push = |cycle: i64, value: Option<Value>| {
        if runs.last().is_none_or(|(_, last)| *last != value) {
            runs.push((cycle, value));
        }
    };
    let mut known_up_to = from;
    for span in images.spans(point, from, to + 1) {
        if span.from > known_up_to {
            push(known_up_to, None);
        }
        push(span.from, Some(number_of(point, span.value)));
        known_up_to = span.to;
    }
    if known_up_to <= to {
        push(known_up_to, None);
    }
    let older = runs.len().saturating_sub(MAXIMUM_CHANGES);
    runs.split_off(older)
}

fn band(known: &Known, program: ProgramId, from: i64, to: i64) -> Band {
    let sources = known.run.series().sources(program);
    let spans = sources.into_iter().flat_map(|sources| sources.spans(from, to + 1));
    Band {
        name: shown::program_name(&known.run, program),
        runs: spans.map(|span| (span.from, span.to - 1, source_word(*span.value))).collect(),
    }
}
