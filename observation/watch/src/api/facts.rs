//! Facts of the run, and its state in a cycle.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Instant;

use axum::Json;
use axum::extract::rejection::{PathRejection, QueryRejection};
use axum::extract::{Extension, Path, Query, State};
use axum::http::header::CONTENT_TYPE;
use axum::response::{IntoResponse, Response};
use serde::{Deserialize, Serialize};
use serde_json::Value;
use understudy_cluster::{Card, CardFacts, Controller, OperatorDeclaration};
use understudy_journal::PointsInEffect;
use understudy_remote_io::{OperatorInput, OperatorInputKind};
use understudy_typed::{Point, Points};
use understudy_view::shown as shown_value;
use understudy_wire::{Member, ProgramId, Role};

use super::Answered;
use super::compare::others;
use super::signals::value_names;
use crate::app::App;
use crate::error::Problem;
use crate::login::Person;
use crate::model::{Known, Model};
use crate::shown::{self, NOTHING};

#[derive(Debug, Serialize)]
pub(super) struct RunFacts {
    title: String,
    cluster: String,
    period_us: u64,
    deadline_us: u64,
    stations: Vec<StationFacts>,
    programs: Vec<ProgramFacts>,
    commands: CommandFacts,
    /// Name of the person who is logged in, or whose keys the page uses.
    person: Option<String>,
    /// Whether that person has logged in, and can log out.
    logged_in: bool,
    /// Other runs of the same directory.
    others: Vec<String>,
}

#[derive(Debug, Serialize)]
struct StationFacts {
    rank: usize,
    name: String,
    role: &'static str,
    program: Option<usize>,
}

#[derive(Debug, Serialize)]
pub(super) struct ProgramFacts {
    index: usize,
    name: String,
    remote_io: String,
    plant: Option<String>,
    /// Hash of the version of the program whose points these are; nothing of them is listed where it is not known.
    points: Option<String>,
    inputs: Vec<SignalFacts>,
    outputs: Vec<SignalFacts>,
}

#[derive(Debug, Serialize)]
struct SignalFacts {
    name: String,
    /// Its type, `BOOL`.
    #[serde(rename = "type")]
    of: String,
    /// The names of the values of an enumeration, by number.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    values: BTreeMap<i64, String>,
    /// Its first bit in the image.
    bit: u32,
    address: Option<String>,
    /// How it is shown.
    #[serde(flatten)]
    card: CardFacts,
    /// Of an input that operators write.
    operator: Option<OperatorFacts>,
    /// Of an input that is an output of another program.
    from: Option<FromFacts>,
}

/// Input that operators write.
#[derive(Debug, Serialize)]
struct OperatorFacts {
    /// `level`, `pulse` or `setpoint`.
    kind: &'static str,
    title: String,
    /// Whether the page asks before it writes.
    confirm: bool,
    /// Of a setpoint: a duration in nanoseconds, a value of an enumeration by its name.
    low: Option<Value>,
    high: Option<Value>,
    /// Reason why this person may not write it.
    why: Option<String>,
}

/// Output of another program.
#[derive(Debug, Serialize)]
struct FromFacts {
    program: usize,
    /// Name of the output.
    output: String,
}

#[derive(Debug, Serialize)]
struct CommandFacts {
    /// Reason why no command can be given.
    why: Option<String>,
    /// Reason why no operator input can be written.
    write_why: Option<String>,
    /// Whether commands are refused until the scenario is over.
    after_scenario: bool,
    /// Commands that are impossible in this run, each with the reason.
    impossible: BTreeMap<&'static str, String>,
}

pub(super) async fn run(
    State(app): State<Arc<App>>,
    Extension(person): Extension<Person>,
) -> Answered<Json<RunFacts>> {
    let model = app.model();
    // The cluster is known before the present state.
    let known = model.known().ok_or_else(|| not_begun(&model))?;
    let run = &known.run;
    let cluster = run.cluster();
    let schedule = &cluster.agreement().schedule;
    let microseconds = |time: std::time::Duration| u64::try_from(time.as_micros()).unwrap_or(0);
    let stations = run.station_ids().map(|station| StationFacts {
        rank: station.index(),
        name: run.members().name(Member::Station(station)).to_owned(),
        role: if schedule.is_understudy(station) { "understudy" } else { "controller" },
        program: (!schedule.is_understudy(station)).then_some(station.index()),
    });
    let points = run.points_in(run.newest());
    let facts = |program| program_facts(known, &points, program, person.role);
    let programs = run.program_ids().map(facts);
    Ok(Json(RunFacts {
        title: format!("{} · {}", cluster.name(), model.name()),
        cluster: cluster.name().to_owned(),
        period_us: microseconds(schedule.period()),
        deadline_us: microseconds(schedule.deadline()),
        stations: stations.collect(),
        programs: programs.collect(),
        commands: CommandFacts {
            why: app.why_not(&person).map(str::to_owned),
            write_why: app.why_not_write(&person).map(str::to_owned),
            after_scenario: app.commanding.after_scenario,
            impossible: app.commanding.impossible.iter().cloned().collect(),
        },
        person: Some(person.name).filter(|name| !name.is_empty()),
        logged_in: app.gate.logins.is_some(),
        others: others(&app.run),
    }))
}

/// A program with the points by which a cycle is shown.
pub(super) async fn points(
    State(app): State<Arc<App>>,
    Extension(person): Extension<Person>,
    program: Result<Path<u8>, PathRejection>,
    when: Result<Query<When>, QueryRejection>,
) -> Answered<Json<ProgramFacts>> {
    let (Path(program), Query(when)) = (program?, when?);
    let program = ProgramId(program);
    at_cycle(&app, when.cycle, |known, cycle| {
        if known.run.program_ids().all(|other| other != program) {
            return Err(Problem::unknown(format!("the cluster has no program {}", program.0)));
        }
        let points = known.run.points_in(Some(cycle));
        Ok(program_facts(known, &points, program, person.role))
    })
    .map(Json)
}

fn program_facts(
    known: &Known,
    points: &PointsInEffect,
    program: ProgramId,
    role: Role,
) -> ProgramFacts {
    let cluster = known.run.cluster();
    let plant = Member::Plant(program);
    let controller = points.controller(program);
    let name = |member| known.run.members().name(member).to_owned();
    let facts = |of: fn(&Controller) -> &Points| {
        let card = |name: &str| points.cluster().card(program, name);
        let own = controller.into_iter();
        let own = own.flat_map(|own| of(own).iter().map(move |point| (own, point)));
        let facts = own.map(|(own, point)| signal_facts(own, point, card(&point.name)));
        facts.collect::<Vec<SignalFacts>>()
    };
    let mut inputs = facts(|own| &own.interface.inputs);
    let remote_io = points.remote_io(program);
    for source in remote_io.iter().flat_map(|remote_io| &remote_io.inputs) {
        let input = inputs.iter_mut().find(|input| input.name == source.name);
        if let Some(input) = input {
            input.operator =
                source.operator().and_then(|declared| operator_facts(&source.name, declared, role));
            input.from = source.signal().map(|signal| FromFacts {
                program: signal.input.from.index(),
                output: signal.output.clone(),
            });
        }
    }
    ProgramFacts {
        index: program.index(),
        name: shown::program_name(&known.run, program),
        remote_io: name(Member::RemoteIo(program)),
        plant: cluster.member_name(plant).map(str::to_owned),
        points: points.versions().get(program.index()).map(ToString::to_string),
        inputs,
        outputs: facts(|own| &own.interface.outputs),
    }
}

/// Nothing for an input that the gateway of another group writes.
fn operator_facts(name: &str, declared: &OperatorDeclaration, role: Role) -> Option<OperatorFacts> {
    let OperatorInput { kind, role: required, .. } = declared.input;
    let (kind, limits) = match kind {
        OperatorInputKind::Level => ("level", None),
        OperatorInputKind::Pulse(_) => ("pulse", None),
        OperatorInputKind::Setpoint { low, high } => ("setpoint", Some((low, high))),
        OperatorInputKind::Group { .. } => return None,
    };
    Some(OperatorFacts {
        kind,
        title: declared.title.clone().unwrap_or_else(|| name.to_owned()),
        confirm: declared.confirm,
        low: limits.map(|(low, _)| shown_value(&declared.declared, low)),
        high: limits.map(|(_, high)| shown_value(&declared.declared, high)),
        why: (role < required).then(|| format!("it requires the role {}", required.word())),
    })
}

fn signal_facts(controller: &Controller, point: &Point, card: Card) -> SignalFacts {
    let mut variables = controller.code.typed().variables.iter();
    let variable = variables.find(|variable| variable.name == point.name);
    SignalFacts {
        name: point.name.clone(),
        of: point.declared().to_string(),
        values: value_names(point.values.as_deref()),
        bit: point.bit,
        address: variable.and_then(|variable| variable.address.clone()),
        card: card.facts(point.of),
        operator: None,
        from: None,
    }
}

/// A cycle; by default the newest.
#[derive(Debug, Deserialize)]
pub(super) struct When {
    pub(super) cycle: Option<i64>,
}

pub(super) async fn state(
    State(app): State<Arc<App>>,
    when: Result<Query<When>, QueryRejection>,
) -> Answered<Response> {
    let Query(when) = when?;
    let newest = app.newest.borrow().clone();
    let is_current = newest.progress.current(Instant::now()).is_ok();
    if when.cycle.is_none() && is_current && &*newest.state != NOTHING {
        // Written once for all clients.
        let json = [(CONTENT_TYPE, "application/json")];
        return Ok((json, newest.state.to_string()).into_response());
    }
    let state = at_cycle(&app, when.cycle, |known, cycle| {
        let state = shown::state(&known.run, cycle, known.has_ended());
        state.ok_or_else(|| not_remembered(cycle))
    });
    let mut state = state?;
    // The model of an older cycle has not read everything that is before it.
    if let Some(known) = app.model().known() {
        state.rest_is(known);
    }
    Ok(Json(state).into_response())
}

/// Answers from the model; for a cycle that it does not remember, from the journal.
pub(super) fn at_cycle<T>(
    app: &App,
    cycle: Option<i64>,
    answer: impl Fn(&Known, i64) -> Answered<T>,
) -> Answered<T> {
    let older = {
        let model = app.model();
        let known = known(&model)?;
        let newest =
            known.run.newest().ok_or_else(|| Problem::unrecorded("the run has no cycle yet"))?;
        let cycle = cycle.unwrap_or(newest);
        if cycle > newest {
            return Err(Problem::unrecorded(format!(
                "cycle {cycle} is in the future: the newest is {newest}"
            )));
        }
        if known.run.oldest().is_some_and(|oldest| oldest <= cycle) {
            return answer(known, cycle);
        }
        cycle
    };
    let known = tokio::task::block_in_place(|| app.reread(older))?;
    answer(&known, older)
}

pub(crate) fn not_remembered(cycle: i64) -> Problem {
    Problem::unrecorded(format!("the journal does not contain cycle {cycle}"))
}

/// The run, if its present state is known.
pub(super) fn known(model: &Model) -> Answered<&Known> {
    model.present()?.ok_or_else(|| not_begun(model))
}

fn not_begun(model: &Model) -> Problem {
    Problem::unrecorded(model.waits_for.clone())
}

#[cfg(test)]
mod tests {
    use understudy_remote_io::PointPlace;
    use understudy_typed::Elementary;

    use super::*;

    #[test]
    fn an_input_says_why_a_person_may_not_write_it() {
        let declared = OperatorDeclaration {
            input: OperatorInput {
                place: PointPlace { bit: 0, of: Elementary::Int },
                kind: OperatorInputKind::Setpoint { low: (-5i16) as u16 as u64, high: 7 },
                initial: 0,
                role: Role::Engineer,
                retains: false,
            },
            declared: Elementary::Int.into(),
            title: None,
            unit: None,
            confirm: true,
            group: None,
        };
        let facts = |role| {
            let facts = operator_facts("gap", &declared, role);
            serde_json::to_value(facts).expect("JSON")
        };
        let operator = facts(Role::Operator);
        assert_eq!(operator["title"], "gap");
        assert_eq!((&operator["low"], &operator["high"]), (&(-5).into(), &7.into()));
        assert_eq!(operator["why"], "it requires the role engineer");
        assert_eq!(facts(Role::Engineer)["why"], Value::Null);
    }
}
