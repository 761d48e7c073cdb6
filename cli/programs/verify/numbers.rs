//! Proofs about programs with numbers, and about the programs of a cluster together.

use std::time::Duration;

use serde_json::json;
use understudy_bits::{Inexact, Member, Source};
use understudy_cluster::{Cluster, InputSourceKind, RemoteIo};
use understudy_scenarios::Scenario;
use understudy_typed::{Elementary, Point, Program};
use understudy_verification::numbers::Model;
use understudy_verification::program::{Bounds, OutputFinding};
use understudy_verification::property::{Asked, Property, read_one};
use understudy_verification::smv;
use understudy_verification::symbolic::{Resolved, Signal};

use super::answer::{self, Finding, ProgramAnswer};
use super::scenario;
use super::{Arguments, Smv, Texts, ToProve, bounds, used};
use crate::answer::{Answer, Status};
use crate::files::{self, ProgramFile};
use crate::patience::Patience;

/// The standard property of a program that can stop.
const STANDARD: &str = "never program.fault";

/// Proves the properties of one program.
pub(super) fn of_program(
    arguments: &Arguments,
    (program, period): (&Program, Duration),
    file: ProgramFile,
    patience: &Patience<'_>,
) -> Result<Answer, Answer> {
    if arguments.smv == Some(Smv::Rungs) || arguments.draw.is_some() {
        let message =
            "--draw and --smv rungs work on rungs, and the program is written in statements";
        return Err(Answer::failed(Status::BadInput, "U0438", message));
    }
    patience.turn_to("the statements of the program".to_owned());
    let texts = Texts::read(arguments, period)?;
    let model = Model::of_program(program, &texts.asked()).map_err(|error| unsupported(&error))?;
    let wrong = |assumed: &Property| model.wrong_assumption(assumed);
    let mut asked = match texts.resolved(&|property| model.resolve(property), &wrong) {
        Ok(asked) => asked,
        Err(mut answer) => {
            answer.reports.splice(0..0, file.reports());
            return Err(answer);
        }
    };
    if arguments.smv.is_some() {
        let circuit = model.exact_circuit().map_err(|inexact| {
            let inexact = inexact.told_by(program);
            let message = format!("--smv writes circuits, and the program has none: {inexact}");
            Answer::failed(Status::BadInput, "U0438", message)
        })?;
        let formulas: Vec<Resolved> =
            asked.properties.iter().map(|(_, formula)| formula.clone()).collect();
        let (formulas, fair) = model.assuming(&formulas, &asked.fair);
        let text = smv::of_circuit(circuit, &formulas, &fair);
        let output = arguments.output.as_deref();
        let answer = files::deliver(output, &text, json!({ "text": text }))?;
        return Ok(answer.with_used(file.reports()));
    }
    let go_on = |work| patience.goes_on(work);
    let bounds = bounds(arguments, &go_on);
    patience.turn_to("the states of every output".to_owned());
    let switches = switches(&model, program, bounds);
    if asked.properties.is_empty() {
        asked.properties.extend(standard_property(&model, program, switches.is_empty()));
    }
    let mut proved = prove(&model, &program.name, asked, bounds, patience);
    proved.switched(model.circuit(), &switches);
    Ok(answer::of_programs(vec![proved], None, None, used(arguments, patience))
        .with_used(file.reports())
        .and_next(&[&"init", &"cell", &"--from", &arguments.file]))
}

/// Proves the standard properties of a program of a cluster.
pub(super) fn standard(program: &Program, bounds: Bounds<'_>) -> Result<ProgramAnswer, Answer> {
    let model =
        Model::of_program(program, &Asked::default()).map_err(|error| unsupported(&error))?;
    let mut proved = ProgramAnswer::of_numbers(&program.name, &model);
    let switches = switches(&model, program, bounds);
    proved.switched(model.circuit(), &switches);
    if let Some((property, formula)) = standard_property(&model, program, switches.is_empty()) {
        let answers = model.check(std::slice::from_ref(&formula), &[], bounds, &mut || {});
        let findings = answers
            .into_iter()
            .map(|proof| Finding::of_numbers(model.circuit(), &property, &formula, proof));
        proved.properties.extend(findings);
    }
    Ok(proved)
}

/// Proves properties of the programs of a cluster together: signals arrive a cycle later, and each one may be lost.
pub(super) fn of_cluster(
    arguments: &Arguments,
    cluster: &Cluster,
    bounds: Bounds<'_>,
    patience: &Patience<'_>,
) -> Result<(ProgramAnswer, Option<Result<Scenario, String>>), Answer> {
    patience.turn_to("the programs together".to_owned());
    let period = cluster.agreement().schedule.period();
    let texts = Texts::read(arguments, period)?;
    let members = members(cluster);
    let model = Model::of_cluster(cluster.name(), &members, &texts.asked())
        .map_err(|error| unsupported(&error))?;
    let wrong = |assumed: &Property| model.wrong_assumption(assumed);
    let asked = texts.resolved(&|property| model.resolve(property), &wrong)?;
    let name = "all programs together";
    let properties: Vec<Property> =
        asked.properties.iter().map(|(property, _)| property.clone()).collect();
    let mut proved = prove(&model, name, asked, bounds, patience);
    proved.starts_together = members.len() > 1;
    let mut runs = properties.iter().zip(&proved.properties);
    let scenario = runs.find_map(|(property, finding)| {
        let (run, again_from) = finding.counterexample()?;
        Some(scenario::of_run(cluster, property, run, again_from))
    });
    Ok((proved, scenario))
}

fn prove(
    model: &Model,
    name: &str,
    asked: ToProve,
    bounds: Bounds<'_>,
    patience: &Patience<'_>,
) -> ProgramAnswer {
    let mut proved = ProgramAnswer::of_numbers(name, model);
    let (properties, formulas): (Vec<Property>, Vec<Resolved>) =
        asked.properties.into_iter().unzip();
    let mut answered = 0;
    let count = formulas.len();
    let about = |answered| format!("{answered} of {count} properties answered");
    patience.turn_to(about(0));
    let answers = model.check(&formulas, &asked.fair, bounds, &mut || {
        answered += 1;
        patience.turn_to(about(answered));
    });
    for ((property, formula), proof) in properties.iter().zip(&formulas).zip(answers) {
        let finding = Finding::of_numbers(model.circuit(), property, formula, proof);
        proved.properties.push(finding.of_inputs(model.is_of_inputs(property)));
    }
    proved
}

/// Whether each output can always be switched on and off again, of a Boolean program.
fn switches(model: &Model, program: &Program, bounds: Bounds<'_>) -> Vec<(Signal, OutputFinding)> {
    let mut points = program.inputs.iter().chain(&program.outputs);
    if points.any(|point| point.of != Elementary::Bool) {
        return Vec::new();
    }
    model.switches(bounds)
}

/// The standard property, of a program that can stop, and where nothing else is proved.
fn standard_property(
    model: &Model,
    program: &Program,
    is_alone: bool,
) -> Option<(Property, Resolved)> {
    if !is_alone && program.outputs.find(Program::FAULT).is_none() {
        return None;
    }
    let property = read_one(STANDARD, Duration::ZERO).ok()?;
    let formula = model.resolve(&property).ok()?;
    Some((property, formula))
}

/// The programs of a cluster with the sources of their inputs.
fn members(cluster: &Cluster) -> Vec<Member<'_>> {
    let controllers = cluster.controllers().iter().zip(cluster.remote_ios());
    let members = controllers.map(|(controller, remote_io)| {
        let points = controller.interface.inputs.iter();
        let points = points.filter(|point| point.slot != 0);
        let sources = points.map(|point| {
            let source = remote_io.inputs.iter().find(|input| input.name == point.name);
            match source.map(|input| &input.kind) {
                Some(InputSourceKind::Operator(declaration)) => match declaration.limits() {
                    Some((low, high)) => Source::Any(Some(low..=high)),
                    None => Source::declared(point),
                },
                Some(InputSourceKind::Signal(declaration)) => Source::Signal {
                    program: declaration.input.from.index(),
                    output: declaration.output.clone(),
                    default: declaration.input.default,
                    stale_after: declaration.input.stale_after,
                },
                None => match signal_of_valid(remote_io, point) {
                    Some(of) => Source::Valid { of },
                    None => Source::declared(point),
                },
            }
        });
        let (name, program) = (controller.name.clone(), controller.code.typed().as_ref());
        Member { name, program, sources: sources.collect() }
    });
    members.collect()
}

/// The signal that an input says to be valid.
fn signal_of_valid(remote_io: &RemoteIo, point: &Point) -> Option<String> {
    let mut inputs = remote_io.inputs.iter();
    let found = inputs.find(|input| {
        let valid = input.signal().and_then(|signal| signal.input.valid);
        valid.map(u32::from) == Some(point.bit)
    });
    Some(found?.name.clone())
}

fn unsupported(error: &Inexact) -> Answer {
    Answer::failed(Status::Failed, error.code_or("U0447"), error)
}
