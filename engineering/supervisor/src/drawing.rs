//! Automata as graphs: for Graphviz, and as a picture.
//!
//! An arrow from nowhere leads to the initial state, a double circle is a marked state, and transitions of uncontrollable events are
//! dashed; the legend of the picture says so. Events that lead from one state to one other share an arrow. In the picture a state stands in the column of its distance from the initial one, and within it
//! near the states that lead to it.

mod labels;
mod layout;
mod picture;

use std::collections::BTreeMap;
use std::fmt::Write as _;

use crate::automaton::{Automaton, State};

pub(crate) use layout::{Graph, lay_out};
pub(crate) use picture::{LINE, Picture, Shape, Sign, Style, middle, text_size};

/// Larger pictures are illegible.
const MAXIMUM_DRAWN: usize = 400;

/// Too large to draw.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error(
    "U0808: {states} states and {arrows} arrows; a picture has at most {MAXIMUM_DRAWN} of either, reduce or project the automaton, or take --as dot"
)]
pub struct TooLargeToDraw {
    /// States of the automaton.
    pub states: usize,
    /// Pairs of states with transitions between them.
    pub arrows: usize,
}

impl TooLargeToDraw {
    /// Stable code for people.
    pub fn code(&self) -> &'static str {
        "U0808"
    }
}

/// The events that lead from one state to another, controllable ones apart from the others.
fn arrows(automaton: &Automaton) -> BTreeMap<(State, State, bool), String> {
    let mut arrows: BTreeMap<_, String> = BTreeMap::new();
    for transition in automaton.transitions() {
        let controllable = transition.label.is_controllable();
        let names = arrows.entry((transition.source, transition.target, controllable)).or_default();
        if !names.is_empty() {
            names.push_str(", ");
        }
        names.push_str(&automaton.alphabet().name(transition.label));
    }
    arrows
}

/// The text that Graphviz draws.
pub fn draw_dot(automaton: &Automaton) -> String {
    let mut text = format!("digraph {} {{\n", quoted(automaton.name()));
    text.push_str("    rankdir=LR; node [shape=circle]; edge [arrowsize=0.7];\n");
    if automaton.initial().is_some() {
        text.push_str("    start [shape=point]; start -> 0;\n");
    }
    for state in automaton.states() {
        let shape = if automaton.is_marked(state) { "doublecircle" } else { "circle" };
        let name = quoted(&automaton.state_name(state));
        let _ = writeln!(text, "    {state} [shape={shape}, label={name}];");
    }
    for ((source, target, controllable), names) in arrows(automaton) {
        let style = if controllable { "solid" } else { "dashed" };
        let names = quoted(&names);
        let _ = writeln!(text, "    {source} -> {target} [style={style}, label={names}];");
    }
    text.push_str("}\n");
    text
}

/// A picture with a legend. The initial state is the shaded one with an arrow from nowhere.
///
/// # Errors
/// It is too large to be read.
pub fn draw_automaton_svg(automaton: &Automaton) -> Result<String, TooLargeToDraw> {
    let arrows = arrows(automaton);
    let (states, count) = (automaton.state_count(), arrows.len());
    if states > MAXIMUM_DRAWN || count > MAXIMUM_DRAWN {
        return Err(TooLargeToDraw { states, arrows: count });
    }
    let names: Vec<String> =
        automaton.states().map(|state| automaton.state_name(state).into_owned()).collect();
    let shapes: Vec<(f64, f64)> = names
        .iter()
        .map(|name| {
            let (width, _) = text_size(std::slice::from_ref(name));
            ((width / 2.0 + 10.0).max(RADIUS), RADIUS)
        })
        .collect();
    let labels: Vec<Vec<String>> = arrows.values().map(|names| wrapped(names)).collect();
    let mut graph = Graph {
        nodes: shapes.clone(),
        first: automaton.initial().map(State::index).into_iter().collect(),
        ..Graph::default()
    };
    for ((source, target, _), label) in arrows.keys().zip(&labels) {
        let (from, to) = (source.index(), target.index());
        graph.arrows.push((from, to, text_size(label)));
        if from == to {
            // Room for the loop above the state, and the same below.
            graph.nodes[from].1 += LOOP / 2.0 + text_size(label).1;
        }
    }
    let layout = lay_out(&graph);
    let mut picture = Picture::default();
    for (place, shape) in layout.nodes.iter().zip(&shapes) {
        picture.keep_free(*place, *shape);
    }
    let mut loops = vec![0.0; states];
    for (number, ((source, target, controllable), label)) in arrows.keys().zip(&labels).enumerate()
    {
        let (from, to) = (source.index(), target.index());
        let style = Style { dashed: !controllable, ..Style::default() };
        let place = layout.nodes[from];
        if from == to {
            let rise = LOOP + loops[from];
            loops[from] = rise - LOOP / 2.0 + text_size(label).1;
            picture.self_loop(place, RADIUS, rise, style, label);
            continue;
        }
        let goal = layout.nodes[to];
        let shape = |state: usize| Shape::Ellipse(shapes[state].0, shapes[state].1);
        let others =
            [(target, source, true), (target, source, false), (source, target, !controllable)];
        let alone = others
            .iter()
            .all(|&(one, other, controllable)| !arrows.contains_key(&(*one, *other, controllable)));
        let mut bends = layout.bends[number].clone();
        let is_beside = (place.0 - goal.0).abs() < 1.0;
        if bends.is_empty() && (!alone || is_beside) {
            let bend = if is_beside { 60.0 } else { 34.0 };
            let lane = if *controllable { 1.0 } else { 2.0 };
            let lane =
                if arrows.contains_key(&(*source, *target, !controllable)) { lane } else { 1.0 };
            bends.push(aside(place, goal, bend * lane));
        }
        picture.arrow((place, shape(from)), &bends, (goal, shape(to)), style, label);
    }
    if let Some(initial) = automaton.initial() {
        let (x, y) = layout.nodes[initial.index()];
        let (rx, ry) = shapes[initial.index()];
        let from = ((x - rx - INITIAL, y), Shape::Ellipse(1.0, 1.0));
        picture.arrow(from, &[], ((x, y), Shape::Ellipse(rx, ry)), Style::default(), &[]);
    }
    for state in automaton.states() {
        let place = layout.nodes[state.index()];
        let (rx, ry) = shapes[state.index()];
        let fill = if state == State::INITIAL { "lightblue" } else { "white" };
        picture.shape(place, Shape::Ellipse(rx, ry), fill);
        if automaton.is_marked(state) {
            picture.shape(place, Shape::Ellipse(rx - 4.0, ry - 4.0), fill);
        }
        picture.text(place, std::slice::from_ref(&names[state.index()]));
    }
    picture.legend(legend(automaton));
    Ok(picture.finish())
}

/// The signs that occur in the picture of an automaton.
fn legend(automaton: &Automaton) -> Vec<(Sign, &'static str)> {
    let has = |controllable: bool| {
        automaton.transitions().any(|step| step.label.is_controllable() == controllable)
    };
    let dashed = Style { dashed: true, ..Style::default() };
    let signs = [
        (automaton.initial().is_some(), Sign::Initial, "initial state"),
        (automaton.marked().next().is_some(), Sign::Marked, "marked state"),
        (has(true), Sign::Arrow(Style::default()), "controllable event"),
        (has(false), Sign::Arrow(dashed), "uncontrollable event"),
    ];
    let occurring = signs.into_iter().filter(|(occurs, ..)| *occurs);
    occurring.map(|(_, sign, text)| (sign, text)).collect()
}

/// The length of the arrow to the initial state, in pixels.
const INITIAL: f64 = 34.0;

/// The smallest radius of a state, and the height of a loop, in pixels.
const RADIUS: f64 = 20.0;
const LOOP: f64 = 24.0;

/// Names of events in lines that are not too long.
fn wrapped(names: &str) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for name in names.split(", ") {
        match lines.last_mut() {
            Some(line) if line.len() + name.len() < 24 => {
                line.push_str(", ");
                line.push_str(name);
            }
            _ => lines.push(name.to_owned()),
        }
    }
    lines
}

/// The point beside the middle of a line, to the left of who goes along it.
pub(crate) fn aside(from: (f64, f64), to: (f64, f64), distance: f64) -> (f64, f64) {
    let (dx, dy) = (to.0 - from.0, to.1 - from.1);
    let length = dx.hypot(dy).max(1.0);
    let (x, y) = middle(from, to);
    (x + dy / length * distance, y - dx / length * distance)
}

/// A text as Graphviz reads it.
pub(crate) fn quoted(text: &str) -> String {
    let escaped = text.replace('\\', "\\\\").replace('"', "\\\"");
    let escaped = escaped.replace('\n', "\\n");
    format!("\"{escaped}\"")
}
