//! Operators on times and dates.

use understudy_typed::{Elementary, Expression, Operation, Type};

use crate::syntax::Operator;

use super::Lowering;
use super::convert::is_number;
use super::fold::{apply, convert, reinterpret};

impl Lowering<'_> {
    /// The operator between a time and another time or a number; nothing where they have none.
    pub(super) fn time_arithmetic(
        &mut self,
        operator: Operator,
        left: Expression,
        right: Expression,
    ) -> Option<Expression> {
        use Elementary::{Lint, Lreal, Time};
        let (from, to) = left.of.elementary().zip(right.of.elementary())?;
        let plain = |operation: fn(Elementary) -> Operation, left, right, result| {
            let operands = vec![reinterpret(left, Lint), reinterpret(right, Lint)];
            let value = apply(operation(Lint), operands, Type::Elementary(Lint));
            Some(reinterpret(value, result))
        };
        match operator {
            Operator::Add if to == Time && from.is_time() => {
                plain(Operation::Add, left, right, from)
            }
            Operator::Add if from == Time && to.is_time() => plain(Operation::Add, left, right, to),
            Operator::Subtract if to == Time && from.is_time() => {
                plain(Operation::Subtract, left, right, from)
            }
            Operator::Subtract if from == to => plain(Operation::Subtract, left, right, Time),
            Operator::Modulo if from == Time && to == Time => {
                plain(Operation::Modulo, left, right, Time)
            }
            Operator::Multiply if to == Time && is_number(from) => {
                self.time_arithmetic(operator, right, left)
            }
            Operator::Multiply | Operator::Divide if from == Time && is_number(to) => {
                let operation = match operator {
                    Operator::Multiply => Operation::Multiply,
                    _ => Operation::Divide,
                };
                if to.is_real() {
                    let operands = vec![convert(left, Lreal), convert(right, Lreal)];
                    let value = apply(operation(Lreal), operands, Type::Elementary(Lreal));
                    return Some(convert(value, Time));
                }
                plain(operation, left, convert(right, Lint), Time)
            }
            _ => None,
        }
    }
}
