//! Pointers that need no address: one that only ever points into one variable is a distance from its start, and one
//! that is an input and is only followed is a VAR_IN_OUT. Any other pointer stays, and is refused at its declaration.
//!
//! ```text
//! pt := ADR(name) + 2;    pt := 0 + 2;
//! pt := pt + 1;           pt := pt + 1;
//! c := pt^;               c := byte of `name` at distance pt, a fault outside of it
//! ```

use understudy_typed::Elementary;

use crate::syntax::{
    Argument, Body, Class, Expression, ExpressionKind, Name, Operator, Path, Span, Statement,
    StatementKind, Step, TypeKind, TypeName, Unit, UnitKind,
};

use super::written::{elementary, integer, join, path, variable};

/// The function that reads what lies at a distance from the start of a variable: the variable, the distance, a type.
pub(in crate::lower) const POINTED: &str = "pointed.at";
/// The value of a variable whose bits are those of another value: the variable, the distance, a type, the value.
pub(in crate::lower) const STORED: &str = "pointed.stored";

/// The distance of a pointer that points nowhere.
const NOWHERE: i128 = -(1 << 40);

/// Writes the pointers of a unit as what they are.
pub(super) fn resolve(unit: &mut Unit) {
    let is_pointer = |at: &usize| {
        let found = &unit.declarations[*at];
        let is_free = found.initial.is_none() && found.address.is_none() && !found.constant;
        is_free && matches!(found.of.kind, TypeKind::Pointer(_))
    };
    let pointers: Vec<usize> = (0..unit.declarations.len()).filter(is_pointer).collect();
    for at in pointers {
        let mut tried = unit.clone();
        if pointer(&mut tried, at).is_some() {
            *unit = tried;
        }
    }
}

fn pointer(unit: &mut Unit, at: usize) -> Option<()> {
    let declaration = &unit.declarations[at];
    let (name, class) = (declaration.name.clone(), declaration.class);
    let span = name.span();
    let TypeKind::Pointer(to) = &declaration.of.kind else {
        return None;
    };
    let to = TypeName::clone(to);
    let is_input = class == Class::Input && unit.kind != UnitKind::Program;
    if !is_input && !matches!(class, Class::Local | Class::Temporary | Class::Static) {
        return None;
    }
    let (element, low) = match &to.kind {
        TypeKind::Array(ranges, element) => match (ranges.as_slice(), &element.kind) {
            ([(low, _)], TypeKind::Named(element)) => (Some(element.clone()), Some(low.clone())),
            _ => (None, None),
        },
        TypeKind::Named(of) => (Some(of.clone()), None),
        _ => (None, None),
    };
    let mut follower = Follower {
        // With a dot: no other unit can write it.
        distance: Name::new(format!("{name}.at"), span.clone()),
        name,
        is_input,
        element,
        low,
        target: None,
    };
    let Body::Statements(statements) = &mut unit.body else {
        return None;
    };
    follower.statements(statements)?;
    for method in &mut unit.methods {
        let Body::Statements(statements) = &mut method.body else {
            return None;
        };
        let hides = method.declarations.iter().any(|found| found.name == follower.name);
        if !hides {
            follower.statements(statements)?;
        }
    }
    let declaration = &mut unit.declarations[at];
    if is_input {
        declaration.class = Class::InOut;
        declaration.of = to;
        return Some(());
    }
    follower.element?;
    declaration.name = follower.distance;
    declaration.of = elementary(Elementary::Lint, &span);
    let nowhere = integer(NOWHERE, &span);
    declaration.initial = Some(crate::syntax::Initializer::Value(nowhere));
    Some(())
}

/// Follows one pointer through a unit; `None` where it is more than that.
struct Follower {
    name: Name,
    /// The variable in its place.
    distance: Name,
    is_input: bool,
    /// What it points to, or an element of it.
    element: Option<Name>,
    /// The first index, where it points to an array.
    low: Option<Expression>,
    /// The variable that it points into.
    target: Option<Path>,
}

impl Follower {
    fn statements(&mut self, statements: &mut [Statement]) -> Option<()> {
        statements.iter_mut().try_for_each(|statement| self.statement(statement))
    }

    fn statement(&mut self, statement: &mut Statement) -> Option<()> {
        let span = statement.span.clone();
        match &mut statement.kind {
            StatementKind::Assign(to, value) if to.root == self.name && !self.is_input => {
                if to.steps.is_empty() {
                    to.root = self.distance.clone();
                    return self.moved(value);
                }
                self.expression(value)?;
                let stored = self.stored(to, value.clone(), &span)?;
                statement.kind = stored;
                Some(())
            }
            StatementKind::Assign(to, value) => {
                self.path(to)?;
                self.expression(value)
            }
            StatementKind::Call(path, arguments) => {
                self.path(path)?;
                self.arguments(arguments)
            }
            StatementKind::If(branches, otherwise) => {
                for (condition, body) in branches {
                    self.expression(condition)?;
                    self.statements(body)?;
                }
                self.statements(otherwise)
            }
            StatementKind::Case(selector, cases, otherwise) => {
                self.expression(selector)?;
                for (_, body) in cases {
                    self.statements(body)?;
                }
                self.statements(otherwise)
            }
            StatementKind::For(written) => {
                self.path(&mut written.counter)?;
                self.expression(&mut written.from)?;
                self.expression(&mut written.to)?;
                if let Some(by) = &mut written.by {
                    self.expression(by)?;
                }
                self.statements(&mut written.body)
            }
            StatementKind::While(condition, body) | StatementKind::Repeat(body, condition) => {
                self.expression(condition)?;
                self.statements(body)
            }
            StatementKind::Exit
            | StatementKind::Continue
            | StatementKind::Return
            | StatementKind::Code(_)
            | StatementKind::Nothing => Some(()),
        }
    }

    fn arguments(&mut self, arguments: &mut [Argument]) -> Option<()> {
        arguments.iter_mut().try_for_each(|argument| match argument {
            Argument::Placed(value) | Argument::Given(_, value) => self.expression(value),
            Argument::Taken { to, .. } => self.path(to),
        })
    }

    /// A variable that is not a pointer, or an input that is followed.
    fn path(&mut self, path: &mut Path) -> Option<()> {
        if path.root == self.name {
            if !self.is_input || !matches!(path.steps.first(), Some(Step::Follow)) {
                return None;
            }
            path.steps.remove(0);
        }
        self.indices(path)
    }

    fn indices(&mut self, path: &mut Path) -> Option<()> {
        path.steps.iter_mut().try_for_each(|step| match step {
            Step::Index(indices) => indices.iter_mut().try_for_each(|index| self.expression(index)),
            _ => Some(()),
        })
    }

    fn expression(&mut self, expression: &mut Expression) -> Option<()> {
        let span = expression.span.clone();
        match &mut expression.kind {
            ExpressionKind::Variable(found) if found.root == self.name && !self.is_input => {
                let distance = self.distance(found)?;
                let value = self.pointed(POINTED, distance, None, &span)?;
                *expression = value;
                Some(())
            }
            ExpressionKind::Variable(path) => self.path(path),
            ExpressionKind::Not(inner) | ExpressionKind::Minus(inner) => self.expression(inner),
            ExpressionKind::Chain(first, rest) => {
                self.expression(first)?;
                rest.iter_mut().try_for_each(|(_, value)| self.expression(value))
            }
            ExpressionKind::Call(path, arguments) => {
                self.path(path)?;
                self.arguments(arguments)
            }
            ExpressionKind::Literal(_) | ExpressionKind::Qualified(..) | ExpressionKind::Faulty => {
                Some(())
            }
        }
    }

    /// `pt := ADR(x) + n`, `pt := pt + n`
    fn moved(&mut self, value: &mut Expression) -> Option<()> {
        let (first, rest) = match &mut value.kind {
            ExpressionKind::Chain(first, rest) => (&mut **first, rest.as_mut_slice()),
            _ => (&mut *value, [].as_mut_slice()),
        };
        for (operator, value) in rest {
            if !matches!(operator, Operator::Add | Operator::Subtract) {
                return None;
            }
            self.expression(value)?;
        }
        let span = first.span.clone();
        match &mut first.kind {
            ExpressionKind::Call(function, arguments)
                if function.steps.is_empty()
                    && (function.root.is("ADR") || function.root.is("REF")) =>
            {
                let [Argument::Placed(given)] = arguments.as_slice() else {
                    return None;
                };
                let ExpressionKind::Variable(target) = &given.kind else {
                    return None;
                };
                self.points_to(target)?;
                *first = integer(0, &span);
                Some(())
            }
            ExpressionKind::Variable(path) if path.root == self.name && path.steps.is_empty() => {
                path.root = self.distance.clone();
                Some(())
            }
            _ => None,
        }
    }

    /// It points into one variable, whatever happens.
    fn points_to(&mut self, target: &Path) -> Option<()> {
        let field = |step: &Step| match step {
            Step::Field(name) => Some(name.key()),
            _ => None,
        };
        let parts: Option<Vec<String>> = target.steps.iter().map(field).collect();
        let parts = parts?;
        match &self.target {
            None if target.root != self.name => self.target = Some(target.clone()),
            Some(known) if known.root == target.root => {
                let known: Option<Vec<String>> = known.steps.iter().map(field).collect();
                return (known? == parts).then_some(());
            }
            _ => return None,
        }
        Some(())
    }

    /// How far `pt^` or `pt^[i]` is from the start of the variable, in bytes.
    fn distance(&mut self, path: &mut Path) -> Option<Expression> {
        let span = path.span.clone();
        let own = variable(self.distance.as_str(), &span);
        match (path.steps.as_mut_slice(), &self.low) {
            ([Step::Follow], None) => Some(own),
            ([Step::Follow, Step::Index(indices)], Some(low)) => {
                let [index] = indices.as_mut_slice() else {
                    return None;
                };
                let low = low.clone();
                self.expression(index)?;
                // It is evaluated more than once.
                if calls(index) {
                    return None;
                }
                let from = join(index.clone(), Operator::Subtract, low);
                let of = variable(self.element.as_ref()?.as_str(), &span);
                let size = Expression {
                    kind: ExpressionKind::Call(
                        self::path("SIZEOF", None, &span),
                        vec![Argument::Placed(of)],
                    ),
                    span: span.clone(),
                };
                Some(join(own, Operator::Add, join(from, Operator::Multiply, size)))
            }
            _ => None,
        }
    }

    /// `pt^ := value` of a variable without parts.
    fn stored(&mut self, to: &mut Path, value: Expression, span: &Span) -> Option<StatementKind> {
        let distance = self.distance(to)?;
        let value = self.pointed(STORED, distance, Some(value), span)?;
        Some(StatementKind::Assign(self.target.clone()?, value))
    }

    fn pointed(
        &self,
        function: &str,
        distance: Expression,
        value: Option<Expression>,
        span: &Span,
    ) -> Option<Expression> {
        let target =
            Expression { kind: ExpressionKind::Variable(self.target.clone()?), span: span.clone() };
        let of = variable(self.element.as_ref()?.as_str(), span);
        let mut values = vec![target, distance, of];
        values.extend(value);
        let arguments = values.into_iter().map(Argument::Placed).collect();
        Some(Expression {
            kind: ExpressionKind::Call(path(function, None, span), arguments),
            span: span.clone(),
        })
    }
}

/// Whether a value calls something.
fn calls(value: &Expression) -> bool {
    match &value.kind {
        ExpressionKind::Call(..) => true,
        ExpressionKind::Not(inner) | ExpressionKind::Minus(inner) => calls(inner),
        ExpressionKind::Chain(first, rest) => {
            calls(first) || rest.iter().any(|(_, value)| calls(value))
        }
        ExpressionKind::Variable(path) => path.steps.iter().any(|step| match step {
            Step::Index(indices) => indices.iter().any(calls),
            _ => false,
        }),
        _ => false,
    }
}
