//! From elements to a [`Project`]: projects, units, variables, types.

use understudy_ladder::Name;
use understudy_text::Diagnostic;
use understudy_text::xml::Node;

use super::objects::graph;
use super::{
    Body, Ignored, Instance, Language, Part, Pou, PouKind, Project, Variable, VariableType,
};
use crate::plcopen::literal::{interval, no_interval};
use crate::plcopen::xml::{
    applications, attribute, child, children, elements, parts_of_tools, program_type, start_tag,
    text, word,
};

/// Reads a project as far as it can be understood, and says what cannot.
pub(crate) fn read(root: Node<'_, '_>) -> (Project, Vec<Diagnostic>) {
    read_parts(root, true)
}

/// The units of a project with their bodies alone.
pub(crate) fn read_bodies(root: Node<'_, '_>) -> (Project, Vec<Diagnostic>) {
    read_parts(root, false)
}

fn read_parts(root: Node<'_, '_>, has_variables: bool) -> (Project, Vec<Diagnostic>) {
    let mut reader = Reader { project: Project::default(), diagnostics: Vec::new(), has_variables };
    for part in elements(root) {
        match part.tag_name().name() {
            "types" => {
                for list in elements(part) {
                    match list.tag_name().name() {
                        "pous" => reader.pous(list),
                        // They are read elsewhere for programs with numbers.
                        "dataTypes" if has_variables => {
                            for data_type in children(list, "dataType") {
                                reader.ignore("a data type of the file", data_type);
                            }
                        }
                        _ => {}
                    }
                }
            }
            // Some tools leave the types out.
            "pous" => {
                reader.project.lacks_instances = true;
                reader.pous(part);
            }
            "instances" if has_variables => reader.instances(part),
            "addData" => reader.ignore("additional data of a tool", part),
            _ => {}
        }
    }
    for list in parts_of_tools(root, "pou") {
        reader.pous(list);
    }
    if has_variables {
        for resource in applications(root) {
            reader.instances(resource);
        }
        for list in parts_of_tools(root, "globalvars") {
            // Those of a resource have been read with it.
            let holder = list.ancestors().nth(2);
            if holder == Some(root) {
                reader.instances(list);
            }
        }
    }
    (reader.project, reader.diagnostics)
}

pub(super) struct Reader {
    pub(super) project: Project,
    pub(super) diagnostics: Vec<Diagnostic>,
    /// Whether variables, with their types and initial values, are read.
    has_variables: bool,
}

impl Reader {
    pub(super) fn error(&mut self, code: &'static str, message: String, node: Node<'_, '_>) {
        let error = Diagnostic::error(code, message, start_tag(node));
        self.diagnostics.push(error);
    }

    pub(super) fn ignore(&mut self, what: impl Into<String>, node: Node<'_, '_>) {
        self.project.ignored.push(Ignored { what: what.into(), span: start_tag(node) });
    }

    /// An attribute that the reader cannot do without.
    pub(super) fn needed(&mut self, node: Node<'_, '_>, name: &str) -> Option<Name> {
        let found = attribute(node, name).filter(|value| !value.is_empty());
        if found.is_none() {
            let element = node.tag_name().name();
            self.error("U1002", format!("`{element}` lacks its `{name}`"), node);
        }
        found
    }

    fn pous(&mut self, list: Node<'_, '_>) {
        for pou in children(list, "pou") {
            let (Some(name), Some(kind)) = (self.needed(pou, "name"), self.needed(pou, "pouType"))
            else {
                continue;
            };
            let kind = match kind.as_str() {
                "program" => PouKind::Program,
                "functionBlock" => PouKind::FunctionBlock,
                "function" => PouKind::Function,
                other => {
                    let message = format!(
                        "invalid type of unit `{other}`: expected program, functionBlock or function"
                    );
                    self.error("U1002", message, pou);
                    continue;
                }
            };
            let unit = self.pou(pou, name, kind);
            let twin =
                self.project.pous.iter().find(|known| known.name.eq_ignore_ascii_case(&unit.name));
            if let Some(twin) = twin {
                let error = Diagnostic::error(
                    "U1003",
                    format!("two units are called `{}`", unit.name),
                    unit.name.span(),
                );
                let error = error.with_related(twin.name.span(), "the first is here");
                self.diagnostics.push(error);
                continue;
            }
            self.project.pous.push(unit);
        }
    }

    fn pou(&mut self, pou: Node<'_, '_>, name: Name, kind: PouKind) -> Pou {
        let mut unit = Pou {
            name,
            kind,
            documentation: documentation(pou),
            variables: Vec::new(),
            body: None,
            actions: Vec::new(),
            transitions: Vec::new(),
        };
        for part in elements(pou) {
            match part.tag_name().name() {
                "interface" if self.has_variables => self.interface(part, &mut unit),
                "actions" => unit.actions = self.parts(part, "action"),
                "transitions" => unit.transitions = self.parts(part, "transition"),
                "body" if unit.body.is_some() => {
                    let message = format!("`{}` has more than one body", unit.name);
                    self.error("U1010", message, part);
                }
                "body" => unit.body = self.body(part),
                "addData" => self.ignore("additional data of a tool", part),
                _ => {}
            }
        }
        unit
    }

    fn parts(&mut self, list: Node<'_, '_>, element: &str) -> Vec<Part> {
        let mut parts = Vec::new();
        for part in children(list, element) {
            if let Some(name) = self.needed(part, "name") {
                let body = child(part, "body").and_then(|body| self.body(body));
                parts.push(Part { name, body });
            }
        }
        parts
    }

    pub(super) fn body(&mut self, body: Node<'_, '_>) -> Option<Body> {
        let is_language = |part: &Node<'_, '_>| {
            matches!(part.tag_name().name(), "LD" | "FBD" | "SFC" | "ST" | "IL")
        };
        if let Some(second) = elements(body).filter(is_language).nth(1) {
            let message = "a body in more than one language is not supported".to_owned();
            self.error("U1010", message, second);
        }
        for part in elements(body).filter(|part| part.tag_name().name() == "addData") {
            self.ignore("additional data of a tool", part);
        }
        for language in elements(body) {
            let found = match language.tag_name().name() {
                "LD" => Body::Graph(graph(self, language, Language::Ladder)),
                "FBD" => Body::Graph(graph(self, language, Language::FunctionBlocks)),
                "SFC" => Body::Graph(graph(self, language, Language::Sequence)),
                "ST" => Body::StructuredText(text(language)),
                "IL" => Body::InstructionList(text(language)),
                _ => continue,
            };
            return Some(found);
        }
        None
    }

    fn interface(&mut self, interface: Node<'_, '_>, unit: &mut Pou) {
        for list in elements(interface) {
            match list.tag_name().name() {
                "returnType" => {}
                "accessVars" => self.ignore("access paths", list),
                "addData" => self.ignore("additional data of a tool", list),
                _ => self.variables(list, &mut unit.variables),
            }
        }
    }

    fn variables(&mut self, list: Node<'_, '_>, into: &mut Vec<Variable>) {
        for node in children(list, "variable") {
            let Some(name) = attribute(node, "name") else {
                continue;
            };
            for part in elements(node).filter(|part| part.tag_name().name() == "addData") {
                self.ignore(format!("additional data of a tool on `{name}`"), part);
            }
            into.push(Variable {
                name,
                is_external: list.tag_name().name() == "externalVars",
                kind: self.data_type(node),
            });
        }
    }

    fn data_type(&mut self, variable: Node<'_, '_>) -> VariableType {
        let kind = child(variable, "type").and_then(|kind| elements(kind).next());
        let Some(kind) = kind else {
            return VariableType::Other;
        };
        match kind.tag_name().name() {
            "BOOL" => VariableType::Bool,
            "derived" => match attribute(kind, "name") {
                // What the types of variables are that Beremiz shows on a panel.
                Some(name) if ["HMI_BOOL", "HMI_INT"].contains(&name.as_str()) => {
                    self.ignore("what a panel shows of a variable", kind);
                    let is_bool = name.as_str() == "HMI_BOOL";
                    if is_bool { VariableType::Bool } else { VariableType::Other }
                }
                Some(name) => VariableType::Derived(name),
                None => VariableType::Other,
            },
            _ => VariableType::Other,
        }
    }

    fn instances(&mut self, part: Node<'_, '_>) {
        for node in part.descendants().filter(Node::is_element) {
            match node.tag_name().name() {
                "globalVars" => {
                    let mut globals = Vec::new();
                    self.variables(node, &mut globals);
                    self.project.globals.extend(globals);
                }
                "pouInstance" => {
                    let type_name = program_type(node);
                    let Some(type_name) = type_name.or_else(|| self.needed(node, "typeName"))
                    else {
                        continue;
                    };
                    let task =
                        node.parent_element().filter(|task| task.tag_name().name() == "task");
                    let given = |name| attribute(task?, name).filter(|value| !value.is_empty());
                    let interval = given("interval").and_then(|written| {
                        let found = interval(&written);
                        if found.is_none() {
                            self.diagnostics.push(no_interval(&written, written.span()));
                        }
                        found
                    });
                    let has_event = given("single").is_some();
                    self.project.instances.push(Instance { type_name, interval, has_event });
                }
                "addData" => self.ignore("additional data of a tool", node),
                _ => {}
            }
        }
    }
}

/// The text of an element's documentation on one line.
fn documentation(node: Node<'_, '_>) -> Option<String> {
    let text = word(child(node, "documentation")?);
    let words: Vec<&str> = text.split_whitespace().collect();
    (!words.is_empty()).then(|| words.join(" "))
}
