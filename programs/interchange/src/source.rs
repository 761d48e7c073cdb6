//! A program from any form of file: a ladder where it is drawn as one, else a typed program, whose points are those of its declarations.

use std::sync::Arc;
use std::time::Duration;

use understudy_ladder::Program as Ladder;
use understudy_structured_text::lower::another_interval;
use understudy_text::{Diagnostic, Severity};
use understudy_typed::{Elementary, Program as Typed};

use crate::apart::NOT_EXECUTED;
use crate::format::{Format, Reading, read, unknown_form};
use crate::plcopen;
use crate::text::{Whole, whole};
use crate::twincat;
use crate::typed_text::parsed;

/// What a file holds.
#[derive(Debug, Clone)]
pub enum Source {
    /// Rungs, or a network of bits and standard blocks.
    Ladder(Ladder),
    /// Statements, lists, charts and networks, for one period.
    Typed(Arc<Typed>),
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
    /// The period of the intervals that the file states.
    pub period: Option<Duration>,
    /// Everything that is wrong or odd, with its place.
    pub diagnostics: Vec<Diagnostic>,
}

/// Reads the program of the file `name`, and everything that is wrong with it.
pub fn read_source(name: &str, text: &str, wanted: Wanted<'_>) -> SourceFile {
    let Some(format) = Format::of(name, text) else {
        return SourceFile { diagnostics: vec![unknown_form(text)], ..SourceFile::default() };
    };
    let statements = match format {
        Format::PlcOpen => twincat::read(text),
        _ => parsed(name, text),
    };
    if let Some(parsed) = statements {
        return source(whole(text, parsed, wanted.program, wanted.period));
    }
    let Reading { program, period, mut diagnostics, is_drawn, .. } =
        read(format, name, text, wanted.program);
    let ladder = program.as_ref().filter(|_| is_drawn);
    diagnostics.extend(ladder.and_then(|it| another_period(it, period, wanted.period)));
    let ladder = program.filter(|_| is_drawn).map(Source::Ladder);
    let ladder = SourceFile { source: ladder, period, diagnostics };
    if format != Format::PlcOpen {
        return ladder;
    }
    let is_ladder = ladder.source.is_some();
    // What is not drawn as a ladder is a program of statements, or a library.
    let parsed = plcopen::read_typed(text);
    let read = whole(text, parsed, wanted.program, wanted.period);
    let missing = read.diagnostics.iter().filter(|found| found.code == NOT_EXECUTED);
    let missing: Vec<Diagnostic> = missing.cloned().collect();
    // A ladder has neither an interval nor a number that it declares and leaves alone.
    let is_all = |typed: &Typed| {
        let mut points = typed.inputs.iter().chain(&typed.outputs);
        let is_every_scan = matches!(typed.tasks.as_slice(), [task] if task.every == 1);
        is_every_scan && points.all(|point| point.of == Elementary::Bool)
    };
    if is_ladder && read.typed.as_ref().is_none_or(is_all) {
        let diagnostics = [ladder.diagnostics, missing].concat();
        return SourceFile { diagnostics, ..ladder };
    }
    let mut found = source(read);
    // Of two readings of a document that both have errors, the one with fewer is nearer to what was meant; a ladder has
    // no circles, no library and no document of the first edition.
    let errors = |found: &[Diagnostic]| {
        let errors = found.iter();
        errors.filter(|it| it.severity == Severity::Error).count()
    };
    let is_other = |found: &Diagnostic| ["U1001", "U1006", "U1013"].contains(&found.code);
    let may_be_ladder = is_drawn && !ladder.diagnostics.iter().any(is_other);
    let has_fewer = errors(&ladder.diagnostics) <= errors(&found.diagnostics);
    if found.source.is_none() && !is_ladder && may_be_ladder && has_fewer {
        found.diagnostics = ladder.diagnostics;
    }
    found
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
    let mut diagnostics = whole.diagnostics;
    let library = (!whole.checked.is_empty()).then_some(Source::Library(whole.checked));
    diagnostics.extend(whole.not_kept);
    diagnostics.sort_by_key(|found| (found.span.start, found.span.end));
    let source = whole.typed.map(|typed| Source::Typed(Arc::new(typed))).or(library);
    SourceFile { source, period: whole.period, diagnostics }
}

/// The error of a file that a program is wanted of, and that has none.
pub fn no_program() -> Diagnostic {
    Diagnostic::error("U1051", "the text has no program", 0..0)
        .with_help("a text needs a PROGRAM … END_PROGRAM")
}
