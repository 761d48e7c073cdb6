//! Supremica's modules: .wmod, XML of the name space `http://waters.sourceforge.net/xsd/module`.
//!
//! A component whose graph knows `:accepting` marks the nodes that have it. One that does not know it has all states marked, as in
//! Supremica. Variables, guards, actions, arrays of events, instances and groups of nodes are U0834.

use understudy_text::xml::{self, Node};

use super::draft::{Declared, Draft, Findings};
use super::{ACCEPTING, ReadForeign};
use crate::alphabet::{Alphabet, Event};
use crate::automaton::Automaton;
use crate::model::Model;

/// Reads a module of Supremica and finds everything that is wrong with it (U0833 to U0838).
pub fn read_module(text: &str) -> ReadForeign {
    let mut reader = Reader::default();
    let mut model = Model::default();
    let mut unobservable = Vec::new();
    match xml::parse(text, "U0833") {
        Err(diagnostic) => reader.findings.push(diagnostic),
        Ok(document) => {
            let root = document.root_element();
            match root.tag_name().name() {
                "Module" => {
                    reader.module(root, &mut model);
                    unobservable =
                        reader.declared.unobservable(&reader.events, &mut reader.findings);
                }
                other => {
                    let message = format!("the root element is `{other}`; expected `Module`");
                    reader.findings.error("U0833", message, xml::start_tag(root));
                }
            }
        }
    }
    reader.findings.answer(model, unobservable)
}

#[derive(Default)]
struct Reader {
    declared: Declared,
    events: Vec<Event>,
    findings: Findings,
}

/// Elements that say where something is drawn, or speak to people.
fn is_silent(node: Node<'_, '_>) -> bool {
    let name = node.tag_name().name();
    name.ends_with("Geometry") || name == "Comment"
}

impl Reader {
    /// U0834 for the elements in `node` that have none of the names.
    fn only(&mut self, node: Node<'_, '_>, names: &[&str]) {
        for child in xml::elements(node).filter(|child| !is_silent(*child)) {
            let name = child.tag_name().name();
            if !names.contains(&name) {
                let within = node.tag_name().name();
                let message = format!("`{name}` in `{within}` is not read: {}", instead(name));
                self.findings.unsupported(message, xml::start_tag(child));
            }
        }
    }

    /// An attribute that must be there, or U0835.
    fn attribute<'a>(&mut self, node: Node<'a, '_>, name: &str) -> Option<&'a str> {
        let value = node.attribute(name);
        if value.is_none() {
            let message = format!("`{}` needs `{name}`", node.tag_name().name());
            self.findings.malformed(message, xml::start_tag(node));
        }
        value
    }

    fn module(&mut self, root: Node<'_, '_>, model: &mut Model) {
        self.only(root, &["ConstantAliasList", "EventDeclList", "ComponentList"]);
        model.name = root.attribute("Name").unwrap_or_default().to_owned();
        for list in xml::children(root, "EventDeclList") {
            self.only(list, &["EventDecl"]);
            for event in xml::children(list, "EventDecl") {
                self.declare(event);
            }
        }
        self.events = self.declared.events();
        model.alphabet = Alphabet::new(self.events.iter().cloned());
        for list in xml::children(root, "ComponentList") {
            self.only(list, &["SimpleComponent"]);
            for component in xml::children(list, "SimpleComponent") {
                self.component(component, model);
            }
        }
    }

    fn declare(&mut self, event: Node<'_, '_>) {
        self.only(event, &[]);
        let (Some(name), Some(kind)) =
            (self.attribute(event, "Name"), self.attribute(event, "Kind"))
        else {
            return;
        };
        let controllable = match kind {
            "CONTROLLABLE" => true,
            "UNCONTROLLABLE" => false,
            "PROPOSITION" => return,
            other => {
                let message = format!(
                    "the kind of event {name} is `{other}`; expected CONTROLLABLE, UNCONTROLLABLE or PROPOSITION"
                );
                self.findings.malformed(message, xml::start_tag(event));
                return;
            }
        };
        let observable = event.attribute("Observable") != Some("false");
        if !self.declared.declare(name, controllable, observable) {
            let message = format!("event {name} is declared twice");
            self.findings.malformed(message, xml::start_tag(event));
        }
    }

    fn component(&mut self, component: Node<'_, '_>, model: &mut Model) {
        self.only(component, &["Graph"]);
        let (Some(name), Some(kind)) =
            (self.attribute(component, "Name"), self.attribute(component, "Kind"))
        else {
            return;
        };
        let place = xml::start_tag(component);
        let Some(graph) = xml::child(component, "Graph") else {
            self.findings.malformed(format!("component {name} has no `Graph`"), place);
            return;
        };
        let role = match kind {
            "PLANT" => &mut model.plants,
            "SPEC" => &mut model.specifications,
            "SUPERVISOR" => &mut model.supervisors,
            "PROPERTY" => {
                let message = format!("{name} is a property: it is not read");
                self.findings.remark(message, place);
                return;
            }
            other => {
                let message = format!(
                    "the kind of component {name} is `{other}`; expected PLANT, SPEC, SUPERVISOR or PROPERTY"
                );
                self.findings.malformed(message, place);
                return;
            }
        };
        role.extend(self.graph(name, graph));
    }

    fn graph(&mut self, name: &str, graph: Node<'_, '_>) -> Option<Automaton> {
        self.only(graph, &["LabelBlock", "NodeList", "EdgeList"]);
        let mut draft = Draft::of(name);
        let mut is_marking = false;
        for list in xml::children(graph, "NodeList") {
            self.only(list, &["SimpleNode"]);
            for node in xml::children(list, "SimpleNode") {
                is_marking |= self.node(node, &mut draft);
            }
        }
        for blocked in xml::children(graph, "LabelBlock") {
            for (event, node) in self.identifiers(blocked) {
                if event == ACCEPTING {
                    is_marking = true;
                } else if let Some(event) = self.find(event, node) {
                    draft.alphabet.insert(event);
                }
            }
        }
        for list in xml::children(graph, "EdgeList") {
            self.only(list, &["Edge"]);
            for edge in xml::children(list, "Edge") {
                self.edge(edge, &mut draft);
            }
        }
        let place = xml::start_tag(graph);
        if !is_marking {
            if draft.state_count() > 0 {
                let message = format!(
                    "{name} does not know `{ACCEPTING}`: all of its states are marked, as in Supremica"
                );
                self.findings.remark(message, place.clone());
            }
            draft.mark_all();
        }
        draft.finish(&self.events, place, &mut self.findings, |number| format!("S{number}"))
    }

    /// Reads a node; whether it is marked.
    fn node(&mut self, node: Node<'_, '_>, draft: &mut Draft) -> bool {
        self.only(node, &["EventList"]);
        let Some(name) = self.attribute(node, "Name") else { return false };
        let place = xml::start_tag(node);
        let Some(state) = draft.add_state(name, &[name]) else {
            let message = format!("{} has two states {name}", draft.name);
            self.findings.malformed(message, place);
            return false;
        };
        if node.attribute("Initial") == Some("true") {
            draft.begin(state, place, &mut self.findings);
        }
        let mut is_marked = false;
        for list in xml::children(node, "EventList") {
            for (proposition, node) in self.identifiers(list) {
                if proposition == ACCEPTING {
                    is_marked = true;
                    draft.mark(state);
                } else {
                    let message = format!(
                        "state {name} of {} has the proposition `{proposition}`; only `{ACCEPTING}` is read, a state is forbidden by a specification without it",
                        draft.name
                    );
                    self.findings.unsupported(message, xml::start_tag(node));
                }
            }
        }
        is_marked
    }

    fn edge(&mut self, edge: Node<'_, '_>, draft: &mut Draft) {
        self.only(edge, &["LabelBlock", "GuardActionBlock"]);
        for block in xml::children(edge, "GuardActionBlock") {
            let parts = xml::elements(block).filter(|part| !is_silent(*part));
            for part in parts.filter(|part| part.has_children()) {
                if let Some(expression) = xml::elements(part).next() {
                    let text = expression.attribute("Text").unwrap_or("an expression");
                    let name = part.tag_name().name();
                    let message = format!("`{name}` of an edge are not read: {text}");
                    self.findings.unsupported(message, xml::start_tag(expression));
                }
            }
        }
        let place = xml::start_tag(edge);
        let ends = ["Source", "Target"].map(|end| {
            let name = self.attribute(edge, end)?;
            draft.state(name, place.clone(), &mut self.findings)
        });
        for block in xml::children(edge, "LabelBlock") {
            for (event, node) in self.identifiers(block) {
                if let (Some(event), [Some(source), Some(target)]) = (self.find(event, node), ends)
                {
                    draft.connect(source, event, target, xml::start_tag(node));
                }
            }
        }
    }

    /// The names in a list of identifiers.
    fn identifiers<'a, 'i>(&mut self, list: Node<'a, 'i>) -> Vec<(&'a str, Node<'a, 'i>)> {
        self.only(list, &["SimpleIdentifier"]);
        let mut names = Vec::new();
        for node in xml::children(list, "SimpleIdentifier") {
            if let Some(name) = self.attribute(node, "Name") {
                names.push((name, node));
            }
        }
        names
    }

    fn find(&mut self, event: &str, node: Node<'_, '_>) -> Option<usize> {
        self.declared.find(event, xml::start_tag(node), &mut self.findings)
    }
}

/// What to do where an element is not read.
fn instead(name: &str) -> &'static str {
    match name {
        "VariableComponent" => {
            "an automaton has no variables; flatten the module in Supremica first"
        }
        "GroupNode" => "ungroup the nodes, and draw the edges from each of them",
        "Instance" => "copy the components of the module",
        "ForeachComponent" => "write each component",
        "ForeachEvent" => "write each event",
        "RangeList" | "IndexedIdentifier" => "declare each event of the array",
        "EventAliasList" => "write the events in place of the alias",
        _ => "it may change what the automaton means",
    }
}
