//! What is said of a bad text.

use understudy_interchange::structured_text::read;

use crate::support::findings;

fn check(text: &str) -> String {
    let reading = read(text);
    if understudy_diagnostic::has_errors(&reading.diagnostics) {
        assert!(reading.programs.is_empty());
    }
    findings(text, reading.diagnostics)
}

#[test]
fn everything_is_said_in_one_run() {
    insta::assert_snapshot!(check(include_str!("texts/full-of-errors.st")));
}
