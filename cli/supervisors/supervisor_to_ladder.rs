//! `understudy supervisor-to-ladder`: a proved ladder program of a supervisor.

use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};
use serde_json::{Value, json};
use understudy_ladder::print;
use understudy_supervisor::ladder::{
    Conversion, InputOutputMap, Located, Mode, Modules, OneEvent, convert, read_map, table,
};
use understudy_supervisor::proof::{
    Counterexample, Deviation, Finding, FindingSeverity, ProofSettings, Proving, Verdict, findings,
    prove_with_progress,
};
use understudy_supervisor::{Alphabet, Automaton, Label, Model, Signal};
use understudy_text::{Diagnostic, Report};

use crate::answer::{Answer, Status};
use crate::console::Console;
use crate::files;
use crate::patience::Patience;
use crate::supervisors::automata::{self, Sources};

/// Convert a supervisor to a proved ladder program
#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  understudy supervisor-to-ladder examples/motivating-example/supervisor.ADS --io examples/motivating-example/map.toml --mode manual -o motivating.ladder
  understudy supervisor-to-ladder examples/avalanche/figure-7.toml --one-event queue --priority d,f

The supervisor is a TCT automaton (.ADS), a generator (.gen) or a model (.toml, .wmod) with supervisors. A reduced supervisor does not track the state of its plant;
supply the plants by --plant. Findings about the supervisor are warnings, unless no ladder program can implement it. The ladder is written
only if it is proved to do what the supervisor allows and nothing else, and no finding is an error.")]
pub(crate) struct Arguments {
    /// Supervisor: a TCT automaton (.ADS), a generator (.gen) or a model (.toml, .wmod)
    #[arg(value_name = "SUPERVISOR")]
    supervisor: PathBuf,
    /// Signal map from events to signals, overrides the model; an event without an entry gets a signal of its own that is 1 for
    /// one scan
    #[arg(long, value_name = "MAP.toml")]
    io: Option<PathBuf>,
    /// Selection among enabled commands
    #[arg(long, value_enum, default_value = "automatic")]
    mode: ModeWord,
    /// Process at most one event in a scan
    #[arg(long, value_enum, value_name = "HOW")]
    one_event: Option<OneEventWord>,
    /// Events that have their turn first, in this order; the others follow by label
    #[arg(long, value_name = "EVENT", value_delimiter = ',')]
    priority: Vec<String>,
    /// Plants that the ladder tracks in addition to the supervisor
    #[arg(long = "plant", value_name = "FILE", num_args = 1..)]
    plants: Vec<PathBuf>,
    /// Output file; default: standard output
    #[arg(long, short, value_name = "FILE.ladder")]
    output: Option<PathBuf>,
    /// Print the rows of the function Omega instead of the ladder
    #[arg(long)]
    table: bool,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum ModeWord {
    /// By the PLC
    Automatic,
    /// By the operator, if several are enabled
    Manual,
    /// By the operator, always
    Requested,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum OneEventWord {
    /// Events wait for their turn; a counter has those that come again while they wait
    Queue,
    /// The inputs bring at most one event in a scan, and no rung checks it
    Assume,
}

impl From<ModeWord> for Mode {
    fn from(word: ModeWord) -> Self {
        match word {
            ModeWord::Automatic => Self::Automatic,
            ModeWord::Manual => Self::Manual,
            ModeWord::Requested => Self::Requested,
        }
    }
}

pub(crate) fn run(arguments: &Arguments, console: &mut Console) -> Result<Answer, Answer> {
    let mut sources = Vec::new();
    for path in [&arguments.supervisor].into_iter().chain(&arguments.plants) {
        sources.push((path.as_path(), source(path)?));
    }
    let automata = sources.iter_mut().map(|(path, Source { model, .. })| {
        (*path, model.plants.iter_mut().chain(&mut model.supervisors))
    });
    automata::agree(&Alphabet::default(), automata)?;
    let mut sources = sources.into_iter();
    let Some((_, supervisor)) = sources.next() else {
        return Ok(Answer::done("", json!({})));
    };
    let mut plants = Vec::new();
    let mut signals = supervisor.model.signals.clone();
    for (path, Source { model: plant, .. }) in sources {
        signals.extend(plant.signals.into_iter().map(Signal::without_place));
        plants.extend(some(path, plant.plants, "plant")?);
    }
    let supervisors =
        some(&arguments.supervisor, supervisor.model.supervisors.clone(), "supervisor")?;
    let (mut map, report) = read_signals(arguments, &supervisors, &plants, supervisor, signals)?;
    map.one_event = one_event(arguments)?;
    let map = map;
    let name = |automata: Vec<Automaton>| -> Vec<Automaton> {
        automata.into_iter().map(|automaton| map.name_events(automaton)).collect()
    };
    let (supervisors, plants) = (name(supervisors), name(plants));
    let modules = Modules { supervisors: &supervisors, plants: &plants };
    let mode = Mode::from(arguments.mode);
    let conversion = convert(&modules, &map, mode)
        .map_err(|diagnostics| bad_map(report.clone(), diagnostics))?;
    let found = findings(&modules, Some(&map))?;
    let settings = ProofSettings { mode, ..ProofSettings::default() };
    let patience = Patience::new(None, console);
    let mut report = |at: Proving| {
        patience.goes_on_with(format_args!(
            "proof of {} states so far, {} of them scanned with every input",
            at.reached, at.scanned
        ));
    };
    let verdict = prove_with_progress(
        &conversion.program,
        &modules,
        &map,
        &conversion.correspondence,
        settings,
        &mut report,
    )?;
    let is_written = matches!(verdict, Verdict::Proved(_)) && !has_error(&found);
    if arguments.output.is_none() && is_written {
        // The answer is the ladder alone.
        notes(&found).lines().for_each(|line| console.note(line));
    }
    Ok(answer(arguments, &modules, &conversion, &found, verdict))
}

fn one_event(arguments: &Arguments) -> Result<Option<OneEvent>, Answer> {
    let order = arguments.priority.iter().map(|event| event.as_str().into()).collect();
    match arguments.one_event {
        Some(OneEventWord::Queue) => Ok(Some(OneEvent::Queued(order))),
        _ if !arguments.priority.is_empty() => {
            let message = "--priority is the order of events that wait; add `--one-event queue`";
            Err(Answer::failed(Status::BadInput, "U0600", message))
        }
        Some(OneEventWord::Assume) => Ok(Some(OneEvent::Assumed)),
        None => Ok(None),
    }
}

/// An input file: a model, or a TCT automaton in each of its roles.
struct Source {
    model: Model,
    report: Report,
}

fn source(path: &Path) -> Result<Source, Answer> {
    if automata::is_model(path) {
        let Sources { read, mut reports, .. } = automata::model(path)?;
        return Ok(Source { model: read, report: reports.swap_remove(0) });
    }
    let Sources { read, mut reports, .. } = automata::all(&[&path.to_owned()])?;
    Ok(Source {
        model: Model { plants: read.clone(), supervisors: read, ..Model::default() },
        report: reports.swap_remove(0),
    })
}

fn some(path: &Path, automata: Vec<Automaton>, what: &str) -> Result<Vec<Automaton>, Answer> {
    if automata.is_empty() {
        let path = path.display();
        let message = format!("{path} has no {what}; `understudy synth` creates supervisors");
        return Err(Answer::failed(Status::BadInput, "U0651", message));
    }
    Ok(automata)
}

/// Signal map of the map file and the models, with the file of its positions.
fn read_signals(
    arguments: &Arguments,
    supervisors: &[Automaton],
    plants: &[Automaton],
    supervisor: Source,
    signals: Vec<Signal>,
) -> Result<(InputOutputMap, Report), Answer> {
    let modules = Modules { supervisors, plants };
    let alphabet = modules.alphabet();
    let addresses = supervisor.model.addresses;
    let Some(path) = &arguments.io else {
        let program = arguments.supervisor.file_stem().unwrap_or_default();
        let mut map = InputOutputMap::of_signals(&program.to_string_lossy(), &alphabet, &signals);
        map.addresses = addresses;
        return Ok((map, supervisor.report));
    };
    let text = files::text(path)?;
    let read = read_map(&text);
    let report = Report { name: path.display().to_string(), text, diagnostics: read.diagnostics };
    let Some(map) = read.map else {
        return Err(Answer::bad_files(vec![report]));
    };
    // Positions in the model do not belong to the map file.
    let signals: Vec<Signal> = signals.into_iter().map(Signal::without_place).collect();
    let located: Vec<Located> = addresses.into_iter().map(Located::without_place).collect();
    let map = map.with_signals(&signals, &alphabet);
    Ok((map.with_addresses(&located), report))
}

fn bad_map(mut report: Report, diagnostics: Vec<Diagnostic>) -> Answer {
    report.diagnostics.extend(diagnostics);
    report.diagnostics.sort_by_key(|diagnostic| diagnostic.span.start);
    Answer::bad_files(vec![report])
}

fn severity(finding: &Finding) -> &'static str {
    match finding.severity {
        FindingSeverity::Warning => "warning",
        FindingSeverity::Error => "error",
    }
}

/// Findings as text, one line each.
pub(crate) fn notes(found: &[Finding]) -> String {
    let lines = found.iter().map(|finding| {
        let (code, message) = (finding.code(), &finding.message);
        format!("{}[{code}]: {message}\n", severity(finding))
    });
    lines.collect()
}

/// Findings as JSON.
pub(crate) fn listed(found: &[Finding]) -> Value {
    let numbers = |labels: &[Label]| labels.iter().map(|label| label.number()).collect::<Vec<_>>();
    let listed = found.iter().map(|finding| {
        json!({
            "code": finding.code(),
            "severity": severity(finding),
            "message": finding.message,
            "states": finding.states.iter().map(|state| state.number()).collect::<Vec<_>>(),
            "events": numbers(&finding.events),
            "run": numbers(&finding.run),
        })
    });
    listed.collect()
}

/// Whether a finding is an error.
pub(crate) fn has_error(found: &[Finding]) -> bool {
    found.iter().any(|finding| finding.severity == FindingSeverity::Error)
}

/// Answer with findings that are errors: each is a failure, and the ladder is withheld.
pub(crate) fn withheld(found: &[Finding], result: &Value) -> Option<Answer> {
    let (errors, warnings): (Vec<&Finding>, Vec<&Finding>) =
        found.iter().partition(|finding| finding.severity == FindingSeverity::Error);
    if errors.is_empty() {
        return None;
    }
    let warnings: Vec<Finding> = warnings.into_iter().cloned().collect();
    let answer = Answer::done(notes(&warnings), result);
    Some(errors.into_iter().fold(answer, |answer, finding| {
        let message = format!("{}; the ladder is not written", finding.message);
        answer.and_failure(Status::Failed, finding.code(), message)
    }))
}

/// Whether a run ends in a scan with several events that it does not process as an order of them would.
fn has_two_events(counterexample: &Counterexample) -> bool {
    counterexample.deviation == Deviation::NotAllowed && counterexample.last.events.len() > 1
}

fn answer(
    arguments: &Arguments,
    modules: &Modules,
    conversion: &Conversion,
    found: &[Finding],
    verdict: Verdict,
) -> Answer {
    let program = &conversion.program;
    let notes = notes(found);
    let mut result = json!({
        "program": program.name.as_str(),
        "rungs": program.rungs.len(),
        "inputs": program.inputs.len(),
        "outputs": program.outputs.len(),
        "memory": program.memory.len(),
        "consumed": conversion.consumed.iter().map(|label| label.number()).collect::<Vec<_>>(),
        "findings": listed(found),
    });
    let proof = match verdict {
        Verdict::Proved(proof) => proof,
        Verdict::Refuted(counterexample) => {
            result["counterexample"] = Value::String(counterexample.to_string());
            let mut message = format!("the ladder violates the supervisor:\n{counterexample}");
            if arguments.one_event.is_none() && has_two_events(&counterexample) {
                message.push_str("no order of the rungs serves two events in one scan in every state; `--one-event queue` processes one in a scan");
            }
            return Answer::done(notes, result).and_failure(Status::Failed, "U0875", message);
        }
    };
    result["proof"] = json!({
        "states": proof.states,
        "scans": proof.scans,
        "joint_states": proof.joint_states,
        "events": proof.events.len(),
    });
    if let Some(answer) = withheld(found, &result) {
        return answer;
    }
    let ladder = print(program);
    let text = if arguments.table {
        let tables = modules.all().zip(&conversion.rows);
        tables.map(|(automaton, rows)| table(automaton, rows)).collect::<Vec<_>>().join("\n")
    } else {
        ladder.clone()
    };
    result["ladder"] = Value::String(ladder.clone());
    let Some(path) = &arguments.output else {
        return Answer::done(text, result);
    };
    if let Err(answer) = files::write(path, &ladder) {
        return answer;
    }
    let summary = format!(
        "{notes}{} rungs written to {}; proved over {} states in {} scans",
        program.rungs.len(),
        path.display(),
        proof.states,
        proof.scans
    );
    Answer::done(summary, result).and_next(&[&"verify", path])
}
