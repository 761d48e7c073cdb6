//! What is read of a file, to be compared.

use understudy_interchange::{Format, read};
use understudy_ladder::print;

/// What a reading is, but for the places in the file.
pub(crate) fn reading(format: Format, text: &str) -> String {
    let reading = read(format, "file", text, None);
    let program = reading.program.as_ref().map(print).unwrap_or_default();
    let found = reading.diagnostics.iter();
    let mut said: Vec<String> = found
        .map(|found| format!("{:?} {} {}", found.severity, found.code, found.message))
        .chain(reading.fidelity.notes.iter().map(|note| note.message.clone()))
        .collect();
    said.sort();
    format!("{program}\n{:?}\n{}", reading.period, said.join("\n"))
}
