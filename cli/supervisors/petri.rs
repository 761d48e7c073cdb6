//! `understudy petri`: automation Petri nets and their ladder programs.

use std::path::{Path, PathBuf};

use clap::{Args, Subcommand, ValueEnum};
use serde_json::{Value, json};
use understudy_ladder::print;
use understudy_supervisor::ladder::locate;
use understudy_supervisor::petri::{
    HybridError, NetFile, draw_net_dot, draw_net_svg, hybrid_net, list_arcs, list_control,
    read_net, reduce, to_ladder, write_net,
};
use understudy_supervisor::proof::{
    Finding, HybridProof, HybridVerdict, ProofSettings, hybrid_findings, prove_hybrid,
};
use understudy_supervisor::{Alphabet, Automaton, Model};
use understudy_text::Report;

use crate::answer::{Answer, Status};
use crate::console::Console;
use crate::files;
use crate::kind::Kind;
use crate::supervisors::automata::{self, Sources, description, summary};
use crate::supervisors::supervisor_to_ladder::{has_error, listed, notes, withheld};

/// Analyse automation Petri nets and convert them to ladder
#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  understudy petri bounds examples/assembly-cell/net.toml
  understudy synth examples/assembly-cell/model.toml --reduce --name keeper -o keeper.toml
  understudy petri ladder examples/assembly-cell/net.toml --supervisor keeper.toml -o cell.ladder

A model uses a net as its plant by [[plant]] net = \"net.toml\". A ladder program is written only if it is proved to behave as the net under
its supervisors.")]
pub(crate) struct Arguments {
    #[command(subcommand)]
    operation: Operation,
    /// Output file
    #[arg(long, short, value_name = "FILE", global = true)]
    output: Option<PathBuf>,
    /// Maximum number of markings
    #[arg(long, value_name = "NUMBER", default_value_t = 1_000_000, global = true)]
    markings: usize,
}

#[derive(Debug, Subcommand)]
enum Operation {
    /// Bound of each place, or a run that shows that a place is unbounded
    #[command(after_help = "Example:\n  understudy petri bounds examples/assembly-cell/net.toml")]
    Bounds {
        #[arg(value_name = "NET.toml")]
        net: PathBuf,
    },
    /// Reachability graph as an automaton: .ADS, .toml, .wmod, .gen, .dot or .svg
    #[command(
        after_help = "Example:\n  understudy petri automaton examples/assembly-cell/net.toml -o net.ADS"
    )]
    Automaton {
        #[arg(value_name = "NET.toml")]
        net: PathBuf,
    },
    /// Smaller equivalent net (.toml)
    #[command(
        after_help = "Example:\n  understudy petri reduce examples/assembly-cell/net.toml -o smaller.toml"
    )]
    Reduce {
        #[arg(value_name = "NET.toml")]
        net: PathBuf,
    },
    /// Proved ladder program of the net with its supervisors
    #[command(
        after_help = "Example:\n  understudy synth examples/assembly-cell/model.toml --reduce --name keeper -o keeper.toml\n  understudy petri ladder examples/assembly-cell/net.toml --supervisor keeper.toml -o cell.ladder"
    )]
    Ladder {
        #[arg(value_name = "NET.toml")]
        net: PathBuf,
        /// Supervisors: automata (.ADS, .gen) or models with supervisors (.toml, .wmod)
        #[arg(long = "supervisor", value_name = "FILE", num_args = 1..)]
        supervisors: Vec<PathBuf>,
    },
    /// Drawing of the net, alone or controlled by supervisors
    #[command(
        after_help = "Example:\n  understudy petri draw examples/assembly-cell/net.toml -o net.svg\n  understudy synth examples/assembly-cell/model.toml --reduce --name keeper -o keeper.toml\n  understudy petri draw examples/assembly-cell/net.toml --supervisor keeper.toml --as arcs"
    )]
    Draw {
        #[arg(value_name = "NET.toml")]
        net: PathBuf,
        /// Supervisors, as nets with inhibitor arcs: automata (.ADS, .gen) or models with supervisors (.toml, .wmod)
        #[arg(long = "supervisor", value_name = "FILE", num_args = 1..)]
        supervisors: Vec<PathBuf>,
        /// The nets of the supervisors without the plant
        #[arg(long, requires = "supervisors")]
        auto_net: bool,
        /// Output format
        #[arg(long = "as", value_enum, default_value = "svg")]
        form: Form,
    },
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Form {
    /// SVG picture
    Svg,
    /// Graphviz
    Dot,
    /// List of all arcs, and the control data as inhibitor arcs
    Arcs,
}

impl Operation {
    fn net(&self) -> &Path {
        match self {
            Self::Bounds { net }
            | Self::Automaton { net }
            | Self::Reduce { net }
            | Self::Ladder { net, .. }
            | Self::Draw { net, .. } => net,
        }
    }
}

pub(crate) fn run(arguments: &Arguments, console: &mut Console) -> Result<Answer, Answer> {
    let path = arguments.operation.net();
    let text = files::text_of(Kind::Net, path)?;
    let read = read_net(&text);
    let report = Report { name: path.display().to_string(), text, diagnostics: read.diagnostics };
    let Some(file) = read.file else {
        return Err(Answer::bad_files(vec![report]));
    };
    let output = arguments.output.as_deref();
    let answer = match &arguments.operation {
        Operation::Bounds { .. } => bounds(&file, arguments.markings),
        Operation::Automaton { .. } => automaton(&file, arguments.markings, output),
        Operation::Reduce { .. } => reduced(file, output),
        Operation::Ladder { supervisors, .. } => {
            return ladder(&file, supervisors, arguments.markings, output, report, console);
        }
        Operation::Draw { form, supervisors, auto_net, .. } => {
            drawn(&file, supervisors, *auto_net, *form, output)
        }
    };
    Ok(Answer::from(answer).with_reports(vec![report]))
}

fn failed(code: &str, error: impl ToString) -> Answer {
    Answer::failed(Status::Failed, code, error)
}

fn bounds(file: &NetFile, limit: usize) -> Result<Answer, Answer> {
    let net = &file.net;
    let explored = net.explore(limit)?;
    let bounds = explored.bounds();
    let places = net.places().iter().zip(&bounds);
    let mut text = String::new();
    let mut of_places = serde_json::Map::new();
    for (place, bound) in places {
        text.push_str(&format!("{}: at most {bound}\n", place.name));
        of_places.insert(place.name.clone(), json!(bound));
    }
    let (markings, dead) = (explored.markings().len(), explored.dead_transitions());
    let stuck: Vec<String> =
        explored.dead_markings().into_iter().map(|marking| net.name_of(marking)).collect();
    let is_safe = bounds.iter().all(|&bound| bound <= 1);
    text.push_str(&format!(
        "{markings} markings{}",
        if is_safe { ", and the net is safe" } else { "" }
    ));
    if !dead.is_empty() {
        text.push_str(&format!("\nnever enabled: {}", dead.join(" ")));
    }
    if let Some(first) = stuck.first() {
        text.push_str(&format!("\n{} deadlock markings, the first is {first}", stuck.len()));
    }
    let result = json!({
        "places": of_places,
        "markings": markings,
        "safe": is_safe,
        "dead_transitions": dead,
        "dead_markings": stuck,
    });
    Ok(Answer::done(text, result))
}

fn automaton(file: &NetFile, limit: usize, output: Option<&Path>) -> Result<Answer, Answer> {
    let explored = file.net.explore(limit)?;
    let made = explored.automaton()?;
    let made = made.with_event_names(&file.events);
    let answer = Answer::done(summary(&made), description(&made));
    let Some(path) = output else {
        return Ok(answer);
    };
    if automata::is_model(path) {
        // The automaton is a plant of a model, so that specifications can be added.
        let model = Model {
            name: made.name().to_owned(),
            alphabet: made.alphabet().clone(),
            plants: vec![made],
            ..Model::default()
        };
        automata::write_whole(path, &model)?;
    } else {
        automata::write(path, &made)?;
    }
    Ok(answer.and_written(path))
}

fn reduced(mut file: NetFile, output: Option<&Path>) -> Result<Answer, Answer> {
    let (net, steps) = reduce(&file.net);
    let steps: Vec<String> = steps.iter().map(ToString::to_string).collect();
    let (places, transitions) = (net.places().len(), net.transitions().len());
    file.net = net;
    let written = write_net(&file);
    let lines: String = steps.iter().map(|step| format!("{step}\n")).collect();
    let text = format!("{lines}{places} places and {transitions} transitions remain");
    let mut result = json!({ "places": places, "transitions": transitions, "removed": steps });
    match output {
        Some(path) => {
            files::write(path, &written)?;
            Ok(Answer::done(text, result).and_written(path))
        }
        None => {
            result["text"] = Value::String(written);
            Ok(Answer::done(text, result))
        }
    }
}

fn drawn(
    file: &NetFile,
    paths: &[PathBuf],
    auto_net: bool,
    form: Form,
    output: Option<&Path>,
) -> Result<Answer, Answer> {
    let named = supervisors(paths, &file.events)?;
    let plant = (!auto_net).then_some(&file.net);
    let net = hybrid_net(plant, &named, &file.events);
    let net = net.map_err(|error| failed(error.code(), error))?;
    let text = match form {
        Form::Dot => draw_net_dot(&net),
        Form::Svg => draw_net_svg(&net)?,
        Form::Arcs => format!("{}{}", list_arcs(&net), list_control(&net, &named)),
    };
    files::deliver(output, &text, json!({ "text": text }))
}

fn ladder(
    file: &NetFile,
    paths: &[PathBuf],
    limit: usize,
    output: Option<&Path>,
    mut report: Report,
    console: &mut Console,
) -> Result<Answer, Answer> {
    let named = supervisors(paths, &file.events)?;
    let made = to_ladder(&file.net, &named, limit);
    let mut made = match made {
        Ok(made) => made,
        // Names of ladder signals have positions in the net file.
        Err(HybridError::Invalid(found)) => {
            report.diagnostics.extend(found);
            return Err(Answer::bad_files(vec![report]));
        }
        Err(error) => return Err(failed(error.code(), error).with_reports(vec![report])),
    };
    if let Err(found) = locate(&mut made.program, &file.addresses) {
        report.diagnostics.extend(found);
        return Err(Answer::bad_files(vec![report]));
    }
    // Nets that cannot be explored in advance are still proved.
    let found = hybrid_findings(&file.net, &named, limit).map_err(|error| error.to_string());
    let answer = match prove_hybrid(&file.net, &named, &made, ProofSettings::default()) {
        Err(error) => failed(error.code(), error),
        Ok(HybridVerdict::Refuted(found)) => {
            let message = format!("the ladder differs from the net and its supervisors:\n{found}");
            failed("U0875", message)
        }
        Ok(HybridVerdict::Proved(proof)) => {
            if let (None, Ok(found)) = (output, &found)
                && !has_error(found)
            {
                // The answer is the ladder alone.
                notes(found).lines().for_each(|line| console.note(line));
            }
            proved(&print(&made.program), &proof, &found, output).into()
        }
    };
    Ok(answer.with_reports(vec![report]))
}

/// The supervisors of files, with the events of a net.
fn supervisors(paths: &[PathBuf], events: &Alphabet) -> Result<Vec<Automaton>, Answer> {
    let mut files = Vec::new();
    for path in paths {
        let read = if automata::is_model(path) {
            let Sources { read, reports, .. } = automata::model(path)?;
            if read.supervisors.is_empty() {
                let path = path.display();
                let message = format!("{path} has no supervisor; `understudy synth` creates them");
                let answer = Answer::failed(Status::BadInput, "U0651", message);
                return Err(answer.with_reports(reports));
            }
            read.supervisors
        } else {
            automata::all(&[path])?.read
        };
        files.push((path.as_path(), read));
    }
    automata::agree(events, files.iter_mut().map(|(path, read)| (*path, read.iter_mut())))?;
    let all = files.into_iter().flat_map(|(_, read)| read);
    Ok(all.map(|one| one.with_event_names(events)).collect())
}

fn proved(
    ladder: &str,
    proof: &HybridProof,
    found: &Result<Vec<Finding>, String>,
    output: Option<&Path>,
) -> Result<Answer, Answer> {
    let mut result = json!({
        "rungs": ladder.lines().filter(|line| line.starts_with("rung")).count(),
        "proof": {
            "states": proof.states,
            "scans": proof.scans,
            "markings": proof.markings,
            "never_fired": proof.never_fired,
        },
        "findings": found.as_ref().ok().map(|found| listed(found)),
    });
    if let Some(answer) = found.as_ref().ok().and_then(|found| withheld(found, &result)) {
        return Err(answer);
    }
    result["ladder"] = json!(ladder);
    let Some(path) = output else {
        return Ok(Answer::done(ladder, result));
    };
    files::write(path, ladder)?;
    let said_before = match found {
        Ok(found) => notes(found),
        Err(error) => format!("preliminary check omitted: {error}\n"),
    };
    let mut text = format!(
        "{}proved over {} states in {} scans, {} markings",
        said_before, proof.states, proof.scans, proof.markings
    );
    if !proof.never_fired.is_empty() {
        text.push_str(&format!("; transitions that never fire: {}", proof.never_fired.join(" ")));
    }
    let answer = Answer::done(text, result).and_written(path);
    Ok(answer.and_next(&[&"verify", &path]))
}
