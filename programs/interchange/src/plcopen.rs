//! PLCopen TC6 XML 2.01 and 2.0: ladders of OpenPLC Editor, Beremiz, CODESYS and others.
//!
//! [`read`] works in stages, each of which reports everything that it finds: a well-formed and bounded file (`xml`), its content
//! (`document`), connections and execution order (`plan`), and bodies as statements (`typed`). [`write()`] makes a file that is valid under
//! the schema and reads back as the same circuit.

mod document;
mod fidelity;
pub(crate) mod literal;
mod plan;
mod power;
pub(crate) mod standard;
mod structure;
pub(crate) mod typed;
mod units;
mod write;
pub(crate) mod xml;

use std::collections::HashSet;
use std::ops::Range;
use std::time::Duration;

use understudy_ladder::Program;
use understudy_structured_text::syntax::UnitKind;
use understudy_text::{Diagnostic, Severity, has_errors};

pub use fidelity::{Count, Fidelity, Note};
pub(crate) use typed::read_document;
pub use typed::{drawn_units, read_typed};
pub use understudy_text::xml::{MAXIMUM_BYTES, MAXIMUM_DEPTH, MAXIMUM_NODES};
pub(crate) use write::confirm_order;
pub use write::{TypedDocument, write, write_typed};

use crate::text::whole;
use document::{ActionContent, Body, Condition, Instance, Kind, Pou, PouKind, Project};

/// The namespaces of 2.01 and 2.0.
const NAMESPACES: [&str; 2] =
    ["http://www.plcopen.org/xml/tc6_0201", "http://www.plcopen.org/xml/tc6_0200"];

/// What a file says.
#[derive(Debug, Default)]
pub struct Reading {
    /// The program, where nothing was wrong with it.
    pub program: Option<Program>,
    /// What its task waits from one scan to the next.
    pub period: Option<Duration>,
    /// Everything that is wrong or odd, with its place.
    pub diagnostics: Vec<Diagnostic>,
    /// What was kept, and what was not.
    pub fidelity: Fidelity,
    /// All that the tasks run, where this is more than the program that was read, which is the first: names with their places.
    pub(crate) runs: Vec<(String, Range<usize>)>,
}

/// Reads the program that the file's first task runs, or the one called `unit`.
pub fn read(text: &str, unit: Option<&str>) -> Reading {
    let mut reading = Reading::default();
    let document = match xml::parse(text) {
        Ok(document) => document,
        Err(error) => {
            reading.diagnostics.push(error);
            return reading;
        }
    };
    let root = document.root_element();
    let namespace = root.tag_name().namespace().unwrap_or_default();
    if root.tag_name().name() != "project" || !NAMESPACES.contains(&namespace) {
        let message = format!(
            "not a PLCopen XML file of version 2.01 or 2.0: its root is `{}` in the namespace {namespace:?}",
            root.tag_name().name()
        );
        let error = Diagnostic::error("U1001", message, xml::start_tag(root));
        let help = format!("it should be `project` in the namespace {:?}", NAMESPACES[0]);
        reading.diagnostics.push(error.with_help(help));
        return reading;
    }
    let (project, found) = document::read(root);
    reading.diagnostics = found;
    if let Some(pou) = chosen(&project, unit, &mut reading.diagnostics) {
        translate(text, &project, pou, &mut reading);
        if unit.is_none() && project.instances.len() > 1 {
            errors_of_others(text, &mut reading.diagnostics);
            reading.runs = runs(&project, pou);
        }
    }
    for found in &mut reading.diagnostics {
        within(text, &mut found.span);
        found.related.iter_mut().for_each(|related| within(text, &mut related.span));
    }
    reading.fidelity.finish(text);
    for (_, span) in &mut reading.runs {
        within(text, span);
    }
    reading.diagnostics.sort_by_key(|found| found.span.start);
    if has_errors(&reading.diagnostics) {
        reading.program = None;
    }
    reading
}

/// What of a file a program with numbers, which has all of its units or what `unit` uses, does not keep. It has no counts: a
/// program with numbers consists of statements.
pub fn fidelity_with_numbers(text: &str, unit: Option<&str>) -> Fidelity {
    let mut fidelity = Fidelity::default();
    let Ok(document) = xml::parse(text) else {
        return fidelity;
    };
    let (project, _) = document::read_bodies(document.root_element());
    let is_unit = |pou: &&Pou| unit.is_some_and(|unit| pou.name.eq_ignore_ascii_case(unit));
    if let Some(pou) = project.pous.iter().find(is_unit) {
        fidelity.unused(&project, pou);
    }
    fidelity.plan(typed::read_typed_of(text, None).notes);
    fidelity.ignored(project.ignored);
    fidelity.finish(text);
    fidelity
}

/// Names of the programs that the tasks of a file run, or, where it has no tasks, of all its programs; each once.
pub fn programs(text: &str) -> Vec<String> {
    let Ok(document) = xml::parse(text) else {
        return Vec::new();
    };
    let (project, _) = document::read(document.root_element());
    let run = project.instances.iter();
    let mut names: Vec<String> = run.map(|run| run.type_name.to_string()).collect();
    if names.is_empty() {
        let pous = project.pous.iter();
        let programs = pous.filter(|pou| pou.kind == PouKind::Program);
        names = programs.map(|pou| pou.name.to_string()).collect();
    }
    let mut seen = HashSet::new();
    names.retain(|name| seen.insert(name.to_lowercase()));
    names
}

/// Places that were reckoned through texts with entities in them may be off: they are brought to letters of the file.
fn within(text: &str, span: &mut Range<usize>) {
    let letter = |place: usize| {
        let mut place = place.min(text.len());
        while !text.is_char_boundary(place) {
            place -= 1;
        }
        place
    };
    *span = letter(span.start)..letter(span.end.max(span.start));
}

/// The unit that is asked for, that a task runs, or the only program.
fn chosen<'a>(
    project: &'a Project,
    unit: Option<&str>,
    diagnostics: &mut Vec<Diagnostic>,
) -> Option<&'a Pou> {
    let programs = || project.pous.iter().filter(|pou| pou.kind == PouKind::Program);
    let names: Vec<String> = programs().map(|pou| format!("`{}`", pou.name)).collect();
    let find = |name: &str| project.pous.iter().find(|pou| pou.name.eq_ignore_ascii_case(name));
    if let Some(unit) = unit {
        let found = find(unit).filter(|pou| pou.kind != PouKind::Function);
        if found.is_none() {
            let message = format!("the file has no program `{unit}`");
            let error = Diagnostic::error("U1013", message, 0..0);
            diagnostics.push(error.with_help(format!("it has {}", names.join(", "))));
        }
        return found;
    }
    for instance in &project.instances {
        if let Some(pou) = find(&instance.type_name) {
            return Some(pou);
        }
        let message = format!("the file has no unit `{}`", instance.type_name);
        let span = instance.type_name.span();
        diagnostics.push(Diagnostic::error("U1013", message, span));
    }
    let mut programs = programs();
    match (programs.next(), programs.next()) {
        (Some(only), None) => Some(only),
        (first, _) => {
            let message = if first.is_none() {
                "the file has no program".to_owned()
            } else {
                "the file has several programs, and no task that runs one of them".to_owned()
            };
            let error = Diagnostic::error("U1013", message, 0..0);
            diagnostics.push(match first {
                Some(_) => error.with_help(format!("choose one of {}", names.join(", "))),
                None => error,
            });
            None
        }
    }
}

/// What the tasks run, the program that is read in front.
fn runs(project: &Project, read: &Pou) -> Vec<(String, Range<usize>)> {
    let mut runs: Vec<&Instance> = project.instances.iter().collect();
    let first = runs.iter().position(|run| run.type_name.eq_ignore_ascii_case(&read.name));
    runs[..=first.unwrap_or(0)].rotate_right(1);
    runs.iter().map(|run| (run.type_name.to_string(), run.type_name.span())).collect()
}

/// The errors of everything that the tasks run: that one program is read hides none of another.
fn errors_of_others(text: &str, diagnostics: &mut Vec<Diagnostic>) {
    let is_error = |found: &Diagnostic| found.severity == Severity::Error;
    let mut found = whole(text, typed::read_typed(text), None, None).diagnostics;
    found.retain(|found| {
        let mut known = diagnostics.iter().filter(|known| is_error(known));
        let meets = |known: &Diagnostic| {
            known.span.start <= found.span.end && found.span.start <= known.span.end
        };
        is_error(found) && !known.any(meets)
    });
    diagnostics.extend(found);
}

/// Says which actions and transitions of a unit its sequence does not name.
fn unnamed_parts(pou: &Pou, diagnostics: &mut Vec<Diagnostic>) {
    let mut named = HashSet::new();
    if let Some(Body::Graph(graph)) = &pou.body {
        for object in &graph.objects {
            match &object.kind {
                Kind::Actions(actions) => {
                    named.extend(actions.iter().filter_map(|action| match &action.content {
                        ActionContent::Reference(name) => Some(name.to_uppercase()),
                        _ => None,
                    }))
                }
                Kind::Transition(transition) => {
                    if let Condition::Reference(name) = &transition.condition {
                        named.insert(name.to_uppercase());
                    }
                }
                _ => {}
            }
        }
    }
    let parts = [("action", &pou.actions), ("transition", &pou.transitions)];
    for (what, parts) in parts {
        for part in parts.iter().filter(|part| !named.contains(&part.name.to_uppercase())) {
            let message = format!("the {what} `{}` is not used by `{}`", part.name, pou.name);
            diagnostics.push(Diagnostic::warning("U1023", message, part.name.span()));
        }
    }
}

/// Brings the unit and what it uses to rungs.
fn translate(text: &str, project: &Project, pou: &Pou, reading: &mut Reading) {
    let runs = project
        .instances
        .iter()
        .find(|instance| instance.type_name.eq_ignore_ascii_case(&pou.name));
    reading.period = runs.and_then(|instance| instance.interval);
    reading.fidelity.ignored(project.ignored.clone());
    for used in units::used(project, pou) {
        unnamed_parts(used, &mut reading.diagnostics);
    }
    let has_event = runs.is_some_and(|instance| instance.has_event);
    let used = units::used(project, pou);
    let used = used.iter().map(|unit| unit.name.to_uppercase()).collect();
    let typed::ReadFile { mut file, diagnostics: found, notes } =
        typed::read_typed_of(text, Some(&used));
    reading.fidelity.plan(notes);
    // The period is that of the task that was found.
    file.instances.retain(|instance| has_event && instance.of.is(&pou.name));
    file.tasks.retain(|_| has_event);
    for unit in &mut file.units {
        // A block that is asked for is read as if it were a program.
        if unit.name.is(&pou.name) && unit.kind == UnitKind::FunctionBlock {
            unit.kind = UnitKind::Program;
        }
    }
    let mut found = whole(text, (file, found), Some(&pou.name), reading.period);
    found.remark_on_rungs(text);
    let found = found.reading(text);
    reading.diagnostics.extend(found.diagnostics);
    let mut seen = Vec::new();
    reading.diagnostics.retain(|found| {
        let is_new = !seen.contains(found);
        seen.push(found.clone());
        is_new
    });
    if let Some(mut program) = found.program {
        program.description.clone_from(&pou.documentation);
        reading.fidelity.count(project, pou, &program);
        reading.program = Some(program);
    }
}
