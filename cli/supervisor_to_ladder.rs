//! `understudy supervisor-to-ladder`: a supervisor as a ladder that is proved to keep it.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};
use serde_json::{Value, json};
use understudy_diagnostic::{Diagnostic, Report};
use understudy_ladder::print;
use understudy_supervisor::ladder::{
    Conversion, InputOutputMap, Mode, Modules, convert, read_map, table,
};
use understudy_supervisor::proof::{
    Finding, FindingSeverity, ProofSettings, Verdict, findings, prove,
};
use understudy_supervisor::{Automaton, read_ads, read_model};

use crate::answer::{Answer, Status};
use crate::files;

/// Turn a supervisor into a ladder, and prove that the ladder does what the supervisor allows and nothing else
#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  understudy supervisor-to-ladder examples/motivating-example/supervisor.ADS \\
      --io examples/motivating-example/map.toml --mode manual -o motivating.ladder

The supervisor is a file of TCT (.ADS) or a model (.toml) with supervisors. A reduced supervisor does not know the state of
its plant; give it its plants with --plant. Findings about the supervisor are warnings, but for those that no ladder can
mend. The ladder is written only when it is proved.")]
pub(crate) struct Arguments {
    /// The supervisor
    #[arg(value_name = "SUPERVISOR")]
    supervisor: PathBuf,
    /// By which signals events are seen and made; without it, each event has a signal of its own that is 1 for one scan
    #[arg(long, value_name = "MAP.toml")]
    io: Option<PathBuf>,
    /// Who chooses among commands
    #[arg(long, value_enum, default_value = "automatic")]
    mode: ModeWord,
    /// Plants that the ladder follows beside the supervisor
    #[arg(long = "plant", value_name = "FILE", num_args = 1..)]
    plants: Vec<PathBuf>,
    /// A file to write to, in place of standard output
    #[arg(long, short, value_name = "FILE.ladder")]
    output: Option<PathBuf>,
    /// Print the rows of the function Omega in place of the ladder
    #[arg(long)]
    table: bool,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum ModeWord {
    /// The PLC
    Automatic,
    /// The operator, where there is a choice
    Manual,
    /// The operator, always
    Requested,
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

pub(crate) fn run(arguments: &Arguments) -> Answer {
    match convert_and_prove(arguments) {
        Ok(answer) | Err(answer) => answer,
    }
}

fn convert_and_prove(arguments: &Arguments) -> Result<Answer, Answer> {
    let supervisors = automata(&arguments.supervisor, true)?;
    let mut plants = Vec::new();
    for path in &arguments.plants {
        plants.extend(automata(path, false)?);
    }
    let (map, report) = read_signals(arguments, &supervisors, &plants)?;
    let name = |automata: Vec<Automaton>| -> Vec<Automaton> {
        automata
            .into_iter()
            .map(|automaton| map.name_events(automaton))
            .collect()
    };
    let (supervisors, plants) = (name(supervisors), name(plants));
    let modules = Modules {
        supervisors: &supervisors,
        plants: &plants,
    };
    let mode = Mode::from(arguments.mode);
    let conversion = convert(&modules, &map, mode)
        .map_err(|diagnostics| bad_map(report.clone(), diagnostics))?;
    let found = findings(&modules)
        .map_err(|error| Answer::failed(Status::Failed, error.code(), error.to_string()))?;
    let settings = ProofSettings {
        mode,
        ..ProofSettings::default()
    };
    let verdict = prove(
        &conversion.program,
        &modules,
        &map,
        &conversion.correspondence,
        settings,
    )
    .map_err(|error| Answer::failed(Status::Failed, error.code(), error.to_string()))?;
    Ok(answer(arguments, &modules, &conversion, &found, verdict))
}

/// The supervisors or the plants of a file.
fn automata(path: &Path, supervisors: bool) -> Result<Vec<Automaton>, Answer> {
    let text = files::text(path)?;
    let name = path.display().to_string();
    if path
        .extension()
        .is_some_and(|extension| extension == "toml")
    {
        let folder = path.parent().unwrap_or(Path::new("")).to_owned();
        let read = read_model(&text, |file| {
            std::fs::read_to_string(folder.join(file)).map_err(|error| error.to_string())
        });
        let Some(model) = read.model else {
            let mut reports = vec![Report {
                name,
                text,
                diagnostics: read.diagnostics,
            }];
            reports.extend(read.files);
            return Err(Answer::bad_files(reports));
        };
        let found = if supervisors {
            model.supervisors
        } else {
            model.plants
        };
        if found.is_empty() {
            let what = if supervisors { "supervisor" } else { "plant" };
            let message = format!("{name} has no {what}; `understudy synth` makes supervisors");
            return Err(Answer::failed(Status::BadInput, "U0651", message));
        }
        return Ok(found);
    }
    let read = read_ads(&text);
    match read.automaton {
        Some(automaton) => Ok(vec![automaton]),
        None => Err(Answer::bad_files(vec![Report {
            name,
            text,
            diagnostics: read.diagnostics,
        }])),
    }
}

fn read_signals(
    arguments: &Arguments,
    supervisors: &[Automaton],
    plants: &[Automaton],
) -> Result<(InputOutputMap, Report), Answer> {
    let modules = Modules {
        supervisors,
        plants,
    };
    let Some(path) = &arguments.io else {
        let program = arguments.supervisor.file_stem().unwrap_or_default();
        let map = InputOutputMap::direct(&program.to_string_lossy(), &modules.alphabet());
        let report = Report {
            name: arguments.supervisor.display().to_string(),
            text: String::new(),
            diagnostics: Vec::new(),
        };
        return Ok((map, report));
    };
    let text = files::text(path)?;
    let read = read_map(&text);
    let report = Report {
        name: path.display().to_string(),
        text,
        diagnostics: read.diagnostics,
    };
    match read.map {
        Some(map) => Ok((map, report)),
        None => Err(Answer::bad_files(vec![report])),
    }
}

fn bad_map(mut report: Report, diagnostics: Vec<Diagnostic>) -> Answer {
    report.diagnostics.extend(diagnostics);
    report
        .diagnostics
        .sort_by_key(|diagnostic| diagnostic.span.start);
    Answer::bad_files(vec![report])
}

fn answer(
    arguments: &Arguments,
    modules: &Modules,
    conversion: &Conversion,
    found: &[Finding],
    verdict: Verdict,
) -> Answer {
    let program = &conversion.program;
    let mut notes = String::new();
    for finding in found {
        let severity = match finding.severity {
            FindingSeverity::Warning => "warning",
            FindingSeverity::Error => "error",
        };
        let _ = writeln!(notes, "{severity} {}: {}", finding.code(), finding.message);
    }
    let mut result = json!({
        "program": program.name.as_str(),
        "rungs": program.rungs.len(),
        "inputs": program.inputs.len(),
        "outputs": program.outputs.len(),
        "memory": program.memory.len(),
        "consumed": conversion.consumed.iter().map(|label| label.number()).collect::<Vec<_>>(),
        "findings": found.iter().map(|finding| json!({
            "code": finding.code(),
            "severity": match finding.severity {
                FindingSeverity::Warning => "warning",
                FindingSeverity::Error => "error",
            },
            "message": finding.message,
            "states": finding.states.iter().map(|state| state.number()).collect::<Vec<_>>(),
            "events": finding.events.iter().map(|label| label.number()).collect::<Vec<_>>(),
            "run": finding.run.iter().map(|label| label.number()).collect::<Vec<_>>(),
        })).collect::<Vec<_>>(),
    });
    let proof = match verdict {
        Verdict::Proved(proof) => proof,
        Verdict::Refuted(counterexample) => {
            result["counterexample"] = Value::String(counterexample.to_string());
            let message = format!("the ladder does not keep the supervisor:\n{counterexample}");
            return Answer::done(notes, result).and_failure(Status::Failed, "U0875", message);
        }
    };
    result["proof"] = json!({
        "states": proof.states,
        "scans": proof.scans,
        "joint_states": proof.joint_states,
        "events": proof.events.len(),
    });
    let ladder = print(program);
    let text = if arguments.table {
        let tables = modules.all().zip(&conversion.rows);
        tables
            .map(|(automaton, rows)| table(automaton, rows))
            .collect::<Vec<_>>()
            .join("\n")
    } else {
        ladder.clone()
    };
    result["ladder"] = Value::String(ladder.clone());
    let failed = found
        .iter()
        .any(|finding| finding.severity == FindingSeverity::Error);
    let status = if failed { Status::Failed } else { Status::Done };
    let Some(path) = &arguments.output else {
        return Answer::done(text, result).with_status(status);
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
    Answer::done(summary, result).with_status(status)
}
