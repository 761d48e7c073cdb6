//! Statements, expressions and places of a routine.

use super::Check;
use crate::form::{
    Argument, Call, Expression, ExpressionKind, Place, Program, Root, Routine, RoutineId,
    RoutineKind, Statement, StatementKind,
};
use crate::operation::Operand;
use crate::types::{Elementary, Type};

/// Shows every place of a routine's own code.
pub(super) fn places<'a>(statements: &'a [Statement], show: &mut dyn FnMut(&'a Place)) {
    crate::visit::writes(statements, show);
    crate::visit::expressions(statements, &mut |expression| match &expression.kind {
        ExpressionKind::Load(place) => show(place),
        ExpressionKind::Call(call) => {
            if let Some(own) = &call.own {
                show(own);
            }
        }
        _ => {}
    });
}

impl Check<'_> {
    pub(super) fn statements(
        &mut self,
        routine: &Routine,
        statements: &[Statement],
        depth: usize,
        is_loop: bool,
    ) {
        self.expect(depth <= Program::NESTING, || "statements are nested too deep".to_owned());
        if depth > Program::NESTING {
            return;
        }
        for statement in statements {
            self.line = statement.line;
            self.statement(routine, statement, is_loop);
            let is_loop = is_loop
                || matches!(
                    statement.kind,
                    StatementKind::For(_) | StatementKind::While(..) | StatementKind::Repeat(..)
                );
            for body in crate::visit::bodies(statement) {
                self.statements(routine, body, depth + 1, is_loop);
            }
        }
    }

    fn statement(&mut self, routine: &Routine, statement: &Statement, is_loop: bool) {
        let bool = Type::Elementary(Elementary::Bool);
        match &statement.kind {
            StatementKind::Assign(place, value) => {
                self.place(routine, place);
                self.expression(routine, value, 0);
                self.alike(&place.of, &value.of);
            }
            StatementKind::Bind(slot, place) => {
                self.place(routine, &slot.holder());
                self.place(routine, place);
                self.alike(&slot.of, &place.of);
            }
            StatementKind::Invoke(called, place) => {
                self.place(routine, place);
                self.instance(*called, Some(place));
            }
            StatementKind::Evaluate(value) => match &value.kind {
                ExpressionKind::Call(call) => self.call(routine, call, &value.of, 0),
                _ => self.expression(routine, value, 0),
            },
            StatementKind::If(branches, _) => {
                for branch in branches {
                    self.expression(routine, &branch.condition, 0);
                    self.alike(&bool, &branch.condition.of);
                }
            }
            StatementKind::Case(selector, ..) => {
                self.expression(routine, selector, 0);
                let of = selector.of.elementary();
                let is_whole = of.is_some_and(|of| !of.is_real());
                self.expect(is_whole, || "CASE over what is no integer".to_owned());
            }
            StatementKind::For(each) => {
                self.place(routine, &each.counter);
                let of = each.counter.of.elementary();
                let is_integer = of.is_some_and(Elementary::is_integer);
                self.expect(is_integer, || "FOR with a counter that is no integer".to_owned());
                for bound in [&each.from, &each.to, &each.by] {
                    self.expression(routine, bound, 0);
                    self.alike(&each.counter.of, &bound.of);
                }
            }
            StatementKind::While(condition, _) | StatementKind::Repeat(_, condition) => {
                self.expression(routine, condition, 0);
                self.alike(&bool, &condition.of);
            }
            StatementKind::Exit | StatementKind::Continue => {
                self.expect(is_loop, || "EXIT or CONTINUE outside a loop".to_owned());
            }
            StatementKind::Return => {}
        }
    }

    fn alike(&mut self, wanted: &Type, found: &Type) {
        self.expect(wanted.is_stored_like(found), || format!("{found:?} in place of {wanted:?}"));
    }

    /// A place in a routine.
    fn place(&mut self, routine: &Routine, place: &Place) {
        let reach = place.reach();
        let slots = reach.div_ceil(64);
        let frame = u64::from(routine.frame.0);
        let frame = frame..frame + u64::from(routine.frame.1);
        let is_block = routine.kind == RoutineKind::Block;
        let is_in_memory = match place.root {
            Root::Global(slot) => self.is_state(slot.into(), slots),
            Root::Frame(slot) => {
                frame.contains(&slot.into()) && u64::from(slot).saturating_add(slots) <= frame.end
            }
            Root::FrameReference(slot) => frame.contains(&slot.into()),
            // The instance is looked at where the routine is invoked.
            Root::Own(_) | Root::OwnReference(_) => is_block,
        };
        self.expect(is_in_memory && reach < u64::MAX / 2, || {
            format!("{:?} + {} is outside its memory", place.root, place.offset)
        });
        self.bits(place);
        for index in &place.indices {
            self.expression(routine, &index.value, 0);
            self.alike(&Type::Elementary(Elementary::Lint), &index.value.of);
            self.expect(index.low <= index.high, || "an array without elements".to_owned());
        }
    }

    /// Elements of packed arrays, and no others, share slots.
    fn bits(&mut self, place: &Place) {
        let width = place.of.elementary().map_or(64, Elementary::bits);
        let grain = if place.is_packed { u64::from(width) } else { 64 };
        let fits = place.bit < 64
            && u64::from(place.bit).is_multiple_of(grain)
            && place.indices.iter().all(|index| index.stride.is_multiple_of(grain));
        let is_part = !place.is_packed || place.of.elementary().is_some();
        self.expect(fits && is_part, || {
            format!("bit {} of {:?} + {}", place.bit, place.root, place.offset)
        });
    }

    /// A routine and the instance on which it is to run.
    fn instance(&mut self, called: RoutineId, place: Option<&Place>) {
        let index = called.0 as usize;
        let Some(routine) = self.program.routines.get(index) else {
            self.expect(false, || format!("there is no routine {index}"));
            return;
        };
        let is_block = routine.kind == RoutineKind::Block;
        self.expect(is_block == place.is_some(), || {
            format!("{} is called with the instance {place:?}", routine.name)
        });
        if let Some(place) = place {
            let slots = place.of.slots();
            let needed = self.own[index];
            let fits = needed <= slots && place.of.elementary().is_none();
            self.expect(fits, || format!("{} needs an instance of {needed} slots", routine.name));
        }
    }

    fn expression(&mut self, routine: &Routine, expression: &Expression, depth: usize) {
        self.expect(depth <= Program::NESTING, || "expressions are nested too deep".to_owned());
        if depth > Program::NESTING {
            return;
        }
        let depth = depth + 1;
        match &expression.kind {
            ExpressionKind::Constant(value) => {
                let of = expression.of.elementary();
                let fits = of.is_some_and(|of| value & !of.mask() == 0);
                self.expect(fits, || format!("{value:#x} as {:?}", expression.of));
            }
            ExpressionKind::Text(_) => self.alike(&expression.of, &Type::Text(0)),
            ExpressionKind::Load(place) => {
                self.place(routine, place);
                self.alike(&expression.of, &place.of);
            }
            ExpressionKind::Apply(operation, operands) => {
                for operand in operands {
                    self.expression(routine, operand, depth);
                }
                let Some(signature) = operation.signature(operands.len()) else {
                    self.expect(false, || {
                        format!("{operation:?} with {} operands", operands.len())
                    });
                    return;
                };
                let found = operands.iter().map(|operand| &operand.of);
                let pairs = signature.operands.iter().zip(found);
                for (wanted, found) in pairs.chain([(&signature.result, &expression.of)]) {
                    let fits = match wanted {
                        Operand::Number(wanted) => found.elementary() == Some(*wanted),
                        Operand::Text => matches!(found, Type::Text(_)),
                    };
                    self.expect(fits, || format!("{operation:?} with {found:?}"));
                }
            }
            ExpressionKind::Choose(parts) => {
                let [condition, first, second] = &**parts;
                for part in [condition, first, second] {
                    self.expression(routine, part, depth);
                }
                self.alike(&Type::Elementary(Elementary::Bool), &condition.of);
                self.alike(&expression.of, &first.of);
                self.alike(&expression.of, &second.of);
            }
            ExpressionKind::Call(call) => {
                self.expect(call.result.is_some(), || {
                    "a call without a result as a value".to_owned()
                });
                self.call(routine, call, &expression.of, depth);
            }
        }
    }

    fn call(&mut self, routine: &Routine, call: &Call, of: &Type, depth: usize) {
        if let Some(own) = &call.own {
            self.place(routine, own);
        }
        self.instance(call.routine, call.own.as_ref());
        let Some(called) = self.program.routines.get(call.routine.0 as usize) else {
            return;
        };
        for argument in &call.arguments {
            match argument {
                Argument::Value(place, value) => {
                    self.variable(called, place);
                    self.expression(routine, value, depth);
                    self.alike(&place.of, &value.of);
                }
                Argument::Reference(slot, place) => {
                    self.variable(called, &slot.holder());
                    self.place(routine, place);
                    self.alike(&slot.of, &place.of);
                }
            }
        }
        for (from, to) in &call.outputs {
            self.variable(called, from);
            self.place(routine, to);
            self.alike(&to.of, &from.of);
        }
        if let Some(result) = &call.result {
            self.variable(called, result);
            self.alike(of, &result.of);
        }
    }

    /// A variable of a called routine.
    fn variable(&mut self, called: &Routine, place: &Place) {
        self.place(called, place);
        let is_plain = place.indices.is_empty() && matches!(place.root, Root::Frame(_));
        self.expect(is_plain, || "a call uses what is no variable of its frame".to_owned());
    }
}
