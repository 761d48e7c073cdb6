//! Syntax that is made here in the place of what a person wrote.

use understudy_typed::Elementary;

use crate::syntax::{
    Argument, Class, Declaration, Expression, ExpressionKind, Initializer, Literal, Name, Operator,
    Path, Retention, Span, Statement, StatementKind, Step, TypeKind, TypeName,
};

pub(super) fn path(name: &str, part: Option<&str>, span: &Span) -> Path {
    let steps = part.map(|part| Step::Field(Name::new(part, span.clone())));
    Path {
        root: Name::new(name, span.clone()),
        steps: steps.into_iter().collect(),
        span: span.clone(),
    }
}

pub(super) fn variable(name: &str, span: &Span) -> Expression {
    of_path(path(name, None, span))
}

pub(super) fn part(name: &str, part: &str, span: &Span) -> Expression {
    of_path(path(name, Some(part), span))
}

pub(super) fn of_path(path: Path) -> Expression {
    Expression { span: path.span.clone(), kind: ExpressionKind::Variable(path) }
}

pub(super) fn literal(literal: Literal, span: &Span) -> Expression {
    Expression { kind: ExpressionKind::Literal(literal), span: span.clone() }
}

pub(super) fn boolean(value: bool, span: &Span) -> Expression {
    literal(Literal::Boolean(value), span)
}

pub(super) fn integer(value: i128, span: &Span) -> Expression {
    literal(Literal::Integer { value, of: None, based: false }, span)
}

pub(super) fn not(value: Expression) -> Expression {
    Expression { span: value.span.clone(), kind: ExpressionKind::Not(Box::new(value)) }
}

/// An operator of an instruction list. Its result has the type of its operands, so arithmetic is that of the function in the place of the
/// operator.
pub(super) fn join(left: Expression, operator: Operator, right: Expression) -> Expression {
    let span = left.span.clone();
    let function = match operator {
        Operator::Add => Some("ADD"),
        Operator::Subtract => Some("SUB"),
        Operator::Multiply => Some("MUL"),
        Operator::Divide => Some("DIV"),
        Operator::Modulo => Some("MOD"),
        _ => None,
    };
    if let Some(function) = function {
        let name = path(function, None, &span);
        let arguments = match left.kind {
            ExpressionKind::Call(found, mut arguments)
                if is_chained(operator) && found.root.is(function) =>
            {
                arguments.push(Argument::Placed(right));
                arguments
            }
            kind => {
                let left = Expression { kind, span: span.clone() };
                vec![Argument::Placed(left), Argument::Placed(right)]
            }
        };
        return Expression { kind: ExpressionKind::Call(name, arguments), span };
    }
    match left.kind {
        // Operators of one kind stand in one chain, so the tree stays flat.
        ExpressionKind::Chain(first, mut rest)
            if rest.iter().all(|(found, _)| *found == operator) && is_chained(operator) =>
        {
            rest.push((operator, right));
            Expression { kind: ExpressionKind::Chain(first, rest), span }
        }
        kind => Expression {
            kind: ExpressionKind::Chain(
                Box::new(Expression { kind, span: span.clone() }),
                vec![(operator, right)],
            ),
            span,
        },
    }
}

/// Whether operators of this kind, one behind the other, are one.
pub(super) fn is_chained(operator: Operator) -> bool {
    matches!(operator, Operator::And | Operator::Or | Operator::AndThen | Operator::Add)
}

pub(super) fn all(values: Vec<Expression>, operator: Operator, span: &Span) -> Expression {
    let joined = values.into_iter().reduce(|left, right| join(left, operator, right));
    joined.unwrap_or_else(|| boolean(operator == Operator::And, span))
}

/// A call of a block with values by name.
pub(super) fn invoke<const N: usize>(
    name: &str,
    given: [(&str, Expression); N],
    span: &Span,
) -> Statement {
    let given = given
        .into_iter()
        .map(|(input, value)| Argument::Given(Name::new(input, span.clone()), value));
    let kind = StatementKind::Call(path(name, None, span), given.collect());
    statement(kind, span)
}

pub(super) fn call(name: &str, arguments: Vec<Expression>, span: &Span) -> Expression {
    let arguments = arguments.into_iter().map(Argument::Placed).collect();
    Expression { kind: ExpressionKind::Call(path(name, None, span), arguments), span: span.clone() }
}

/// TIME() - since
pub(super) fn since(moment: Expression, span: &Span) -> Expression {
    join(call("TIME", Vec::new(), span), Operator::Subtract, moment)
}

pub(super) fn statement(kind: StatementKind, span: &Span) -> Statement {
    Statement { kind, span: span.clone(), comments: Vec::new() }
}

pub(super) fn assign(to: Path, value: Expression, span: &Span) -> Statement {
    statement(StatementKind::Assign(to, value), span)
}

pub(super) fn when(condition: Expression, body: Vec<Statement>, span: &Span) -> Statement {
    statement(StatementKind::If(vec![(condition, body)], Vec::new()), span)
}

pub(super) fn elementary(of: Elementary, span: &Span) -> TypeName {
    TypeName { kind: TypeKind::Named(Name::new(of.name(), span.clone())), span: span.clone() }
}

pub(super) fn declare(
    name: &str,
    class: Class,
    of: TypeName,
    initial: Option<Initializer>,
    span: &Span,
) -> Declaration {
    Declaration {
        name: Name::new(name, span.clone()),
        class,
        constant: false,
        retention: Retention::Unstated,
        edge: None,
        address: None,
        of,
        initial,
        description: None,
    }
}
