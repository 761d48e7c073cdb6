//! Choices without a jump: `IF condition THEN variable := value; END_IF` of what is evaluated fast.
//!
//! A jump that a processor does not foresee takes as long as ten instructions. So the value is computed whatever the condition, which has no effect
//! where the value can neither fault nor change anything, and the variable takes it where the condition is TRUE. In a loop conditions are less often
//! foreseen than elsewhere, so more is evaluated there.

use super::Compiler;
use super::condition::is_plain;
use super::place::Location;
use crate::form::{Branch, Expression, ExpressionKind, Place, Statement, StatementKind};
use crate::machine::instruction::Code;
use crate::operation::Operation;

/// Operations that are never evaluated in vain.
const SLOW: usize = 100;

impl Compiler<'_> {
    /// Assigns without a jump; `None` where that is no gain.
    pub(super) fn assign_if(&mut self, branches: &[Branch], otherwise: &[Statement]) -> Option<()> {
        let ([branch], []) = (branches, otherwise) else {
            return None;
        };
        let [statement] = &*branch.body else {
            return None;
        };
        let StatementKind::Assign(place, value) = &statement.kind else {
            return None;
        };
        let most = usize::from(!self.loops.is_empty());
        let is_fast = |expression| operations(expression).is_some_and(|count| count <= most);
        let of = place.of.elementary()?;
        let is_variable = place.indices.is_empty() && !place.is_by_reference();
        if !is_variable || !is_fast(value) || !is_test(&branch.condition, most) {
            return None;
        }
        let Location::Slot(slot) = self.location(place, of) else {
            return None;
        };
        let condition = self.operand(&branch.condition);
        if is_next(place, value) && matches!(branch.condition.kind, ExpressionKind::Apply(..)) {
            // FALSE and TRUE are 0 and 1.
            self.add(of, slot, condition);
        } else {
            let value = self.operand(value);
            self.emit(Code::MoveIf, slot, value, condition);
        }
        Some(())
    }
}

/// A condition that is a variable, or one comparison where operations are wanted.
fn is_test(condition: &Expression, most: usize) -> bool {
    let is_comparison = matches!(
        condition.kind,
        ExpressionKind::Load(_) | ExpressionKind::Apply(Operation::Compare(..), _)
    );
    is_comparison && operations(condition).is_some_and(|count| count <= 2 * most)
}

/// Whether a value is that of the variable and 1.
fn is_next(place: &Place, value: &Expression) -> bool {
    let ExpressionKind::Apply(Operation::Add(of), operands) = &value.kind else {
        return false;
    };
    let [Expression { kind: ExpressionKind::Load(loaded), .. }, added] = &**operands else {
        return false;
    };
    let is_one = matches!(added.kind, ExpressionKind::Constant(1));
    let is_same = (loaded.root, loaded.offset, loaded.bit) == (place.root, place.offset, place.bit);
    is_one && is_same && loaded.indices.is_empty() && !of.is_real()
}

/// Operations of an expression that can neither fault nor change anything.
fn operations(expression: &Expression) -> Option<usize> {
    let mut count = 0;
    crate::visit::in_expression(expression, &mut |inner| {
        count += match inner.kind {
            ExpressionKind::Constant(_) | ExpressionKind::Load(_) => 0,
            ExpressionKind::Apply(Operation::Real(..) | Operation::Power(_), _) => SLOW,
            ExpressionKind::Apply(..) => 1,
            _ => SLOW,
        };
    });
    is_plain(expression).then_some(count)
}
