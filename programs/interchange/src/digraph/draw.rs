//! Digraphs as one self-contained SVG picture, light and dark as the reader's screen is.

use std::collections::HashMap;
use std::fmt::Write;

use understudy_ladder::{ContactKind, Program};
use understudy_text::duration;
use understudy_text::markup::escaped;

use super::graph::{Digraph, Edge, LEFT, Label, STEP_X, Vertex, digraphs};

const RADIUS: f64 = 13.0;
const MARGIN: f64 = 60.0;
/// Above a graph, for its title.
const TITLE: f64 = 40.0;

/// Every selector begins at the picture's own class, so that a page can hold several pictures.
const STYLE: &str = "\
.digraph{--paper:#fff;--ink:#1c2733;--soft:#667788;--edge:#41505f;--rail:#1f5fa8;--output:#8a4b08;--fill:#f3f7fb}
@media(prefers-color-scheme:dark){
.digraph{--paper:#12181f;--ink:#e4eaf0;--soft:#93a3b3;--edge:#a9b8c6;--rail:#6db1ff;--output:#f0b26b;--fill:#1b242e}}
.digraph .paper{fill:var(--paper)}
.digraph text{font:12px ui-monospace,'DejaVu Sans Mono',Menlo,Consolas,monospace;fill:var(--ink);text-anchor:middle}
.digraph .title{font-weight:bold;font-size:13px;text-anchor:start}
.digraph .number{font-size:10px;fill:var(--soft)}
.digraph .edge{stroke:var(--edge);stroke-width:1.5;fill:none;marker-end:url(#digraph-head)}
.digraph .output{stroke:var(--output);stroke-dasharray:none}
.digraph .written{fill:var(--output)}
.digraph .vertex{stroke:var(--edge);stroke-width:1.5;fill:var(--fill)}
.digraph .rail{stroke:var(--rail);stroke-width:3}
.digraph .head{fill:var(--edge)}";

/// The picture of a program: one digraph for each rung, contacts with the signs of the ladder's text, closed ones with a bar.
pub fn draw_svg(program: &Program) -> String {
    let mut graphs = digraphs(program);
    stretch(&mut graphs);
    let mut body = String::new();
    let (mut width, mut height) = (400.0_f64, 0.0_f64);
    for (index, graph) in graphs.iter().enumerate() {
        let below = (index + 1) as f64 * TITLE;
        draw_graph(&mut body, graph, below);
        for vertex in &graph.vertices {
            width = width.max(vertex.x + MARGIN);
            height = height.max(vertex.y + below + MARGIN);
        }
        for through in graph.edges.iter().filter_map(|edge| edge.through) {
            height = height.max(through + below + MARGIN);
        }
        let title = title(graph).chars().count() as f64 * 8.0;
        width = width.max(title + 2.0 * MARGIN);
    }
    format!(
        "<svg class=\"digraph\" xmlns=\"http://www.w3.org/2000/svg\" width=\"{width:.0}\" height=\"{height:.0}\" viewBox=\"0 0 {width:.0} {height:.0}\">\n\
         <title>{}</title>\n<style>\n{STYLE}\n</style>\n\
         <defs><marker id=\"digraph-head\" viewBox=\"0 0 8 8\" refX=\"7\" refY=\"4\" markerWidth=\"7\" markerHeight=\"7\" orient=\"auto\"><path class=\"head\" d=\"M0 0L8 4L0 8z\"/></marker></defs>\n\
         <rect class=\"paper\" width=\"100%\" height=\"100%\"/>\n{body}</svg>\n",
        escaped(&program.name)
    )
}

/// Makes room for the longest words along an edge.
fn stretch(graphs: &mut [Digraph]) {
    let edges = graphs.iter().flat_map(|graph| &graph.edges);
    let longest = edges.map(|edge| words(&edge.label).0.chars().count()).max().unwrap_or(0);
    let factor = ((longest as f64 * 7.3 + 3.0 * RADIUS) / STEP_X).max(1.0);
    for vertex in graphs.iter_mut().flat_map(|graph| &mut graph.vertices) {
        vertex.x = LEFT + (vertex.x - LEFT) * factor;
    }
}

fn title(graph: &Digraph) -> String {
    match (&graph.feeds, &graph.title) {
        (Some((block, pin)), _) => format!("{}  feeds {block}.{pin}", graph.number),
        (None, Some(title)) => format!("{}  {title}", graph.number),
        (None, None) => graph.number.to_string(),
    }
}

fn draw_graph(body: &mut String, graph: &Digraph, below: f64) {
    let places: HashMap<usize, Vertex> = graph
        .vertices
        .iter()
        .map(|vertex| (vertex.number, Vertex { y: vertex.y + below, ..*vertex }))
        .collect();
    if let Some(rail) = places.get(&0) {
        let _ = writeln!(
            body,
            r#"<text class="title" x="{:.1}" y="{:.1}">{}</text>"#,
            rail.x - RADIUS,
            rail.y - 34.0,
            escaped(&title(graph))
        );
    }
    for edge in &graph.edges {
        if let (Some(from), Some(to)) = (places.get(&edge.from), places.get(&edge.to)) {
            draw_edge(body, edge, *from, *to, below);
        }
    }
    for vertex in &graph.vertices {
        let class = if vertex.number == 0 { "vertex rail" } else { "vertex" };
        let y = vertex.y + below;
        let _ = writeln!(
            body,
            r#"<circle class="{class}" cx="{:.1}" cy="{y:.1}" r="{RADIUS}"/><text class="number" x="{:.1}" y="{:.1}">{}</text>"#,
            vertex.x,
            vertex.x,
            y + 3.5,
            vertex.number
        );
    }
}

/// Down to its own row, along it, and up to its vertex; straight where both vertices stand in the row.
fn draw_edge(body: &mut String, edge: &Edge, from: Vertex, to: Vertex, below: f64) {
    let row = edge.through.map_or(to.y, |through| through + below);
    let is_output = matches!(edge.label, Label::Coil(..));
    let class = if is_output { "edge output" } else { "edge" };
    let (left, right) = (from.x + RADIUS, to.x - RADIUS);
    let (near, far) = (from.x + 34.0, to.x - 34.0);
    let path = if (from.y, to.y) == (row, row) {
        format!("M{left:.1} {row:.1}L{right:.1} {row:.1}")
    } else {
        let start = if from.y == row { left } else { from.x + RADIUS * 0.7 };
        let start_y =
            if from.y == row { row } else { from.y + RADIUS * 0.7 * (row - from.y).signum() };
        let end = if to.y == row { right } else { to.x - RADIUS * 0.7 };
        let end_y = if to.y == row { row } else { to.y + RADIUS * 0.7 * (row - to.y).signum() };
        format!(
            "M{start:.1} {start_y:.1}Q{:.1} {row:.1} {near:.1} {row:.1}L{far:.1} {row:.1}Q{:.1} {row:.1} {end:.1} {end_y:.1}",
            from.x + 14.0,
            to.x - 14.0
        )
    };
    let _ = writeln!(body, r#"<path class="{class}" d="{path}"/>"#);
    let (text, bar) = words(&edge.label);
    let (middle, above) = ((from.x + to.x) / 2.0, row - 9.0);
    let class = if is_output { " class=\"written\"" } else { "" };
    let _ =
        writeln!(body, r#"<text{class} x="{middle:.1}" y="{above:.1}">{}</text>"#, escaped(&text));
    if bar {
        let half = text.chars().count() as f64 * 3.6;
        let _ = writeln!(
            body,
            r#"<path class="edge" style="marker-end:none" d="M{:.1} {y:.1}L{:.1} {y:.1}"/>"#,
            middle - half,
            middle + half,
            y = above - 12.0
        );
    }
}

/// The text at an edge, and whether it has a bar above, which marks a normally closed contact in the paper.
fn words(label: &Label) -> (String, bool) {
    match label {
        Label::Contact(ContactKind::NormallyClosed, name) => (name.to_string(), true),
        Label::Contact(kind, name) => (format!("{}{name}", kind.sign()), false),
        Label::Comparison(comparison) => {
            let (counter, sign) = (&comparison.counter, comparison.relation.sign());
            (format!("{counter}.CV {sign} {}", comparison.value), false)
        }
        Label::Block(name, kind) => {
            let time = kind.preset_time().map(duration::text);
            let preset = time.or(kind.preset_value().map(|value| value.to_string()));
            let preset = preset.map(|preset| format!(" {preset}")).unwrap_or_default();
            (format!("{} {name}{preset}", kind.word()), false)
        }
        Label::Coil(kind, name) => {
            let space = if kind.is_latch() { " " } else { "" };
            (format!("({}{space}{name})", kind.sign()), false)
        }
    }
}
