//! Functions on dates and times that are not operators.

use understudy_typed::{Elementary, Expression, Operation, Type};

use crate::syntax;

use super::Lowering;
use crate::lower::fold::{apply, reinterpret};

impl Lowering<'_> {
    /// `CONCAT_DATE_TOD(date, time of day)`
    pub(super) fn date_and_time(&mut self, values: &[&syntax::Expression]) -> Option<Expression> {
        let date = self.expression(values[0], &Type::Elementary(Elementary::Date));
        let time = self.expression(values[1], &Type::Elementary(Elementary::TimeOfDay));
        let operands = [date?, time?].map(|value| reinterpret(value, Elementary::Lint));
        let of = Type::Elementary(Elementary::Lint);
        let sum = apply(Operation::Add(Elementary::Lint), operands.into(), of);
        Some(reinterpret(sum, Elementary::DateAndTime))
    }
}
