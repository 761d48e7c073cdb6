//! The files of TwinCAT, `.TcPOU`, `.TcGVL`, `.TcDUT` and `.TcIO`: XML around Structured Text; and the document of a project.
//!
//! Declarations and bodies are texts; a body in another language is refused by its name, as are properties and transitions.

use understudy_structured_text::parser::{
    parse_at, parse_body_at, parse_declarations_at, parse_statements_at,
};
use understudy_structured_text::syntax::{
    Body, File, Name, ProgramInstance, Retention, Task, Unit, UnitKind,
};
use understudy_text::Diagnostic;
use understudy_text::xml::Node;

use crate::plcopen::read_document;
use crate::plcopen::xml::{attribute, child, children, elements, parse, start_tag, text, word};

/// What every file of TwinCAT has as its root, and the document of a project.
pub(crate) const ROOT: &str = "TcPlcObject";

/// A Structured Text in the document of a project.
pub(crate) const TEXT: &str = "StructuredText";

/// Behind the name of a library, its program for the pictures of a visualisation.
const VISUALISATION: &str = ".Visu_Prg";

/// Elements that change nothing: folders, and where lines are.
const READ_PAST: [&str; 4] = ["Folder", "LineIds", "ObjectProperties", "Data"];

/// Whether a text can be a file of TwinCAT, or the document of a project.
pub(crate) fn is_one(text: &str) -> bool {
    let start = text.trim_start_matches('\u{feff}').trim_start();
    start.starts_with('<') && start.contains(ROOT)
}

/// Reads a file of TwinCAT, or the files of a project, with everything that is wrong with it; none where the text is none.
pub(crate) fn read(text: &str) -> Option<(File, Vec<Diagnostic>)> {
    if !is_one(text) {
        return None;
    }
    let document = match parse(text) {
        Ok(document) => document,
        Err(error) => return Some((File::default(), vec![error])),
    };
    let root = document.root_element();
    if root.tag_name().name() != ROOT {
        return None;
    }
    let mut reader = Reader::default();
    for object in elements(root) {
        match object.tag_name().name() {
            "POU" => reader.unit(object),
            "GVL" | "DUT" => reader.declarations(object),
            "Task" => reader.task(object),
            "Itf" => reader.interface(object),
            TEXT => reader.text(object),
            "Compile" => reader.missing(object),
            "project" => {}
            name => reader.foreign(name, object),
        }
    }
    reader.documents(root);
    reader.diagnostics.sort_by_key(|found| found.span.start);
    Some((reader.file, reader.diagnostics))
}

#[derive(Default)]
struct Reader {
    file: File,
    diagnostics: Vec<Diagnostic>,
}

impl Reader {
    fn foreign(&mut self, name: &str, node: Node<'_, '_>) {
        let message = format!("the element `{name}` of TwinCAT is not supported");
        let error = Diagnostic::error("U1010", message, start_tag(node));
        self.diagnostics.push(error);
    }

    /// A file that a project names and that could not be read.
    fn missing(&mut self, object: Node<'_, '_>) {
        let name = attribute(object, "Include");
        let name = name.map(|name| name.replace('\\', "/")).unwrap_or_default();
        let message = format!("the file `{name}` of the project is missing, or cannot be read");
        let error = Diagnostic::error("U1090", message, start_tag(object));
        self.diagnostics.push(error.with_help("restore it, or remove it from the project"));
    }

    /// A Structured Text of a project.
    fn text(&mut self, object: Node<'_, '_>) {
        let passage = text(object);
        let (file, found) = parse_at(passage.as_str(), &|span| passage.place(span));
        self.diagnostics.extend(found);
        self.file.append(file);
    }

    /// The PLCopen documents of a project. What the others declare is known before any body is read.
    fn documents(&mut self, root: Node<'_, '_>) {
        let documents: Vec<Node<'_, '_>> = children(root, "project").collect();
        for (at, document) in documents.iter().enumerate() {
            let mut known = self.file.clone();
            let others = documents.iter().enumerate().filter(|(other, _)| *other > at);
            others.for_each(|(_, other)| known.append(read_document(*other, &File::default()).0));
            let (file, found) = read_document(*document, &known);
            self.file.append(file);
            self.diagnostics.extend(found);
        }
    }

    /// An interface, of which the name is kept.
    fn interface(&mut self, object: Node<'_, '_>) {
        let Some(name) = attribute(object, "Name") else {
            return;
        };
        let message = format!(
            "INTERFACE `{}` is not checked: the methods of the blocks that implement it count",
            name.as_str()
        );
        self.diagnostics.push(Diagnostic::warning("U1055", message, name.span()));
        self.file.interfaces.push(Name::new(name.as_str(), name.span()));
    }

    /// A task with the programs that it calls; its cycle time is in microseconds.
    fn task(&mut self, object: Node<'_, '_>) {
        let Some(name) = attribute(object, "Name") else {
            return;
        };
        let name = Name::new(name.as_str(), name.span());
        let number = |element: &str| {
            let written = child(object, element).map(word)?;
            written.parse::<i64>().ok()
        };
        let cycle = child(object, "CycleTime").map(word).filter(|written| !written.is_empty());
        let interval = cycle.and_then(|written| {
            let interval = written.parse::<i64>().ok().and_then(|cycle| cycle.checked_mul(1_000));
            if interval.is_none() {
                let message = format!(
                    "the cycle time `{written}` of the task `{name}` is no number of microseconds"
                );
                let error = Diagnostic::error("U1011", message, written.span());
                self.diagnostics.push(error.with_help("10000 is 10 ms"));
            }
            interval
        });
        self.file.tasks.push(Task {
            name: name.clone(),
            interval,
            priority: number("Priority"),
            single: None,
        });
        for called in children(object, "PouCall").filter_map(|call| child(call, "Name")) {
            let of = word(called);
            if of.ends_with(VISUALISATION) {
                let message = format!("`{}` draws pictures, and is not executed", of.as_str());
                self.diagnostics.push(Diagnostic::warning("U1055", message, of.span()));
                continue;
            }
            let of = Name::new(of.as_str(), of.span());
            let task = Some(name.clone());
            let retention = Retention::Unstated;
            let instance =
                ProgramInstance { name: of.clone(), retention, task, of, connections: Vec::new() };
            self.file.instances.push(instance);
        }
    }

    /// The text of the declaration of an object.
    fn declared(&mut self, object: Node<'_, '_>) -> File {
        let Some(node) = child(object, "Declaration") else {
            let message = format!("`{}` lacks its `Declaration`", object.tag_name().name());
            let error = Diagnostic::error("U1002", message, start_tag(object));
            self.diagnostics.push(error);
            return File::default();
        };
        let passage = text(node);
        let (file, found) = parse_declarations_at(passage.as_str(), &|span| passage.place(span));
        self.diagnostics.extend(found);
        file
    }

    fn declarations(&mut self, object: Node<'_, '_>) {
        let file = self.declared(object);
        self.file.units.extend(file.units);
        self.file.globals.extend(file.globals);
        self.file.types.extend(file.types);
        let known = ["Declaration"];
        for part in elements(object) {
            let name = part.tag_name().name();
            if !known.contains(&name) && !READ_PAST.contains(&name) {
                self.foreign(name, part);
            }
        }
    }

    fn unit(&mut self, object: Node<'_, '_>) {
        let file = self.declared(object);
        self.file.globals.extend(file.globals);
        self.file.types.extend(file.types);
        let mut units = file.units.into_iter();
        let Some(mut unit) = units.next() else {
            return;
        };
        for part in elements(object) {
            match part.tag_name().name() {
                "Declaration" => {}
                "Implementation" => unit.body = self.body(part),
                "Method" => unit.methods.extend(self.method(part)),
                "Action" => unit.methods.extend(self.action(part)),
                name if READ_PAST.contains(&name) => {}
                name => self.foreign(name, part),
            }
        }
        self.file.units.push(unit);
        self.file.units.extend(units);
    }

    fn body(&mut self, implementation: Node<'_, '_>) -> Body {
        let mut body = Body::default();
        for language in elements(implementation) {
            if language.tag_name().name() == "ST" {
                let passage = text(language);
                let (found, errors) = parse_body_at(passage.as_str(), &|span| passage.place(span));
                self.diagnostics.extend(errors);
                body = found;
            } else {
                let name = language.tag_name().name();
                let message = format!("a body in {name} of TwinCAT is not supported");
                let error = Diagnostic::error("U1010", message, start_tag(language));
                self.diagnostics.push(
                    error.with_help("export it as PLCopen XML, or write it in Structured Text"),
                );
            }
        }
        body
    }

    fn method(&mut self, node: Node<'_, '_>) -> Option<Unit> {
        let file = self.declared(node);
        let mut unit = file.units.into_iter().next()?;
        // The header of a method alone may be read as one of a unit without a name.
        if unit.kind != UnitKind::Method
            && let Some(method) = unit.methods.pop()
        {
            unit = method;
        }
        unit.kind = UnitKind::Method;
        for implementation in children(node, "Implementation") {
            unit.body = self.body(implementation);
        }
        Some(unit)
    }

    /// An action is a method without variables.
    fn action(&mut self, node: Node<'_, '_>) -> Option<Unit> {
        let name = attribute(node, "Name")?;
        let mut statements = Vec::new();
        for implementation in children(node, "Implementation") {
            for language in elements(implementation) {
                if language.tag_name().name() != "ST" {
                    self.body(implementation);
                    continue;
                }
                let passage = text(language);
                let (found, errors) =
                    parse_statements_at(passage.as_str(), &|span| passage.place(span));
                self.diagnostics.extend(errors);
                statements.extend(found);
            }
        }
        Some(Unit {
            kind: UnitKind::Method,
            name: Name::new(name.as_str(), name.span()),
            comments: Vec::new(),
            result: None,
            declarations: Vec::new(),
            body: Body::Statements(statements),
            methods: Vec::new(),
            extends: None,
            implements: Vec::new(),
            span: name.span(),
        })
    }
}

#[cfg(test)]
mod tests {
    use understudy_structured_text::{Options, lower};
    use understudy_text::has_errors;

    use super::read;

    const UNIT: &str = r#"<?xml version="1.0" encoding="utf-8"?>
<TcPlcObject Version="1.1.0.1"><POU Name="Main" Id="{0}" SpecialFunc="None">
<Declaration><![CDATA[PROGRAM Main
VAR in AT %IW0 : INT; out AT %QW0 : INT; END_VAR
]]></Declaration><Implementation><ST><![CDATA[IF in < 10 THEN Double(); END_IF]]></ST></Implementation>
<Action Name="Double" Id="{1}"><Implementation><ST><![CDATA[out := in * 2;]]></ST></Implementation></Action>
</POU></TcPlcObject>"#;

    #[test]
    fn a_unit_with_an_action_is_a_program() {
        let (file, mut found) = read(UNIT).expect("a file of TwinCAT");
        let lowered = lower(&file, &Options { text: UNIT, ..Options::default() });
        found.extend(lowered.diagnostics);
        assert!(!has_errors(&found), "{found:?}");
        assert!(lowered.program.is_some());
    }

    #[test]
    fn a_body_in_another_language_is_refused_by_its_name() {
        let text = UNIT.replace("<ST>", "<NWL>").replace("</ST>", "</NWL>");
        let (_, found) = read(&text).expect("a file of TwinCAT");
        assert!(found.iter().all(|found| found.message.contains("NWL")));
        assert_eq!(found.len(), 2, "{found:?}");
    }

    #[test]
    fn other_documents_are_none() {
        assert!(read("<project/>").is_none());
        assert!(read("PROGRAM p END_PROGRAM").is_none());
    }
}
