//! Conditions: comparisons that jump.

use super::expression::{Compared, comparing};
use super::{Compiler, Label};
use crate::form::{Expression, ExpressionKind};
use crate::machine::instruction::Code;
use crate::operation::{Comparison, Operation};
use crate::types::Elementary;

impl Compiler<'_> {
    /// Goes to a label where a condition is as wanted, else on.
    pub(super) fn condition(&mut self, condition: &Expression, to: Label, wanted: bool) {
        match &condition.kind {
            ExpressionKind::Constant(value) => {
                if (*value != 0) == wanted {
                    self.jump(Code::Jump, 0, 0, to);
                }
            }
            ExpressionKind::Apply(Operation::Not(Elementary::Bool), operands) => {
                self.condition(&operands[0], to, !wanted);
            }
            ExpressionKind::Apply(Operation::Compare(comparison, of), operands) => {
                self.compare(*comparison, *of, operands, to, wanted);
            }
            ExpressionKind::Apply(Operation::And(Elementary::Bool), operands)
                if is_plain(&operands[1]) =>
            {
                self.both(&operands[0], &operands[1], to, wanted);
            }
            ExpressionKind::Apply(Operation::Or(Elementary::Bool), operands)
                if is_plain(&operands[1]) =>
            {
                self.either(&operands[0], &operands[1], to, wanted);
            }
            ExpressionKind::Choose(parts) => {
                let [first, second, third] = &**parts;
                let (otherwise, end) = (self.label(), self.label());
                self.scope(|compiler| compiler.condition(first, otherwise, false));
                self.scope(|compiler| compiler.condition(second, to, wanted));
                self.jump(Code::Jump, 0, 0, end);
                self.place_label(otherwise);
                self.scope(|compiler| compiler.condition(third, to, wanted));
                self.place_label(end);
            }
            _ => {
                let operand = self.operand(condition);
                let code = if wanted { Code::JumpIf } else { Code::JumpUnless };
                self.jump(code, operand, 0, to);
            }
        }
    }

    fn both(&mut self, first: &Expression, second: &Expression, to: Label, wanted: bool) {
        if !wanted {
            self.scope(|compiler| compiler.condition(first, to, false));
            self.scope(|compiler| compiler.condition(second, to, false));
            return;
        }
        let end = self.label();
        self.scope(|compiler| compiler.condition(first, end, false));
        self.scope(|compiler| compiler.condition(second, to, true));
        self.place_label(end);
    }

    fn either(&mut self, first: &Expression, second: &Expression, to: Label, wanted: bool) {
        if wanted {
            self.scope(|compiler| compiler.condition(first, to, true));
            self.scope(|compiler| compiler.condition(second, to, true));
            return;
        }
        let end = self.label();
        self.scope(|compiler| compiler.condition(first, end, true));
        self.scope(|compiler| compiler.condition(second, to, false));
        self.place_label(end);
    }

    fn compare(
        &mut self,
        comparison: Comparison,
        of: Elementary,
        operands: &[Expression],
        to: Label,
        wanted: bool,
    ) {
        let left = self.operand_before(&operands[0], &operands[1..]);
        let right = self.operand(&operands[1]);
        let Compared { code, is_exchanged } = comparing(comparison, of);
        let (left, right) = match is_exchanged {
            true => (right, left),
            false => (left, right),
        };
        let (code, is_exchanged) = jumping(code, wanted);
        match is_exchanged {
            true => self.jump(code, right, left, to),
            false => self.jump(code, left, right, to),
        }
    }
}

/// The jump where a comparison is as wanted, and whether its operands are exchanged. Of integers, not a < b is b <= a; of reals it is not.
fn jumping(code: Code, wanted: bool) -> (Code, bool) {
    let (if_true, if_false, is_exchanged) = match code {
        Code::Equal => (Code::JumpEqual, Code::JumpNotEqual, false),
        Code::NotEqual => (Code::JumpNotEqual, Code::JumpEqual, false),
        Code::LessU => (Code::JumpLessU, Code::JumpLessOrEqualU, true),
        Code::LessOrEqualU => (Code::JumpLessOrEqualU, Code::JumpLessU, true),
        Code::LessS8 => (Code::JumpLessS8, Code::JumpLessOrEqualS8, true),
        Code::LessOrEqualS8 => (Code::JumpLessOrEqualS8, Code::JumpLessS8, true),
        Code::LessS16 => (Code::JumpLessS16, Code::JumpLessOrEqualS16, true),
        Code::LessOrEqualS16 => (Code::JumpLessOrEqualS16, Code::JumpLessS16, true),
        Code::LessS32 => (Code::JumpLessS32, Code::JumpLessOrEqualS32, true),
        Code::LessOrEqualS32 => (Code::JumpLessOrEqualS32, Code::JumpLessS32, true),
        Code::LessS64 => (Code::JumpLessS64, Code::JumpLessOrEqualS64, true),
        Code::LessOrEqualS64 => (Code::JumpLessOrEqualS64, Code::JumpLessS64, true),
        Code::EqualReal => (Code::JumpEqualReal, Code::JumpNotEqualReal, false),
        Code::NotEqualReal => (Code::JumpNotEqualReal, Code::JumpEqualReal, false),
        Code::LessReal => (Code::JumpLessReal, Code::JumpNotLessReal, false),
        Code::LessOrEqualReal => (Code::JumpLessOrEqualReal, Code::JumpNotLessOrEqualReal, false),
        Code::EqualLreal => (Code::JumpEqualLreal, Code::JumpNotEqualLreal, false),
        Code::NotEqualLreal => (Code::JumpNotEqualLreal, Code::JumpEqualLreal, false),
        Code::LessLreal => (Code::JumpLessLreal, Code::JumpNotLessLreal, false),
        _ => (Code::JumpLessOrEqualLreal, Code::JumpNotLessOrEqualLreal, false),
    };
    match wanted {
        true => (if_true, false),
        false => (if_false, is_exchanged),
    }
}

/// Whether an expression can neither change anything nor be a fault, so that it need not be evaluated.
pub(super) fn is_plain(expression: &Expression) -> bool {
    let mut plain = true;
    crate::visit::in_expression(expression, &mut |inner| {
        plain &= match &inner.kind {
            ExpressionKind::Load(place) => place.indices.is_empty() && !place.is_by_reference(),
            ExpressionKind::Apply(operation, _) => !matches!(
                operation,
                Operation::Divide(_) | Operation::Multiplex(_) | Operation::Text(_)
            ),
            ExpressionKind::Call(_) => false,
            _ => true,
        };
    });
    plain
}
