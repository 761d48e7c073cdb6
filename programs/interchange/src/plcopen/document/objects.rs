//! The objects of a graph and what they are connected to.

use std::collections::HashMap;
use std::str::FromStr;

use understudy_ladder::Name;
use understudy_text::Diagnostic;
use understudy_text::xml::Node;

use super::macro_step::Ends;
use super::read::Reader;
use super::rungs::rung;
use super::{
    Action, ActionContent, Block, Condition, Edge, Graph, Kind, Language, Modifier, Object, Pin,
    Storage, Transition, Wire,
};
use crate::plcopen::xml::{attribute, child, children, elements, held, start_tag, text, word};

/// The input of a transition whose condition is wired to it.
pub(crate) const CONDITION: &str = "condition";

/// The most objects of one graph.
const MAXIMUM_OBJECTS: usize = 200_000;

/// Reads all objects of a body.
pub(super) fn graph(reader: &mut Reader, body: Node<'_, '_>, language: Language) -> Graph {
    let mut graph = Graph { language, objects: Vec::new() };
    let mut rungs = 0;
    let mut ends = Ends::default();
    for node in elements(body) {
        if graph.objects.len() >= MAXIMUM_OBJECTS {
            let message = format!("a body has more than {MAXIMUM_OBJECTS} objects");
            reader.error("U1001", message, node);
            break;
        }
        if node.tag_name().name() == "rung" {
            rungs += 1;
            rung(reader, node, rungs, &mut graph.objects);
        } else if let Some(object) = object(reader, node) {
            match node.tag_name().name() {
                "macroStep" => ends.expand(reader, node, object, &mut graph.objects),
                _ => graph.objects.push(object),
            }
        }
    }
    unique(reader, &graph);
    ends.connect(reader, &mut graph);
    graph
}

fn unique(reader: &mut Reader, graph: &Graph) {
    let mut places = HashMap::new();
    for object in &graph.objects {
        if let Some(first) = places.insert(object.id, object.span.clone()) {
            let error = Diagnostic::error(
                "U1003",
                format!("two objects have the localId {}", object.id),
                object.span.clone(),
            );
            let error = error.with_related(first, "the first is here");
            reader.diagnostics.push(error);
        }
    }
}

fn object(reader: &mut Reader, node: Node<'_, '_>) -> Option<Object> {
    let name = node.tag_name().name();
    if name == "addData" {
        reader.ignore("additional data of a tool", node);
        return None;
    }
    let Some(id) = attribute(node, "localId").and_then(|id| id.parse::<u64>().ok()) else {
        reader.error("U1002", format!("`{name}` has no localId that is a number"), node);
        return None;
    };
    let mut inputs = Vec::new();
    let mut outputs = Vec::new();
    for part in elements(node) {
        match part.tag_name().name() {
            "connectionPointIn" => {
                inputs.push(input(reader, part, Name::default(), Modifier::default()))
            }
            "connectionPointOut" => {
                unread_expression(reader, part);
                let name = attribute(part, "formalParameter").unwrap_or_default();
                outputs.push(Pin { name, ..Pin::default() });
            }
            "inputVariables" => {
                let pins = pins(reader, part);
                inputs.extend(pins.into_iter().map(|(pin, node)| {
                    if pin.modifier.storage.is_some() {
                        changed(reader, "an input that is set or reset", node);
                    }
                    pin
                }));
            }
            "inOutVariables" => {
                let mut both = Vec::new();
                for (pin, node) in pins(reader, part) {
                    if pin.modifier != Modifier::default() {
                        changed(reader, "an in-out variable that is changed on its way", node);
                    }
                    both.push(pin);
                }
                outputs.extend(both.iter().map(|pin| Pin { wires: Vec::new(), ..pin.clone() }));
                inputs.extend(both);
            }
            "outputVariables" => {
                let pins = pins(reader, part);
                outputs.extend(pins.into_iter().map(|(pin, node)| {
                    if pin.modifier.storage.is_some() || pin.modifier.edge.is_some() {
                        changed(reader, "an output that is set or reset, or sees edges,", node);
                    }
                    pin
                }));
            }
            "addData" if is_title(node) => {}
            "addData" => reader.ignore("additional data of a tool", part),
            "documentation" => reader.ignore("the documentation of an object", part),
            _ => {}
        }
    }
    let variable = || child(node, "variable").map(word).unwrap_or_default();
    let expression = || child(node, "expression").map(word).unwrap_or_default();
    let kind = match name {
        "leftPowerRail" => Kind::LeftRail,
        "rightPowerRail" => Kind::RightRail,
        "contact" => Kind::Contact(variable(), read_modifier(reader, node, "", "a contact")),
        "coil" => Kind::Coil(variable(), modifier(reader, node, "")),
        "block" => Kind::Block(Block {
            type_name: reader.needed(node, "typeName")?,
            instance: attribute(node, "instanceName").filter(|name| !name.is_empty()),
        }),
        "inVariable" => Kind::InVariable(
            expression(),
            read_modifier(reader, node, "", "a variable that is read"),
        ),
        "outVariable" => Kind::OutVariable(expression(), modifier(reader, node, "")),
        "inOutVariable" => {
            let to = modifier(reader, node, "In");
            let from = read_modifier(reader, node, "Out", "a variable that is read");
            Kind::InOutVariable(expression(), to, from)
        }
        "connector" => Kind::Connector(reader.needed(node, "name")?),
        "continuation" => Kind::Continuation(reader.needed(node, "name")?),
        "comment" => Kind::Comment(
            child(node, "content").map(text).unwrap_or_default().as_str().trim().to_owned(),
        ),
        "step" | "macroStep" => {
            not_negated(reader, node, "step");
            let initial = attribute(node, "initialStep")
                .is_some_and(|value| matches!(value.as_str(), "true" | "1"));
            Kind::Step(reader.needed(node, "name")?, initial)
        }
        "transition" => {
            not_negated(reader, node, "transition");
            Kind::Transition(transition(reader, node, &mut inputs))
        }
        "selectionDivergence" => Kind::SelectionDivergence,
        "selectionConvergence" => Kind::SelectionConvergence,
        "simultaneousDivergence" => Kind::SimultaneousDivergence,
        "simultaneousConvergence" => Kind::SimultaneousConvergence,
        "jumpStep" => Kind::JumpStep(reader.needed(node, "targetName")?),
        "actionBlock" => {
            not_negated(reader, node, "action block");
            Kind::Actions(actions(reader, node))
        }
        "label" => Kind::Label(reader.needed(node, "label")?),
        "jump" => Kind::Jump(reader.needed(node, "label")?),
        "return" => Kind::Return,
        // The title of a network of CODESYS; what other elements of vendors do is unknown.
        "vendorElement" if is_title(node) => {
            let title = child(node, "alternativeText").map(text).unwrap_or_default();
            Kind::Comment(title.as_str().trim().to_owned())
        }
        "vendorElement" => Kind::Other("a vendor's element"),
        "error" => Kind::Other("an error mark"),
        _ => {
            reader.error("U1010", format!("`{name}` is not known"), node);
            return None;
        }
    };
    Some(Object {
        id,
        span: start_tag(node),
        position: position(reader, node),
        order: number(reader, node, "executionOrderId").unwrap_or(0),
        kind,
        inputs,
        outputs,
    })
}

/// Whether an element of a vendor is the title of a network, which does nothing.
fn is_title(node: Node<'_, '_>) -> bool {
    let has_pins = elements(node).any(|part| part.tag_name().name().ends_with("Variables"));
    node.tag_name().name() == "vendorElement"
        && !has_pins
        && child(node, "addData").is_some_and(|data| {
            elements(data).any(|data| {
                let is_kind = held(data).to_ascii_lowercase().ends_with("elementtype");
                is_kind && word(data).eq_ignore_ascii_case("networktitle")
            })
        })
}

/// The pins of a list with their elements.
fn pins<'a, 'i>(reader: &mut Reader, list: Node<'a, 'i>) -> Vec<(Pin, Node<'a, 'i>)> {
    let mut pins = Vec::new();
    for node in children(list, "variable") {
        let name =
            attribute(node, "formalParameter").unwrap_or_else(|| Name::at("", start_tag(node)));
        let modifier = modifier(reader, node, "");
        if let Some(point) = child(node, "connectionPointOut") {
            unread_expression(reader, point);
        }
        let pin = match child(node, "connectionPointIn") {
            Some(point) => input(reader, point, name, modifier),
            None => Pin { name, modifier, wires: Vec::new() },
        };
        pins.push((pin, node));
    }
    pins
}

/// A variable at a connection point, in place of an object of its own.
fn unread_expression(reader: &mut Reader, point: Node<'_, '_>) {
    if let Some(expression) = child(point, "expression") {
        let message = "an expression at a connection point is not supported".to_owned();
        reader.error("U1010", message, expression);
    }
}

/// A modifier that the object cannot have here.
fn changed(reader: &mut Reader, what: &str, node: Node<'_, '_>) {
    reader.error("U1010", format!("{what} is not supported"), node);
}

fn input(reader: &mut Reader, point: Node<'_, '_>, name: Name, modifier: Modifier) -> Pin {
    let mut wires = Vec::new();
    unread_expression(reader, point);
    for node in elements(point) {
        if node.tag_name().name() != "connection" {
            continue;
        }
        match attribute(node, "refLocalId").and_then(|id| id.parse().ok()) {
            Some(from) => wires.push(Wire {
                from,
                pin: attribute(node, "formalParameter").filter(|pin| !pin.is_empty()),
                span: start_tag(node),
            }),
            None => reader.error(
                "U1002",
                "a connection has no refLocalId that is a number".to_owned(),
                node,
            ),
        }
    }
    Pin { name, modifier, wires }
}

/// `negated`, `edge` and `storage`, with a suffix for objects that have two of each.
pub(super) fn modifier(reader: &mut Reader, node: Node<'_, '_>, suffix: &str) -> Modifier {
    let mut one_of = |name: &str, known: &[&[&str]]| {
        let name = format!("{name}{suffix}");
        let value = attribute(node, &name).filter(|value| !value.is_empty());
        let found = value
            .as_ref()
            .and_then(|value| known.iter().position(|words| words.contains(&value.as_str())));
        if let Some(value) = value.filter(|_| found.is_none()) {
            let words: Vec<&str> =
                known.iter().filter_map(|words| words.first().copied()).collect();
            let message =
                format!("invalid value `{value}` of `{name}`: expected {}", words.join(", "));
            reader.diagnostics.push(Diagnostic::error("U1010", message, value.span()));
        }
        found.unwrap_or(0)
    };
    // "negated" is what one tool writes for "true".
    let negated = one_of("negated", &[&["false", "0"], &["true", "1", "negated"]]);
    let edge = one_of("edge", &[&["none"], &["rising"], &["falling"]]);
    let stored = [&["none"][..], &["set"], &["reset"]];
    let storage = one_of("storage", &stored);
    let kind = one_of("kind", &stored);
    Modifier {
        negated: negated == 1,
        edge: [None, Some(Edge::Rising), Some(Edge::Falling)][edge],
        storage: [None, Some(Storage::Set), Some(Storage::Reset)][storage.max(kind)],
    }
}

/// A modifier of what is only read.
pub(super) fn read_modifier(
    reader: &mut Reader,
    node: Node<'_, '_>,
    suffix: &str,
    what: &str,
) -> Modifier {
    let modifier = modifier(reader, node, suffix);
    if modifier.storage.is_some() {
        changed(reader, &format!("{what} that sets or resets"), node);
    }
    modifier
}

/// Refuses the negation of what has none here.
fn not_negated(reader: &mut Reader, node: Node<'_, '_>, what: &str) {
    if modifier(reader, node, "").negated {
        changed(reader, &format!("a negated {what}"), node);
    }
}

fn transition(reader: &mut Reader, node: Node<'_, '_>, inputs: &mut Vec<Pin>) -> Transition {
    let priority = attribute(node, "priority").and_then(|priority| priority.parse().ok());
    let mut found = Transition {
        priority: priority.unwrap_or(0),
        negated: false,
        condition: Condition::Missing,
    };
    let Some(condition) = child(node, "condition") else {
        return found;
    };
    found.negated = modifier(reader, condition, "").negated;
    for part in elements(condition) {
        match part.tag_name().name() {
            "reference" => {
                if let Some(name) = reader.needed(part, "name") {
                    found.condition = Condition::Reference(name);
                }
            }
            "inline" => {
                if let Some(body) = reader.body(part) {
                    found.condition = Condition::Inline(body);
                }
            }
            "connectionPointIn" => {
                let name = Name::at(CONDITION, start_tag(part));
                inputs.push(input(reader, part, name, Modifier::default()));
                found.condition = Condition::Wired;
            }
            // 2.0 has the connections without a connection point.
            "connection" => {
                let name = Name::at(CONDITION, start_tag(condition));
                if found.condition_is_missing() {
                    inputs.push(input(reader, condition, name, Modifier::default()));
                    found.condition = Condition::Wired;
                }
            }
            _ => {}
        }
    }
    found
}

impl Transition {
    fn condition_is_missing(&self) -> bool {
        matches!(self.condition, Condition::Missing)
    }
}

fn actions(reader: &mut Reader, node: Node<'_, '_>) -> Vec<Action> {
    let mut actions = Vec::new();
    for action in children(node, "action") {
        let qualifier =
            attribute(action, "qualifier").unwrap_or_else(|| Name::at("N", start_tag(action)));
        let mut content = ActionContent::Missing;
        for part in elements(action) {
            match part.tag_name().name() {
                "reference" => {
                    if let Some(name) = attribute(part, "name").filter(|name| !name.is_empty()) {
                        content = ActionContent::Reference(name);
                    }
                }
                "inline" => {
                    if let Some(body) = reader.body(part) {
                        content = ActionContent::Inline(body);
                    }
                }
                _ => {}
            }
        }
        if attribute(action, "indicator").is_some_and(|name| !name.is_empty()) {
            reader.error(
                "U1010",
                "an action with an indicator is not supported".to_owned(),
                action,
            );
        }
        actions.push(Action {
            span: start_tag(action),
            qualifier,
            duration: attribute(action, "duration"),
            content,
        });
    }
    actions
}

/// The number in an attribute; nothing where it is left out. The order of a scan depends on it, so what is none is an error.
fn number<T: FromStr>(reader: &mut Reader, node: Node<'_, '_>, name: &str) -> Option<T> {
    let written = attribute(node, name).filter(|written| !written.trim().is_empty())?;
    let found = written.trim().parse().ok();
    if found.is_none() {
        let element = node.tag_name().name();
        let message = format!("the `{name}` of `{element}` is no number: `{written}`");
        reader.error("U1002", message, node);
    }
    found
}

/// The top left corner; nought where none is given.
fn position(reader: &mut Reader, node: Node<'_, '_>) -> (i64, i64) {
    let Some(place) = child(node, "position") else {
        return (0, 0);
    };
    // Saturates.
    let mut coordinate =
        |name| (number::<f64>(reader, place, name).unwrap_or(0.0) * 1000.0).round() as i64;
    (coordinate("x"), coordinate("y"))
}
