//! What names mean as places of memory: two names may be one place, by their addresses or as variables of a caller.

use std::collections::HashMap;

/// A place of memory that a name means.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub(crate) enum Place {
    /// A variable, by its name in capitals.
    Variable(String),
    /// A bit at an address: its area and what is behind it.
    Bit(char, String),
    /// More than a bit of an area: it may overlap with everything in the area.
    Wide(char),
}

/// The area of variables that a caller gives: two of them may be one variable.
const OF_CALLER: char = '@';

/// A variable that a unit names.
#[derive(Clone, Copy)]
pub(crate) struct Named<'v> {
    pub(crate) name: &'v str,
    pub(crate) address: Option<&'v str>,
    /// The caller of the unit gives it.
    pub(crate) is_in_out: bool,
    pub(crate) is_external: bool,
}

/// The addresses of the variables of a unit.
#[derive(Debug, Default)]
pub(crate) struct Places {
    /// The place of each variable with an address, by its name in capitals.
    addresses: HashMap<String, Place>,
}

impl Places {
    /// Where the variables that a unit names are: its own, and the global ones.
    pub(crate) fn of_unit<'v>(variables: impl Iterator<Item = Named<'v>> + Clone) -> Self {
        let mut places = Self::default();
        let has_in_out = variables.clone().any(|variable| variable.is_in_out);
        for variable in variables {
            let mut note = |place| {
                places.addresses.entry(variable.name.to_uppercase()).or_insert(place);
            };
            if let Some(place) = variable.address.and_then(direct) {
                note(place);
            }
            if has_in_out && (variable.is_in_out || variable.is_external) {
                note(Place::Wide(OF_CALLER));
            }
        }
        places
    }

    /// The places of all variables in an expression.
    pub(super) fn of(&self, text: &str) -> Vec<Place> {
        let mut places = Vec::new();
        for name in names(text) {
            places.extend(direct(&name).or_else(|| self.addresses.get(&name).cloned()));
            places.push(Place::Variable(name));
        }
        places
    }

    /// Whether writing to `target` may change the value of `text`.
    pub(crate) fn overlap(&self, text: &str, target: &str) -> bool {
        if is_anywhere(target) {
            return true;
        }
        let targets = self.of(target);
        self.of(text).iter().any(|place| targets.iter().any(|target| overlap(place, target)))
    }
}

/// Whether a target is behind a pointer: it may be any variable.
pub(super) fn is_anywhere(target: &str) -> bool {
    target.contains('^')
}

fn overlap(left: &Place, right: &Place) -> bool {
    match (left, right) {
        (Place::Wide(left), Place::Wide(right) | Place::Bit(right, _))
        | (Place::Bit(left, _), Place::Wide(right)) => left == right,
        _ => left == right,
    }
}

/// The names in an expression in capitals, of a part of a variable that of the whole.
pub(super) fn names(text: &str) -> impl Iterator<Item = String> {
    let is_part = |letter: char| letter.is_alphanumeric() || matches!(letter, '_' | '.' | '%');
    let words = text.split(move |letter| !is_part(letter)).filter_map(|word| {
        let is_name = |first: char| first.is_alphabetic() || matches!(first, '_' | '%');
        let name = match word.starts_with('%') {
            true => word,
            false => word.split('.').next().unwrap_or_default(),
        };
        name.starts_with(is_name).then(|| name.to_uppercase())
    });
    words.filter(|name| !matches!(name.as_str(), "TRUE" | "FALSE"))
}

/// The place of an address such as `%QX0.1`.
fn direct(address: &str) -> Option<Place> {
    let mut letters = address.strip_prefix('%')?.chars();
    let area = letters.next()?.to_ascii_uppercase();
    let rest = letters.as_str();
    match rest.chars().next()?.to_ascii_uppercase() {
        'X' => Some(Place::Bit(area, rest[1..].to_owned())),
        first if first.is_ascii_digit() => Some(Place::Bit(area, rest.to_owned())),
        _ => Some(Place::Wide(area)),
    }
}
