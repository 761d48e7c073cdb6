//! Programs of LDmicro (`*.ld`): a ladder editor and compiler for small microcontrollers.
//!
//! ```text
//! LDmicro0.1
//! CYCLE=10000
//! IO LIST
//!     Xbutton at 21
//!     Yled at 30
//! END
//! PROGRAM
//! RUNG
//!     CONTACTS Xbutton 0
//!     TON Tpause 500000
//!     COIL Yled 0 0 0
//! END
//! ```
//!
//! Its numbers are shared by name between counters, resets, moves and comparisons, and its instructions act in the middle of a
//! wire; so a rung is written out as statements and lowered as Structured Text is. What each element does is described in
//! `docs/reference/ldmicro.md`; what only a microcontroller has is listed with its line.

mod limits;
mod parse;
mod statements;

use std::time::Duration;

use understudy_ladder::{Name, Program};
use understudy_text::{Diagnostic, has_errors};

/// What was read.
#[derive(Debug, Clone, Default)]
pub struct Reading {
    /// The program, where there are no errors.
    pub program: Option<Program>,
    /// The cycle time; `RTO` counts in cycles of it.
    pub period: Option<Duration>,
    /// Everything that was found, in the order of its place.
    pub diagnostics: Vec<Diagnostic>,
}

/// Reads a file under the name `name`, which its format does not hold.
pub fn read(name: &str, text: &str) -> Reading {
    let (file, mut diagnostics) = parse::parse(text);
    let mut program = None;
    if !has_errors(&diagnostics) {
        let (written, found) = statements::statements(&file);
        diagnostics.extend(found);
        if !has_errors(&diagnostics) {
            let reading = crate::text::read(&written.text, None);
            diagnostics.extend(
                reading
                    .diagnostics
                    .into_iter()
                    .map(|found| Diagnostic { span: written.place_of(found.span.start), ..found }),
            );
            program = reading.program;
        }
    }
    diagnostics.sort_by_key(|found| found.span.start);
    diagnostics.dedup();
    let mut program = program.filter(|_| !has_errors(&diagnostics));
    if let Some(program) = &mut program {
        let legal = |letter: char| {
            if letter.is_alphanumeric() { letter } else { '_' }
        };
        let name: String = name.chars().map(legal).take(100).collect();
        let starts = name.starts_with(|first: char| first.is_alphabetic());
        program.name = Name::from(if starts { name } else { format!("program_{name}") });
    }
    Reading { program, period: file.period, diagnostics }
}
