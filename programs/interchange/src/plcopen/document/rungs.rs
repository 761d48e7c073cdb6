//! `<rung>`, which is not of the schema: one tool writes ladders as rungs of contacts and coils in the order of the current,
//! and blocks whose pins name variables. Each becomes the objects that it means.

use understudy_ladder::{BlockKind, Name};
use understudy_text::xml::Node;

use super::objects::{modifier, read_modifier};
use super::read::Reader;
use super::{Block, Kind, Modifier, Object, Pin, Wire};
use crate::plcopen::standard;
use crate::plcopen::xml::{attribute, children, elements, start_tag, word};

/// Objects of rungs are numbered from here, above what people number.
pub(crate) const FIRST_ID: u64 = 1 << 62;

/// Reads one rung, the `number`-th of its body, into the objects of the body.
pub(super) fn rung(
    reader: &mut Reader,
    node: Node<'_, '_>,
    number: usize,
    objects: &mut Vec<Object>,
) {
    let mut rung = Rung { objects, number, column: 0 };
    let rail = rung.add(node, Kind::LeftRail, Vec::new());
    let mut power = Wire { from: rail, pin: None, span: start_tag(node) };
    for part in elements(node) {
        let input = Pin { wires: vec![power.clone()], ..Pin::default() };
        let variable = attribute(part, "variable").unwrap_or_default();
        let known = match part.tag_name().name() {
            "block" => &["localId", "lineNumber", "typeName", "instanceName"][..],
            _ => &["localId", "lineNumber", "variable", "negated", "edge", "storage", "kind"],
        };
        for given in part.attributes().filter(|given| !known.contains(&given.name())) {
            let message = format!("the attribute `{}` in a rung is not supported", given.name());
            reader.error("U1010", message, part);
        }
        let mut inner = elements(part);
        let foreign = match part.tag_name().name() {
            "block" => inner.find(|inner| inner.tag_name().name() != "variable"),
            "addData" => None,
            _ => inner.next(),
        };
        if let Some(foreign) = foreign {
            let name = foreign.tag_name().name();
            reader.error("U1010", format!("`{name}` in a rung is not known"), foreign);
        }
        match part.tag_name().name() {
            "contact" => {
                let kind = Kind::Contact(variable, read_modifier(reader, part, "", "a contact"));
                power.from = rung.add(part, kind, vec![input]);
                power.pin = None;
            }
            "coil" => {
                rung.add(part, Kind::Coil(variable, modifier(reader, part, "")), vec![input]);
            }
            "block" => {
                let Some(type_name) = reader.needed(part, "typeName") else {
                    continue;
                };
                let Some(kind) = BlockKind::of_word(&type_name) else {
                    // Nothing says which of its variables it writes.
                    let message = format!(
                        "the block {type_name} in a rung is not supported: only the standard function blocks are"
                    );
                    reader.error("U1010", message, part);
                    continue;
                };
                power = rung.block(part, type_name, kind, &power);
            }
            "addData" => reader.ignore("additional data of a tool", part),
            other => reader.error("U1010", format!("`{other}` in a rung is not known"), part),
        }
    }
}

struct Rung<'a> {
    objects: &'a mut Vec<Object>,
    number: usize,
    column: i64,
}

impl Rung<'_> {
    fn add(&mut self, node: Node<'_, '_>, kind: Kind, inputs: Vec<Pin>) -> u64 {
        let id = FIRST_ID + self.objects.len() as u64;
        self.column += 1;
        self.objects.push(Object {
            id,
            span: start_tag(node),
            position: (self.column, i64::try_from(self.number).unwrap_or(i64::MAX)),
            order: 0,
            kind,
            inputs,
            outputs: Vec::new(),
        });
        id
    }

    /// A block with its variables; the power before it enters at its first input, if no variable does.
    fn block(
        &mut self,
        node: Node<'_, '_>,
        type_name: Name,
        kind: BlockKind,
        power: &Wire,
    ) -> Wire {
        let mut inputs = Vec::new();
        let mut outputs = Vec::new();
        let mut taken = Vec::new();
        for pin in children(node, "variable") {
            let name = attribute(pin, "formalParameter").unwrap_or_default();
            if standard::output(kind, &name).is_some() {
                outputs.push(Pin { name: name.clone(), ..Pin::default() });
                taken.push((name, word(pin), pin));
            } else {
                let from =
                    self.add(pin, Kind::InVariable(word(pin), Modifier::default()), Vec::new());
                let wire = Wire { from, pin: None, span: start_tag(pin) };
                inputs.push(Pin { name, wires: vec![wire], ..Pin::default() });
            }
        }
        let fed = self
            .objects
            .iter()
            .any(|object| object.id == power.from && !matches!(object.kind, Kind::LeftRail));
        let first = kind.wire_input();
        if fed && !inputs.iter().any(|pin| pin.name.as_str() == first) {
            let name = Name::at(first, start_tag(node));
            inputs.push(Pin { name, wires: vec![power.clone()], ..Pin::default() });
        }
        let block = Block {
            type_name,
            instance: attribute(node, "instanceName").filter(|name| !name.is_empty()),
        };
        let id = self.add(node, Kind::Block(block), inputs);
        if let Some(object) = self.objects.last_mut() {
            object.outputs = outputs;
        }
        for (pin, variable, node) in taken {
            let wire = Wire { from: id, pin: Some(pin), span: start_tag(node) };
            let input = Pin { wires: vec![wire], ..Pin::default() };
            self.add(node, Kind::OutVariable(variable, Modifier::default()), vec![input]);
        }
        Wire {
            from: id,
            pin: Some(Name::at(kind.outputs()[0], start_tag(node))),
            span: start_tag(node),
        }
    }
}
