//! Initial values of variables, whatever their type.

use understudy_typed::{Array, Type};

use crate::syntax::{Expression, Initializer, Name, Span};

use super::Lowering;
use super::images::{Builder, Image};
use super::names::Constant;
use super::standard_blocks::CYCLE;
use super::types::Resolved;

impl Lowering<'_> {
    /// The initial content of a variable of a type.
    pub(super) fn initial_image(
        &mut self,
        initial: &Initializer,
        resolved: &Resolved,
    ) -> Option<Image> {
        let mut image = Builder::of(&resolved.image);
        self.initialize(initial, (&resolved.of, resolved.range), 0, &mut image)?;
        Some(image.done())
    }

    fn initialize(
        &mut self,
        initial: &Initializer,
        (of, range): (&Type, Option<(i128, i128)>),
        bit: u64,
        image: &mut Builder,
    ) -> Option<()> {
        match (initial, of) {
            (Initializer::Value(value), Type::Array(_) | Type::Structure(..)) => {
                let wanted = self.describe(of);
                let message = format!("an initial value of {wanted} is expected");
                let help = match of {
                    Type::Array(_) => "write the elements in brackets, such as `[1, 2, 8(0)]`",
                    _ => "write the parts, such as `(speed := 5, run := TRUE)`",
                };
                self.error_with("U1043", message, value.span.clone(), help);
                None
            }
            (Initializer::Value(value), _) => self.initial_value(value, (of, range), bit, image),
            (Initializer::Array(entries, span), Type::Array(array)) => {
                let mut at = 0;
                self.entries(entries, (array, range), bit, &mut at, image, span)
            }
            (Initializer::Structure(parts, span), Type::Structure(id, _)) => {
                let info = self.structures[id.0 as usize].clone();
                for (name, part) in parts {
                    let Some(&field) = info.fields.get(&name.key()) else {
                        self.no_such_part(name, of);
                        return None;
                    };
                    self.sets_cycle |= name.is(CYCLE);
                    let field = self.program.structures[id.0 as usize].fields[field].clone();
                    if field.is_reference {
                        let message = format!("`{name}` is a VAR_IN_OUT and has no initial value");
                        self.error("U1043", message, span.clone());
                        return None;
                    }
                    let of = (&field.of, info.ranges.get(&field.slot).copied());
                    self.initialize(part, of, bit + u64::from(field.slot) * 64, image)?;
                }
                Some(())
            }
            (Initializer::Array(_, span) | Initializer::Structure(_, span), _) => {
                let wanted = self.describe(of);
                let message = format!("an initial value of {wanted} is expected");
                self.error("U1043", message, span.clone());
                None
            }
        }
    }

    fn initial_value(
        &mut self,
        value: &Expression,
        (of, range): (&Type, Option<(i128, i128)>),
        bit: u64,
        image: &mut Builder,
    ) -> Option<()> {
        match self.constant_of(value, of)? {
            Constant::Number(of, stored) => {
                let of = of.elementary()?;
                let initial = of.signed(stored);
                if let Some((low, high)) = range
                    && !(low..=high).contains(&initial)
                {
                    let message =
                        format!("the initial value {initial} is outside the range {low}..{high}");
                    let help = "write a value of the range, or a wider range";
                    self.error_with("U1036", message, value.span.clone(), help);
                    return None;
                }
                image.set(bit, of.bits(), stored);
            }
            Constant::Text(capacity, bytes) => {
                image.put(bit, &Type::Text(capacity), &super::images::zero());
                image.text(bit, &bytes);
            }
        }
        Some(())
    }

    /// Elements from `at` on; repetitions are made here.
    fn entries(
        &mut self,
        entries: &[(Option<Expression>, Vec<Initializer>)],
        (array, range): (&Array, Option<(i128, i128)>),
        bit: u64,
        at: &mut u64,
        image: &mut Builder,
        span: &Span,
    ) -> Option<()> {
        for (times, values) in entries {
            let times = match times {
                Some(times) => {
                    let value = self.constant_integer(times)?;
                    match u64::try_from(value) {
                        Ok(value) if value <= array.length() => value,
                        _ => {
                            let message = format!(
                                "{value} repetitions; the array has {} elements",
                                array.length()
                            );
                            self.error("U1036", message, times.span.clone());
                            return None;
                        }
                    }
                }
                None => 1,
            };
            if values.is_empty() {
                *at += times;
            }
            for _ in 0..times {
                if values.is_empty() {
                    break;
                }
                for value in values {
                    self.element(value, (array, range), bit, at, image, span)?;
                }
            }
        }
        Some(())
    }

    fn element(
        &mut self,
        value: &Initializer,
        (array, range): (&Array, Option<(i128, i128)>),
        bit: u64,
        at: &mut u64,
        image: &mut Builder,
        span: &Span,
    ) -> Option<()> {
        // Rows of an array of several dimensions may stand in brackets of their own.
        if let (Initializer::Array(entries, span), false) =
            (value, matches!(array.element, Type::Array(_)))
        {
            return self.entries(entries, (array, range), bit, at, image, span);
        }
        if *at >= array.length() {
            let message =
                format!("more initial values than the array has elements: {}", array.length());
            self.error("U1036", message, span.clone());
            return None;
        }
        let of = (&array.element, range);
        self.initialize(value, of, bit + *at * array.stride(), image)?;
        *at += 1;
        Some(())
    }

    /// Reports a part that a structure or block does not have.
    pub(super) fn no_such_part(&mut self, name: &Name, of: &Type) {
        let mut help = "check the type of the variable".to_owned();
        if let Type::Structure(id, _) = of {
            let unit = self.structures[id.0 as usize].unit;
            let unit = unit.map(|unit| self.units[unit].unit);
            let mut declared = unit.into_iter().flat_map(|unit| &unit.declarations);
            // It has no place, because its type is not known.
            if declared.any(|found| found.name == *name) && self.follows_an_error() {
                return;
            }
            let fields = &self.program.structures[id.0 as usize].fields;
            let shown = fields.iter().map(|field| field.name.as_str());
            help = understudy_text::spelling::suggestion(
                name.as_str(),
                shown.filter(|name| !name.contains('.')),
            );
            if let Some(other) =
                self.structures[id.0 as usize].unit.and_then(|unit| self.counterpart(unit))
            {
                help = format!("{help}; {other}");
            }
        }
        let whole = self.describe(of);
        let message = format!("{whole} has no part `{name}`");
        self.error_with("U1041", message, name.span(), help);
    }
}
