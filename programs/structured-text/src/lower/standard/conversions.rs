//! Conversions: `X_TO_Y`, `TO_Y`, `TRUNC`, binary coded decimals.
//!
//! A TIME or TIME_OF_DAY as a number is one of milliseconds, a DATE or DATE_AND_TIME one of seconds, as in CODESYS, TwinCAT and
//! Siemens controllers; the long types (LTIME, …) are numbers of nanoseconds. Between DWORD and REAL, and LWORD and LREAL, the
//! bits are taken, as the third edition of the standard has it.

use understudy_typed::{Elementary, Expression, Operation, TextOperation, Type};

use crate::syntax;

use super::{Lowering, lint};
use crate::lower::convert::{as_bits, as_integer, is_whole, takes_bits};
use crate::lower::fold::{apply, convert, reinterpret, text};
use crate::lower::types::{DEFAULT_CAPACITY, elementary};

/// Nanoseconds of a day.
const DAY: i64 = 86_400_000_000_000;

/// Characters of a number that is written out.
const NUMBER_CAPACITY: u16 = 80;

/// One end of a conversion.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::lower) enum End {
    /// A type, and how many nanoseconds its numbers count where it is a time.
    Elementary(Elementary, i64),
    Text,
}

/// A conversion as its name says.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Conversion {
    Plain(Option<End>, End),
    Truncate(Option<Elementary>, Option<Elementary>),
    FromBcd(Option<Elementary>, Elementary),
    ToBcd(Option<Elementary>, Option<Elementary>),
}

fn end(name: &str) -> Option<End> {
    if matches!(name, "STRING" | "WSTRING") {
        return Some(End::Text);
    }
    let found = elementary(name)?;
    let unit = match (found, name) {
        (_, "LTIME" | "LDATE" | "LTOD" | "LTIME_OF_DAY" | "LDT" | "LDATE_AND_TIME") => 1,
        (Elementary::Time | Elementary::TimeOfDay, _) => 1_000_000,
        _ => 1_000_000_000,
    };
    Some(End::Elementary(found, unit))
}

impl Conversion {
    /// The conversion of a name in capitals.
    pub(super) fn of(key: &str) -> Option<Self> {
        if key == "TRUNC" {
            return Some(Self::Truncate(None, None));
        }
        if let Some(to) = key.strip_prefix("TRUNC_") {
            return Some(Self::Truncate(None, Some(elementary(to)?)));
        }
        if let Some((from, to)) = key.split_once("_TRUNC_") {
            return Some(Self::Truncate(Some(elementary(from)?), Some(elementary(to)?)));
        }
        if let Some((from, to)) = key.split_once("_BCD_TO_") {
            return Some(Self::FromBcd(Some(elementary(from)?), elementary(to)?));
        }
        if let Some(to) = key.strip_prefix("BCD_TO_") {
            return Some(Self::FromBcd(None, elementary(to)?));
        }
        if let Some((from, to)) = key.split_once("_TO_BCD") {
            let to = match to.strip_prefix('_') {
                Some(to) => Some(elementary(to)?),
                None if to.is_empty() => None,
                None => return None,
            };
            return Some(Self::ToBcd(Some(elementary(from)?), to));
        }
        if let Some(to) = key.strip_prefix("ANY_TO_").or_else(|| key.strip_prefix("TO_")) {
            if let Some(to) = to.strip_prefix("BCD_") {
                return Some(Self::ToBcd(None, Some(elementary(to)?)));
            }
            return Some(Self::Plain(None, end(to)?));
        }
        let (from, to) = key.split_once("_TO_")?;
        Some(Self::Plain(Some(end(from)?), end(to)?))
    }
}

/// A conversion between an enumeration and a number, as its name says.
pub(in crate::lower) enum Enumerated {
    From(Type, End),
    To(Option<End>, Type),
}

impl Lowering<'_> {
    /// The conversion of a name in which a type of the file is an enumeration: `COLOUR_TO_INT`, `INT_TO_COLOUR`, `TO_COLOUR`.
    pub(in crate::lower) fn enumerated(&mut self, name: &syntax::Name) -> Option<Enumerated> {
        let is_number = |end: &End| matches!(end, End::Elementary(of, _) if !of.is_time());
        let key = name.key();
        let mut of = |part: &str| self.enumeration_named(&syntax::Name::new(part, name.span()));
        if let Some(to) = key.strip_prefix("TO_")
            && let Some(to) = of(to)
        {
            return Some(Enumerated::To(None, to));
        }
        // A name of a type may have the word itself.
        key.match_indices("_TO_").find_map(|(at, word)| {
            let (from, to) = (&key[..at], &key[at + word.len()..]);
            match (end(from).filter(is_number), end(to).filter(is_number)) {
                (None, Some(end)) => of(from).map(|from| Enumerated::From(from, end)),
                (Some(end), None) => of(to).map(|to| Enumerated::To(Some(end), to)),
                _ => None,
            }
        })
    }

    pub(super) fn enumerated_value(
        &mut self,
        conversion: Enumerated,
        value: &syntax::Expression,
    ) -> Option<Expression> {
        match conversion {
            Enumerated::From(from, to) => {
                let value = self.expression(value, &from)?;
                self.converted_to(value, 1, to)
            }
            Enumerated::To(from, to) => {
                let base = End::Elementary(to.elementary()?, 1);
                let (value, unit) = self.converted_from(from, base, value)?;
                let value = self.converted_to(value, unit, base)?;
                Some(Expression { of: to, ..value })
            }
        }
    }

    pub(super) fn conversion(
        &mut self,
        conversion: &Conversion,
        value: &syntax::Expression,
        hint: Option<&Type>,
    ) -> Option<Expression> {
        match *conversion {
            Conversion::Plain(from, to) => {
                let (value, unit) = self.converted_from(from, to, value)?;
                self.converted_to(value, unit, to)
            }
            Conversion::Truncate(from, to) => self.truncated(from, to, value, hint),
            Conversion::FromBcd(from, to) => {
                let found = match from {
                    Some(from) => self.expression(value, &Type::Elementary(from))?,
                    None => self.typed(value, None)?,
                };
                let from = found.of.elementary().filter(|of| is_whole(*of));
                let Some(from) = from else {
                    return self.not_a_number(&found, &value.span);
                };
                let bits = as_bits(from);
                let digits = as_integer(to);
                let operands = vec![reinterpret(found, bits)];
                let operation = Operation::FromBcd(bits, digits);
                let number = apply(operation, operands, Type::Elementary(digits));
                Some(convert(number, to))
            }
            Conversion::ToBcd(from, to) => {
                let found = match from {
                    Some(from) => self.expression(value, &Type::Elementary(from))?,
                    None => self.typed(value, None)?,
                };
                let from = found.of.elementary().filter(|of| is_whole(*of));
                let Some(from) = from else {
                    return self.not_a_number(&found, &value.span);
                };
                let integer = as_integer(from);
                let to = to.unwrap_or(as_bits(from));
                let operands = vec![reinterpret(found, integer)];
                let operation = Operation::ToBcd(integer, as_bits(to));
                Some(apply(operation, operands, Type::Elementary(as_bits(to))))
            }
        }
    }

    /// The value to be converted, and the nanoseconds that its numbers count.
    fn converted_from(
        &mut self,
        from: Option<End>,
        to: End,
        value: &syntax::Expression,
    ) -> Option<(Expression, i64)> {
        match from {
            Some(End::Elementary(from, unit)) => {
                let found = self.expression(value, &Type::Elementary(from))?;
                Some((found, unit))
            }
            Some(End::Text) => {
                let (found, _) = self.text_value(value)?;
                Some((found, 1))
            }
            None => {
                let hint = match to {
                    End::Elementary(to, _) if to.is_real() => Some(Type::Elementary(to)),
                    _ => None,
                };
                let found = self.typed(value, hint.as_ref())?;
                let unit = match (found.of.elementary(), to) {
                    (Some(Elementary::Time | Elementary::TimeOfDay), _) => 1_000_000,
                    (Some(of), _) if of.is_time() => 1_000_000_000,
                    _ => 1,
                };
                Some((found, unit))
            }
        }
    }

    fn converted_to(&mut self, value: Expression, unit: i64, to: End) -> Option<Expression> {
        let from = match (&value.of, to) {
            (Type::Text(_), End::Text) => return Some(value),
            (Type::Text(_), End::Elementary(to, _)) => {
                return Some(text(TextOperation::To(to), vec![value], Type::Elementary(to)));
            }
            (of, _) => of.elementary()?,
        };
        let (to, to_unit) = match to {
            End::Text => {
                let of = Type::Text(NUMBER_CAPACITY.min(DEFAULT_CAPACITY));
                return Some(text(TextOperation::From(from), vec![value], of));
            }
            End::Elementary(to, unit) => (to, unit),
        };
        Some(match (from.is_time(), to.is_time()) {
            (true, true) => time_to_time(value, from, to),
            (true, false) => from_time(value, unit, to),
            (false, true) => to_time(value, from, to, to_unit),
            (false, false) if takes_bits(from, to) => reinterpret(value, to),
            (false, false) => convert(value, to),
        })
    }

    fn truncated(
        &mut self,
        from: Option<Elementary>,
        to: Option<Elementary>,
        value: &syntax::Expression,
        hint: Option<&Type>,
    ) -> Option<Expression> {
        let found = match from {
            Some(from) => self.expression(value, &Type::Elementary(from))?,
            None => self.typed(value, None)?,
        };
        let hinted = hint.and_then(Type::elementary).filter(|of| of.is_integer());
        let to = to.or(hinted).unwrap_or(Elementary::Dint);
        match found.of.elementary() {
            Some(from) if from.is_real() => {
                Some(apply(Operation::Truncate(from, to), vec![found], Type::Elementary(to)))
            }
            Some(from) if is_whole(from) => Some(convert(found, to)),
            _ => self.not_a_number(&found, &value.span),
        }
    }
}

fn long(operation: fn(Elementary) -> Operation, value: Expression, other: i64) -> Expression {
    let of = Type::Elementary(Elementary::Lint);
    apply(operation(Elementary::Lint), vec![value, lint(other)], of)
}

fn from_time(value: Expression, unit: i64, to: Elementary) -> Expression {
    if to.is_real() {
        let double = Type::Elementary(Elementary::Lreal);
        let value = convert(value, Elementary::Lreal);
        let unit = convert(lint(unit), Elementary::Lreal);
        let value = apply(Operation::Divide(Elementary::Lreal), vec![value, unit], double);
        return convert(value, to);
    }
    if to == Elementary::Bool {
        return convert(value, to);
    }
    let value = reinterpret(value, Elementary::Lint);
    convert(long(Operation::Divide, value, unit), to)
}

fn to_time(value: Expression, from: Elementary, to: Elementary, unit: i64) -> Expression {
    if from.is_real() {
        let double = Type::Elementary(Elementary::Lreal);
        let value = convert(value, Elementary::Lreal);
        let unit = convert(lint(unit), Elementary::Lreal);
        let value = apply(Operation::Multiply(Elementary::Lreal), vec![value, unit], double);
        return convert(value, to);
    }
    let value = convert(value, Elementary::Lint);
    reinterpret(long(Operation::Multiply, value, unit), to)
}

fn time_to_time(value: Expression, from: Elementary, to: Elementary) -> Expression {
    if from == to {
        return value;
    }
    let value = reinterpret(value, Elementary::Lint);
    let value = match to {
        Elementary::TimeOfDay => long(Operation::Modulo, value, DAY),
        Elementary::Date => {
            let rest = long(Operation::Modulo, value.clone(), DAY);
            let of = Type::Elementary(Elementary::Lint);
            apply(Operation::Subtract(Elementary::Lint), vec![value, rest], of)
        }
        _ => value,
    };
    reinterpret(value, to)
}
