//! How formulas are printed: names for variables, the sign of the product, and Boolean formulas in the manner of (39), (40).
//!
//! Precedence: ¬ binds tightest, then ∧, ⊕, ∨. A formula is a tree, an expression a graph with sharing; so a formula may be far
//! larger than its expression, and printing is bounded.

use std::collections::HashMap;

use crate::expression::{Expression, Graph, Operation, Variable};

/// A formula that is too long to be read.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error(
    "U0411: the formula has more than {leaves} variables or is nested deeper than {depth}; it is too large to print"
)]
pub struct FormulaTooLarge {
    /// Variables in one formula, at most, each counted as often as it occurs.
    pub leaves: usize,
    /// Nesting, at most.
    pub depth: usize,
}

impl FormulaTooLarge {
    /// Stable code for people.
    pub fn code(&self) -> &'static str {
        "U0411"
    }
}

/// Bounds of a printed formula; they bound the recursion, too.
const LIMIT: FormulaTooLarge = FormulaTooLarge { leaves: 2_000, depth: 200 };

/// Refuses an expression whose formula is beyond the bounds. Chains of one operation count as one level.
pub(crate) fn check_size(graph: &Graph, root: Expression) -> Result<(), FormulaTooLarge> {
    let cone = graph.cone(root, 4 * LIMIT.leaves).ok_or(LIMIT)?;
    let mut sizes: HashMap<Expression, (usize, usize)> = HashMap::new();
    for expression in cone {
        let operation = graph.operation(expression);
        let same_kind = |operand: Expression| {
            std::mem::discriminant(&graph.operation(operand)) == std::mem::discriminant(&operation)
        };
        let mut leaves: usize = 0;
        let mut depth = 0;
        for operand in operation.operands() {
            let size = sizes[&operand];
            leaves = leaves.saturating_add(size.0);
            depth = depth.max(size.1 + usize::from(!same_kind(operand)));
        }
        sizes.insert(expression, (leaves.max(1), depth));
    }
    let (leaves, depth) = sizes[&root];
    if leaves > LIMIT.leaves || depth > LIMIT.depth {
        return Err(LIMIT);
    }
    Ok(())
}

/// The operands of a chain such as `a ∧ b ∧ c`, however it is nested, in the order in which they are read.
pub(crate) fn chain(graph: &Graph, root: Expression) -> Vec<Expression> {
    let kind = std::mem::discriminant(&graph.operation(root));
    let mut operands = Vec::new();
    let mut pending = vec![root];
    while let Some(expression) = pending.pop() {
        let operation = graph.operation(expression);
        if std::mem::discriminant(&operation) == kind {
            let mut inner: Vec<Expression> = operation.operands().collect();
            inner.reverse();
            pending.extend(inner);
        } else {
            operands.push(expression);
        }
    }
    operands
}

/// The Boolean formula of `root`, such as `(u22 ∨ x39 ∧ ¬u21) ∧ ¬u23`.
///
/// # Errors
/// It is too large for a person.
pub fn boolean(
    graph: &Graph,
    root: Expression,
    name: &dyn Fn(Variable) -> String,
) -> Result<String, FormulaTooLarge> {
    check_size(graph, root)?;
    let mut text = String::new();
    write_boolean(graph, root, name, 0, &mut text);
    Ok(text)
}

fn write_boolean(
    graph: &Graph,
    root: Expression,
    name: &dyn Fn(Variable) -> String,
    outer: u8,
    text: &mut String,
) {
    let (sign, precedence) = match graph.operation(root) {
        Operation::Constant(value) => return text.push(if value { '1' } else { '0' }),
        Operation::Variable(variable) => return text.push_str(&name(variable)),
        Operation::Not(operand) => {
            text.push('¬');
            return write_boolean(graph, operand, name, 4, text);
        }
        Operation::And(..) => (" ∧ ", 3),
        Operation::Xor(..) => (" ⊕ ", 2),
        Operation::Or(..) => (" ∨ ", 1),
    };
    if precedence < outer {
        text.push('(');
    }
    for (place, operand) in chain(graph, root).into_iter().enumerate() {
        if place > 0 {
            text.push_str(sign);
        }
        write_boolean(graph, operand, name, precedence, text);
    }
    if precedence < outer {
        text.push(')');
    }
}
