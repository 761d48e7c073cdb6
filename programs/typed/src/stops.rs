//! Whether a scan of a program can stop by a fault, told by its text alone: no value is followed but the counters of loops.

use std::collections::HashSet;

use crate::cost::{Cost, turns};
use crate::form::{
    Argument, Expression, ExpressionKind, For, Index, Place, Program, RoutineId, Statement,
    StatementKind,
};
use crate::operation::Operation;
use crate::types::{Elementary, Type};
use crate::visit;

impl Program {
    /// Whether a scan may end in a [`Fault`](crate::Fault). Where it says no, none does, whatever the inputs are.
    ///
    /// A division by a constant, and an index that is the counter of a loop within the bounds of the array, stop no program.
    pub fn can_fault(&self) -> bool {
        let has_reals = self.outputs.iter().any(|point| point.of.is_real());
        has_reals || Cost::new(self).is_bounded_by_budget() || {
            let mut reached = HashSet::new();
            let mut pending: Vec<RoutineId> = self.tasks.iter().map(|task| task.routine).collect();
            while let Some(id) = pending.pop() {
                if reached.insert(id) {
                    visit::calls(&self.routine(id).body, &mut |called| pending.push(called));
                }
            }
            reached.into_iter().any(|id| Counters::default().can_fault(&self.routine(id).body))
        }
    }
}

/// The loops around a statement whose counters take the numbers between their bounds and no other.
#[derive(Default)]
struct Counters<'p>(Vec<(&'p Place, i128, i128)>);

impl<'p> Counters<'p> {
    fn can_fault(&mut self, statements: &'p [Statement]) -> bool {
        statements.iter().any(|statement| self.statement(&statement.kind))
    }

    fn statement(&mut self, statement: &'p StatementKind) -> bool {
        let stops = match statement {
            StatementKind::Assign(place, value) => {
                !fits(place, value) || self.place(place) || self.expression(value)
            }
            StatementKind::Bind(slot, place) => self.place(slot) || self.place(place),
            StatementKind::Invoke(_, place) => self.place(place),
            StatementKind::Evaluate(value) | StatementKind::Case(value, ..) => {
                self.expression(value)
            }
            StatementKind::If(branches, _) => {
                branches.iter().any(|branch| self.expression(&branch.condition))
            }
            StatementKind::For(each) => return self.repeated(each),
            StatementKind::While(condition, _) | StatementKind::Repeat(_, condition) => {
                self.expression(condition)
            }
            StatementKind::Exit | StatementKind::Continue | StatementKind::Return => false,
        };
        stops || visit::bodies_of(statement).into_iter().any(|body| self.can_fault(body))
    }

    fn repeated(&mut self, each: &'p For) -> bool {
        let once = [&each.from, &each.to, &each.by];
        if self.place(&each.counter) || once.into_iter().any(|value| self.expression(value)) {
            return true;
        }
        let bounds =
            turns(each).and_then(|_| Some((self.number(&each.from)?, self.number(&each.to)?)));
        let Some(((from, _), (to, _))) = bounds else {
            return self.can_fault(&each.body);
        };
        self.0.push((&each.counter, from.min(to), from.max(to)));
        let stops = self.can_fault(&each.body);
        self.0.pop();
        stops
    }

    fn place(&self, place: &Place) -> bool {
        place.is_by_reference() || place.indices.iter().any(|index| self.index(index))
    }

    fn index(&self, index: &Index) -> bool {
        let within = |(low, high)| i128::from(index.low) <= low && high <= i128::from(index.high);
        self.expression(&index.value) || !self.number(&index.value).is_some_and(within)
    }

    /// Between which numbers an expression of constants and counters lies.
    fn number(&self, expression: &Expression) -> Option<(i128, i128)> {
        let of = expression.of.elementary()?;
        let is_of = |(low, high): (i128, i128)| {
            let (least, most) = of.limits();
            (!of.is_real() && least <= low && high <= most).then_some((low, high))
        };
        match &expression.kind {
            ExpressionKind::Constant(stored) if !of.is_real() => {
                let number = of.signed(*stored);
                Some((number, number))
            }
            ExpressionKind::Load(place) => {
                let is_it = |counter: &Place| {
                    counter.root == place.root
                        && (counter.offset, counter.bit) == (place.offset, place.bit)
                        && place.indices.is_empty()
                };
                let known = self.0.iter().rev().find(|(counter, ..)| is_it(counter));
                known.map(|(_, low, high)| (*low, *high))
            }
            ExpressionKind::Apply(Operation::Convert(from, _), operands) if !from.is_real() => {
                is_of(self.number(operands.first()?)?)
            }
            ExpressionKind::Apply(operation, operands) => {
                let [one, other] = operands.as_slice() else { return None };
                let ((low, high), (least, most)) = (self.number(one)?, self.number(other)?);
                match operation {
                    Operation::Add(_) => is_of((low + least, high + most)),
                    Operation::Subtract(_) => is_of((low - most, high - least)),
                    _ => None,
                }
            }
            _ => None,
        }
    }

    fn expression(&self, expression: &Expression) -> bool {
        match &expression.kind {
            ExpressionKind::Constant(_) | ExpressionKind::Text(_) => false,
            ExpressionKind::Load(place) => self.place(place),
            ExpressionKind::Apply(operation, operands) => {
                let stops = match operation {
                    Operation::Divide(of) | Operation::Modulo(of) => {
                        !of.is_real() && !operands.get(1).is_some_and(is_constant_but_zero)
                    }
                    Operation::Multiplex(_) => true,
                    _ => false,
                };
                stops || operands.iter().any(|operand| self.expression(operand))
            }
            ExpressionKind::Choose(parts) => parts.iter().any(|part| self.expression(part)),
            ExpressionKind::Call(call) => {
                call.own.as_ref().is_some_and(|own| self.place(own))
                    || call.arguments.iter().any(|argument| match argument {
                        Argument::Value(place, value) => {
                            !fits(place, value) || self.expression(value)
                        }
                        Argument::Reference(_, place) => self.place(place),
                    })
                    || call
                        .outputs
                        .iter()
                        .any(|(_, to)| matches!(to.of, Type::Text(_)) || self.place(to))
            }
        }
    }
}

/// Whether a value is no text, or one that its place holds whatever is in it.
fn fits(place: &Place, value: &Expression) -> bool {
    let Type::Text(capacity) = place.of else {
        return true;
    };
    match &value.kind {
        ExpressionKind::Text(text) => text.len() <= capacity as usize,
        ExpressionKind::Load(from) => matches!(from.of, Type::Text(most) if most <= capacity),
        _ => false,
    }
}

fn is_constant_but_zero(expression: &Expression) -> bool {
    let of = expression.of.elementary().unwrap_or(Elementary::Bool);
    matches!(expression.kind, ExpressionKind::Constant(stored) if stored & of.mask() != 0)
}
