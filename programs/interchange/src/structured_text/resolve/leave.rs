//! RETURN, EXIT and CONTINUE: bits that say what has been left, and choices around what comes behind.
//!
//! ```text
//! IF a THEN RETURN; END_IF;      IF a THEN returned := TRUE; END_IF;
//! y := b;                        IF NOT returned THEN y := b; END_IF;
//! ```

use std::ops::Range;

use super::super::program::{Action, Role, Truth};
use super::super::syntax::{Leave, Statement, StatementKind, Unit};
use super::Resolver;

/// The bits of what can be left here, by what it is; the innermost loop is last.
#[derive(Debug, Default)]
pub(super) struct Left {
    returned: Option<usize>,
    /// EXIT and CONTINUE of each loop around.
    loops: Vec<(Option<usize>, Option<usize>)>,
}

/// What a statement may leave, loops in it aside.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Leaves {
    unit: bool,
    around: bool,
    turn: bool,
}

impl Leaves {
    pub(super) fn any(self) -> bool {
        self.unit || self.around || self.turn
    }

    /// What one or the other may leave.
    pub(super) fn and(self, other: Self) -> Self {
        Self {
            unit: self.unit || other.unit,
            around: self.around || other.around,
            turn: self.turn || other.turn,
        }
    }
}

/// What the statements may leave.
pub(super) fn leaves(body: &[Statement]) -> Leaves {
    let all = body.iter().map(leaves_of);
    all.fold(Leaves::default(), Leaves::and)
}

/// What one statement may leave; a loop keeps to itself what leaves it or ends a turn of it.
pub(super) fn leaves_of(statement: &Statement) -> Leaves {
    let none = Leaves::default();
    match &statement.kind {
        StatementKind::Leave(Leave::Unit) => Leaves { unit: true, ..none },
        StatementKind::Leave(Leave::Loop) => Leaves {
            around: true,
            ..none
        },
        StatementKind::Leave(Leave::Turn) => Leaves { turn: true, ..none },
        StatementKind::If(branches, otherwise) => {
            let bodies = branches.iter().map(|(_, branch)| leaves(branch));
            bodies.fold(leaves(otherwise), Leaves::and)
        }
        StatementKind::Case(_, branches, otherwise) => {
            let bodies = branches.iter().map(|(_, branch)| leaves(branch));
            bodies.fold(leaves(otherwise), Leaves::and)
        }
        StatementKind::For(content) => Leaves {
            unit: leaves(&content.body).unit,
            ..none
        },
        StatementKind::Assign(..)
        | StatementKind::Call(..)
        | StatementKind::Refused(_)
        | StatementKind::Nothing => none,
    }
}

impl Resolver {
    /// Begins an execution of a unit; the answer is for [`Self::leave_unit`].
    pub(super) fn enter_unit(&mut self, instance: usize, unit: &Unit) -> Left {
        let returned = leaves(&unit.body).unit.then(|| {
            let wanted = self.path_of(instance, "returned");
            self.flag(&wanted, unit.name.span())
        });
        let entered = Left {
            returned,
            loops: Vec::new(),
        };
        std::mem::replace(&mut self.left, entered)
    }

    pub(super) fn leave_unit(&mut self, around: Left) {
        self.left = around;
    }

    pub(super) fn enter_loop(&mut self, instance: usize, body: &[Statement], span: &Range<usize>) {
        let found = leaves(body);
        let mut bit = |wanted, is_left: bool| {
            is_left.then(|| {
                let wanted = self.path_of(instance, wanted);
                self.flag(&wanted, span.clone())
            })
        };
        let bits = (bit("exited", found.around), bit("skipped", found.turn));
        self.left.loops.push(bits);
    }

    pub(super) fn leave_loop(&mut self) {
        self.left.loops.pop();
    }

    /// A turn of the innermost loop begins.
    pub(super) fn begin_turn(&mut self, span: &Range<usize>) {
        if let Some((_, Some(skipped))) = self.left.loops.last() {
            let action = Action::SetTruth(*skipped, Truth::Constant(false));
            self.push(action, span.clone(), Vec::new());
        }
    }

    /// A bit that is 0 from here.
    fn flag(&mut self, wanted: &str, span: Range<usize>) -> usize {
        let cell = self.add_bit(wanted.to_owned(), Role::Memory, &span);
        let action = Action::SetTruth(cell, Truth::Constant(false));
        self.push(action, span, Vec::new());
        cell
    }

    /// Leaves what the statement says.
    pub(super) fn leave(&mut self, what: Leave, span: Range<usize>) {
        let innermost = self.left.loops.last();
        let bit = match what {
            Leave::Unit => self.left.returned,
            Leave::Loop => innermost.and_then(|(exited, _)| *exited),
            Leave::Turn => innermost.and_then(|(_, skipped)| *skipped),
        };
        match bit {
            Some(bit) => {
                let action = Action::SetTruth(bit, Truth::Constant(true));
                self.push(action, span, Vec::new());
            }
            None => self.error("U1040", "EXIT and CONTINUE stand in a loop", span),
        }
    }

    /// Whether nothing has been left of what `leaves` may leave.
    pub(super) fn still_here(&self, leaves: Leaves) -> Truth {
        let (exited, skipped) = self.left.loops.last().copied().unwrap_or_default();
        let bits = [
            self.left.returned.filter(|_| leaves.unit),
            exited.filter(|_| leaves.around),
            skipped.filter(|_| leaves.turn),
        ];
        let bits = bits.into_iter().flatten().map(Truth::Cell);
        Truth::Not(Box::new(Truth::Any(bits.collect())))
    }

    /// What leaves the turns of a loop for good: RETURN and EXIT.
    pub(super) fn ends_loop(body: &[Statement]) -> Leaves {
        Leaves {
            turn: false,
            ..leaves(body)
        }
    }

    /// Steps that `make` makes, under a condition.
    pub(super) fn under(
        &mut self,
        condition: Truth,
        span: &Range<usize>,
        make: impl FnOnce(&mut Self),
    ) {
        let around = std::mem::take(&mut self.steps);
        make(self);
        let inner = std::mem::replace(&mut self.steps, around);
        if !inner.is_empty() {
            self.push(
                Action::If(vec![(condition, inner)], Vec::new()),
                span.clone(),
                Vec::new(),
            );
        }
    }
}
