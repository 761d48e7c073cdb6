//! The text of a program: of one file, or of the files of a project.

use std::fs;
use std::path::{Path, PathBuf};

use understudy_interchange::{
    Format, Joined, ProjectFile, Rungs, can_be_joined, is_part, read_project,
};
use understudy_text::{Diagnostic, Report};

use super::{FIRST_FILES, text};
use crate::answer::{Answer, Status};
use crate::kind::{self, Kind};

/// The most files of a folder that are examined for those of a project.
const MAXIMUM_FILES: usize = 20_000;

/// The text of a program: of one file, or of the files of a project.
pub(crate) struct ProgramText {
    pub(crate) name: String,
    pub(crate) text: String,
    joined: Option<Joined>,
}

impl ProgramText {
    /// The program in a file, in the files that a TwinCAT project (`.plcproj`) names, or in those of a folder.
    ///
    /// # Errors
    /// If a file cannot be read, or one of a project is not well-formed.
    pub(crate) fn of(path: &Path) -> Result<Self, Answer> {
        let name = path.display().to_string();
        match project(path)? {
            Some(Files::Named(project)) => Self::named_by(name, project),
            Some(Files::Found(files)) => Self::together(name, &files),
            None => Ok(Self { text: text(path)?, name, joined: None }),
        }
    }

    /// The same, where what it names must look like a program.
    ///
    /// # Errors
    /// As [`Self::of`], and if the file is of another kind.
    pub(crate) fn expected(path: &Path) -> Result<Self, Answer> {
        let found = Self::of(path)?;
        if found.is_one_file() {
            kind::expect(Kind::Program, path, &found.text)?;
        }
        Ok(found)
    }

    /// Whether it is the text of one file.
    pub(crate) fn is_one_file(&self) -> bool {
        self.joined.is_none()
    }

    /// Several files as one program.
    ///
    /// # Errors
    /// All that cannot be read, or are no part of a project.
    pub(crate) fn together(name: String, files: &[PathBuf]) -> Result<Self, Answer> {
        let mut texts = Vec::new();
        let mut failed: Option<Answer> = None;
        for file in files {
            match (text(file), &mut failed) {
                (Ok(text), _) => texts.push((file.display().to_string(), text)),
                (Err(answer), Some(failed)) => failed.failures.extend(answer.failures),
                (Err(answer), None) => failed = Some(answer),
            }
        }
        let joined = Joined::of(texts).map_err(Answer::bad_files);
        match (joined, failed) {
            (Ok(joined), None) => {
                Ok(Self { name, text: joined.text.clone(), joined: Some(joined) })
            }
            (Ok(_), Some(failed)) => Err(failed),
            (Err(answer), None) => Err(answer),
            (Err(answer), Some(failed)) => Err(failed.with_reports(answer.reports)),
        }
    }

    /// The files that a project names; what is missing is reported with what is found in the others.
    fn named_by(name: String, mut project: ProjectFile) -> Result<Self, Answer> {
        let folder = Path::new(&project.name).parent().unwrap_or(Path::new("")).to_owned();
        let mut texts = Vec::new();
        let mut missing = Vec::new();
        for (file, place) in std::mem::take(&mut project.files) {
            let found = within(&folder, &file);
            match text(&found) {
                Ok(text) => texts.push((found.display().to_string(), text)),
                Err(_) => missing.push(place),
            }
        }
        let joined = Joined::of_project(project, texts, &missing).map_err(Answer::bad_files)?;
        Ok(Self { name, text: joined.text.clone(), joined: Some(joined) })
    }

    /// The file that what has no place is said of.
    pub(crate) fn first_file(&self) -> &str {
        self.joined.as_ref().and_then(Joined::first).unwrap_or(&self.name)
    }

    /// It with what was found in it.
    pub(crate) fn found(self, diagnostics: Vec<Diagnostic>) -> ProgramFile {
        let Self { name, text, joined } = self;
        ProgramFile { report: Report { name, text, diagnostics }, rungs: None, joined }
    }

    /// What was found, file by file.
    pub(crate) fn reports(self, diagnostics: Vec<Diagnostic>) -> Vec<Report> {
        self.found(diagnostics).reports()
    }
}

/// A program that was read, as one text, with what was found in it.
pub(crate) struct ProgramFile {
    pub(crate) report: Report,
    /// The rungs that it is written in or drawn as.
    pub(crate) rungs: Option<Rungs>,
    joined: Option<Joined>,
}

impl ProgramFile {
    /// What was found, file by file.
    pub(crate) fn reports(self) -> Vec<Report> {
        match self.joined {
            Some(joined) => joined.reports(self.report.diagnostics),
            None => vec![self.report],
        }
    }
}

/// Whether a path is the file of a TwinCAT project, by its end.
pub(crate) fn is_project(path: &Path) -> bool {
    path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("plcproj"))
}

/// The files among `paths` that are programs together, each two or more, in their order. Those that cannot be read are left out.
pub(crate) fn groups(paths: &[&Path]) -> Vec<Vec<PathBuf>> {
    let files = paths.iter().filter(|path| !is_project(path) && !path.is_dir());
    let files = files.filter_map(|path| Some((path.display().to_string(), text(path).ok()?)));
    let is_program = |name: &str, text: &str| Kind::of(Path::new(name), text) == Kind::Program;
    let files = files.filter(|(name, text)| is_program(name, text) && can_be_joined(name, text));
    let files: Vec<(String, String)> = files.collect();
    if files.len() < 2 {
        return Vec::new();
    }
    let groups = understudy_interchange::groups(&files);
    let several = groups.into_iter().filter(|group| group.len() > 1);
    several.map(|group| group.into_iter().map(|at| (&files[at].0).into()).collect()).collect()
}

/// The files of a project.
enum Files {
    /// Those that its file names.
    Named(ProjectFile),
    /// Those of its folder.
    Found(Vec<PathBuf>),
}

/// The files of a project, where the path is one: its file or its folder.
fn project(path: &Path) -> Result<Option<Files>, Answer> {
    if !path.is_dir() {
        return if is_project(path) { named(path).map(Some) } else { Ok(None) };
    }
    let files = files_in(path)?;
    let mut projects = files.iter().filter(|file| is_project(file));
    match (projects.next(), projects.next()) {
        (Some(only), None) => named(only).map(Some),
        (Some(first), Some(second)) => {
            let message = format!(
                "{} has several projects: name one, such as {} or {}",
                path.display(),
                first.display(),
                second.display()
            );
            Err(Answer::failed(Status::BadInput, "U0601", message))
        }
        (None, _) => {
            let parts: Vec<PathBuf> =
                files.iter().filter(|file| is_part(&file.to_string_lossy())).cloned().collect();
            let is_other = !parts.is_empty() || has_first_file(path);
            let sources = if is_other { parts } else { sources(files) };
            Ok((!sources.is_empty()).then_some(Files::Found(sources)))
        }
    }
}

/// Whether a folder is that of a cluster, a model or a reconfiguration.
fn has_first_file(folder: &Path) -> bool {
    FIRST_FILES.iter().any(|name| folder.join(name).exists())
}

/// The Structured Texts and PLCopen documents among files.
fn sources(files: Vec<PathBuf>) -> Vec<PathBuf> {
    let is_plcopen =
        |path: &Path| text(path).is_ok_and(|text| text.contains("http://www.plcopen.org/xml/tc6"));
    let is_source = |path: &PathBuf| match Format::of_ending(&path.to_string_lossy()) {
        Some(Format::StructuredText) => true,
        Some(Format::PlcOpen) => is_plcopen(path),
        _ => false,
    };
    files.into_iter().filter(is_source).collect()
}

/// All files in a folder and in those in it, in the order of their names. A folder with a cluster in it has copies of programs.
fn files_in(path: &Path) -> Result<Vec<PathBuf>, Answer> {
    let mut files = Vec::new();
    let mut folders = vec![path.to_owned()];
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(&folder).into_iter().flatten().flatten() {
            // A link may lead back.
            let is_folder = entry.file_type().is_ok_and(|kind| kind.is_dir());
            let path = entry.path();
            match is_folder {
                true if has_first_file(&path) => {}
                true => folders.push(path),
                false => files.push(path),
            }
        }
        if files.len() + folders.len() > MAXIMUM_FILES {
            let message = format!(
                "{} has more than {MAXIMUM_FILES} files: name the folder or the files of the project",
                path.display()
            );
            return Err(Answer::failed(Status::BadInput, "U0601", message));
        }
    }
    files.sort();
    Ok(files)
}

/// A file that a project names: on the systems where such projects are made, a name in capitals is the same one.
fn within(folder: &Path, name: &str) -> PathBuf {
    let mut path = folder.to_owned();
    for part in Path::new(name).components() {
        let exact = path.join(part);
        let alike = |entry: &fs::DirEntry| entry.file_name().eq_ignore_ascii_case(part.as_os_str());
        let entries = || fs::read_dir(&path).into_iter().flatten().flatten();
        path = match exact.exists() {
            true => exact,
            false => entries().find(alike).map_or(exact, |entry| entry.path()),
        };
    }
    path
}

/// The files that the file of a project names.
fn named(project: &Path) -> Result<Files, Answer> {
    let text = text(project)?;
    let name = project.display().to_string();
    match read_project(&name, &text) {
        Ok(project) => Ok(Files::Named(project)),
        Err(found) => Err(Answer::bad_files(vec![Report { name, text, diagnostics: vec![found] }])),
    }
}
