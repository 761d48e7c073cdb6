//! Reads, writes and describes automata for the commands.

use std::path::{Path, PathBuf};

use serde_json::{Value, json};
use understudy_supervisor::{
    Alphabet, Automaton, EventSource, Label, Model, ReadForeign, agree_on_events,
    draw_automaton_svg, draw_dot, read_ads, read_generator, read_model, read_module, write_ads,
    write_generator, write_model, write_module,
};
use understudy_text::Report;

use crate::answer::{Answer, Status};
use crate::files;
use crate::kind::Kind;

/// Automata with the findings of their files.
pub(crate) struct Sources<T> {
    pub(crate) read: T,
    pub(crate) reports: Vec<Report>,
    /// Events that the files declare unobservable.
    pub(crate) unobservable: Vec<Label>,
}

/// Reads files of one automaton each. All files are read, so that all errors are shown at once.
pub(crate) fn one_each(paths: &[&PathBuf]) -> Result<Sources<Vec<Automaton>>, Answer> {
    gather(paths, |path| {
        let sources = all_of(path)?;
        if sources.read.len() == 1 {
            return Ok(sources);
        }
        let message = format!(
            "{} has {} automata; this operation requires files of one automaton each (`understudy synth` and `des sync` read models)",
            path.display(),
            sources.read.len()
        );
        let answer = Answer::failed(Status::BadInput, "U0652", message);
        Err(answer.with_reports(sources.reports))
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
    let mut reports = Vec::new();
    let mut unobservable = Vec::new();
    let mut failures = Vec::new();
    let mut files = Vec::new();
    for path in paths {
        match read_one(path) {
            Ok(source) => {
                files.push((*path, source.read));
                reports.extend(source.reports);
                unobservable.extend(source.unobservable);
            }
            Err(answer) => {
                reports.extend(answer.reports);
                failures.push(answer.failures);
            }
        }
    }
    if !failures.is_empty() {
        let mut answer = Answer::bad_files(reports);
        answer.failures = failures.concat();
        return Err(answer);
    }
    let parts = files.iter_mut().map(|(path, automata)| (path.as_path(), automata.iter_mut()));
    if let Err(answer) = agree(&Alphabet::default(), parts) {
        return Err(answer.with_reports(reports));
    }
    let read = files.into_iter().flat_map(|(_, automata)| automata).collect();
    Ok(Sources { read, reports, unobservable })
}

/// Gives events of equal names in several files equal labels; `known` are those that stand already.
///
/// # Errors
/// U0839 where the files do not fit together.
pub(crate) fn agree<'a, A: Iterator<Item = &'a mut Automaton>>(
    known: &Alphabet,
    files: impl Iterator<Item = (&'a Path, A)>,
) -> Result<(), Answer> {
    let sources = files.map(|(path, automata)| EventSource {
        file: path.display().to_string(),
        automata: automata.collect(),
        is_by_name: has_ending(path, &["wmod", "gen"]),
    });
    agree_on_events(known, &mut sources.collect::<Vec<_>>())
        .map_err(|error| Answer::failed(Status::BadInput, error.code(), error))
}

/// Reads the automata of a file: a model (.toml, .wmod), a generator of libFAUDES (.gen), otherwise a TCT file.
fn all_of(path: &Path) -> Result<Sources<Vec<Automaton>>, Answer> {
    if is_model(path) {
        let Sources { read, reports, unobservable } = model(path)?;
        let roles = [read.plants, read.specifications, read.supervisors];
        return Ok(Sources { read: roles.into_iter().flatten().collect(), reports, unobservable });
    }
    if has_ending(path, &["gen"]) {
        let sources = foreign(path, Kind::Generator, read_generator)?;
        return Ok(Sources {
            read: sources.read.supervisors,
            reports: sources.reports,
            unobservable: sources.unobservable,
        });
    }
    let text = files::text_of(Kind::Ads, path)?;
    let read = read_ads(&text);
    let report = Report { name: path.display().to_string(), text, diagnostics: read.diagnostics };
    let Some(automaton) = read.automaton else {
        return Err(Answer::bad_files(vec![report]));
    };
    let automaton = if automaton.name().is_empty() {
        let stem = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        automaton.with_name(stem)
    } else {
        automaton
    };
    Ok(Sources { read: vec![automaton], reports: vec![report], unobservable: Vec::new() })
}

/// Reads a file of another tool.
fn foreign(
    path: &Path,
    kind: Kind,
    read: fn(&str) -> ReadForeign,
) -> Result<Sources<Model>, Answer> {
    let text = files::text_of(kind, path)?;
    let ReadForeign { model, unobservable, diagnostics } = read(&text);
    let reports = vec![Report { name: path.display().to_string(), text, diagnostics }];
    match model {
        Some(read) => Ok(Sources { read, reports, unobservable }),
        None => Err(Answer::bad_files(reports)),
    }
}

fn has_ending(path: &Path, endings: &[&str]) -> bool {
    let ending = path.extension().unwrap_or_default().to_ascii_lowercase();
    endings.iter().any(|known| ending == *known)
}

/// Whether a file can have several automata with their roles, by its ending.
pub(crate) fn is_model(path: &Path) -> bool {
    has_ending(path, &["toml", "wmod"])
}

/// Reads a model and the files that it names, relative to its folder, or a module of Supremica.
pub(crate) fn model(path: &Path) -> Result<Sources<Model>, Answer> {
    if has_ending(path, &["wmod"]) {
        return foreign(path, Kind::Module, read_module);
    }
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
        Some(read) => Ok(Sources { read, reports, unobservable: Vec::new() }),
        None => Err(Answer::bad_files(reports)),
    }
}

/// Writes a model in the format of the file extension, .toml or .wmod.
pub(crate) fn write_whole(path: &Path, model: &Model) -> Result<(), Answer> {
    let is_module = has_ending(path, &["wmod"]);
    files::write(path, &if is_module { write_module(model) } else { write_model(model) })
}

/// Writes an automaton in the format of the file extension.
pub(crate) fn write(path: &Path, automaton: &Automaton) -> Result<(), Answer> {
    if is_model(path) {
        let model = Model {
            name: automaton.name().to_owned(),
            alphabet: automaton.alphabet().clone(),
            supervisors: vec![automaton.clone()],
            ..Model::default()
        };
        return write_whole(path, &model);
    }
    let ending = path.extension().unwrap_or_default().to_string_lossy().to_lowercase();
    let text = match ending.as_str() {
        "ads" => write_ads(automaton, &[])?,
        "gen" => write_generator(automaton),
        "dot" => draw_dot(automaton),
        "svg" => draw_automaton_svg(automaton)?,
        _ => {
            let message = format!(
                "{}: output formats of automata are .ADS, .toml, .wmod, .gen, .dot and .svg",
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
