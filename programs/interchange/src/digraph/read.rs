//! XML to a program.

mod edge;

use std::collections::HashMap;
use std::ops::Range;

use understudy_ladder::{
    Element, Feed, MAXIMUM_RUNGS, Name, Program, Rung, Series, Signal, check, visit,
};
use understudy_text::xml::Node;
use understudy_text::{Diagnostic, has_errors};

use super::Reading;
use super::infer::{Names, Use, contradictions, signals};
use super::network::{Network, network};
use crate::plcopen::xml;

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
        let errors = found.filter(|found| found.severity == understudy_text::Severity::Error);
        reader.diagnostics.extend(errors);
    }
    let mut diagnostics = reader.diagnostics;
    diagnostics.sort_by_key(|found| found.span.start);
    Reading { program: (!has_errors(&diagnostics)).then_some(program), diagnostics }
}

#[derive(Default)]
struct Reader {
    names: Names,
    feeds: Feeds,
    diagnostics: Vec<Diagnostic>,
}

impl Reader {
    fn error(&mut self, code: &'static str, message: impl Into<String>, span: Range<usize>) {
        self.diagnostics.push(Diagnostic::error(code, message, span));
    }

    /// Reports the children and attributes of `node` that are not read.
    fn only(&mut self, node: Node<'_, '_>, elements: &[&str], attributes: &[&str]) {
        let mut found = Vec::new();
        for child in xml::elements(node) {
            let name = child.tag_name().name();
            if !elements.contains(&name) {
                found.push((
                    format!("the element `{name}` is not read here"),
                    xml::start_tag(child),
                ));
            }
        }
        for attribute in node.attributes() {
            let name = attribute.name();
            if attribute.namespace().is_none() && !attributes.contains(&name) {
                found.push((format!("the attribute `{name}` is not read here"), attribute.range()));
            }
        }
        for (message, span) in found {
            self.diagnostics.push(Diagnostic::warning("U1066", message, span));
        }
    }

    fn diagram(&mut self, root: Node<'_, '_>) -> Program {
        if root.tag_name().name() != "LadderDiagram" {
            let message = format!("expected a LadderDiagram, found `{}`", root.tag_name().name());
            self.error("U1060", message, xml::start_tag(root));
            return Program::default();
        }
        self.only(root, &["Comment", "Signals", "Graph", "Footer"], &["name", "description"]);
        let name = xml::attribute(root, "name").unwrap_or_else(|| Name::from("ladder"));
        let mut program = Program {
            name: self.names.legal(&name, &mut self.diagnostics),
            description: root.attribute("description").map(str::to_owned),
            comments: comments(root, "Comment"),
            footer: comments(root, "Footer"),
            ..Program::default()
        };
        if let Some(declared) = xml::child(root, "Signals") {
            self.only(declared, &["Signal"], &[]);
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
        } else {
            contradictions(&used, &program, &mut self.diagnostics);
        }
        program
    }

    fn declaration(&mut self, node: Node<'_, '_>, program: &mut Program) {
        let attributes = ["role", "name", "address", "initial", "description"];
        self.only(node, &["Comment"], &attributes);
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
                    format!("invalid initial value `{other}`: expected 0 or 1"),
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

    fn graph(&mut self, node: Node<'_, '_>, program: &mut Program, used: &mut Vec<Use>) {
        let attributes = ["graphNumber", "block", "pin", "title"];
        self.only(node, &["Comment", "Vertices", "Edges"], &attributes);
        let place = xml::start_tag(node);
        let number = program.rungs.len() + 1;
        let vertices: Option<Vec<usize>> = xml::child(node, "Vertices").map(|vertices| {
            self.only(vertices, &["Vertex"], &[]);
            let vertices = xml::children(vertices, "Vertex");
            vertices.filter_map(|vertex| self.vertex(vertex)).collect()
        });
        let mut edges = Vec::new();
        let mut is_whole = true;
        if let Some(content) = xml::child(node, "Edges") {
            self.only(content, &["Edge"], &[]);
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
        let Network { before, bits, series, coils, after } = found;
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
                        block.pins.push(Feed { pin: Name::at(*pin, span), network: found.series });
                    }
                }
                Element::Contact(_) | Element::Comparison(_) => {}
            }
        }
    }
}

fn has_block(element: &Element) -> bool {
    let mut found = false;
    visit(&vec![element.clone()], &mut |element| found |= matches!(element, Element::Block(_)));
    found
}

fn comments(node: Node<'_, '_>, name: &str) -> Vec<String> {
    xml::children(node, name)
        .map(|comment| xml::text(comment).as_str().split_whitespace().collect::<Vec<_>>().join(" "))
        .collect()
}
