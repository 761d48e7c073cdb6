//! Two operations in one instruction. Each is rounded as if it stood alone.

use super::Compiler;
use crate::form::{Expression, ExpressionKind};
use crate::machine::instruction::Code;
use crate::operation::Operation;
use crate::types::Elementary;

impl Compiler<'_> {
    /// `to` := an operation of which one operand is an operation, where there is an instruction for both.
    pub(super) fn apply_two(
        &mut self,
        operation: Operation,
        operands: &[Expression],
        to: u32,
    ) -> Option<()> {
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
                    Elementary::Dint | Elementary::Udint => Code::MultiplyAdd32,
                    Elementary::Real => Code::MultiplyAddReal,
                    Elementary::Lreal => Code::MultiplyAddLreal,
                    _ => return None,
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
            _ => return None,
        }
        Some(())
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
