//! What is said of a bad text.

use crate::support::read;

use crate::support::findings;

fn check(text: &str) -> String {
    let reading = read(text);
    if understudy_text::has_errors(&reading.diagnostics) {
        assert!(reading.program.is_none());
    }
    findings(text, reading.diagnostics)
}

#[test]
fn everything_is_said_in_one_run() {
    insta::assert_snapshot!(check(include_str!("texts/full-of-errors.st")));
}
