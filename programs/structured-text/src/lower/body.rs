//! The bodies of routines.

use std::rc::Rc;

use understudy_typed::{Elementary, Operation, Root, Statement, StatementKind, Type};

use crate::syntax::{Body, UnitKind};

use super::Lowering;
use super::blocks::{Block, Key, Routine};
use super::fold::{apply, not};
use super::names::Scope;
use super::places::{load, place};

impl Lowering<'_> {
    /// Lowers the bodies that wait for it, and those that they call.
    pub(super) fn bodies(&mut self) {
        while let Some((key, routine)) = self.queue.pop() {
            self.body(&key, &routine);
        }
    }

    fn body(&mut self, key: &Key, routine: &Rc<Routine>) {
        let unit = self.unit_of(key.owner);
        self.scope = Scope {
            unit: Some(key.owner.unit),
            method: key.owner.method,
            class: key.class,
            symbols: Some(routine.symbols.clone()),
            routine: routine.id.0,
            loops: 0,
        };
        self.facts.forget();
        let mut body = Vec::new();
        if matches!(unit.kind, UnitKind::Program | UnitKind::FunctionBlock)
            && let Some(block) = self.block(key.owner.unit, &unit.span)
        {
            let line = self.line(&unit.name.span());
            edges(&block, line, &mut body);
        }
        match &unit.body {
            Body::Statements(statements) => self.statements(statements, &mut body),
            // Charts and lists are statements before they come here.
            Body::Chart(_) | Body::Instructions(_) => {
                let message = format!("the body of `{}` is not Structured Text", unit.name);
                self.error("U1040", message, unit.name.span());
            }
        }
        self.program.routines[routine.id.0 as usize].body = body;
        self.scope = Scope::default();
    }
}

/// What inputs with R_EDGE and F_EDGE are in this call.
fn edges(block: &Block, line: u32, body: &mut Vec<Statement>) {
    let bool = Type::Elementary(Elementary::Bool);
    for edge in &block.edges {
        let variable = |slot| place(Root::Own(slot), bool.clone());
        let now = |is_rising: bool| {
            let value = load(variable(edge.input));
            if is_rising { value } else { not(value) }
        };
        let before = not(load(variable(edge.last)));
        let seen = apply(
            Operation::And(Elementary::Bool),
            vec![now(edge.is_rising), before],
            bool.clone(),
        );
        for (slot, value) in [(edge.seen, seen), (edge.last, now(edge.is_rising))] {
            body.push(Statement { line, kind: StatementKind::Assign(variable(slot), value) });
        }
    }
}
