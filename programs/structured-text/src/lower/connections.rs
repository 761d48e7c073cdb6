//! What stands around a program that runs: its connections, and the event of its task.

use std::rc::Rc;

use understudy_typed::{
    Branch, Elementary, Operation, Root, Routine as Lowered, RoutineId, RoutineKind, Statement,
    StatementKind, Type,
};

use crate::syntax::Expression;

use super::Lowering;
use super::blocks::{Block, Routine};
use super::fold::{apply, not};
use super::places::{load, place};
use super::programs::Instance;

impl<'a> Lowering<'a> {
    /// A routine that copies what the program is connected to, before and behind its body.
    pub(super) fn connected(
        &mut self,
        instance: &Instance<'a>,
        routine: &Routine,
        block: &Block,
    ) -> Option<RoutineId> {
        if instance.connections.is_empty() && instance.event.is_none() {
            return None;
        }
        let id = RoutineId(self.program.routines.len() as u32);
        self.scope.symbols = Some(Rc::default());
        self.scope.routine = id.0;
        let whole = place(Root::Own(0), block.of.clone());
        let name = instance.name.as_str();
        let bound =
            self.bind(name, &[], &routine.parameters, instance.connections, &instance.name.span());
        let mut body = Vec::new();
        let line = self.line(&instance.name.span());
        if let Some(bound) = bound {
            for (at, value) in &bound.given {
                let parameter = &routine.parameters[*at];
                let to = parameter.place(Root::Own(parameter.slot));
                let value = self.stored_at(value, &to);
                let kind = value.map(|value| StatementKind::Assign(to, value));
                body.extend(kind.map(|kind| Statement { line, kind }));
            }
            let kind = StatementKind::Invoke(routine.id, whole);
            body.push(Statement { line, kind });
            for (at, path, negated) in &bound.taken {
                let parameter = &routine.parameters[*at];
                let value = load(parameter.place(Root::Own(parameter.slot)));
                let kind = self.take_output(value, path, *negated);
                body.extend(kind.map(|kind| Statement { line, kind }));
            }
        }
        let body = match instance.event {
            Some(event) => self.at_event(instance, event, body),
            None => body,
        };
        self.scope = super::names::Scope::default();
        self.calls.push(vec![(routine.id.0, instance.name.span())]);
        self.program.routines.push(Lowered {
            name: name.to_owned(),
            kind: RoutineKind::Block,
            frame: (self.program.frames, 0),
            initial: Vec::new(),
            body,
            timer: None,
        });
        Some(id)
    }

    /// A body that is executed in the scans in which an event becomes TRUE, seen when the turn of the program comes.
    fn at_event(
        &mut self,
        instance: &Instance<'a>,
        event: &Expression,
        body: Vec<Statement>,
    ) -> Vec<Statement> {
        let span = instance.name.span();
        let (line, bool) = (self.line(&span), Type::Elementary(Elementary::Bool));
        let condition = self.condition(event);
        let Some((condition, slot)) = condition.zip(self.state(2, &span)) else {
            return Vec::new();
        };
        let variable = |slot| place(Root::Global(slot), bool.clone());
        let operands = vec![condition.clone(), not(load(variable(slot + 1)))];
        let begins = apply(Operation::And(Elementary::Bool), operands, bool.clone());
        let kinds = [
            StatementKind::Assign(variable(slot), begins),
            StatementKind::Assign(variable(slot + 1), condition),
            StatementKind::If(vec![Branch { condition: load(variable(slot)), body }], Vec::new()),
        ];
        kinds.map(|kind| Statement { line, kind }).into()
    }
}
