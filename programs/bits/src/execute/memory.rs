//! Places of a program: their addresses, and what is stored and loaded there.

use understudy_typed::{Elementary, Place, Program, Root, Type};

use super::{ALTERNATIVES, Context, Execution, Result, Value};
use crate::term::Term;

impl Execution<'_> {
    /// The only address of a place.
    pub(super) fn address(&mut self, context: Context, place: &Place) -> Result<u64> {
        match self.places(context, place)?.as_slice() {
            &[(_, address)] => Ok(address),
            _ => self.unsupported(context, "a reference to an element with a computed index"),
        }
    }

    /// The addresses that a place may mean, each with its condition; an index out of range is a fault.
    pub(super) fn places(&mut self, context: Context, place: &Place) -> Result<Vec<(Term, u64)>> {
        let frames = u64::from(self.program.state);
        let root = match place.root {
            Root::Global(slot) => 64 * u64::from(slot),
            Root::Own(slot) => 64 * (context.own + u64::from(slot)),
            Root::Frame(slot) => 64 * (frames + u64::from(slot)),
            Root::OwnReference(slot) => self.reference(context, context.own + u64::from(slot))?,
            Root::FrameReference(slot) => self.reference(context, frames + u64::from(slot))?,
        };
        let first = root + 64 * u64::from(place.offset) + u64::from(place.bit);
        let yes = self.terms.boolean(true);
        let mut places = vec![(yes, first)];
        for index in &place.indices {
            let value = self.number(context, &index.value)?;
            let inside = self.between(value, index.low.into(), index.high.into());
            let outside = self.terms.not(inside);
            let (low, high) = (index.low, index.high);
            self.fault(outside);
            if let Some(known) = self.terms.value(value) {
                // A known index outside is a fault: any place serves.
                let known = (known as i64).clamp(low, high);
                for place in &mut places {
                    place.1 += known.abs_diff(low) * index.stride;
                }
                continue;
            }
            let count = usize::try_from(high.abs_diff(low)).map_or(usize::MAX, |last| last + 1);
            if count.saturating_mul(places.len()) > ALTERNATIVES {
                return self.unsupported(context, "an array too large for a computed index");
            }
            let mut further = Vec::with_capacity(count * places.len());
            for &(condition, address) in &places {
                for element in low..=high {
                    let here = self.terms.equals(value, element as u64);
                    let condition = self.terms.and(condition, here);
                    further.push((condition, address + element.abs_diff(low) * index.stride));
                }
            }
            places = further;
        }
        Ok(places)
    }

    pub(super) fn reference(&mut self, context: Context, slot: u64) -> Result<u64> {
        let address = self.get(64 * slot, Elementary::Lword);
        match self.terms.value(address) {
            Some(0) => {
                let yes = self.terms.boolean(true);
                self.fault(yes);
                Ok(64 * u64::from(Program::HEADER))
            }
            Some(address) => Ok(address),
            None => self.unsupported(context, "a VAR_IN_OUT variable that changes"),
        }
    }

    pub(super) fn store(&mut self, context: Context, place: &Place, value: Value) -> Result<()> {
        let places = self.places(context, place)?;
        if matches!(value, Value::Text) {
            if matches!(place.of, Type::Text(_)) {
                let long = self.terms.unknown(Elementary::Bool);
                self.fault(long);
            }
            return Ok(());
        }
        let single = places.len() == 1;
        for (condition, address) in places {
            let parts = match &value {
                Value::Number(number) => vec![(0, *number)],
                Value::Parts(parts) => parts.clone(),
                Value::Text => Vec::new(),
            };
            for (offset, value) in parts {
                let of = self.terms.of(value);
                let value = if single {
                    value
                } else {
                    let before = self.get(address + offset, of);
                    self.terms.choose(condition, value, before)
                };
                self.timers.written(address + offset);
                self.set(address + offset, value);
            }
        }
        Ok(())
    }

    /// What is stored at an address.
    pub(super) fn load(&mut self, address: u64, of: &Type) -> Value {
        if let Some(of) = of.elementary() {
            return Value::Number(self.typed(address, of));
        }
        if matches!(of, Type::Text(_)) {
            return Value::Text;
        }
        let mut parts = Vec::new();
        self.leaves(0, of, &mut parts);
        let parts = parts.into_iter();
        Value::Parts(parts.map(|(offset, of)| (offset, self.typed(address + offset, of))).collect())
    }

    /// The number at an address as one of type `of`, which has the width of what was stored there.
    pub(super) fn typed(&mut self, address: u64, of: Elementary) -> Term {
        self.timers.read(address);
        let stored = self.get(address, of);
        self.terms.as_type(stored, of)
    }

    /// The parts of a type that are numbers, counted in bits from its start.
    pub(super) fn leaves(&self, first: u64, of: &Type, parts: &mut Vec<(u64, Elementary)>) {
        match of {
            Type::Elementary(of) | Type::Enumeration(_, of) => parts.push((first, *of)),
            Type::Text(_) => {}
            Type::Array(array) => {
                for element in 0..array.length() {
                    self.leaves(first + element * array.stride(), &array.element, parts);
                }
            }
            Type::Structure(id, _) => {
                for field in &self.program.structures[id.0 as usize].fields {
                    let first = first + 64 * u64::from(field.slot);
                    if field.is_reference {
                        parts.push((first, Elementary::Lword));
                    } else {
                        self.leaves(first, &field.of, parts);
                    }
                }
            }
        }
    }
}
