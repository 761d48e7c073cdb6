//! The answer of a command, as text and as JSON.

use std::borrow::Cow;
use std::ffi::OsStr;
use std::path::Path;

use schemars::JsonSchema;
use serde::Serialize;
use serde_json::{Map, Value};
use understudy_bus::BusError;
use understudy_text::{
    Diagnostic, Lines, MAXIMUM_MESSAGE, Position, Report, Severity, shell, shortened,
};

/// Maximum number of findings in an answer.
const MAXIMUM_SHOWN: usize = 500;

/// Maximum number of failures in an answer.
const MAXIMUM_FAILURES: usize = 100;

/// Exit status of a command.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Status {
    /// Exit status 0: success.
    Done,
    /// Exit status 1: a run or a check failed.
    Failed,
    /// Exit status 2: invalid input, nothing was started.
    BadInput,
    /// Exit status 3: the host was too slow for a verdict.
    Inconclusive,
    /// Exit status 4: a campaign ran, and found runs that fail.
    Found,
}

impl Status {
    pub(crate) fn code(self) -> u8 {
        match self {
            Self::Done => 0,
            Self::Failed => 1,
            Self::BadInput => 2,
            Self::Inconclusive => 3,
            Self::Found => 4,
        }
    }
}

/// A failure without a position in a file.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, JsonSchema)]
pub struct Failure {
    /// Stable code, such as `U0501`.
    pub code: String,
    /// What failed, with the names and numbers concerned.
    pub message: String,
}

/// Answer of a command.
#[derive(Debug)]
pub struct Answer {
    pub(crate) status: Status,
    /// Text for standard output.
    pub(crate) text: String,
    /// Result as JSON.
    pub(crate) result: Value,
    /// Files that were read, with their findings.
    pub(crate) reports: Vec<Report>,
    /// Print only the number of warnings, for commands that do not check files.
    pub(crate) counts_warnings: bool,
    pub(crate) failures: Vec<Failure>,
    pub(crate) about: Box<About>,
}

/// Parts of an answer that few commands use.
#[derive(Debug, Default)]
pub(crate) struct About {
    /// Numbers that are also top-level keys of the document.
    pub(crate) numbers: Map<String, Value>,
    /// Next steps after success; text only.
    pub(crate) next: Vec<String>,
    /// Findings that the text says: they are not counted again.
    pub(crate) told: Vec<Diagnostic>,
}

impl Answer {
    /// Success, with its text and its JSON.
    pub fn done(text: impl Into<String>, result: impl Serialize) -> Self {
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

    /// A failure with its stable code, such as `U0501`.
    pub fn failed(status: Status, code: &str, message: impl ToString) -> Self {
        Self::done("", Value::Null).and_failure(status, code, message)
    }

    /// Files with errors.
    pub fn bad_files(reports: Vec<Report>) -> Self {
        Self { status: Status::BadInput, ..Self::done("", Value::Null).with_reports(reports) }
    }

    pub(crate) fn with_reports(mut self, reports: Vec<Report>) -> Self {
        self.reports = reports;
        self
    }

    /// Files that the command used: the text counts the warnings that `check` lists and shows all others, JSON lists them.
    pub(crate) fn with_used(self, reports: Vec<Report>) -> Self {
        Self { counts_warnings: true, ..self.with_reports(reports) }
    }

    /// Findings in the files that the text says already.
    pub(crate) fn and_told(mut self, told: Vec<Diagnostic>) -> Self {
        self.about.told = told;
        self
    }

    pub(crate) fn with_numbers(mut self, numbers: Map<String, Value>) -> Self {
        self.about.numbers = numbers;
        self
    }

    /// Adds the name of a file that was written, as a line and as `file` of the result.
    pub(crate) fn and_written(mut self, path: &Path) -> Self {
        let name = path.display().to_string();
        if !self.text.is_empty() {
            self.text.push('\n');
        }
        self.text.push_str(&format!("written to {name}"));
        self.result["file"] = Value::String(name);
        self
    }

    /// Adds a next step, given by its arguments.
    pub(crate) fn and_next(mut self, arguments: &[&dyn AsRef<OsStr>]) -> Self {
        let words = arguments.iter();
        let words: Vec<_> = words.map(|word| word.as_ref().to_string_lossy()).collect();
        let line = std::iter::once("understudy").chain(words.iter().map(Cow::as_ref));
        self.about.next.push(shell::line(line));
        self
    }

    /// The same with another exit status.
    #[must_use]
    pub fn with_status(mut self, status: Status) -> Self {
        self.status = status;
        self
    }

    pub(crate) fn and_failure(
        mut self,
        status: Status,
        code: &str,
        message: impl ToString,
    ) -> Self {
        self.status = status;
        self.failures.push(Failure { code: code.to_owned(), message: message.to_string() });
        self
    }

    /// Message of the first failure.
    pub fn first_failure(&self) -> Option<&str> {
        self.failures.first().map(|failure| failure.message.as_str())
    }

    /// Limits the number and the length of failures.
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
                message: format!("{left} more failures omitted"),
            });
        }
    }
}

/// What ends a command early is an answer too.
impl From<Result<Answer, Answer>> for Answer {
    fn from(answer: Result<Answer, Answer>) -> Self {
        answer.unwrap_or_else(|failed| failed)
    }
}

impl From<BusError> for Answer {
    fn from(error: BusError) -> Self {
        Self::failed(Status::Failed, error.code(), error)
    }
}

/// Findings of each file, up to the maximum.
pub(crate) fn shown(reports: &[Report]) -> impl Iterator<Item = (&Report, Vec<Diagnostic>)> {
    let mut left = MAXIMUM_SHOWN;
    reports.iter().map(move |report| {
        let shown = report.shown(left);
        left = left.saturating_sub(shown.len());
        (report, shown)
    })
}

/// The document of every command with `--json`.
#[derive(Debug, Serialize, JsonSchema)]
pub(crate) struct Envelope<'a> {
    /// Version of this program.
    understudy: &'a str,
    /// Command.
    command: &'a str,
    /// Exit status: 0 success, 1 failed, 2 invalid input and nothing was started, 3 inconclusive, 4 a campaign found
    /// runs that fail.
    status: u8,
    /// Findings in the files that were read.
    diagnostics: Vec<PlacedDiagnostic<'a>>,
    /// Failures without a position in a file.
    failures: &'a [Failure],
    /// Result of the command; its structure depends on the command.
    result: &'a Value,
    /// Numbers of `reliability`, repeated at the top level, such as `mttf_paper_hours`.
    #[serde(flatten)]
    numbers: &'a Map<String, Value>,
}

/// A finding with its position.
#[derive(Debug, Serialize, JsonSchema)]
struct PlacedDiagnostic<'a> {
    /// File as named on the command line.
    file: &'a str,
    /// Counted from 1.
    line: usize,
    /// Counted from 1, in characters.
    column: usize,
    /// End, exclusive.
    end_line: usize,
    /// End, exclusive.
    end_column: usize,
    /// Stable code, such as `U0104`.
    code: &'static str,
    /// `error` or `warning`.
    severity: &'static str,
    /// Message.
    message: String,
    /// Short text at the position.
    label: Option<String>,
    /// Fix.
    help: Option<String>,
    /// Related positions in the same file.
    related: Vec<PlacedRelated>,
}

/// A related position.
#[derive(Debug, Serialize, JsonSchema)]
struct PlacedRelated {
    /// Counted from 1.
    line: usize,
    /// Counted from 1, in characters.
    column: usize,
    /// Message.
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
            PlacedRelated { line, column, message: related.message }
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
