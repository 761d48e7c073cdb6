//! `understudy des`: the operations of TCT.

mod answers;

use std::path::{Path, PathBuf};
use std::time::Duration;

use clap::{Args, Subcommand};
use serde_json::{Value, json};
use understudy_supervisor::ladder::avalanche_events;
use understudy_supervisor::operations::{
    allevents, meet, minstate, mutex, observer, selfloop, sync, trim,
};
use understudy_supervisor::{Automaton, AutomatonError, Bounds, Event, Label, State, TooLarge};

use understudy_text::duration;

use crate::answer::{Answer, Status};
use crate::console::Console;
use crate::supervisors::automata::{self, Sources, description, summary};
use crate::supervisors::reduction::BUDGET;
use answers::{check, compare, conflict, control_data, projected, reduce, supervisor};

/// Apply the operations of TCT to automata
#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  understudy des sync examples/agv/AGV1.ADS examples/agv/AGV2.ADS -o PLANT.ADS
  understudy des supcon PLANT.ADS examples/agv/Z1SPEC.ADS --lift -o SUPER.ADS
  understudy des condat PLANT.ADS SUPER.ADS --json

Files are automata of TCT (.ADS), of libFAUDES (.gen), or models: .toml, and modules of Supremica (.wmod). Results are written as .ADS,
.toml, .wmod, .gen, .dot or .svg, by the ending of the output file. Events of .gen and .wmod files are the same where their names are, those
of the others where their labels are. supcon uses the meet with the specification: without --lift, events outside of its alphabet are forbidden. supreduce ends after its --budget, or at Ctrl-C,
with the smallest supervisor found.")]
pub(crate) struct Arguments {
    #[command(subcommand)]
    operation: Operation,
    /// Output file for the resulting automaton: .ADS, .toml, .wmod, .gen, .dot or .svg
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
    /// Natural projection that hides events, and its properties
    #[command(
        after_help = "Example:\n  understudy des project examples/agv/AGV1.ADS --hide 10 -o projected.ADS"
    )]
    Project {
        /// Automaton
        file: PathBuf,
        /// Names or labels of the hidden events
        #[arg(long, value_name = "EVENT", value_delimiter = ',', required = true)]
        hide: Vec<String>,
    },
    /// Observer: where an automaton can be after what was seen
    #[command(
        after_help = "Example:\n  understudy des observer examples/agv/AGV1.ADS --hide 10 -o observer.svg"
    )]
    Observer {
        /// Automaton
        file: PathBuf,
        /// Names or labels of the unobservable events, in addition to those that a .gen or .wmod file declares unobservable
        #[arg(long, value_name = "EVENT", value_delimiter = ',')]
        hide: Vec<String>,
    },
    /// Convert an automaton, or a whole model between .toml and .wmod
    #[command(
        after_help = "Example:\n  understudy des convert examples/agv/AGV1.ADS -o vehicle.svg\n  understudy des convert examples/small-factory/model.toml -o factory.wmod"
    )]
    #[command(visible_alias = "create")]
    Convert {
        /// Automaton or model
        file: PathBuf,
    },
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
    if let (Operation::Convert { file }, Some(output)) = (&arguments.operation, &arguments.output)
        && automata::is_model(file)
        && automata::is_model(output)
    {
        return whole(file, output);
    }
    let files = arguments.operation.files();
    let sources = match arguments.operation {
        Operation::Check { .. }
        | Operation::Sync { .. }
        | Operation::Meet { .. }
        | Operation::Nonconflict { .. } => automata::all(&files),
        _ => automata::one_each(&files),
    };
    let Sources { read, reports, unobservable } = sources?;
    let parts: Vec<&Automaton> = read.iter().collect();
    let answer = match arguments.operation.answer(&parts, &unobservable, bounds, console) {
        Ok(Outcome::Answer(answer)) => answer,
        Ok(Outcome::Automaton(automaton, answer)) => made(arguments, &automaton, answer).into(),
        Err(error) => Answer::failed(Status::Failed, error.code(), error),
    };
    Ok(answer.with_reports(reports))
}

/// Writes a model in another format.
fn whole(file: &Path, output: &Path) -> Result<Answer, Answer> {
    let Sources { read: model, reports, .. } = automata::model(file)?;
    let roles = [&model.plants, &model.specifications, &model.supervisors];
    let all: Vec<&Automaton> = roles.into_iter().flatten().collect();
    let text = all.iter().map(|one| summary(one)).collect::<Vec<_>>().join("\n");
    let result = json!({ "automata": all.into_iter().map(description).collect::<Vec<_>>() });
    automata::write_whole(output, &model)?;
    Ok(Answer::done(text, result).and_written(output).with_reports(reports))
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
            | Self::Observer { file, .. }
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
        unobservable: &[Label],
        bounds: Bounds,
        console: &mut Console,
    ) -> Result<Outcome, TooLarge> {
        let wrong = |error: AutomatonError| {
            Outcome::Answer(Answer::failed(Status::BadInput, error.code(), error))
        };
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
                let labels = events.iter().map(|&number| Label::new(number));
                let events: Vec<Event> = labels.map(Event::unnamed).collect();
                match selfloop(parts[0], &events) {
                    Ok(looped) => Outcome::of(looped),
                    Err(error) => {
                        Outcome::Answer(Answer::failed(Status::BadInput, error.code(), error))
                    }
                }
            }
            Self::Mutex { exclude, .. } => match no_such_state(parts, exclude) {
                Some(error) => wrong(error),
                None => Outcome::of(mutex(parts[0], parts[1], exclude, bounds)?),
            },
            Self::Nonconflict { .. } => Outcome::Answer(conflict(parts, bounds)?),
            Self::Project { hide, .. } => match labels(parts[0], hide) {
                Ok(hidden) => projected(parts[0], &hidden, bounds)?,
                Err(error) => wrong(error),
            },
            Self::Observer { hide, .. } => match labels(parts[0], hide) {
                Ok(mut hidden) => {
                    hidden.extend(unobservable);
                    Outcome::of(observer(parts[0], &hidden, bounds)?)
                }
                Err(error) => wrong(error),
            },
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

/// The events of these names or labels.
fn labels(automaton: &Automaton, events: &[String]) -> Result<Vec<Label>, AutomatonError> {
    events.iter().map(|event| automaton.event(event)).collect()
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
