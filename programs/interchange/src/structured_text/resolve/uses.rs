//! How a body uses its function blocks, which decides whether a standard block can stand in a rung.

use std::collections::{HashMap, HashSet};

use super::super::syntax::{
    Argument, Expression, ExpressionKind, Operator, Path, Statement, StatementKind,
};

use super::leave::leaves_of;

/// What happens to one instance in a body.
#[derive(Debug, Clone, Default)]
pub(super) struct Uses {
    /// Calls in the text.
    pub(super) calls: usize,
    /// One of them is in a choice or a loop.
    pub(super) conditional: bool,
    /// Inputs that are assigned or read by name, in capitals.
    pub(super) touched: HashSet<String>,
    /// CV is used otherwise than compared with a number.
    pub(super) counts: bool,
    /// The value that a call gives to PV.
    pub(super) preset: Option<Expression>,
}

/// By the instance's name, in capitals.
pub(super) type UsesByName = HashMap<String, Uses>;

/// The largest number that a rung compares a counter with.
pub(super) const MAXIMUM_COMPARED: i64 = understudy_ladder::MAXIMUM_PRESET_VALUE as i64;

/// The uses of all instances in `body`.
pub(super) fn uses(body: &[Statement]) -> UsesByName {
    let mut found = UsesByName::new();
    statements(body, false, &mut found);
    found
}

fn statements(body: &[Statement], mut conditional: bool, found: &mut UsesByName) {
    for statement in body {
        match &statement.kind {
            StatementKind::Assign(target, value) => {
                touch(target, found);
                expression(value, found);
            }
            StatementKind::Call(instance, arguments) => {
                if let [name] = instance.parts.as_slice() {
                    let uses = found.entry(name.to_ascii_uppercase()).or_default();
                    uses.calls += 1;
                    uses.conditional |= conditional;
                    let preset = arguments.iter().find_map(|argument| match argument {
                        Argument::Given(pin, value) if pin.eq_ignore_ascii_case("PV") => {
                            Some(value.clone())
                        }
                        _ => None,
                    });
                    let last = arguments.iter().rev().find_map(|argument| match argument {
                        Argument::Placed(value) => Some(value.clone()),
                        _ => None,
                    });
                    uses.preset = preset.or(last);
                    let is_fed = arguments.iter().any(|argument| match argument {
                        Argument::Placed(_) => true,
                        Argument::Given(pin, _) => pin.eq_ignore_ascii_case("IN"),
                        Argument::Taken(..) => false,
                    });
                    if !is_fed {
                        // What another call has given stays.
                        uses.touched.insert("IN".to_owned());
                    }
                }
                arguments_of(arguments, found);
            }
            StatementKind::If(branches, otherwise) => {
                for (condition, branch) in branches {
                    expression(condition, found);
                    statements(branch, true, found);
                }
                statements(otherwise, true, found);
            }
            StatementKind::Case(selector, branches, otherwise) => {
                expression(selector, found);
                for (_, branch) in branches {
                    statements(branch, true, found);
                }
                statements(otherwise, true, found);
            }
            StatementKind::For(content) => {
                expression(&content.from, found);
                expression(&content.to, found);
                statements(&content.body, true, found);
            }
            StatementKind::Leave(_) | StatementKind::Refused(_) | StatementKind::Nothing => {}
        }
        // What comes behind it may not be executed.
        conditional |= leaves_of(statement).any();
    }
}

fn arguments_of(arguments: &[Argument], found: &mut UsesByName) {
    for argument in arguments {
        match argument {
            Argument::Placed(value) | Argument::Given(_, value) => expression(value, found),
            Argument::Taken(pin, target) => {
                touch(target, found);
                // Given out as a number.
                if pin.eq_ignore_ascii_case("CV") {
                    found.values_mut().for_each(|uses| uses.counts = true);
                }
            }
        }
    }
}

fn touch(path: &Path, found: &mut UsesByName) {
    if let [instance, pin] = path.parts.as_slice() {
        let uses = found.entry(instance.to_ascii_uppercase()).or_default();
        let pin = pin.to_ascii_uppercase();
        uses.counts |= pin == "CV";
        uses.touched.insert(pin);
    }
}

fn expression(content: &Expression, found: &mut UsesByName) {
    match &content.kind {
        ExpressionKind::Variable(path) => touch(path, found),
        ExpressionKind::Not(inner) | ExpressionKind::Minus(inner) => expression(inner, found),
        ExpressionKind::Chain(first, rest) => {
            if let [(operator, second)] = rest.as_slice()
                && (compared(first, *operator, second) || compared(second, *operator, first))
            {
                return;
            }
            expression(first, found);
            for (_, operand) in rest {
                expression(operand, found);
            }
        }
        ExpressionKind::Call(_, arguments) => arguments_of(arguments, found),
        ExpressionKind::Boolean(_)
        | ExpressionKind::Integer(_)
        | ExpressionKind::Time(_)
        | ExpressionKind::Foreign(_)
        | ExpressionKind::Faulty => {}
    }
}

/// `counter.CV >= 5`
fn compared(left: &Expression, operator: Operator, right: &Expression) -> bool {
    let ExpressionKind::Variable(path) = &left.kind else {
        return false;
    };
    let [_, pin] = path.parts.as_slice() else {
        return false;
    };
    let small = matches!(right.kind, ExpressionKind::Integer(value) if (0..=MAXIMUM_COMPARED).contains(&value));
    pin.eq_ignore_ascii_case("CV") && matches!(operator.rank(), 3 | 4) && small
}
