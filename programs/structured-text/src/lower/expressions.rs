//! Expressions: literals, signs, and what leads to variables, operators and calls.

use std::sync::Arc;

use understudy_typed::{Elementary, Expression, Operation, Type};

use crate::syntax::{self, ExpressionKind, Literal, Span};

use super::Lowering;
use super::convert::{as_bits, as_integer, is_number};
use super::fold::{apply, boolean, not, reinterpret};
use super::names::number;
use super::numbers::{Number, Operand};

impl Lowering<'_> {
    /// An expression whose value is wanted as a type; `None` where an error is reported.
    pub(super) fn expression(
        &mut self,
        expression: &syntax::Expression,
        of: &Type,
    ) -> Option<Expression> {
        let operand = self.operand(expression, Some(of));
        self.coerce(operand, of, &expression.span)
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
        self.settle(operand, hint)
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
            ExpressionKind::Not(inner) => self.not(inner, hint),
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
            Literal::Integer { value, of: None } => {
                return Operand::Number(Number::Integer(*value));
            }
            Literal::Integer { value, of: Some(of) } => {
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

    fn not(&mut self, inner: &syntax::Expression, hint: Option<&Type>) -> Option<Expression> {
        let operand = self.operand(inner, hint);
        if let Operand::Number(_) = operand
            && hint.and_then(Type::elementary) == Some(Elementary::Bool)
        {
            let of = Type::Elementary(Elementary::Bool);
            return self.coerce(operand, &of, &inner.span).map(not);
        }
        let value = self.settle(operand, hint)?;
        match value.of.elementary() {
            Some(of) if of.is_bit_string() || of.is_integer() => {
                let bits = as_bits(of);
                let value = reinterpret(value, bits);
                let value = apply(Operation::Not(bits), vec![value], Type::Elementary(bits));
                Some(reinterpret(value, of))
            }
            _ => {
                let found = self.describe(&value.of);
                self.mismatch(&found, &Type::Elementary(Elementary::Bool), &inner.span)
            }
        }
    }

    fn minus(&mut self, inner: &syntax::Expression, hint: Option<&Type>, span: &Span) -> Operand {
        match self.operand(inner, hint) {
            Operand::Faulty => Operand::Faulty,
            Operand::Number(value) => match value.negated() {
                Some(value) => Operand::Number(value),
                None => self.no_result(span),
            },
            Operand::Typed(value) => match value.of.elementary() {
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
