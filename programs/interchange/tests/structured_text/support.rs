//! What several tests need.

use std::time::Duration;

use understudy_interchange::{Format, Reading, Wanted, read_source};
use understudy_ladder::{Program, check};
use understudy_text::Diagnostic;

pub(crate) const PERIOD: Duration = Duration::from_millis(100);

/// Reads a text as a ladder.
pub(crate) fn read(text: &str) -> Reading {
    understudy_interchange::read(Format::StructuredText, "text.st", text, None)
}

/// What is found in a text that is read as it is.
pub(crate) fn found(text: &str) -> Vec<Diagnostic> {
    let read = read_source("text.st", text, Wanted { period: Some(PERIOD), program: None });
    assert_eq!(understudy_text::has_errors(&read.diagnostics), read.source.is_none(), "{text}");
    read.diagnostics
}

/// The rungs of the one program of a text without errors.
pub(crate) fn program(text: &str) -> Program {
    let reading = read(text);
    let errors = understudy_text::has_errors(&reading.diagnostics);
    assert!(!errors, "{:#?}\n{text}", reading.diagnostics);
    let program = reading.program.expect("one program");
    let found = check(&program);
    assert!(
        !understudy_text::has_errors(&found),
        "{found:#?}\n{}\n{text}",
        understudy_ladder::print(&program)
    );
    program
}

/// What is found in a text, each with its line and column.
pub(crate) fn findings(text: &str, diagnostics: Vec<Diagnostic>) -> String {
    let report = understudy_text::Report { name: "text".into(), text: text.into(), diagnostics };
    let lines = report.diagnostics.iter().map(|found| {
        let place = report.line_and_column(found.span.start);
        let help = found.help.as_ref().map(|help| format!("\n      {help}")).unwrap_or_default();
        format!("{place}: {} {:?}: {}{help}\n", found.code, found.severity, found.message)
    });
    lines.collect()
}
