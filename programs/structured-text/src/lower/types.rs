//! Types: names, arrays, structures, enumerations, subranges.

use std::collections::HashMap;
use std::rc::Rc;
use std::sync::Arc;

use understudy_text::spelling;
use understudy_typed::{
    Array, Elementary, Enumeration, EnumerationId, Field, Structure, StructureId, Type,
};

use crate::syntax::{self, Expression, Name, Retention, Span, TypeDefinition, TypeKind, TypeName};

use super::images::{Builder, Image, zero};
use super::{Lowering, MAXIMUM_SLOTS};

/// Bytes of a STRING that names no length.
pub(super) const DEFAULT_CAPACITY: u16 = 254;

/// A type with the initial content of its variables.
#[derive(Debug, Clone)]
pub(super) struct Resolved {
    pub(super) of: Type,
    pub(super) image: Image,
    /// The bounds of a subrange, or of that of an array's elements.
    pub(super) range: Option<(i128, i128)>,
}

impl Resolved {
    pub(super) fn new(of: Type, image: Image) -> Self {
        Self { of, image, range: None }
    }
}

impl From<Type> for Resolved {
    fn from(of: Type) -> Self {
        Self::new(of, zero())
    }
}

pub(super) enum TypeState<'a> {
    New(&'a TypeDefinition),
    Busy,
    Faulty,
    Done(Resolved),
}

/// What is known of a structure.
pub(super) struct StructureInfo {
    /// The fields by their names in capitals.
    pub(super) fields: HashMap<String, usize>,
    /// Bounds of the fields that are subranges, by their slots.
    pub(super) ranges: HashMap<u32, (i128, i128)>,
    /// What the declarations of its fields say of a loss of power, by their slots, where they say something.
    pub(super) retention: HashMap<u32, Retention>,
    /// Whether parts of it have a retention of their own.
    pub(super) is_mixed: bool,
    /// The unit whose memory it is.
    pub(super) unit: Option<usize>,
}

/// The elementary type of a name in capitals.
pub(super) fn elementary(key: &str) -> Option<Elementary> {
    Some(match key {
        "LTIME" => Elementary::Time,
        "LDATE" | "D" => Elementary::Date,
        "TOD" | "LTOD" | "LTIME_OF_DAY" => Elementary::TimeOfDay,
        "DT" | "LDT" | "LDATE_AND_TIME" => Elementary::DateAndTime,
        _ => {
            return Elementary::ALL.into_iter().find(|known| known.name() == key);
        }
    })
}

/// Blocks of Beremiz that Python or files of the controller answer.
fn is_extension(key: &str) -> bool {
    ["PYTHON_", "CSV_"].iter().any(|start| key.starts_with(start))
}

impl<'a> Lowering<'a> {
    /// The type of a declaration; `None` where an error is reported.
    pub(super) fn resolve(&mut self, name: &TypeName) -> Option<Resolved> {
        let before = self.blamed;
        let found = self.deeper(&name.span, |own| own.resolve_kind(name));
        self.accounted(before, found, &name.span)
    }

    fn resolve_kind(&mut self, name: &TypeName) -> Option<Resolved> {
        let resolved = match &name.kind {
            TypeKind::Named(named) => self.named_type(named)?,
            TypeKind::Subrange(base, low, high) => self.subrange(base, low, high)?,
            TypeKind::Text { length, .. } => self.text_type(length.as_deref())?,
            TypeKind::Array(ranges, element) => self.array_type(ranges, element, &name.span)?,
            TypeKind::OpenArray(..) => {
                let message = "an array of open bounds is permitted in VAR_IN_OUT and VAR_INPUT of functions only";
                let help = "write the bounds, such as `ARRAY [0..9] OF INT`";
                self.error_with("U1040", message, name.span.clone(), help);
                return None;
            }
            TypeKind::Structure(fields) => self.structure_type("", fields, &name.span)?,
            TypeKind::Enumeration(values, base) => self.enumeration("", values, base.as_ref())?,
            TypeKind::Pointer(_) => {
                let message = "pointers and references are not supported";
                let help = "pass the variable as VAR_IN_OUT";
                self.error_with("U1040", message, name.span.clone(), help);
                return None;
            }
        };
        if resolved.of.slots() > u64::from(MAXIMUM_SLOTS) {
            self.too_large(resolved.of.slots(), &name.span);
            return None;
        }
        Some(resolved)
    }

    fn named_type(&mut self, name: &Name) -> Option<Resolved> {
        let key = name.key();
        if let Some(state) = self.types.get_mut(&key) {
            match state {
                TypeState::Done(resolved) => return Some(resolved.clone()),
                TypeState::Faulty => {
                    self.blamed += 1;
                    return None;
                }
                TypeState::Busy => {
                    let message = format!("the type `{name}` contains itself");
                    self.error("U1047", message, name.span());
                    return None;
                }
                TypeState::New(definition) => {
                    let definition: &'a TypeDefinition = definition;
                    *state = TypeState::Busy;
                    let outside = self.leave_unit();
                    let resolved = self.define(definition);
                    self.scope = outside;
                    let state = match &resolved {
                        Some(resolved) => TypeState::Done(resolved.clone()),
                        None => TypeState::Faulty,
                    };
                    self.types.insert(key, state);
                    return resolved;
                }
            }
        }
        if let Some(elementary) = elementary(&key) {
            return Some(Type::Elementary(elementary).into());
        }
        if matches!(key.as_str(), "STRING" | "WSTRING") {
            return Some(Type::Text(DEFAULT_CAPACITY).into());
        }
        // What the libraries of TwinCAT call a text.
        if key == "T_MAXSTRING" && !self.unit_names.contains_key(&key) {
            return Some(Type::Text(255).into());
        }
        if let Some(&unit) = self.unit_names.get(&key) {
            let block = self.block_type(unit, name.span())?;
            return Some(block);
        }
        self.unknown_type(name);
        None
    }

    fn unknown_type(&mut self, name: &Name) {
        let key = name.key();
        let unsupported = match key.as_str() {
            "CHAR" | "WCHAR" => Some("use BYTE or STRING[1]"),
            _ if is_extension(&key) => {
                Some("it runs outside of the program: give what it answers as an input")
            }
            "RTC" => Some("read the date and time from an input point"),
            "VARIANT" | "ANY" | "POINTER" | "REF_TO" => Some("use a type of constant size"),
            _ if key.starts_with("ANY_") => Some("use a type of constant size"),
            _ => None,
        };
        if self.interfaces.contains(&key) {
            let blocks = self.units.iter().map(|entry| entry.unit);
            let mut blocks = blocks.filter(|unit| unit.implements.contains(name));
            let help = match blocks.next() {
                Some(block) => {
                    format!("declare it as a block that has it, such as `{}`", block.name)
                }
                None => "declare it as a block that has its methods".to_owned(),
            };
            let message = format!("a variable of the INTERFACE `{name}` is not supported");
            self.error_with("U1040", message, name.span(), help);
            return;
        }
        if let Some(help) = unsupported {
            let message = format!("the type {key} is not supported");
            self.error_with("U1040", message, name.span(), help);
            return;
        }
        let known = Elementary::ALL.iter().map(|known| known.name());
        let known = known.chain(self.types.keys().map(String::as_str));
        let known = known.chain(self.units.iter().map(|entry| entry.unit.name.as_str()));
        let help = spelling::question(name.as_str(), known)
            .unwrap_or_else(|| "declare it with TYPE or FUNCTION_BLOCK".to_owned());
        let message = format!("the type `{name}` is not declared");
        self.error_with("U1041", message, name.span(), help);
    }

    fn define(&mut self, definition: &TypeDefinition) -> Option<Resolved> {
        let name = definition.name.as_str();
        let mut resolved = match &definition.of.kind {
            TypeKind::Structure(fields) => {
                self.structure_type(name, fields, &definition.of.span)?
            }
            TypeKind::Enumeration(values, base) => self.enumeration(name, values, base.as_ref())?,
            _ => self.resolve(&definition.of)?,
        };
        if let Some(initial) = &definition.initial {
            resolved.image = self.initial_image(initial, &resolved)?;
        }
        Some(resolved)
    }

    fn subrange(&mut self, base: &Name, low: &Expression, high: &Expression) -> Option<Resolved> {
        let of = self.named_type(base)?.of;
        let elementary =
            of.elementary().filter(|found| found.is_integer() || found.is_bit_string());
        let Some(elementary) = elementary else {
            let message = format!("a subrange is one of an integer type; `{base}` is none");
            self.error("U1043", message, base.span());
            return None;
        };
        let span = low.span.start..high.span.end;
        let low = self.constant_integer(low)?;
        let high = self.constant_integer(high)?;
        let (least, most) = super::convert::limits(elementary);
        if low > high || low < least || high > most {
            let message = format!("the range {low}..{high} is empty or leaves {elementary}");
            let help = format!("write the lower bound first; {elementary} is {least}..{most}");
            self.error_with("U1036", message, span, help);
            return None;
        }
        let mut image = Builder::default();
        image.set(0, elementary.bits(), low as u64);
        Some(Resolved { range: Some((low, high)), ..Resolved::new(of, image.done()) })
    }

    fn text_type(&mut self, length: Option<&Expression>) -> Option<Resolved> {
        let Some(length) = length else {
            return Some(Type::Text(DEFAULT_CAPACITY).into());
        };
        let value = self.constant_integer(length)?;
        match u16::try_from(value) {
            Ok(capacity) if capacity > 0 => Some(Type::Text(capacity).into()),
            _ => {
                let message = format!("a STRING has 1 to 65535 characters, not {value}");
                self.error("U1036", message, length.span.clone());
                None
            }
        }
    }

    /// The ranges of an array.
    fn array_type(
        &mut self,
        written: &[(Expression, Expression)],
        element: &TypeName,
        span: &Span,
    ) -> Option<Resolved> {
        let element = self.resolve(element);
        let mut ranges = Vec::with_capacity(written.len());
        for (low, high) in written {
            let span = low.span.start..high.span.end;
            let (low, high) = (self.constant_integer(low), self.constant_integer(high));
            let (low, high) = (low?, high?);
            match (i64::try_from(low), i64::try_from(high)) {
                (Ok(low), Ok(high)) if low <= high => ranges.push((low, high)),
                _ => {
                    let message = format!("the bounds {low}..{high} of the array are empty");
                    self.error_with("U1036", message, span, "write the lower bound first");
                    return None;
                }
            }
        }
        let element = element?;
        let range = element.range;
        let array = Array { ranges, element: element.of };
        let (length, stride) = (array.length(), array.stride());
        let of = Type::Array(Arc::new(array));
        if of.slots() > u64::from(MAXIMUM_SLOTS) {
            self.too_large(of.slots(), span);
            return None;
        }
        let mut image = Builder::default();
        if !element.image.is_empty() {
            let Type::Array(array) = &of else { return None };
            for at in 0..length {
                image.put(at * stride, &array.element, &element.image);
            }
        }
        Some(Resolved { range, ..Resolved::new(of, image.done()) })
    }

    fn structure_type(
        &mut self,
        name: &str,
        declarations: &[syntax::Declaration],
        span: &Span,
    ) -> Option<Resolved> {
        let mut fields: Vec<Field> = Vec::new();
        let mut known = HashMap::new();
        let (mut ranges, mut retention) = (HashMap::new(), HashMap::new());
        let mut image = Builder::default();
        let mut slots: u64 = 0;
        let mut is_whole = true;
        for declaration in declarations {
            let Some(resolved) = self.declared_type(declaration) else {
                is_whole = false;
                continue;
            };
            if known.insert(declaration.name.key(), fields.len()).is_some() {
                let message =
                    format!("two parts of the structure are called `{}`", declaration.name);
                self.error("U1042", message, declaration.name.span());
                continue;
            }
            let start = slots;
            slots += resolved.of.slots();
            if slots > u64::from(MAXIMUM_SLOTS) {
                self.too_large(slots, span);
                return None;
            }
            image.put(start * 64, &resolved.of, &resolved.image);
            ranges.extend(resolved.range.map(|range| (start as u32, range)));
            // Only the blocks of declarations of a data block say it.
            if declaration.retention != syntax::Retention::Unstated {
                retention.insert(start as u32, declaration.retention);
            }
            fields.push(Field {
                name: declaration.name.as_str().to_owned(),
                of: resolved.of,
                slot: start as u32,
                is_reference: false,
            });
        }
        if !is_whole {
            return None;
        }
        let image = image.done();
        let id = self.add_structure(
            Structure { name: name.to_owned(), fields },
            StructureInfo { fields: known, ranges, retention, is_mixed: false, unit: None },
        );
        Some(Resolved::new(Type::Structure(id, slots as u32), image))
    }

    pub(super) fn add_structure(
        &mut self,
        structure: Structure,
        mut info: StructureInfo,
    ) -> StructureId {
        info.is_mixed = !info.retention.is_empty() || self.has_mixed(&structure);
        let id = StructureId(self.structures.len() as u32);
        self.program.structures.push(structure);
        self.structures.push(Rc::new(info));
        id
    }

    /// The type of a declaration with its own initial value in the image.
    pub(super) fn declared_type(&mut self, declaration: &syntax::Declaration) -> Option<Resolved> {
        let mut resolved = self.resolve(&declaration.of)?;
        if let Some(initial) = &declaration.initial {
            resolved.image = self.initial_image(initial, &resolved)?;
        }
        Some(resolved)
    }

    fn enumeration(
        &mut self,
        name: &str,
        values: &[(Name, Option<Expression>)],
        base: Option<&Name>,
    ) -> Option<Resolved> {
        let elementary = match base {
            Some(base) => {
                let found = self.named_type(base)?.of.elementary();
                match found.filter(|of| super::convert::is_whole(*of)) {
                    Some(found) => found,
                    None => {
                        let message = format!(
                            "an enumeration has values of an integer type; `{base}` is none"
                        );
                        self.error("U1043", message, base.span());
                        return None;
                    }
                }
            }
            None => Elementary::Int,
        };
        let id = EnumerationId(self.program.enumerations.len() as u32);
        // Known at once, so that values may name each other.
        self.program
            .enumerations
            .push(Arc::new(Enumeration { name: name.to_owned(), values: Vec::new() }));
        let mut next: i128 = 0;
        let (least, most) = super::convert::limits(elementary);
        for (value_name, value) in values {
            if let Some(value) = value {
                next = self.constant_integer(value)?;
            }
            let Some(value) = i64::try_from(next).ok().filter(|_| next >= least && next <= most)
            else {
                let message = format!("the value {next} of `{value_name}` leaves {elementary}");
                self.error("U1036", message, value_name.span());
                return None;
            };
            let enumeration = &self.program.enumerations[id.0 as usize];
            let mut known = enumeration.values.iter();
            if known.any(|(known, _)| known.eq_ignore_ascii_case(value_name.as_str())) {
                let message = format!("the value `{value_name}` is declared twice");
                let help = "remove or rename one of them";
                self.error_with("U1042", message, value_name.span(), help);
                continue;
            }
            let enumeration = &mut self.program.enumerations[id.0 as usize];
            Arc::make_mut(enumeration).values.push((value_name.as_str().to_owned(), value));
            let known = self.enumerators.entry(value_name.key()).or_default();
            known.push((id, elementary, value));
            next += 1;
        }
        let first = self.program.enumerations[id.0 as usize].values.first();
        let first = first.map_or(0, |(_, value)| *value);
        let mut image = Builder::default();
        image.set(0, elementary.bits(), first as u64);
        Some(Resolved::new(Type::Enumeration(id, elementary), image.done()))
    }
}
