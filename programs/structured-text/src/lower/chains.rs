//! Operators between operands, and the types that they give.

use understudy_typed::{Comparison, Elementary, Expression, Operation, TextOperation, Type};

use crate::syntax::{self, Operator, Span};

use super::Lowering;
use super::convert::{
    as_bits, as_integer, common, comparable, conversion, is_number, is_whole, limits,
};
use super::fold::{apply, boolean, choose, convert, reinterpret, text};
use super::names::number;
use super::numbers::{Number, Operand};
use super::promotion::{Valued, WIDE, is_narrow, wide_bits};

/// Operators around and beside each other that an expression may have.
const MAXIMUM_LENGTH: usize = 400;

/// Operands from which on `a OR b OR …` becomes a tree of little depth.
const LONG: usize = 16;

impl Lowering<'_> {
    pub(super) fn chain(
        &mut self,
        first: &syntax::Expression,
        rest: &[(Operator, syntax::Expression)],
        hint: Option<&Type>,
        span: &Span,
    ) -> Operand {
        let is_flat = rest.len() > LONG
            && rest.iter().all(|(operator, _)| *operator == rest[0].0)
            && matches!(rest[0].0, Operator::And | Operator::Or | Operator::Xor);
        let length = if is_flat { LONG } else { rest.len() };
        let outside = self.length;
        if !self.has_room(length, span) {
            return Operand::Faulty;
        }
        self.length += length;
        let found = if is_flat {
            self.flat_chain(first, rest, hint, span)
        } else {
            self.left_chain(first, rest, hint)
        };
        self.length = outside;
        found
    }

    /// Whether so many operators or functions may still be in the expression.
    pub(super) fn has_room(&mut self, more: usize, span: &Span) -> bool {
        let fits = self.length + more <= MAXIMUM_LENGTH;
        if !fits {
            let message = format!("an expression of more than {MAXIMUM_LENGTH} operators");
            let help = "assign parts of it to variables";
            self.error_with("U1033", message, span.clone(), help);
        }
        fits
    }

    fn left_chain(
        &mut self,
        first: &syntax::Expression,
        rest: &[(Operator, syntax::Expression)],
        hint: Option<&Type>,
    ) -> Operand {
        let compares = rest.iter().any(|(operator, _)| matches!(operator, Operator::Compare(_)));
        let outer = hint.filter(|_| !compares);
        let mut whole = first.span.clone();
        let mut left = self.operand(first, outer);
        for (operator, right) in rest {
            let right_hint = match &left {
                Operand::Number(_) | Operand::Faulty => outer.cloned(),
                typed => typed.own_type(),
            };
            let value = self.operand(right, right_hint.as_ref());
            left = self.binary(*operator, (left, &whole), (value, &right.span), outer);
            whole.end = right.span.end;
        }
        left
    }

    /// `a OR b OR …`: as a tree of little depth where all have one type.
    fn flat_chain(
        &mut self,
        first: &syntax::Expression,
        rest: &[(Operator, syntax::Expression)],
        hint: Option<&Type>,
        span: &Span,
    ) -> Operand {
        let operator = rest[0].0;
        let parts = std::iter::once(first).chain(rest.iter().map(|(_, part)| part));
        let mut parts: Vec<(Operand, Span)> =
            parts.map(|part| (self.operand(part, hint), part.span.clone())).collect();
        while parts.len() > 1 {
            let mut halved = Vec::with_capacity(parts.len().div_ceil(2));
            let mut pending = parts.into_iter();
            while let Some((left, left_span)) = pending.next() {
                match pending.next() {
                    Some((right, right_span)) => {
                        let both = left_span.start..right_span.end;
                        let joined =
                            self.binary(operator, (left, &left_span), (right, &right_span), hint);
                        halved.push((joined, both));
                    }
                    None => halved.push((left, left_span)),
                }
            }
            parts = halved;
        }
        match parts.pop() {
            Some((whole, _)) => whole,
            None => self.no_result(span),
        }
    }

    pub(super) fn no_result(&mut self, span: &Span) -> Operand {
        let message = "the value of this expression has more than 64 bits, or none";
        self.error("U1043", message, span.clone());
        Operand::Faulty
    }

    /// An operator between two operands.
    pub(super) fn binary(
        &mut self,
        operator: Operator,
        (left, left_span): (Operand, &Span),
        (right, right_span): (Operand, &Span),
        hint: Option<&Type>,
    ) -> Operand {
        let span = left_span.start..right_span.end;
        let (left, right) = match (left, right) {
            (Operand::Faulty, _) | (_, Operand::Faulty) => return Operand::Faulty,
            (Operand::Number(left), Operand::Number(right)) => {
                return self.literals(operator, left, right, &span);
            }
            (left, Operand::Number(right)) => {
                let value = self.beside(left.own_type(), right, operator, hint);
                (left, value.map_or(Operand::Faulty, Operand::Typed))
            }
            (Operand::Number(left), right) => {
                let value = self.beside(right.own_type(), left, operator, hint);
                (value.map_or(Operand::Faulty, Operand::Typed), right)
            }
            typed => typed,
        };
        if let Operator::AndThen | Operator::OrElse = operator {
            let of = Type::Elementary(Elementary::Bool);
            let left = self.coerce(left, &of, left_span);
            let right = self.coerce(right, &of, right_span);
            return match (left, right) {
                (Some(left), Some(right)) if operator == Operator::AndThen => {
                    Operand::Typed(choose(left, right, boolean(false)))
                }
                (Some(left), Some(right)) => Operand::Typed(choose(left, boolean(true), right)),
                _ => Operand::Faulty,
            };
        }
        let (Some(left), Some(right)) = (Valued::of(left), Valued::of(right)) else {
            return Operand::Faulty;
        };
        let found = match operator {
            Operator::Compare(comparison) => self.comparison(comparison, left, right, &span),
            Operator::And | Operator::Or | Operator::Xor => {
                self.bitwise(operator, left, right, &span)
            }
            Operator::Power => self.power(left, right, hint, &span),
            _ => self.arithmetic(operator, left, right, &span),
        };
        found.map_or(Operand::Faulty, Valued::operand)
    }

    fn literals(
        &mut self,
        operator: Operator,
        left: Number,
        right: Number,
        span: &Span,
    ) -> Operand {
        if let Operator::Compare(comparison) = operator {
            let ordering = match (left, right) {
                (Number::Integer(left), Number::Integer(right)) => Some(left.cmp(&right)),
                _ => {
                    let (left, right) =
                        (left.in_real(Elementary::Lreal), right.in_real(Elementary::Lreal));
                    let of = Type::Elementary(Elementary::Bool);
                    let operation = Operation::Compare(comparison, Elementary::Lreal);
                    return Operand::Typed(apply(operation, vec![left, right], of));
                }
            };
            let holds = ordering.is_some_and(|ordering| match comparison {
                Comparison::Equal => ordering.is_eq(),
                Comparison::NotEqual => ordering.is_ne(),
                Comparison::Less => ordering.is_lt(),
                Comparison::LessOrEqual => ordering.is_le(),
                Comparison::Greater => ordering.is_gt(),
                Comparison::GreaterOrEqual => ordering.is_ge(),
            });
            return Operand::Typed(boolean(holds));
        }
        let is_zero = matches!(right, Number::Integer(0)) && matches!(left, Number::Integer(_));
        if is_zero && matches!(operator, Operator::Divide | Operator::Modulo) {
            self.error("U1046", "division of a whole number by 0", span.clone());
            return Operand::Faulty;
        }
        match left.operate(operator, right) {
            Some(value) => Operand::Number(value),
            None => self.no_result(span),
        }
    }

    /// A literal as it is beside a typed value.
    fn beside(
        &mut self,
        typed: Option<Type>,
        literal: Number,
        operator: Operator,
        hint: Option<&Type>,
    ) -> Option<Expression> {
        let settled = literal.default_type();
        let Some(of) = typed.as_ref().and_then(Type::elementary) else {
            return self.settle(Operand::Number(literal), None, &(0..0));
        };
        let target = match literal {
            Number::Real(..) if of.is_real() => of,
            Number::Real(..) if is_whole(of) => {
                let hinted = hint.and_then(Type::elementary).filter(|of| of.is_real());
                let single = if of.bits() == 64 { Elementary::Lreal } else { Elementary::Real };
                hinted.unwrap_or(single)
            }
            Number::Integer(_) if of.is_real() => of,
            Number::Integer(value) if is_whole(of) || of == Elementary::Bool => {
                let (least, most) = limits(of);
                match least <= value && value <= most {
                    true => of,
                    false => settled,
                }
            }
            // A time is scaled by a number.
            Number::Real(..) => Elementary::Lreal,
            Number::Integer(_) if matches!(operator, Operator::Power) => Elementary::Lreal,
            Number::Integer(_) => Elementary::Lint,
        };
        Some(match literal {
            _ if target.is_real() => literal.in_real(target),
            Number::Integer(value) => {
                number(Type::Elementary(target), value as u64 & target.mask())
            }
            Number::Real(..) => return None,
        })
    }

    fn comparison(
        &mut self,
        comparison: Comparison,
        left: Valued,
        right: Valued,
        span: &Span,
    ) -> Option<Valued> {
        let of = Type::Elementary(Elementary::Bool);
        if let (Type::Text(_), Type::Text(_)) = (&left.own, &right.own) {
            let operands = vec![left.value, right.value];
            return Some(Valued::typed(text(TextOperation::Compare(comparison), operands, of)));
        }
        let are_enumerations =
            matches!((&left.own, &right.own), (Type::Enumeration(..), Type::Enumeration(..)));
        let kinds = left.value.of.elementary().zip(right.value.of.elementary());
        let common = match kinds {
            Some(_) if are_enumerations && left.own != right.own => None,
            Some((left, right)) if left == right => Some(left),
            Some((left, right)) => comparable(left, right),
            None => None,
        };
        let Some(common) = common else {
            return self.do_not_fit("compared", &left.own, &right.own, span);
        };
        self.seen(&left, common, span);
        self.seen(&right, common, span);
        if is_whole(common) {
            // No type has all numbers of both.
            self.changed(&left.value, common, span);
            self.changed(&right.value, common, span);
        }
        let operands = vec![convert(left.value, common), convert(right.value, common)];
        Some(Valued::typed(apply(Operation::Compare(comparison, common), operands, of)))
    }

    /// Warns where the bits above those of a type are seen.
    fn seen(&mut self, operand: &Valued, of: Elementary, span: &Span) {
        if let Some(own) = operand.own.elementary().filter(|_| operand.is_wide()) {
            self.inverted(&operand.value, own, of.bits(), span);
        }
    }

    fn do_not_fit<T>(&mut self, what: &str, left: &Type, right: &Type, span: &Span) -> Option<T> {
        let (left, right) = (self.describe(left), self.describe(right));
        let message = format!("{left} and {right} cannot be {what}");
        let is_elementary = |name: &str| Elementary::ALL.iter().any(|of| of.name() == name);
        let help = if is_elementary(&left) && is_elementary(&right) {
            format!("convert one of them, such as with {}(…)", conversion(&right, &left))
        } else {
            "use values of one type".to_owned()
        };
        self.error_with("U1043", message, span.clone(), help);
        None
    }

    fn bitwise(
        &mut self,
        operator: Operator,
        left: Valued,
        right: Valued,
        span: &Span,
    ) -> Option<Valued> {
        let kinds = left.own.elementary().zip(right.own.elementary());
        let result = match kinds {
            Some((Elementary::Bool, Elementary::Bool)) => Some(Elementary::Bool),
            Some((left, right)) if is_whole(left) && is_whole(right) => {
                match (left.is_bit_string(), right.is_bit_string()) {
                    (true, false) if left.bits() >= right.bits() => Some(left),
                    (false, true) if right.bits() >= left.bits() => Some(right),
                    _ => common(left, right),
                }
            }
            _ => None,
        };
        let Some(result) = result else {
            return self.do_not_fit("combined bit by bit", &left.own, &right.own, span);
        };
        let operation = match operator {
            Operator::And => Operation::And,
            Operator::Or => Operation::Or,
            _ => Operation::Xor,
        };
        // Where both have no sign, or one type, the bits above are those that their result is extended with.
        let are_plain = !left.is_wide() && !right.is_wide();
        let are_alike = kinds
            .is_some_and(|(left, right)| left == right || !left.is_signed() && !right.is_signed());
        if is_narrow(result) && !(are_plain && are_alike) {
            let values = vec![left.widened(), right.widened()];
            let own = Type::Elementary(result);
            return Some(Valued { value: wide_bits(operation, values), own });
        }
        self.seen(&left, result, span);
        self.seen(&right, result, span);
        let bits = as_bits(result);
        let operands =
            [left, right].map(|operand| reinterpret(convert(operand.value, result), bits));
        let value = apply(operation(bits), operands.into(), Type::Elementary(bits));
        Some(Valued::typed(reinterpret(value, result)))
    }

    fn arithmetic(
        &mut self,
        operator: Operator,
        left: Valued,
        right: Valued,
        span: &Span,
    ) -> Option<Valued> {
        let kinds = left.own.elementary().zip(right.own.elementary());
        if let Some((from, to)) = kinds
            && (from.is_time() || to.is_time())
        {
            return match self.time_arithmetic(operator, left.value, right.value) {
                Some(value) => Some(Valued::typed(value)),
                None => self.do_not_fit("calculated with so", &left.own, &right.own, span),
            };
        }
        let found = kinds.and_then(|(left, right)| {
            let known = is_number(left) && is_number(right);
            common(left, right).filter(|_| known)
        });
        let Some(result) = found else {
            return self.do_not_fit("calculated with", &left.own, &right.own, span);
        };
        let of = if is_narrow(result) { WIDE } else { as_integer(result) };
        if let Some((left, right)) = kinds
            && matches!(operator, Operator::Divide | Operator::Modulo)
            && !of.is_real()
        {
            let leaves =
                |from: Elementary| limits(from).0 < limits(of).0 || limits(from).1 > limits(of).1;
            if leaves(left) || leaves(right) {
                let message = format!("{left} and {right} are divided as {of}");
                let help = "convert both to a type that has all their numbers";
                self.warn("U1080", message, span.clone(), help);
            }
        }
        let operation = match operator {
            Operator::Add => Operation::Add(of),
            Operator::Subtract => Operation::Subtract(of),
            Operator::Multiply => Operation::Multiply(of),
            Operator::Divide => Operation::Divide(of),
            _ if of.is_real() => {
                let message = format!("MOD needs whole numbers, and this is {of}");
                let help =
                    "convert both, such as with REAL_TO_DINT(…), or write x - y * FLOOR(x / y)";
                self.error_with("U1043", message, span.clone(), help);
                return None;
            }
            _ => Operation::Modulo(of),
        };
        let divides = matches!(operator, Operator::Divide | Operator::Modulo) && !of.is_real();
        let is_zero = matches!(right.value.kind, understudy_typed::ExpressionKind::Constant(0));
        if divides && is_zero {
            self.error("U1046", "division of a whole number by 0", span.clone());
            return None;
        }
        self.seen(&left, of, span);
        self.seen(&right, of, span);
        let operands = vec![convert(left.value, of), convert(right.value, of)];
        let value = apply(operation, operands, Type::Elementary(of));
        self.product(&value, span);
        Some(match is_narrow(result) {
            true => Valued { value, own: Type::Elementary(result) },
            false => Valued::typed(reinterpret(value, result)),
        })
    }

    fn power(
        &mut self,
        left: Valued,
        right: Valued,
        hint: Option<&Type>,
        span: &Span,
    ) -> Option<Valued> {
        let kinds = left.own.elementary().zip(right.own.elementary());
        let Some((base, exponent)) =
            kinds.filter(|(left, right)| is_number(*left) && is_number(*right))
        else {
            return self.do_not_fit("raised to a power", &left.own, &right.own, span);
        };
        let hinted = hint.and_then(Type::elementary).filter(|of| of.is_real());
        let of = match (base.is_real(), exponent.is_real()) {
            (true, _) => base,
            (false, true) => exponent,
            (false, false) => hinted.unwrap_or(Elementary::Lreal),
        };
        let operands = vec![convert(left.value, of), convert(right.value, of)];
        Some(Valued::typed(apply(Operation::Power(of), operands, Type::Elementary(of))))
    }
}
