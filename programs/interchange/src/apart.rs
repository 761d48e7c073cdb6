//! The programs of a file, each for a controller of its own.
//!
//! Programs that share a variable or read each other, and a program that runs twice, stay together: apart they would do something else.

use std::collections::{HashMap, HashSet};
use std::time::Duration;

use understudy_structured_text::lower::{event, has_event, roots, share_bits};
use understudy_structured_text::print;
use understudy_structured_text::syntax::{Declaration, File, Name, Unit, UnitKind};
use understudy_text::{Diagnostic, Severity, has_errors};

use crate::format::Format;
use crate::plcopen;
use crate::source::{Rungs, Source, SourceFile, Wanted, no_program, read_source};
use crate::twincat;
use crate::typed_text::{Bodies, parsed, typed_text_with};
use crate::written::{WriteError, Written, write};

/// Code of the warning on a program that nothing runs: it is not kept.
pub const IDLE_PROGRAM: &str = "U1055";

/// Code of the warning on what a program reads of one that is not executed.
pub const NOT_EXECUTED: &str = "U1085";

/// Code of an address that cannot be used.
const ADDRESS: &str = "U1083";

/// A program for a controller of its own.
#[derive(Debug)]
pub struct Apart {
    /// What it is; never a library.
    pub source: Source,
    /// Its scan period, where the file states one.
    pub period: Option<Duration>,
    /// A text of its own and its form, where the file has other programs too, or no file has the text that was read.
    pub written: Option<Result<(Format, Written), WriteError>>,
}

/// Where the program of a file that has no other is kept.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Copies {
    /// The programs stand in copies of the text that was read.
    AsRead,
    /// The programs stand in a text that is written, since what was read is no file: the parts of a project.
    Written,
}

/// A text that was read, and its syntax where it is not only a ladder.
struct Text<'a> {
    name: &'a str,
    text: &'a str,
    parsed: Option<File>,
}

/// Reads each program of the file `name` that a controller can run, and everything that is wrong with them.
pub fn read_apart(name: &str, text: &str, copies: Copies) -> (Vec<Apart>, Vec<Diagnostic>) {
    let whole = read_source(name, text, Wanted::default());
    let file = Text { name, text, parsed: parsed(name, text).map(|(file, _)| file) };
    let parsed = file.parsed.as_ref();
    let units = parsed.map_or_else(Vec::new, |parsed| programs(name, text, parsed));
    let belong_together = parsed.is_some_and(|parsed| belong_together(parsed, &units));
    // Alone, each program has the memory to itself in which another one has a part.
    let is_wrong = |found: &Diagnostic| found.code == ADDRESS && found.severity == Severity::Error;
    let share_memory = whole.diagnostics.iter().any(is_wrong);
    if units.len() < 2 || share_memory || whole.source.is_some() && belong_together {
        return file.together(whole, copies);
    }
    let mut apart = Vec::new();
    // Of what is read program by program, the whole alone tells which programs nothing runs.
    let idle = whole.diagnostics.iter().filter(|found| found.code == IDLE_PROGRAM);
    let mut diagnostics: Vec<Diagnostic> = idle.cloned().collect();
    if belong_together {
        let message =
            "the programs of the file share variables, and nothing says which of them run";
        let found = Diagnostic::error("U1013", message, 0..0);
        diagnostics.push(found.with_help("add a CONFIGURATION with a task for each of them"));
    }
    for unit in &units {
        let wanted = Wanted { program: Some(unit), period: None };
        let SourceFile { source, rungs, period, diagnostics: found } =
            read_source(name, text, wanted);
        for finding in found {
            if !diagnostics.contains(&finding) {
                diagnostics.push(finding);
            }
        }
        let Some(source @ Source::Program(_)) = source else {
            continue;
        };
        let (alone, is_read) = file.alone((source, rungs), period, Some(unit));
        // Where the programs cannot be written apart, one controller runs them all.
        if !is_read && whole.source.is_some() {
            return file.together(whole, copies);
        }
        apart.push(alone);
    }
    diagnostics.sort_by_key(|found| (found.span.start, found.span.end));
    (apart, diagnostics)
}

/// Leaves of a file the program of that name and what it uses.
pub(crate) fn alone(file: &mut File, program: &str) {
    let chosen = |name: &Name| name.is(program);
    let mut parts: HashMap<String, HashSet<String>> = HashMap::new();
    for unit in &file.units {
        parts.entry(unit.name.key()).or_default().extend(words(&print::unit(unit)));
    }
    for of in &file.types {
        let only = File { types: vec![of.clone()], ..File::default() };
        parts.entry(of.name.key()).or_default().extend(words(&print::file(&only)));
    }
    for global in &file.globals {
        let only = print::declarations(std::slice::from_ref(global));
        parts.entry(global.name.key()).or_default().extend(words(&only));
    }
    let runs = file.instances.iter().filter(|run| chosen(&run.of));
    let events = runs.filter_map(|run| event(file, run));
    let mut own: HashSet<String> =
        events.flat_map(|event| words(&print::expression(event))).collect();
    own.insert(program.to_ascii_uppercase());
    let used: HashSet<String> = reached(&own, &parts).into_iter().map(str::to_owned).collect();
    file.units.retain(|unit| used.contains(&unit.name.key()));
    file.globals.retain(|global| global.constant || used.contains(&global.name.key()));
}

impl Text<'_> {
    /// A program in a text of its own, and whether this could be read: what is drafted is what will be read of it.
    fn alone(
        &self,
        (source, rungs): (Source, Option<Rungs>),
        period: Option<Duration>,
        program: Option<&str>,
    ) -> (Apart, bool) {
        let Self { name, text, parsed } = self;
        let has_event = parsed.as_ref().is_some_and(|file| has_event(file, program));
        // A ladder states neither interval nor event.
        let is_plain = period.is_none() && !has_event;
        let ladder = rungs.and_then(Rungs::written).filter(|_| is_plain);
        let to = if ladder.is_some() { Format::Ladder } else { Format::StructuredText };
        let wanted = Wanted { program, period: None };
        let written = match &ladder {
            Some(ladder) => write(to, ladder, None),
            None => match typed_text_with(name, text, wanted, (to, Bodies::AsRead), None) {
                Ok((Some(written), _)) => Ok(written),
                Ok((None, _)) => Err(WriteError::NotHeld("it has errors".to_owned())),
                Err(error) => Err(error),
            },
        };
        let read = written.as_ref().ok().and_then(|written| {
            let name = format!("alone.{}", to.ending());
            read_source(&name, &written.text, Wanted::default()).source
        });
        let is_read = read.is_some();
        let written = Some(written.map(|written| (to, written)));
        (Apart { source: read.unwrap_or(source), period, written }, is_read)
    }

    /// One controller for all that the file runs.
    fn together(&self, whole: SourceFile, copies: Copies) -> (Vec<Apart>, Vec<Diagnostic>) {
        let SourceFile { source, rungs, period, mut diagnostics } = whole;
        let is_program = matches!(source, Some(Source::Program(_)));
        if !is_program && !has_errors(&diagnostics) {
            diagnostics.push(no_program());
        }
        let apart = source.filter(|_| is_program).map(|source| match copies {
            Copies::AsRead => Apart { source, period, written: None },
            Copies::Written => self.alone((source, rungs), period, None).0,
        });
        (apart.into_iter().collect(), diagnostics)
    }
}

/// Names of the programs that the tasks of a file run; of those that no other calls, where it has no tasks.
fn programs(name: &str, text: &str, file: &File) -> Vec<String> {
    let mut names = match Format::of(name, text) {
        Some(Format::PlcOpen) if !twincat::is_one(text) => plcopen::programs(text),
        _ => Vec::new(),
    };
    if names.is_empty() {
        names.extend(file.instances.iter().map(|instance| instance.of.to_string()));
    }
    if file.instances.is_empty() {
        let roots = roots(file);
        names.retain(|name| roots.iter().any(|unit| unit.name.is(name)));
        if names.is_empty() {
            names.extend(roots.iter().map(|unit| unit.name.to_string()));
        }
    }
    let mut seen = HashSet::new();
    names.retain(|name| seen.insert(name.to_ascii_uppercase()));
    names
}

/// Whether programs share memory, run twice or are connected to variables.
fn belong_together(file: &File, programs: &[String]) -> bool {
    let mut seen = HashSet::new();
    let mut instances = file.instances.iter();
    let is_more = instances
        .any(|instance| !instance.connections.is_empty() || !seen.insert(instance.of.key()));
    let is_program = |unit: &Unit| unit.kind == UnitKind::Program;
    let all = file.units.iter().filter(|unit| is_program(unit));
    let all: HashSet<String> = all.map(|unit| unit.name.key()).collect();
    let words_of = |unit: &Unit| (unit.name.key(), words_of(unit, &all));
    let is_main = |unit: &&Unit| is_program(unit) && programs.iter().any(|name| unit.name.is(name));
    let (main, called): (Vec<&Unit>, Vec<&Unit>) = file.units.iter().partition(is_main);
    let main: HashMap<String, HashSet<String>> = main.into_iter().map(words_of).collect();
    let called: HashMap<String, HashSet<String>> = called.into_iter().map(words_of).collect();
    // Each controller has inputs of its own, whatever else reads them.
    let is_input = |address: &str| address.to_ascii_uppercase().starts_with("%I");
    // A variable at an address is the memory there.
    let place = |global: &Declaration| {
        let printed = words(&print::declarations(std::slice::from_ref(global)));
        printed.into_iter().find(|word| word.starts_with('%'))
    };
    let globals = file.globals.iter().filter(|global| !global.constant);
    let globals: HashMap<String, String> = globals
        .map(|global| (global.name.key(), place(global).unwrap_or_else(|| global.name.key())))
        .collect();
    let mut users: Vec<(String, &str)> = Vec::new();
    for program in programs {
        let mut own = main.get(&program.to_ascii_uppercase()).cloned().unwrap_or_default();
        own.insert(memory_of(&program.to_ascii_uppercase()));
        let runs = file.instances.iter().filter(|run| run.of.is(program));
        for event in runs.filter_map(|run| event(file, run)) {
            let event = words(&print::expression(event));
            own.extend(event.intersection(&all).map(|name| memory_of(name)));
            own.extend(event);
        }
        let shared =
            reached(&own, &called).into_iter().filter_map(|word| match globals.get(word) {
                Some(place) => Some(place.as_str()),
                None => (word.starts_with('%') || word.starts_with(MEMORY)).then_some(word),
            });
        let shared: HashSet<&str> = shared.filter(|word| !is_input(word)).collect();
        users.extend(shared.into_iter().map(|word| (word.to_owned(), program.as_str())));
    }
    let meet = |(one, by): &(String, &str), (other, to): &(String, &str)| {
        by != to && (one == other || share_bits(one, other))
    };
    is_more || users.iter().any(|user| users.iter().any(|other| meet(user, other)))
}

/// In front of the name of a program, the word for its memory. No name has a space.
const MEMORY: &str = "PROGRAM ";

fn memory_of(program: &str) -> String {
    format!("{MEMORY}{program}")
}

/// Names and addresses in a unit, and the memory of each other program that it names.
fn words_of(unit: &Unit, programs: &HashSet<String>) -> HashSet<String> {
    let mut found = words(&print::unit(unit));
    let parts = std::iter::once(unit).chain(&unit.methods);
    let own = parts.flat_map(|part| &part.declarations).map(|declared| declared.name.key());
    let own: HashSet<String> = own.chain([unit.name.key()]).collect();
    let others = programs.iter().filter(|name| found.contains(*name) && !own.contains(*name));
    let others: Vec<String> = others.map(|name| memory_of(name)).collect();
    found.extend(others);
    found
}

/// Words, and those of the blocks and functions that they name.
fn reached<'a>(
    own: &'a HashSet<String>,
    called: &'a HashMap<String, HashSet<String>>,
) -> HashSet<&'a str> {
    let mut reached = HashSet::new();
    let mut waiting = vec![own];
    while let Some(words) = waiting.pop() {
        for word in words {
            if reached.insert(word.as_str()) {
                waiting.extend(called.get(word));
            }
        }
    }
    reached
}

/// Names and addresses in a text, in capitals.
pub(crate) fn words(text: &str) -> HashSet<String> {
    let text = text.to_ascii_uppercase();
    let is_part = |letter: char| letter.is_alphanumeric() || letter == '_';
    let mut words = HashSet::new();
    let names = text.split(|letter: char| !is_part(letter)).filter(|word| !word.is_empty());
    words.extend(names.map(str::to_owned));
    let addresses = text.split('%').skip(1).map(|rest| {
        let end = rest.find(|letter: char| !is_part(letter) && letter != '.');
        let address = &rest[..end.unwrap_or(rest.len())];
        // The X of a bit may be left out.
        match address.get(1..2).is_some_and(|size| size.parse::<u8>().is_ok()) {
            true => format!("%{}X{}", &address[..1], &address[1..]),
            false => format!("%{address}"),
        }
    });
    words.extend(addresses);
    words
}
