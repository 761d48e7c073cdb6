//! Signals by identifier, and their values in a cycle.
//!
//! An identifier is `PROGRAM.input.NAME`, `PROGRAM.output.NAME` or `PROGRAM.state.NAME`, or has the number of an input or output in place of its name; in a
//! name, `;` is written for a comma, because a list of identifiers has commas between.

use std::collections::BTreeMap;
use std::sync::Arc;

use axum::Json;
use axum::extract::rejection::QueryRejection;
use axum::extract::{Query, State};
use serde::{Deserialize, Serialize};
use serde_json::Value;
use understudy_typed::{Enumeration, Point, Points};
use understudy_view::{StateSignal, shown};
use understudy_wire::ProgramId;

use super::Answered;
use super::facts::{at_cycle, known};
use crate::app::App;
use crate::error::Problem;
use crate::model::Known;

/// Signals whose values are in one answer, at most.
const MAXIMUM_SIGNALS: usize = 200;

/// A signal of a program.
pub(super) enum Signal {
    Input(Point),
    Output(Point),
    State(StateSignal),
}

/// What is known of the signals in the state of the programs that a request names.
#[derive(Default)]
pub(super) struct Signals(BTreeMap<u8, BTreeMap<String, StateSignal>>);

impl Signals {
    /// The signal of an identifier, and its program.
    pub(super) fn find(&mut self, known: &Known, id: &str) -> Answered<(ProgramId, Signal)> {
        let found = self.look(known, id);
        found.ok_or_else(|| Problem::unknown(format!("the run has no signal {id:.60}")))
    }

    fn look(&mut self, known: &Known, id: &str) -> Option<(ProgramId, Signal)> {
        let mut parts = id.splitn(3, '.');
        let program = ProgramId(parts.next()?.parse().ok()?);
        let (kind, name) = (parts.next()?, parts.next()?);
        // By a number it is one of the points that count.
        let controller = known.run.points_at(program, known.run.newest())?;
        let point = |points: &Points| match name.parse() {
            Ok(number) => points.iter().nth(number).cloned(),
            Err(_) => points.iter().find(|point| identified(&point.name) == name).cloned(),
        };
        let signal = match kind {
            "input" => Signal::Input(point(&controller.interface.inputs)?),
            "output" => Signal::Output(point(&controller.interface.outputs)?),
            "state" => {
                let of_program = self.0.entry(program.0).or_insert_with(|| {
                    let signals = known.run.state_signals(program).into_iter();
                    signals.map(|signal| (identified(&signal.name), signal)).collect()
                });
                Signal::State(of_program.get(name)?.clone())
            }
            _ => return None,
        };
        Some((program, signal))
    }
}

/// A name in an identifier.
fn identified(name: &str) -> String {
    name.replace(',', ";")
}

/// The identifiers of a list, at most so many.
pub(super) fn identifiers(text: &str, most: usize) -> Answered<Vec<&str>> {
    let names: Vec<&str> = text.split(',').filter(|name| !name.is_empty()).collect();
    if names.len() > most {
        let count = names.len();
        return Err(Problem::bad(format!("{count} signals: at most {most}")));
    }
    Ok(names)
}

#[derive(Debug, Serialize)]
pub(super) struct Listed {
    id: String,
    program: usize,
    /// `variable`, as opposed to `input` and `output` among the facts of the run.
    kind: &'static str,
    name: String,
    #[serde(rename = "type")]
    of: String,
    /// The names of the values of an enumeration, by number.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    values: BTreeMap<i64, String>,
    address: Option<String>,
    /// The comment of its declaration.
    description: Option<String>,
}

/// The names of the values of an enumeration, by number; of several names the first.
pub(super) fn value_names(known: Option<&Enumeration>) -> BTreeMap<i64, String> {
    let values = known.into_iter().flat_map(|known| known.values.iter().rev());
    values.map(|(name, value)| (*value, name.clone())).collect()
}

/// The signals in the states of all programs; inputs and outputs are facts of the run.
pub(super) async fn signals(State(app): State<Arc<App>>) -> Answered<Json<Vec<Listed>>> {
    let model = app.model();
    let known = known(&model)?;
    let programs = known.run.program_ids();
    let listed = programs.flat_map(|program| {
        let signals = known.run.state_signals(program).into_iter();
        signals.map(move |signal| Listed {
            id: format!("{}.state.{}", program.0, identified(&signal.name)),
            program: program.index(),
            kind: "variable",
            values: value_names(signal.values()),
            name: signal.name,
            of: signal.of,
            address: signal.address,
            description: signal.description,
        })
    });
    Ok(Json(listed.collect()))
}

#[derive(Debug, Deserialize)]
pub(super) struct Wanted {
    #[serde(default)]
    signals: String,
    cycle: Option<i64>,
}

#[derive(Debug, Serialize)]
pub(super) struct Values {
    cycle: i64,
    /// In the order of the request; nothing where one is not known.
    values: Vec<Value>,
    /// Identifiers of the request that no signal has; the request is refused where it has no other ones.
    unknown: Vec<String>,
}

/// Inputs and outputs as last sampled and applied, and the state after the scan of the cycle.
pub(super) async fn values(
    State(app): State<Arc<App>>,
    wanted: Result<Query<Wanted>, QueryRejection>,
) -> Answered<Json<Values>> {
    let Query(wanted) = wanted?;
    let names = identifiers(&wanted.signals, MAXIMUM_SIGNALS)?;
    at_cycle(&app, wanted.cycle, |known, cycle| {
        let mut signals = Signals::default();
        let mut values = vec![Value::Null; names.len()];
        let mut unknown = Vec::new();
        let mut of_states: BTreeMap<u8, (Vec<usize>, Vec<StateSignal>)> = BTreeMap::new();
        for (place, name) in names.iter().enumerate() {
            let series = known.run.series();
            let (program, signal) = match signals.find(known, name) {
                Ok(found) => found,
                Err(_) if unknown.len() + 1 < names.len() => {
                    unknown.push((*name).to_owned());
                    continue;
                }
                Err(problem) => return Err(problem),
            };
            let (point, images) = match signal {
                Signal::Input(point) => (point, series.inputs(program)),
                Signal::Output(point) => (point, series.outputs(program)),
                Signal::State(signal) => {
                    let own = of_states.entry(program.0).or_default();
                    own.0.push(place);
                    own.1.push(signal);
                    continue;
                }
            };
            if let Some(stored) = images.and_then(|images| images.stored_at(&point, cycle)) {
                values[place] = shown(&point.declared(), stored);
            }
        }
        for (program, (places, own)) in of_states {
            let found = known.run.state_values(ProgramId(program), cycle, &own);
            let found = found.unwrap_or_default().into_iter().zip(&own);
            for (place, (value, signal)) in places.into_iter().zip(found) {
                values[place] = signal.shown(value);
            }
        }
        Ok(Values { cycle, values, unknown })
    })
    .map(Json)
}
