//! Reads, writes and describes automata for the commands.

use std::path::{Path, PathBuf};

use serde_json::{Value, json};
use understudy_supervisor::{
    Automaton, Model, draw_automaton_svg, draw_dot, read_ads, read_model, write_ads, write_model,
};
use understudy_text::Report;

use crate::answer::{Answer, Status};
use crate::files;
use crate::kind::Kind;

/// Automata with the findings of their files.
pub(crate) struct Sources<T> {
    pub(crate) read: T,
    pub(crate) reports: Vec<Report>,
}

/// Reads files of one automaton each. All files are read, so that all errors are shown at once.
pub(crate) fn one_each(paths: &[&PathBuf]) -> Result<Sources<Vec<Automaton>>, Answer> {
    gather(paths, |path| {
        let Sources { mut read, reports } = all_of(path)?;
        if let (Some(only), true) = (read.pop(), read.is_empty()) {
            return Ok(Sources { read: vec![only], reports });
        }
        let message = format!(
            "{} has several automata; operations require files of one automaton each (`understudy synth` reads models)",
            path.display()
        );
        Err(Answer::failed(Status::BadInput, "U0652", message).with_reports(reports))
    })
}

/// Reads all automata of all files.
pub(crate) fn all(paths: &[&PathBuf]) -> Result<Sources<Vec<Automaton>>, Answer> {
    gather(paths, all_of)
}

fn gather(
    paths: &[&PathBuf],
    read_one: impl Fn(&Path) -> Result<Sources<Vec<Automaton>>, Answer>,
) -> Result<Sources<Vec<Automaton>>, Answer> {
    let mut sources = Sources { read: Vec::new(), reports: Vec::new() };
    let mut failures = Vec::new();
    let mut right = true;
    for path in paths {
        match read_one(path) {
            Ok(source) => {
                sources.read.extend(source.read);
                sources.reports.extend(source.reports);
            }
            Err(answer) => {
                right = false;
                sources.reports.extend(answer.reports);
                failures.extend(answer.failures);
            }
        }
    }
    if right {
        return Ok(sources);
    }
    let mut answer = Answer::bad_files(sources.reports);
    answer.failures = failures;
    Err(answer)
}

/// Reads the automata of a file: a model (.toml), otherwise a TCT file.
fn all_of(path: &Path) -> Result<Sources<Vec<Automaton>>, Answer> {
    if is_model(path) {
        let Sources { read, reports } = model(path)?;
        let roles = [read.plants, read.specifications, read.supervisors];
        return Ok(Sources { read: roles.into_iter().flatten().collect(), reports });
    }
    let text = files::text_of(Kind::Ads, path)?;
    let read = read_ads(&text);
    let report = Report { name: path.display().to_string(), text, diagnostics: read.diagnostics };
    match read.automaton {
        Some(automaton) if automaton.name().is_empty() => {
            let stem = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
            Ok(Sources { read: vec![automaton.with_name(stem)], reports: vec![report] })
        }
        Some(automaton) => Ok(Sources { read: vec![automaton], reports: vec![report] }),
        None => Err(Answer::bad_files(vec![report])),
    }
}

pub(crate) fn is_model(path: &Path) -> bool {
    path.extension().is_some_and(|extension| extension == "toml")
}

/// Reads a model and the files that it names, relative to its folder.
pub(crate) fn model(path: &Path) -> Result<Sources<Model>, Answer> {
    let text = files::text_of(Kind::Model, path)?;
    let folder = path.parent().unwrap_or(Path::new("")).to_owned();
    let read = read_model(&text, |file| files::named(&folder, file));
    let name = path.display().to_string();
    let mut reports = vec![Report { name, text, diagnostics: read.diagnostics }];
    reports.extend(
        read.files.into_iter().map(|report| Report {
            name: folder.join(&report.name).display().to_string(),
            ..report
        }),
    );
    match read.model {
        Some(read) => Ok(Sources { read, reports }),
        None => Err(Answer::bad_files(reports)),
    }
}

/// Writes an automaton in the format of the file extension.
pub(crate) fn write(path: &Path, automaton: &Automaton) -> Result<(), Answer> {
    let ending = path.extension().unwrap_or_default().to_string_lossy().to_lowercase();
    let text = match ending.as_str() {
        "ads" => write_ads(automaton, &[])?,
        "toml" => write_model(&Model {
            name: automaton.name().to_owned(),
            alphabet: automaton.alphabet().clone(),
            supervisors: vec![automaton.clone()],
            ..Model::default()
        }),
        "dot" => draw_dot(automaton),
        "svg" => draw_automaton_svg(automaton)?,
        _ => {
            let message = format!(
                "{}: output formats of automata are .ADS, .toml, .dot and .svg",
                path.display()
            );
            return Err(Answer::failed(Status::BadInput, "U0653", message));
        }
    };
    files::write(path, &text)
}

/// Text of the automaton.
pub(crate) fn summary(automaton: &Automaton) -> String {
    if automaton.is_empty() {
        return format!("{}: EMPTY", automaton.name());
    }
    let mut text = format!(
        "{}: {} states, {} transitions, {} marked",
        automaton.name(),
        automaton.state_count(),
        automaton.transition_count(),
        automaton.marked().count()
    );
    let blocked = automaton.blocked_events();
    if !blocked.is_empty() {
        let names: Vec<String> =
            blocked.iter().map(|&label| automaton.alphabet().name(label)).collect();
        text.push_str(&format!(
            "; events without a transition: {} (not stored in .ADS files)",
            names.join(" ")
        ));
    }
    text
}

/// JSON of the automaton.
pub(crate) fn description(automaton: &Automaton) -> Value {
    let marked: Vec<u32> = automaton.marked().map(|state| state.number()).collect();
    let blocked = automaton.blocked_events();
    json!({
        "name": automaton.name(),
        "states": automaton.state_count(),
        "transitions": automaton.transition_count(),
        "initial": automaton.initial().map(|state| state.number()),
        "marked": marked,
        "events": automaton.alphabet().labels().map(|label| label.number()).collect::<Vec<_>>(),
        "blocked_events": blocked.iter().map(|label| label.number()).collect::<Vec<_>>(),
    })
}
