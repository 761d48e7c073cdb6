//! Two operations in one instruction. Each is rounded as if it stood alone.

use super::Compiler;
use crate::form::{Expression, ExpressionKind};
use crate::machine::instruction::Code;
use crate::operation::{Comparison, Operation};
use crate::types::Elementary;

impl Compiler<'_> {
    /// `to` := an operation of which one operand is an operation, where there is an instruction for both.
    pub(super) fn apply_two(
        &mut self,
        operation: Operation,
        operands: &[Expression],
        to: u32,
    ) -> Option<()> {
        if let (Operation::Absolute(of), [difference]) = (operation, operands) {
            let code = match of {
                Elementary::Real => Code::DistanceReal,
                Elementary::Lreal => Code::DistanceLreal,
                _ => return None,
            };
            let is_difference = |operation| matches!(operation, Operation::Subtract(_));
            let [first, second] = inner(difference, is_difference)?;
            let operands = self.operands(&[first, second]);
            self.emit(code, to, operands[0], operands[1]);
            return Some(());
        }
        let [first, second] = operands else {
            return None;
        };
        match operation {
            Operation::And(_) => {
                if let Some([inner]) = inner(second, is_not) {
                    let operands = self.operands(&[first, inner]);
                    self.emit(Code::AndNot, to, operands[0], operands[1]);
                } else {
                    let [inner] = inner(first, is_not)?;
                    let operands = self.operands(&[inner, second]);
                    self.emit(Code::AndNot, to, operands[1], operands[0]);
                }
            }
            Operation::Add(of) => {
                let code = match of {
                    Elementary::Real => Code::MultiplyAddReal,
                    Elementary::Lreal => Code::MultiplyAddLreal,
                    _ => match of.bits() {
                        16 => Code::MultiplyAdd16,
                        32 => Code::MultiplyAdd32,
                        64 => Code::MultiplyAdd64,
                        _ => return None,
                    },
                };
                if let Some([left, right]) = inner(second, is_product) {
                    let operands = self.operands(&[first, left, right]);
                    self.emit(code, to, operands[1], operands[2]);
                    self.emit(Code::Data, operands[0], 0, 0);
                } else {
                    let [left, right] = inner(first, is_product)?;
                    let operands = self.operands(&[left, right, second]);
                    self.emit(code, to, operands[0], operands[1]);
                    self.emit(Code::Data, operands[2], 0, 0);
                }
            }
            Operation::Subtract(of) => {
                let code = match of {
                    Elementary::Real => Code::MultiplySubtractReal,
                    Elementary::Lreal => Code::MultiplySubtractLreal,
                    _ => return None,
                };
                let [left, right] = inner(second, is_product)?;
                let operands = self.operands(&[first, left, right]);
                self.emit(code, to, operands[1], operands[2]);
                self.emit(Code::Data, operands[0], 0, 0);
            }
            Operation::Compare(comparison, _) => {
                let (word, at) = tested_bit(comparison, first, second)?;
                let word = self.operand(word);
                let mask = self.constant(1);
                self.emit_with(Code::Extract, at, to, word, mask);
            }
            _ => return None,
        }
        Some(())
    }
}

/// The word and the place of the bit that a comparison tests: `word AND mask = mask` or `word AND mask <> 0`, where the mask has one bit.
fn tested_bit<'e>(
    comparison: Comparison,
    first: &'e Expression,
    second: &Expression,
) -> Option<(&'e Expression, u8)> {
    let is_and = |operation| matches!(operation, Operation::And(_));
    let [word, mask] = inner(first, is_and)?;
    let (mask, wanted) = (constant(mask)?, constant(second)?);
    let is_test = match comparison {
        Comparison::Equal => wanted == mask,
        Comparison::NotEqual => wanted == 0,
        _ => false,
    };
    (is_test && mask.is_power_of_two()).then_some((word, mask.trailing_zeros() as u8))
}

fn constant(expression: &Expression) -> Option<u64> {
    match expression.kind {
        ExpressionKind::Constant(value) => Some(value),
        _ => None,
    }
}

/// The operands of an expression that is such an operation.
fn inner<const N: usize>(
    expression: &Expression,
    is_such: fn(Operation) -> bool,
) -> Option<&[Expression; N]> {
    match &expression.kind {
        ExpressionKind::Apply(operation, operands) if is_such(*operation) => {
            operands.as_slice().try_into().ok()
        }
        _ => None,
    }
}

fn is_not(operation: Operation) -> bool {
    matches!(operation, Operation::Not(_))
}

fn is_product(operation: Operation) -> bool {
    matches!(operation, Operation::Multiply(_))
}
