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

/// The bodies within a statement.
pub(crate) fn bodies(statement: &Statement) -> Vec<&[Statement]> {
    match &statement.kind {
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
