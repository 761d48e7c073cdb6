//! Reads and writes the files of a command.

mod project;

use std::borrow::Cow;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, SystemTime};

use serde_json::{Value, json};
use understudy_cluster::{Cluster, Loaded, Overrides, TemplateFile};
use understudy_interchange::{Source, USUAL_PERIOD, Wanted, read_ladder, read_source};
use understudy_journal::{Members, RunDirectory, RunDirectoryError, named_file};
use understudy_ladder::Program;
use understudy_logic::Circuit;
use understudy_parity::{ParityController, generate};
use understudy_scenarios::{Scenario, read as read_scenario};
use understudy_text::spelling::nearest;
use understudy_text::{Report, decode, has_errors};

use crate::answer::{Answer, Status};
use crate::kind::{self, Kind};
pub(crate) use project::{ProgramFile, ProgramText, groups, is_project};

/// The files that this command has read.
static READ: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());

/// Text of a file.
pub(crate) fn text(path: &Path) -> Result<String, Answer> {
    decoded(path, bytes(path)?)
}

/// Bytes of a file.
pub(crate) fn bytes(path: &Path) -> Result<Vec<u8>, Answer> {
    let bytes = fs::read(path)
        .map_err(|error| Answer::failed(Status::BadInput, "U0601", unreadable(path, &error)))?;
    note_read(path);
    Ok(bytes)
}

/// Keeps a file from being overwritten by this command.
fn note_read(path: &Path) {
    READ.lock().unwrap_or_else(PoisonError::into_inner).extend(fs::canonicalize(path));
}

/// Text of a file that another file names, from the folder of that one.
pub(crate) fn named(folder: &Path, name: &str) -> Result<String, String> {
    let text = named_file(folder, name)?;
    note_read(&folder.join(name));
    Ok(text)
}

/// Decodes the bytes of a file.
pub(crate) fn decoded(path: &Path, bytes: Vec<u8>) -> Result<String, Answer> {
    decode(bytes).map_err(|error| {
        let message = format!("{} is not a text file: {error}", path.display());
        Answer::failed(Status::BadInput, "U0618", message)
    })
}

/// Text of a file of the given kind.
pub(crate) fn text_of(wanted: Kind, path: &Path) -> Result<String, Answer> {
    let text = text(path)?;
    kind::expect(wanted, path, &text)?;
    Ok(text)
}

/// Main files of a project folder.
const FIRST_FILES: [&str; 3] = ["cluster.toml", "model.toml", "reconfiguration.toml"];

/// Message for an unreadable file, with a suggestion.
pub(crate) fn unreadable(path: &Path, error: &io::Error) -> String {
    let (reason, meant) = if path.is_dir() {
        let first = FIRST_FILES.iter().map(|name| path.join(name));
        ("it is a folder".to_owned(), first.into_iter().find(|file| file.exists()))
    } else if error.kind() == io::ErrorKind::NotFound {
        (error.to_string(), nearest_file(path))
    } else {
        (error.to_string(), None)
    };
    let meant = meant.map(|file| format!("; did you mean {}?", file.display()));
    format!("{} cannot be read: {reason}{}", path.display(), meant.unwrap_or_default())
}

/// File in the same folder with the most similar name.
fn nearest_file(path: &Path) -> Option<PathBuf> {
    let folder = path.parent()?;
    let place = if folder == Path::new("") { Path::new(".") } else { folder };
    let entries = fs::read_dir(place).ok()?.filter_map(Result::ok);
    let names: Vec<String> =
        entries.filter_map(|entry| entry.file_name().into_string().ok()).collect();
    let name = path.file_name()?.to_str()?;
    let nearest = nearest(name, names.iter().map(String::as_str).filter(|known| *known != name))?;
    Some(folder.join(nearest))
}

/// What `check` lists of a program, or of a cluster and its programs, apart from what it searches for within its time limit.
pub(crate) fn listed_by_check(path: &Path) -> Vec<Report> {
    if path.extension().is_some_and(|ending| ending == "toml") {
        let read = text(path).map(|text| read_cluster(path, &text, Overrides::default()).reports);
        return read.unwrap_or_default();
    }
    let read = ProgramText::of(path).map(|text| {
        let found = read_source(&text.name, &text.text, Wanted::default());
        text.reports(found.diagnostics)
    });
    read.unwrap_or_default()
}

/// A program without errors, whatever it is written in, in one file or a TwinCAT project, with the warnings, and its period.
///
/// # Errors
/// If the file cannot be read, is no program or has errors.
pub(crate) fn program(
    path: &Path,
    wanted: Wanted<'_>,
) -> Result<(Source, ProgramFile, Duration), Answer> {
    let file = ProgramText::expected(path)?;
    let period = |found: Option<Duration>| wanted.period.or(found).unwrap_or(USUAL_PERIOD);
    let read = read_source(&file.name, &file.text, wanted);
    let mut file = file.found(read.diagnostics);
    file.rungs = read.rungs;
    match read.source {
        Some(source) if !file.report.has_errors() => Ok((source, file, period(read.period))),
        _ => Err(Answer::bad_files(file.reports())),
    }
}

/// A ladder without errors, in one file or a TwinCAT project, and its files with the warnings.
///
/// # Errors
/// If the file cannot be read, is not a ladder or has errors.
pub fn ladder(path: &Path) -> Result<(Program, Vec<Report>), Answer> {
    ladder_at(path, None).map(|(program, reports, _)| (program, reports))
}

/// As [`ladder`], for a period; with the interval that the file states.
pub(crate) fn ladder_at(
    path: &Path,
    period: Option<Duration>,
) -> Result<(Program, Vec<Report>, Option<Duration>), Answer> {
    let file = ProgramText::expected(path)?;
    let read = read_ladder(&file.name, &file.text, period);
    let program = read.program.filter(|_| !has_errors(&read.diagnostics));
    let Some(program) = program else {
        return Err(Answer::bad_files(file.reports(read.diagnostics)));
    };
    Ok((program, file.reports(read.diagnostics), read.period))
}

/// Writes a file.
///
/// # Errors
/// U0602 if it cannot be written.
pub fn write(path: &Path, text: &str) -> Result<(), Answer> {
    fs::write(path, text).map_err(|error| unwritable(path, &error))
}

/// Makes a folder and its parents.
pub(crate) fn make_folder(path: &Path) -> Result<(), Answer> {
    fs::create_dir_all(path).map_err(|error| unwritable(path, &error))
}

/// Writes the output file of a command, unless it is one of its inputs.
///
/// # Errors
/// U0602 if it cannot be written, U0603 if the command has read it.
pub(crate) fn write_output(path: &Path, text: &str) -> Result<(), Answer> {
    let read = READ.lock().unwrap_or_else(PoisonError::into_inner);
    if fs::canonicalize(path).is_ok_and(|path| read.contains(&path)) {
        let message = format!(
            "{} is what this command reads, and is not overwritten; choose another output file",
            path.display()
        );
        return Err(Answer::failed(Status::BadInput, "U0603", message));
    }
    write(path, text)
}

/// Answers with a text and its JSON, or writes the text to the output file if one is given.
pub(crate) fn deliver(output: Option<&Path>, text: &str, result: Value) -> Result<Answer, Answer> {
    let Some(path) = output else {
        return Ok(Answer::done(text, result));
    };
    write_output(path, text)?;
    Ok(Answer::done("", json!({})).and_written(path))
}

/// A new directory for a run below `runs`.
pub(crate) fn run_directory(runs: &Path) -> Result<RunDirectory, Answer> {
    RunDirectory::create(runs, SystemTime::now()).map_err(unwritable_run)
}

/// The failure of a directory for runs that cannot be written.
pub(crate) fn unwritable_run(error: RunDirectoryError) -> Answer {
    let message = format!("{error}; choose another directory with --out");
    Answer::failed(Status::Failed, "U0602", message)
}

/// Replaces a file atomically.
pub(crate) fn replace(path: &Path, text: &str) -> Result<(), Answer> {
    let mut staged = path.as_os_str().to_owned();
    staged.push(".new");
    let staged = PathBuf::from(staged);
    let written = fs::write(&staged, text).and_then(|()| fs::rename(&staged, path));
    written.map_err(|error| {
        let _ = fs::remove_file(&staged);
        unwritable(path, &error)
    })
}

/// Reads a cluster file and the programs that it names, relative to its folder.
pub(crate) fn read_cluster(path: &Path, text: &str, overrides: Overrides) -> Loaded {
    let folder = path.parent().unwrap_or(Path::new("")).to_owned();
    let mut loaded =
        understudy_cluster::read_with(&path.display().to_string(), text, overrides, &mut |name| {
            named(&folder, name)
        });
    // Programs are named relative to the current folder.
    for report in loaded.reports.iter_mut().skip(1) {
        report.name = folder.join(&report.name).display().to_string();
    }
    loaded
}

/// A valid cluster, and its files with their warnings.
pub(crate) fn cluster(path: &Path, overrides: Overrides) -> Result<(Cluster, Vec<Report>), Answer> {
    let text = text_of(Kind::Cluster, path)?;
    let Loaded { cluster, reports } = read_cluster(path, &text, overrides);
    match cluster {
        Some(cluster) => Ok((cluster, reports)),
        None => Err(Answer::bad_files(reports)),
    }
}

/// A valid scenario for a cluster.
pub(crate) fn scenario(path: &Path, cluster: &Cluster) -> Result<Scenario, Answer> {
    let text = text_of(Kind::Scenario, path)?;
    let found = read_scenario(&path.display().to_string(), &text, Some(&Members::of(cluster)));
    found.scenario.ok_or_else(|| Answer::bad_files(vec![found.report]))
}

/// A file to write.
pub(crate) struct NewFile {
    /// File name without folders.
    pub(crate) name: String,
    pub(crate) bytes: Vec<u8>,
}

/// Writes the files of a template to a folder without overwriting.
pub(crate) fn write_template(
    folder: &Path,
    files: &[TemplateFile],
) -> Result<Vec<PathBuf>, Answer> {
    let files =
        files.iter().map(|file| NewFile { name: file.name.to_owned(), bytes: file.text.into() });
    write_new(folder, &files.collect::<Vec<_>>())
}

/// Writes all files to a folder, or none, without overwriting.
pub(crate) fn write_new(folder: &Path, files: &[NewFile]) -> Result<Vec<PathBuf>, Answer> {
    let paths: Vec<PathBuf> = files.iter().map(|file| folder.join(&file.name)).collect();
    let existing: Vec<String> = paths
        .iter()
        .filter(|path| path.symlink_metadata().is_ok())
        .map(|path| path.display().to_string())
        .collect();
    if !existing.is_empty() {
        let message = format!(
            "these files already exist and are not overwritten: {}; choose another folder or move them",
            existing.join(", ")
        );
        return Err(Answer::failed(Status::BadInput, "U0603", message));
    }
    let is_new = !folder.exists();
    make_folder(folder)?;
    for (count, (file, path)) in files.iter().zip(&paths).enumerate() {
        if let Err(error) = fs::write(path, &file.bytes) {
            for written in &paths[..=count] {
                let _ = fs::remove_file(written);
            }
            if is_new {
                let _ = fs::remove_dir(folder);
            }
            return Err(unwritable(path, &error));
        }
    }
    Ok(paths)
}

pub(crate) fn unwritable(path: &Path, error: &io::Error) -> Answer {
    let message = format!("{} cannot be written: {error}", path.display());
    Answer::failed(Status::Failed, "U0602", message)
}

/// The generated controller of a cluster whose programs all have exact circuits, for a command that works on circuits.
///
/// # Errors
/// The answer of the command: which program has none, and which of its values is in the way.
pub(crate) fn parity_of<'a>(
    cluster: &'a Cluster,
    command: &str,
) -> Result<Cow<'a, ParityController>, Answer> {
    if let Some(parity) = cluster.parity() {
        return Ok(Cow::Borrowed(parity));
    }
    let (_, parity) = understudy_of(cluster).map_err(|(code, reason)| {
        let message = match code {
            "U0438" => format!("`{command}` works on circuits, and {reason}"),
            _ => reason,
        };
        Answer::failed(Status::BadInput, code, message)
    })?;
    Ok(Cow::Owned(parity))
}

/// The circuits of the programs of a cluster, and the generated controller.
///
/// # Errors
/// A code and the reason: which program has no circuit, and which of its values is in the way.
pub(crate) fn understudy_of(
    cluster: &Cluster,
) -> Result<(Vec<Circuit>, ParityController), (&'static str, String)> {
    let circuits = cluster.circuits().map_err(|(name, inexact)| {
        let code = inexact.code_or("U0438");
        (code, format!("the program of `{name}` has no circuit: {inexact}"))
    })?;
    let circuits: Vec<Circuit> = circuits.into_iter().map(Cow::into_owned).collect();
    let parity = match cluster.parity() {
        Some(parity) => parity.clone(),
        None => {
            let members: Vec<&Circuit> = circuits.iter().collect();
            generate(&members).map_err(|error| (error.code(), error.to_string()))?
        }
    };
    Ok((circuits, parity))
}
