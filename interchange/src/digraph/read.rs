//! XML to a program.

use std::collections::HashMap;
use std::ops::Range;

use roxmltree::Node;
use understudy_diagnostic::{Diagnostic, has_errors};
use understudy_ladder::{
    Block, BlockKind, Coil, Comparison, Contact, Element, Feed, MAXIMUM_PRESET_VALUE,
    MAXIMUM_RUNGS, Name, Program, Relation, Rung, Series, Signal, check, parse_time, visit,
};

use super::Reading;
use super::graph::{coil_kind, contact_kind, edge_types};
use super::infer::{Names, signals};
use super::network::{Content, Network, RawEdge, network};
use crate::plcopen::xml;

/// Findings past which no more are said.
const MAXIMUM_FINDINGS: usize = 200;

/// By block and input.
type Feeds = HashMap<(String, String), (Network, Range<usize>)>;

pub(super) fn read(text: &str) -> Reading {
    let mut reader = Reader::default();
    let program = match xml::parse(text) {
        Ok(document) => reader.diagram(document.root_element()),
        Err(finding) => {
            reader.diagnostics.push(finding);
            Program::default()
        }
    };
    if !has_errors(&reader.diagnostics) {
        let found = check(&program).into_iter();
        let errors = found.filter(|found| found.severity == understudy_diagnostic::Severity::Error);
        reader.diagnostics.extend(errors);
    }
    let mut diagnostics = reader.diagnostics;
    diagnostics.sort_by_key(|found| found.span.start);
    diagnostics.truncate(MAXIMUM_FINDINGS);
    Reading {
        program: (!has_errors(&diagnostics)).then_some(program),
        diagnostics,
    }
}

#[derive(Default)]
struct Reader {
    names: Names,
    feeds: Feeds,
    diagnostics: Vec<Diagnostic>,
}

impl Reader {
    fn error(&mut self, code: &'static str, message: impl Into<String>, span: Range<usize>) {
        if self.diagnostics.len() < MAXIMUM_FINDINGS {
            self.diagnostics
                .push(Diagnostic::error(code, message, span));
        }
    }

    /// Says which children of `node` nobody reads.
    fn only(&mut self, node: Node<'_, '_>, known: &[&str]) {
        for child in xml::elements(node) {
            let name = child.tag_name().name();
            if !known.contains(&name) && self.diagnostics.len() < MAXIMUM_FINDINGS {
                let message = format!("the element `{name}` is not read here");
                self.diagnostics
                    .push(Diagnostic::warning("U1066", message, xml::start_tag(child)));
            }
        }
    }

    fn diagram(&mut self, root: Node<'_, '_>) -> Program {
        if root.tag_name().name() != "LadderDiagram" {
            let message = format!(
                "a LadderDiagram is expected, and `{}` stands here",
                root.tag_name().name()
            );
            self.error("U1060", message, xml::start_tag(root));
            return Program::default();
        }
        self.only(root, &["Comment", "Signals", "Graph", "Footer"]);
        let name = xml::attribute(root, "name").unwrap_or_else(|| Name::from("ladder"));
        let mut program = Program {
            name: self.names.legal(&name, &mut self.diagnostics),
            description: root.attribute("description").map(str::to_owned),
            comments: comments(root, "Comment"),
            footer: comments(root, "Footer"),
            ..Program::default()
        };
        if let Some(declared) = xml::child(root, "Signals") {
            self.only(declared, &["Signal"]);
            for signal in xml::children(declared, "Signal") {
                self.declaration(signal, &mut program);
            }
        }
        let mut used = Vec::new();
        for graph in xml::children(root, "Graph") {
            if program.rungs.len() >= MAXIMUM_RUNGS {
                let message = format!("there are more than {MAXIMUM_RUNGS} graphs");
                self.error("U1065", message, xml::start_tag(graph));
                break;
            }
            self.graph(graph, &mut program, &mut used);
        }
        let mut unused: Vec<_> = std::mem::take(&mut self.feeds).into_iter().collect();
        unused.sort_by_key(|(_, (_, span))| span.start);
        for ((block, pin), (_, span)) in unused {
            self.error(
                "U1064",
                format!("no graph behind this one has the block `{block}` for its input `{pin}`"),
                span,
            );
        }
        if xml::child(root, "Signals").is_none() {
            signals(&used, &mut program, &mut self.diagnostics);
        }
        program
    }

    fn declaration(&mut self, node: Node<'_, '_>, program: &mut Program) {
        self.only(node, &["Comment"]);
        let Some(name) = xml::attribute(node, "name") else {
            self.error("U1061", "a Signal needs a name", xml::start_tag(node));
            return;
        };
        let address = xml::attribute(node, "address").and_then(|address| {
            let found = understudy_ladder::parse_address(address.trim_start_matches('%'));
            if found.is_none() {
                self.error(
                    "U1061",
                    format!("`{address}` is not the address of a bit"),
                    address.span(),
                );
            }
            found
        });
        let initial = xml::attribute(node, "initial").and_then(|initial| match initial.as_str() {
            "0" => Some(false),
            "1" => Some(true),
            other => {
                self.error(
                    "U1061",
                    format!("`{other}` is no initial value; 0 and 1 are"),
                    initial.span(),
                );
                None
            }
        });
        let signal = Signal {
            name: self.names.legal(&name, &mut self.diagnostics),
            address,
            initial,
            description: node.attribute("description").map(str::to_owned),
            comments: comments(node, "Comment"),
        };
        match node.attribute("role") {
            Some("input") => program.inputs.push(signal),
            Some("output") => program.outputs.push(signal),
            Some("memory") => program.memory.push(signal),
            _ => self.error(
                "U1061",
                "the role of a Signal is input, output or memory",
                xml::start_tag(node),
            ),
        }
    }

    fn graph(
        &mut self,
        node: Node<'_, '_>,
        program: &mut Program,
        used: &mut Vec<super::infer::Use>,
    ) {
        self.only(node, &["Comment", "Vertices", "Edges"]);
        let place = xml::start_tag(node);
        let number = program.rungs.len() + 1;
        let vertices: Option<Vec<usize>> = xml::child(node, "Vertices").map(|vertices| {
            self.only(vertices, &["Vertex"]);
            let vertices = xml::children(vertices, "Vertex");
            vertices.filter_map(|vertex| self.vertex(vertex)).collect()
        });
        let mut edges = Vec::new();
        let mut is_whole = true;
        if let Some(content) = xml::child(node, "Edges") {
            self.only(content, &["Edge"]);
            for edge in xml::children(content, "Edge") {
                match self.edge(edge, vertices.as_deref(), used) {
                    Some(edge) => edges.push(edge),
                    None => is_whole = false,
                }
            }
        }
        // What is missing is said already, and would only look like a hole.
        if !is_whole {
            return;
        }
        let found = match network(number, edges, &place) {
            Ok(found) => found,
            Err(found) => {
                self.diagnostics.extend(found);
                return;
            }
        };
        if let Some(block) = xml::attribute(node, "block") {
            let pin = xml::attribute(node, "pin").unwrap_or_default();
            let key = (block.to_string(), pin.to_string());
            if let Some(coil) = found.coils.first() {
                self.error(
                    "U1064",
                    "a graph that feeds a block has no outputs",
                    coil.target.span(),
                );
            }
            if self.feeds.insert(key, (found, place.clone())).is_some() {
                self.error(
                    "U1064",
                    format!("the input `{pin}` of `{block}` is fed by two graphs"),
                    place,
                );
            }
            return;
        }
        self.rung(node, found, program);
    }

    /// Adds the rungs of a graph, with what feeds its blocks.
    fn rung(&mut self, node: Node<'_, '_>, found: Network, program: &mut Program) {
        let Network {
            before,
            bits,
            series,
            coils,
            after,
        } = found;
        program.memory.extend(bits.into_iter().map(Signal::new));
        let mut own = Rung {
            title: node.attribute("title").map(str::to_owned),
            comments: comments(node, "Comment"),
            network: series,
            coils,
        };
        let has_own = !own.coils.is_empty() || own.network.iter().any(has_block);
        let mut rungs = before;
        if !has_own && let Some(last) = rungs.last_mut() {
            // The graph ends in a block, which stands on the rung of its last vertex.
            last.title = own.title.take();
            last.comments = std::mem::take(&mut own.comments);
        } else {
            rungs.push(own);
        }
        rungs.extend(after);
        for mut rung in rungs {
            let mut first = Vec::new();
            let mut bits = Vec::new();
            self.feed(&mut rung.network, &mut first, &mut bits);
            program.memory.extend(bits.into_iter().map(Signal::new));
            program.rungs.extend(first);
            program.rungs.push(rung);
        }
    }

    /// Gives blocks what feeds them.
    fn feed(&mut self, series: &mut Series, first: &mut Vec<Rung>, bits: &mut Vec<String>) {
        for element in series {
            match element {
                Element::Branches(branches) => {
                    for branch in branches {
                        self.feed(branch, first, bits);
                    }
                }
                Element::Block(block) => {
                    for (pin, _) in block.kind.side_inputs() {
                        let key = (block.name.to_string(), (*pin).to_owned());
                        let Some((mut found, span)) = self.feeds.remove(&key) else {
                            continue;
                        };
                        for mut rung in found.before {
                            self.feed(&mut rung.network, first, bits);
                            first.push(rung);
                        }
                        bits.extend(found.bits);
                        self.feed(&mut found.series, first, bits);
                        block.pins.push(Feed {
                            pin: Name::at(*pin, span),
                            network: found.series,
                        });
                    }
                }
                Element::Contact(_) | Element::Comparison(_) => {}
            }
        }
    }

    fn whole(&mut self, node: Node<'_, '_>, word: &Name, what: &str) -> Option<usize> {
        let found = word.parse().ok();
        if found.is_none() {
            let span = if word.is_empty() {
                xml::start_tag(node)
            } else {
                word.span()
            };
            self.error(
                "U1061",
                format!("{what} is a whole number, and `{}` is none", word.as_str()),
                span,
            );
        }
        found
    }

    fn vertex(&mut self, node: Node<'_, '_>) -> Option<usize> {
        let number = xml::attribute(node, "number").unwrap_or_default();
        self.whole(node, &number, "the number of a vertex")
    }

    fn edge(
        &mut self,
        node: Node<'_, '_>,
        vertices: Option<&[usize]>,
        used: &mut Vec<super::infer::Use>,
    ) -> Option<RawEdge> {
        self.only(
            node,
            &[
                "from", "to", "address", "symbol", "relation", "value", "block", "preset",
            ],
        );
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
        let symbol = xml::child(node, "symbol")
            .map(xml::word)
            .unwrap_or_default();
        if symbol.is_empty() {
            self.error("U1061", "an edge needs a symbol", xml::start_tag(node));
            return None;
        }
        let content = self.content(node, &symbol)?;
        used.push(super::infer::Use {
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
            address: xml::child(node, "address")
                .map(xml::word)
                .filter(|word| !word.is_empty()),
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
        Some(RawEdge {
            from,
            to,
            content,
            span: xml::start_tag(node),
        })
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
            let kind = if kind == NormallyOpen && is_marked {
                NormallyClosed
            } else {
                kind
            };
            return Some(Content::Element(Element::Contact(Contact {
                kind,
                operand: name,
            })));
        }
        if let Some(kind) = coil_kind(&word) {
            return Some(Content::Coil(Coil { kind, target: name }));
        }
        match word.as_str() {
            "ComparisonEdge" => {
                let relation = xml::child(node, "relation")
                    .map(xml::word)
                    .unwrap_or_default();
                let found = Relation::ALL
                    .into_iter()
                    .find(|known| known.sign() == relation.as_str());
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
                self.diagnostics
                    .push(finding.with_help(format!("edges are {}", edge_types())));
                None
            }
        }
    }

    fn block_kind(&mut self, node: Node<'_, '_>) -> Option<BlockKind> {
        let word = xml::child(node, "block").map(xml::word).unwrap_or_default();
        let preset = xml::child(node, "preset")
            .map(xml::word)
            .unwrap_or_default();
        let time = parse_time(&preset).filter(|_| !preset.is_empty());
        let number = preset
            .parse::<u16>()
            .ok()
            .filter(|value| u64::from(*value) <= u64::from(MAXIMUM_PRESET_VALUE));
        let kind = match word.as_str() {
            "TON" => time.map(BlockKind::Ton),
            "TOF" => time.map(BlockKind::Tof),
            "TP" => time.map(BlockKind::Tp),
            "CTU" => number.map(BlockKind::Ctu),
            "CTD" => number.map(BlockKind::Ctd),
            "CTUD" => number.map(BlockKind::Ctud),
            "SR" => Some(BlockKind::Sr),
            "RS" => Some(BlockKind::Rs),
            "R_TRIG" => Some(BlockKind::RTrig),
            "F_TRIG" => Some(BlockKind::FTrig),
            other => {
                self.error(
                    "U1061",
                    format!("`{other}` is no block that is known here"),
                    xml::start_tag(node),
                );
                return None;
            }
        };
        if kind.is_none() {
            let message = format!("`{}` is no preset of a {}", preset.as_str(), word.as_str());
            self.error("U1061", message, xml::start_tag(node));
        }
        kind
    }
}

fn has_block(element: &Element) -> bool {
    let mut found = false;
    visit(&vec![element.clone()], &mut |element| {
        found |= matches!(element, Element::Block(_))
    });
    found
}

fn comments(node: Node<'_, '_>, name: &str) -> Vec<String> {
    xml::children(node, name)
        .map(|comment| {
            xml::text(comment)
                .split_whitespace()
                .collect::<Vec<_>>()
                .join(" ")
        })
        .collect()
}
