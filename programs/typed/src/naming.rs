//! Variables by name and by address: `pid.integral`, `table[3]`.

use std::sync::Arc;

use crate::form::{Detail, Program, Variable};
use crate::image::Declared;
use crate::operation::{number_text, text_literal};
use crate::types::{Array, Elementary, Enumeration, Type};

/// Whether a name is `whole`, or names a part of it: `pump.speed` and `pump[0]` are within `pump`.
pub fn is_within(name: &str, whole: &str) -> bool {
    name.strip_prefix(whole).is_some_and(|rest| rest.is_empty() || rest.starts_with(['.', '[']))
}

/// As [`is_within`], in any case of letters.
pub fn is_within_in_any_case(name: &str, whole: &str) -> bool {
    let head = name.get(..whole.len());
    head.is_some_and(|head| head.eq_ignore_ascii_case(whole)) && is_within(&name[whole.len()..], "")
}

/// A variable without parts, or such a part of one.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Part {
    /// Its name, such as `pid.integral` or `table[3]`.
    pub name: String,
    /// Its type.
    pub of: Type,
    /// The names of its values, where its type is an enumeration.
    pub values: Option<Arc<Enumeration>>,
    /// What its declaration says besides its type.
    pub detail: Detail,
    /// Its place in memory: 64 · slot + bit.
    pub address: u64,
}

impl Part {
    /// How its value is declared; nothing where it has parts, or is a text.
    pub fn declared(&self) -> Option<Declared> {
        let Detail { range, is_long } = self.detail;
        Some(Declared { of: self.of.elementary()?, range, values: self.values.clone(), is_long })
    }

    /// The value in a state as it is written in IEC 61131-3; nothing where it has parts, or where the state ends before it.
    pub fn text(&self, state: &[u64]) -> Option<String> {
        if let Some(((_, stored), declared)) = self.stored(state).zip(self.declared()) {
            return Some(declared.text(stored));
        }
        let Type::Text(capacity) = self.of else {
            return None;
        };
        let slots = state.get(usize::try_from(self.address / 64).ok()?..)?;
        let (length, bytes) = slots.split_first()?;
        let bytes = bytes.iter().flat_map(|slot| slot.to_le_bytes());
        let length = usize::try_from(*length).unwrap_or(usize::MAX).min(usize::from(capacity));
        let bytes: Vec<u8> = bytes.take(length).collect();
        Some(text_literal(&bytes, false))
    }

    /// The value in a state, as it is stored; nothing where it has parts, or where the state ends before it.
    pub fn stored(&self, state: &[u64]) -> Option<(Elementary, u64)> {
        let of = self.of.elementary()?;
        let slot = usize::try_from(self.address / 64).ok()?;
        Some((of, state.get(slot)? >> (self.address % 64) & of.mask()))
    }
}

impl Elementary {
    /// A stored value in the notation of IEC 61131-3, such as `2.5`, `TRUE`, `T#1s`.
    pub fn text(self, stored: u64) -> String {
        number_text::write(self, stored)
    }

    /// The stored value of a date, a time of day or both as [`Self::text`] writes it, with its keyword, its short form or none before the `#`.
    pub fn moment(self, text: &str) -> Option<u64> {
        let text = text.to_ascii_uppercase();
        // The long types have the same values.
        let is_long = text.starts_with('L') && text.contains('#');
        let text = if is_long { &text[1..] } else { &text };
        let stored = number_text::read(self, text.as_bytes());
        let written = self.text(stored);
        let (_, bare) = written.split_once('#')?;
        let keyword = format!("{self}#{bare}");
        let is_written = [written.as_str(), bare, &keyword].contains(&text);
        (is_written && Declared::from(self).has(stored)).then_some(stored)
    }
}

impl Program {
    /// How a value of an elementary or enumerated type is declared; nothing for a type with parts.
    pub fn declared(&self, of: &Type) -> Option<Declared> {
        Some(Declared { values: self.values_of(of), ..of.elementary()?.into() })
    }

    fn values_of(&self, of: &Type) -> Option<Arc<Enumeration>> {
        match of {
            Type::Enumeration(id, _) => self.enumerations.get(id.0 as usize).cloned(),
            _ => None,
        }
    }

    fn new_part(&self, name: String, of: Type, address: u64) -> Part {
        Part { values: self.values_of(&of), detail: self.detail(&name), name, of, address }
    }

    /// What the declaration of a variable or of a part says besides the type.
    fn detail(&self, name: &str) -> Detail {
        if self.details.is_empty() {
            return Detail::default();
        }
        let mut pieces = name.split('[');
        let mut key = pieces.next().unwrap_or_default().to_owned();
        for piece in pieces {
            let (_, rest) = piece.split_once(']').unwrap_or_default();
            key = key + "[]" + rest;
        }
        self.details.get(&key).copied().unwrap_or_default()
    }

    /// A type as it is written; `a structure` and `an enumeration of INT` where it has no name.
    pub fn type_name(&self, of: &Type) -> String {
        match of {
            Type::Elementary(elementary) => elementary.name().to_owned(),
            Type::Enumeration(id, elementary) => match self.enumerations.get(id.0 as usize) {
                Some(found) if !found.name.is_empty() => found.name.clone(),
                _ => format!("an enumeration of {elementary}"),
            },
            Type::Text(capacity) => format!("STRING[{capacity}]"),
            Type::Array(array) => {
                let ranges = array.ranges.iter().map(|(low, high)| format!("{low}..{high}"));
                let ranges: Vec<String> = ranges.collect();
                let element = self.type_name(&array.element);
                format!("ARRAY [{}] OF {element}", ranges.join(", "))
            }
            Type::Structure(id, _) => match self.structures.get(id.0 as usize) {
                Some(found) if !found.name.is_empty() => found.name.clone(),
                _ => "a structure".to_owned(),
            },
        }
    }

    /// The variable, or the part of one, that lies at an address of the state. Of an address within a text, the text.
    pub fn part_at(&self, address: u64) -> Option<Part> {
        let slot = address / 64;
        let holds = |first: u32, of: &Type| {
            let first = u64::from(first);
            (first..first.saturating_add(of.slots())).contains(&slot)
        };
        let mut variables = self.variables.iter();
        let variable = variables.find(|variable| holds(variable.slot, &variable.of))?;
        self.part_of(variable, address)
    }

    /// The part of a variable that lies at an address.
    fn part_of(&self, variable: &Variable, address: u64) -> Option<Part> {
        let first = 64 * u64::from(variable.slot);
        let mut part = self.new_part(variable.name.clone(), variable.of.clone(), first);
        loop {
            let within = address - part.address;
            match part.of.clone() {
                Type::Structure(id, _) => {
                    let fields = &self.structures.get(id.0 as usize)?.fields;
                    let field = fields.iter().find(|field| {
                        let first = u64::from(field.slot);
                        let slots = if field.is_reference { 1 } else { field.of.slots() };
                        (first..first.saturating_add(slots)).contains(&(within / 64))
                    })?;
                    // What lies there is an address, and the variable elsewhere.
                    if field.is_reference {
                        return None;
                    }
                    part.name = format!("{}.{}", part.name, field.name);
                    part.of = field.of.clone();
                    part.address += 64 * u64::from(field.slot);
                }
                Type::Array(array) => {
                    let element = within / array.stride().max(1);
                    part.name += &indices(&array, element)?;
                    part.address += element * array.stride();
                    part.of = array.element.clone();
                }
                _ => return Some(self.new_part(part.name, part.of, part.address)),
            }
        }
    }

    /// A variable or a part of it by its parts without parts, in the order of memory; references are left out, and so is what is behind `most` parts.
    pub fn leaves(&self, part: Part, most: usize) -> Vec<Part> {
        let mut leaves = Vec::new();
        self.add_leaves(part, most, &mut leaves);
        leaves
    }

    fn add_leaves(&self, part: Part, most: usize, leaves: &mut Vec<Part>) {
        if leaves.len() >= most {
            return;
        }
        match &part.of {
            Type::Structure(id, _) => {
                let found = self.structures.get(id.0 as usize);
                let fields = found.iter().flat_map(|found| &found.fields);
                for field in fields.filter(|field| !field.is_reference) {
                    let name = format!("{}.{}", part.name, field.name);
                    let address = part.address + 64 * u64::from(field.slot);
                    let part = self.new_part(name, field.of.clone(), address);
                    self.add_leaves(part, most, leaves);
                }
            }
            Type::Array(array) => {
                let elements = (0..).map_while(|element| Some((element, indices(array, element)?)));
                for (element, indices) in elements.take(most) {
                    let name = format!("{}{indices}", part.name);
                    let address = part.address + element * array.stride();
                    let part = self.new_part(name, array.element.clone(), address);
                    self.add_leaves(part, most, leaves);
                }
            }
            _ => leaves.push(part),
        }
    }

    /// The variable or the part of a name, in any case of letters: `level`, `pid.integral`, `table[3]`, or an address such as `%QW4`.
    pub fn part(&self, name: &str) -> Option<Part> {
        let is = |known: &str| known.eq_ignore_ascii_case(name);
        let addressed = |address: &Option<String>| address.as_deref().is_some_and(is);
        let variables = || self.variables.iter();
        // The names of a ladder may differ in their case alone.
        let same = variables().find(|variable| variable.name == name);
        let other = || variables().find(|known| is(&known.name) || addressed(&known.address));
        let whole = same.or_else(other);
        let within = || {
            let found = variables().filter(|known| is_within_in_any_case(name, &known.name));
            found.max_by_key(|known| (known.name.len(), name.starts_with(&known.name)))
        };
        let variable = whole.or_else(within)?;
        let first = 64 * u64::from(variable.slot);
        let mut part = self.new_part(variable.name.clone(), variable.of.clone(), first);
        let mut rest = match whole {
            Some(_) => "",
            None => &name[variable.name.len()..],
        };
        while !rest.is_empty() {
            match part.of.clone() {
                Type::Structure(id, _) => {
                    let after = rest.strip_prefix('.')?;
                    let end = after.find(['.', '[']).unwrap_or(after.len());
                    let fields = &self.structures.get(id.0 as usize)?.fields;
                    let mut fields = fields.iter();
                    let field = fields.find(|field| {
                        !field.is_reference && field.name.eq_ignore_ascii_case(&after[..end])
                    })?;
                    part.name = format!("{}.{}", part.name, field.name);
                    part.of = field.of.clone();
                    part.address += 64 * u64::from(field.slot);
                    rest = &after[end..];
                }
                Type::Array(array) => {
                    let (inside, after) = rest.strip_prefix('[')?.split_once(']')?;
                    let element = element(&array, inside)?;
                    part.name += &indices(&array, element)?;
                    part.address += element * array.stride();
                    part.of = array.element.clone();
                    rest = after;
                }
                _ => return None,
            }
        }
        Some(self.new_part(part.name, part.of, part.address))
    }
}

/// The parts of a program by their addresses, for many questions.
#[derive(Debug)]
pub struct Parts<'p> {
    program: &'p Program,
    /// For each slot of the state the variable that holds it.
    holders: Vec<Option<&'p Variable>>,
}

impl<'p> Parts<'p> {
    /// An index of the slots of a program.
    pub fn new(program: &'p Program) -> Self {
        let mut holders = vec![None; program.state as usize];
        // Of several that share a slot, the first one.
        for variable in program.variables.iter().rev() {
            let first = variable.slot as usize;
            let behind = first.saturating_add(variable.of.slots() as usize).min(holders.len());
            if let Some(slots) = holders.get_mut(first..behind) {
                slots.fill(Some(variable));
            }
        }
        Self { program, holders }
    }

    /// As [`Program::part_at`].
    pub fn at(&self, address: u64) -> Option<Part> {
        let variable = (*self.holders.get((address / 64) as usize)?)?;
        self.program.part_of(variable, address)
    }
}

/// The indices of an element, `[3]` or `[1,2]`.
pub fn indices(array: &Array, element: u64) -> Option<String> {
    if element >= array.length() {
        return None;
    }
    let mut rest = element;
    let mut texts = Vec::new();
    for &(low, high) in array.ranges.iter().rev() {
        let length = high.abs_diff(low).saturating_add(1);
        texts.push(low.saturating_add_unsigned(rest % length).to_string());
        rest /= length;
    }
    texts.reverse();
    Some(format!("[{}]", texts.join(",")))
}

/// The element of indices such as `3` or `1, 2`.
fn element(array: &Array, indices: &str) -> Option<u64> {
    let indices: Vec<i64> =
        indices.split(',').map(|index| index.trim().parse().ok()).collect::<Option<_>>()?;
    if indices.len() != array.ranges.len() {
        return None;
    }
    let mut element = 0u64;
    for (&index, &(low, high)) in indices.iter().zip(&array.ranges) {
        let is_inside = (low..=high).contains(&index);
        let length = high.abs_diff(low).saturating_add(1);
        element = element.checked_mul(length)?.checked_add(index.abs_diff(low))?;
        if !is_inside {
            return None;
        }
    }
    Some(element)
}
