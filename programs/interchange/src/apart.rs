//! The programs of a file, each for a controller of its own.
//!
//! Programs that share a variable, and a program that runs twice, stay together: apart they would do something else.

use std::collections::{HashMap, HashSet};
use std::time::Duration;

use understudy_structured_text::lower::{event, has_event};
use understudy_structured_text::print;
use understudy_structured_text::syntax::{Declaration, File, Name, Unit, UnitKind};
use understudy_text::{Diagnostic, has_errors};

use crate::format::Format;
use crate::plcopen;
use crate::source::{Source, SourceFile, Wanted, no_program, read_source};
use crate::twincat;
use crate::typed_text::{Bodies, parsed, typed_text_with};
use crate::written::{WriteError, Written, write};

/// A program for a controller of its own.
#[derive(Debug)]
pub struct Apart {
    /// What it is; never a library.
    pub source: Source,
    /// Its scan period, where the file states one.
    pub period: Option<Duration>,
    /// A text of its own and its form, where the file has other programs too.
    pub written: Option<Result<(Format, Written), WriteError>>,
}

/// Reads each program of the file `name` that a controller can run, and everything that is wrong with them.
pub fn read_apart(name: &str, text: &str) -> (Vec<Apart>, Vec<Diagnostic>) {
    let whole = read_source(name, text, Wanted::default());
    let parsed = parsed(name, text).map(|(file, _)| file);
    let units = parsed.as_ref().map_or_else(Vec::new, |file| programs(name, text, file));
    let belong_together = parsed.as_ref().is_some_and(|file| belong_together(file, &units));
    if units.len() < 2 || whole.source.is_some() && belong_together {
        return together(whole);
    }
    let mut apart = Vec::new();
    let mut diagnostics = Vec::new();
    if belong_together {
        let message =
            "the programs of the file share variables, and nothing says which of them run";
        let found = Diagnostic::error("U1013", message, 0..0);
        diagnostics.push(found.with_help("add a CONFIGURATION with a task for each of them"));
    }
    for unit in &units {
        let wanted = Wanted { program: Some(unit), period: None };
        let SourceFile { source, period, diagnostics: found } = read_source(name, text, wanted);
        for finding in found {
            if !diagnostics.contains(&finding) {
                diagnostics.push(finding);
            }
        }
        let has_event = parsed.as_ref().is_some_and(|file| has_event(file, Some(unit)));
        let is_document =
            Format::of(name, text) == Some(Format::PlcOpen) && twincat::read(text).is_none();
        let to = match &source {
            // A ladder states neither interval nor event.
            Some(Source::Ladder(_)) if period.is_none() && !has_event => Format::Ladder,
            Some(Source::Ladder(_)) if is_document => Format::PlcOpen,
            Some(Source::Ladder(_) | Source::Typed(_)) => Format::StructuredText,
            Some(Source::Library(_)) | None => continue,
        };
        let written = match &source {
            Some(Source::Ladder(ladder)) if to == Format::Ladder => write(to, ladder, None),
            _ => match typed_text_with(name, text, wanted, (to, Bodies::AsRead), None) {
                Ok((Some(written), _)) => Ok(written),
                Ok((None, _)) => Err(WriteError::NotHeld("it has errors".to_owned())),
                Err(error) => Err(error),
            },
        };
        // What is drafted is what will be read of the text.
        let read = written.as_ref().ok().and_then(|written| {
            let name = format!("{unit}.{}", to.ending());
            read_source(&name, &written.text, Wanted::default()).source
        });
        // Where the programs cannot be written apart, one controller runs them all.
        if read.is_none() && whole.source.is_some() {
            return together(whole);
        }
        let written = Some(written.map(|written| (to, written)));
        apart.extend(read.or(source).map(|source| Apart { source, period, written }));
    }
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

/// One controller for all that the file runs.
fn together(whole: SourceFile) -> (Vec<Apart>, Vec<Diagnostic>) {
    let SourceFile { source, period, mut diagnostics } = whole;
    let is_program = matches!(source, Some(Source::Ladder(_) | Source::Typed(_)));
    if !is_program && !has_errors(&diagnostics) {
        diagnostics.push(no_program());
    }
    let source = source.filter(|_| is_program);
    let apart = source.map(|source| Apart { source, period, written: None });
    (apart.into_iter().collect(), diagnostics)
}

/// Names of the programs that the tasks of a file run; of all its programs, where it has no tasks.
fn programs(name: &str, text: &str, file: &File) -> Vec<String> {
    if Format::of(name, text) == Some(Format::PlcOpen) {
        let programs = plcopen::programs(text);
        if !programs.is_empty() {
            return programs;
        }
    }
    let run = file.instances.iter().map(|instance| &instance.of);
    let declared = file.units.iter().filter(|unit| unit.kind == UnitKind::Program);
    let declared = declared.map(|unit| &unit.name);
    let names: Vec<_> = match file.instances.is_empty() {
        true => declared.collect(),
        false => run.collect(),
    };
    let mut seen = HashSet::new();
    let names = names.into_iter().filter(|name| seen.insert(name.key()));
    names.map(|name| name.as_str().to_owned()).collect()
}

/// Whether programs share a variable, run twice or are connected to variables.
fn belong_together(file: &File, programs: &[String]) -> bool {
    let mut seen = HashSet::new();
    let mut instances = file.instances.iter();
    let is_more = instances
        .any(|instance| !instance.connections.is_empty() || !seen.insert(instance.of.key()));
    let words_of = |unit: &Unit| (unit.name.key(), words(&print::unit(unit)));
    let (main, called): (Vec<&Unit>, Vec<&Unit>) =
        file.units.iter().partition(|unit| unit.kind == UnitKind::Program);
    let main: HashMap<String, HashSet<String>> = main.into_iter().map(words_of).collect();
    let called: HashMap<String, HashSet<String>> = called.into_iter().map(words_of).collect();
    // Each controller has inputs of its own, whatever else reads them.
    let is_input = |address: &str| address.to_ascii_uppercase().starts_with("%I");
    let is_at_input =
        |global: &&Declaration| global.address.as_ref().is_some_and(|it| is_input(it.as_str()));
    let globals = file.globals.iter().filter(|global| !global.constant);
    let globals = globals.filter(|global| !is_at_input(global));
    let globals: HashSet<String> = globals.map(|global| global.name.key()).collect();
    let mut users: HashMap<String, usize> = HashMap::new();
    for program in programs {
        let mut own = main.get(&program.to_ascii_uppercase()).cloned().unwrap_or_default();
        let runs = file.instances.iter().filter(|run| run.of.is(program));
        let events = runs.filter_map(|run| event(file, run));
        own.extend(events.flat_map(|event| words(&print::expression(event))));
        for word in reached(&own, &called) {
            let is_memory = word.starts_with('%') && !is_input(word);
            if globals.contains(word) || is_memory {
                *users.entry(word.to_owned()).or_default() += 1;
            }
        }
    }
    is_more || users.values().any(|users| *users > 1)
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
fn words(text: &str) -> HashSet<String> {
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
