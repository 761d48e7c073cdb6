//! Typed programs as ladders: the programs of BOOLs, timers, counters and bounded integers, whatever they were written in.
//!
//! ```text
//! typed program ── unroll ──► cells and steps ── bounds ──► intervals ── timers ──► clocks ── lower ──► rungs
//! ```
//!
//! A scan of the ladder does what a scan of the program does. Standard blocks become blocks of the ladder where they can stand in a rung;
//! other blocks and functions are put in place of their calls; numbers become as many bits as their values need. What a ladder
//! cannot do is refused with its place, and the program runs as it is.

mod bounds;
mod facts;
mod lost;
mod lower;
mod number;
mod program;
mod timers;
mod unroll;

use std::collections::BTreeMap;

use understudy_ladder::{Name, Program as Ladder, Relation};
use understudy_structured_text::lower::Names;
use understudy_structured_text::syntax::{Body, File, Statement, StatementKind, Unit, UnitKind};
use understudy_text::{Diagnostic, Lines, has_errors};
use understudy_typed::Program;

use self::bounds::Interval;
use self::program::{Action, Cell, Number, Resolved, Role, Step, Truth};
use self::unroll::Surroundings;

/// A program as a ladder, with what is odd about it; nothing where it is none, with the reason.
pub(crate) fn ladder(
    text: &str,
    file: &File,
    program: &Program,
    names: &Names,
) -> (Option<Ladder>, Vec<Diagnostic>) {
    let lines = Lines::new(text);
    let mut units = file.units.iter();
    let unit = units.find(|unit| unit.kind == UnitKind::Program && unit.name.is(&program.name));
    let comments = comments(file, &lines);
    let declarations = unit.iter().flat_map(|unit| &unit.declarations);
    let places = declarations
        .map(|found| {
            let line = lines.index(found.name.span().start) + 1;
            (found.name.key(), u32::try_from(line).unwrap_or(u32::MAX))
        })
        .collect();
    let around = Surroundings { names, places: &places, comments: &comments };
    let place = |line: usize| match line.checked_sub(1) {
        Some(index) => {
            let range = lines.range(index);
            let content = &text[range.clone()];
            let start = range.start + content.len() - content.trim_start().len();
            start..start.max(range.start + content.trim_end().len())
        }
        None => unit.map_or(0..0, |unit| unit.name.span()),
    };
    let mut resolved = match unroll::unroll(program, &around) {
        Ok(resolved) => resolved,
        Err(refusal) => {
            let message = format!("`{}` is no ladder: {}", program.name, refusal.what);
            let error = Diagnostic::error(refusal.code, message, place(refusal.line as usize));
            let help = "a ladder has BOOLs, timers, counters and integers within bounds; `check`, `verify`, `scan`, stations and `convert --to st` take the program as it is";
            return (None, vec![error.with_help(help)]);
        }
    };
    let (mut intervals, mut diagnostics) = bounds::bounds(&resolved);
    if limit_outputs(program, &mut resolved, &intervals) {
        (intervals, diagnostics) = bounds::bounds(&resolved);
    }
    diagnostics.extend(timers::place(&mut resolved, &mut intervals));
    let mut made = None;
    if !has_errors(&diagnostics) {
        let name = unit.map_or_else(
            || Name::from(program.name.as_str()),
            |unit| Name::at(unit.name.as_str(), unit.name.span()),
        );
        let (mut ladder, found) = lower::lower(&name, &resolved, &intervals);
        diagnostics.extend(found);
        ladder.comments = unit.map(|unit| unit.comments.clone()).unwrap_or_default();
        made = Some(ladder);
    }
    for found in &mut diagnostics {
        found.span = place(found.span.start);
    }
    let footer = unit.map(footer).unwrap_or_default();
    let made = made.filter(|_| !has_errors(&diagnostics)).map(|mut ladder| {
        ladder.footer.extend(footer);
        ladder
    });
    if made.is_some() {
        diagnostics.extend(lost::lost(text, file, program));
    }
    (made, diagnostics)
}

/// Ends a scan as a program does: an output that may leave its subrange becomes the end of it. Whether there is one.
fn limit_outputs(program: &Program, resolved: &mut Resolved, intervals: &[Interval]) -> bool {
    let mut limits = Vec::new();
    for point in &program.outputs {
        let Some((low, high)) = point.range else {
            continue;
        };
        let is_it = |cell: &Cell| cell.role == Role::Output && cell.name == point.name;
        let Some(cell) = resolved.cells.iter().position(is_it) else {
            continue;
        };
        let interval = &intervals[cell];
        let (Ok(least), Ok(most)) = (i64::try_from(low), i64::try_from(high)) else {
            continue;
        };
        if interval.low >= low && interval.high <= high {
            continue;
        }
        let beyond = |relation, end| {
            let (own, end) = (Number::Cell(cell), Number::Constant(end));
            Box::new(Truth::Compare(relation, Box::new(own), Box::new(end)))
        };
        let within = Number::Choice(
            beyond(Relation::Greater, most),
            Box::new(Number::Constant(most)),
            Box::new(Number::Cell(cell)),
        );
        let limited = Number::Choice(
            beyond(Relation::Less, least),
            Box::new(Number::Constant(least)),
            Box::new(within),
        );
        let action = Action::SetNumber(cell, limited);
        limits.push(Step { action, span: 0..0, comments: Vec::new() });
    }
    let is_limited = !limits.is_empty();
    resolved.steps.extend(limits);
    is_limited
}

/// The comments below the last statement.
fn footer(unit: &Unit) -> Vec<String> {
    match &unit.body {
        Body::Statements(statements) => match statements.last() {
            Some(last) if matches!(last.kind, StatementKind::Nothing) => last.comments.clone(),
            _ => Vec::new(),
        },
        Body::Chart(_) | Body::Instructions(_) => Vec::new(),
    }
}

/// The comments above statements, by their lines.
fn comments(file: &File, lines: &Lines<'_>) -> BTreeMap<u32, Vec<String>> {
    let mut found = BTreeMap::new();
    for unit in &file.units {
        if let Body::Statements(statements) = &unit.body {
            of_statements(statements, lines, &mut found);
        }
    }
    found
}

fn of_statements(
    statements: &[Statement],
    lines: &Lines<'_>,
    found: &mut BTreeMap<u32, Vec<String>>,
) {
    for statement in statements {
        if !statement.comments.is_empty() {
            let line = u32::try_from(lines.index(statement.span.start) + 1).unwrap_or(u32::MAX);
            let known = found.entry(line).or_default();
            known.extend(statement.comments.iter().cloned());
        }
        match &statement.kind {
            StatementKind::If(branches, otherwise) => {
                for (_, body) in branches {
                    of_statements(body, lines, found);
                }
                of_statements(otherwise, lines, found);
            }
            StatementKind::Case(_, cases, otherwise) => {
                for (_, body) in cases {
                    of_statements(body, lines, found);
                }
                of_statements(otherwise, lines, found);
            }
            StatementKind::For(each) => of_statements(&each.body, lines, found),
            StatementKind::While(_, body) | StatementKind::Repeat(body, _) => {
                of_statements(body, lines, found);
            }
            _ => {}
        }
    }
}
