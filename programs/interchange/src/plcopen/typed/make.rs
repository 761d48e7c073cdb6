//! Syntax that is made in the place of what is drawn.

use understudy_ladder::Name as Written;
use understudy_structured_text::syntax::{
    Argument, Class, Declaration, Expression, ExpressionKind, Literal, Name, Operator, Path,
    Retention, Span, Statement, StatementKind, Step, TypeKind, TypeName,
};

/// A name of the document.
pub(crate) fn name(written: &Written) -> Name {
    Name::new(written.as_str(), written.span())
}

/// `name` or `name.part`.
pub(crate) fn path(name: &str, part: Option<&str>, span: &Span) -> Path {
    let steps = part.map(|part| Step::Field(Name::new(part, span.clone())));
    Path {
        root: Name::new(name, span.clone()),
        steps: steps.into_iter().collect(),
        span: span.clone(),
    }
}

pub(crate) fn read(path: Path) -> Expression {
    Expression { span: path.span.clone(), kind: ExpressionKind::Variable(path) }
}

pub(crate) fn variable(name: &str, span: &Span) -> Expression {
    read(path(name, None, span))
}

pub(crate) fn boolean(value: bool, span: &Span) -> Expression {
    Expression { kind: ExpressionKind::Literal(Literal::Boolean(value)), span: span.clone() }
}

pub(crate) fn integer(value: i128, span: &Span) -> Expression {
    Expression {
        kind: ExpressionKind::Literal(Literal::Integer { value, of: None, based: false }),
        span: span.clone(),
    }
}

pub(crate) fn not(value: Expression) -> Expression {
    Expression { span: value.span.clone(), kind: ExpressionKind::Not(Box::new(value)) }
}

/// Two or more values with one operator between them; one is itself.
pub(crate) fn chain(values: Vec<Expression>, operator: Operator, span: &Span) -> Expression {
    let mut values = values.into_iter();
    let Some(first) = values.next() else {
        return boolean(operator == Operator::And, span);
    };
    let rest: Vec<_> = values.map(|value| (operator, value)).collect();
    if rest.is_empty() {
        return first;
    }
    Expression { kind: ExpressionKind::Chain(Box::new(first), rest), span: span.clone() }
}

pub(crate) fn call(name: Name, arguments: Vec<Argument>, span: &Span) -> Expression {
    let path = Path { span: name.span(), root: name, steps: Vec::new() };
    Expression { kind: ExpressionKind::Call(path, arguments), span: span.clone() }
}

pub(crate) fn statement(kind: StatementKind, span: &Span) -> Statement {
    Statement { kind, span: span.clone(), comments: Vec::new() }
}

pub(crate) fn assign(to: Path, value: Expression, span: &Span) -> Statement {
    statement(StatementKind::Assign(to, value), span)
}

pub(crate) fn when(condition: Expression, body: Vec<Statement>, span: &Span) -> Statement {
    statement(StatementKind::If(vec![(condition, body)], Vec::new()), span)
}

pub(crate) fn named(of: &str, span: &Span) -> TypeName {
    TypeName { kind: TypeKind::Named(Name::new(of, span.clone())), span: span.clone() }
}

pub(crate) fn declare(name: &str, class: Class, of: TypeName, span: &Span) -> Declaration {
    Declaration {
        name: Name::new(name, span.clone()),
        class,
        constant: false,
        retention: Retention::Unstated,
        edge: None,
        address: None,
        of,
        initial: None,
        description: None,
    }
}
