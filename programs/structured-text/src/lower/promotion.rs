//! Operators on numbers of fewer than 32 bits: they are computed as DINT, and what is stored is cut to its type.
//!
//! So do the C code of matiec, RuSTy and CODESYS; `raw * 100 / 4095` of an INT has no overflow between its operators. Functions and
//! boxes (`MUL`, `DIV`) keep the type of their inputs. `NOT` of a value that has a type keeps it too: `NOT w` of a WORD has 16 bits in
//! the standard, in RuSTy, STruC++ and IronPLC; only the C code of matiec has 32.

use understudy_typed::{Elementary, Expression, ExpressionKind, Operation, Type};

use crate::syntax::Span;

use super::Lowering;
use super::convert::{as_bits, as_integer, is_whole, limits};
use super::fold::{apply, convert, reinterpret};
use super::numbers::Operand;
use super::ranges::{Range, ranges};

/// The type in which operators on smaller numbers are computed.
pub(super) const WIDE: Elementary = Elementary::Dint;

/// An integer or a bit string of several bits, and of fewer than 32.
pub(super) fn is_narrow(of: Elementary) -> bool {
    is_whole(of) && of.bits() < WIDE.bits()
}

/// A value of an operand, and the type that it has where it is stored.
pub(super) struct Valued {
    pub(super) value: Expression,
    pub(super) own: Type,
}

impl Valued {
    pub(super) fn typed(value: Expression) -> Self {
        Self { own: value.of.clone(), value }
    }

    /// A value whose type is known.
    pub(super) fn of(operand: Operand) -> Option<Self> {
        match operand {
            Operand::Typed(value) => Some(Self::typed(value)),
            Operand::Wide(value, own) => Some(Self { value, own: Type::Elementary(own) }),
            Operand::Number(_) | Operand::Faulty => None,
        }
    }

    pub(super) fn is_wide(&self) -> bool {
        self.value.of != self.own
    }

    /// As an operand of an operator that computes in DINT.
    pub(super) fn widened(self) -> Expression {
        convert(self.value, WIDE)
    }

    pub(super) fn operand(self) -> Operand {
        match self.own.elementary() {
            Some(own) if self.value.of != self.own => Operand::Wide(self.value, own),
            _ => Operand::Typed(self.value),
        }
    }
}

/// An operation on the bits of values that are DINTs.
pub(super) fn wide_bits(
    operation: fn(Elementary) -> Operation,
    values: Vec<Expression>,
) -> Expression {
    let bits = as_bits(WIDE);
    let values = values.into_iter().map(|value| reinterpret(value, bits)).collect();
    reinterpret(apply(operation(bits), values, Type::Elementary(bits)), WIDE)
}

/// The low bits of a DINT as a type of at most 32 bits. Operators whose low bits depend on low bits only are done in that type at once.
pub(super) fn cut(value: Expression, to: Elementary) -> Expression {
    if !is_narrow(to) || value.of.elementary() != Some(WIDE) {
        return convert(value, to);
    }
    let of = as_integer(to);
    let bits = as_bits(to);
    let ExpressionKind::Apply(operation, operands) = value.kind else {
        return convert(value, to);
    };
    let narrower = match operation {
        Operation::Add(WIDE) => Some(Operation::Add(of)),
        Operation::Subtract(WIDE) => Some(Operation::Subtract(of)),
        Operation::Multiply(WIDE) => Some(Operation::Multiply(of)),
        Operation::Negate(WIDE) => Some(Operation::Negate(of)),
        // The least number by −1 wraps around in either type.
        Operation::Divide(WIDE) if all_fit(&operands, of) => Some(Operation::Divide(of)),
        Operation::Modulo(WIDE) if all_fit(&operands, of) => Some(Operation::Modulo(of)),
        _ => None,
    };
    if let Some(operation) = narrower {
        let operands = operands.into_iter().map(|operand| cut(operand, of)).collect();
        return reinterpret(apply(operation, operands, Type::Elementary(of)), to);
    }
    match (operation, <[Expression; 1]>::try_from(operands)) {
        (Operation::Convert(..), Ok([inner])) => convert(inner, to),
        (Operation::Reinterpret(from, _), Ok([inner])) if from == as_bits(WIDE) => {
            reinterpret(cut_bits(inner, bits), to)
        }
        (operation, Ok(operands)) => again(operation, operands.into(), to),
        (operation, Err(operands)) => again(operation, operands, to),
    }
}

/// The same for a DWORD.
fn cut_bits(value: Expression, to: Elementary) -> Expression {
    const BITS: Elementary = Elementary::Dword;
    let ExpressionKind::Apply(operation, operands) = value.kind else {
        return convert(value, to);
    };
    let narrower = match operation {
        Operation::Not(BITS) => Operation::Not(to),
        Operation::And(BITS) => Operation::And(to),
        Operation::Or(BITS) => Operation::Or(to),
        Operation::Xor(BITS) => Operation::Xor(to),
        Operation::Reinterpret(WIDE, _) => {
            let inner = operands.into_iter().next().map(|inner| cut(inner, to));
            return inner.unwrap_or_else(|| super::names::number(Type::Elementary(to), 0));
        }
        other => {
            let kind = ExpressionKind::Apply(other, operands);
            return convert(Expression { of: Type::Elementary(BITS), kind }, to);
        }
    };
    let operands = operands.into_iter().map(|operand| cut_bits(operand, to)).collect();
    apply(narrower, operands, Type::Elementary(to))
}

fn again(operation: Operation, operands: Vec<Expression>, to: Elementary) -> Expression {
    let kind = ExpressionKind::Apply(operation, operands);
    convert(Expression { of: Type::Elementary(WIDE), kind }, to)
}

fn has_not(value: &Expression) -> bool {
    match &value.kind {
        ExpressionKind::Apply(Operation::Not(_), _) => true,
        ExpressionKind::Apply(_, operands) => operands.iter().any(has_not),
        _ => false,
    }
}

fn all_fit(operands: &[Expression], of: Elementary) -> bool {
    operands.iter().all(|operand| ranges(operand, None).possible.is_within(limits(of)))
}

impl Lowering<'_> {
    /// Warns where bits above those of its type are seen that NOT has set.
    pub(super) fn inverted(&mut self, value: &Expression, own: Elementary, bits: u32, span: &Span) {
        if bits <= own.bits()
            || own.is_signed()
            || ranges(value, Some(&self.facts)).possible.ends().0 >= 0
        {
            return;
        }
        if has_not(value) {
            let message = format!(
                "NOT of a calculated {own} sets the bits above it too: operators have {} bits",
                WIDE.bits()
            );
            let help = format!("write TO_{own}(…) around it if only its own bits are meant");
            self.warn("U1080", message, span.clone(), help);
        }
    }

    /// A DINT, stored where its type is smaller, as a value of a whole type. Warns where it can leave that type by more than a sum does.
    pub(super) fn stored_as(
        &mut self,
        value: Expression,
        own: Elementary,
        to: Elementary,
        span: &Span,
    ) -> Expression {
        let Range { possible, likely } = ranges(&value, Some(&self.facts));
        let is_kept = possible.is_within(limits(to))
            || likely.is_within(limits(to)) && !matches!(value.kind, ExpressionKind::Constant(_));
        let keeps_bits = own.is_bit_string() && own.bits() == to.bits();
        if is_kept || keeps_bits && possible.is_within((-(1 << own.bits()), 1 << own.bits())) {
            self.inverted(&value, own, to.bits(), span);
        } else if own != to && likely.is_within(limits(own)) {
            self.converted((own.name(), own), to, span);
        } else if !self.is_told(span) {
            let (least, most) = limits(to);
            let (low, high) = possible.ends();
            let found =
                if low == high { format!("is {low}") } else { format!("can be {low} to {high}") };
            let message = format!(
                "this {found}, and {to} is {least} to {most}: a number beyond wraps around"
            );
            let help = match is_narrow(to) {
                true => {
                    format!("use a DINT, limit it first, or write DINT_TO_{to}(…) if that is meant")
                }
                false => format!("limit it first, or write DINT_TO_{to}(…) if that is meant"),
            };
            self.warn("U1054", message, span.clone(), help);
        }
        if is_narrow(to) { cut(value, to) } else { convert(value, to) }
    }
}
