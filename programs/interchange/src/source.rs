//! A program from any form of file: a typed program, whose points are those of its declarations, and the rungs of one that has them.

use std::sync::Arc;
use std::time::Duration;

use understudy_ladder::{LowerError, Program as Ladder};
use understudy_structured_text::lower::another_interval;
use understudy_text::{Diagnostic, has_errors};
use understudy_typed::Program as Typed;

use crate::format::{Format, Reading, read, unknown_form};
use crate::plcopen;
use crate::text::{Whole, whole};
use crate::twincat;
use crate::typed_text::parsed;
use crate::written::USUAL_PERIOD;

/// What a file holds.
#[derive(Debug, Clone)]
pub enum Source {
    /// A program, for one period.
    Program(Arc<Typed>),
    /// Function blocks and functions without a program, each checked: their names.
    Library(Vec<String>),
}

/// What is read from a file, and how.
#[derive(Debug, Clone, Copy, Default)]
pub struct Wanted<'a> {
    /// The program, in a file with several.
    pub program: Option<&'a str>,
    /// From one scan to the next, in place of what the file says.
    pub period: Option<Duration>,
}

/// A file that was read.
#[derive(Debug, Clone, Default)]
pub struct SourceFile {
    /// What it holds; nothing where there are errors.
    pub source: Option<Source>,
    /// The rungs of the program, where it is written or drawn as a ladder and has no more than rungs hold.
    pub rungs: Option<Rungs>,
    /// The period of the intervals that the file states.
    pub period: Option<Duration>,
    /// Everything that is wrong or odd, with its place.
    pub diagnostics: Vec<Diagnostic>,
}

/// The rungs of a program.
#[derive(Debug, Clone)]
pub struct Rungs {
    /// They.
    pub ladder: Ladder,
    /// The program is written in them; it is drawn as them, and written in statements, otherwise.
    pub are_written: bool,
}

impl Rungs {
    /// The rungs, where the program is written in them.
    pub fn written(self) -> Option<Ladder> {
        self.are_written.then_some(self.ladder)
    }
}

impl SourceFile {
    /// The rungs that the program is written in.
    pub fn ladder(&self) -> Option<&Ladder> {
        self.rungs.as_ref().filter(|rungs| rungs.are_written).map(|rungs| &rungs.ladder)
    }
}

/// Reads the program of the file `name`, and everything that is wrong with it.
pub fn read_source(name: &str, text: &str, wanted: Wanted<'_>) -> SourceFile {
    let Some(format) = Format::of(name, text) else {
        return SourceFile { diagnostics: vec![unknown_form(text)], ..SourceFile::default() };
    };
    let statements = match format {
        Format::PlcOpen => Some(twincat::read(text).unwrap_or_else(|| plcopen::read_typed(text))),
        _ => parsed(name, text),
    };
    if let Some(parsed) = statements {
        let mut read = whole(text, parsed, wanted.program, wanted.period);
        let drawn = if format == Format::PlcOpen { read.remark_on_rungs(text) } else { None };
        let rungs = drawn.map(|ladder| Rungs { ladder, are_written: false });
        return SourceFile { rungs, ..source(read) };
    }
    let Reading { program, period, mut diagnostics, .. } = read(format, name, text, wanted.program);
    let other = program.as_ref().and_then(|it| another_period(it, period, wanted.period));
    diagnostics.extend(other);
    let typed = program.as_ref().filter(|_| !has_errors(&diagnostics)).and_then(|ladder| {
        let typed = ladder.typed(wanted.period.or(period).unwrap_or(USUAL_PERIOD));
        typed.map_err(|error| diagnostics.push(not_run(&error))).ok()
    });
    let source = typed.map(|typed| Source::Program(Arc::new(typed)));
    let rungs = program.map(|ladder| Rungs { ladder, are_written: true });
    SourceFile { source, rungs, period, diagnostics }
}

/// The error on rungs that cannot be executed.
fn not_run(error: &LowerError) -> Diagnostic {
    Diagnostic::error(error.code_or("U0436"), error.to_string(), 0..0)
}

/// The warning on a ladder whose file states another interval than the period at which it runs: it runs in every scan.
pub(crate) fn another_period(
    ladder: &Ladder,
    interval: Option<Duration>,
    period: Option<Duration>,
) -> Option<Diagnostic> {
    let nanoseconds = |time: Duration| i64::try_from(time.as_nanos()).unwrap_or(i64::MAX);
    let (interval, period) = (nanoseconds(interval?), nanoseconds(period?));
    let program = (ladder.name.as_str(), ladder.name.span());
    (interval != period)
        .then(|| another_interval(program, (period, period.into()), (interval, interval)))
}

fn source(whole: Whole) -> SourceFile {
    let diagnostics = whole.diagnostics;
    let library = (!whole.checked.is_empty()).then_some(Source::Library(whole.checked));
    let source = whole.typed.map(|typed| Source::Program(Arc::new(typed))).or(library);
    SourceFile { source, rungs: None, period: whole.period, diagnostics }
}

/// The error of a file that a program is wanted of, and that has none.
pub fn no_program() -> Diagnostic {
    Diagnostic::error("U1051", "the text has no program", 0..0)
        .with_help("a text needs a PROGRAM … END_PROGRAM")
}
