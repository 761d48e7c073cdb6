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

/// Random numbers, the same for the same seed.
pub(crate) struct Dice(u64);

impl Dice {
    pub(crate) fn new(seed: u64) -> Self {
        Self(seed ^ 0x9e37_79b9_7f4a_7c15)
    }

    pub(crate) fn next(&mut self) -> u64 {
        // SplitMix64.
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut value = self.0;
        value = (value ^ value >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        value = (value ^ value >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
        value ^ value >> 31
    }

    pub(crate) fn below(&mut self, bound: usize) -> usize {
        usize::try_from(self.next() % bound as u64).expect("a small bound")
    }

    pub(crate) fn bits(&mut self, count: usize) -> Vec<bool> {
        (0..count).map(|_| self.below(2) == 1).collect()
    }
}
