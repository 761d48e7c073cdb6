//! Functions of reals.

use understudy_typed::{Elementary, Expression, Operation, RealFunction, Type};

use crate::lower::Lowering;
use crate::lower::convert::{as_integer, is_number};
use crate::lower::fold::{apply, convert, reinterpret};
use crate::lower::numbers::Operand;
use crate::syntax;

impl Lowering<'_> {
    /// A value as a real: what is whole becomes the real type of the hint, else LREAL.
    pub(super) fn real_value(
        &mut self,
        value: &syntax::Expression,
        hint: Option<&Type>,
    ) -> Option<(Expression, Elementary)> {
        let hint = hint.filter(|of| of.elementary().is_some_and(Elementary::is_real));
        let hinted = hint.and_then(Type::elementary);
        let operand = self.operand(value, hint);
        if let Operand::Number(value) = operand {
            let of = hinted.unwrap_or(Elementary::Lreal);
            return Some((value.in_real(of), of));
        }
        let found = self.settle(operand, hint, &value.span)?;
        match found.of.elementary() {
            Some(of) if of.is_real() => Some((found, of)),
            Some(of) if is_number(of) => {
                let of = hinted.unwrap_or(Elementary::Lreal);
                Some((convert(found, of), of))
            }
            _ => {
                let found = self.describe(&found.of);
                let message = format!("expected a REAL or LREAL, found {found}");
                let help = "convert it first, such as with TO_REAL(…)";
                self.error_with("U1043", message, value.span.clone(), help);
                None
            }
        }
    }

    pub(super) fn real_call(
        &mut self,
        function: RealFunction,
        value: &syntax::Expression,
        hint: Option<&Type>,
    ) -> Option<Expression> {
        let (value, of) = self.real_value(value, hint)?;
        Some(apply(Operation::Real(function, of), vec![value], Type::Elementary(of)))
    }

    /// FLOOR, CEIL, ROUND: of the type that is wanted, DINT where none is.
    pub(super) fn rounded(
        &mut self,
        key: &str,
        value: &syntax::Expression,
        hint: Option<&Type>,
    ) -> Option<Expression> {
        let (value, of) = self.real_value(value, hint)?;
        let real = |function, value| {
            apply(Operation::Real(function, of), vec![value], Type::Elementary(of))
        };
        let rounded = match key {
            "FLOOR" => real(RealFunction::Floor, value),
            "CEIL" => real(RealFunction::Ceiling, value),
            "ROUND" => real(RealFunction::Round, value),
            _ => {
                let whole = apply(
                    Operation::Truncate(of, Elementary::Lint),
                    vec![value.clone()],
                    Type::Elementary(Elementary::Lint),
                );
                let operands = vec![value, convert(whole, of)];
                return Some(apply(Operation::Subtract(of), operands, Type::Elementary(of)));
            }
        };
        match hint.and_then(Type::elementary) {
            Some(wanted) if wanted.is_real() => Some(rounded),
            Some(wanted) if wanted.is_integer() => Some(convert(rounded, wanted)),
            _ => Some(convert(rounded, Elementary::Dint)),
        }
    }

    pub(super) fn absolute(
        &mut self,
        value: &syntax::Expression,
        hint: Option<&Type>,
    ) -> Option<Expression> {
        let found = self.typed(value, hint)?;
        match found.of.elementary() {
            Some(of) if is_number(of) || of == Elementary::Time => {
                let of = as_integer(of);
                let found = reinterpret(found, of);
                Some(apply(Operation::Absolute(of), vec![found], Type::Elementary(of)))
            }
            _ => self.not_a_number(&found, &value.span),
        }
    }
}
