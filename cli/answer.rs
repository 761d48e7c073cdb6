//! What a command answers, for people and for machines alike.

use std::borrow::Cow;
use std::ffi::OsStr;

use schemars::JsonSchema;
use serde::Serialize;
use serde_json::{Map, Value};
use understudy_text::{
    Diagnostic, Lines, MAXIMUM_MESSAGE, Position, Report, Severity, shell, shortened,
};

/// The most findings of all files together that an answer shows.
const MAXIMUM_SHOWN: usize = 500;

/// The most failures that an answer shows.
const MAXIMUM_FAILURES: usize = 100;

/// How a command ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Status {
    /// Exit status 0.
    Done,
    /// Exit status 1: a run, or a check of what came of it.
    Failed,
    /// Exit status 2: nothing was started.
    BadInput,
    /// Exit status 3: the host woke members too late for a verdict.
    Inconclusive,
}

impl Status {
    pub(crate) fn code(self) -> u8 {
        match self {
            Self::Done => 0,
            Self::Failed => 1,
            Self::BadInput => 2,
            Self::Inconclusive => 3,
        }
    }
}

/// A failure that has no place in a file.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, JsonSchema)]
pub(crate) struct Failure {
    /// Stable code, such as `U0501`.
    pub(crate) code: String,
    /// What failed, with the names and numbers concerned.
    pub(crate) message: String,
}

/// What a command answers.
#[derive(Debug)]
pub(crate) struct Answer {
    pub(crate) status: Status,
    /// For standard output.
    pub(crate) text: String,
    /// The same for machines.
    pub(crate) result: Value,
    /// Files that were read, with what was found in them.
    pub(crate) reports: Vec<Report>,
    /// Nobody asked about the files: people are told how many warnings there are, and where to see them.
    pub(crate) counts_warnings: bool,
    pub(crate) failures: Vec<Failure>,
    pub(crate) about: Box<About>,
}

/// What few commands add to their answer.
#[derive(Debug, Default)]
pub(crate) struct About {
    /// Those of its numbers that stand at the top of the document too.
    pub(crate) numbers: Map<String, Value>,
    /// Commands that are useful after this one when it ended well; for people only.
    pub(crate) next: Vec<String>,
}

impl Answer {
    pub(crate) fn done(text: impl Into<String>, result: impl Serialize) -> Self {
        Self {
            status: Status::Done,
            text: text.into(),
            result: serde_json::to_value(result).unwrap_or(Value::Null),
            reports: Vec::new(),
            counts_warnings: false,
            failures: Vec::new(),
            about: Box::default(),
        }
    }

    pub(crate) fn failed(status: Status, code: &str, message: impl Into<String>) -> Self {
        Self::done("", Value::Null).and_failure(status, code, message)
    }

    pub(crate) fn bad_files(reports: Vec<Report>) -> Self {
        Self {
            status: Status::BadInput,
            ..Self::done("", Value::Null).with_reports(reports)
        }
    }

    pub(crate) fn with_reports(mut self, reports: Vec<Report>) -> Self {
        self.reports = reports;
        self
    }

    /// Files that the command used: their warnings are counted for people, and told whole to machines.
    pub(crate) fn with_used(self, reports: Vec<Report>) -> Self {
        Self {
            counts_warnings: true,
            ..self.with_reports(reports)
        }
    }

    pub(crate) fn with_numbers(mut self, numbers: Map<String, Value>) -> Self {
        self.about.numbers = numbers;
        self
    }

    /// A command that is useful after this one, by its arguments.
    pub(crate) fn and_next(mut self, arguments: &[&dyn AsRef<OsStr>]) -> Self {
        let words = arguments.iter();
        let words: Vec<_> = words.map(|word| word.as_ref().to_string_lossy()).collect();
        self.about
            .next
            .push(shell_line(words.iter().map(Cow::as_ref)));
        self
    }

    pub(crate) fn with_status(mut self, status: Status) -> Self {
        self.status = status;
        self
    }

    pub(crate) fn and_failure(
        mut self,
        status: Status,
        code: &str,
        message: impl Into<String>,
    ) -> Self {
        self.status = status;
        self.failures.push(Failure {
            code: code.to_owned(),
            message: message.into(),
        });
        self
    }

    /// Bounds the failures and their messages, which may quote a file.
    pub(crate) fn bound(&mut self) {
        let left = self.failures.len().saturating_sub(MAXIMUM_FAILURES);
        self.failures.truncate(MAXIMUM_FAILURES);
        for failure in &mut self.failures {
            if let Cow::Owned(short) = shortened(&failure.message, 4 * MAXIMUM_MESSAGE) {
                failure.message = short;
            }
        }
        if left > 0 {
            self.failures.push(Failure {
                code: "U0617".to_owned(),
                message: format!("{left} more failures are not shown"),
            });
        }
    }
}

/// A call of this program as a line of a shell.
pub(crate) fn shell_line<'a>(arguments: impl IntoIterator<Item = &'a str>) -> String {
    shell::line(std::iter::once("understudy").chain(arguments))
}

/// The findings of each file that an answer shows.
pub(crate) fn shown(reports: &[Report]) -> impl Iterator<Item = (&Report, Vec<Diagnostic>)> {
    let mut left = MAXIMUM_SHOWN;
    reports.iter().map(move |report| {
        let shown = report.shown(left);
        left = left.saturating_sub(shown.len());
        (report, shown)
    })
}

/// The document that every command answers with under `--json`.
#[derive(Debug, Serialize, JsonSchema)]
pub(crate) struct Envelope<'a> {
    /// The version of this program.
    understudy: &'a str,
    /// The command.
    command: &'a str,
    /// The exit status: 0 done, 1 failed, 2 bad input and nothing was started.
    status: u8,
    /// What was found in the files that were read.
    diagnostics: Vec<PlacedDiagnostic<'a>>,
    /// What failed, apart from what was found in files.
    failures: &'a [Failure],
    /// What the command answers; its shape is described for each command.
    result: &'a Value,
    /// The numbers of `reliability` once more, such as `mttf_paper_hours`.
    #[serde(flatten)]
    numbers: &'a Map<String, Value>,
}

/// A diagnostic with its place.
#[derive(Debug, Serialize, JsonSchema)]
struct PlacedDiagnostic<'a> {
    /// The file as it was given.
    file: &'a str,
    /// Counted from 1.
    line: usize,
    /// Counted from 1, in characters.
    column: usize,
    /// The end, not included.
    end_line: usize,
    /// The end, not included.
    end_column: usize,
    /// Stable code, such as `U0104`.
    code: &'static str,
    /// `error` or `warning`.
    severity: &'static str,
    /// What is wrong.
    message: String,
    /// Short text at the place.
    label: Option<String>,
    /// The way out.
    help: Option<String>,
    /// Other places of the same file that explain this one.
    related: Vec<PlacedRelated>,
}

/// Another place.
#[derive(Debug, Serialize, JsonSchema)]
struct PlacedRelated {
    /// Counted from 1.
    line: usize,
    /// Counted from 1, in characters.
    column: usize,
    /// What is to be seen there.
    message: String,
}

impl<'a> Envelope<'a> {
    pub(crate) fn new(command: &'a str, answer: &'a Answer) -> Self {
        Self {
            understudy: env!("CARGO_PKG_VERSION"),
            command,
            status: answer.status.code(),
            diagnostics: shown(&answer.reports).flat_map(placed).collect(),
            failures: &answer.failures,
            result: &answer.result,
            numbers: &answer.about.numbers,
        }
    }
}

fn placed((report, found): (&Report, Vec<Diagnostic>)) -> Vec<PlacedDiagnostic<'_>> {
    if found.is_empty() {
        return Vec::new();
    }
    let lines = Lines::new(&report.text);
    let place = |diagnostic: Diagnostic| {
        let start = lines.position(diagnostic.span.start);
        let end = lines.position(diagnostic.span.end);
        let related = diagnostic.related.into_iter().map(|related| {
            let Position { line, column } = lines.position(related.span.start);
            PlacedRelated {
                line,
                column,
                message: related.message,
            }
        });
        PlacedDiagnostic {
            file: &report.name,
            line: start.line,
            column: start.column,
            end_line: end.line,
            end_column: end.column,
            code: diagnostic.code,
            severity: match diagnostic.severity {
                Severity::Error => "error",
                Severity::Warning => "warning",
            },
            message: diagnostic.message,
            label: diagnostic.label,
            help: diagnostic.help,
            related: related.collect(),
        }
    };
    found.into_iter().map(place).collect()
}
