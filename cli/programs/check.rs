//! `understudy check`: all errors and warnings of project files.

mod next;
mod remarks;
mod retained;

use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

use clap::Args;
use serde::Serialize;
use understudy_cluster::{Cluster, Code, Overrides, SourceText};
use understudy_interchange::{Format, Source, USUAL_PERIOD, Wanted, read_source, unknown_form};
use understudy_journal::Members;
use understudy_ladder::Program as Ladder;
use understudy_scenarios::read;
use understudy_supervisor::ladder::read_map;
use understudy_supervisor::petri::read_net;
use understudy_supervisor::{read_ads, read_generator, read_module};
use understudy_text::duration;
use understudy_text::{Diagnostic, Report, Severity, has_errors};
use understudy_typed::{Cost, Program};
use understudy_wire::ProgramId;

use crate::answer::{Answer, Failure, Status};
use crate::files::{self, ProgramText, read_cluster};
use crate::kind::Kind;
use crate::plants;
use crate::programs::init::from::Known;
use crate::supervisors::automata;
use crate::supervisors::reconfigure::read_project;
use remarks::{Looking, RungSize};
use retained::Retained;

/// Check files and report all errors and warnings
#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  understudy check examples/press-cell/cluster.toml scenarios/kill-each.toml
  understudy check --json examples/press-cell/robot.ladder
  understudy check examples/boiler/main.ladder --rung-size 11x7
  understudy check examples/assembly-cell/model.toml examples/assembly-cell/net.toml examples/boiler/main-map.toml
  understudy check MAIN.TcPOU E_Mode.TcDUT
  understudy check examples/other-tools/conveyor

Files that use what another one declares are checked as one program, as are those of a TwinCAT project (.plcproj) or of a folder. The programs of a cluster are checked with it. Names in a scenario are checked against the cluster file given with it, otherwise against the
cluster.toml in its folder. Ladder programs are also checked for rungs without effect, coils with conflicting values in one scan, and
sequence steps that are passed in one scan; `understudy verify` shows example runs. Warnings do not change the exit status.")]
pub(crate) struct Arguments {
    /// Programs (.ladder, .st, .xml and others), automata of TCT (.ADS), Supremica (.wmod) and libFAUDES (.gen), and clusters, plants, scenarios, models, nets, signal maps and projects (.toml)
    #[arg(value_name = "FILE", required = true)]
    files: Vec<PathBuf>,
    /// The program to check in a text with several programs and no configuration
    #[arg(long, value_name = "NAME")]
    program: Option<String>,
    /// The largest rung that the target takes, as elements across and lines down, such as 11x7; larger ones are warnings
    #[arg(long, value_name = "ACROSSxDOWN")]
    rung_size: Option<RungSize>,
    /// Time limit for the optional checks of large programs
    #[arg(long, value_name = "TIME", default_value = "1s", value_parser = duration::parse)]
    budget: Duration,
}

#[derive(Serialize)]
struct Result {
    files: Vec<CheckedFile>,
    errors: usize,
    warnings: usize,
}

#[derive(Serialize)]
struct CheckedFile {
    name: String,
    /// `ladder`, `cluster`, `plant`, `scenario`, `model`, `net`, `map`, `project`, `ADS`, `module`, `generator` or `unknown`; null for an unreadable file.
    kind: Option<&'static str>,
    errors: usize,
    warnings: usize,
    /// Programs of a cluster or a project that have errors.
    wrong_programs: usize,
    /// Whether the time limit ended the optional checks early.
    cut_short: bool,
    /// Memory and time of a program with numbers.
    #[serde(skip_serializing_if = "Option::is_none")]
    size: Option<Size>,
    /// What a warm start keeps.
    #[serde(skip_serializing_if = "Option::is_none")]
    retained: Option<Retained>,
    /// Function blocks and functions of a text without a program.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    units: Vec<String>,
}

/// What a program with numbers takes.
#[derive(Clone, Copy, Serialize)]
struct Size {
    /// State that a joining station receives, in bytes.
    state_bytes: u64,
    /// Operations of a scan, at most.
    operations: u64,
    /// Whether only the budget bounds its loops.
    bounded_by_budget: bool,
}

impl Size {
    fn of(program: &Program) -> Self {
        let cost = Cost::new(program);
        Self {
            state_bytes: cost.state_bytes,
            operations: cost.worst_case(),
            bounded_by_budget: cost.is_bounded_by_budget(),
        }
    }

    fn text(self) -> String {
        let Self { state_bytes, operations, bounded_by_budget } = self;
        let budget = if bounded_by_budget { ", the limit for its loops" } else { "" };
        format!("; state {state_bytes} bytes, at most {operations} operations a scan{budget}")
    }
}

#[derive(Default)]
struct Found<'a> {
    /// The named files, in their order.
    given: Vec<(Kind, &'a Path)>,
    cut_short: Vec<String>,
    wrong_programs: Vec<(String, usize)>,
    sizes: Vec<(String, Size)>,
    retained: Vec<(String, Retained)>,
    libraries: Vec<(String, Vec<String>)>,
    /// Programs of one file each.
    known: Vec<Known<'a>>,
    reports: Vec<(Kind, Report)>,
    failures: Vec<Failure>,
    unreadable: Vec<String>,
}

pub(crate) fn run(arguments: &Arguments) -> Answer {
    let looking = Looking::new(arguments.budget, arguments.rung_size);
    let mut found = Found::default();
    let mut scenarios = Vec::new();
    let mut clusters = Vec::new();
    // Types and blocks can be in files of their own: files that use each other are one program.
    let named: Vec<&Path> = arguments.files.iter().map(PathBuf::as_path).collect();
    let projects = files::groups(&named);
    let parts: Vec<PathBuf> = projects.iter().flatten().cloned().collect();
    let program = arguments.program.as_deref();
    for files in &projects {
        let name = files[0].display().to_string();
        found.add_joined(&files[0], ProgramText::together(name, files), program, &looking);
    }
    for path in &arguments.files {
        if parts.contains(path) {
            found.given.push((Kind::Program, path));
            continue;
        }
        if path.is_dir() || files::is_project(path) {
            let libraries = found.libraries.len();
            found.add_joined(path, ProgramText::of(path), program, &looking);
            if found.libraries.len() == libraries {
                found.given.push((Kind::Program, path));
            }
            continue;
        }
        let Some(text) = found.text(path) else {
            continue;
        };
        let kind = Kind::of(path, &text);
        found.given.push((kind, path));
        match kind {
            Kind::Ads => {
                let diagnostics = read_ads(&text).diagnostics;
                found.add_file(Kind::Ads, path, text, diagnostics);
            }
            Kind::Module => {
                let diagnostics = read_module(&text).diagnostics;
                found.add_file(Kind::Module, path, text, diagnostics);
            }
            Kind::Generator => {
                let diagnostics = read_generator(&text).diagnostics;
                found.add_file(Kind::Generator, path, text, diagnostics);
            }
            Kind::Net => {
                let diagnostics = read_net(&text).diagnostics;
                found.add_file(Kind::Net, path, text, diagnostics);
            }
            Kind::Map => {
                let diagnostics = read_map(&text).diagnostics;
                found.add_file(Kind::Map, path, text, diagnostics);
            }
            Kind::Model => found.add_model(path),
            Kind::Program => {
                let name = path.display().to_string();
                let (source, period, diagnostics) =
                    found.read_program(&name, &name, &text, program, &looking);
                let format = Format::of(&name, &text);
                found.known.extend(source.map(|source| Known { path, format, source, period }));
                found.add_file(Kind::Program, path, text, diagnostics);
            }
            Kind::Unknown => {
                let diagnostics = vec![unknown_form(&text)];
                found.add_file(Kind::Unknown, path, text, diagnostics);
            }
            Kind::Scenario => scenarios.push((path, text)),
            Kind::Plant => found.add(Kind::Plant, plants::read(path, &text).report),
            Kind::Project => {
                found.add_with_ladders(Kind::Project, read_project(path, &text).reports);
            }
            Kind::Cluster => {
                let mut loaded = read_cluster(path, &text, Overrides::default());
                if let Some(cluster) = &loaded.cluster {
                    found.look(&looking, cluster, &mut loaded.reports);
                }
                found.add_with_ladders(Kind::Cluster, loaded.reports);
                clusters.extend(loaded.cluster.as_ref().map(Members::of));
            }
        }
    }
    for (path, text) in scenarios {
        let members = match clusters.as_slice() {
            [only] => Some(only.clone()),
            _ => members_beside(path),
        };
        let scenario = read(&path.display().to_string(), &text, members.as_ref());
        found.add(Kind::Scenario, scenario.report);
    }
    let given = std::mem::take(&mut found.given);
    let known = std::mem::take(&mut found.known);
    let libraries: Vec<PathBuf> = found.libraries.iter().map(|(name, _)| name.into()).collect();
    let files = next::Files { given: &given, known: &known, parts: &parts, libraries: &libraries };
    next::after_check(found.answer(), arguments.program.as_deref(), &files)
}

/// Members of the `cluster.toml` in the folder of a scenario, if it is valid.
fn members_beside(scenario: &Path) -> Option<Members> {
    let path = scenario.with_file_name("cluster.toml");
    let text = files::text(&path).ok()?;
    let cluster = read_cluster(&path, &text, Overrides::default()).cluster?;
    Some(Members::of(&cluster))
}

impl Found<'_> {
    /// Reads a program, with the period that it states and what was found; what is known of it is told of the file `shown`.
    fn read_program(
        &mut self,
        name: &str,
        shown: &str,
        text: &str,
        program: Option<&str>,
        looking: &Looking,
    ) -> (Option<Source>, Option<Duration>, Vec<Diagnostic>) {
        let file = read_source(name, text, Wanted { program, period: None });
        let every = file.period.unwrap_or(USUAL_PERIOD);
        match &file.source {
            Some(Source::Program(typed)) => {
                let executable = || {
                    let source = Arc::new(SourceText::of(name, text, every));
                    let code = Code::of(Arc::clone(typed), file.ladder().cloned(), source);
                    code.ok().map(|code| code.executable())
                };
                self.list(shown, typed, Retained::of(typed, executable), file.ladder());
            }
            Some(Source::Library(units)) => self.libraries.push((shown.to_owned(), units.clone())),
            None => {}
        }
        let mut diagnostics = file.diagnostics;
        let rungs = file.rungs.filter(|_| file.source.is_some());
        if rungs.is_some_and(|rungs| looking.at_rungs(&rungs.ladder, every, &mut diagnostics)) {
            self.cut_short.push(shown.to_owned());
        }
        (file.source, file.period, diagnostics)
    }

    /// Lists what a program keeps, and the memory and the time that its statements take.
    fn list(
        &mut self,
        shown: &str,
        program: &Program,
        retained: Option<Retained>,
        written: Option<&Ladder>,
    ) {
        self.retained.extend(retained.map(|retained| (shown.to_owned(), retained)));
        if written.is_none() {
            self.sizes.push((shown.to_owned(), Size::of(program)));
        }
    }

    /// Reports on the files of a project, which are one program.
    fn add_joined(
        &mut self,
        path: &Path,
        text: std::result::Result<ProgramText, Answer>,
        program: Option<&str>,
        looking: &Looking,
    ) {
        let reports = match text {
            Ok(text) => {
                let first = text.first_file().to_owned();
                let (_, _, found) =
                    self.read_program(&text.name, &first, &text.text, program, looking);
                text.reports(found)
            }
            Err(answer) => {
                if answer.reports.is_empty() {
                    self.unreadable.push(path.display().to_string());
                }
                self.failures.extend(answer.failures);
                answer.reports
            }
        };
        for report in reports {
            self.add(Kind::Program, report);
        }
    }

    /// Checks the rungs of the programs of a cluster and its understudy.
    fn look(&mut self, looking: &Looking, cluster: &Cluster, reports: &mut [Report]) {
        let period = cluster.agreement().schedule.period();
        let mut seen = Vec::new();
        for (program, controller) in (0..).map(ProgramId).zip(cluster.controllers()) {
            let of_it = |report: &&mut Report| Path::new(&report.name).ends_with(&controller.file);
            let Some(report) = reports.iter_mut().find(of_it) else {
                continue;
            };
            let known = seen.contains(&report.name) || has_errors(&report.diagnostics);
            seen.push(report.name.clone());
            let typed = controller.code.typed();
            let retained = Retained::of(typed, || Some(controller.code.executable()))
                .map(|retained| retained.writing(cluster.retained_bytes_a_day(program)));
            self.list(&report.name, typed, retained, controller.ladder());
            if !known
                && let Some(ladder) = controller.ladder()
                && looking.at_rungs(ladder, period, &mut report.diagnostics)
            {
                self.cut_short.push(report.name.clone());
            }
        }
        if let Some(report) = reports.first_mut()
            && looking.at_understudy(cluster, report)
        {
            self.cut_short.push(report.name.clone());
        }
    }

    fn text(&mut self, path: &Path) -> Option<String> {
        match files::text(path) {
            Ok(text) => Some(text),
            Err(answer) => {
                self.unreadable.push(path.display().to_string());
                self.failures.extend(answer.failures);
                None
            }
        }
    }

    fn add_file(&mut self, kind: Kind, path: &Path, text: String, diagnostics: Vec<Diagnostic>) {
        let report = Report { name: path.display().to_string(), text, diagnostics };
        self.add(kind, report);
    }

    /// Reads a model with its nets and automata.
    fn add_model(&mut self, path: &Path) {
        let reports = match automata::model(path) {
            Ok(sources) => sources.reports,
            Err(answer) => answer.reports,
        };
        for (index, report) in reports.into_iter().enumerate() {
            let kind = match index {
                0 => Kind::Model,
                _ if report.name.ends_with(".toml") => Kind::Net,
                _ => Kind::Ads,
            };
            self.add(kind, report);
        }
    }

    /// Reports on a file and the ladders that it names.
    fn add_with_ladders(&mut self, kind: Kind, reports: Vec<Report>) {
        let wrong = reports.iter().skip(1).filter(|report| count(report, Severity::Error) > 0);
        let wrong = wrong.count();
        if let Some(first) = reports.first() {
            self.wrong_programs.push((first.name.clone(), wrong));
        }
        for (index, report) in reports.into_iter().enumerate() {
            self.add(if index == 0 { kind } else { Kind::Program }, report);
        }
    }

    /// Reports each ladder once, also if several files name it.
    fn add(&mut self, kind: Kind, report: Report) {
        if !self.reports.iter().any(|(_, known)| known.name == report.name) {
            self.reports.push((kind, report));
        }
    }

    fn answer(self) -> Answer {
        let checked = self.reports.iter().map(|(kind, report)| CheckedFile {
            name: report.name.clone(),
            kind: Some(kind.word()),
            errors: count(report, Severity::Error),
            warnings: count(report, Severity::Warning),
            wrong_programs: found_of(&self.wrong_programs, &report.name).unwrap_or(0),
            cut_short: self.cut_short.contains(&report.name),
            size: found_of(&self.sizes, &report.name),
            retained: found_of(&self.retained, &report.name),
            units: found_of(&self.libraries, &report.name).unwrap_or_default(),
        });
        let unreadable = self.unreadable.into_iter().map(|name| CheckedFile {
            name,
            kind: None,
            errors: 1,
            warnings: 0,
            wrong_programs: 0,
            cut_short: false,
            size: None,
            retained: None,
            units: Vec::new(),
        });
        let files: Vec<CheckedFile> = checked.chain(unreadable).collect();
        let errors = files.iter().map(|file| file.errors).sum();
        let warnings = files.iter().map(|file| file.warnings).sum();
        let mut text = String::new();
        let width = files.iter().map(|file| file.name.chars().count()).max().unwrap_or(0);
        for file in &files {
            let verdict = match (file.errors, file.warnings, file.wrong_programs) {
                (0, 0, 0) => "right".to_owned(),
                (0, warnings, 0) => format!("right, {}", number(warnings, "warning")),
                (0, _, 1) => "1 of its programs has errors".to_owned(),
                (0, _, wrong) => format!("{wrong} of its programs have errors"),
                (errors, 0, _) => number(errors, "error"),
                (errors, warnings, _) => {
                    format!("{}, {}", number(errors, "error"), number(warnings, "warning"))
                }
            };
            let kind = file.kind.unwrap_or("");
            let mut more = String::new();
            if file.cut_short {
                more +=
                    "; optional checks incomplete: increase --budget or use `understudy verify`";
            }
            if !file.units.is_empty() {
                let units = match file.units.len() {
                    1 => "1 unit".to_owned(),
                    units => format!("{units} units"),
                };
                more += &format!("; a library without a program: {units} checked");
            }
            more += &file.size.map(Size::text).unwrap_or_default();
            more += &file.retained.as_ref().map(Retained::text).unwrap_or_default();
            let _ = writeln!(text, "{:width$}  {kind:8}  {verdict}{more}", file.name);
        }
        let status = if errors == 0 { Status::Done } else { Status::BadInput };
        let result = Result { files, errors, warnings };
        let mut answer = Answer::done(text, result)
            .with_status(status)
            .with_reports(self.reports.into_iter().map(|(_, report)| report).collect());
        answer.failures = self.failures;
        answer
    }
}

fn count(report: &Report, severity: Severity) -> usize {
    let diagnostics = report.diagnostics.iter();
    diagnostics.filter(|diagnostic| diagnostic.severity == severity).count()
}

/// What was found out about the file of a name.
fn found_of<T: Clone>(found: &[(String, T)], name: &str) -> Option<T> {
    let found = found.iter().find(|(known, _)| known == name);
    found.map(|(_, value)| value.clone())
}

fn number(count: usize, what: &str) -> String {
    match count {
        1 => format!("1 {what}"),
        _ => format!("{count} {what}s"),
    }
}
