//! Rungs as digraphs, with a place for each vertex.

use understudy_ladder::{
    Block, BlockKind, CoilKind, Comparison, ContactKind, Element, Name, Program, Rung, Series,
    visit,
};

/// Between two vertices side by side, and between two rows: the distances of the paper's example.
pub(super) const STEP_X: f64 = 120.0;
const STEP_Y: f64 = 60.0;
pub(super) const LEFT: f64 = 60.0;
const TOP: f64 = 50.0;
/// Between two graphs.
const GAP: f64 = 80.0;

/// One rung, or what feeds one input of a block.
#[derive(Debug, Clone, PartialEq)]
pub struct Digraph {
    /// From 1, in the order of the scan.
    pub number: usize,
    /// The block and its input that the graph feeds; none for a rung.
    pub feeds: Option<(Name, Name)>,
    /// The rung's title.
    pub title: Option<String>,
    /// The rung's comment lines.
    pub comments: Vec<String>,
    /// The left rail is the first.
    pub vertices: Vec<Vertex>,
    /// In the order in which their elements are evaluated; outputs come last.
    pub edges: Vec<Edge>,
}

/// A connection between elements.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Vertex {
    /// Unique in the program, but for 0: that is the left rail of every graph.
    pub number: usize,
    /// Where it is drawn, in pixels from the left.
    pub x: f64,
    /// Where it is drawn, in pixels from the top.
    pub y: f64,
}

/// An element.
#[derive(Debug, Clone, PartialEq)]
pub struct Edge {
    /// The vertex that gives it power.
    pub from: usize,
    /// The vertex that it gives power to.
    pub to: usize,
    /// The height through which it is drawn, where that is not the line between its vertices.
    pub through: Option<f64>,
    /// What it is.
    pub label: Label,
}

/// What an edge is.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Label {
    /// A contact and what it reads.
    Contact(ContactKind, Name),
    /// A comparison of a counter.
    Comparison(Comparison),
    /// A block; its other inputs are fed by graphs of their own.
    Block(Name, BlockKind),
    /// An output and what it writes.
    Coil(CoilKind, Name),
}

/// All graphs of a program, those that feed a block before the rung with the block.
pub fn digraphs(program: &Program) -> Vec<Digraph> {
    let mut drawing = Drawing { next_vertex: 1, top: TOP, graphs: Vec::new() };
    for rung in &program.rungs {
        let mut blocks = Vec::new();
        visit(&rung.network, &mut |element| {
            if let Element::Block(block) = element {
                blocks.push(block);
            }
        });
        for block in blocks {
            drawing.feeds(block);
        }
        drawing.rung(rung);
    }
    drawing.graphs
}

struct Drawing {
    next_vertex: usize,
    top: f64,
    graphs: Vec<Digraph>,
}

impl Drawing {
    fn begin(&self, feeds: Option<(Name, Name)>) -> Digraph {
        Digraph {
            number: self.graphs.len() + 1,
            feeds,
            title: None,
            comments: Vec::new(),
            vertices: vec![Vertex { number: 0, x: LEFT, y: self.top }],
            edges: Vec::new(),
        }
    }

    fn finish(&mut self, graph: Digraph, rows: usize) {
        self.top += (rows.max(1) - 1) as f64 * STEP_Y + GAP;
        self.graphs.push(graph);
    }

    fn vertex(&mut self, graph: &mut Digraph, column: usize, row: usize) -> usize {
        let number = self.next_vertex;
        self.next_vertex += 1;
        graph.vertices.push(Vertex {
            number,
            x: LEFT + column as f64 * STEP_X,
            y: self.top + row as f64 * STEP_Y,
        });
        number
    }

    fn feeds(&mut self, block: &Block) {
        for feed in &block.pins {
            let mut graph = self.begin(Some((block.name.clone(), feed.pin.clone())));
            self.series(&mut graph, &feed.network, 0, None, (0, 0));
            self.finish(graph, height(&feed.network));
        }
    }

    fn rung(&mut self, rung: &Rung) {
        let mut graph = self.begin(None);
        graph.title.clone_from(&rung.title);
        graph.comments.clone_from(&rung.comments);
        let (last, column) = self.series(&mut graph, &rung.network, 0, None, (0, 0));
        for (row, coil) in rung.coils.iter().enumerate() {
            let to = self.vertex(&mut graph, column + 1, row);
            graph.edges.push(Edge {
                from: last,
                to,
                through: None,
                label: Label::Coil(coil.kind, coil.target.clone()),
            });
        }
        self.finish(graph, height(&rung.network).max(rung.coils.len()));
    }

    /// The elements of `series` from the vertex `from` at `place` (column, row); the last one leads to `to`, or to a vertex
    /// of its own. Answers with the last vertex and its column.
    fn series(
        &mut self,
        graph: &mut Digraph,
        series: &Series,
        mut from: usize,
        to: Option<(usize, usize)>,
        (mut column, row): (usize, usize),
    ) -> (usize, usize) {
        for (place, element) in series.iter().enumerate() {
            let is_last = place + 1 == series.len();
            let wide = column + width_of(element);
            let (next, next_column) = match to.filter(|_| is_last) {
                Some(to) => to,
                None => (self.vertex(graph, wide, row), wide),
            };
            if let Element::Branches(branches) = element {
                let mut below = row;
                for branch in branches {
                    self.series(graph, branch, from, Some((next, next_column)), (column, below));
                    below += height(branch);
                }
            } else {
                let label = match element {
                    Element::Contact(contact) => {
                        Label::Contact(contact.kind, contact.operand.clone())
                    }
                    Element::Comparison(comparison) => Label::Comparison(comparison.clone()),
                    Element::Block(block) => Label::Block(block.name.clone(), block.kind),
                    Element::Branches(_) => continue,
                };
                graph.edges.push(Edge {
                    from,
                    to: next,
                    through: Some(self.top + row as f64 * STEP_Y),
                    label,
                });
            }
            (from, column) = (next, next_column);
        }
        (from, column)
    }
}

fn width_of(element: &Element) -> usize {
    match element {
        Element::Branches(branches) => branches.iter().map(width).max().unwrap_or(1),
        _ => 1,
    }
}

fn width(series: &Series) -> usize {
    series.iter().map(width_of).sum::<usize>().max(1)
}

fn height(series: &Series) -> usize {
    let heights = series.iter().map(|element| match element {
        Element::Branches(branches) => branches.iter().map(height).sum(),
        _ => 1,
    });
    heights.max().unwrap_or(1)
}

/// Edge types of the paper, and those that are added to them.
const CONTACTS: [(&str, ContactKind); 4] = [
    ("OpenContactEdge", ContactKind::NormallyOpen),
    ("CloseContactEdge", ContactKind::NormallyClosed),
    ("RisingContactEdge", ContactKind::Rising),
    ("FallingContactEdge", ContactKind::Falling),
];

const COILS: [(&str, CoilKind); 6] = [
    ("OpenOutputEdge", CoilKind::Plain),
    ("CloseOutputEdge", CoilKind::Negated),
    ("SetOutputEdge", CoilKind::Set),
    ("ResetOutputEdge", CoilKind::Reset),
    ("RisingOutputEdge", CoilKind::Rising),
    ("FallingOutputEdge", CoilKind::Falling),
];

/// The type of an edge in the XML.
pub(super) fn type_of(label: &Label) -> &'static str {
    match label {
        Label::Contact(kind, _) => word_of(&CONTACTS, *kind),
        Label::Coil(kind, _) => word_of(&COILS, *kind),
        Label::Comparison(_) => "ComparisonEdge",
        Label::Block(..) => "BlockEdge",
    }
}

fn word_of<T: PartialEq>(table: &[(&'static str, T)], wanted: T) -> &'static str {
    let found = table.iter().find(|(_, kind)| *kind == wanted);
    found.map_or("", |(word, _)| word)
}

pub(super) fn contact_kind(word: &str) -> Option<ContactKind> {
    CONTACTS.iter().find(|(known, _)| *known == word).map(|(_, kind)| *kind)
}

pub(super) fn coil_kind(word: &str) -> Option<CoilKind> {
    COILS.iter().find(|(known, _)| *known == word).map(|(_, kind)| *kind)
}

/// All edge types, for help.
pub(super) fn edge_types() -> String {
    let contacts = CONTACTS.iter().map(|(word, _)| *word);
    let coils = COILS.iter().map(|(word, _)| *word);
    let words: Vec<&str> = contacts.chain(["ComparisonEdge", "BlockEdge"]).chain(coils).collect();
    words.join(", ")
}
