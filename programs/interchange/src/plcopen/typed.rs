//! A document as syntax, for programs with numbers: variables, types and configuration as they are declared, bodies in
//! all languages as statements, lists and charts.

mod account;
mod chart;
mod configuration;
mod interface;
pub(crate) mod make;
mod network;
mod surroundings;
pub(crate) mod values;

use std::collections::{HashMap, HashSet};
use std::ops::Range;

use understudy_ladder::Name as Written;
use understudy_structured_text::parser::{parse_instructions_at, parse_statements_at};
use understudy_structured_text::syntax::{Body, File, Unit, UnitKind};
use understudy_text::Diagnostic;
use understudy_text::xml::Node;

use crate::diagrams::Style;

use super::document::{self, Body as Drawn, Language, Part, Pou, PouKind};
use super::xml::{self, attribute, child, elements, start_tag};
use super::{NAMESPACES, within};
use network::Network;

/// The namespace of the first edition, whose elements are the same as far as they are read.
const FIRST_EDITION: &str = "http://www.plcopen.org/xml/tc6.xsd";

/// What is being read.
struct Typed {
    file: File,
    /// Units in front that are not of the document.
    known: usize,
    diagnostics: Vec<Diagnostic>,
    notes: Vec<(String, Range<usize>)>,
}

/// A document as syntax.
#[derive(Default)]
pub(super) struct ReadFile {
    pub(super) file: File,
    pub(super) diagnostics: Vec<Diagnostic>,
    /// What is worth knowing of its networks and changes nothing.
    pub(super) notes: Vec<(String, Range<usize>)>,
}

/// Reads a document, with everything that is wrong with it. Places are those of the document.
pub fn read_typed(text: &str) -> (File, Vec<Diagnostic>) {
    let read = read_typed_of(text, None);
    (read.file, read.diagnostics)
}

/// Reads of a document the units of these names, in capitals; all of them where none are given.
pub(super) fn read_typed_of(text: &str, units: Option<&HashSet<String>>) -> ReadFile {
    match xml::parse(text) {
        Ok(document) => read_root(document.root_element(), units, &File::default()),
        Err(error) => ReadFile { diagnostics: vec![error], ..ReadFile::default() },
    }
}

/// Reads a document that is an element of another one, where `known` is declared outside of it.
pub(crate) fn read_document(root: Node<'_, '_>, known: &File) -> (File, Vec<Diagnostic>) {
    let read = read_root(root, None, known);
    (read.file, read.diagnostics)
}

fn read_root(root: Node<'_, '_>, units: Option<&HashSet<String>>, known: &File) -> ReadFile {
    let text = root.document().input_text();
    let namespace = root.tag_name().namespace().unwrap_or_default();
    let is_known = NAMESPACES.contains(&namespace) || namespace == FIRST_EDITION;
    if root.tag_name().name() != "project" || !is_known {
        let message = format!(
            "not a PLCopen XML file: its root is `{}` in the namespace {namespace:?}",
            root.tag_name().name()
        );
        let error = Diagnostic::error("U1001", message, xml::start_tag(root));
        let help = format!("it should be `project` in the namespace {:?}", NAMESPACES[0]);
        return ReadFile { diagnostics: vec![error.with_help(help)], ..ReadFile::default() };
    }
    let mut typed = Typed {
        file: known.clone(),
        known: known.units.len(),
        diagnostics: Vec::new(),
        notes: Vec::new(),
    };
    account::check(root, &mut typed.diagnostics);
    typed.project(root, units);
    typed.file.remove_first(known);
    let mut diagnostics = typed.diagnostics;
    for found in &mut diagnostics {
        within(text, &mut found.span);
        for related in &mut found.related {
            within(text, &mut related.span);
        }
    }
    diagnostics.sort_by_key(|found| (found.span.start, found.span.end));
    diagnostics.dedup();
    let mut notes = typed.notes;
    for (_, span) in &mut notes {
        within(text, span);
    }
    ReadFile { file: typed.file, diagnostics, notes }
}

/// The units of a document, or of those of a project, whose bodies are ladders or function blocks, in capitals.
pub fn drawn_units(text: &str) -> HashMap<String, Style> {
    let Ok(document) = xml::parse(text) else {
        return HashMap::new();
    };
    let style = |pou: &Pou| match &pou.body {
        Some(Drawn::Graph(graph)) => match graph.language {
            Language::Ladder => Some(Style::Ladder),
            Language::FunctionBlocks => Some(Style::Blocks),
            Language::Sequence => None,
        },
        _ => None,
    };
    let projects = xml::projects(document.root_element());
    let pous = projects.flat_map(|project| document::read_bodies(project).0.pous);
    pous.filter_map(|pou| Some((pou.name.to_uppercase(), style(&pou)?))).collect()
}

impl Typed {
    fn error(&mut self, code: &'static str, message: String, span: Range<usize>) {
        self.diagnostics.push(Diagnostic::error(code, message, span));
    }

    /// An attribute that the reader cannot do without.
    fn needed(&mut self, node: Node<'_, '_>, name: &str) -> Option<Written> {
        let found = attribute(node, name).filter(|value| !value.is_empty());
        if found.is_none() {
            let message = format!("`{}` lacks its `{name}`", node.tag_name().name());
            self.error("U1002", message, start_tag(node));
        }
        found
    }

    /// Whether a name is that of a function block or a function.
    fn is_block(&self, name: &str) -> bool {
        let found = values::unit(&self.file, name);
        found.is_some_and(|unit| unit.kind != UnitKind::Program)
    }

    fn project(&mut self, root: Node<'_, '_>, units: Option<&HashSet<String>>) {
        let (mut project, found) = document::read_bodies(root);
        project.pous.retain(|pou| {
            let name = pou.name.to_uppercase();
            units.is_none_or(|units| units.contains(&name))
        });
        self.diagnostics.extend(found);
        for types in elements(root).filter(|part| part.tag_name().name() == "types") {
            for list in elements(types).filter(|list| list.tag_name().name() == "dataTypes") {
                self.data_types(list);
            }
        }
        for list in xml::parts_of_tools(root, "datatype") {
            self.data_types(list);
        }
        let mut nodes: HashMap<String, Node<'_, '_>> = HashMap::new();
        for node in root.descendants().filter(|node| node.tag_name().name() == "pou") {
            if let Some(name) = attribute(node, "name") {
                nodes.entry(name.to_uppercase()).or_insert(node);
            }
        }
        // All are known before any body is read.
        for pou in &project.pous {
            let node = nodes.get(&pou.name.to_uppercase()).copied();
            self.unit(pou, node);
        }
        for instances in elements(root).filter(|part| part.tag_name().name() == "instances") {
            self.instances(instances);
        }
        for resource in xml::applications(root) {
            self.resource(resource);
        }
        for list in xml::parts_of_tools(root, "globalvars") {
            self.globals(list);
        }
        self.surroundings();
        for (at, pou) in (self.known..).zip(&project.pous) {
            self.body(at, pou, project.lacks_instances);
        }
    }

    /// A unit without its body.
    fn unit(&mut self, pou: &Pou, node: Option<Node<'_, '_>>) {
        let interface = node.and_then(|node| child(node, "interface"));
        let (declarations, result) =
            interface.map_or((Vec::new(), None), |node| self.interface(node));
        let kind = match pou.kind {
            PouKind::Program => UnitKind::Program,
            PouKind::FunctionBlock => UnitKind::FunctionBlock,
            PouKind::Function => UnitKind::Function,
        };
        let mut comments = node.map(interface::comments).unwrap_or_default();
        if comments.is_empty() {
            comments = interface.map(interface::comments).unwrap_or_default();
        }
        self.file.units.push(Unit {
            kind,
            name: make::name(&pou.name),
            comments,
            result: result.filter(|_| kind == UnitKind::Function),
            declarations,
            body: Body::default(),
            methods: Vec::new(),
            extends: None,
            implements: Vec::new(),
            span: pou.name.span(),
        });
    }

    /// Fills the body of the unit at that place.
    fn body(&mut self, at: usize, pou: &Pou, lacks_instances: bool) {
        let mut found = Vec::new();
        let mut methods = Vec::new();
        let declarations = self.file.units[at].declarations.clone();
        let mut network = Network::new(&self.file, &declarations, lacks_instances, &mut found);
        let mut is_chart = false;
        let body = match &pou.body {
            Some(Drawn::Graph(graph)) if graph.language == Language::Sequence => {
                is_chart = true;
                let charted = chart::chart(pou, graph, &mut network);
                methods = charted.methods;
                Body::Chart(charted.chart)
            }
            Some(Drawn::Graph(graph)) => Body::Statements(network.statements(graph)),
            Some(Drawn::StructuredText(text)) => {
                let (statements, errors) =
                    parse_statements_at(text.as_str(), &|span| text.place(span));
                network.diagnostics.extend(errors);
                Body::Statements(statements)
            }
            Some(Drawn::InstructionList(text)) => {
                let (list, errors) = parse_instructions_at(text.as_str(), &|span| text.place(span));
                network.diagnostics.extend(errors);
                Body::Instructions(list)
            }
            None => {
                let message = format!("`{}` has no body", pou.name);
                let error = Diagnostic::error("U1010", message, pou.name.span());
                network.diagnostics.push(error);
                Body::default()
            }
        };
        let made = std::mem::take(&mut network.made);
        let kept = declarations.iter().filter(|known| !network.is_unread(&known.name.key()));
        let kept = kept.cloned().collect();
        self.notes.append(&mut network.notes);
        if !is_chart {
            for part in pou.actions.iter().chain(&pou.transitions) {
                found.push(foreign(part, pou));
            }
        }
        let unit = &mut self.file.units[at];
        unit.declarations = kept;
        unit.declarations.extend(made);
        unit.body = body;
        unit.methods = methods;
        self.diagnostics.append(&mut found);
    }
}

/// The finding on an action or transition of a unit without a chart.
fn foreign(part: &Part, pou: &Pou) -> Diagnostic {
    let message = format!(
        "`{}` is an action or transition of `{}`, which is not a chart",
        part.name, pou.name
    );
    let found = Diagnostic::warning("U1023", message, part.name.span());
    found.with_help("nothing does it: move its statements into the body")
}
