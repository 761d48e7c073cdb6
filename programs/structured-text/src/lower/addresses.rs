//! Variables at addresses: `%I` is an input point, `%Q` an output point, `%M` memory.

use std::rc::Rc;
use std::sync::Arc;

use understudy_typed::{Array, Declared, Elementary, Root, Type, indices};

use crate::syntax::{Class, Declaration, Name, Retention, Span};

use super::Lowering;
use super::images::initial;
use super::names::{Symbol, Variable};
use super::types::Resolved;

/// Points that one variable may have.
const MAXIMUM_POINTS: u64 = 1_000;

/// Points of a variable.
pub(super) enum Points {
    /// One, with its name, its declaration and its slot.
    One(String, Declared, u32),
    /// Those of the elements of an array at a slot, which share its slots.
    Elements(String, Arc<Array>, Declared, u32),
}

impl Points {
    fn count(&self) -> u64 {
        match self {
            Self::One(..) => 1,
            Self::Elements(_, array, ..) => array.length(),
        }
    }
}

/// A part of the inputs, the outputs or the memory, counted in two ways: by the size in the address, as CODESYS counts, and by bytes, as Siemens
/// counts.
#[derive(Clone)]
struct Part {
    /// I, Q or M.
    area: char,
    /// The levels in front of the last one, which tell modules apart.
    levels: Vec<u64>,
    bits: u64,
    ranges: [(u64, u64); 2],
}

impl Part {
    /// The part of `size` bits at an address such as `%MW3`, or of the size in the address; nothing for an incomplete address.
    fn of(address: &str, size: Option<u64>) -> Option<Self> {
        let key = normal(address);
        let area = key.chars().nth(1).filter(|area| matches!(area, 'I' | 'Q' | 'M'))?;
        let numbers: Result<Vec<u64>, _> = key.get(3..)?.split('.').map(str::parse).collect();
        let mut levels = numbers.ok()?;
        let last = levels.pop()?;
        let bits = bits_of(&key).map_or(1, u64::from);
        let length = size.map_or(bits, |size| bits.max(size));
        let starts = match bits {
            // A bit has its byte in front.
            1 => {
                let byte = levels.pop().unwrap_or(0);
                [byte.saturating_mul(8).saturating_add(last); 2]
            }
            _ => [last.saturating_mul(bits), last.saturating_mul(8)],
        };
        let ranges = starts.map(|start| (start, start.saturating_add(length)));
        Some(Self { area, levels, bits, ranges })
    }

    fn overlaps(&self, other: &Self) -> bool {
        let meet = |at: usize| {
            let ((start, end), (from, to)) = (self.ranges[at], other.ranges[at]);
            start < to && from < end
        };
        // Addresses of one size are counted in that size.
        (self.area, &self.levels) == (other.area, &other.levels)
            && (meet(0) || self.bits != other.bits && meet(1))
    }
}

/// Whether two addresses such as `%MW0` and `%MX0.3` can be one memory.
pub fn share_bits(one: &str, other: &str) -> bool {
    let parts = Part::of(one, None).zip(Part::of(other, None));
    parts.is_some_and(|(one, other)| one.overlaps(&other))
}

/// A variable at an address, and its part of the memory.
#[derive(Clone)]
pub(super) struct Extent {
    name: String,
    address: String,
    span: Span,
    /// A warning about it is reported already.
    is_told: bool,
    part: Part,
}

impl Lowering<'_> {
    /// A variable at an address: `%I` is an input point, `%Q` an output point, `%M` memory.
    pub(super) fn located(&mut self, declaration: &Declaration, resolved: &Resolved) -> Symbol {
        let symbol = self.located_at(declaration, resolved).unwrap_or(Symbol::Faulty);
        if let Symbol::Variable(variable) = &symbol
            && let (Root::Global(slot), false) = (variable.root, variable.is_point)
        {
            self.keep(declaration.retention, &variable.of.clone(), slot);
        }
        symbol
    }

    /// Keeps what a retentive program declares at addresses, of which it does not say anything else.
    pub(super) fn keep_located(&mut self, declarations: &[Declaration]) {
        let unstated = |it: &&Declaration| it.retention == Retention::Unstated && !it.constant;
        for declaration in declarations.iter().filter(unstated) {
            let key = declaration.address.as_ref().map(|address| normal(address.as_str()));
            if let Some(Symbol::Variable(variable)) =
                key.and_then(|key| self.addresses.get(&key)).cloned()
                && let (Root::Global(slot), false) = (variable.root, variable.is_point)
            {
                self.keep(Retention::Retained, &variable.of.clone(), slot);
            }
        }
    }

    fn located_at(&mut self, declaration: &Declaration, resolved: &Resolved) -> Option<Symbol> {
        let address = declaration.address.as_ref()?;
        let name = &declaration.name;
        let key = normal(address.as_str());
        // An incomplete address is one of its own.
        let key = match key.contains('*') {
            true => format!("{key} {}", name.key()),
            false => key,
        };
        self.is_no_element(name, address, &key)?;
        if let Some(known) = self.addresses.get(&key).cloned() {
            if let Symbol::Variable(first) = &known
                && first.of != resolved.of
            {
                let (own, other) = (self.describe(&resolved.of), self.describe(&first.of));
                let message =
                    format!("`{name}` is {own} at {address}, where `{}` is {other}", first.name);
                let found = understudy_text::Diagnostic::error("U1083", message, address.span());
                let found = found.with_related(first.span.clone(), "declared here");
                self.report(found.with_help("give both one type, or two addresses"));
                return None;
            }
            return Some(known);
        }
        let symbol = self.at_address(name, address, resolved).unwrap_or(Symbol::Faulty);
        self.addresses.insert(key, symbol.clone());
        Some(symbol)
    }

    fn at_address(&mut self, name: &Name, address: &Name, resolved: &Resolved) -> Option<Symbol> {
        let kind = address.as_str().chars().nth(1).map(|kind| kind.to_ascii_uppercase());
        let is_input = kind == Some('I');
        let is_point = is_input || kind == Some('Q');
        if !is_point && kind != Some('M') {
            let message = format!("`{address}` is not an address");
            let help =
                "write an input such as %IX0.0, an output such as %QW3 or a memory such as %MD8";
            self.error_with("U1083", message, address.span(), help);
            return None;
        }
        if is_point && let Some(of) = element(&resolved.of) {
            return self.array_at(name, address, resolved, of, is_input);
        }
        let elementary = resolved.of.elementary();
        let mut points = Vec::new();
        let root = (&resolved.of, resolved.range);
        if is_point && self.points_of(root, (name.as_str(), 0), false, &mut points).is_err() {
            let found = self.describe(&resolved.of);
            let message = format!(
                "`{name}` at {address} is {found}; a point is a number, a bit or a time, or a structure of them"
            );
            let help = "declare each element as a variable with an address of its own";
            self.error_with("U1083", message, name.span(), help);
            return None;
        }
        if let Some(of) = elementary {
            self.fits_address(name, address, of);
        }
        self.overlap(name, address, resolved)?;
        let slot = self.state(resolved.of.slots(), &name.span())?;
        self.program.initial.extend(initial(&resolved.image, slot));
        for point in points {
            if let Points::One(shown, declared, offset) = point {
                self.point_at(shown, address, declared, slot + offset, is_input);
            }
        }
        Some(at_slot(name, slot, resolved, is_input))
    }

    /// A point, which has its address in its name where another point has that name.
    pub(super) fn point_at(
        &mut self,
        mut shown: String,
        address: &Name,
        declared: Declared,
        slot: u32,
        is_input: bool,
    ) {
        let known = self.points_mut(is_input);
        if known.iter().any(|point| point.name.eq_ignore_ascii_case(&shown)) {
            shown = format!("{shown} {address}");
        }
        known.push_declared(shown, declared, slot);
    }

    /// The points of a variable of this type and subrange: itself, or the parts of a structure and the elements of arrays; those of arrays whose
    /// elements share slots only `with_packed`. The type of the first part that can have none.
    pub(super) fn points_of(
        &self,
        (of, range): (&Type, Option<(i128, i128)>),
        (name, slot): (&str, u32),
        with_packed: bool,
        points: &mut Vec<Points>,
    ) -> Result<(), (String, Type)> {
        let refused = || Err((name.to_owned(), of.clone()));
        let known: u64 = points.iter().map(Points::count).sum();
        if known >= MAXIMUM_POINTS {
            return refused();
        }
        if let Some(declared) = self.program.declared(of) {
            points.push(Points::One(name.to_owned(), Declared { range, ..declared }, slot));
            return Ok(());
        }
        match of {
            Type::Structure(id, _) => {
                let info = &self.structures[id.0 as usize];
                if info.unit.is_some() {
                    return refused();
                }
                let mut fields = self.program.structures[id.0 as usize].fields.iter();
                fields.try_for_each(|field| {
                    let name = format!("{name}.{}", field.name);
                    let of = (&field.of, info.ranges.get(&field.slot).copied());
                    self.points_of(of, (&name, slot + field.slot), with_packed, points)
                })
            }
            Type::Array(array) if array.stride().is_multiple_of(64) => {
                let slots = (array.stride() / 64) as u32;
                (0..array.length()).try_for_each(|at| {
                    let Some(indices) = indices(array, at) else { return refused() };
                    let of = (&array.element, range);
                    let slot = slot + at as u32 * slots;
                    self.points_of(of, (&format!("{name}{indices}"), slot), with_packed, points)
                })
            }
            // Elements that share a slot have points that are copied.
            Type::Array(array) => {
                let declared = self.program.declared(&array.element).filter(|_| with_packed);
                let fits = known + array.length() <= MAXIMUM_POINTS;
                let Some(declared) = declared.filter(|_| fits) else {
                    return refused();
                };
                let declared = Declared { range, ..declared };
                points.push(Points::Elements(name.to_owned(), Arc::clone(array), declared, slot));
                Ok(())
            }
            _ => refused(),
        }
    }

    /// Refuses a memory that shares a part of another one: no two compilers agree on which. So does a point of the size of another one.
    pub(super) fn overlap(
        &mut self,
        name: &Name,
        address: &Name,
        resolved: &Resolved,
    ) -> Option<()> {
        let is_memory = normal(address.as_str()).starts_with("%M");
        let size = match (resolved.of.elementary(), element(&resolved.of)) {
            (Some(Elementary::Bool), _) => None,
            // Points of bits follow one another.
            (_, Some(Elementary::Bool)) if !is_memory => Some(self.bytes(&resolved.of)),
            _ => Some(self.bytes(&resolved.of).saturating_mul(8)),
        };
        let Some(part) = Part::of(address.as_str(), size) else {
            return Some(());
        };
        let extent = Extent {
            name: name.as_str().to_owned(),
            address: address.as_str().to_owned(),
            span: address.span(),
            is_told: false,
            part,
        };
        let other = self.extents.iter().position(|other| other.part.overlaps(&extent.part));
        let Some(other) = other else {
            self.extents.push(extent);
            return Some(());
        };
        // Points of one size are counted in that size everywhere.
        if extent.part.area != 'M' && extent.part.bits != self.extents[other].part.bits {
            self.warn_of_shared_bits(extent, other);
            return Some(());
        }
        let other = self.extents[other].clone();
        let message = format!(
            "`{name}` at {address} and, at {}, `{}` share a part of the memory",
            other.address, other.name
        );
        let found = understudy_text::Diagnostic::error("U1083", message, address.span());
        let found = found.with_related(other.span, "the other one");
        self.report(found.with_help(
            "give them addresses apart, or read a part of one variable, such as `word.3` or `word.%B1`",
        ));
        None
    }

    /// Warns of inputs or outputs of different sizes that are one in the memory of some controllers, and are points of their own in others and here.
    /// Once for each variable, so that a word has no warning for each of its bits.
    fn warn_of_shared_bits(&mut self, mut extent: Extent, other: usize) {
        let wider = if self.extents[other].part.bits > extent.part.bits {
            &mut self.extents[other]
        } else {
            &mut extent
        };
        if !std::mem::replace(&mut wider.is_told, true) {
            let points = if extent.part.area == 'I' { "inputs" } else { "outputs" };
            let other = &self.extents[other];
            let message = format!(
                "`{}` at {} and `{}` at {} share bits of the process image in the standard and in CODESYS; here they are two {points}, as in OpenPLC",
                extent.name, extent.address, other.name, other.address
            );
            let found = understudy_text::Diagnostic::warning("U1083", message, extent.span.clone());
            let found = found.with_related(other.span.clone(), "the other one");
            self.report(found.with_help(
                "where the program relies on shared bits, declare the wider variable alone and read or write its parts, such as `word.3`",
            ));
        }
        self.extents.push(extent);
    }

    /// Warns where the size in an address is not that of the variable.
    fn fits_address(&mut self, name: &Name, address: &Name, of: Elementary) {
        let Some(bits) = bits_of(&normal(address.as_str())) else {
            return;
        };
        if bits != of.bits() {
            let message = format!("`{name}` is {of}, and {address} has {bits} bits");
            let help = "the type counts: write the letter of its width, X, B, W, D or L";
            self.warn("U1083", message, address.span(), help);
        }
    }

    /// An address in a body.
    pub(super) fn direct(&mut self, address: &Name) -> Symbol {
        let key = normal(address.as_str());
        if self.is_no_element(address, address, &key).is_none() {
            return Symbol::Faulty;
        }
        if let Some(known) = self.addresses.get(&key) {
            return known.clone();
        }
        let of = match key.chars().nth(2) {
            Some('B') => Elementary::Byte,
            Some('W') => Elementary::Word,
            Some('D') => Elementary::Dword,
            Some('L') => Elementary::Lword,
            _ => Elementary::Bool,
        };
        let resolved: Resolved = Type::Elementary(of).into();
        let symbol = self.at_address(address, address, &resolved).unwrap_or(Symbol::Faulty);
        self.addresses.insert(key, symbol.clone());
        symbol
    }
}

/// The elements of an array of one dimension whose elements share slots.
fn element(of: &Type) -> Option<Elementary> {
    match of {
        Type::Array(array) if array.ranges.len() == 1 => array.element.elementary(),
        _ => None,
    }
}

/// A variable at an address, in a slot of the state.
pub(super) fn at_slot(name: &Name, slot: u32, resolved: &Resolved, is_input: bool) -> Symbol {
    Symbol::Variable(Rc::new(Variable {
        name: name.as_str().to_owned(),
        root: Root::Global(slot),
        of: resolved.of.clone(),
        class: Class::Local,
        is_constant: false,
        is_point: is_input,
        range: resolved.range,
        span: name.span(),
    }))
}

/// Bits of what the letter of an address says.
pub(super) fn bits_of(key: &str) -> Option<u32> {
    Some(match key.chars().nth(2)? {
        'X' => 1,
        'B' => 8,
        'W' => 16,
        'D' => 32,
        'L' => 64,
        _ => return None,
    })
}

/// An address in capitals, with the X that may be left out.
pub(super) fn normal(address: &str) -> String {
    let mut key = address.to_ascii_uppercase();
    if key.chars().nth(2).is_some_and(|digit| digit.is_ascii_digit()) {
        key.insert(2, 'X');
    }
    key
}
