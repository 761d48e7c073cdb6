//! The document of the format says what is true.

use understudy_ladder::{BlockKind, parse};

const DOCUMENT: &str = include_str!("../../../../docs/reference/ladder-format.md");

#[test]
fn the_example_of_the_document_is_sound() {
    let example = DOCUMENT
        .split("```text\n")
        .nth(1)
        .and_then(|rest| rest.split("```").next())
        .expect("an example");
    assert_eq!(parse(example).diagnostics, []);
}

#[test]
fn the_document_names_the_inputs_and_outputs_of_every_block() {
    let time = std::time::Duration::ZERO;
    for kind in [
        BlockKind::Ton(time),
        BlockKind::Tof(time),
        BlockKind::Tp(time),
        BlockKind::Ctu(0),
        BlockKind::Ctd(0),
        BlockKind::Ctud(0),
        BlockKind::Sr,
        BlockKind::Rs,
        BlockKind::RTrig,
        BlockKind::FTrig,
    ] {
        let row = DOCUMENT
            .lines()
            .filter(|line| line.starts_with(&format!("| `{{{} ", kind.word())))
            .find(|line| line.matches('|').count() == 6)
            .expect("a row");
        let cells: Vec<&str> = row.split('|').map(str::trim).collect();
        assert_eq!(cells[2], kind.wire_input());
        for (pin, required) in kind.side_inputs() {
            let cell = if *required { format!("{pin} (required)") } else { (*pin).to_owned() };
            assert!(cells[3].split(", ").any(|known| known == cell), "{row}");
        }
        for output in kind.outputs() {
            assert!(cells[4].split(", ").any(|known| known == *output), "{row}");
        }
    }
}

/// The codes that the sources can give, and those of the document's table, each with its severity.
#[test]
fn the_document_lists_every_code() {
    let sources = [
        include_str!("../../src/check.rs"),
        include_str!("../../src/check/report.rs"),
        include_str!("../../src/lexer.rs"),
        include_str!("../../src/lower.rs"),
        include_str!("../../src/parser.rs"),
        include_str!("../../src/parser/rung.rs"),
    ];
    let mut used: Vec<&str> = sources
        .iter()
        .flat_map(|source| source.split("\"U0").skip(1))
        .map(|rest| &rest[..3])
        .collect();
    used.sort_unstable();
    used.dedup();
    let listed: Vec<&str> = DOCUMENT
        .lines()
        .filter_map(|line| line.strip_prefix("| U0"))
        .map(|rest| &rest[..3])
        .collect();
    assert_eq!(used, listed);
}
