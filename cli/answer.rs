//! What a command answers, for people and for machines alike.

use schemars::JsonSchema;
use serde::Serialize;
use serde_json::{Map, Value};
use understudy_diagnostic::{Report, Severity};

/// How a command ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Status {
    /// Exit status 0.
    Done,
    /// Exit status 1: a run, or a check of what came of it.
    Failed,
    /// Exit status 2: nothing was started.
    BadInput,
}

impl Status {
    pub(crate) fn code(self) -> u8 {
        match self {
            Self::Done => 0,
            Self::Failed => 1,
            Self::BadInput => 2,
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
    /// Those of its numbers that stand at the top of the document too.
    pub(crate) numbers: Box<Map<String, Value>>,
    /// Files that were read, with what was found in them.
    pub(crate) reports: Vec<Report>,
    /// Nobody asked about the files: people are told how many warnings there are, and where to see them.
    pub(crate) counts_warnings: bool,
    pub(crate) failures: Vec<Failure>,
}

impl Answer {
    pub(crate) fn done(text: impl Into<String>, result: impl Serialize) -> Self {
        Self {
            status: Status::Done,
            text: text.into(),
            result: serde_json::to_value(result).unwrap_or(Value::Null),
            numbers: Box::default(),
            reports: Vec::new(),
            counts_warnings: false,
            failures: Vec::new(),
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
        *self.numbers = numbers;
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
    code: &'a str,
    /// `error` or `warning`.
    severity: &'a str,
    /// What is wrong.
    message: &'a str,
    /// Short text at the place.
    label: Option<&'a str>,
    /// The way out.
    help: Option<&'a str>,
    /// Other places of the same file that explain this one.
    related: Vec<PlacedRelated<'a>>,
}

/// Another place.
#[derive(Debug, Serialize, JsonSchema)]
struct PlacedRelated<'a> {
    /// Counted from 1.
    line: usize,
    /// Counted from 1, in characters.
    column: usize,
    /// What is to be seen there.
    message: &'a str,
}

impl<'a> Envelope<'a> {
    pub(crate) fn new(command: &'a str, answer: &'a Answer) -> Self {
        Self {
            understudy: env!("CARGO_PKG_VERSION"),
            command,
            status: answer.status.code(),
            diagnostics: answer.reports.iter().flat_map(placed).collect(),
            failures: &answer.failures,
            result: &answer.result,
            numbers: &answer.numbers,
        }
    }
}

fn placed(report: &Report) -> impl Iterator<Item = PlacedDiagnostic<'_>> {
    report.diagnostics.iter().map(|diagnostic| {
        let start = report.line_and_column(diagnostic.span.start);
        let end = report.line_and_column(diagnostic.span.end);
        let related = diagnostic.related.iter().map(|related| {
            let place = report.line_and_column(related.span.start);
            PlacedRelated {
                line: place.line,
                column: place.column,
                message: &related.message,
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
            message: &diagnostic.message,
            label: diagnostic.label.as_deref(),
            help: diagnostic.help.as_deref(),
            related: related.collect(),
        }
    })
}
