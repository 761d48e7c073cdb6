//! What of a text a ladder does not keep, although it is one.

use std::collections::{BTreeMap, HashMap, HashSet};
use std::ops::Range;

use understudy_structured_text::syntax::{Class, File, Name, TypeKind, Unit, UnitKind};
use understudy_text::Diagnostic;

/// Names that one finding lists.
const MAXIMUM_LISTED: usize = 20;

/// What a program as rungs does not keep, or has under another name.
#[derive(Debug, Default)]
pub(super) struct Lost<'f> {
    /// Declarations of the program that are no part of rungs, and that no statement uses.
    pub(super) unused: Vec<&'f Name>,
    /// Names that a ladder cannot have, with those that it has in their place.
    pub(super) renamed: Vec<(&'f Name, String)>,
    /// Global variables that are signals of the ladder.
    pub(super) globals: Vec<(&'f Name, String)>,
}

/// Second names of one address, initial values of inputs, and what nothing uses.
pub(super) fn lost(text: &str, file: &File, unit: &Unit, lost: &Lost<'_>) -> Vec<Diagnostic> {
    let warning = |message: String, span| Diagnostic::warning("U1055", message, span);
    let mut found = Vec::new();
    for (name, other) in &lost.renamed {
        let message = format!("`{name}` is `{other}` in the ladder");
        found.push(Diagnostic::warning("U1067", message, name.span()));
    }
    for name in &lost.unused {
        let message =
            format!("`{name}` is nothing that a ladder holds, and nothing here uses it: not kept");
        found.push(warning(message, name.span()));
    }
    let mut first: BTreeMap<String, &Name> = BTreeMap::new();
    for declaration in &unit.declarations {
        let name = &declaration.name;
        if declaration.class == Class::Input && declaration.initial.is_some() {
            let message = format!("the initial value of the input `{name}` is not kept");
            found.push(warning(message, name.span()));
        }
        let Some(address) = &declaration.address else {
            continue;
        };
        match first.get(&address.key()) {
            Some(first) => {
                let message = format!(
                    "`{name}` as a second name of `{first}`, whose address it has, is not kept"
                );
                found.push(warning(message, name.span()));
            }
            None => {
                first.insert(address.key(), name);
            }
        }
    }
    // The parts of a document are reported by their counts.
    if !text.trim_start_matches('\u{feff}').trim_start().starts_with('<') {
        found.extend(unused(text, file, lost));
    }
    found
}

/// What is declared outside of the programs and not used elsewhere in the text.
fn unused(text: &str, file: &File, lost: &Lost<'_>) -> Option<Diagnostic> {
    let belongs = |letter: char| letter.is_ascii_alphanumeric() || letter == '_';
    let mut places: HashMap<String, Vec<usize>> = HashMap::new();
    for word in text.split(|letter| !belongs(letter)).filter(|word| !word.is_empty()) {
        let place = word.as_ptr() as usize - text.as_ptr() as usize;
        places.entry(word.to_ascii_uppercase()).or_default().push(place);
    }
    let is_named = |name: &Name, own: &Range<usize>| {
        let found = places.get(&name.key());
        found.is_some_and(|found| found.iter().any(|place| !own.contains(place)))
    };
    let mut unused: Vec<&Name> = Vec::new();
    for unit in &file.units {
        if unit.kind != UnitKind::Program && !is_named(&unit.name, &unit.span) {
            unused.push(&unit.name);
        }
    }
    for definition in &file.types {
        let values = match &definition.of.kind {
            TypeKind::Enumeration(values, _) => values.as_slice(),
            _ => &[],
        };
        let mut names = values.iter().map(|(name, _)| name).chain([&definition.name]);
        if !names.any(|name| is_named(name, &name.span())) {
            unused.push(&definition.name);
        }
    }
    let globals = file.globals.iter().map(|global| &global.name);
    let is_kept = |name: &Name| lost.globals.iter().any(|(kept, _)| *kept == name);
    unused.extend(globals.filter(|name| !is_named(name, &name.span()) && !is_kept(name)));
    let mut seen = HashSet::new();
    unused.retain(|name| seen.insert(name.key()));
    let first = unused.first()?;
    let listed = unused.iter().take(MAXIMUM_LISTED);
    let listed: Vec<String> = listed.map(|name| format!("`{name}`")).collect();
    let more = match unused.len() - listed.len() {
        0 => String::new(),
        more => format!(" and {more} more"),
    };
    let message = format!("nothing uses {}{more}: not kept", listed.join(", "));
    Some(Diagnostic::warning("U1055", message, first.span()))
}
