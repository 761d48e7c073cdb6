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
//! wire; so a rung is written out as the statements of a program. What each element does is described in
//! `docs/reference/ldmicro.md`; what only a microcontroller has is listed with its line.

mod limits;
mod parse;
mod statements;

use std::time::Duration;

use understudy_structured_text::parser::parse_at;
use understudy_structured_text::syntax::{File, Name, ProgramInstance, Retention, Task};
use understudy_text::{Diagnostic, has_errors};

/// Reads a file under the name `name`, which its format does not hold: one program, run at the cycle time of the file, and everything that was
/// found, in the order of its place. The places are those of the elements.
pub(crate) fn read(name: &str, text: &str) -> (File, Vec<Diagnostic>) {
    let (file, mut diagnostics) = parse::parse(text);
    let mut program = File::default();
    if !has_errors(&diagnostics) {
        let (written, found) = statements::statements(name, &file);
        diagnostics.extend(found);
        if !has_errors(&diagnostics) {
            let (read, found) = parse_at(&written.text, &|span| written.place_of(span.start));
            diagnostics.extend(found);
            program = read;
            run(&mut program, file.period);
        }
    }
    diagnostics.sort_by_key(|found| found.span.start);
    diagnostics.dedup();
    (program, diagnostics)
}

/// Runs the program by a task of that interval.
fn run(file: &mut File, interval: Option<Duration>) {
    let interval = interval.and_then(|interval| i64::try_from(interval.as_nanos()).ok());
    if let (Some(unit), Some(interval)) = (file.units.first(), interval) {
        let of = unit.name.clone();
        let task = Name::new("cycle", of.span());
        file.instances.push(ProgramInstance {
            retention: Retention::Unstated,
            name: of.clone(),
            task: Some(task.clone()),
            of,
            connections: Vec::new(),
        });
        let (interval, priority) = (Some(interval), Some(0));
        file.tasks.push(Task { name: task, interval, priority, single: None });
    }
}
