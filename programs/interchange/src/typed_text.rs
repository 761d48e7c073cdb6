//! A program with numbers as Structured Text or PLCopen XML, from any form that is read.
//!
//! Invariant: the text is the program. It is read back, and both are executed over scans with pseudo-random inputs: every output is the same.

use std::collections::HashMap;
use std::time::Duration;

use understudy_executable::{Executable, Interface, digest};
use understudy_structured_text::lower::{event, intervals};
use understudy_structured_text::syntax::{
    Body, Declaration, File, Name, ProgramInstance, Task, TypeKind, TypeName, Unit, UnitKind,
};
use understudy_structured_text::{control_blocks, parse, print};
use understudy_text::{Diagnostic, Severity, has_errors};
use understudy_typed::Program;

use crate::apart::alone;
use crate::diagrams::Style;
use crate::format::{Format, stem};
use crate::ldmicro;
use crate::lists::without_lists;
use crate::plcopen;
use crate::source::Wanted;
use crate::text::{Whole, whole};
use crate::twincat;
use crate::written::{Compared, USUAL_PERIOD, WriteError, Written};

/// Scans in which a program and its text are compared.
const SCANS: usize = 2_000;

/// The programs, blocks and types of the file `name` as one text of the form `to`, which runs them by a CONFIGURATION, and what was found in
/// the file. Nothing is written where it has errors, or is of a form that has no programs with numbers.
///
/// # Errors
/// [`WriteError::NotHeld`] and [`WriteError::ReadOnly`], where the form does not hold it; [`WriteError::Different`], where the text does something
/// else than the program: a defect of this program.
pub fn typed_text(
    name: &str,
    text: &str,
    wanted: Wanted<'_>,
    to: Format,
    bodies: Bodies,
) -> Result<(Option<Written>, Vec<Diagnostic>), WriteError> {
    typed_text_with(name, text, wanted, (to, bodies), Some(USUAL_PERIOD))
}

/// As [`typed_text`]; `usual` is the interval of a task that it adds where the file states none.
pub(crate) fn typed_text_with(
    name: &str,
    text: &str,
    wanted: Wanted<'_>,
    (to, bodies): (Format, Bodies),
    usual: Option<Duration>,
) -> Result<(Option<Written>, Vec<Diagnostic>), WriteError> {
    let format = Format::of(name, text);
    let Some((mut file, found)) = parsed(name, text) else {
        return Ok((None, Vec::new()));
    };
    if let Some(program) = wanted.program {
        alone(&mut file, program);
    }
    let mut losses = Vec::new();
    let period = match given_interval(&mut file, wanted) {
        true => wanted.period,
        false => {
            losses.extend(wanted.period.map(own_intervals));
            None
        }
    };
    let wanted = Wanted { period, ..wanted };
    let read = whole(text, (file.clone(), found), wanted.program, wanted.period);
    let mut diagnostics = read.diagnostics.clone();
    diagnostics.sort_by_key(|found| (found.span.start, found.span.end));
    if has_errors(&diagnostics) || (read.typed.is_none() && read.checked.is_empty()) {
        return Ok((None, diagnostics));
    }
    if read.typed.is_some() {
        configure(&mut file, wanted, wanted.period.or(read.period).or(usual));
    }
    let mut file = with_library(file);
    without_lists(&mut file);
    let as_text = print::file(&file);
    let (printed, scans) = match to {
        Format::StructuredText => {
            let printed = with_written_names(&file, as_text.clone());
            let again = whole(&printed, parse(&printed), wanted.program, None);
            let scans = compare(&read, &again)?;
            (printed, scans)
        }
        Format::PlcOpen => {
            let drawn = match format {
                Some(Format::PlcOpen) => plcopen::drawn_units(text),
                _ => HashMap::new(),
            };
            let style = |unit: &Unit| bodies.style(drawn.get(&unit.name.key()).copied());
            let document = match document(&file, &read, wanted, &style) {
                // Networks that differ from the statements are replaced by the text.
                Err(WriteError::Different(_)) => {
                    document(&file, &read, wanted, &|_| None).map(|(printed, _, scans)| {
                        let units = file.units.iter().filter(|unit| style(unit).is_some());
                        let reasons =
                            units.map(|unit| format!("`{}` is not its networks", unit.name));
                        (printed, reasons.collect(), scans)
                    })
                }
                document => document,
            };
            let (printed, reasons, scans) = document?;
            losses.extend(in_text(&reasons));
            (printed, scans)
        }
        _ => return Err(WriteError::ReadOnly),
    };
    let compared = Compared { scans, ..Compared::default() };
    if format == Some(Format::StructuredText) {
        let kept = match wanted.program {
            Some(_) => file.units.iter().filter_map(|unit| text.get(unit.span.clone())).collect(),
            None => text.to_owned(),
        };
        losses.extend(lost_comments(&kept, &as_text));
    }
    let written = Written { losses, text: printed, compared };
    Ok((Some(written), diagnostics))
}

/// A document, which bodies of it are text and why, and in how many scans it was the program that was read.
fn document(
    file: &File,
    read: &Whole,
    wanted: Wanted<'_>,
    style: &dyn Fn(&Unit) -> Option<Style>,
) -> Result<(String, Vec<String>, usize), WriteError> {
    let main = file.instances.first().map(|instance| &instance.of);
    let main = main.or_else(|| Some(&file.units.last()?.name));
    let title = main.map_or("project", Name::as_str);
    let document = plcopen::write_typed(file, title, style).map_err(WriteError::NotHeld)?;
    plcopen::confirm_order(&document.text, file).map_err(WriteError::Different)?;
    let printed = with_written_names(file, document.text);
    let again = whole(&printed, plcopen::read_typed(&printed), wanted.program, None);
    let scans = compare(read, &again)?;
    Ok((printed, document.as_text, scans))
}

/// The syntax of the file `name`, and what was found in it; nothing for a form that has no programs with numbers.
pub(crate) fn parsed(name: &str, text: &str) -> Option<(File, Vec<Diagnostic>)> {
    if let Some(parsed) = twincat::read(text) {
        return Some(parsed);
    }
    match Format::of(name, text)? {
        Format::StructuredText => Some(parse(text)),
        Format::PlcOpen => Some(plcopen::read_typed(text)),
        Format::LdMicro => Some(ldmicro::read(stem(name), text)),
        Format::Ladder | Format::Digraph => None,
    }
}

/// What statements are written as, where the form has several languages.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Bodies {
    /// What was read: ladders, function blocks or text.
    #[default]
    AsRead,
    /// Text as function blocks, as far as networks hold the statements; all else as it was read.
    Blocks,
}

impl Bodies {
    /// What a body is drawn as that was drawn as `read`; nothing for text.
    pub(crate) fn style(self, read: Option<Style>) -> Option<Style> {
        read.or((self == Self::Blocks).then_some(Style::Blocks))
    }
}

/// The finding on bodies that are not networks.
fn in_text(reasons: &[String]) -> Option<Diagnostic> {
    if reasons.is_empty() {
        return None;
    }
    let mut listed = reasons.iter().take(8).cloned().collect::<Vec<_>>().join(", ");
    if let Some(more @ 1..) = reasons.len().checked_sub(8) {
        listed = format!("{listed} and {more} more");
    }
    let message =
        format!("PLCopen XML has these bodies as Structured Text, not as networks: {listed}");
    Some(Diagnostic::warning("U1018", message, 0..0))
}

/// Gives the one interval of a file the wanted period; false where the file has several, or runs its programs without one.
fn given_interval(file: &mut File, wanted: Wanted<'_>) -> bool {
    let Some(period) = wanted.period else {
        return true;
    };
    let intervals = intervals(file, wanted.program);
    let Some(first) = intervals.first() else {
        return file.instances.is_empty() || wanted.program.is_some();
    };
    let is_one = intervals.iter().all(|interval| interval == first);
    for task in file.tasks.iter_mut().filter(|task| is_one && task.interval == Some(*first)) {
        task.interval = i64::try_from(period.as_nanos()).ok();
    }
    is_one
}

/// The finding on a period that a text with intervals of its own does not have.
fn own_intervals(period: Duration) -> Diagnostic {
    let period = understudy_text::duration::text(period);
    let message =
        format!("the written text keeps the intervals of its tasks, not the period of {period}");
    let help = "a cluster file or --period gives the period at which they are counted";
    Diagnostic::warning("U1018", message, 0..0).with_help(help)
}

/// Runs the program by a task, where the file does not say what runs, or another program is wanted. What starts that program stays its task.
fn configure(file: &mut File, wanted: Wanted<'_>, interval: Option<Duration>) {
    let is_wanted = |unit: &&Unit| {
        unit.kind == UnitKind::Program && wanted.program.is_none_or(|name| unit.name.is(name))
    };
    let chosen: Vec<Name> =
        file.units.iter().filter(is_wanted).map(|unit| unit.name.clone()).collect();
    if !file.instances.is_empty() && wanted.program.is_none() {
        return;
    }
    let name = |text: &str| Name::new(text, 0..0);
    let mut runs = file.instances.iter();
    let runs = runs.find(|run| wanted.program.is_some_and(|program| run.of.is(program)));
    let retention = runs.map(|run| run.retention).unwrap_or_default();
    let single = runs.and_then(|run| event(file, run).cloned());
    let interval = interval.filter(|_| single.is_none());
    let interval = interval.and_then(|interval| i64::try_from(interval.as_nanos()).ok());
    file.tasks = vec![Task { name: name("Task0"), interval, priority: Some(0), single }];
    // The points of several programs have the names of the programs in front.
    let are_several = chosen.len() > 1;
    let instances = chosen.into_iter().map(|of| ProgramInstance {
        retention,
        name: if are_several { of.clone() } else { name("Instance0") },
        task: Some(name("Task0")),
        of,
        connections: Vec::new(),
    });
    file.instances = instances.collect();
}

/// The file with the control blocks that it uses: other compilers do not have them.
fn with_library(mut file: File) -> File {
    let mut names = Vec::new();
    declared_types(&file.globals, &mut names);
    file.types.iter().for_each(|definition| types_of(&definition.of, &mut names));
    let mut looked_at = 0;
    while looked_at < file.units.len() || !names.is_empty() {
        if let Some(unit) = file.units.get(looked_at) {
            types_in(unit, &mut names);
            looked_at += 1;
        }
        for name in std::mem::take(&mut names) {
            let is_known = file.units.iter().any(|unit| unit.name == name);
            let found = control_blocks().find(|unit| unit.name == name);
            if let Some(found) = found.filter(|_| !is_known) {
                file.units.push(found.clone());
            }
        }
    }
    file
}

/// The types that a unit names; a variable may have the name of a block.
fn types_in(unit: &Unit, names: &mut Vec<Name>) {
    names.extend(unit.extends.clone());
    declared_types(&unit.declarations, names);
    unit.methods.iter().for_each(|method| types_in(method, names));
}

fn declared_types(declarations: &[Declaration], names: &mut Vec<Name>) {
    declarations.iter().for_each(|declaration| types_of(&declaration.of, names));
}

fn types_of(of: &TypeName, names: &mut Vec<Name>) {
    match &of.kind {
        TypeKind::Named(name) => names.push(name.clone()),
        TypeKind::Array(_, element) | TypeKind::OpenArray(_, element) => types_of(element, names),
        TypeKind::Pointer(element) => types_of(element, names),
        TypeKind::Structure(fields) => declared_types(fields, names),
        TypeKind::Subrange(..) | TypeKind::Text { .. } | TypeKind::Enumeration(..) => {}
    }
}

/// The text with names that can be written: the reader of drawn networks makes names with a dot, which no user can have declared.
pub(crate) fn with_written_names(file: &File, text: String) -> String {
    let mut made = Vec::new();
    for unit in &file.units {
        names_with_dots(unit, &mut made);
    }
    made.into_iter().fold(text, |text, name| {
        let mut written = written_name(&name);
        while text.contains(&written) {
            written.push('_');
        }
        replaced(&text, &name, &written)
    })
}

/// A name that can be written in place of one that a reader has made: `ia_0_rising` of `ia[0].rising`.
pub(crate) fn written_name(name: &str) -> String {
    let words = name.split(|letter: char| !letter.is_alphanumeric() && letter != '_');
    let words: Vec<&str> = words.filter(|word| !word.is_empty()).collect();
    words.join("_")
}

fn names_with_dots(unit: &Unit, made: &mut Vec<String>) {
    let declared = unit.declarations.iter().map(|declaration| &declaration.name);
    let chart = match &unit.body {
        Body::Chart(chart) => Some(chart),
        _ => None,
    };
    let actions = chart.iter().flat_map(|chart| &chart.actions);
    let actions = actions.map(|action| &action.name);
    let steps = chart.iter().flat_map(|chart| &chart.steps);
    let actions = actions.chain(steps.map(|step| &step.name));
    let methods = unit.methods.iter().map(|method| &method.name);
    let names = declared.chain(actions).chain(methods).map(|name| name.as_str());
    made.extend(names.filter(|name| name.contains('.')).map(str::to_owned));
    unit.methods.iter().for_each(|method| names_with_dots(method, made));
}

/// The text with another word in place of each `word` that is a whole one.
fn replaced(text: &str, word: &str, by: &str) -> String {
    let is_part = |letter: char| letter.is_alphanumeric() || letter == '_';
    let mut result = String::with_capacity(text.len());
    let mut done = 0;
    for (at, _) in text.match_indices(word) {
        let before = text[..at].chars().next_back();
        let after = text[at + word.len()..].chars().next();
        let is_whole =
            !before.is_some_and(|it| is_part(it) || it == '.') && !after.is_some_and(is_part);
        result += &text[done..at];
        result += if is_whole { by } else { word };
        done = at + word.len();
    }
    result + &text[done..]
}

/// Compares a program with what was read of its text; the number of scans.
fn compare(read: &Whole, again: &Whole) -> Result<usize, WriteError> {
    let different = |reason: String| Err(WriteError::Different(reason));
    let mut errors = again.diagnostics.iter();
    if let Some(error) = errors.find(|found| found.severity == Severity::Error) {
        return different(format!("{} {}", error.code, error.message));
    }
    match (&read.typed, &again.typed) {
        // A document declares the globals that its units refer to, so more of them can be checked there.
        (None, None) if read.checked.iter().all(|unit| again.checked.contains(unit)) => Ok(0),
        (Some(before), Some(after)) => {
            let digested = |program: &Program| {
                let (executable, interface) = (Executable::from(program), Interface::from(program));
                let every: Vec<u32> = program.tasks.iter().map(|task| task.every).collect();
                let outputs = digest(&executable, &interface, SCANS as u64);
                (outputs, points(&interface), program.period, every)
            };
            if digested(before) != digested(after) {
                return different("its outputs differ in scans with random inputs".to_owned());
            }
            if retentive(before) != retentive(after) {
                return different("other variables are retentive".to_owned());
            }
            Ok(SCANS)
        }
        _ => different(format!("it has {} in place of {}", named(again), named(read))),
    }
}

/// The retentive variables, without regard to what a form changes in names.
fn retentive(program: &Program) -> Vec<String> {
    let names = program.retentive_names().into_iter();
    let mut names: Vec<String> =
        names.map(|name| written_name(&name).to_ascii_uppercase()).collect();
    names.sort_unstable();
    names
}

/// What a file has, for a message.
fn named(read: &Whole) -> String {
    match &read.typed {
        Some(typed) => format!("{} programs", typed.tasks.len()),
        None => format!("the units {}", read.checked.join(", ")),
    }
}

/// Names and types of the inputs and outputs.
fn points(interface: &Interface) -> Vec<(String, understudy_typed::Elementary)> {
    let points = interface.inputs.iter().chain(interface.outputs.iter());
    points.map(|point| (point.name.clone(), point.of)).collect()
}

/// Says how many comments of a text are not in another one: those within bodies are not kept.
fn lost_comments(text: &str, printed: &str) -> Option<Diagnostic> {
    let count = |text: &str| text.matches("(*").count() + text.matches("//").count();
    let lost = count(text).saturating_sub(count(printed));
    let message = format!("the written text lacks {lost} comments, which are within statements");
    (lost > 0).then(|| Diagnostic::warning("U1018", message, 0..0))
}
