//! A cluster from existing programs.
//!
//! Invariant: files are written only after every program was read and the drafted cluster was checked.

use std::collections::{HashMap, HashSet};
use std::fs;
use std::path::{Path, PathBuf};
use std::time::Duration;

use understudy_cluster::{
    Draft, DraftProgram, MAXIMUM_PROGRAM_NAME, is_name, read as read_cluster,
};
use understudy_interchange::{
    Apart, Copies, Format, IDLE_PROGRAM, NO_OUTPUT, OutputError, Source, USUAL_PERIOD, read_apart,
    read_with_outputs,
};
use understudy_text::spelling::suggestion;
use understudy_text::{Report, Severity, decode, duration, has_errors};
use understudy_wire::MAXIMUM_PROGRAMS;

use super::written;
use crate::answer::{Answer, Failure};
use crate::files::{self, NewFile, ProgramText};
use crate::programs::convert::code;

pub(super) fn run(
    folder: &Path,
    arguments: &[PathBuf],
    outputs: &[String],
) -> Result<Answer, Answer> {
    let (texts, found) = drafted(folder, arguments, outputs)?;
    let texts = texts.into_iter().map(|(name, text)| NewFile { name, bytes: text.into_bytes() });
    // A program that is already in the folder is used in place.
    let copies = found.copies.into_iter().filter(|copy| {
        let place = fs::canonicalize(folder.join(&copy.file.name));
        !place.is_ok_and(|place| fs::canonicalize(&copy.source).is_ok_and(|source| source == place))
    });
    let all: Vec<NewFile> = texts.chain(copies.map(|copy| copy.file)).collect();
    let paths = files::write_new(folder, &all)?;
    let findings = found.reports.iter().flat_map(|report| &report.diagnostics);
    let idle = findings.filter(|finding| finding.code == IDLE_PROGRAM);
    let idle: String =
        idle.map(|finding| format!("\n{}: {}\n", finding.code, finding.message)).collect();
    let marks = format!(
        "{idle}\ncomplete the entries marked FILL IN in cluster.toml: fail-safe outputs and plants\n"
    );
    Ok(written(folder, &paths, &marks).with_used(found.reports))
}

/// A file of one program or several that has been read.
pub(crate) struct Known<'a> {
    pub(crate) path: &'a Path,
    pub(crate) format: Option<Format>,
    pub(crate) source: Source,
    /// Its scan period, where the file states one.
    pub(crate) period: Option<Duration>,
}

/// Whether a cluster can be drafted from these files, all of which are right. It is drafted only where this does not follow from what
/// is known of them.
pub(crate) fn can_draft(folder: &Path, arguments: &[PathBuf], known: &[Known<'_>]) -> bool {
    let at_once = if arguments.len() == known.len() { follows(known) } else { None };
    at_once.unwrap_or_else(|| drafted(folder, arguments, &[]).is_ok())
}

/// Whether a cluster can be drafted; nothing where this does not follow.
fn follows(known: &[Known<'_>]) -> Option<bool> {
    let mut found = Found::default();
    for Known { path, format, source, period } in known {
        let is_one = !matches!(source, Source::Program(typed) if typed.tasks.len() > 1);
        let is_ordinary = is_one && DraftProgram::is_ordinary(source, *period);
        if !is_ordinary || *period != known.first()?.period {
            return None;
        }
        let given = Given::new(path);
        let (unit, name) = given.names(source, *format, true)?;
        let program = DraftProgram::new(name, String::new(), String::new(), source);
        found.take(&given, program, &unit, source);
    }
    found.check();
    Some(!found.is_wrong())
}

/// The texts of the draft, which was checked, and what was found; `outputs` are variables that are made outputs.
fn drafted(
    folder: &Path,
    arguments: &[PathBuf],
    outputs: &[String],
) -> Result<(Vec<(String, String)>, Found), Answer> {
    let mut found = Found::default();
    for given in Given::all(arguments) {
        found.read(&given, outputs);
    }
    found.check();
    found.check_outputs(outputs);
    if found.is_wrong() {
        return Err(found.refusal());
    }
    let texts = found.draft(folder).files();
    found.check_draft(&texts);
    if found.is_wrong() {
        return Err(found.refusal());
    }
    Ok((texts, found))
}

/// A file named on the command line, or the files of a project.
struct Given<'a> {
    name: Option<&'a str>,
    path: PathBuf,
    /// All files, where it is a program only together with other ones.
    files: Vec<PathBuf>,
}

impl<'a> Given<'a> {
    /// `NAME=FILE` or a file. An existing file whose name contains `=` is a file.
    fn new(argument: &'a Path) -> Self {
        let split = argument.to_str().and_then(|text| text.split_once('='));
        let (name, path) = match split {
            Some((name, file)) if !argument.exists() && !name.contains('/') => {
                (Some(name), file.into())
            }
            _ => (None, argument.to_owned()),
        };
        Self { name, path, files: Vec::new() }
    }

    /// Files that use each other are one project, in place of its first file; the first name among them is its name.
    fn all(arguments: &'a [PathBuf]) -> Vec<Self> {
        let mut all: Vec<Self> = arguments.iter().map(|argument| Self::new(argument)).collect();
        let paths: Vec<&Path> = all.iter().map(|given| given.path.as_path()).collect();
        for files in files::groups(&paths) {
            let is_part = |given: &Self| files.contains(&given.path);
            let name = all.iter().filter(|given| is_part(given)).find_map(|given| given.name);
            all.retain(|given| !is_part(given) || given.path == files[0]);
            if let Some(first) = all.iter_mut().find(|given| given.path == files[0]) {
                first.name = name;
                first.files = files;
            }
        }
        all
    }

    /// Its text, where it looks like a program.
    fn text(&self) -> Result<ProgramText, Answer> {
        match self.files.as_slice() {
            [] => ProgramText::expected(&self.path),
            files => ProgramText::together(self.path.display().to_string(), files),
        }
    }

    /// The name of a program of the file there, and that of its controller; nothing for a library.
    fn names(
        &self,
        source: &Source,
        format: Option<Format>,
        is_only: bool,
    ) -> Option<(String, String)> {
        let unit = match source {
            Source::Program(typed) => typed.name.clone(),
            Source::Library(_) => return None,
        };
        // Digraphs are unnamed, and several programs have no common name.
        let stem = self.path.file_stem().unwrap_or_default().to_string_lossy();
        let are_several = matches!(source, Source::Program(typed) if typed.tasks.len() > 1);
        let own = match format {
            Some(Format::Digraph) => stem,
            _ if are_several && is_name(&stem) => stem,
            _ => unit.split(',').next().unwrap_or(&unit).into(),
        };
        let name = self.controller(&own, is_only);
        Some((unit, name))
    }

    /// Controller name for one program of the file.
    fn controller(&self, program: &str, is_only: bool) -> String {
        match self.name {
            None => program.to_owned(),
            Some(name) if is_only => name.to_owned(),
            Some(name) => format!("{name}-{program}"),
        }
    }
}

/// A program to write to the folder.
struct Copied {
    source: PathBuf,
    file: NewFile,
}

#[derive(Default)]
struct Found {
    programs: Vec<DraftProgram>,
    copies: Vec<Copied>,
    /// Given file of each program.
    sources: Vec<PathBuf>,
    periods: Vec<Duration>,
    reports: Vec<Report>,
    failures: Vec<Failure>,
    /// The wanted outputs that a program has.
    outputs: HashSet<String>,
    /// Names of variables that could be outputs.
    memory: Vec<String>,
}

impl Found {
    fn read(&mut self, given: &Given<'_>, outputs: &[String]) {
        let file = match given.text() {
            Ok(read) => read,
            Err(answer) => {
                self.failures.extend(answer.failures);
                self.reports.extend(answer.reports);
                return;
            }
        };
        // The files of a project become one text.
        let copies = if file.is_one_file() { Copies::AsRead } else { Copies::Written };
        let (mut programs, diagnostics) = read_apart(&file.name, &file.text, copies);
        if !outputs.is_empty() && !has_errors(&diagnostics) {
            match read_with_outputs(&file.name, &file.text, outputs) {
                Ok(None) => {}
                Ok(Some(changed)) => {
                    self.outputs.extend(changed.outputs);
                    programs = changed.programs;
                }
                Err(OutputError::Write(error)) => {
                    self.fail(code(&error), format!("{}: {error}", file.name));
                }
                Err(OutputError::Refused(code, reason)) => {
                    self.fail(code, format!("{}: {reason}", file.name));
                }
            }
        }
        let mut file = file.found(diagnostics);
        let is_only = programs.len() == 1;
        for program in programs {
            self.add(given, program, is_only, &mut file.report);
        }
        self.reports.extend(file.reports());
    }

    /// A program of a file: a copy of the file, or a text of its own where the file has several.
    fn add(&mut self, given: &Given<'_>, program: Apart, is_only: bool, report: &mut Report) {
        let Apart { source, period, written } = program;
        let format = Format::of(&report.name, &report.text);
        let Some((unit, name)) = given.names(&source, format, is_only) else {
            return;
        };
        let (ending, bytes) = match written {
            None => match files::bytes(&given.path) {
                Ok(whole) => (ending(&given.path, format), whole),
                Err(answer) => {
                    self.failures.extend(answer.failures);
                    return;
                }
            },
            Some(Ok((format, written))) => {
                report.diagnostics.extend(written.losses);
                (format.ending().to_owned(), written.text.into_bytes())
            }
            Some(Err(error)) => {
                let message = format!("{}: {unit}: {error}", report.name);
                self.fail(code(&error), message);
                return;
            }
        };
        let file = format!("{name}.{ending}");
        let origin = format!("{}, program {unit}", report.name);
        let drafted = DraftProgram::new(name, file.clone(), origin, &source);
        self.periods.extend(period);
        self.copies
            .push(Copied { source: given.path.clone(), file: NewFile { name: file, bytes } });
        self.take(given, drafted, &unit, &source);
    }

    /// Takes a program of a file, with the name that it has there.
    fn take(&mut self, given: &Given<'_>, drafted: DraftProgram, unit: &str, source: &Source) {
        if !drafted.has_outputs() {
            let such_as = memory(source).next().map(|name| format!(", such as `{name}`"));
            let message = format!(
                "{}: the program `{unit}` has no outputs to protect; name what it computes{} with --output, declare it as an output (VAR_OUTPUT, or AT %Q…) or omit the program",
                given.path.display(),
                such_as.unwrap_or_default()
            );
            self.fail("U0622", message);
        }
        self.memory.extend(memory(source).map(str::to_owned));
        self.sources.push(given.path.clone());
        self.programs.push(drafted);
    }

    /// Number and names of the programs.
    fn check(&mut self) {
        let mut failures = Vec::new();
        let mut taken: HashMap<String, &Path> = HashMap::new();
        for other in Draft::other_members() {
            taken.insert(other.to_owned(), Path::new(""));
        }
        for (program, source) in self.programs.iter().zip(&self.sources) {
            let name = program.name();
            let file = source.display();
            let fix = format!("name it on the command line: --from NAME={file}");
            if !is_name(name) || name.len() > MAXIMUM_PROGRAM_NAME {
                let message = format!(
                    "{file}: {name:?} is not a controller name: expected a letter followed by letters, digits, `-` and `_`, at most {MAXIMUM_PROGRAM_NAME} characters; {fix}"
                );
                failures.push(("U0623", message));
                continue;
            }
            let members = program.members();
            if let Some(member) = members.iter().find(|member| taken.contains_key(*member)) {
                let whose = match taken[member] {
                    path if path == Path::new("") => "is the understudy".to_owned(),
                    path => format!("comes from {}", path.display()),
                };
                let message = format!(
                    "{file}: the program `{name}` requires the name `{member}`, which is in use: it {whose}; {fix}"
                );
                failures.push(("U0624", message));
                continue;
            }
            taken.extend(members.map(|member| (member, source.as_path())));
        }
        if self.programs.len() > MAXIMUM_PROGRAMS {
            let message = format!(
                "{} programs: a cluster has at most {MAXIMUM_PROGRAMS}; divide them into several clusters",
                self.programs.len()
            );
            failures.push(("U0625", message));
        }
        for (code, message) in failures {
            self.fail(code, message);
        }
    }

    /// Every wanted output is a variable of a program.
    fn check_outputs(&mut self, wanted: &[String]) {
        if self.reports.iter().any(Report::has_errors) {
            return;
        }
        let lacking = wanted.iter().filter(|output| !self.outputs.contains(*output));
        for output in lacking.collect::<Vec<_>>() {
            let (_, name) = output.rsplit_once('.').unwrap_or(("", output));
            let message = match self.memory.iter().any(|known| known.eq_ignore_ascii_case(name)) {
                true => format!(
                    "--output {output}: only a variable of a PROGRAM or a global one becomes an output, and none at an address (AT %M…); declare it at an address in %Q"
                ),
                false => format!(
                    "--output {output}: no program has a variable of this name in its memory or among its global variables; {}",
                    suggestion(output, self.memory.iter().map(String::as_str))
                ),
            };
            self.fail(NO_OUTPUT, message);
        }
    }

    fn draft(&mut self, folder: &Path) -> Draft {
        // All programs run in one cycle, as those of one file do.
        let common = self.periods.iter().copied().reduce(duration::common);
        Draft::new(
            cluster_name(folder),
            common.unwrap_or(USUAL_PERIOD),
            std::mem::take(&mut self.programs),
        )
    }

    /// Reads the drafted cluster as it will be on disk and reports all errors.
    fn check_draft(&mut self, texts: &[(String, String)]) {
        let (file, text) = &texts[0];
        let copies = &self.copies;
        let loaded = read_cluster(file, text, &mut |wanted| {
            let drafted = texts.iter().find(|(name, _)| name == wanted);
            if let Some((_, text)) = drafted {
                return Ok(text.clone());
            }
            let copy = copies.iter().find(|copy| copy.file.name == wanted);
            let copy = copy.ok_or_else(|| "cannot be drafted".to_owned())?;
            decode(copy.file.bytes.clone()).map_err(|error| error.to_string())
        });
        for report in &loaded.reports {
            let errors = report.diagnostics.iter();
            for error in errors.filter(|found| found.severity == Severity::Error) {
                self.fail(error.code, error.message.clone());
            }
        }
    }

    fn fail(&mut self, code: &str, message: String) {
        self.failures.push(Failure { code: code.to_owned(), message });
    }

    fn is_wrong(&self) -> bool {
        !self.failures.is_empty() || self.reports.iter().any(Report::has_errors)
    }

    fn refusal(self) -> Answer {
        let mut answer = Answer::bad_files(self.reports);
        answer.failures = self.failures;
        answer
    }
}

/// Variables of a program that are neither inputs nor outputs.
fn memory(source: &Source) -> impl Iterator<Item = &str> {
    let typed = match source {
        Source::Program(typed) => Some(typed),
        Source::Library(_) => None,
    };
    typed.into_iter().flat_map(|typed| {
        let names = typed.variables.iter().map(|variable| variable.name.as_str());
        names.filter(|name| typed.inputs.find(name).or(typed.outputs.find(name)).is_none())
    })
}

/// File extension of a copy, with the format of the original.
fn ending(path: &Path, format: Option<Format>) -> String {
    let name = path.to_string_lossy();
    match (Format::of_ending(&name), path.extension()) {
        (Some(_), Some(ending)) => ending.to_string_lossy().to_lowercase(),
        _ => format.map_or("", Format::ending).to_owned(),
    }
}

/// Cluster name: the legal characters of the folder name.
fn cluster_name(folder: &Path) -> String {
    let absolute = std::path::absolute(folder).unwrap_or_default();
    let name = absolute.file_name().unwrap_or_default().to_string_lossy();
    let legal = |letter: char| {
        if letter.is_ascii_alphanumeric() || letter == '_' { letter } else { '-' }
    };
    let name: String = name.chars().map(legal).take(MAXIMUM_PROGRAM_NAME).collect();
    if is_name(&name) { name } else { "cluster".to_owned() }
}
