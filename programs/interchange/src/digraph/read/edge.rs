//! Edges: their ends, and the elements that they are.

use understudy_ladder::{
    Block, BlockKind, Coil, Comparison, Contact, Element, MAXIMUM_PRESET_VALUE, Name, Relation,
};
use understudy_text::Diagnostic;
use understudy_text::duration;
use understudy_text::xml::Node;

use super::super::graph::{coil_kind, contact_kind, edge_types};
use super::super::infer::Use;
use super::super::network::{Content, RawEdge};
use super::Reader;
use crate::plcopen::xml;

impl Reader {
    fn whole(&mut self, node: Node<'_, '_>, word: &Name, what: &str) -> Option<usize> {
        let found = word.parse().ok();
        if found.is_none() {
            let span = if word.is_empty() { xml::start_tag(node) } else { word.span() };
            self.error(
                "U1061",
                format!("{what} is `{}`: expected a whole number", word.as_str()),
                span,
            );
        }
        found
    }

    pub(super) fn vertex(&mut self, node: Node<'_, '_>) -> Option<usize> {
        self.only(node, &["startX", "startY"], &["number"]);
        let number = xml::attribute(node, "number").unwrap_or_default();
        self.whole(node, &number, "the number of a vertex")
    }

    pub(super) fn edge(
        &mut self,
        node: Node<'_, '_>,
        vertices: Option<&[usize]>,
        used: &mut Vec<Use>,
    ) -> Option<RawEdge> {
        let elements = ["from", "to", "address", "symbol", "relation", "value", "block", "preset"];
        self.only(node, &elements, &["type"]);
        let end = |reader: &mut Self, name: &str| {
            let word = xml::child(node, name).map(xml::word).unwrap_or_default();
            let number = reader.whole(node, &word, "the end of an edge")?;
            if vertices.is_some_and(|vertices| !vertices.contains(&number)) {
                reader.error("U1062", format!("there is no vertex {number}"), word.span());
                return None;
            }
            Some(number)
        };
        let (from, to) = (end(self, "from"), end(self, "to"));
        let symbol = xml::child(node, "symbol").map(xml::word).unwrap_or_default();
        if symbol.is_empty() {
            self.error("U1061", "an edge needs a symbol", xml::start_tag(node));
            return None;
        }
        let content = self.content(node, &symbol)?;
        used.push(Use {
            name: match &content {
                Content::Coil(coil) => Some(coil.target.clone()),
                Content::Element(Element::Contact(contact)) => Some(contact.operand.clone()),
                Content::Element(_) => None,
            },
            is_written: matches!(content, Content::Coil(_)),
            block: match &content {
                Content::Element(Element::Block(block)) => Some(block.name.to_string()),
                _ => None,
            },
            address: xml::child(node, "address").map(xml::word).filter(|word| !word.is_empty()),
            symbol,
        });
        let (from, to) = (from?, to?);
        if from == to {
            self.error(
                "U1063",
                format!("an edge leads from vertex {from} to itself"),
                xml::start_tag(node),
            );
            return None;
        }
        Some(RawEdge { from, to, content, span: xml::start_tag(node) })
    }

    fn content(&mut self, node: Node<'_, '_>, symbol: &Name) -> Option<Content> {
        let Some(word) = xml::attribute(node, "type") else {
            self.error("U1061", "an edge needs a type", xml::start_tag(node));
            return None;
        };
        // The paper marks closed contacts in their symbol too.
        let plain = symbol.trim_start_matches('!').trim();
        let is_marked = plain.len() < symbol.len();
        let plain = Name::at(plain, symbol.span());
        let name = self.names.legal(&plain, &mut self.diagnostics);
        if let Some(kind) = contact_kind(&word) {
            use understudy_ladder::ContactKind::{NormallyClosed, NormallyOpen};
            let kind = if kind == NormallyOpen && is_marked { NormallyClosed } else { kind };
            return Some(Content::Element(Element::Contact(Contact { kind, operand: name })));
        }
        if let Some(kind) = coil_kind(&word) {
            return Some(Content::Coil(Coil { kind, target: name }));
        }
        match word.as_str() {
            "ComparisonEdge" => {
                let relation = xml::child(node, "relation").map(xml::word).unwrap_or_default();
                let found = Relation::of_sign(relation.as_str());
                let value = xml::child(node, "value").map(xml::word).unwrap_or_default();
                let value = self.whole(node, &value, "the value of a comparison")?;
                let value = u16::try_from(value)
                    .ok()
                    .filter(|value| u64::from(*value) <= u64::from(MAXIMUM_PRESET_VALUE));
                let (Some(relation), Some(value)) = (found, value) else {
                    self.error("U1061", format!("a comparison has a relation such as >= and a number up to {MAXIMUM_PRESET_VALUE}"), xml::start_tag(node));
                    return None;
                };
                Some(Content::Element(Element::Comparison(Comparison {
                    counter: name,
                    relation,
                    value,
                })))
            }
            "BlockEdge" => {
                let kind = self.block_kind(node)?;
                let pins = Vec::new();
                Some(Content::Element(Element::Block(Block { name, kind, pins })))
            }
            _ => {
                let finding = Diagnostic::error(
                    "U1061",
                    format!("an edge cannot be a `{}`", word.as_str()),
                    word.span(),
                );
                self.diagnostics.push(finding.with_help(format!("edges are {}", edge_types())));
                None
            }
        }
    }

    fn block_kind(&mut self, node: Node<'_, '_>) -> Option<BlockKind> {
        let word = xml::child(node, "block").map(xml::word).unwrap_or_default();
        let preset = xml::child(node, "preset").map(xml::word).unwrap_or_default();
        let time = duration::parse(&preset).ok();
        let number = preset
            .parse::<u16>()
            .ok()
            .filter(|value| u64::from(*value) <= u64::from(MAXIMUM_PRESET_VALUE));
        let Some(kind) = BlockKind::of_word(word.as_str()) else {
            let message = format!("unknown block `{}`", word.as_str());
            self.error("U1061", message, xml::start_tag(node));
            return None;
        };
        let kind = match (kind.preset_time(), kind.preset_value()) {
            (Some(_), _) => time.map(|time| kind.with_time(time)),
            (_, Some(_)) => number.map(|number| kind.with_value(number)),
            (None, None) => Some(kind),
        };
        if kind.is_none() {
            let message = format!("invalid preset `{}` of a {}", preset.as_str(), word.as_str());
            self.error("U1061", message, xml::start_tag(node));
        }
        kind
    }
}
