//! The paper's digraphs, from outside.

#[path = "../structured_text/support.rs"]
#[allow(dead_code, reason = "other tests use the rest")]
mod support;

use proptest::prelude::*;
use understudy_interchange::digraph::{digraphs, draw_svg, read, write};
use understudy_ladder::{Interpreter, Program, parse, print};

use support::{PERIOD, findings};
use understudy_logic::Running;
use understudy_testing::random::Dice;

/// The program of an XML without errors.
fn program(xml: &str) -> Program {
    let reading = read(xml);
    assert!(
        !understudy_text::has_errors(&reading.diagnostics),
        "{:#?}\n{xml}",
        reading.diagnostics
    );
    reading.program.expect("a program without errors")
}

fn ladder(text: &str) -> Program {
    parse(text).into_result().expect("a sound program").0
}

#[test]
fn the_vents_of_the_paper() {
    let xml = include_str!("../../../../examples/other-tools/vents.xml");
    let reading = read(xml);
    let ladder = print(&program(xml));
    insta::assert_snapshot!(format!("{ladder}\n{}", findings(xml, reading.diagnostics)));
}

#[test]
fn everything_is_said_in_one_run() {
    let xml = include_str!("full-of-errors.xml");
    let reading = read(xml);
    assert!(reading.program.is_none());
    insta::assert_snapshot!(findings(xml, reading.diagnostics));
}

/// Power flows from the left to the right through a bridge, and every contact is there once.
#[test]
fn a_graph_that_is_neither_series_nor_parallel() {
    let bridge = program(include_str!("bridge.xml"));
    insta::assert_snapshot!(print(&bridge));
    let mut scans = Interpreter::new(&bridge, PERIOD).expect("a sound program");
    let names: Vec<&str> = bridge.inputs.iter().map(|input| input.name.as_str()).collect();
    assert_eq!(names, ["a", "b", "c", "d", "e"]);
    let (mut last_e, mut z) = (false, false);
    let mut dice = Dice::new(1);
    for _ in 0..200 {
        let inputs = dice.bits(5);
        let [a, b, c, d, e] = inputs[..] else {
            panic!("five inputs");
        };
        let (rising, below) = (e && !last_e, b || a && !c);
        last_e = e;
        z |= a;
        assert_eq!(scans.scan(&inputs), [a && d || below && rising, z]);
    }
}

fn check_round_trip(ladder: &Program, seed: u64) {
    let xml = write(ladder);
    let again = program(&xml);
    // Branches that hold nothing but branches are one with them; otherwise nothing changes.
    assert_eq!(write(&again), xml);
    let (one, other) = (ladder.lower(PERIOD).expect("sound"), again.lower(PERIOD).expect("sound"));
    let (mut one_runs, mut other_runs) = (Running::new(&one), Running::new(&other));
    let mut dice = Dice::new(seed);
    for scan in 0..16 {
        let inputs = dice.bits(ladder.inputs.len());
        assert_eq!(
            one_runs.step(&inputs),
            other_runs.step(&inputs),
            "scan {scan}\n{}\n{xml}",
            print(ladder)
        );
    }
    let svg = draw_svg(ladder);
    assert!(svg.contains("</svg>"));
}

const EXAMPLES: [&str; 4] = [
    include_str!("../../../../examples/press-cell/robot.ladder"),
    include_str!("../../../../examples/press-cell/press.ladder"),
    include_str!("../../../../examples/boiler/main.ladder"),
    include_str!("../../../ladder/tests/ladder/every-element.ladder"),
];

#[test]
fn the_examples_come_back() {
    for text in EXAMPLES {
        let ladder = ladder(text);
        check_round_trip(&ladder, 3);
        assert_eq!(print(&program(&write(&ladder))), print(&ladder));
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 150, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn random_ladders_come_back(seed: u64) {
        check_round_trip(&understudy_testing::random::random_program(seed, 6), seed);
    }
}

/// Every element is one edge, and every graph begins at the left rail.
#[test]
fn elements_are_edges() {
    for text in EXAMPLES {
        let ladder = ladder(text);
        let graphs = digraphs(&ladder);
        let edges: usize = graphs.iter().map(|graph| graph.edges.len()).sum();
        let coils: usize = ladder.rungs.iter().map(|rung| rung.coils.len()).sum();
        assert_eq!(edges, ladder.contact_count() + ladder.blocks().len() + coils);
        assert!(!graphs.is_empty());
        assert!(graphs.iter().all(|graph| graph.vertices[0].number == 0));
    }
}

#[test]
fn every_element_as_xml() {
    insta::assert_snapshot!(write(&ladder(EXAMPLES[3])));
}

#[test]
fn every_element_as_a_picture() {
    insta::assert_snapshot!(draw_svg(&ladder(EXAMPLES[3])));
}

fn graph(edges: impl Iterator<Item = (usize, usize)>, last: usize) -> String {
    let edges: String = edges
        .map(|(from, to)| format!("<Edge type=\"OpenContactEdge\"><from>{from}</from><to>{to}</to><symbol>a</symbol></Edge>"))
        .collect();
    format!(
        "<LadderDiagram><Graph><Edges>{edges}<Edge type=\"OpenOutputEdge\"><from>{last}</from><to>999999</to><symbol>y</symbol></Edge></Edges></Graph></LadderDiagram>"
    )
}

/// Graphs that want to be too deep or too large are read, or refused; nothing overflows.
#[test]
fn large_graphs_end() {
    let size = 4_000;
    program(&graph((0..size).map(|k| (k, k + 1)), size));
    program(&graph((0..size).map(|_| (0, 1)), 1));
    // Branches in branches: each vertex is also reached from the rail.
    program(&graph((0..size).flat_map(|k| [(k, k + 1), (0, k + 1)]), size));
    // A ladder of bridges, which is nowhere series or parallel.
    let bridges = (0..size / 2).flat_map(|k| [(k, k + 1), (k, k + 2), (k + 1, k + 2)]);
    program(&graph(bridges, size / 2 + 1));
    let deep = "<Graph>".repeat(100_000);
    assert!(read(&format!("<LadderDiagram>{deep}")).program.is_none());
    let bomb = "<!DOCTYPE x [<!ENTITY a \"aaaa\"><!ENTITY b \"&a;&a;&a;&a;\">]><LadderDiagram name=\"&b;\"/>";
    assert!(read(bomb).program.is_none());
    let whole = include_str!("bridge.xml");
    for (end, _) in whole.char_indices() {
        read(&whole[..end]);
    }
}
