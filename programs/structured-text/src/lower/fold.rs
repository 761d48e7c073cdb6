//! Operations on expressions; those on constants are done at once, by the same rules as in a station.

use std::sync::Arc;

use understudy_typed::{
    Elementary, Expression, ExpressionKind, Operation, TextOperand, TextOperation, Type,
};

use super::names::number;

/// An operation with an elementary result.
pub(super) fn apply(operation: Operation, operands: Vec<Expression>, of: Type) -> Expression {
    let constants: Option<Vec<u64>> = operands
        .iter()
        .map(|operand| match operand.kind {
            ExpressionKind::Constant(value) => Some(value),
            _ => None,
        })
        .collect();
    let folds = !matches!(operation, Operation::Elapsed | Operation::Text(_));
    if let Some(constants) = constants.filter(|_| folds)
        && let Ok(value) = operation.apply(&constants)
    {
        return number(of, value);
    }
    Expression { of, kind: ExpressionKind::Apply(operation, operands) }
}

/// An operation on texts.
pub(super) fn text(operation: TextOperation, operands: Vec<Expression>, of: Type) -> Expression {
    let constants: Option<Vec<TextOperand<'_>>> = operands
        .iter()
        .map(|operand| match &operand.kind {
            ExpressionKind::Constant(value) => Some(TextOperand::Number(*value)),
            ExpressionKind::Text(bytes) => Some(TextOperand::Text(bytes)),
            _ => None,
        })
        .collect();
    if let Some(constants) = constants {
        let mut result = Vec::new();
        let value = operation.apply(&constants, &mut result);
        return match &of {
            Type::Text(_) => Expression { of, kind: ExpressionKind::Text(Arc::from(result)) },
            _ => number(of, value),
        };
    }
    Expression { of, kind: ExpressionKind::Apply(Operation::Text(operation), operands) }
}

/// The same value as another elementary type.
pub(super) fn convert(value: Expression, to: Elementary) -> Expression {
    match value.of.elementary() {
        Some(from) if from != to => {
            apply(Operation::Convert(from, to), vec![value], Type::Elementary(to))
        }
        _ => Expression { of: Type::Elementary(to), kind: value.kind },
    }
}

/// The same bits as another elementary type of the same width.
pub(super) fn reinterpret(value: Expression, to: Elementary) -> Expression {
    match value.of.elementary() {
        Some(from) if from != to => {
            apply(Operation::Reinterpret(from, to), vec![value], Type::Elementary(to))
        }
        _ => value,
    }
}

/// NOT of a BOOL.
pub(super) fn not(value: Expression) -> Expression {
    let of = value.of.clone();
    apply(Operation::Not(Elementary::Bool), vec![value], of)
}

/// TRUE or FALSE.
pub(super) fn boolean(value: bool) -> Expression {
    number(Type::Elementary(Elementary::Bool), u64::from(value))
}

/// The second where the first is TRUE, else the third, of any type.
pub(super) fn choose(condition: Expression, then: Expression, otherwise: Expression) -> Expression {
    Expression {
        of: then.of.clone(),
        kind: ExpressionKind::Choose(Box::new([condition, then, otherwise])),
    }
}
