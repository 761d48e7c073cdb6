//! Units of a file by way of Structured Text: each becomes a text, and the reader of texts makes rungs of it, with the units that
//! it uses in place of their calls.

use std::collections::HashMap;

use understudy_ladder::{Name, Program};
use understudy_text::{Diagnostic, Severity, has_errors};

use super::document::{
    Body, Graph, Ignored, Language, Pou, PouKind, Project, Section, Variable, VariableType,
};
use super::plan::plan;
use super::sequence;
use super::standard::StandardBlock;
use super::statements::{Statements, Text};
use crate::structured_text::{self, Callable, Class, lower_body};

/// The most units that one program uses.
const MAXIMUM_UNITS: usize = 200;

/// A program, and what was found on the way to it.
#[derive(Default)]
pub(crate) struct Lowered {
    pub(crate) program: Option<Program>,
    pub(crate) diagnostics: Vec<Diagnostic>,
    pub(crate) notes: Vec<(String, std::ops::Range<usize>)>,
    pub(crate) ignored: Vec<Ignored>,
}

/// A unit as a text.
struct Unit<'a> {
    pou: &'a Pou,
    callable: Callable,
    text: Text,
}

/// Lowers a unit with everything that it uses.
pub(crate) fn lower(project: &Project, pou: &Pou) -> Lowered {
    let mut lowered = Lowered::default();
    let used = used(project, pou);
    let mut units: Vec<Unit<'_>> = Vec::new();
    if used.len() > MAXIMUM_UNITS {
        let message = format!("`{}` uses more than {MAXIMUM_UNITS} units", pou.name);
        let error = Diagnostic::error("U1001", message, pou.name.span());
        lowered.diagnostics.push(error);
        return lowered;
    }
    for pou in &used {
        units.extend(unit(project, pou, &mut lowered));
    }
    if has_errors(&lowered.diagnostics) {
        return lowered;
    }
    let main = units.remove(0);
    let others: Vec<Callable> = units.iter().map(|unit| unit.callable.clone()).collect();
    // What is wrong with a unit is shown in the unit.
    for unit in &units {
        let rest: Vec<Callable> = others
            .iter()
            .filter(|other| other.name != unit.callable.name)
            .cloned()
            .collect();
        let (_, found) = lower_body(&unit.callable, "", &rest);
        // Beside errors, what is not kept: the program is not as the file has it.
        let told = found
            .into_iter()
            .filter(|found| found.severity == Severity::Error || found.code == "U1055");
        lowered.diagnostics.extend(placed(unit, told));
    }
    if has_errors(&lowered.diagnostics) {
        return lowered;
    }
    let (program, found) = lower_body(&main.callable, "", &others);
    lowered.diagnostics.extend(placed(&main, found.into_iter()));
    if let Some(mut program) = program {
        program.description.clone_from(&pou.documentation);
        let found = understudy_ladder::check(&program).into_iter();
        let errors = found.filter(|found| found.severity == Severity::Error);
        lowered.diagnostics.extend(placed(&main, errors));
        lowered.program = Some(program);
    }
    lowered
}

/// Findings with their places in the file.
fn placed<'a>(
    unit: &'a Unit<'_>,
    found: impl Iterator<Item = Diagnostic> + 'a,
) -> impl Iterator<Item = Diagnostic> + 'a {
    found.map(|mut found| {
        let nowhere = found.span == (0..0);
        found.span = if nowhere {
            unit.pou.name.span()
        } else {
            unit.text.place(&found.span)
        };
        for related in &mut found.related {
            related.span = unit.text.place(&related.span);
        }
        found
    })
}

/// The unit and all units that it uses, itself first.
pub(crate) fn used<'a>(project: &'a Project, pou: &'a Pou) -> Vec<&'a Pou> {
    let mut used = vec![pou];
    let mut next = 0;
    while let Some(pou) = used.get(next).copied() {
        next += 1;
        for other in &project.pous {
            let is_new = !used.iter().any(|known| known.name == other.name);
            if is_new && other.kind != PouKind::Program && mentions(pou, &other.name) {
                used.push(other);
            }
        }
    }
    used
}

fn mentions(pou: &Pou, name: &str) -> bool {
    let typed = pou.variables.iter().any(|variable| {
        matches!(&variable.kind, VariableType::Derived(kind) if kind.eq_ignore_ascii_case(name))
    });
    let parts = pou
        .actions
        .iter()
        .chain(&pou.transitions)
        .filter_map(|part| part.body.as_ref());
    typed || pou.body.iter().chain(parts).any(|body| match body {
        Body::Graph(graph) => graph.objects.iter().any(|object| {
            matches!(&object.kind, super::document::Kind::Block(block) if block.type_name.eq_ignore_ascii_case(name))
        }),
        Body::StructuredText(text) | Body::InstructionList(text) => {
            words(text.as_str()).any(|word| word.eq_ignore_ascii_case(name))
        }
    })
}

fn words(text: &str) -> impl Iterator<Item = &str> {
    text.split(|letter: char| !letter.is_alphanumeric() && letter != '_')
}

/// A unit as a text; what is wrong with its graphs is in `lowered`.
fn unit<'a>(project: &'a Project, pou: &'a Pou, lowered: &mut Lowered) -> Option<Unit<'a>> {
    let type_of = |name: &str| type_of(project, pou, name);
    let taken = pou
        .variables
        .iter()
        .map(|variable| variable.name.to_string());
    let mut statements = Statements::new(taken, &type_of);
    match &pou.body {
        Some(Body::Graph(graph)) if graph.language == Language::Sequence => {
            sequence::write(project, pou, graph, &mut statements, lowered);
        }
        Some(Body::Graph(graph)) => network(project, graph, &mut statements, lowered),
        Some(Body::StructuredText(text)) => statements.text = Text::verbatim(text),
        Some(Body::InstructionList(text)) => {
            statements.instruction_list(text, &mut lowered.diagnostics);
        }
        None => {
            let message = format!("`{}` has no body", pou.name);
            lowered
                .diagnostics
                .push(Diagnostic::error("U1010", message, pou.name.span()));
            return None;
        }
    }
    let mut variables = Vec::new();
    for variable in &pou.variables {
        variables.extend(declaration(
            project,
            variable,
            &statements.text.body,
            lowered,
        ));
    }
    let mut declared: HashMap<String, ()> = pou
        .variables
        .iter()
        .map(|variable| (variable.name.to_uppercase(), ()))
        .collect();
    for (name, kind) in &statements.declared {
        declared.insert(name.to_uppercase(), ());
        variables.push(local(name, kind));
    }
    // An instance that only its block names.
    for (name, kind) in instances(pou) {
        if declared.insert(name.to_uppercase(), ()).is_none() {
            lowered.diagnostics.push(undeclared(project, &name, &kind));
            variables.push(local(&name, &kind));
        }
    }
    let result = pou.result.as_ref().map(VariableType::text);
    let callable = Callable {
        name: pou.name.to_string(),
        result: if pou.kind == PouKind::Function {
            result.or(Some("BOOL".to_owned()))
        } else {
            None
        },
        variables,
        body: statements.text.body.clone(),
    };
    Some(Unit {
        pou,
        callable,
        text: statements.text,
    })
}

/// The statements of a network.
pub(crate) fn network(
    project: &Project,
    graph: &Graph,
    statements: &mut Statements<'_>,
    lowered: &mut Lowered,
) {
    let is_block = |name: &str| is_block(project, name);
    let plan = plan(graph, &is_block, &mut lowered.diagnostics);
    statements.plan(&plan);
    lowered.notes.extend(plan.notes);
}

/// Whether a block of that type keeps something from scan to scan.
pub(crate) fn is_block(project: &Project, name: &str) -> bool {
    StandardBlock::of(name).is_some()
        || project
            .pous
            .iter()
            .any(|pou| pou.kind == PouKind::FunctionBlock && pou.name.eq_ignore_ascii_case(name))
}

/// The finding on an instance of a block that no variable declares.
pub(crate) fn undeclared(project: &Project, instance: &Name, kind: &str) -> Diagnostic {
    let message = format!("the block `{instance}` is not declared");
    let (found, help) = if project.lacks_instances {
        let message = format!("{message}; it is read as a separate {kind}");
        (Diagnostic::warning("U1012", message, instance.span()), "")
    } else {
        (
            Diagnostic::error("U1012", message, instance.span()),
            ", or leave the name out",
        )
    };
    found.with_help(format!(
        "declare the variable `{instance}` of type {kind}{help}"
    ))
}

fn instances(pou: &Pou) -> Vec<(Name, String)> {
    let parts = pou
        .actions
        .iter()
        .chain(&pou.transitions)
        .filter_map(|part| part.body.as_ref());
    let mut found = Vec::new();
    for body in pou.body.iter().chain(parts) {
        let Body::Graph(graph) = body else { continue };
        for object in &graph.objects {
            if let super::document::Kind::Block(block) = &object.kind
                && let Some(instance) = &block.instance
            {
                found.push((instance.clone(), block.type_name.to_string()));
            }
        }
    }
    found
}

fn local(name: &str, kind: &str) -> structured_text::Variable {
    structured_text::Variable {
        name: name.to_owned(),
        class: Class::Local,
        type_name: kind.to_owned(),
        initial: None,
        address: None,
        constant: false,
        description: None,
    }
}

fn declaration(
    project: &Project,
    variable: &Variable,
    body: &str,
    lowered: &mut Lowered,
) -> Option<structured_text::Variable> {
    let global = project.globals.iter().find(|global| {
        variable.section == Section::External && global.name.eq_ignore_ascii_case(&variable.name)
    });
    let declared = global.unwrap_or(variable);
    let usual = match &declared.kind {
        VariableType::Elementary(kind) => {
            matches!(kind.as_str(), "BOOL" | "TIME") || kind.ends_with("INT")
        }
        VariableType::Range(..) => true,
        VariableType::Derived(kind) => is_block(project, kind),
        VariableType::Foreign(_) => false,
    };
    let mut ignore = |what: String| {
        lowered.ignored.push(Ignored {
            what,
            span: variable.name.span(),
        });
    };
    if !usual && !words(body).any(|word| word.eq_ignore_ascii_case(&variable.name)) {
        ignore(format!(
            "`{}`, a {} that nothing uses,",
            variable.name,
            declared.kind.text()
        ));
        return None;
    }
    if declared.retain {
        ignore(format!(
            "the retention of `{}` over a loss of power",
            variable.name
        ));
    }
    let class = match variable.section {
        Section::Input => Class::Input,
        Section::Output => Class::Output,
        Section::InOut => Class::InOut,
        _ => Class::Local,
    };
    let initial = declared
        .initial
        .as_ref()
        .map(|initial| initial.trim().to_owned());
    Some(structured_text::Variable {
        name: variable.name.to_string(),
        class,
        type_name: declared.kind.text(),
        initial: initial.map(|initial| match (&declared.kind, initial.as_str()) {
            (kind, "0") if kind.is_bool() => "FALSE".to_owned(),
            (kind, "1") if kind.is_bool() => "TRUE".to_owned(),
            _ => initial,
        }),
        address: declared.address.as_ref().map(ToString::to_string),
        constant: declared.constant,
        description: declared.documentation.clone(),
    })
}

/// The type of a variable, of an output of an instance, or of what a function answers.
fn type_of(project: &Project, pou: &Pou, name: &str) -> Option<String> {
    let find = |pou: &Pou, name: &str| {
        let variable = pou
            .variables
            .iter()
            .find(|variable| variable.name.eq_ignore_ascii_case(name));
        variable.map(|variable| variable.kind.clone())
    };
    if let Some(kind) = find(pou, name) {
        return Some(kind.text());
    }
    let unit = |kind: &str| {
        project
            .pous
            .iter()
            .find(|pou| pou.name.eq_ignore_ascii_case(kind))
    };
    if let Some(function) = unit(name) {
        return function.result.as_ref().map(VariableType::text);
    }
    let (instance, pin) = name.split_once('.')?;
    let VariableType::Derived(kind) = find(pou, instance)? else {
        return None;
    };
    if StandardBlock::of(&kind).is_some() {
        let kind = match pin.to_ascii_uppercase().as_str() {
            "ET" => "TIME",
            "CV" => "INT",
            _ => "BOOL",
        };
        return Some(kind.to_owned());
    }
    find(unit(&kind)?, pin).map(|kind| kind.text())
}
