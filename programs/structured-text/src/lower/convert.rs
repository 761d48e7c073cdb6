//! Which types fit each other: implicit conversions, and the common type of operands.

use understudy_typed::{Elementary, Expression, ExpressionKind, Type};

use crate::syntax::Span;

use super::Lowering;
use super::fold;
use super::names::number;
use super::numbers::{Number, Operand};
use super::ranges::ranges;

/// The least and the greatest number of an integer, a bit string or a time.
pub(super) fn limits(of: Elementary) -> (i128, i128) {
    of.limits()
}

/// How a type fits another.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Fit {
    /// Nothing is lost.
    Whole,
    /// The bits stay, the number may become another.
    Sign,
    /// Digits may be lost.
    Rounded,
    No,
}

/// An integer or a bit string of several bits.
pub(super) fn is_whole(of: Elementary) -> bool {
    of.is_integer() || of.is_bit_string() && of != Elementary::Bool
}

/// Something to calculate with: integers, bit strings of several bits, reals.
pub(super) fn is_number(of: Elementary) -> bool {
    is_whole(of) || of.is_real()
}

fn fit(from: Elementary, to: Elementary) -> Fit {
    if from == to {
        return Fit::Whole;
    }
    if is_whole(from) && is_whole(to) {
        let ((least, most), (from_least, from_most)) = (limits(to), limits(from));
        return if least <= from_least && from_most <= most {
            Fit::Whole
        } else if to.bits() >= from.bits() {
            Fit::Sign
        } else {
            Fit::No
        };
    }
    if is_whole(from) && to.is_real() {
        let exact = if to == Elementary::Real { 16 } else { 32 };
        return if from.bits() <= exact { Fit::Whole } else { Fit::Rounded };
    }
    if (from, to) == (Elementary::Real, Elementary::Lreal) {
        return Fit::Whole;
    }
    Fit::No
}

/// The unsigned integer of a bit string's width; other types stay.
pub(super) fn as_integer(of: Elementary) -> Elementary {
    match of {
        Elementary::Byte => Elementary::Usint,
        Elementary::Word => Elementary::Uint,
        Elementary::Dword => Elementary::Udint,
        Elementary::Lword => Elementary::Ulint,
        _ => of,
    }
}

/// Whether a conversion takes the bits and not the number: table 25 of the standard's third edition.
pub(super) fn takes_bits(from: Elementary, to: Elementary) -> bool {
    use Elementary::{Dword, Lreal, Lword, Real};
    matches!((from, to), (Dword, Real) | (Real, Dword) | (Lword, Lreal) | (Lreal, Lword))
}

/// The name of the function that converts numbers of one type to another one.
pub(super) fn conversion(from: &str, to: &str) -> String {
    let number = |name: &str| {
        let mut types = Elementary::ALL.iter();
        types.find(|of| of.name() == name).map_or(name.to_owned(), |of| as_integer(*of).to_string())
    };
    let is_real = |name: &str| matches!(name, "REAL" | "LREAL");
    match (is_real(from), is_real(to)) {
        // The function of these names may take the bits.
        (true, false) => format!("{from}_TO_{}", number(to)),
        (false, true) => format!("{}_TO_{to}", number(from)),
        _ => format!("{from}_TO_{to}"),
    }
}

/// The bit string of a type's width.
pub(super) fn as_bits(of: Elementary) -> Elementary {
    match of.bits() {
        1 => Elementary::Bool,
        8 => Elementary::Byte,
        16 => Elementary::Word,
        32 => Elementary::Dword,
        _ => Elementary::Lword,
    }
}

/// The type in which two operands are calculated; of two integers of one width and different signs that with the sign.
pub(super) fn common(left: Elementary, right: Elementary) -> Option<Elementary> {
    if left == right {
        return Some(left);
    }
    if !is_number(left) || !is_number(right) {
        return None;
    }
    if left.is_real() || right.is_real() {
        let double = left == Elementary::Lreal || right == Elementary::Lreal;
        let long = |of: Elementary| is_whole(of) && of.bits() == 64;
        let double = double || long(left) || long(right);
        return Some(match double {
            true => Elementary::Lreal,
            false => Elementary::Real,
        });
    }
    if left.is_bit_string() && right.is_bit_string() {
        return Some(if left.bits() >= right.bits() { left } else { right });
    }
    let (left, right) = (as_integer(left), as_integer(right));
    Some(match left.bits().cmp(&right.bits()) {
        std::cmp::Ordering::Greater => left,
        std::cmp::Ordering::Less => right,
        std::cmp::Ordering::Equal if left.is_signed() => left,
        std::cmp::Ordering::Equal => right,
    })
}

/// The type in which two numbers are compared: one that has both, where there is one.
pub(super) fn comparable(left: Elementary, right: Elementary) -> Option<Elementary> {
    let found = common(left, right)?;
    if fit(left, found) == Fit::Whole && fit(right, found) == Fit::Whole || found.is_real() {
        return Some(found);
    }
    let wider = [Elementary::Int, Elementary::Dint, Elementary::Lint];
    let has_both = |of: &Elementary| fit(left, *of) == Fit::Whole && fit(right, *of) == Fit::Whole;
    Some(wider.into_iter().find(has_both).unwrap_or(Elementary::Lint))
}

impl Lowering<'_> {
    /// The value as one of a type, where the languages convert by themselves.
    pub(super) fn coerce(
        &mut self,
        operand: Operand,
        to: &Type,
        span: &Span,
    ) -> Option<Expression> {
        let before = self.blamed;
        let found = match operand {
            Operand::Faulty => return None,
            Operand::Number(number) => self.coerce_number(number, to, span),
            Operand::Typed(value) => self.coerce_typed(value, to, span),
            Operand::Wide(value, own) => self.coerce_wide(value, own, to, span),
        };
        self.accounted(before, found, span)
    }

    fn coerce_number(&mut self, value: Number, to: &Type, span: &Span) -> Option<Expression> {
        if let (Type::Enumeration(id, of), Number::Integer(value)) = (to, value) {
            let values = &self.program.enumerations[id.0 as usize].values;
            if values.iter().any(|(_, known)| i128::from(*known) == value) {
                return Some(number(to.clone(), value as u64 & of.mask()));
            }
            let message = format!("{} has no value {value}", self.describe(to));
            let shown: Vec<&str> = values.iter().map(|(name, _)| name.as_str()).take(20).collect();
            let help = format!("write one of its names: {}", shown.join(", "));
            self.error_with("U1043", message, span.clone(), help);
            return None;
        }
        let elementary = match to {
            Type::Elementary(of) => *of,
            _ => return self.mismatch("a number", to, span),
        };
        if elementary.is_real() {
            return self.real_number(value, elementary, span);
        }
        if elementary.is_time() {
            return self.mismatch("a number without a unit", to, span);
        }
        let Number::Integer(value) = value else {
            let message = format!("expected {elementary}, found a number with a decimal point");
            let help = format!("write a whole number, or LREAL_TO_{elementary}(…)");
            self.error_with("U1043", message, span.clone(), help);
            return None;
        };
        let (least, most) = limits(elementary);
        if value < least || value > most {
            let message = match elementary {
                Elementary::Bool => format!("expected BOOL, found the number {value}"),
                _ => {
                    let article = elementary.article();
                    format!("{value} is not {article} {elementary}, which is {least} to {most}")
                }
            };
            let help = match elementary {
                Elementary::Bool => "write TRUE or FALSE, or compare the number".to_owned(),
                _ if value >= 0 && value <= i128::from(elementary.mask()) => {
                    let bits = as_bits(elementary);
                    format!("write {bits}_TO_{elementary}({bits}#{value}) if its bits are meant")
                }
                _ => "use a wider type".to_owned(),
            };
            self.error_with("U1043", message, span.clone(), help);
            return None;
        }
        Some(number(to.clone(), value as u64 & elementary.mask()))
    }

    /// A literal in a real type; one that is too large for it is an error.
    pub(super) fn real_number(
        &mut self,
        value: Number,
        of: Elementary,
        span: &Span,
    ) -> Option<Expression> {
        if let (Elementary::Real, Number::Real(single, double)) = (of, value)
            && single.is_infinite()
            && double.is_finite()
        {
            let message = format!("{double:e} is not a REAL, which is -3.4e38 to 3.4e38");
            self.error_with("U1032", message, span.clone(), "use LREAL");
            return None;
        }
        Some(value.in_real(of))
    }

    fn coerce_wide(
        &mut self,
        value: Expression,
        own: Elementary,
        to: &Type,
        span: &Span,
    ) -> Option<Expression> {
        match to {
            Type::Elementary(to) if is_whole(*to) => Some(self.stored_as(value, own, *to, span)),
            Type::Elementary(to) if to.is_real() => {
                let exact = (-(1 << 24), 1 << 24);
                if *to == Elementary::Real
                    && !ranges(&value, Some(&self.facts)).likely.is_within(exact)
                {
                    self.rounded_to((own.name(), own), *to, span);
                }
                self.inverted(&value, own, to.bits(), span);
                Some(fold::convert(value, *to))
            }
            _ => {
                let value = self.stored_as(value, own, own, span);
                self.coerce_typed(value, to, span)
            }
        }
    }

    fn coerce_typed(&mut self, value: Expression, to: &Type, span: &Span) -> Option<Expression> {
        if value.of == *to {
            return Some(value);
        }
        let found = self.describe(&value.of);
        let (from, target) = match (&value.of, to) {
            (Type::Text(_), Type::Text(_)) => return Some(value),
            (Type::Elementary(from), Type::Elementary(to))
            | (Type::Enumeration(_, from), Type::Elementary(to)) => (*from, *to),
            (Type::Elementary(from), Type::Enumeration(_, target)) if is_whole(*from) => {
                let wanted = self.describe(to);
                let message = format!("{found} becomes {wanted}, whether or not it has that value");
                let help = "compare with its names, or use CASE";
                self.warn("U1080", message, span.clone(), help);
                let mut value = fold::convert(value, *target);
                value.of = to.clone();
                return Some(value);
            }
            _ => return self.mismatch(&found, to, span),
        };
        if let ExpressionKind::Constant(stored) = value.kind
            && is_whole(from)
            && is_whole(target)
        {
            let (least, most) = limits(target);
            let known = from.signed(stored);
            if least <= known && known <= most {
                return Some(fold::convert(value, target));
            }
        }
        let is_constant = matches!(value.kind, ExpressionKind::Constant(_));
        let fit = match fit(from, target) {
            Fit::No if is_constant && from.is_real() && target.is_real() => Fit::Rounded,
            fit => fit,
        };
        match fit {
            Fit::Whole | Fit::Sign => self.converted((&found, from), target, span),
            Fit::Rounded => self.rounded_to((&found, from), target, span),
            Fit::No if is_whole(from) && is_whole(target) && !is_constant => {
                self.converted((&found, from), target, span);
            }
            Fit::No => return self.mismatch(&found, to, span),
        }
        Some(fold::convert(value, target))
    }

    /// Warns where a whole number becomes another one in a type that it takes by itself; a constant that the type has stays.
    pub(super) fn changed(&mut self, value: &Expression, to: Elementary, span: &Span) {
        let Some(from) = value.of.elementary().filter(|of| is_whole(*of) && is_whole(to)) else {
            return;
        };
        let (least, most) = limits(to);
        let possible = ranges(value, Some(&self.facts)).possible;
        if !possible.is_within((least, most)) {
            let found = self.describe(&value.of);
            self.converted((&found, from), to, span);
        }
    }

    /// Warns where a whole number becomes one of a type that does not have all numbers of its own.
    pub(super) fn converted(
        &mut self,
        (found, from): (&str, Elementary),
        to: Elementary,
        span: &Span,
    ) {
        let what = match fit(from, to) {
            Fit::Sign => ": the bits stay, the number may change",
            // Other compilers warn, and keep the low bits.
            Fit::No => ", which is narrower: its low bits are kept",
            Fit::Whole | Fit::Rounded => return,
        };
        let message = format!("{found} becomes {to}{what}");
        let help = format!("write {}(…) if that is meant", conversion(from.name(), to.name()));
        self.warn("U1080", message, span.clone(), help);
    }

    /// Warns where digits may be lost.
    fn rounded_to(&mut self, (found, from): (&str, Elementary), to: Elementary, span: &Span) {
        let message = format!("{found} becomes {to}, which has fewer digits");
        let help = format!("write {}(…) if that is meant", conversion(from.name(), to.name()));
        self.warn("U1080", message, span.clone(), help);
    }

    /// Reports a value of another type than the one wanted.
    pub(super) fn mismatch<T>(&mut self, found: &str, to: &Type, span: &Span) -> Option<T> {
        let wanted = self.describe(to);
        let message = format!("expected {wanted}, found {found}");
        let is_elementary = |name: &str| Elementary::ALL.iter().any(|of| of.name() == name);
        let help = match to {
            Type::Elementary(_) | Type::Text(_) if is_elementary(found) => {
                let wanted = if matches!(to, Type::Text(_)) { "STRING" } else { &wanted };
                match wanted {
                    "BOOL" => {
                        format!("compare it, such as `… > 0`, or write {found}_TO_BOOL(…)")
                    }
                    _ => format!("write {}(…)", conversion(found, wanted)),
                }
            }
            Type::Elementary(of) if of.is_time() => "write a unit, such as T#500ms".to_owned(),
            Type::Elementary(of) if found.starts_with("STRING") => {
                format!("write STRING_TO_{of}(…)")
            }
            _ => format!("use a value of {wanted}"),
        };
        self.error_with("U1043", message, span.clone(), help);
        None
    }

    /// A value of the type that it has by itself, or of the one that its surroundings suggest.
    pub(super) fn settle(
        &mut self,
        operand: Operand,
        hint: Option<&Type>,
        span: &Span,
    ) -> Option<Expression> {
        match operand {
            Operand::Faulty => None,
            Operand::Typed(value) => Some(value),
            Operand::Wide(value, own) => Some(self.stored_as(value, own, own, span)),
            Operand::Number(value) => {
                let hinted = hint.and_then(Type::elementary).filter(|of| match value {
                    Number::Real(..) => of.is_real(),
                    Number::Integer(value) => {
                        let (least, most) = limits(*of);
                        of.is_real() || is_whole(*of) && least <= value && value <= most
                    }
                });
                let of = hinted.unwrap_or_else(|| value.default_type());
                if of.is_real() {
                    return Some(value.in_real(of));
                }
                let Number::Integer(value) = value else {
                    return None;
                };
                Some(number(Type::Elementary(of), value as u64 & of.mask()))
            }
        }
    }
}
