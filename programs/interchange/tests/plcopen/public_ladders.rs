//! Ladders of other people, where they are at hand: each is read, or what of it is not taken is listed with its place.

use std::collections::BTreeMap;

use understudy_interchange::plcopen::read;
use understudy_text::Severity;

use crate::support::{PERIOD, data};

/// Counts only: several of the files may be read and not copied.
#[test]
fn each_is_read_or_what_is_not_taken_is_listed() {
    let Some(index) = data("ladder/index.json") else {
        return;
    };
    let index = std::fs::read_to_string(index).expect("a file that exists");
    let index: serde_json::Value = serde_json::from_str(&index).expect("an index");
    let mut lines = Vec::new();
    for entry in index.as_array().expect("files") {
        let file = entry["file"].as_str().expect("a name");
        let Some(path) = data(&format!("ladder/{file}")) else {
            continue;
        };
        let text = std::fs::read_to_string(path).expect("a file that exists");
        let mut reading = read(&text, None);
        if reading.diagnostics.iter().any(|found| found.code == "U1013") {
            // A library: each of its units is read for itself.
            for unit in units(&text) {
                let found = read(&text, Some(&unit));
                lines.push(format!(
                    "{file} {unit}: {}",
                    if found.program.is_some() { "taken" } else { "not taken" }
                ));
                reading = found;
            }
        }
        let mut codes: BTreeMap<&str, usize> = BTreeMap::new();
        for found in &reading.diagnostics {
            if found.severity == Severity::Error {
                assert!(
                    !found.span.is_empty() || found.code == "U1013",
                    "{file}: {found:?} has a place"
                );
            }
            *codes.entry(found.code).or_default() += 1;
        }
        let codes: Vec<String> =
            codes.iter().map(|(code, count)| format!("{code} {count}")).collect();
        let codes = if codes.is_empty() { "nothing".to_owned() } else { codes.join(", ") };
        let size = match &reading.program {
            None => "not taken".to_owned(),
            Some(program) => {
                let circuit = program.lower(PERIOD).expect("a program without errors");
                format!(
                    "{} rungs, {} contacts, {} blocks; {} inputs, {} outputs, {} registers",
                    program.rungs.len(),
                    program.contact_count(),
                    program.blocks().len(),
                    circuit.inputs().len(),
                    circuit.outputs().len(),
                    circuit.registers().len()
                )
            }
        };
        lines
            .push(format!("{file}: {size}; {} notes; found {codes}", reading.fidelity.notes.len()));
    }
    insta::assert_snapshot!(lines.join("\n"));
}

/// The names of the units of a file.
fn units(text: &str) -> Vec<String> {
    let parts = text.split("<pou name=\"").skip(1);
    parts.filter_map(|part| Some(part.split_once('"')?.0.to_owned())).collect()
}
