//! `understudy des`: the operations of TCT.

use std::path::PathBuf;
use std::time::Duration;

use clap::{Args, Subcommand};
use serde_json::{Value, json};
use understudy_supervisor::ladder::avalanche_events;
use understudy_supervisor::operations::{
    ControlData, Difference, allevents, condat, isomorph, lift, meet, minstate, mutex, nonconflict,
    project, reachable, selfloop, supcon, sync, trim,
};
use understudy_supervisor::{
    Automaton, AutomatonError, Bounds, Event, Label, Model, State, TooLarge, synthesis_findings,
};

use understudy_text::duration;

use crate::answer::{Answer, Status};
use crate::console::Console;
use crate::supervisors::automata::{self, Sources, description, summary};
use crate::supervisors::reduction::{BUDGET, reduced};

/// Apply the operations of TCT to automata
#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  understudy des sync examples/agv/AGV1.ADS examples/agv/AGV2.ADS -o PLANT.ADS
  understudy des supcon PLANT.ADS examples/agv/Z1SPEC.ADS --lift -o SUPER.ADS
  understudy des condat PLANT.ADS SUPER.ADS --json

Files are TCT automata (.ADS) or models of one automaton (.toml). Results are written as .ADS, .toml, .dot or .svg. supcon uses the meet
with the specification: without --lift, events outside of its alphabet are forbidden. supreduce ends after its --budget, or at Ctrl-C,
with the smallest supervisor found.")]
pub(crate) struct Arguments {
    #[command(subcommand)]
    operation: Operation,
    /// Output file for the resulting automaton: .ADS, .toml, .dot or .svg
    #[arg(long, short, value_name = "FILE", global = true)]
    output: Option<PathBuf>,
    /// Memory limit of a product
    #[arg(long, value_name = "MEGABYTES", default_value_t = 2000, global = true)]
    memory: usize,
}

#[derive(Debug, Subcommand)]
enum Operation {
    /// Check files and describe the automata in them
    #[command(
        after_help = "Example:\n  understudy des check examples/agv/AGV1.ADS examples/agv/AGV2.ADS"
    )]
    Check {
        #[arg(value_name = "FILE", required = true)]
        files: Vec<PathBuf>,
    },
    /// Synchronous product: an automaton ignores events outside of its alphabet
    #[command(
        after_help = "Example:\n  understudy des sync examples/agv/AGV1.ADS examples/agv/AGV2.ADS -o both.ADS"
    )]
    Sync {
        #[arg(value_name = "FILE", required = true)]
        files: Vec<PathBuf>,
    },
    /// Product that forbids events outside of either alphabet
    #[command(
        after_help = "Example:\n  understudy des meet examples/agv/AGV1.ADS examples/agv/AGV2.ADS -o meet.ADS"
    )]
    Meet {
        #[arg(value_name = "FILE", required = true)]
        files: Vec<PathBuf>,
    },
    /// Reachable and coreachable part
    #[command(
        after_help = "Example:\n  understudy des trim examples/agv/Z1SPEC.ADS -o trimmed.ADS"
    )]
    Trim { file: PathBuf },
    /// Supremal controllable and nonblocking supervisor
    #[command(
        after_help = "Example:\n  understudy des supcon examples/agv/AGV1.ADS examples/agv/Z1SPEC.ADS --lift -o supervisor.ADS"
    )]
    Supcon {
        plant: PathBuf,
        specification: PathBuf,
        /// Extend the specification to the alphabet of the plant by self-loops
        #[arg(long)]
        lift: bool,
    },
    /// Controllable events that a supervisor disables in each state
    #[command(
        after_help = "Example:\n  understudy des condat examples/agv/AGV1.ADS examples/agv/AGV1.ADS"
    )]
    Condat { plant: PathBuf, supervisor: PathBuf },
    /// Reduced supervisor with the same effect on the plant
    #[command(
        after_help = "Example:\n  understudy des supreduce examples/agv/AGV1.ADS examples/agv/AGV1.ADS -o reduced.ADS"
    )]
    Supreduce {
        plant: PathBuf,
        supervisor: PathBuf,
        /// Time limit: the smallest supervisor so far is the result
        #[arg(long, value_name = "TIME", default_value = BUDGET, value_parser = duration::parse)]
        budget: Duration,
    },
    /// Minimal automaton with the same languages
    #[command(
        after_help = "Example:\n  understudy des minstate examples/agv/AGV1.ADS -o minimal.ADS"
    )]
    Minstate { file: PathBuf },
    /// Whether two automata are isomorphic
    #[command(
        after_help = "Example:\n  understudy des isomorph examples/agv/AGV1.ADS examples/agv/AGV1.ADS"
    )]
    Isomorph { left: PathBuf, right: PathBuf },
    /// Automaton of one state that allows all events
    #[command(
        after_help = "Example:\n  understudy des allevents examples/agv/AGV1.ADS -o events.ADS"
    )]
    Allevents { file: PathBuf },
    /// Self-loops for events in every state
    #[command(
        after_help = "Example:\n  understudy des selfloop examples/agv/AGV1.ADS --events 90,92 -o loops.ADS"
    )]
    Selfloop {
        file: PathBuf,
        /// Event labels
        #[arg(long, value_name = "LABEL", value_delimiter = ',', required = true)]
        events: Vec<u32>,
    },
    /// Synchronous product without mutually exclusive pairs of states
    #[command(
        after_help = "Example:\n  understudy des mutex examples/agv/AGV1.ADS examples/agv/AGV2.ADS --exclude 1:1,2:2 -o exclusive.ADS"
    )]
    Mutex {
        left: PathBuf,
        right: PathBuf,
        /// Mutually exclusive pairs of states, such as 1:1,2:2
        #[arg(long, value_name = "STATE:STATE", value_delimiter = ',', required = true, value_parser = pair)]
        exclude: Vec<(State, State)>,
    },
    /// Whether automata can always reach marked states together
    #[command(
        after_help = "Example:\n  understudy des nonconflict examples/agv/AGV1.ADS examples/agv/AGV2.ADS"
    )]
    Nonconflict {
        #[arg(value_name = "FILE", required = true)]
        files: Vec<PathBuf>,
    },
    /// Natural projection that hides events
    #[command(
        after_help = "Example:\n  understudy des project examples/agv/AGV1.ADS --hide 10 -o projected.ADS"
    )]
    Project {
        file: PathBuf,
        /// Labels of the hidden events
        #[arg(long, value_name = "LABEL", value_delimiter = ',', required = true)]
        hide: Vec<u32>,
    },
    /// Convert an automaton file to another format
    #[command(
        after_help = "Example:\n  understudy des convert examples/agv/AGV1.ADS -o vehicle.svg"
    )]
    #[command(visible_alias = "create")]
    Convert { file: PathBuf },
    /// Events that cause the avalanche effect in a ladder
    #[command(after_help = "Example:\n  understudy des avalanche examples/avalanche/TEST.ADS")]
    Avalanche { file: PathBuf },
}

fn pair(text: &str) -> Result<(State, State), String> {
    let numbers = text.split_once(':').and_then(|(left, right)| {
        Some((State::new(left.parse().ok()?), State::new(right.parse().ok()?)))
    });
    numbers.ok_or_else(|| "expected a pair of states such as 1:2".to_owned())
}

pub(crate) fn run(arguments: &Arguments, console: &mut Console) -> Result<Answer, Answer> {
    let bounds = Bounds { memory_bytes: arguments.memory.saturating_mul(1_000_000) };
    let files = arguments.operation.files();
    let sources = match arguments.operation {
        Operation::Check { .. } => automata::all(&files),
        _ => automata::one_each(&files),
    };
    let Sources { read, reports } = sources?;
    let parts: Vec<&Automaton> = read.iter().collect();
    let answer = match arguments.operation.answer(&parts, bounds, console) {
        Ok(Outcome::Answer(answer)) => answer,
        Ok(Outcome::Automaton(automaton, answer)) => made(arguments, &automaton, answer).into(),
        Err(error) => Answer::failed(Status::Failed, error.code(), error),
    };
    Ok(answer.with_reports(reports))
}

/// Adds the automaton to the answer, and writes it to the output file if one is given.
fn made(
    arguments: &Arguments,
    automaton: &Automaton,
    mut answer: Answer,
) -> Result<Answer, Answer> {
    answer.text = format!("{}{}", answer.text, summary(automaton));
    let mut result = description(automaton);
    if let (Value::Object(result), Value::Object(more)) = (&mut result, answer.result) {
        result.extend(more);
    }
    answer.result = result;
    let Some(path) = &arguments.output else {
        return Ok(answer);
    };
    automata::write(path, automaton)?;
    Ok(answer.and_written(path))
}

enum Outcome {
    Automaton(Automaton, Answer),
    Answer(Answer),
}

impl Outcome {
    fn of(automaton: Automaton) -> Self {
        Self::Automaton(automaton, Answer::done("", json!({})))
    }
}

impl Operation {
    fn files(&self) -> Vec<&PathBuf> {
        match self {
            Self::Check { files }
            | Self::Sync { files }
            | Self::Meet { files }
            | Self::Nonconflict { files } => files.iter().collect(),
            Self::Trim { file }
            | Self::Minstate { file }
            | Self::Allevents { file }
            | Self::Selfloop { file, .. }
            | Self::Project { file, .. }
            | Self::Convert { file }
            | Self::Avalanche { file } => vec![file],
            Self::Supcon { plant, specification, .. } => vec![plant, specification],
            Self::Condat { plant, supervisor } | Self::Supreduce { plant, supervisor, .. } => {
                vec![plant, supervisor]
            }
            Self::Isomorph { left, right } | Self::Mutex { left, right, .. } => vec![left, right],
        }
    }

    /// Applies the operation. `parts` are the automata of [`Self::files`], in their order.
    fn answer(
        &self,
        parts: &[&Automaton],
        bounds: Bounds,
        console: &mut Console,
    ) -> Result<Outcome, TooLarge> {
        let labels = |numbers: &[u32]| numbers.iter().map(|&number| Label::new(number)).collect();
        Ok(match self {
            Self::Check { .. } => Outcome::Answer(check(parts, bounds)?),
            Self::Sync { .. } => Outcome::of(sync(parts, bounds)?),
            Self::Meet { .. } => Outcome::of(meet(parts, bounds)?),
            Self::Trim { .. } => Outcome::of(trim(parts[0])),
            Self::Supcon { lift, .. } => supervisor(parts[0], parts[1], *lift, bounds)?,
            Self::Condat { .. } => Outcome::Answer(control_data(parts[0], parts[1], bounds)?),
            Self::Supreduce { budget, .. } => reduce(parts[0], parts[1], bounds, *budget, console)?,
            Self::Minstate { .. } => Outcome::of(minstate(parts[0])),
            Self::Isomorph { .. } => Outcome::Answer(compare(parts[0], parts[1])),
            Self::Allevents { .. } => Outcome::of(allevents(parts[0].alphabet())),
            Self::Selfloop { events, .. } => {
                let labels: Vec<Label> = labels(events);
                let events: Vec<Event> = labels.into_iter().map(Event::unnamed).collect();
                match selfloop(parts[0], &events) {
                    Ok(looped) => Outcome::of(looped),
                    Err(error) => {
                        Outcome::Answer(Answer::failed(Status::BadInput, error.code(), error))
                    }
                }
            }
            Self::Mutex { exclude, .. } => match no_such_state(parts, exclude) {
                Some(error) => {
                    Outcome::Answer(Answer::failed(Status::BadInput, error.code(), error))
                }
                None => Outcome::of(mutex(parts[0], parts[1], exclude, bounds)?),
            },
            Self::Nonconflict { .. } => Outcome::Answer(conflict(parts, bounds)?),
            Self::Project { hide, .. } => {
                let hidden: Vec<Label> = labels(hide);
                Outcome::of(project(parts[0], &hidden, bounds)?)
            }
            Self::Convert { .. } => Outcome::of(parts[0].clone()),
            Self::Avalanche { .. } => {
                let events = avalanche_events(parts[0]);
                let all: Vec<Label> = parts[0].alphabet().labels().collect();
                let name = parts[0].name();
                let cause = if events.is_empty() {
                    format!("{name}: no event causes the avalanche effect")
                } else {
                    let names = word(parts[0], &events);
                    format!("{name}: the avalanche effect is caused by {names}")
                };
                let text = format!("{name}: all events are {}\n{cause}", word(parts[0], &all));
                let result = json!({ "events": numbers(&events), "all_events": numbers(&all) });
                Outcome::Answer(Answer::done(text, result))
            }
        })
    }
}

/// First pair with an unknown state.
fn no_such_state(parts: &[&Automaton], pairs: &[(State, State)]) -> Option<AutomatonError> {
    let sides = pairs.iter().flat_map(|&(left, right)| [(left, parts[0]), (right, parts[1])]);
    let mut wrong =
        sides.filter(|(state, part)| !part.is_empty() && state.index() >= part.state_count());
    wrong
        .next()
        .map(|(state, part)| AutomatonError::NoSuchState { state, states: part.state_count() })
}

fn word(automaton: &Automaton, labels: &[Label]) -> String {
    let names: Vec<String> = labels.iter().map(|&label| automaton.alphabet().name(label)).collect();
    names.join(" ")
}

fn numbers(labels: &[Label]) -> Vec<u32> {
    labels.iter().map(|label| label.number()).collect()
}

fn check(parts: &[&Automaton], bounds: Bounds) -> Result<Answer, TooLarge> {
    let mut lines = Vec::new();
    let mut files = Vec::new();
    for part in parts {
        let unreachable = part.state_count() - reachable(part).state_count();
        let blocking = nonconflict(&[part], bounds)?;
        let mut line = summary(part);
        if unreachable > 0 {
            line.push_str(&format!("; {unreachable} unreachable states"));
        }
        if let Some(conflict) = &blocking {
            line.push_str(&format!(
                "; blocks in state {} after \"{}\"",
                part.state_name(conflict.states[0]),
                word(part, &conflict.word)
            ));
        }
        lines.push(line);
        let mut file = description(part);
        file["unreachable"] = json!(unreachable);
        file["nonblocking"] = json!(blocking.is_none());
        files.push(file);
    }
    Ok(Answer::done(lines.join("\n"), json!({ "automata": files })))
}

fn supervisor(
    plant: &Automaton,
    specification: &Automaton,
    lifted: bool,
    bounds: Bounds,
) -> Result<Outcome, TooLarge> {
    let specification =
        if lifted { lift(specification, plant.alphabet()) } else { specification.clone() };
    let result = supcon(plant, &specification, bounds)?;
    let model = Model {
        alphabet: plant.alphabet().union([specification.alphabet()]),
        plants: vec![plant.clone()],
        specifications: vec![specification],
        ..Model::default()
    };
    let findings = synthesis_findings(&model, &result);
    let lines = findings.iter().map(|finding| format!("{}: {}\n", finding.code, finding.message));
    let answer = Answer::done(
        lines.collect::<String>(),
        json!({
            "explored_states": result.explored_states,
            "findings": findings.iter().map(|finding| json!({
                "code": finding.code,
                "severity": finding.severity,
                "message": finding.message,
            })).collect::<Vec<_>>(),
        }),
    );
    // EMPTY is a valid result of an operation.
    Ok(Outcome::Automaton(result.supervisor, answer))
}

fn control_data(
    plant: &Automaton,
    supervisor: &Automaton,
    bounds: Bounds,
) -> Result<Answer, TooLarge> {
    let data = condat(plant, supervisor, bounds)?;
    let rows = data.table.iter();
    let lines = rows.map(|(&state, events)| {
        format!("{}: {}\n", supervisor.state_name(state), word(plant, events))
    });
    let text = format!(
        "{}{} states disable events, {} pairs",
        lines.collect::<String>(),
        data.states_with_disablement(),
        data.pairs()
    );
    let table =
        data.table.iter().map(|(state, events)| (state.to_string(), json!(numbers(events))));
    let result = json!({
        "states_with_disablement": data.states_with_disablement(),
        "pairs": data.pairs(),
        "table": table.collect::<serde_json::Map<_, _>>(),
    });
    Ok(refusing(Answer::done(text, result), plant, supervisor, &data))
}

/// Adds the states in which a supervisor disables uncontrollable events.
fn refusing(
    mut answer: Answer,
    plant: &Automaton,
    supervisor: &Automaton,
    data: &ControlData,
) -> Answer {
    for disabled in &data.uncontrollable {
        let message = format!(
            "in state {} the supervisor disables the uncontrollable event {}: it is not a supervisor of this plant",
            supervisor.state_name(disabled.state),
            plant.alphabet().name(disabled.event)
        );
        answer = answer.and_failure(Status::Failed, "U0846", message);
    }
    answer
}

/// Reduces a supervisor of this plant.
fn reduce(
    plant: &Automaton,
    supervisor: &Automaton,
    bounds: Bounds,
    budget: Duration,
    console: &mut Console,
) -> Result<Outcome, TooLarge> {
    let data = condat(plant, supervisor, bounds)?;
    let answer = refusing(Answer::done("", json!({})), plant, supervisor, &data);
    if !answer.failures.is_empty() {
        return Ok(Outcome::Answer(answer));
    }
    Ok(match reduced(plant, supervisor, bounds, budget, console) {
        Err(answer) => Outcome::Answer(answer),
        Ok(reduced) => {
            let result = json!({
                "is_complete": reduced.warning.is_none(),
                "lower_bound": reduced.lower_bound,
            });
            let answer = Answer::done(reduced.notes(), result);
            Outcome::Automaton(reduced.supervisor, answer)
        }
    })
}

fn compare(left: &Automaton, right: &Automaton) -> Answer {
    let difference = match isomorph(left, right) {
        Ok(states) => {
            let states: Vec<u32> = states.iter().map(|state| state.number()).collect();
            let result = json!({ "isomorphic": true, "states": states });
            return Answer::done("isomorphic", result);
        }
        Err(difference) => difference,
    };
    let said = |word_of: &[Label]| format!("\"{}\"", word(left, word_of));
    let reason = match &difference {
        Difference::StateCounts(one, two) => format!("{one} states and {two} states"),
        Difference::Enabled { word, event } => format!(
            "after {} only one of them allows {}",
            said(word),
            left.alphabet().union([right.alphabet()]).name(*event)
        ),
        Difference::Marked { word } => format!("after {} only one of them is marked", said(word)),
        Difference::Merged { word, other } => {
            format!("{} and {} lead to the same state in only one of them", said(word), said(other))
        }
        Difference::Unreachable { name, reached } => {
            format!(
                "only {reached} states of {name} are reachable; isomorph compares reachable automata"
            )
        }
    };
    let result = json!({ "isomorphic": false, "reason": reason });
    Answer::done(format!("not identical: {reason}"), result).with_status(Status::Failed)
}

fn conflict(parts: &[&Automaton], bounds: Bounds) -> Result<Answer, TooLarge> {
    let Some(conflict) = nonconflict(parts, bounds)? else {
        return Ok(Answer::done("nonconflicting", json!({ "nonconflicting": true })));
    };
    let names = parts[0].alphabet().union(parts[1..].iter().map(|part| part.alphabet()));
    let words: Vec<String> = conflict.word.iter().map(|&label| names.name(label)).collect();
    let states = parts.iter().zip(&conflict.states);
    let states: Vec<String> = states
        .map(|(part, &state)| format!("{} in {}", part.name(), part.state_name(state)))
        .collect();
    let text = format!(
        "conflicting: after \"{}\" not all can reach marked states ({})",
        words.join(" "),
        states.join(", ")
    );
    let result = json!({ "nonconflicting": false, "word": numbers(&conflict.word) });
    Ok(Answer::done(text, result).with_status(Status::Failed))
}
