//! What several tests need.

use std::time::Duration;

use understudy_interchange::structured_text::read;
use understudy_ladder::{Program, check};
use understudy_text::Diagnostic;

pub(crate) const PERIOD: Duration = Duration::from_millis(100);

/// The one program of a text without errors.
pub(crate) fn program(text: &str) -> Program {
    let reading = read(text);
    let errors = understudy_text::has_errors(&reading.diagnostics);
    assert!(!errors, "{:#?}\n{text}", reading.diagnostics);
    let [program] = reading.programs.as_slice() else {
        panic!("one program is expected:\n{text}");
    };
    let found = check(program);
    assert!(
        !understudy_text::has_errors(&found),
        "{found:#?}\n{}\n{text}",
        understudy_ladder::print(program)
    );
    program.clone()
}

/// What is found in a text, each with its line and column.
pub(crate) fn findings(text: &str, diagnostics: Vec<Diagnostic>) -> String {
    let report = understudy_text::Report {
        name: "text".into(),
        text: text.into(),
        diagnostics,
    };
    let lines = report.diagnostics.iter().map(|found| {
        let place = report.line_and_column(found.span.start);
        let help = found
            .help
            .as_ref()
            .map(|help| format!("\n      {help}"))
            .unwrap_or_default();
        format!(
            "{place}: {} {:?}: {}{help}\n",
            found.code, found.severity, found.message
        )
    });
    lines.collect()
}
