//! Functions on texts.

use understudy_typed::{Elementary, Expression, TextOperation, Type};

use crate::syntax;

use super::Lowering;
use crate::lower::fold::{convert, text};

impl Lowering<'_> {
    pub(super) fn text_call(
        &mut self,
        key: &str,
        values: &[&syntax::Expression],
        hint: Option<&Type>,
    ) -> Option<Expression> {
        let texts = match key {
            "CONCAT" => values.len(),
            "INSERT" | "REPLACE" | "FIND" => 2,
            _ => 1,
        };
        let mut operands = Vec::with_capacity(values.len());
        let mut capacity: u32 = 0;
        let mut is_whole = true;
        for value in &values[..texts] {
            match self.text_value(value) {
                Some((value, own)) => {
                    capacity += u32::from(own);
                    operands.push(value);
                }
                None => is_whole = false,
            }
        }
        for value in &values[texts..] {
            match self.long(value) {
                Some(value) => operands.push(value),
                None => is_whole = false,
            }
        }
        if !is_whole {
            return None;
        }
        let of = Type::Text(u16::try_from(capacity).unwrap_or(u16::MAX));
        let operation = match key {
            "LEN" => return self.counted_text(TextOperation::Length, operands, hint),
            "FIND" => return self.counted_text(TextOperation::Find, operands, hint),
            "LEFT" => TextOperation::Left,
            "RIGHT" => TextOperation::Right,
            "MID" => TextOperation::Middle,
            "CONCAT" => TextOperation::Concatenate,
            "INSERT" => TextOperation::Insert,
            "DELETE" => TextOperation::Delete,
            "REPLACE" => TextOperation::Replace,
            "UPPER_CASE" | "TO_UPPER" => TextOperation::UpperCase,
            "LOWER_CASE" | "TO_LOWER" => TextOperation::LowerCase,
            _ => return None,
        };
        Some(text(operation, operands, of))
    }

    /// LEN and FIND give an INT, or the integer that is wanted.
    fn counted_text(
        &mut self,
        operation: TextOperation,
        operands: Vec<Expression>,
        hint: Option<&Type>,
    ) -> Option<Expression> {
        let value = text(operation, operands, Type::Elementary(Elementary::Lint));
        let wanted = hint.and_then(Type::elementary);
        let wanted = wanted.filter(|of| of.is_integer() && of.bits() >= 16);
        Some(convert(value, wanted.unwrap_or(Elementary::Int)))
    }

    /// A text and how long it may be.
    pub(super) fn text_value(&mut self, value: &syntax::Expression) -> Option<(Expression, u16)> {
        let found = self.typed(value, None)?;
        match found.of {
            Type::Text(capacity) => Some((found, capacity)),
            _ => {
                let found = self.describe(&found.of);
                self.mismatch(
                    &found,
                    &Type::Text(super::super::types::DEFAULT_CAPACITY),
                    &value.span,
                )
            }
        }
    }
}
