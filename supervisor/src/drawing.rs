//! Automata as graphs: for Graphviz, and as a picture.
//!
//! A double circle is a marked state, and transitions of uncontrollable events are dashed. Events that lead from one state to
//! one other share an arrow. In the picture
//! a state stands in the column of its distance from the initial one, and within it near the states that lead to it.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use crate::automaton::{Automaton, State};

/// A picture of more states or arrows is for nobody to read.
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
        let names = arrows
            .entry((transition.source, transition.target, controllable))
            .or_default();
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
        let shape = if automaton.is_marked(state) {
            "doublecircle"
        } else {
            "circle"
        };
        let name = quoted(&automaton.state_name(state));
        let _ = writeln!(text, "    {state} [shape={shape}, label={name}];");
    }
    for ((source, target, controllable), names) in arrows(automaton) {
        let style = if controllable { "solid" } else { "dashed" };
        let names = quoted(&names);
        let _ = writeln!(
            text,
            "    {source} -> {target} [style={style}, label={names}];"
        );
    }
    text.push_str("}\n");
    text
}

/// A picture. The initial state is the shaded one.
///
/// # Errors
/// It is too large to be read.
pub fn draw_automaton_svg(automaton: &Automaton) -> Result<String, TooLargeToDraw> {
    let arrows = arrows(automaton);
    let (states, count) = (automaton.state_count(), arrows.len());
    if states > MAXIMUM_DRAWN || count > MAXIMUM_DRAWN {
        return Err(TooLargeToDraw {
            states,
            arrows: count,
        });
    }
    let places = places(automaton);
    let mut picture = Picture::default();
    for ((source, target, controllable), names) in &arrows {
        let both_ways = arrows
            .keys()
            .any(|&(from, to, _)| (from, to) == (*target, *source));
        let pair = arrows.contains_key(&(*source, *target, !controllable));
        let lane = if pair && *controllable { 2.0 } else { 1.0 };
        if source == target {
            picture.self_loop(places[source.index()], lane, *controllable, names);
        } else {
            let (from, to) = (places[source.index()], places[target.index()]);
            let neighbours = (to.0 - from.0 - COLUMN).abs() < 1.0;
            let bend = if neighbours && !both_ways {
                lane - 1.0
            } else {
                lane
            };
            picture.arrow(from, to, bend, *controllable, names);
        }
    }
    for state in automaton.states() {
        let name = automaton.state_name(state);
        picture.state(
            places[state.index()],
            &name,
            automaton.is_marked(state),
            state == State::INITIAL,
        );
    }
    Ok(picture.finish())
}

/// Distances of columns and rows, and the smallest radius of a state, in pixels.
const COLUMN: f64 = 150.0;
const ROW: f64 = 110.0;
const RADIUS: f64 = 20.0;

type Place = (f64, f64);

/// Where each state stands: states that are not reached come in the column after the last one.
fn places(automaton: &Automaton) -> Vec<Place> {
    let mut columns: Vec<Vec<State>> = automaton
        .initial()
        .into_iter()
        .map(|state| vec![state])
        .collect();
    let mut placed = vec![false; automaton.state_count()];
    if let Some(initial) = automaton.initial() {
        placed[initial.index()] = true;
    }
    // A column is found from the one before in the order of its rows, so that arrows to neighbours seldom cross.
    while let Some(last) = columns.last().filter(|column| !column.is_empty()) {
        let mut next = Vec::new();
        for state in last.clone() {
            for edge in automaton.edges(state) {
                if !std::mem::replace(&mut placed[edge.target.index()], true) {
                    next.push(edge.target);
                }
            }
        }
        columns.push(next);
    }
    let unreached = automaton.states().filter(|state| !placed[state.index()]);
    columns.push(unreached.collect());
    columns.retain(|column| !column.is_empty());
    let mut places = vec![(0.0, 0.0); automaton.state_count()];
    for (number, column) in columns.iter().enumerate() {
        for (place, state) in column.iter().enumerate() {
            let y = (place as f64 - (column.len() - 1) as f64 / 2.0) * ROW;
            places[state.index()] = (number as f64 * COLUMN, y);
        }
    }
    places
}

/// What has been drawn, and how far it reaches.
struct Picture {
    shapes: String,
    low: Place,
    high: Place,
}

impl Default for Picture {
    fn default() -> Self {
        Self {
            shapes: String::new(),
            low: (-40.0, -40.0),
            high: (40.0, 40.0),
        }
    }
}

impl Picture {
    fn reach(&mut self, (x, y): Place, margin: f64) {
        self.low = (self.low.0.min(x - margin), self.low.1.min(y - margin));
        self.high = (self.high.0.max(x + margin), self.high.1.max(y + margin));
    }

    fn state(&mut self, (x, y): Place, name: &str, marked: bool, initial: bool) {
        let width = RADIUS.max(4.0 * name.chars().count() as f64 + 10.0);
        let fill = if initial { "lightblue" } else { "white" };
        let mut rings = vec![0.0];
        rings.extend(marked.then_some(4.0));
        for ring in rings {
            let (rx, ry) = (width - ring, RADIUS - ring);
            let _ = writeln!(
                self.shapes,
                "<ellipse cx=\"{x:.1}\" cy=\"{y:.1}\" rx=\"{rx:.1}\" ry=\"{ry:.1}\" fill=\"{fill}\" stroke=\"black\"/>"
            );
        }
        let name = escaped(name);
        let _ = writeln!(
            self.shapes,
            "<text x=\"{x:.1}\" y=\"{:.1}\">{name}</text>",
            y + 4.0
        );
        self.reach((x, y), width + 10.0);
    }

    /// A curve that leaves the straight line to its left, by so many steps.
    fn arrow(&mut self, from: Place, to: Place, bend: f64, controllable: bool, names: &str) {
        let (dx, dy) = (to.0 - from.0, to.1 - from.1);
        let length = dx.hypot(dy).max(1.0);
        let away = bend * (18.0 + 0.2 * length);
        let control = (
            from.0 + dx / 2.0 + dy / length * away,
            from.1 + dy / 2.0 - dx / length * away,
        );
        let start = towards(from, control);
        let end = towards(to, control);
        let middle = (
            (start.0 + 2.0 * control.0 + end.0) / 4.0,
            (start.1 + 2.0 * control.1 + end.1) / 4.0,
        );
        self.line(
            &format!("M {} Q {} {}", point(start), point(control), point(end)),
            controllable,
        );
        self.label(middle, names);
    }

    fn self_loop(&mut self, (x, y): Place, lane: f64, controllable: bool, names: &str) {
        let top = y - RADIUS - 30.0 * lane;
        let (left, right) = ((x - 8.0, y - RADIUS), (x + 8.0, y - RADIUS));
        let path = format!(
            "M {} C {} {} {}",
            point(left),
            point((x - 26.0, top)),
            point((x + 26.0, top)),
            point(right)
        );
        self.line(&path, controllable);
        self.label((x, y - RADIUS - 24.0 * lane), names);
    }

    fn line(&mut self, path: &str, controllable: bool) {
        let dash = if controllable {
            ""
        } else {
            " stroke-dasharray=\"5 3\""
        };
        let _ = writeln!(
            self.shapes,
            "<path d=\"{path}\" fill=\"none\" stroke=\"black\"{dash} marker-end=\"url(#arrow)\"/>"
        );
    }

    fn label(&mut self, (x, y): Place, names: &str) {
        let text = escaped(names);
        let _ = writeln!(
            self.shapes,
            "<text x=\"{x:.1}\" y=\"{:.1}\">{text}</text>",
            y + 4.0
        );
        self.reach((x, y), 4.0 * names.chars().count() as f64 + 12.0);
    }

    fn finish(self) -> String {
        let (width, height) = (self.high.0 - self.low.0, self.high.1 - self.low.1);
        format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width:.0}\" height=\"{height:.0}\" viewBox=\"{:.1} {:.1} {width:.1} {height:.1}\">\n\
             <defs><marker id=\"arrow\" markerWidth=\"9\" markerHeight=\"7\" refX=\"8\" refY=\"3.5\" orient=\"auto\"><path d=\"M 0 0 L 9 3.5 L 0 7 z\"/></marker></defs>\n\
             <style>text {{ font: 12px sans-serif; text-anchor: middle; paint-order: stroke; stroke: white; stroke-width: 3px; }}</style>\n\
             {}</svg>\n",
            self.low.0, self.low.1, self.shapes
        )
    }
}

/// The point of a state's circle that looks towards another point.
fn towards(centre: Place, other: Place) -> Place {
    let (dx, dy) = (other.0 - centre.0, other.1 - centre.1);
    let length = dx.hypot(dy).max(1.0);
    (
        centre.0 + dx / length * RADIUS,
        centre.1 + dy / length * RADIUS,
    )
}

fn point((x, y): Place) -> String {
    format!("{x:.1} {y:.1}")
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
}

fn quoted(text: &str) -> String {
    let escaped = text.replace('\\', "\\\\").replace('"', "\\\"");
    format!("\"{escaped}\"")
}
