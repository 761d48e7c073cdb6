//! What several tests need.

use std::time::Duration;

use understudy_ladder::{Program, parse};

/// The period of one scan in tests that do not vary it.
pub(crate) const PERIOD: Duration = Duration::from_millis(100);

/// The program that `text` says; it must be without errors.
pub(crate) fn program(text: &str) -> Program {
    match parse(text).into_result() {
        Ok((program, _)) => program,
        Err(diagnostics) => panic!("{diagnostics:#?}\n{text}"),
    }
}
