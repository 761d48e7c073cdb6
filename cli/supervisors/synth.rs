//! `understudy synth`: supervisor synthesis.

use std::path::PathBuf;
use std::time::Duration;

use clap::{Args, ValueEnum};
use serde_json::{Value, json};
use understudy_supervisor::operations::{minstate, sync};
use understudy_supervisor::{
    Automaton, Bounds, Finding, Model, SymbolicBounds, Together, empty_finding, model_findings,
    modular_findings, specification_findings, synthesis_findings, synthesise, synthesise_modularly,
    synthesise_symbolically,
};
use understudy_text::{Severity, duration};

use crate::answer::{Answer, Failure, Status};
use crate::console::Console;
use crate::supervisors::automata::{self, Sources, description, summary};
use crate::supervisors::reduction;

/// Synthesise the least restrictive supervisor of a model
#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  understudy synth examples/small-factory/model.toml --reduce -o supervisor.toml
  understudy supervisor-to-ladder supervisor.toml --plant supervisor.toml
  understudy synth examples/boiler/complete.toml --engine specified -o supervisors.toml
  understudy supervisor-to-ladder supervisors.toml --io examples/boiler/complete-map.toml --plant examples/boiler/complete.toml -o complete.ladder

The supervisor is nonblocking. Specifications restrict only the events of their alphabets. Errors of a model are reported with the shortest
sequence of events that shows them. The symbolic engine counts and decides without listing states. The modular engine synthesises one
supervisor for each specification and reports conflicts. The engine `specified` takes the specifications themselves as supervisors.")]
pub(crate) struct Arguments {
    /// Model of plants and specifications: .toml, or a module of Supremica (.wmod)
    #[arg(value_name = "MODEL")]
    model: PathBuf,
    /// Method of synthesis
    #[arg(long, value_enum, default_value = "explicit")]
    engine: Engine,
    /// Reduce each supervisor: fewer states with the same effect on the plant
    #[arg(long)]
    reduce: bool,
    /// Time limit to reduce a supervisor: the smallest so far is the result
    #[arg(long, value_name = "TIME", default_value = reduction::BUDGET, value_parser = duration::parse)]
    budget: Duration,
    /// Minimise each supervisor: merge equivalent states
    #[arg(long, conflicts_with = "reduce")]
    minstate: bool,
    /// Name of the supervisor, or prefix of the names of several; default: SUPER
    #[arg(long, value_name = "NAME")]
    name: Option<String>,
    /// Output file: .toml or .wmod for the model with its supervisors; .ADS, .gen, .dot or .svg for a single supervisor
    #[arg(long, short, value_name = "FILE")]
    output: Option<PathBuf>,
    /// Memory limit of a product
    #[arg(long, value_name = "MEGABYTES", default_value_t = 2000)]
    memory: usize,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Engine {
    /// Enumerate states
    Explicit,
    /// Represent sets of states by decision diagrams
    Symbolic,
    /// Synthesise one supervisor for each specification
    Modular,
    /// Use the specifications themselves, if they are supervisors
    Specified,
}

pub(crate) fn run(arguments: &Arguments, console: &mut Console) -> Result<Answer, Answer> {
    let Sources { read: model, reports, .. } = automata::model(&arguments.model)?;
    let findings = model_findings(&model);
    let answer = if findings.iter().any(|finding| finding.severity == Severity::Error) {
        with_findings(Answer::done("", json!({})), &findings, Status::BadInput)
    } else {
        made(arguments, model, console).into()
    };
    let answer = answer.with_reports(reports);
    Ok(match &arguments.output {
        Some(path) if automata::is_model(path) => {
            answer.and_next(&[&"supervisor-to-ladder", path, &"--plant", path])
        }
        Some(_) => answer,
        None => {
            let model = &arguments.model;
            answer.and_next(&[&"synth", model, &"--reduce", &"-o", &"supervisor.toml"])
        }
    })
}

fn made(arguments: &Arguments, model: Model, console: &mut Console) -> Result<Answer, Answer> {
    let bounds = Bounds { memory_bytes: arguments.memory.saturating_mul(1_000_000) };
    match arguments.engine {
        Engine::Explicit => explicit(arguments, model, bounds, console),
        Engine::Specified => specified(arguments, model, bounds),
        Engine::Symbolic => symbolic(arguments, &model, bounds, console),
        Engine::Modular => modular(arguments, model, bounds, console),
    }
}

fn explicit(
    arguments: &Arguments,
    model: Model,
    bounds: Bounds,
    console: &mut Console,
) -> Result<Answer, Answer> {
    let result = synthesise(&model.plants(), &model.specifications(), bounds)?;
    let findings = synthesis_findings(&model, &result);
    let (supervisor, warning) =
        reduced(arguments, &model.plants(), result.supervisor, bounds, console)?;
    let supervisor = named(arguments, supervisor);
    let mut value = description(&supervisor);
    value["engine"] = json!("explicit");
    value["explored_states"] = json!(result.explored_states);
    let answer = Answer::done(warning + &summary(&supervisor), value);
    written(arguments, model, vec![supervisor], with_findings(answer, &findings, Status::Failed))
}

fn specified(arguments: &Arguments, model: Model, bounds: Bounds) -> Result<Answer, Answer> {
    if arguments.reduce || arguments.minstate {
        let message = "the engine `specified` does not modify the specifications".to_owned();
        return Err(Answer::failed(Status::BadInput, "U0655", message));
    }
    let result = synthesise(&model.plants(), &model.specifications(), bounds)?;
    let mut findings = synthesis_findings(&model, &result);
    findings.extend(specification_findings(&result));
    let mut value = description(&result.supervisor);
    value["engine"] = json!("specified");
    let mut lines = vec![summary(&result.supervisor)];
    if findings.iter().any(|finding| finding.severity == Severity::Error) {
        let answer = Answer::done(lines.join("\n"), value);
        return Ok(with_findings(answer, &findings, Status::Failed));
    }
    let supervisors = model.specifications.clone();
    lines.extend(supervisors.iter().map(summary));
    value["supervisors"] = supervisors.iter().map(description).collect();
    let answer = Answer::done(lines.join("\n"), value);
    let answer = with_findings(answer, &findings, Status::Failed);
    written(arguments, model, supervisors, answer)
}

fn modular(
    arguments: &Arguments,
    model: Model,
    bounds: Bounds,
    console: &mut Console,
) -> Result<Answer, Answer> {
    let result = synthesise_modularly(&model.plants(), &model.specifications(), bounds)?;
    let findings = modular_findings(&model, &result);
    let mut supervisors = Vec::new();
    let mut values = Vec::new();
    let mut warnings = String::new();
    for local in &result.local {
        let specification = local.specification.map(|number| model.specifications[number].name());
        let plants: Vec<&Automaton> =
            local.plants.iter().map(|&plant| &model.plants[plant]).collect();
        let name = arguments.name.as_deref().unwrap_or("SUPER");
        let name = format!("{name}_{}", specification.unwrap_or(plants[0].name()));
        let (supervisor, warning) =
            reduced(arguments, &plants, local.result.supervisor.clone(), bounds, console)?;
        let supervisor = supervisor.with_name(name);
        warnings.push_str(&warning);
        let mut value = description(&supervisor);
        value["specification"] = json!(specification);
        value["plants"] = json!(plants.iter().map(|plant| plant.name()).collect::<Vec<_>>());
        values.push(value);
        supervisors.push(supervisor);
    }
    let together = match result.together {
        Together::Nonconflicting => "nonconflicting",
        Together::Conflicting(_) | Together::ConflictingSomewhere => "conflicting",
        Together::Undecided => "undecided",
    };
    let lines: Vec<String> = supervisors.iter().map(summary).collect();
    let text = format!("{warnings}{}\ntogether: {together}", lines.join("\n"));
    let value = json!({ "engine": "modular", "supervisors": values, "together": together });
    let answer = with_findings(Answer::done(text, value), &findings, Status::Failed);
    written(arguments, model, supervisors, answer)
}

fn symbolic(
    arguments: &Arguments,
    model: &Model,
    bounds: Bounds,
    console: &mut Console,
) -> Result<Answer, Answer> {
    let (plants, specifications) = (model.plants(), model.specifications());
    let made = synthesise_symbolically(&plants, &specifications, SymbolicBounds::default())?;
    let transitions = made.transition_count()?;
    let count = |count: Option<u128>| count.map_or("more than 2^128".to_owned(), |n| n.to_string());
    // Counts that a double would round are strings in JSON.
    let number = |value: Option<u128>| match value.map(u64::try_from) {
        Some(Ok(small)) if small < 1 << 53 => json!(small),
        _ => json!(count(value)),
    };
    let states = made.state_count();
    let value = json!({
        "engine": "symbolic",
        "states": number(states),
        "transitions": number(transitions),
        "nodes": made.node_count(),
    });
    let text = format!(
        "SUPER: {} states, {} transitions, in {} nodes of a decision diagram",
        count(states),
        count(transitions),
        made.node_count()
    );
    let mut answer = Answer::done(text, value);
    let why = made.explanation(plants.len())?;
    if let Some(why) = &why {
        answer = with_findings(answer, &[empty_finding(model, why)], Status::Failed);
    }
    if arguments.output.is_none() && !arguments.reduce && !arguments.minstate {
        return Ok(answer);
    }
    let listed = made.to_automaton(bounds)?;
    let (supervisor, warning) = reduced(arguments, &plants, listed, bounds, console)?;
    let supervisor = named(arguments, supervisor);
    let mut value = description(&supervisor);
    value["engine"] = json!("symbolic");
    answer.text = format!("{warning}{}\n{}", answer.text, summary(&supervisor));
    answer.result = value;
    written(arguments, model.clone(), vec![supervisor], answer)
}

/// Renames the supervisor as requested.
fn named(arguments: &Arguments, supervisor: Automaton) -> Automaton {
    match &arguments.name {
        Some(name) => supervisor.with_name(name.clone()),
        None => supervisor,
    }
}

/// Reduces the supervisor as requested, with what there is to say about that.
fn reduced(
    arguments: &Arguments,
    plants: &[&Automaton],
    supervisor: Automaton,
    bounds: Bounds,
    console: &mut Console,
) -> Result<(Automaton, String), Answer> {
    if arguments.minstate {
        return Ok((minstate(&supervisor), String::new()));
    }
    if !arguments.reduce {
        return Ok((supervisor, String::new()));
    }
    let plant = sync(plants, bounds)?;
    let reduced = reduction::reduced(&plant, &supervisor, bounds, arguments.budget, console)?;
    let notes = reduced.notes();
    Ok((reduced.supervisor, notes))
}

/// Adds errors as failures and warnings in front of the text.
fn with_findings(mut answer: Answer, findings: &[Finding], status: Status) -> Answer {
    let mut warnings = String::new();
    for finding in findings {
        match finding.severity {
            Severity::Warning => {
                warnings.push_str(&format!("warning[{}]: {}\n", finding.code, finding.message));
            }
            Severity::Error => {
                answer.status = status;
                answer.failures.push(Failure {
                    code: finding.code.to_owned(),
                    message: finding.message.clone(),
                });
            }
        }
    }
    answer.text.insert_str(0, &warnings);
    let listed = findings.iter().map(|finding| {
        json!({ "code": finding.code, "severity": finding.severity, "message": finding.message })
    });
    answer.result["findings"] = Value::Array(listed.collect());
    answer
}

fn written(
    arguments: &Arguments,
    model: Model,
    supervisors: Vec<Automaton>,
    answer: Answer,
) -> Result<Answer, Answer> {
    let Some(path) = &arguments.output else {
        return Ok(answer);
    };
    match supervisors.as_slice() {
        _ if automata::is_model(path) => {
            let model = Model { supervisors, ..model };
            automata::write_whole(path, &model)?;
        }
        [only] => automata::write(path, only)?,
        _ => {
            let message = format!(
                "{}: {} supervisors require a .toml or .wmod file",
                path.display(),
                supervisors.len()
            );
            return Err(Answer::failed(Status::BadInput, "U0654", message));
        }
    }
    Ok(answer.and_written(path))
}
