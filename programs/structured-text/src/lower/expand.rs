//! Bodies that are not Structured Text, written as such before anything is lowered: charts and instruction lists.

mod charts;
mod instructions;
mod written;

use std::borrow::Cow;

use understudy_text::Diagnostic;

use crate::syntax::{Body, File, Unit};

/// The file with statements in the place of charts and lists.
pub(super) fn expand<'a>(file: &'a File, diagnostics: &mut Vec<Diagnostic>) -> Cow<'a, File> {
    let is_other = |unit: &Unit| !matches!(unit.body, Body::Statements(_));
    let needs = |unit: &Unit| is_other(unit) || unit.methods.iter().any(is_other);
    if !file.units.iter().any(needs) {
        return Cow::Borrowed(file);
    }
    let mut file = file.clone();
    for unit in &mut file.units {
        body(unit, diagnostics);
        for method in &mut unit.methods {
            body(method, diagnostics);
        }
    }
    Cow::Owned(file)
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
