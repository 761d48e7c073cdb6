//! Programs of other tools: Structured Text, digraph XML, LDmicro.

use std::time::Duration;

use understudy_interchange::{Format, digraph, read};
use understudy_ladder::{Program, check};

use crate::attack::attack;

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

/// What is taken is a ladder without errors, which becomes a circuit.
fn is_sound(program: &Program) {
    assert!(!understudy_text::has_errors(&check(program)));
    let _ = program.lower(Duration::from_millis(10));
}

#[test]
fn structured_text() {
    let seeds = [
        "programs/interchange/tests/structured_text/texts/blocks.st",
        "examples/other-tools/press.st",
        "programs/interchange/tests/structured_text/texts/full-of-errors.st",
    ];
    attack("structured_text", &seeds, |bytes| {
        let reading = read(Format::StructuredText, "text.st", &text(bytes), None);
        reading.program.iter().for_each(is_sound);
    });
}

#[test]
fn digraph() {
    let seeds = [
        "examples/other-tools/vents.xml",
        "programs/interchange/tests/digraph/bridge.xml",
        "programs/interchange/tests/digraph/full-of-errors.xml",
    ];
    attack("digraph", &seeds, |bytes| {
        let Some(program) = digraph::read(&text(bytes)).program else {
            return;
        };
        is_sound(&program);
        // What is right is the same after it was written.
        let written = digraph::write(&program);
        let again = digraph::read(&written).program.map(|again| digraph::write(&again));
        assert_eq!(again, Some(written));
    });
}

#[test]
fn ldmicro() {
    let seeds =
        ["examples/other-tools/light.ld", "programs/interchange/tests/ldmicro/full-of-errors.ld"];
    attack("ldmicro", &seeds, |bytes| {
        let reading = read(Format::LdMicro, "program.ld", &text(bytes), None);
        reading.program.iter().for_each(is_sound);
    });
}
