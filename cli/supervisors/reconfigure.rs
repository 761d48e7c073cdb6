//! `understudy reconfigure`: operation of a ladder program with failed input channels.

use std::path::{Path, PathBuf};

use clap::Args;
use serde_json::Value;
use understudy_ladder::print;
use understudy_reconfiguration::project::{self, Loaded, Project};
use understudy_reconfiguration::{Failure, Outcome, analyse};
use understudy_supervisor::{draw_automaton_svg, draw_dot};
use understudy_text::{Diagnostic, Report};

use crate::answer::{Answer, Status};
use crate::files;
use crate::kind::Kind;

/// Generate the ladder module that operates with failed input channels
#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  understudy reconfigure examples/filling-line/reconfiguration.toml --channels Ready,Filling_done -o filling-line

DIR receives report.md, result.json, the automaton of the ladder, its feedback tables, the mega-controller with pictures, the integer
programs with their solutions, module 2 and the combined ladder. Files are written only if the combined ladder is proved. Project file:
docs/reference/reconfiguration.md.")]
pub(crate) struct Arguments {
    /// Project file
    #[arg(value_name = "PROJECT.toml")]
    project: PathBuf,
    /// Inputs that may fail, overrides the project
    #[arg(long, value_name = "INPUT", value_delimiter = ',')]
    channels: Vec<String>,
    /// Maximum number of simultaneously failed inputs, overrides the project
    #[arg(long, value_name = "COUNT")]
    simultaneous: Option<usize>,
    /// Prevent events after which only the operator's release leads back, where other outputs can do it
    #[arg(long)]
    trim: bool,
    /// Output folder; default: print the report
    #[arg(long, short, value_name = "DIR")]
    output: Option<PathBuf>,
}

pub(crate) fn run(arguments: &Arguments) -> Result<Answer, Answer> {
    let (mut project, mut reports) = read(&arguments.project)?;
    narrow(arguments, &mut project)?;
    let partly = project.partly_covered().into_iter();
    let partly = partly.map(|message| Diagnostic::warning("U1252", message, 0..0));
    reports[0].diagnostics.extend(partly);
    let outcome = analyse(&project).map_err(|failure| failed(&failure))?;
    for span in &outcome.idle {
        let message = "this relation affects no reachable state of the ladder";
        reports[0].diagnostics.push(Diagnostic::warning("U1251", message, span.clone()));
    }
    let name = project.ladder.name.to_string();
    let report = outcome.report(&name);
    let mut result = outcome.json();
    let Some(folder) = &arguments.output else {
        return Ok(Answer::done(report, result).with_reports(reports));
    };
    let files = written(&outcome, report, &result)?;
    files::make_folder(folder)?;
    for (name, text) in &files {
        files::write(&folder.join(name), text)?;
    }
    let names: Vec<&str> = files.iter().map(|(name, _)| *name).collect();
    result["directory"] = Value::String(folder.display().to_string());
    let summary = format!(
        "{name}: {} states, {} of the mega-controller; {} rungs of module 2, proved over {} states in {} scans\nwritten to {}: {}",
        outcome.controller.states().len(),
        outcome.mega.states.len(),
        outcome.combined.program.rungs.len() - outcome.combined.first_rung,
        outcome.proof.states,
        outcome.proof.scans,
        folder.display(),
        names.join(", ")
    );
    Ok(Answer::done(summary, result).with_reports(reports))
}

fn read(path: &Path) -> Result<(Project, Vec<Report>), Answer> {
    let Loaded { project, reports } = read_project(path, &files::text_of(Kind::Project, path)?);
    match project {
        Some(project) => Ok((project, reports)),
        None => Err(Answer::bad_files(reports)),
    }
}

/// Reads a project and the ladder programs that it names, relative to its folder.
pub(crate) fn read_project(path: &Path, text: &str) -> Loaded {
    let folder = path.parent().unwrap_or(Path::new("")).to_owned();
    let mut loaded =
        project::read(&path.display().to_string(), text, &mut |name| files::named(&folder, name));
    for report in loaded.reports.iter_mut().skip(1) {
        report.name = folder.join(&report.name).display().to_string();
    }
    loaded
}

/// Applies the overrides of the command line.
fn narrow(arguments: &Arguments, project: &mut Project) -> Result<(), Answer> {
    if !arguments.channels.is_empty() {
        project
            .choose(&arguments.channels)
            .map_err(|message| Answer::failed(Status::BadInput, "U1205", message))?;
    }
    if let Some(count) = arguments.simultaneous {
        project.simultaneous = count.clamp(1, project.channels.len().max(1));
    }
    project.trim = arguments.trim;
    Ok(())
}

fn failed(failure: &Failure) -> Answer {
    let status = match failure {
        Failure::NotProved(_) => Status::Failed,
        _ => Status::BadInput,
    };
    let text = failure.to_string();
    let message = text.split_once(": ").map_or(text.as_str(), |(_, message)| message);
    Answer::failed(status, failure.code(), message)
}

/// Renders all files before the first is written.
fn written(
    outcome: &Outcome,
    report: String,
    result: &Value,
) -> Result<Vec<(&'static str, String)>, Answer> {
    let controller = outcome.drawn_controller()?;
    let mega = outcome.drawn_mega_controller()?;
    let mut files = vec![
        ("report.md", report),
        ("feedback.md", outcome.tables()),
        ("programs.md", outcome.programs()),
        ("combined.ladder", print(&outcome.combined.program)),
        ("module-2.ladder", outcome.module_two_text()),
        ("automaton.dot", draw_dot(&controller)),
        ("mega-controller.dot", draw_dot(&mega)),
        ("result.json", format!("{result:#}\n")),
    ];
    if let Some(diagnosis) = &outcome.diagnosis {
        files.push(("diagnosis.ladder", print(diagnosis)));
    }
    // Large graphs are written as DOT only.
    if let Ok(picture) = draw_automaton_svg(&controller) {
        files.push(("automaton.svg", picture));
    }
    if let Ok(picture) = draw_automaton_svg(&mega) {
        files.push(("mega-controller.svg", picture));
    }
    Ok(files)
}
