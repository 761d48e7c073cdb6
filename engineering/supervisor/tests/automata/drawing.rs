//! What people see of an automaton.

use insta::assert_snapshot;
use understudy_supervisor::petri::{draw_net_svg, read_net};
use understudy_supervisor::{Alphabet, Automaton, draw_automaton_svg, draw_dot, read_ads};

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
    for sign in ["initial state", "marked state", "controllable event", "uncontrollable event"] {
        assert!(picture.contains(&format!(">{sign}<")), "{sign}");
    }
    draw_automaton_svg(&Automaton::empty("E", Alphabet::new([]))).expect("nothing to draw");
    let (plants, buffers) = line(5, 2);
    let parts: Vec<&Automaton> = plants.iter().chain(&buffers).collect();
    let error = draw_automaton_svg(&sync(&parts, Default::default()).expect("it fits"));
    assert_eq!(error.expect_err("too large").code(), "U0808");
}

/// The number behind a name and `="`.
fn number(line: &str, name: &str) -> f64 {
    let (_, rest) = line.split_once(&format!("{name}=\"")).expect("an attribute");
    rest.split('"').next().and_then(|text| text.parse().ok()).expect("a number")
}

/// The texts of a picture, each with its middle and half of its size.
fn texts(picture: &str) -> Vec<(&str, [f64; 2], [f64; 2])> {
    let lines = picture.lines().filter(|line| line.starts_with("<text"));
    let texts = lines.map(|line| {
        let (_, text) = line.split_once('>').expect("a text");
        let text = text.trim_end_matches("</text>");
        let half = [text.chars().count() as f64 * 3.0, 5.0];
        let start = if line.contains("text-anchor: start") { half[0] } else { 0.0 };
        (text, [number(line, "x") + start, number(line, "y") - 4.0], half)
    });
    texts.collect()
}

/// Where the arrows of a picture end.
fn heads(picture: &str) -> Vec<[f64; 2]> {
    let lines = picture.lines().filter(|line| line.contains("marker-end"));
    let heads = lines.map(|line| {
        let path = line.split('"').nth(1).expect("a path");
        let numbers = path.split(' ').filter_map(|word| word.parse().ok());
        let numbers: Vec<f64> = numbers.collect();
        [numbers[numbers.len() - 2], numbers[numbers.len() - 1]]
    });
    heads.collect()
}

/// Components of the reference models: those that a paper would print.
fn components() -> Vec<Automaton> {
    let all = crate::models::MODELS.into_iter().flat_map(|name| {
        let model = Model::read(name);
        let small = model.file("_SIMSUP");
        let small = (small.state_count() < 12).then_some(small);
        model.plants.into_iter().chain(model.specifications).chain(small)
    });
    all.collect()
}

/// In the pictures of the papers and of the reference models, texts cover neither each other nor the heads of arrows.
#[test]
fn the_texts_of_pictures_are_legible() {
    let automaton = read_ads(include_str!("../../../../examples/avalanche/TEST.ADS")).automaton;
    let motivating = include_str!("../../../../examples/motivating-example/supervisor.ADS");
    let motivating = read_ads(motivating).automaton;
    let net = read_net(include_str!("../../../../examples/assembly-cell/net.toml")).file;
    let automata = [automaton.expect("an automaton"), motivating.expect("an automaton")];
    let automata = automata.into_iter().chain(components());
    let pictures: Vec<String> = automata
        .map(|automaton| draw_automaton_svg(&automaton).expect("it fits"))
        .chain([draw_net_svg(&net.expect("a net").net).expect("it fits")])
        .collect();
    for picture in &pictures {
        let texts = texts(picture);
        for (number, (text, middle, half)) in texts.iter().enumerate() {
            let is_near = |other: &[f64; 2], size: &[f64; 2]| {
                (0..2).all(|axis| (middle[axis] - other[axis]).abs() < half[axis] + size[axis])
            };
            for (other, place, size) in &texts[number + 1..] {
                assert!(!is_near(place, size), "{text} covers {other}\n{picture}");
            }
            for head in heads(picture) {
                assert!(!is_near(&head, &[0.0; 2]), "{text} covers a head\n{picture}");
            }
        }
    }
}
