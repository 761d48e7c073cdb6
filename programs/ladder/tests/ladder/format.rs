//! The document of the format says what is true.

use understudy_ladder::{BlockKind, Parsed, parse, print};

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
        include_str!("../../src/check/retention.rs"),
        include_str!("../../src/check/size.rs"),
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

#[test]
fn the_names_of_another_maker_are_those_of_the_blocks() {
    let text = |timer: &str, counter: &str, value: &str| {
        format!(
            "program p\ninput a\ninput r\noutput y\noutput z\nrung\n    a {{TON t 1s}}\nrung\n    a {{CTU c 5 R=[ r | {timer} ]}}\n\
             rung\n    [ {timer} | /{counter} {value} >= 3 ] ( y )\nrung\n    a {{CTUD d 5 CD=r}}\nrung\n    d.{} ( z )\n",
            if timer == "t.Q" { "QU" } else { "DN" }
        )
    };
    let own = parse(&text("t.Q", "c.Q", "c.CV"));
    let other = parse(&text("t.DN", "c.DN", "c.ACC"));
    let found = |parsed: &Parsed| parsed.diagnostics.iter().map(|one| one.code).collect::<Vec<_>>();
    assert_eq!(found(&other), found(&own), "{:?}", other.diagnostics);
    assert_eq!(print(&other.program), print(&own.program));
    // A signal of this name stays what it is, and a block that counts nothing has no such output.
    let signal = parse("program p\ninput t.DN\noutput y\nrung\n    t.DN {TON u 1s} ( y )\n");
    assert!(print(&signal.program).contains("    t.DN {TON u 1s}"), "{:?}", signal.diagnostics);
    for wrong in ["{R_TRIG t}", "{SR t R=b}"] {
        let parsed = parse(&format!(
            "program p\ninput a\ninput b\noutput y\nrung\n    a {wrong}\nrung\n    t.DN ( y )\n"
        ));
        assert!(found(&parsed).contains(&"U0104"), "{wrong}");
    }
    let timing =
        parse("program p\ninput a\noutput y\nrung\n    a {TON t 1s}\nrung\n    t.TT ( y )\n");
    let help =
        timing.diagnostics.iter().find(|one| one.code == "U0104").and_then(|one| one.help.clone());
    assert!(help.is_some_and(|help| help.contains("/t.Q")), "{:?}", timing.diagnostics);
}

#[test]
fn the_size_of_a_rung_is_that_of_its_drawing() {
    for (network, size) in [
        ("a", (1, 1)),
        ("", (0, 1)),
        ("a a a", (3, 1)),
        ("[ a | a a | a ] a", (3, 3)),
        ("a [ a [ a | a ] | a ] {TON t 1s}", (4, 3)),
        ("[ a | a ] [ a | a | a ]", (2, 3)),
    ] {
        let parsed = parse(&format!("program p\ninput a\noutput y\nrung\n    {network} ( y )\n"));
        assert_eq!(parsed.program.rungs[0].size(), size, "{network}: {:?}", parsed.diagnostics);
    }
}
