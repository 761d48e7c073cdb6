//! What the tests of several crates share: the press cell, a point of each kind, skipped tests, random numbers, random programs and tables of states.

mod cells;
mod folder;
pub mod points;
pub mod random;
pub mod states;

pub use folder::Folder;

use std::fmt::Display;
use std::fs::OpenOptions;
use std::io::{self, Write as _};
use std::thread;

pub use cells::{CELL_WITH_SPARE, COUNTER, cluster, line, press_cell};

/// Where [`skip`] writes a line for each test, for whoever counts them.
pub const LIST: &str = "UNDERSTUDY_SKIPPED";

/// Says that the running test, or a part of it, needs something that is not there: on the standard error of the test program, also where the
/// harness shows the output of failed tests alone, and in the file that [`LIST`] names.
pub fn skip(reason: impl Display) {
    let thread = thread::current();
    let line = format!("skipped: {}: {reason}\n", thread.name().unwrap_or("a test"));
    // The harness takes over what `eprint!` prints, and not what is written here.
    let _ = io::stderr().write_all(line.as_bytes());
    if let Some(list) = std::env::var_os(LIST) {
        let file = OpenOptions::new().append(true).create(true).open(list);
        let _ = file.and_then(|mut file| file.write_all(line.as_bytes()));
    }
}
