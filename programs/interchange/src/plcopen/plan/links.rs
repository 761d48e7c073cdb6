//! Who is connected to whom: references resolved, coils and connectors looked through, current from left to right.

use std::cell::Cell;
use std::collections::{HashMap, HashSet};

use understudy_ladder::{BlockKind, Name};
use understudy_text::Diagnostic;

use super::is_ladder;
use super::rings::rings;
use crate::plcopen::document::{CONDITION, Graph, Kind, Object, Pin, Wire};
use crate::plcopen::standard;

/// The most connections of one input.
const MAXIMUM_WIRES: usize = 1000;

/// What is looked through for all inputs of a graph together.
const MAXIMUM_LOOKS: usize = 5_000_000;

/// Where power comes from.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Source {
    Rail,
    /// An output of the object of that number, by its name where it has one.
    Output(usize, Option<Name>),
}

/// All connections of a graph.
pub(super) struct Links {
    /// By object and input.
    pub(super) sources: Vec<Vec<Vec<Source>>>,
    /// How many inputs of other objects each object feeds.
    pub(super) fan_out: Vec<usize>,
    /// Calls of function blocks, as opposed to functions.
    pub(super) is_block: Vec<bool>,
    /// By object: whether something asks for its ENO.
    pub(super) takes_eno: Vec<bool>,
    /// The numbers of rings.
    pub(super) ring: Vec<usize>,
    /// By object: the number of its first pin.
    first_pin: Vec<usize>,
}

struct Resolver<'a> {
    graph: &'a Graph,
    places: HashMap<u64, usize>,
    connectors: HashMap<&'a str, usize>,
    is_block: &'a [bool],
    looks: Cell<usize>,
}

impl Links {
    pub(super) fn new(
        graph: &Graph,
        is_block: &dyn Fn(&str) -> bool,
        diagnostics: &mut Vec<Diagnostic>,
    ) -> Self {
        let blocks: Vec<bool> = graph
            .objects
            .iter()
            .map(|object| match &object.kind {
                Kind::Block(block) => is_block(&block.type_name),
                _ => false,
            })
            .collect();
        let mut places = HashMap::new();
        let mut connectors = HashMap::new();
        for (place, object) in graph.objects.iter().enumerate() {
            places.entry(object.id).or_insert(place);
            if let Kind::Connector(name) = &object.kind
                && let Some(first) = connectors.insert(name.as_str(), place)
            {
                let message = format!("two connectors are called `{name}`");
                let error = Diagnostic::error("U1003", message, object.span.clone());
                let first = graph.objects[first].span.clone();
                diagnostics.push(error.with_related(first, "the first is here"));
            }
        }
        let resolver =
            Resolver { graph, places, connectors, is_block: &blocks, looks: Cell::new(0) };
        let mut sources = Vec::with_capacity(graph.objects.len());
        let mut fan_out = vec![0; graph.objects.len()];
        let mut takes_eno = vec![false; graph.objects.len()];
        let mut first_pin = Vec::with_capacity(graph.objects.len());
        let mut pins = 2 * graph.objects.len();
        for object in &graph.objects {
            first_pin.push(pins);
            pins += object.inputs.len();
            let mut inputs = Vec::new();
            for pin in &object.inputs {
                if pin.wires.len() > MAXIMUM_WIRES {
                    let message = format!("an input has more than {MAXIMUM_WIRES} connections");
                    let span = object.span.clone();
                    diagnostics.push(Diagnostic::error("U1001", message, span));
                    inputs.push(Vec::new());
                    continue;
                }
                resolver.check(object, pin, diagnostics);
                // The ways of a sequence carry no power.
                let found = if is_sequence(object) && pin.name.as_str() != CONDITION {
                    Vec::new()
                } else {
                    resolver.sources(pin)
                };
                if counts(object) {
                    for source in &found {
                        if let Source::Output(from, pin) = source {
                            fan_out[*from] += 1;
                            takes_eno[*from] |= is_eno(pin.as_ref());
                        }
                    }
                }
                inputs.push(found);
            }
            sources.push(inputs);
        }
        for object in &graph.objects {
            if let Kind::Continuation(name) = &object.kind
                && !resolver.connectors.contains_key(name.as_str())
            {
                let message = format!("no connector is called `{name}`");
                diagnostics.push(Diagnostic::error("U1005", message, object.span.clone()));
            }
        }
        if resolver.looks.get() > MAXIMUM_LOOKS {
            let message = "the connections of a body are too many to be followed";
            let span = graph.objects.first().map_or(0..0, |object| object.span.clone());
            diagnostics.push(Diagnostic::error("U1001", message, span));
        }
        let ring = rings(&sources);
        Self { sources, fan_out, is_block: blocks, takes_eno, ring, first_pin }
    }

    /// The number of what an object has at EN.
    pub(super) fn enable(&self, place: usize) -> usize {
        self.sources.len() + place
    }

    /// The number of an input of an object.
    pub(super) fn pin(&self, place: usize, input: usize) -> usize {
        self.first_pin[place] + input
    }

    /// How many connections name an object, whatever becomes of them.
    pub(super) fn fan_out_of(&self, graph: &Graph, object: &Object) -> usize {
        let pins = graph.objects.iter().flat_map(|other| &other.inputs);
        let wires = pins.flat_map(|pin| &pin.wires);
        wires.filter(|wire| wire.from == object.id).count()
    }
}

/// Whether an output of a block says that the block was enabled.
pub(super) fn is_eno(pin: Option<&Name>) -> bool {
    pin.is_some_and(|pin| pin.eq_ignore_ascii_case("ENO"))
}

fn is_sequence(object: &Object) -> bool {
    matches!(
        object.kind,
        Kind::Step(..)
            | Kind::Transition(_)
            | Kind::Actions(_)
            | Kind::JumpStep(_)
            | Kind::SelectionDivergence
            | Kind::SelectionConvergence
            | Kind::SimultaneousDivergence
            | Kind::SimultaneousConvergence
    )
}

/// A right power rail, and what is looked through, do not use power.
fn counts(object: &Object) -> bool {
    !matches!(object.kind, Kind::RightRail | Kind::Connector(_))
}

impl Resolver<'_> {
    /// The sources of an input behind coils and connectors, each once.
    fn sources(&self, pin: &Pin) -> Vec<Source> {
        let mut found = Vec::new();
        let mut seen = HashSet::new();
        let mut waiting: Vec<&Wire> = pin.wires.iter().rev().collect();
        while let Some(wire) = waiting.pop() {
            self.looks.set(self.looks.get() + 1 + found.len() / 8);
            if self.looks.get() > MAXIMUM_LOOKS || found.len() > MAXIMUM_WIRES {
                self.looks.set(MAXIMUM_LOOKS + 1);
                break;
            }
            let Some(&place) = self.places.get(&wire.from) else {
                continue;
            };
            let object = &self.graph.objects[place];
            let through = match &object.kind {
                Kind::Coil(..) | Kind::Connector(_) => Some(place),
                Kind::Continuation(name) => self.connectors.get(name.as_str()).copied(),
                _ => None,
            };
            if let Some(through) = through {
                if seen.insert(through) {
                    let inputs = &self.graph.objects[through].inputs;
                    waiting.extend(inputs.iter().flat_map(|pin| &pin.wires).rev());
                }
                continue;
            }
            let source = match &object.kind {
                Kind::LeftRail => Source::Rail,
                Kind::Continuation(_) => continue,
                // That is reported by the check.
                _ if wire.pin.as_ref().is_some_and(|name| !self.has_pin(place, name)) => continue,
                _ => Source::Output(place, wire.pin.clone()),
            };
            if !found.contains(&source) {
                found.push(source);
            }
        }
        found
    }

    fn check(&self, object: &Object, pin: &Pin, diagnostics: &mut Vec<Diagnostic>) {
        for wire in &pin.wires {
            let Some(&place) = self.places.get(&wire.from) else {
                let message = format!("nothing has the localId {}", wire.from);
                diagnostics.push(
                    Diagnostic::error("U1005", message, wire.span.clone())
                        .with_related(object.span.clone(), "connected to this"),
                );
                continue;
            };
            let from = &self.graph.objects[place];
            if !has_output(from) {
                let message = format!("object {} has nothing that goes out", from.id);
                diagnostics.push(
                    Diagnostic::error("U1005", message, wire.span.clone())
                        .with_related(from.span.clone(), "this object"),
                );
            }
            if let Some(name) = &wire.pin {
                self.check_pin(place, name, wire, diagnostics);
            }
            let flows_back = is_ladder(self.graph)
                && is_element(from)
                && (is_element(object) || matches!(object.kind, Kind::RightRail))
                && from.position.0 > object.position.0;
            if flows_back {
                let message = format!(
                    "current would flow from right to left, from object {} to object {}",
                    from.id, object.id
                );
                diagnostics.push(
                    Diagnostic::error("U1007", message, wire.span.clone())
                        .with_related(from.span.clone(), "it comes from here")
                        .with_help("draw what feeds a contact or coil to the left of it"),
                );
            }
        }
    }

    /// A named output of a block must be one that the block has.
    fn check_pin(&self, from: usize, name: &Name, wire: &Wire, diagnostics: &mut Vec<Diagnostic>) {
        let object = &self.graph.objects[from];
        if let (Kind::Block(block), false) = (&object.kind, self.has_pin(from, name)) {
            let message = format!("{} has no output `{name}`", block.type_name);
            diagnostics.push(
                Diagnostic::error("U1008", message, wire.span.clone())
                    .with_related(object.span.clone(), "this block"),
            );
        }
    }

    fn has_pin(&self, from: usize, name: &Name) -> bool {
        let object = &self.graph.objects[from];
        let Kind::Block(block) = &object.kind else {
            return true;
        };
        let mut outputs = object.outputs.iter();
        match BlockKind::of_word(&block.type_name) {
            Some(kind) => {
                standard::output(kind, name).is_some() || name.eq_ignore_ascii_case("ENO")
            }
            // What a unit of the file has is checked where it is called.
            None => {
                object.outputs.is_empty()
                    || self.is_block[from]
                    || outputs.any(|output| output.name.eq_ignore_ascii_case(name))
            }
        }
    }
}

fn has_output(object: &Object) -> bool {
    !matches!(
        object.kind,
        Kind::RightRail
            | Kind::OutVariable(..)
            | Kind::Connector(_)
            | Kind::Comment(_)
            | Kind::Actions(_)
            | Kind::JumpStep(_)
            | Kind::Jump(_)
            | Kind::Label(_)
            | Kind::Return
    )
}

fn is_element(object: &Object) -> bool {
    matches!(object.kind, Kind::Contact(..) | Kind::Coil(..))
}
