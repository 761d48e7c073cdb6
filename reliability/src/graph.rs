//! A chain drawn as a graph: columns by the number of steps from the start, failures on the right.
//!
//! Only the first columns of a large chain are drawn, and it is said how many states are not. From the last column an arrow leads to the
//! failure; a state further left says its rate of failing below itself, so that no arrow runs behind others.

use std::fmt::Write;
use understudy_text::markup::escaped;

use crate::chain::Chain;

const COLUMNS: usize = 3;
const ROWS: usize = 4;
const COLUMN_WIDTH: i32 = 225;
const ROW_HEIGHT: i32 = 134;
const NODE_WIDTH: i32 = 152;
const NODE_HEIGHT: i32 = 40;

struct Node {
    name: String,
    x: i32,
    y: i32,
    /// Counted from the left; nothing for the failure.
    column: Option<usize>,
}

/// The first states of `chain` and the rates among them, per hour.
pub(crate) fn graph(chain: &Chain) -> String {
    let levels = chain.levels();
    let mut nodes: Vec<Node> = Vec::new();
    let mut node_of = vec![None; chain.states()];
    let mut columns: Vec<Vec<usize>> = vec![Vec::new(); COLUMNS];
    for (state, level) in levels.iter().enumerate() {
        let column = *level as usize;
        if !chain.is_failure(state) && column < COLUMNS && columns[column].len() < ROWS {
            columns[column].push(state);
        }
    }
    columns.retain(|column| !column.is_empty());
    let rows = columns.iter().map(Vec::len).max().unwrap_or(1) as i32;
    let middle = 30 + rows * ROW_HEIGHT / 2;
    for (column, states) in columns.iter().enumerate() {
        for (row, &state) in states.iter().enumerate() {
            node_of[state] = Some(nodes.len());
            nodes.push(Node {
                name: chain.name(state),
                x: 90 + column as i32 * COLUMN_WIDTH,
                y: middle + (2 * row as i32 + 1 - states.len() as i32) * ROW_HEIGHT / 2,
                column: Some(column),
            });
        }
    }
    let right = 90 + columns.len() as i32 * COLUMN_WIDTH;
    let failed = nodes.len();
    for (state, place) in node_of.iter_mut().enumerate() {
        if chain.is_failure(state) {
            *place = Some(failed);
        }
    }
    if (0..chain.states()).any(|state| chain.is_failure(state)) {
        nodes.push(Node { name: "failed".into(), x: right, y: middle, column: None });
    }
    let left_out = node_of.iter().filter(|node| node.is_none()).count();
    draw(chain, &nodes, &node_of, left_out, right, rows)
}

fn draw(
    chain: &Chain,
    nodes: &[Node],
    node_of: &[Option<usize>],
    left_out: usize,
    right: i32,
    rows: i32,
) -> String {
    let (width, height) = (right + 100, 60 + rows * ROW_HEIGHT);
    let mut svg = format!(
        "<svg width=\"{width}\" height=\"{height}\" viewBox=\"0 0 {width} {height}\" xmlns=\"http://www.w3.org/2000/svg\" \
         font-family=\"sans-serif\" font-size=\"11\">\
         <defs><marker id=\"head\" viewBox=\"0 0 8 8\" refX=\"7\" refY=\"4\" markerWidth=\"7\" markerHeight=\"7\" orient=\"auto\">\
         <path d=\"M0,0L8,4L0,8Z\" fill=\"#1A202C\"/></marker></defs>"
    );
    let last = nodes.iter().filter_map(|node| node.column).max();
    let rows = || nodes.iter().map(|node| node.y);
    let top = rows().min().unwrap_or(0) - NODE_HEIGHT / 2;
    let bottom = rows().max().unwrap_or(0) + NODE_HEIGHT / 2;
    let mut labels = String::new();
    for (state, node) in node_of.iter().enumerate() {
        let Some(from) = node.map(|node| &nodes[node]) else {
            continue;
        };
        if chain.is_failure(state) {
            continue;
        }
        let mut lethal = 0.0;
        for (to, rate) in chain.successors(state) {
            match node_of[to].map(|node| &nodes[node]) {
                Some(to) if to.column.is_none() => lethal += rate,
                Some(to) => edge(&mut svg, &mut labels, (from, to), rate, (top, bottom)),
                None => {}
            }
        }
        let failed = nodes.iter().find(|node| node.column.is_none());
        if let Some(failed) = failed.filter(|_| lethal > 0.0) {
            if from.column == last {
                edge(&mut svg, &mut labels, (from, failed), lethal, (top, bottom));
            } else {
                let (x, y) = (from.x, from.y + NODE_HEIGHT / 2 + 15);
                let text = format!("fails: {}", short(lethal));
                label(&mut labels, f64::from(x), f64::from(y), "#B43C2E", &text);
            }
        }
    }
    for node in nodes {
        let (x, y) = (node.x - NODE_WIDTH / 2, node.y - NODE_HEIGHT / 2);
        let fill = if node.column.is_none() { "#F3C6C1" } else { "#FFFFFF" };
        let _ = write!(
            svg,
            "<rect x=\"{x}\" y=\"{y}\" width=\"{NODE_WIDTH}\" height=\"{NODE_HEIGHT}\" rx=\"9\" fill=\"{fill}\" stroke=\"#1A202C\"/>"
        );
        let lines = lines(&node.name);
        for (line, text) in lines.iter().enumerate() {
            let y = node.y + 4 + (2 * line as i32 + 1 - lines.len() as i32) * 7;
            let _ = write!(
                svg,
                "<text x=\"{}\" y=\"{y}\" text-anchor=\"middle\" fill=\"#1A202C\">{}</text>",
                node.x,
                escaped(text)
            );
        }
    }
    svg.push_str(&labels);
    if left_out > 0 {
        let _ = write!(
            svg,
            "<text x=\"20\" y=\"{}\" fill=\"#1A202C\">{left_out} more states are not drawn.</text>",
            height - 12
        );
    }
    svg.push_str("</svg>");
    svg
}

/// A bent arrow, so that both directions are seen, with its rate beside it. One that passes over a column is bent away from the middle.
fn edge(
    svg: &mut String,
    labels: &mut String,
    (from, to): (&Node, &Node),
    rate: f64,
    (top, bottom): (i32, i32),
) {
    let (dx, dy) = (f64::from(to.x - from.x), f64::from(to.y - from.y));
    let length = dx.hypot(dy).max(1.0);
    let far = (to.x - from.x).abs() > COLUMN_WIDTH;
    let middle = i32::midpoint(top, bottom);
    // Far ones from the upper half go over all boxes, others below them.
    let above = if from.y == middle { dx < 0.0 } else { from.y < middle };
    let (nx, ny) = match (far, above) {
        (true, true) => (0.0, -1.0),
        (true, false) => (0.0, 1.0),
        (false, _) => (-dy / length * 18.0, dx / length * 18.0),
    };
    let (half_width, half_height) = (f64::from(NODE_WIDTH) / 2.0, f64::from(NODE_HEIGHT) / 2.0);
    // From side to side, one direction above the other; over a column, and within one, from edge to edge.
    let (start, end) = if far || dx == 0.0 {
        let side = (half_width * 0.8 * dx.signum(), half_height * ny.signum());
        (
            (f64::from(from.x) + side.0, f64::from(from.y) + side.1),
            (f64::from(to.x) - side.0, f64::from(to.y) + side.1),
        )
    } else {
        let (side, shift) = (half_width * dx.signum(), 9.0 * dx.signum());
        (
            (f64::from(from.x) + side, f64::from(from.y) + shift),
            (f64::from(to.x) - side, f64::from(to.y) + shift),
        )
    };
    let control = if far {
        // Half way, the curve is where the control point and the ends have pulled it in equal parts.
        let height = f64::from(if above { top - 16 } else { bottom + 32 });
        (f64::midpoint(start.0, end.0), 2.0 * height - f64::midpoint(start.1, end.1))
    } else {
        (f64::midpoint(start.0, end.0) + nx, f64::midpoint(start.1, end.1) + ny)
    };
    // Nearer to its origin, so that the rates of both directions do not overlap.
    let at = |start: f64, control: f64, end: f64| 0.42 * start + 0.46 * control + 0.12 * end;
    let place =
        (at(start.0, control.0, end.0), at(start.1, control.1, end.1) + 4.0 + 9.0 * ny.signum());
    let _ = write!(
        svg,
        "<path d=\"M{:.1},{:.1}Q{:.1},{:.1} {:.1},{:.1}\" fill=\"none\" stroke=\"#1A202C\" marker-end=\"url(#head)\"/>",
        start.0, start.1, control.0, control.1, end.0, end.1
    );
    label(labels, place.0, place.1, "#1F5FA8", &short(rate));
}

fn label(labels: &mut String, x: f64, y: f64, colour: &str, text: &str) {
    let _ = write!(
        labels,
        "<text x=\"{x:.1}\" y=\"{y:.1}\" text-anchor=\"middle\" fill=\"{colour}\" stroke=\"#FFFFFF\" stroke-width=\"4\" paint-order=\"stroke\">{text}</text>"
    );
}

fn short(rate: f64) -> String {
    if (1e-3..1e4).contains(&rate) {
        format!("{}", (rate * 1e5).round() / 1e5)
    } else {
        format!("{rate:.2e}")
    }
}

/// A name in at most two lines.
fn lines(name: &str) -> Vec<String> {
    match name.split_once(", ").or_else(|| name.split_once("; ")) {
        Some((first, second)) => vec![format!("{first},"), second.into()],
        None => vec![name.into()],
    }
}
