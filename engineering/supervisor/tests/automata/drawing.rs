//! What people see of an automaton.

use insta::assert_snapshot;
use understudy_supervisor::{Alphabet, Automaton, draw_automaton_svg, draw_dot};

use crate::families::line;
use crate::models::Model;
use understudy_supervisor::operations::sync;

#[test]
fn a_graph_for_graphviz() {
    let model = Model::read("small_factory");
    assert_snapshot!(draw_dot(&model.plants[0]), @r#"
digraph "MACH1" {
    rankdir=LR; node [shape=circle]; edge [arrowsize=0.7];
    start [shape=point]; start -> 0;
    0 [shape=doublecircle, label="0"];
    1 [shape=circle, label="1"];
    2 [shape=circle, label="2"];
    0 -> 1 [style=solid, label="11"];
    1 -> 0 [style=dashed, label="10"];
    1 -> 2 [style=dashed, label="12"];
    2 -> 0 [style=solid, label="13"];
}
"#);
    assert_snapshot!(draw_dot(&Automaton::empty("E", Alphabet::new([]))), @r#"
digraph "E" {
    rankdir=LR; node [shape=circle]; edge [arrowsize=0.7];
}
"#);
}

#[test]
fn a_picture_has_all_states_and_events_and_a_bound() {
    let model = Model::read("transfer_line");
    let reduced = model.file("_SIMSUP");
    let picture = draw_automaton_svg(&reduced).expect("it fits");
    let marked = reduced.marked().count();
    assert_eq!(picture.matches("<ellipse").count(), reduced.state_count() + marked);
    assert!(picture.contains(">1, 3<") && picture.contains("stroke-dasharray"), "{picture}");
    draw_automaton_svg(&Automaton::empty("E", Alphabet::new([]))).expect("nothing to draw");
    let (plants, buffers) = line(5, 2);
    let parts: Vec<&Automaton> = plants.iter().chain(&buffers).collect();
    let error = draw_automaton_svg(&sync(&parts, Default::default()).expect("it fits"));
    assert_eq!(error.expect_err("too large").code(), "U0808");
}
