//! Walks over statements and expressions, in the order of the text.

use crate::form::{
    Argument, Call, Expression, ExpressionKind, Place, RoutineId, Statement, StatementKind,
};

/// Shows every expression, outer ones first.
pub(crate) fn expressions<'a>(statements: &'a [Statement], show: &mut dyn FnMut(&'a Expression)) {
    for statement in statements {
        match &statement.kind {
            StatementKind::Assign(place, value) => {
                in_place(place, show);
                in_expression(value, show);
            }
            StatementKind::Bind(slot, place) => {
                in_place(slot, show);
                in_place(place, show);
            }
            StatementKind::Invoke(_, place) => in_place(place, show),
            StatementKind::Evaluate(value) => in_expression(value, show),
            StatementKind::If(branches, _) => {
                for branch in branches {
                    in_expression(&branch.condition, show);
                }
            }
            StatementKind::Case(selector, ..) => in_expression(selector, show),
            StatementKind::For(each) => {
                in_place(&each.counter, show);
                for value in [&each.from, &each.to, &each.by] {
                    in_expression(value, show);
                }
            }
            StatementKind::While(condition, _) | StatementKind::Repeat(_, condition) => {
                in_expression(condition, show);
            }
            StatementKind::Exit | StatementKind::Continue | StatementKind::Return => {}
        }
        for body in bodies(statement) {
            expressions(body, show);
        }
    }
}

/// The places that a body names, by what it does with them; one that is handed on by reference is among both.
#[derive(Debug, Clone, Default)]
pub struct Uses<'a> {
    /// Places that it reads.
    pub reads: Vec<&'a Place>,
    /// Places that it writes.
    pub writes: Vec<&'a Place>,
}

impl<'a> Uses<'a> {
    /// The places that `statements` name, but for those in the routines that they call.
    pub fn of(statements: &'a [Statement]) -> Self {
        let mut uses = Self::default();
        expressions(statements, &mut |expression| match &expression.kind {
            ExpressionKind::Load(place) => uses.reads.push(place),
            ExpressionKind::Call(call) => {
                let references = call.arguments.iter().filter_map(|argument| match argument {
                    Argument::Reference(_, place) => Some(place),
                    Argument::Value(..) => None,
                });
                for place in references.chain(&call.own) {
                    uses.reads.push(place);
                    uses.writes.push(place);
                }
                uses.writes.extend(call.outputs.iter().map(|(_, to)| to));
            }
            _ => {}
        });
        uses.in_statements(statements);
        uses
    }

    fn in_statements(&mut self, statements: &'a [Statement]) {
        for statement in statements {
            match &statement.kind {
                StatementKind::Assign(place, _) => self.writes.push(place),
                StatementKind::For(each) => self.writes.push(&each.counter),
                StatementKind::Bind(_, place) | StatementKind::Invoke(_, place) => {
                    self.reads.push(place);
                    self.writes.push(place);
                }
                _ => {}
            }
            for body in bodies(statement) {
                self.in_statements(body);
            }
        }
    }
}

/// The bodies within a statement.
pub fn bodies(statement: &Statement) -> Vec<&[Statement]> {
    bodies_of(&statement.kind)
}

/// The bodies within what a statement does.
pub(crate) fn bodies_of(statement: &StatementKind) -> Vec<&[Statement]> {
    match statement {
        StatementKind::If(branches, otherwise) => {
            let branches = branches.iter().map(|branch| &*branch.body);
            branches.chain([&**otherwise]).collect()
        }
        StatementKind::Case(_, cases, otherwise) => {
            let cases = cases.iter().map(|case| &*case.body);
            cases.chain([&**otherwise]).collect()
        }
        StatementKind::For(each) => vec![&each.body],
        StatementKind::While(_, body) | StatementKind::Repeat(body, _) => vec![body],
        _ => Vec::new(),
    }
}

fn in_place<'a>(place: &'a Place, show: &mut dyn FnMut(&'a Expression)) {
    for index in &place.indices {
        in_expression(&index.value, show);
    }
}

/// Shows an expression and those within.
pub(crate) fn in_expression<'a>(expression: &'a Expression, show: &mut dyn FnMut(&'a Expression)) {
    show(expression);
    match &expression.kind {
        ExpressionKind::Constant(_) | ExpressionKind::Text(_) => {}
        ExpressionKind::Load(place) => in_place(place, show),
        ExpressionKind::Apply(_, operands) => {
            for operand in operands {
                in_expression(operand, show);
            }
        }
        ExpressionKind::Choose(parts) => {
            for part in parts.iter() {
                in_expression(part, show);
            }
        }
        ExpressionKind::Call(call) => in_call(call, show),
    }
}

fn in_call<'a>(call: &'a Call, show: &mut dyn FnMut(&'a Expression)) {
    if let Some(own) = &call.own {
        in_place(own, show);
    }
    for argument in &call.arguments {
        match argument {
            Argument::Value(_, value) => in_expression(value, show),
            Argument::Reference(_, place) => in_place(place, show),
        }
    }
    for (_, to) in &call.outputs {
        in_place(to, show);
    }
}

/// Shows every routine that statements call.
pub(crate) fn calls(statements: &[Statement], show: &mut dyn FnMut(RoutineId)) {
    invocations(statements, show);
    expressions(statements, &mut |expression| {
        if let ExpressionKind::Call(call) = &expression.kind {
            show(call.routine);
        }
    });
}

fn invocations(statements: &[Statement], show: &mut dyn FnMut(RoutineId)) {
    for statement in statements {
        if let StatementKind::Invoke(routine, _) = statement.kind {
            show(routine);
        }
        for body in bodies(statement) {
            invocations(body, show);
        }
    }
}

/// Shows every place that statements themselves write, or whose address they give away.
pub(crate) fn writes<'a>(statements: &'a [Statement], show: &mut dyn FnMut(&'a Place)) {
    assignments(statements, show);
    expressions(statements, &mut |expression| {
        if let ExpressionKind::Call(call) = &expression.kind {
            for argument in &call.arguments {
                if let Argument::Reference(_, place) = argument {
                    show(place);
                }
            }
            for (_, to) in &call.outputs {
                show(to);
            }
        }
    });
}

fn assignments<'a>(statements: &'a [Statement], show: &mut dyn FnMut(&'a Place)) {
    for statement in statements {
        match &statement.kind {
            StatementKind::Assign(place, _) | StatementKind::Invoke(_, place) => show(place),
            StatementKind::Bind(slot, place) => {
                show(slot);
                show(place);
            }
            StatementKind::For(each) => show(&each.counter),
            _ => {}
        }
        for body in bodies(statement) {
            assignments(body, show);
        }
    }
}
