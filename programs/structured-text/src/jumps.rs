//! Bodies with labels: parts between them, and jumps that say which part is next and leave the part with CONTINUE.
//!
//! ```text
//! next := 0;
//! FOR turn := 0 TO 0 DO IF next <= 0 THEN … END_IF; END_FOR;      jumps further down: each part once, in order
//! FOR turn := 0 TO 0 DO IF next <= 1 THEN … END_IF; END_FOR;
//!
//! WHILE next < 2 DO CASE next OF 0: next := 1; … END_CASE; END_WHILE;      a jump back: a loop over the parts
//! ```

use understudy_typed::Comparison;

use crate::syntax::{
    Expression, ExpressionKind, For, Label, Literal, Name, Operator, Path, Span, Statement,
    StatementKind,
};

/// The statements of a body in parts; `next` says which part is next, `turn` counts loops of one turn. Both are variables of type DINT.
pub fn in_parts(parts: Vec<Vec<Statement>>, next: &str, turn: &str, span: &Span) -> Vec<Statement> {
    let made = Made { span };
    let first = made.statement(StatementKind::Assign(made.path(next), made.integer(0)));
    let mut statements = vec![first];
    let mut places = parts.iter().enumerate();
    if places.all(|(at, body)| only_down(body, next, at as i128)) {
        for (at, body) in parts.into_iter().enumerate() {
            let reached = made.compare(next, Comparison::LessOrEqual, at);
            let body = vec![made.statement(StatementKind::If(vec![(reached, body)], Vec::new()))];
            statements.push(made.statement(StatementKind::For(Box::new(For {
                counter: made.path(turn),
                from: made.integer(0),
                to: made.integer(0),
                by: None,
                body,
            }))));
        }
        return statements;
    }
    let more = made.compare(next, Comparison::Less, parts.len());
    let cases = parts.into_iter().enumerate().map(|(at, mut body)| {
        let behind = StatementKind::Assign(made.path(next), made.integer(at + 1));
        body.insert(0, made.statement(behind));
        let first = made.integer(at);
        (vec![Label { first, last: None }], body)
    });
    let case = StatementKind::Case(made.variable(next), cases.collect(), Vec::new());
    let body = vec![made.statement(case)];
    statements.push(made.statement(StatementKind::While(more, body)));
    statements
}

/// Whether the jumps of a part go further down.
fn only_down(body: &[Statement], next: &str, at: i128) -> bool {
    body.iter().all(|statement| match &statement.kind {
        StatementKind::Assign(to, value) if to.root.is(next) => match &value.kind {
            ExpressionKind::Literal(Literal::Integer { value, .. }) => *value > at,
            _ => false,
        },
        StatementKind::If(branches, otherwise) => {
            let mut bodies = branches.iter().map(|(_, body)| body);
            bodies.all(|body| only_down(body, next, at)) && only_down(otherwise, next, at)
        }
        _ => true,
    })
}

struct Made<'a> {
    span: &'a Span,
}

impl Made<'_> {
    fn statement(&self, kind: StatementKind) -> Statement {
        Statement { kind, span: self.span.clone(), comments: Vec::new() }
    }

    fn expression(&self, kind: ExpressionKind) -> Expression {
        Expression { kind, span: self.span.clone() }
    }

    fn path(&self, name: &str) -> Path {
        Path {
            root: Name::new(name, self.span.clone()),
            steps: Vec::new(),
            span: self.span.clone(),
        }
    }

    fn variable(&self, name: &str) -> Expression {
        self.expression(ExpressionKind::Variable(self.path(name)))
    }

    fn integer(&self, value: usize) -> Expression {
        self.expression(ExpressionKind::Literal(Literal::Integer {
            value: value as i128,
            of: None,
            based: false,
        }))
    }

    fn compare(&self, name: &str, comparison: Comparison, with: usize) -> Expression {
        let right = (Operator::Compare(comparison), self.integer(with));
        self.expression(ExpressionKind::Chain(Box::new(self.variable(name)), vec![right]))
    }
}
