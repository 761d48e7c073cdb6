//! Expressions: literals, signs, and what leads to variables, operators and calls.

use std::sync::Arc;

use understudy_typed::{Elementary, Expression, Operation, Type};

use crate::syntax::{self, ExpressionKind, Literal, Span};

use super::Lowering;
use super::convert::{as_bits, as_integer, is_number, is_whole, limits};
use super::fold::{apply, boolean, convert, not, reinterpret};
use super::names::number;
use super::numbers::{Number, Operand};
use super::promotion::{WIDE, is_narrow, wide_bits};

impl Lowering<'_> {
    /// An expression whose value is wanted as a type; `None` where an error is reported.
    pub(super) fn expression(
        &mut self,
        expression: &syntax::Expression,
        of: &Type,
    ) -> Option<Expression> {
        let operand = self.operand_for(expression, of);
        self.coerce(operand, of, &expression.span)
    }

    /// An operand that is stored as a type. The digits of a number of base 2, 8 or 16 may be the bits of a negative one.
    pub(super) fn operand_for(&mut self, expression: &syntax::Expression, of: &Type) -> Operand {
        if let ExpressionKind::Literal(Literal::Integer { value, of: None, based: true }) =
            expression.kind
            && let Type::Elementary(of) = *of
            && of.is_integer()
            && of.is_signed()
            && value > limits(of).1
            && value <= i128::from(of.mask())
        {
            return Operand::Typed(number(Type::Elementary(of), value as u64));
        }
        self.operand(expression, Some(of))
    }

    /// A condition.
    pub(super) fn condition(&mut self, expression: &syntax::Expression) -> Option<Expression> {
        self.expression(expression, &Type::Elementary(Elementary::Bool))
    }

    /// An expression of whatever type; the hint settles what is open in it.
    pub(super) fn typed(
        &mut self,
        expression: &syntax::Expression,
        hint: Option<&Type>,
    ) -> Option<Expression> {
        let operand = self.operand(expression, hint);
        self.settle(operand, hint, &expression.span)
    }

    /// The same, where a number is used at once and not stored: an operator's result of fewer than 32 bits is a DINT.
    pub(super) fn used(
        &mut self,
        expression: &syntax::Expression,
        hint: Option<&Type>,
    ) -> Option<Expression> {
        match self.operand(expression, hint) {
            Operand::Wide(value, _) => Some(value),
            operand => self.settle(operand, hint, &expression.span),
        }
    }

    pub(super) fn operand(
        &mut self,
        expression: &syntax::Expression,
        hint: Option<&Type>,
    ) -> Operand {
        let before = self.blamed;
        let found = match self.operand_kind(expression, hint) {
            Operand::Faulty => None,
            found => Some(found),
        };
        let found = self.accounted(before, found, &expression.span);
        found.unwrap_or(Operand::Faulty)
    }

    fn operand_kind(&mut self, expression: &syntax::Expression, hint: Option<&Type>) -> Operand {
        let span = &expression.span;
        let found = match &expression.kind {
            ExpressionKind::Literal(literal) => return self.literal(literal, span),
            ExpressionKind::Variable(path) => self.variable(path, hint),
            ExpressionKind::Qualified(of, value) => self.qualified(of, value),
            ExpressionKind::Not(inner) => return self.not(inner, hint),
            ExpressionKind::Minus(inner) => return self.minus(inner, hint, span),
            ExpressionKind::Chain(first, rest) => return self.chain(first, rest, hint, span),
            ExpressionKind::Call(path, arguments) => {
                return self.call(path, arguments, hint, span);
            }
            ExpressionKind::Faulty => {
                self.blamed += 1;
                None
            }
        };
        found.map_or(Operand::Faulty, Operand::Typed)
    }

    fn literal(&mut self, literal: &Literal, span: &Span) -> Operand {
        Operand::Typed(match literal {
            Literal::Boolean(value) => boolean(*value),
            Literal::Integer { value, of: None, .. } => {
                return Operand::Number(Number::Integer(*value));
            }
            Literal::Integer { value, of: Some(of), .. } => {
                let value = Operand::Number(Number::Integer(*value));
                match self.coerce(value, &Type::Elementary(*of), span) {
                    Some(value) => value,
                    None => return Operand::Faulty,
                }
            }
            Literal::Real { text, of } => {
                let value = Number::written(text);
                let Some(value) = value.filter(|value| value.is_finite()) else {
                    let message = match value {
                        Some(_) => format!("`{text}` is too large for LREAL"),
                        None => format!("`{text}` is not a number"),
                    };
                    self.error("U1032", message, span.clone());
                    return Operand::Faulty;
                };
                match of.filter(|of| of.is_real()) {
                    Some(of) => match self.real_number(value, of, span) {
                        Some(value) => value,
                        None => return Operand::Faulty,
                    },
                    None => return Operand::Number(value),
                }
            }
            Literal::Time { nanoseconds, of } => number(Type::Elementary(*of), *nanoseconds as u64),
            Literal::Text { bytes, .. } => {
                let capacity = u16::try_from(bytes.len()).unwrap_or(u16::MAX).max(1);
                Expression {
                    of: Type::Text(capacity),
                    kind: understudy_typed::ExpressionKind::Text(Arc::from(bytes.as_slice())),
                }
            }
        })
    }

    fn not(&mut self, inner: &syntax::Expression, hint: Option<&Type>) -> Operand {
        let operand = self.operand(inner, hint);
        if let Operand::Number(_) = operand
            && hint.and_then(Type::elementary) == Some(Elementary::Bool)
        {
            let of = Type::Elementary(Elementary::Bool);
            let value = self.coerce(operand, &of, &inner.span).map(not);
            return value.map_or(Operand::Faulty, Operand::Typed);
        }
        if let Operand::Wide(value, own) = operand {
            return Operand::Wide(wide_bits(Operation::Not, vec![value]), own);
        }
        // The bits of a variable are those of its type, as the standard says and all but C code have it.
        let Some(value) = self.settle(operand, hint, &inner.span) else {
            return Operand::Faulty;
        };
        let Some(of) = value.of.elementary().filter(|of| of.is_bit_string() || is_whole(*of))
        else {
            let found = self.describe(&value.of);
            let wanted = Type::Elementary(Elementary::Bool);
            let _: Option<()> = self.mismatch(&found, &wanted, &inner.span);
            return Operand::Faulty;
        };
        let bits = as_bits(of);
        let value = reinterpret(value, bits);
        let value = apply(Operation::Not(bits), vec![value], Type::Elementary(bits));
        Operand::Typed(reinterpret(value, of))
    }

    fn minus(&mut self, inner: &syntax::Expression, hint: Option<&Type>, span: &Span) -> Operand {
        match self.operand(inner, hint) {
            Operand::Faulty => Operand::Faulty,
            Operand::Number(value) => match value.negated() {
                Some(value) => Operand::Number(value),
                None => self.no_result(span),
            },
            Operand::Wide(value, own) => {
                let value = apply(Operation::Negate(WIDE), vec![value], Type::Elementary(WIDE));
                Operand::Wide(value, as_integer(own))
            }
            Operand::Typed(value) => match value.of.elementary() {
                Some(of) if is_narrow(of) => {
                    let value = vec![convert(value, WIDE)];
                    let value = apply(Operation::Negate(WIDE), value, Type::Elementary(WIDE));
                    Operand::Wide(value, as_integer(of))
                }
                Some(of) if is_number(of) || of == Elementary::Time => {
                    let of = as_integer(of);
                    let value = reinterpret(value, of);
                    Operand::Typed(apply(Operation::Negate(of), vec![value], Type::Elementary(of)))
                }
                _ => {
                    let found = self.describe(&value.of);
                    let message = format!("`-` needs a number, and this is {found}");
                    self.error("U1043", message, inner.span.clone());
                    Operand::Faulty
                }
            },
        }
    }
}
