//! What lies at a distance from the start of a variable: the meaning of pointers that only ever point into one.

use understudy_typed::{Comparison, Elementary, Expression, Index, Operation, TextOperation, Type};

use crate::syntax::{self, Span};

use super::{Lowering, lint};
use crate::lower::convert::is_whole;
use crate::lower::fold::{apply, choose, convert, reinterpret, text};
use crate::lower::places::load;

impl Lowering<'_> {
    /// The value at a distance in bytes, as a type; a distance outside of the variable is a fault.
    pub(super) fn pointed(
        &mut self,
        values: &[&syntax::Expression],
        span: &Span,
    ) -> Option<Expression> {
        let of = self.pointed_type(values[2])?;
        let found = self.typed(values[0], None)?;
        let distance = self.long(values[1])?;
        let elementary = found.of.elementary();
        match &found.of {
            Type::Text(capacity) if of.bits() == 8 && is_whole(of) => {
                let most = i64::from(*capacity);
                let long = Type::Elementary(Elementary::Lint);
                let operands = vec![distance.clone(), lint(1)];
                let position = apply(Operation::Add(Elementary::Lint), operands, long);
                let byte = Type::Elementary(Elementary::Byte);
                let value = text(TextOperation::Byte, vec![found, position], byte);
                Some(within(distance, most, reinterpret(value, of)))
            }
            Type::Array(array) if array.element == Type::Elementary(of) && of.bits() >= 8 => {
                let syntax::ExpressionKind::Variable(path) = &values[0].kind else {
                    return None;
                };
                let mut place = self.target(path)?.place;
                place.indices.push(Index {
                    value: element(distance, i64::from(of.bits() / 8)),
                    low: 0,
                    high: i64::try_from(array.length()).ok()? - 1,
                    stride: array.stride(),
                });
                place.is_packed = true;
                place.of = array.element.clone();
                Some(load(place))
            }
            _ if elementary.is_some_and(|own| own.bits() == of.bits()) && of.bits() >= 8 => {
                Some(within(distance, 0, same_bits(found, of)))
            }
            _ => self.not_pointed(&found.of, of, span),
        }
    }

    /// The value of a variable that has the bits of another value.
    pub(super) fn pointed_stored(
        &mut self,
        values: &[&syntax::Expression],
        span: &Span,
    ) -> Option<Expression> {
        let of = self.pointed_type(values[2])?;
        let found = self.typed(values[0], None)?;
        let distance = self.long(values[1])?;
        let value = self.expression(values[3], &Type::Elementary(of))?;
        match found.of.elementary() {
            Some(own) if own.bits() == of.bits() && of.bits() >= 8 => {
                Some(within(distance, 0, same_bits(value, own)))
            }
            _ => self.not_pointed(&found.of, of, span),
        }
    }

    fn pointed_type(&mut self, value: &syntax::Expression) -> Option<Elementary> {
        let syntax::ExpressionKind::Variable(path) = &value.kind else {
            return None;
        };
        let kind = syntax::TypeKind::Named(path.root.clone());
        let span = value.span.clone();
        let found = self.resolve(&syntax::TypeName { kind, span })?;
        let elementary = found.of.elementary();
        if elementary.is_none() {
            let shown = self.describe(&found.of);
            let message = format!("a pointer to {shown} is not supported");
            let help = "pass the variable as VAR_IN_OUT";
            self.error_with("U1040", message, value.span.clone(), help);
        }
        elementary
    }

    fn not_pointed<T>(&mut self, found: &Type, of: Elementary, span: &Span) -> Option<T> {
        let shown = self.describe(found);
        let message = format!("a pointer to {of} that points into {shown} is not supported");
        let help = "read the variable itself, or pass it as VAR_IN_OUT";
        self.error_with("U1040", message, span.clone(), help);
        None
    }
}

/// The same bits as another type; a real is never anything else on the way.
fn same_bits(value: Expression, of: Elementary) -> Expression {
    match value.of.elementary() {
        Some(own) if own == of => value,
        _ => apply(
            Operation::Reinterpret(value.of.elementary().unwrap_or(of), of),
            vec![value],
            Type::Elementary(of),
        ),
    }
}

/// A value where a distance is from 0 to the most that is permitted; another one is a fault.
fn within(distance: Expression, most: i64, value: Expression) -> Expression {
    let bool = Type::Elementary(Elementary::Bool);
    let compare = |comparison, limit| {
        let operands = vec![distance.clone(), lint(limit)];
        let operation = Operation::Compare(comparison, Elementary::Lint);
        apply(operation, operands, bool.clone())
    };
    let (least, most) =
        (compare(Comparison::GreaterOrEqual, 0), compare(Comparison::LessOrEqual, most));
    let operands = vec![least, most];
    let is_within = apply(Operation::And(Elementary::Bool), operands, bool);
    let which = choose(is_within, lint(0), lint(1));
    let of = value.of.elementary().unwrap_or(Elementary::Byte);
    let as_type = value.of.clone();
    apply(Operation::Multiplex(of), vec![which, value], as_type)
}

/// The number of the element at a distance; none where it is within one.
fn element(distance: Expression, size: i64) -> Expression {
    let long = Type::Elementary(Elementary::Lint);
    let parted = |operation: fn(Elementary) -> Operation| {
        let operands = vec![distance.clone(), lint(size)];
        apply(operation(Elementary::Lint), operands, long.clone())
    };
    let rest = parted(Operation::Modulo);
    let bool = Type::Elementary(Elementary::Bool);
    let operation = Operation::Compare(Comparison::Equal, Elementary::Lint);
    let is_whole = apply(operation, vec![rest, lint(0)], bool);
    convert(choose(is_whole, parted(Operation::Divide), lint(-1)), Elementary::Lint)
}
