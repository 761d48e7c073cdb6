//! Nothing is left out in silence, whatever the form: without any one word of a file, the program or a finding is another.

use std::ops::Range;

use understudy_interchange::{Format, digraph};
use understudy_ladder::print;

use crate::reading::{reading, source};

mod intervals;
mod outputs;
#[path = "../shared/reading.rs"]
mod reading;

/// The words and signs of a text: letters and digits, or one other character.
fn words(text: &str) -> Vec<Range<usize>> {
    let belongs =
        |letter: char| letter.is_alphanumeric() || matches!(letter, '_' | '%' | '#' | '.');
    let mut words = Vec::new();
    let mut start = 0;
    while let Some(first) = text[start..].chars().next() {
        let length = if belongs(first) {
            text[start..].find(|letter| !belongs(letter)).unwrap_or(text.len() - start)
        } else {
            first.len_utf8()
        };
        if !first.is_whitespace() {
            words.push(start..start + length);
        }
        start += length;
    }
    words
}

/// The words without which a text is read in the same way, each with its line.
fn unread(format: Format, text: &str, pieces: impl Iterator<Item = Range<usize>>) -> Vec<String> {
    let whole = reading(format, text);
    let mut unread = Vec::new();
    for piece in pieces {
        // A blank in its place keeps its neighbours apart.
        let without = format!("{} {}", &text[..piece.start], &text[piece.end..]);
        if reading(format, &without) == whole {
            let start = text[..piece.start].rfind('\n').map_or(0, |place| place + 1);
            let line = text[start..].lines().next().unwrap_or_default();
            unread.push(format!("{} of {}", &text[piece], line.trim()));
        }
    }
    unread
}

fn lines(text: &str) -> impl Iterator<Item = Range<usize>> {
    let mut end = 0;
    text.split_inclusive('\n').map(move |line| {
        end += line.len();
        end - line.len()..end - usize::from(line.ends_with('\n'))
    })
}

fn check(format: Format, text: &str, pieces: impl Iterator<Item = Range<usize>>, allowed: &[&str]) {
    let found = source(format, text);
    assert!(found.source.is_some(), "{:#?}", found.diagnostics);
    let mut unread = unread(format, text, pieces);
    unread.retain(|unread| !allowed.iter().any(|allowed| unread.starts_with(allowed)));
    assert_eq!(unread, Vec::<String>::new(), "{}", reading(format, text));
}

#[test]
fn every_word_of_structured_text_counts() {
    let text = include_str!("texts/all.st");
    // Semicolons that may be left out, and names of the configuration that have no meaning here.
    let allowed = [
        "; of END_",
        "; of VAR",
        "; of nobody",
        "; of word",
        "; of idle:",
        "c of CONFIGURATION",
        "r of RESOURCE",
        "plc of RESOURCE",
        "RESOURCE of RESOURCE",
        "ON of RESOURCE",
    ];
    let text = &text[..text.find("    TASK").expect("a task")];
    let text = format!(
        "{text}    TASK t(INTERVAL := T#20ms); TASK u(INTERVAL := T#50ms); END_RESOURCE END_CONFIGURATION"
    );
    let configuration = text.find("  RESOURCE").expect("a resource");
    let words = words(&text).into_iter().filter(|word| word.end < configuration);
    check(Format::StructuredText, &text, words, &allowed);
}

#[test]
fn every_word_of_ldmicro_counts() {
    let text = include_str!("texts/all.ld");
    let words: Vec<Range<usize>> = words(text);
    let lines = lines(text).filter(|line| !line.is_empty());
    // Settings of the compiler for the microcontroller.
    let allowed = ["CRYSTAL=", "4000000"];
    check(Format::LdMicro, text, words.into_iter().chain(lines), &allowed);
}

#[test]
fn every_word_of_a_ladder_counts() {
    let text = include_str!("../../../ladder/tests/ladder/every-element.ladder");
    check(Format::Ladder, text, words(text).into_iter(), &[]);
    for seed in 0..6 {
        let text = print(&understudy_testing::random::random_program(seed, 5));
        check(Format::Ladder, &text, words(&text).into_iter(), &[]);
    }
}

#[test]
fn every_element_of_a_digraph_counts() {
    for seed in 0..6 {
        let text = digraph::write(&understudy_testing::random::random_program(seed, 5));
        let document = roxmltree::Document::parse(&text).expect("XML");
        let is_drawn = |node: &roxmltree::Node<'_, '_>| {
            let drawing = ["Vertices", "startX", "startY"];
            node.ancestors().any(|node| drawing.contains(&node.tag_name().name()))
        };
        let nodes = document.descendants().filter(|node| node.is_element() && !is_drawn(node));
        let mut places = Vec::new();
        for node in nodes {
            places.push(node.range());
            let attributes =
                node.attributes().filter(|attribute| attribute.name() != "graphNumber");
            places.extend(attributes.map(|attribute| attribute.range()));
        }
        // Addresses are declared; another one at an edge is a finding.
        check(Format::Digraph, &text, places.into_iter(), &["<address>"]);
    }
}

#[test]
fn an_empty_program_is_not_taken_without_a_word() {
    let xml = r#"<project xmlns="http://www.plcopen.org/xml/tc6_0201"><types><pous><pou name="p" pouType="program"><body><LD/></body></pou></pous></types></project>"#;
    for (format, text) in [
        (Format::PlcOpen, xml),
        (Format::StructuredText, "PROGRAM p END_PROGRAM"),
        (Format::LdMicro, "LDmicro0.1\nPROGRAM\n"),
        (Format::Digraph, "<LadderDiagram name=\"p\"/>"),
    ] {
        let found = source(format, text).diagnostics;
        assert!(found.iter().any(|found| found.code == "U1023"), "{format:?}: {found:?}");
    }
}

#[test]
fn an_address_of_an_edge_that_is_not_the_declared_one_is_said() {
    let program =
        understudy_ladder::parse("program p\ninput a at %IX0.1\noutput y\nrung a ( y )\n").program;
    let text = digraph::write(&program);
    let changed = text.replacen("<address>000.01</address>", "<address>000.02</address>", 1);
    assert_ne!(text, changed);
    assert!(source(Format::Digraph, &text).diagnostics.is_empty());
    let found = source(Format::Digraph, &changed).diagnostics;
    assert_eq!(found.iter().map(|found| found.code).collect::<Vec<_>>(), ["U1068"]);
}

#[test]
fn names_that_differ_by_case_alone_are_named_both() {
    let text = "PROGRAM p VAR_INPUT a : BOOL; A : BOOL; END_VAR VAR_OUTPUT y : BOOL; END_VAR y := a; END_PROGRAM";
    let found = source(Format::StructuredText, text);
    assert!(found.source.is_none());
    let messages: Vec<&str> =
        found.diagnostics.iter().map(|found| found.message.as_str()).collect();
    assert!(
        messages.iter().any(|message| message.contains("`a`") && message.contains("`A`")),
        "{messages:?}"
    );
}

#[test]
fn the_interval_of_a_task_is_a_time_within_the_bounds() {
    let text = |interval: &str| {
        format!(
            "PROGRAM p VAR_INPUT a : BOOL; END_VAR VAR_OUTPUT y : BOOL; END_VAR y := a; END_PROGRAM
            CONFIGURATION c RESOURCE r ON plc TASK t(INTERVAL := {interval}, PRIORITY := 1); PROGRAM i WITH t : p; END_RESOURCE END_CONFIGURATION"
        )
    };
    for interval in ["T#-10ms", "-T#10ms", "T#0s", "T#2h", "soon", "10"] {
        let found = source(Format::StructuredText, &text(interval));
        assert!(found.source.is_none(), "{interval}");
    }
    let found = source(Format::StructuredText, &text("T#20ms"));
    assert_eq!(found.diagnostics, []);
    assert_eq!(found.period, Some(std::time::Duration::from_millis(20)));
}

/// Many warnings before an error do not hide it: nothing is taken that was not understood.
#[test]
fn an_error_behind_many_warnings_is_an_error() {
    let words: String =
        (0..300).map(|place| format!("w{place} AT %QW{place} : INT (0..1);\n")).collect();
    let text =
        format!("PROGRAM p VAR {words} y AT %QX0.0 : BOOL; END_VAR y := unknown; END_PROGRAM");
    assert!(source(Format::StructuredText, &text).source.is_none());
    let persist = "RUNG\n    CONTACTS Xa 0\n    PERSIST Xa\n    COIL Yb 0 0 0\nEND\n".repeat(300);
    let text = format!("LDmicro0.1\nPROGRAM\n{persist}RUNG\n    WARP Xa\n    COIL Yc 0 0 0\nEND\n");
    assert!(source(Format::LdMicro, &text).source.is_none());
    let edge = r#"<Edge type="OpenContactEdge" colour="red"><from>0</from><to>1</to><symbol>a</symbol></Edge>"#;
    let coil = r#"<Edge type="OpenOutputEdge"><from>1</from><to>2</to><symbol>y</symbol></Edge>"#;
    let graphs = format!("<Graph><Edges>{edge}{coil}</Edges></Graph>").repeat(300);
    let wrong = coil.replace("OpenOutputEdge", "NoEdge");
    let text = format!(
        r#"<LadderDiagram name="p">{graphs}<Graph><Edges>{edge}{wrong}</Edges></Graph></LadderDiagram>"#
    );
    assert!(source(Format::Digraph, &text).source.is_none());
}
