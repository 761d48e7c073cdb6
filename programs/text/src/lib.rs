//! What every reader of a text file shares: diagnostics, spelling, TOML tables, XML with bounds, and durations.
//!
//! Readers of files return what they understood *and* a list of [`Diagnostic`]s, so that one run shows every error.
//! A diagnostic has a stable code (`U0123`), a place in its source and, where one can be named, the fix. This crate
//! holds the data; the command line draws it. [`pages`] documents each code, [`spelling`] suggests the name that was
//! meant, [`tables`] reads TOML as tables of known keys, and [`duration`] is the one form of a duration in text.

pub mod duration;
mod encoding;
mod lines;
pub mod markup;
pub mod pages;
pub mod shell;
mod shown;
pub mod spelling;
pub mod tables;
mod visible;
mod words;
pub mod xml;

use std::fmt;
use std::ops::Range;

use serde::Serialize;

pub use encoding::{NotText, decode};
pub use lines::Lines;
#[doc(hidden)]
pub use serde;
pub use shown::{MAXIMUM_FINDINGS, MAXIMUM_MESSAGE, MAXIMUM_SHOWN, shortened};
pub use visible::{visible, visible_json};

/// How bad it is: an error stops whatever was asked for, a warning does not.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Severity {
    /// Legal, and probably not what was meant.
    Warning,
    /// Nothing is started from a file that has one.
    Error,
}

/// One finding about one place of one source.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Diagnostic {
    /// Stable code for people and search engines, such as `U0104`.
    pub code: &'static str,
    /// Error or warning.
    pub severity: Severity,
    /// What is wrong, in one sentence, with the numbers and names concerned.
    pub message: String,
    /// Byte range in the source; empty at the place where something is missing.
    pub span: Range<usize>,
    /// Short text at the span, such as "expected a contact".
    pub label: Option<String>,
    /// Other places that explain this one.
    pub related: Vec<Related>,
    /// The way out: what to write, or the known name that is nearest to a misspelt one.
    pub help: Option<String>,
}

/// A second place that explains a diagnostic, such as the first declaration of a name declared twice.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Related {
    /// Byte range in the same source.
    pub span: Range<usize>,
    /// What is to be seen there.
    pub message: String,
}

impl Diagnostic {
    /// An error at `span`.
    pub fn error(code: &'static str, message: impl Into<String>, span: Range<usize>) -> Self {
        Self::new(Severity::Error, code, message.into(), span)
    }

    /// A warning at `span`.
    pub fn warning(code: &'static str, message: impl Into<String>, span: Range<usize>) -> Self {
        Self::new(Severity::Warning, code, message.into(), span)
    }

    fn new(severity: Severity, code: &'static str, message: String, span: Range<usize>) -> Self {
        Self { code, severity, message, span, label: None, related: Vec::new(), help: None }
    }

    /// Adds the short text at the span.
    #[must_use]
    pub fn with_label(mut self, label: impl Into<String>) -> Self {
        self.label = Some(label.into());
        self
    }

    /// Adds a second place.
    #[must_use]
    pub fn with_related(mut self, span: Range<usize>, message: impl Into<String>) -> Self {
        self.related.push(Related { span, message: message.into() });
        self
    }

    /// Adds the way out.
    #[must_use]
    pub fn with_help(mut self, help: impl Into<String>) -> Self {
        self.help = Some(help.into());
        self
    }
}

/// A source text with its name, and what was found in it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Report {
    /// The file's name as the user gave it.
    pub name: String,
    /// Its whole text; the spans of `diagnostics` point into it.
    pub text: String,
    /// In the order of their places.
    pub diagnostics: Vec<Diagnostic>,
}

impl Report {
    /// True where at least one diagnostic is an error.
    pub fn has_errors(&self) -> bool {
        has_errors(&self.diagnostics)
    }

    /// 1-based line and column (in characters) of one byte offset; [`Lines`] is for many.
    pub fn line_and_column(&self, offset: usize) -> Position {
        Lines::new(&self.text).position(offset)
    }
}

/// True where at least one of `diagnostics` is an error.
pub fn has_errors(diagnostics: &[Diagnostic]) -> bool {
    diagnostics.iter().any(|diagnostic| diagnostic.severity == Severity::Error)
}

/// A place in a text, both counted from 1.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct Position {
    /// Line.
    pub line: usize,
    /// Column in characters.
    pub column: usize,
}

impl fmt::Display for Position {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{}:{}", self.line, self.column)
    }
}
