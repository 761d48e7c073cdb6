//! What is written as plain Structured Text before anything is lowered: charts, instruction lists, pointers into one
//! variable.

mod charts;
mod instructions;
mod pointers;
mod written;

use std::borrow::Cow;

use understudy_text::Diagnostic;

use crate::syntax::{Body, File, TypeKind, Unit};

pub(super) use pointers::{POINTED, STORED};

/// The file with statements in the place of charts and lists.
pub(super) fn expand<'a>(file: &'a File, diagnostics: &mut Vec<Diagnostic>) -> Cow<'a, File> {
    let is_other = |unit: &Unit| !matches!(unit.body, Body::Statements(_));
    let needs = |unit: &Unit| {
        let mut bodies = std::iter::once(unit).chain(&unit.methods);
        bodies.any(|body| is_other(body) || has_pointers(body))
    };
    if !file.units.iter().any(needs) {
        return Cow::Borrowed(file);
    }
    let mut file = file.clone();
    for unit in &mut file.units {
        body(unit, diagnostics);
        for method in &mut unit.methods {
            body(method, diagnostics);
            pointers::resolve(method);
        }
        pointers::resolve(unit);
    }
    Cow::Owned(file)
}

fn has_pointers(unit: &Unit) -> bool {
    let mut declarations = unit.declarations.iter();
    declarations.any(|found| matches!(found.of.kind, TypeKind::Pointer(_)))
}

fn body(unit: &mut Unit, diagnostics: &mut Vec<Diagnostic>) {
    let (declarations, statements) = match &unit.body {
        Body::Statements(_) => return,
        Body::Chart(chart) => charts::statements(chart, unit, diagnostics),
        Body::Instructions(list) => instructions::statements(list, unit, diagnostics),
    };
    unit.declarations.extend(declarations);
    unit.body = Body::Statements(statements);
}
