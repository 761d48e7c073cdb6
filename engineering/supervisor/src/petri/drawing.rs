//! A net as a graph: for Graphviz, and as a picture.
//!
//! Circles are places, with their tokens; bars are transitions, filled where a supervisor may forbid them. A round head ends an
//! inhibitor arc, a dashed arc leaves its tokens.

use std::fmt::Write as _;

use super::net::{Action, Arc, Net, NetTransition, Place};
use crate::drawing::{
    Graph, LINE, Picture, Shape, Style, TooLargeToDraw, aside, lay_out, quoted, text_size,
};

/// Half the sizes of places and bars, in pixels.
const PLACE: f64 = 17.0;
const BAR: (f64, f64) = (4.0, 20.0);

/// Larger pictures are illegible.
const MAXIMUM_DRAWN: usize = 200;

/// The text that Graphviz draws.
pub fn draw_net_dot(net: &Net) -> String {
    let mut text = format!("digraph {} {{\n", quoted(net.name()));
    text.push_str("    rankdir=LR; edge [arrowsize=0.7];\n");
    for (number, place) in net.places().iter().enumerate() {
        let _ = writeln!(
            text,
            "    p{number} [shape=circle, label=\"{}\", xlabel={}];",
            tokens(place),
            quoted(&describe_place(place).join("\n"))
        );
    }
    for (number, transition) in net.transitions().iter().enumerate() {
        let label = quoted(&describe_transition(transition).join("\n"));
        let fill = if is_controllable(transition) { ", style=filled, fillcolor=black" } else { "" };
        let _ = writeln!(
            text,
            "    t{number} [shape=box, width=0.1, height=0.5, label=\"\", xlabel={label}{fill}];"
        );
        let mut arcs = |arcs: &[Arc], gives: bool, style: &str| {
            for arc in arcs {
                let (from, to) = (format!("p{}", arc.place), format!("t{number}"));
                let (from, to) = if gives { (to, from) } else { (from, to) };
                let weight = if arc.weight == 1 {
                    String::new()
                } else {
                    format!("label=\"{}\" ", arc.weight)
                };
                let _ = writeln!(text, "    {from} -> {to} [{weight}{style}];");
            }
        };
        arcs(&transition.takes, false, "style=solid");
        arcs(&transition.gives, true, "style=solid");
        arcs(&transition.inhibitors, false, "arrowhead=odot");
        arcs(&transition.enablers, false, "style=dashed");
    }
    text.push_str("}\n");
    text
}

/// A picture.
///
/// # Errors
/// It is too large to be read.
pub fn draw_net_svg(net: &Net) -> Result<String, TooLargeToDraw> {
    let (places, transitions) = (net.places(), net.transitions());
    let arcs = transitions.iter().flat_map(all_arcs).count();
    if places.len() + transitions.len() > MAXIMUM_DRAWN || arcs > 2 * MAXIMUM_DRAWN {
        return Err(TooLargeToDraw { states: places.len() + transitions.len(), arrows: arcs });
    }
    let texts: Vec<Vec<String>> = places
        .iter()
        .map(describe_place)
        .chain(transitions.iter().map(describe_transition))
        .collect();
    let halves = texts.iter().enumerate().map(|(node, lines)| {
        let (width, height) = text_size(lines);
        let half = if node < places.len() { PLACE } else { BAR.1 };
        ((width / 2.0).max(PLACE), half + height)
    });
    let mut graph = Graph {
        nodes: halves.collect(),
        first: (0..places.len()).filter(|&place| places[place].initial > 0).collect(),
        ..Graph::default()
    };
    let mut drawn = Vec::new();
    for (number, transition) in transitions.iter().enumerate() {
        for (arc, gives, style) in all_arcs(transition) {
            let (from, to) = (arc.place, places.len() + number);
            let (from, to) = if gives { (to, from) } else { (from, to) };
            let weight = (arc.weight != 1).then(|| arc.weight.to_string());
            let label: Vec<String> = weight.into_iter().collect();
            graph.arrows.push((from, to, text_size(&label)));
            drawn.push((style, label));
        }
    }
    let layout = lay_out(&graph);
    let shape = |node: usize| {
        if node < places.len() {
            Shape::Ellipse(PLACE, PLACE)
        } else {
            Shape::Rectangle(BAR.0, BAR.1)
        }
    };
    let mut picture = Picture::default();
    for (place, half) in layout.nodes.iter().zip(&graph.nodes) {
        picture.keep_free(*place, *half);
    }
    let pairs: Vec<(usize, usize)> = graph.arrows.iter().map(|&(from, to, _)| (from, to)).collect();
    for (number, (style, label)) in drawn.iter().enumerate() {
        let (from, to) = pairs[number];
        let (place, goal) = (layout.nodes[from], layout.nodes[to]);
        let mut bends = layout.bends[number].clone();
        let is_pair = pairs.contains(&(to, from))
            || pairs.iter().filter(|pair| **pair == (from, to)).count() > 1;
        if bends.is_empty() && is_pair {
            bends.push(aside(place, goal, 30.0));
        }
        picture.arrow((place, shape(from)), &bends, (goal, shape(to)), *style, label);
    }
    for (node, text) in texts.iter().enumerate() {
        let place = layout.nodes[node];
        let (fill, half) = match transitions.get(node.wrapping_sub(places.len())) {
            Some(transition) if is_controllable(transition) => ("black", BAR.1),
            Some(_) => ("white", BAR.1),
            None => ("white", PLACE),
        };
        picture.shape(place, shape(node), fill);
        let away = half + text.len() as f64 * LINE / 2.0 + 2.0;
        picture.note(&[(place.0, place.1 + away), (place.0, place.1 - away)], text);
        if let Some(content) = places.get(node) {
            picture.text(place, &[tokens(content)]);
        }
    }
    Ok(picture.finish())
}

/// All arcs of a transition: whether it gives, and how they are drawn.
fn all_arcs(transition: &NetTransition) -> impl Iterator<Item = (Arc, bool, Style)> + use<> {
    let kind = |arcs: &[Arc], gives: bool, dashed: bool, round: bool| {
        let style = Style { dashed, round };
        arcs.iter().map(|arc| (*arc, gives, style)).collect::<Vec<_>>()
    };
    let takes = kind(&transition.takes, false, false, false);
    let gives = kind(&transition.gives, true, false, false);
    let inhibitors = kind(&transition.inhibitors, false, false, true);
    let enablers = kind(&transition.enablers, false, true, false);
    takes.into_iter().chain(gives).chain(inhibitors).chain(enablers)
}

fn is_controllable(transition: &NetTransition) -> bool {
    transition.label.is_some_and(|label| label.is_controllable())
}

/// Tokens as dots, and from four on as a number.
fn tokens(place: &Place) -> String {
    match place.initial {
        0 => String::new(),
        few @ 1..=3 => "●".repeat(few as usize),
        many => many.to_string(),
    }
}

/// Name, capacity and actions.
fn describe_place(place: &Place) -> Vec<String> {
    let mut lines = vec![match place.capacity {
        Some(capacity) => format!("{} ≤ {capacity}", place.name),
        None => place.name.clone(),
    }];
    lines.extend(place.actions.iter().map(|action| match action {
        Action::Level(signal) => format!("/ {signal}"),
        Action::Impulse(signal) => format!("/ {signal} once"),
    }));
    lines
}

/// Name, condition and delay.
fn describe_transition(transition: &NetTransition) -> Vec<String> {
    let mut lines = vec![transition.name.clone()];
    let condition = transition.condition.to_string();
    if !condition.is_empty() {
        lines.push(condition);
    }
    if let Some(delay) = transition.delay {
        lines.push(format!("after {}", understudy_text::duration::text(delay)));
    }
    lines
}
