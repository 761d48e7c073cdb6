//! A digraph as a network of a rung.
//!
//! Two edges one behind the other become one, and so do two edges between the same vertices, until one edge is left: then the
//! graph is series and parallel. In any other graph each vertex becomes a memory bit, which has power when an edge gives it some.

use std::collections::{BTreeMap, BTreeSet, HashMap, VecDeque};
use std::ops::Range;

use understudy_ladder::{
    Coil, CoilKind, Contact, ContactKind, Element, MAXIMUM_NESTING, Name, Rung, Series,
};
use understudy_text::Diagnostic;

/// Branches in branches past which vertices become memory bits.
const MAXIMUM_DEPTH: usize = MAXIMUM_NESTING - 2;

/// An edge as it was read.
pub(super) struct RawEdge {
    pub(super) from: usize,
    pub(super) to: usize,
    pub(super) content: Content,
    pub(super) span: Range<usize>,
}

pub(super) enum Content {
    Element(Element),
    Coil(Coil),
}

/// What became of a graph: rungs that come first, with the memory bits that they write, and the network.
#[derive(Default)]
pub(super) struct Network {
    pub(super) before: Vec<Rung>,
    pub(super) bits: Vec<String>,
    pub(super) series: Series,
    /// Coils at the end of the network; those elsewhere have rungs of their own.
    pub(super) coils: Vec<Coil>,
    pub(super) after: Vec<Rung>,
}

/// The network of the graph `number`, or everything that is wrong with its shape.
pub(super) fn network(
    number: usize,
    edges: Vec<RawEdge>,
    place: &Range<usize>,
) -> Result<Network, Vec<Diagnostic>> {
    if edges.is_empty() {
        return Err(vec![Diagnostic::error("U1062", "the graph has no edge", place.clone())]);
    }
    let shape = Shape::of(&edges, place)?;
    let mut elements = Vec::new();
    let mut coils: Vec<(usize, Coil)> = Vec::new();
    for edge in edges {
        match edge.content {
            Content::Element(element) => elements.push((edge.from, edge.to, element)),
            Content::Coil(coil) => coils.push((edge.from, coil)),
        }
    }
    let fed: BTreeSet<usize> = coils.iter().map(|(from, _)| *from).collect();
    let target = match (fed.len(), shape.sinks.as_slice()) {
        (1, _) => fed.first().copied(),
        (0, [sink]) => Some(*sink),
        _ => None,
    };
    if let Some(target) = target
        && let Some(series) = reduced(&shape, &elements, target)
    {
        return Ok(Network {
            series,
            coils: coils.into_iter().map(|(_, coil)| coil).collect(),
            ..Network::default()
        });
    }
    Ok(by_vertices(number, &shape, elements, coils))
}

/// What the vertices of a graph are to each other.
struct Shape {
    source: usize,
    /// Vertices behind which nothing comes, those behind outputs not counted.
    sinks: Vec<usize>,
    /// All vertices between elements, each behind those that give it power.
    order: Vec<usize>,
}

impl Shape {
    fn of(edges: &[RawEdge], place: &Range<usize>) -> Result<Self, Vec<Diagnostic>> {
        let mut incoming: BTreeMap<usize, usize> = BTreeMap::new();
        let mut outgoing: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
        let mut behind_outputs = BTreeSet::new();
        let mut outputs_at = BTreeSet::new();
        for edge in edges {
            incoming.entry(edge.from).or_insert(0);
            match edge.content {
                Content::Element(_) => {
                    *incoming.entry(edge.to).or_insert(0) += 1;
                    outgoing.entry(edge.from).or_default().push(edge.to);
                }
                Content::Coil(_) => {
                    behind_outputs.insert(edge.to);
                    outputs_at.insert(edge.from);
                }
            }
        }
        let mut found = Vec::new();
        for edge in edges {
            if behind_outputs.contains(&edge.from) {
                let message =
                    format!("vertex {} follows an output, where the power ends", edge.from);
                found.push(Diagnostic::error("U1063", message, edge.span.clone()));
            }
        }
        let sources: Vec<usize> =
            incoming.iter().filter(|(_, count)| **count == 0).map(|(vertex, _)| *vertex).collect();
        let source = match sources.as_slice() {
            [source] => *source,
            [] => {
                found.push(Diagnostic::error(
                    "U1063",
                    "every vertex has an edge that leads to it: the graph goes in a circle",
                    place.clone(),
                ));
                return Err(found);
            }
            [first, second, ..] => {
                let message = format!(
                    "the vertices {first} and {second} have no edge that leads to them; only the left rail has none"
                );
                found.push(Diagnostic::error("U1063", message, place.clone()));
                return Err(found);
            }
        };
        let mut order = Vec::new();
        let mut waiting = incoming.clone();
        let mut free = VecDeque::from([source]);
        while let Some(vertex) = free.pop_front() {
            order.push(vertex);
            for next in outgoing.get(&vertex).into_iter().flatten() {
                let count = waiting.entry(*next).or_insert(1);
                *count -= 1;
                if *count == 0 {
                    free.push_back(*next);
                }
            }
        }
        if order.len() < incoming.len() {
            found.push(Diagnostic::error(
                "U1063",
                "the edges of this graph go in a circle; power flows from the left to the right",
                place.clone(),
            ));
        }
        let is_sink = |vertex: &usize| !outgoing.contains_key(vertex);
        let sinks: Vec<usize> = order.iter().copied().filter(is_sink).collect();
        let lost: Vec<usize> =
            sinks.iter().copied().filter(|sink| !outputs_at.contains(sink)).collect();
        // A graph without outputs ends in a block, at its one end.
        if !outputs_at.is_empty() && !lost.is_empty() || lost.len() > 1 {
            let message = format!("power that comes to vertex {} leads nowhere", lost[0]);
            found.push(Diagnostic::error("U1063", message, place.clone()));
        }
        if found.is_empty() { Ok(Self { source, sinks, order }) } else { Err(found) }
    }
}

/// A part of the graph that has become one edge.
struct Part {
    from: usize,
    to: usize,
    /// Of its first element, which is evaluated first.
    first: usize,
    depth: usize,
    tree: Tree,
}

enum Tree {
    Series(Series),
    /// Each with its first element's number.
    Parallel(Vec<(usize, Series)>),
}

impl Part {
    fn into_series(self) -> Series {
        match self.tree {
            Tree::Series(series) => series,
            Tree::Parallel(mut branches) => {
                branches.sort_by_key(|(first, _)| *first);
                vec![Element::Branches(branches.into_iter().map(|(_, branch)| branch).collect())]
            }
        }
    }
}

/// The whole graph as one series from its source to `target`, where it is one.
fn reduced(shape: &Shape, elements: &[(usize, usize, Element)], target: usize) -> Option<Series> {
    if shape.source == target {
        return elements.is_empty().then(Vec::new);
    }
    let mut reduction = Reduction::default();
    for (first, (from, to, element)) in elements.iter().enumerate() {
        reduction.add(Part {
            from: *from,
            to: *to,
            first,
            depth: 0,
            tree: Tree::Series(vec![element.clone()]),
        });
    }
    let mut pending: VecDeque<usize> = shape.order.iter().copied().collect();
    while let Some(vertex) = pending.pop_front() {
        if vertex == shape.source || vertex == target {
            continue;
        }
        let Some((from, to)) = reduction.through(vertex) else {
            continue;
        };
        let (Some(left), Some(right)) = (reduction.take(from, vertex), reduction.take(vertex, to))
        else {
            continue;
        };
        let (first, depth) = (left.first.min(right.first), left.depth.max(right.depth));
        let mut series = left.into_series();
        series.extend(right.into_series());
        let is_joined = reduction.add(Part { from, to, first, depth, tree: Tree::Series(series) });
        if reduction.deepest > MAXIMUM_DEPTH {
            return None;
        }
        if is_joined {
            pending.extend([from, to]);
        }
    }
    let whole = reduction.take(shape.source, target)?;
    reduction.parts.is_empty().then(|| whole.into_series())
}

#[derive(Default)]
struct Reduction {
    /// By both ends: two between the same ends are one.
    parts: HashMap<(usize, usize), Part>,
    incoming: HashMap<usize, BTreeSet<usize>>,
    outgoing: HashMap<usize, BTreeSet<usize>>,
    deepest: usize,
}

impl Reduction {
    /// True where the part was joined with one between the same ends.
    fn add(&mut self, part: Part) -> bool {
        let ends = (part.from, part.to);
        self.incoming.entry(part.to).or_default().insert(part.from);
        self.outgoing.entry(part.from).or_default().insert(part.to);
        let Some(other) = self.parts.remove(&ends) else {
            self.parts.insert(ends, part);
            return false;
        };
        let (first, depth) = (other.first.min(part.first), other.depth.max(part.depth) + 1);
        self.deepest = self.deepest.max(depth);
        let mut branches = Vec::new();
        for part in [other, part] {
            match part.tree {
                Tree::Parallel(more) => branches.extend(more),
                Tree::Series(series) => branches.push((part.first, series)),
            }
        }
        let joined = Part {
            from: ends.0,
            to: ends.1,
            first,
            // Branches beside branches are no deeper.
            depth: if branches.len() > 2 { depth - 1 } else { depth },
            tree: Tree::Parallel(branches),
        };
        self.parts.insert(ends, joined);
        true
    }

    /// The vertices around one with one edge to it and one from it.
    fn through(&self, vertex: usize) -> Option<(usize, usize)> {
        let (incoming, outgoing) = (self.incoming.get(&vertex)?, self.outgoing.get(&vertex)?);
        let is_one = incoming.len() == 1 && outgoing.len() == 1;
        is_one.then(|| Some((*incoming.first()?, *outgoing.first()?)))?
    }

    fn take(&mut self, from: usize, to: usize) -> Option<Part> {
        let part = self.parts.remove(&(from, to))?;
        if let Some(incoming) = self.incoming.get_mut(&to) {
            incoming.remove(&from);
        }
        if let Some(outgoing) = self.outgoing.get_mut(&from) {
            outgoing.remove(&to);
        }
        Some(part)
    }
}

/// A memory bit for each vertex.
fn by_vertices(
    number: usize,
    shape: &Shape,
    elements: Vec<(usize, usize, Element)>,
    coils: Vec<(usize, Coil)>,
) -> Network {
    let bit = |vertex: usize| format!("graph_{number}.vertex_{vertex}");
    let power = |vertex: usize| -> Series {
        if vertex == shape.source { Vec::new() } else { vec![contact(&bit(vertex))] }
    };
    let mut into: HashMap<usize, Vec<Series>> = HashMap::new();
    for (from, to, element) in elements {
        let mut series = power(from);
        series.push(element);
        into.entry(to).or_default().push(series);
    }
    let mut network = Network::default();
    for &vertex in shape.order.iter().filter(|vertex| **vertex != shape.source) {
        let mut branches = into.remove(&vertex).unwrap_or_default();
        let series = match branches.len() {
            1 => branches.remove(0),
            _ => vec![Element::Branches(branches)],
        };
        network.before.push(Rung {
            network: series,
            coils: vec![Coil { kind: CoilKind::Plain, target: Name::from(bit(vertex)) }],
            ..Rung::default()
        });
        network.bits.push(bit(vertex));
    }
    // Coils that one vertex feeds stand on one rung; the first of these rungs is the graph's own.
    let mut rungs: Vec<(usize, Vec<Coil>)> = Vec::new();
    for (from, coil) in coils {
        match rungs.last_mut() {
            Some((last, coils)) if *last == from => coils.push(coil),
            _ => rungs.push((from, vec![coil])),
        }
    }
    let mut rungs = rungs.into_iter();
    match rungs.next() {
        Some((from, coils)) => {
            network.series = power(from);
            network.coils = coils;
        }
        None => network.series = shape.sinks.first().map(|sink| power(*sink)).unwrap_or_default(),
    }
    network.after = rungs
        .map(|(from, coils)| Rung { network: power(from), coils, ..Rung::default() })
        .collect();
    network
}

fn contact(operand: &str) -> Element {
    Element::Contact(Contact { kind: ContactKind::NormallyOpen, operand: Name::from(operand) })
}
