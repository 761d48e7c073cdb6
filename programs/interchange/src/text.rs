//! From syntax to a typed program, and to rungs where a ladder is asked for.

use std::ops::Range;
use std::time::Duration;

use understudy_ladder::{PERIODS, Program as Ladder};
use understudy_structured_text::syntax::{Body, File, Statement, StatementKind, Unit, UnitKind};
use understudy_structured_text::{Lowered, Options, lower, parse};
use understudy_text::{Diagnostic, has_errors};
use understudy_typed::{Cost, Program as Typed};

use crate::diagrams::Style;
use crate::format::Reading;
use crate::plcopen::drawn_units;
use crate::rungs::rungs;
use crate::source::no_program;

/// The shortest period that tasks of different intervals may need.
const SHORTEST: Duration = Duration::from_millis(1);

/// Operations of a scan: some seconds on any machine, and no period is longer.
const MAXIMUM_OPERATIONS: u64 = 1_000_000_000;

/// A program with its syntax.
#[derive(Default)]
pub(crate) struct Whole {
    /// The program; nothing where there are errors.
    pub(crate) typed: Option<Typed>,
    file: File,
    /// The units of a library.
    pub(crate) checked: Vec<String>,
    /// The period by which the intervals of its tasks are counted.
    pub(crate) period: Option<Duration>,
    /// What was found of the program.
    pub(crate) diagnostics: Vec<Diagnostic>,
}

/// Lowers the program of a file.
pub(crate) fn whole(
    text: &str,
    (file, mut diagnostics): (File, Vec<Diagnostic>),
    program: Option<&str>,
    period: Option<Duration>,
) -> Whole {
    let nanoseconds = |period: Duration| i64::try_from(period.as_nanos()).unwrap_or(i64::MAX);
    if file.units.is_empty() && has_errors(&diagnostics) {
        // Nothing was read, so there is nothing to lower.
        return Whole { diagnostics, ..Whole::default() };
    }
    let period_given = period.map(nanoseconds);
    let options = Options { text, program, period: period_given, ..Options::default() };
    let Lowered { program: typed, checked, diagnostics: found } = lower(&file, &options);
    diagnostics.extend(found);
    let period = understudy_structured_text::lower::period(&file, program);
    diagnostics.extend(periods(&file, period));
    diagnostics.extend(file.units.iter().filter_map(without_statements));
    diagnostics.extend(typed.as_ref().and_then(too_long));
    diagnostics.sort_by_key(|found| (found.span.start, found.span.end));
    let is_right = !has_errors(&diagnostics);
    let typed = typed.filter(|_| is_right);
    Whole {
        typed,
        file,
        checked: if is_right { checked } else { Vec::new() },
        period: period.map(|interval| Duration::from_nanos(interval.unsigned_abs())),
        diagnostics,
    }
}

/// The warning of a program that does nothing.
fn without_statements(unit: &Unit) -> Option<Diagnostic> {
    let is_nothing = |statement: &Statement| matches!(statement.kind, StatementKind::Nothing);
    let is_empty = match &unit.body {
        Body::Statements(statements) => statements.iter().all(is_nothing),
        Body::Instructions(lines) => lines.is_empty(),
        Body::Chart(_) => false,
    };
    (is_empty && unit.kind == UnitKind::Program).then(|| {
        let message = format!("`{}` has no statements", unit.name);
        Diagnostic::warning("U1023", message, unit.name.span())
    })
}

/// The error on a program whose scan would not end in any period: calls that double from level to level are short in a text.
fn too_long(program: &Typed) -> Option<Diagnostic> {
    let Cost { straight, dearest_turn, .. } = Cost::new(program);
    let operations = straight.max(dearest_turn);
    (operations > MAXIMUM_OPERATIONS).then(|| {
        let message = format!(
            "a scan of `{}` takes up to {operations} operations; at most {MAXIMUM_OPERATIONS}",
            program.name
        );
        Diagnostic::error("U1048", message, 0..0).with_help("call functions and blocks fewer times")
    })
}

/// The findings on intervals of tasks that no station has.
fn periods(file: &File, common: Option<i64>) -> Vec<Diagnostic> {
    let wrong = file.tasks.iter().filter(|task| {
        let interval = task.interval.and_then(|interval| u64::try_from(interval).ok());
        task.interval.is_some()
            && interval.is_none_or(|interval| !PERIODS.contains(&Duration::from_nanos(interval)))
    });
    let found = wrong.map(|task| {
        let (least, most) = (PERIODS.start(), PERIODS.end());
        let message = format!("the interval of a task is a time from {least:?} to {most:?}");
        let error = Diagnostic::error("U1084", message, task.name.span());
        error.with_help("write it as a literal such as T#20ms")
    });
    let mut found: Vec<Diagnostic> = found.collect();
    let common = common.and_then(|common| u64::try_from(common).ok()).map(Duration::from_nanos);
    if let Some(common) = common.filter(|common| found.is_empty() && *common < SHORTEST)
        && let [_, other, ..] = file.tasks.as_slice()
    {
        let message = format!(
            "the intervals of the tasks are multiples of {common:?} only; no period is shorter than {SHORTEST:?}"
        );
        let error = Diagnostic::error("U1084", message, other.name.span());
        found.push(error.with_help("choose intervals that are multiples of 1 ms"));
    }
    found
}

/// The error on a file that runs more than the one program of a ladder.
pub(crate) fn several<'a>(
    count: usize,
    names: impl Iterator<Item = &'a str>,
    span: Range<usize>,
) -> Diagnostic {
    let mut listed: Vec<String> = Vec::new();
    for name in names.map(|name| format!("`{name}`")) {
        if !listed.contains(&name) {
            listed.push(name);
        }
    }
    let message = format!("the file runs {count} programs, and a ladder is one");
    let help = format!(
        "choose one of {}; `understudy convert --unit NAME` writes one as a file of its own",
        listed.join(", ")
    );
    Diagnostic::error("U1013", message, span).with_help(help)
}

impl Whole {
    /// The rungs of a program that is drawn as a ladder. What a person should know of a drawing with rungs is added.
    pub(crate) fn remark_on_rungs(&mut self, text: &str) -> Option<Ladder> {
        let typed = self.typed.as_ref().filter(|typed| typed.tasks.len() == 1)?;
        let style = drawn_units(text).remove(&typed.name.to_uppercase())?;
        let found = rungs(text, &self.file, typed);
        let is_every_scan = typed.tasks.iter().all(|task| task.every == 1);
        self.diagnostics.extend(found.remarks);
        found.program.filter(|_| style == Style::Ladder && is_every_scan)
    }

    /// The ladder, or why it is none.
    pub(crate) fn reading(self, text: &str) -> Reading {
        let (ladder, reasons) = match &self.typed {
            Some(typed) if typed.tasks.len() == 1 => {
                let found = rungs(text, &self.file, typed);
                (found.program, found.diagnostics)
            }
            Some(typed) => {
                let programs = self.file.units.iter().filter(|unit| unit.kind == UnitKind::Program);
                let names = programs.map(|unit| unit.name.as_str());
                (None, vec![several(typed.tasks.len(), names, 0..0)])
            }
            None => (None, Vec::new()),
        };
        let mut diagnostics = self.diagnostics;
        if self.typed.is_none() && !has_errors(&diagnostics) {
            diagnostics.push(no_program());
        }
        diagnostics.extend(reasons);
        diagnostics.sort_by_key(|found| (found.span.start, found.span.end));
        Reading { program: ladder, period: self.period, diagnostics, ..Reading::default() }
    }
}

/// Reads the program of a Structured Text as a ladder; `program` chooses one where there are several.
pub(crate) fn read(text: &str, program: Option<&str>) -> Reading {
    whole(text, parse(text), program, None).reading(text)
}
