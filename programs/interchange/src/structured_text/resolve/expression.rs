//! Expressions: their names and types.

use std::ops::Range;
use std::time::Duration;

use understudy_ladder::{Name, Relation};
use understudy_text::Diagnostic;

use super::super::program::{Action, Cell, Kind, Number, Role, Truth};
use super::super::syntax::{Expression, ExpressionKind, Operator, Path};
use super::{Entity, Resolver};

/// The largest number of operands of one product.
const MAXIMUM_FACTORS: usize = 64;

/// What an expression is.
#[derive(Debug, Clone)]
pub(super) enum Value {
    Truth(Truth),
    Number(Number),
    Time(Option<Duration>),
    /// Already diagnosed.
    Error,
}

impl Value {
    fn words(&self) -> &'static str {
        match self {
            Self::Truth(_) => "a Boolean",
            Self::Number(_) => "a number",
            Self::Time(_) => "a time",
            Self::Error => "nothing",
        }
    }
}

impl Resolver {
    /// Its value where it is a constant number; otherwise nothing is reported.
    pub(super) fn constant(&mut self, instance: usize, expression: &Expression) -> Option<i64> {
        match &expression.kind {
            ExpressionKind::Integer(value) => Some(*value),
            ExpressionKind::Minus(inner) => self.constant(instance, inner)?.checked_neg(),
            ExpressionKind::Variable(path) => match path.parts.as_slice() {
                [name] => match self.entity(instance, name) {
                    Some(Entity::Number(value)) => Some(*value),
                    Some(_) => None,
                    None => self.enumeration_value(name),
                },
                _ => None,
            },
            _ => None,
        }
    }

    pub(super) fn truth(&mut self, instance: usize, expression: &Expression) -> Truth {
        let value = self.expression(instance, expression);
        self.as_truth(value, &expression.span)
    }

    fn as_truth(&mut self, value: Value, span: &Range<usize>) -> Truth {
        match value {
            Value::Truth(truth) => truth,
            // 0 and 1 stand for FALSE and TRUE.
            Value::Number(Number::Constant(value @ (0 | 1))) => Truth::Constant(value == 1),
            Value::Error => Truth::Constant(false),
            other => {
                let message = format!("a Boolean is expected, and this is {}", other.words());
                self.error("U1043", message, span.clone());
                Truth::Constant(false)
            }
        }
    }

    pub(super) fn number(&mut self, instance: usize, expression: &Expression) -> Number {
        let value = self.expression(instance, expression);
        self.as_number(value, &expression.span)
    }

    fn as_number(&mut self, value: Value, span: &Range<usize>) -> Number {
        match value {
            Value::Number(number) => number,
            Value::Error => Number::Constant(0),
            other => {
                let message = format!("a number is expected, and this is {}", other.words());
                self.error("U1043", message, span.clone());
                Number::Constant(0)
            }
        }
    }

    pub(super) fn expression(&mut self, instance: usize, expression: &Expression) -> Value {
        let span = &expression.span;
        match &expression.kind {
            ExpressionKind::Boolean(value) => Value::Truth(Truth::Constant(*value)),
            ExpressionKind::Integer(value) => Value::Number(Number::Constant(*value)),
            ExpressionKind::Time(time) => Value::Time(Some(*time)),
            ExpressionKind::Foreign(what) => {
                self.error("U1040", format!("{what} is not supported"), span.clone());
                Value::Error
            }
            ExpressionKind::Faulty => Value::Error,
            ExpressionKind::Variable(path) => self.read(instance, path),
            ExpressionKind::Not(inner) => match self.expression(instance, inner) {
                Value::Error => Value::Error,
                value => Value::Truth(Truth::Not(Box::new(self.as_truth(value, &inner.span)))),
            },
            ExpressionKind::Minus(inner) => {
                let number = self.number(instance, inner);
                Value::Number(match number {
                    Number::Constant(value) => Number::Constant(value.saturating_neg()),
                    other => Number::Sum(vec![(true, other)]),
                })
            }
            ExpressionKind::Chain(first, rest) => self.chain(instance, first, rest),
            ExpressionKind::Call(name, arguments) => self.function(instance, name, arguments, span),
        }
    }

    fn chain(
        &mut self,
        instance: usize,
        first: &Expression,
        rest: &[(Operator, Expression)],
    ) -> Value {
        if let [(operator, second)] = rest
            && let Some(relation) = relation(*operator)
            && let Some(compared) = self.counted(instance, first, relation, second)
        {
            return compared;
        }
        let mut left = self.expression(instance, first);
        let mut span = first.span.clone();
        if rest.len() > MAXIMUM_FACTORS && rest[0].0.rank() == Operator::Multiply.rank() {
            let message = format!("more than {MAXIMUM_FACTORS} factors in a row are not supported");
            self.error("U1040", message, span);
            return Value::Error;
        }
        for (operator, operand) in rest {
            let right = self.expression(instance, operand);
            if matches!(left, Value::Error) || matches!(right, Value::Error) {
                left = Value::Error;
                continue;
            }
            left = self.join(left, &span, *operator, right, &operand.span);
            span.end = operand.span.end;
        }
        left
    }

    /// `counter.CV >= 5`, where the counter is in a rung.
    fn counted(
        &mut self,
        instance: usize,
        first: &Expression,
        relation: Relation,
        second: &Expression,
    ) -> Option<Value> {
        let (path, value, relation) = match (&first.kind, &second.kind) {
            (ExpressionKind::Variable(path), ExpressionKind::Integer(value)) => {
                (path, *value, relation)
            }
            (ExpressionKind::Integer(value), ExpressionKind::Variable(path)) => {
                (path, *value, relation.mirrored())
            }
            _ => return None,
        };
        let [block, pin] = path.parts.as_slice() else {
            return None;
        };
        let Some(Entity::Instance(block)) = self.entity(instance, block) else {
            return None;
        };
        let Some(Entity::Counter(name)) = self.entity(*block, pin) else {
            return None;
        };
        let value = u16::try_from(value).ok()?;
        Some(Value::Truth(Truth::Counter(name.clone(), relation, value)))
    }

    fn join(
        &mut self,
        left: Value,
        left_span: &Range<usize>,
        operator: Operator,
        right: Value,
        right_span: &Range<usize>,
    ) -> Value {
        let both = left_span.start..right_span.end;
        if let (Value::Time(_), _) | (_, Value::Time(_)) = (&left, &right) {
            let finding = Diagnostic::error("U1045", "nothing can be calculated with times", both);
            self.say(finding.with_help("a time can only be the preset of a timer"));
            return Value::Error;
        }
        match operator {
            Operator::And | Operator::Or | Operator::Xor => {
                let left = self.as_truth(left, left_span);
                let right = self.as_truth(right, right_span);
                Value::Truth(match (operator, left) {
                    // A long chain stays flat.
                    (Operator::And, Truth::All(mut parts)) => {
                        parts.push(right);
                        Truth::All(parts)
                    }
                    (Operator::Or, Truth::Any(mut parts)) => {
                        parts.push(right);
                        Truth::Any(parts)
                    }
                    (Operator::Xor, Truth::Odd(mut parts)) => {
                        parts.push(right);
                        Truth::Odd(parts)
                    }
                    (Operator::And, left) => Truth::All(vec![left, right]),
                    (Operator::Or, left) => Truth::Any(vec![left, right]),
                    (_, left) => Truth::Odd(vec![left, right]),
                })
            }
            Operator::Power => {
                self.error("U1040", "powers are not supported", both);
                Value::Error
            }
            Operator::Equal | Operator::NotEqual if matches!(left, Value::Truth(_)) => {
                let left = self.as_truth(left, left_span);
                let right = self.as_truth(right, right_span);
                // a = b is an odd number of a, b and TRUE; a long chain stays flat.
                let mut parts = match left {
                    Truth::Odd(parts) => parts,
                    left => vec![left],
                };
                parts.push(right);
                if operator == Operator::Equal {
                    parts.push(Truth::Constant(true));
                }
                Value::Truth(Truth::Odd(parts))
            }
            _ => {
                let left = self.as_number(left, left_span);
                let right = self.as_number(right, right_span);
                match relation(operator) {
                    Some(relation) => {
                        Value::Truth(Truth::Compare(relation, Box::new(left), Box::new(right)))
                    }
                    None => self.calculate(left, operator, right, right_span),
                }
            }
        }
    }

    fn calculate(
        &mut self,
        left: Number,
        operator: Operator,
        right: Number,
        right_span: &Range<usize>,
    ) -> Value {
        let number = match operator {
            Operator::Add | Operator::Subtract => {
                let negative = operator == Operator::Subtract;
                match left {
                    Number::Sum(mut parts) => {
                        parts.push((negative, right));
                        Number::Sum(parts)
                    }
                    left => Number::Sum(vec![(false, left), (negative, right)]),
                }
            }
            Operator::Multiply => Number::Product(vec![left, right]),
            _ => match right.constant() {
                Some(by) if by != 0 && i32::try_from(by).is_ok() => match operator {
                    Operator::Divide => Number::Quotient(Box::new(left), by),
                    _ => Number::Remainder(Box::new(left), by),
                },
                Some(0) if operator == Operator::Modulo => Number::Constant(0),
                found => {
                    let message = match found {
                        Some(0) => "a division by 0",
                        Some(_) => "a division by a number of more than 32 bits is not supported",
                        None => "a division by a value that is not constant is not supported",
                    };
                    self.error("U1046", message, right_span.clone());
                    return Value::Error;
                }
            },
        };
        Value::Number(number.constant().map_or(number, Number::Constant))
    }

    /// The cell or constant behind a variable.
    fn read(&mut self, instance: usize, path: &Path) -> Value {
        let Some(entity) = self.look_up(instance, path) else {
            return Value::Error;
        };
        match entity {
            Entity::Truth(value) => Value::Truth(Truth::Constant(value)),
            Entity::Number(value) => Value::Number(Number::Constant(value)),
            Entity::Time(time) => Value::Time(time),
            Entity::Cell(cell) => self.value_of(cell),
            Entity::Broken => Value::Error,
            Entity::Instance(_) | Entity::Counter(_) => {
                let message = format!("`{}` is a block, and no value", path.text());
                self.error("U1043", message, path.span.clone());
                Value::Error
            }
        }
    }

    pub(super) fn value_of(&self, cell: usize) -> Value {
        match self.program.cells[cell].kind {
            Kind::Truth => Value::Truth(Truth::Cell(cell)),
            Kind::Number { .. } => Value::Number(Number::Cell(cell)),
        }
    }

    /// The meaning of a path; `None` where it has none, which is reported.
    pub(super) fn look_up(&mut self, instance: usize, path: &Path) -> Option<Entity> {
        let [names @ .., last] = path.parts.as_slice() else {
            return None;
        };
        let mut place = instance;
        for name in names {
            match self.named(place, name)? {
                Entity::Instance(next) => place = next,
                Entity::Broken => return Some(Entity::Broken),
                _ => {
                    let message = format!("`{name}` is not a block and has no members");
                    self.error("U1041", message, path.span.clone());
                    return None;
                }
            }
        }
        if last.starts_with('%') {
            return self.direct(last).map(Entity::Cell);
        }
        self.named(place, last)
    }

    fn named(&mut self, instance: usize, name: &Name) -> Option<Entity> {
        if let Some(entity) = self.entity(instance, name) {
            return Some(entity.clone());
        }
        if let Some(value) = self.enumeration_value(name) {
            return Some(Entity::Number(value));
        }
        let native = self.instances[instance].native;
        if native.is_some()
            && ["ET", "PT", "PV", "IN", "CV"].contains(&name.to_ascii_uppercase().as_str())
        {
            let word = native.unwrap_or_default();
            let message = format!("`{name}` of a {word} cannot be read");
            let finding = Diagnostic::error("U1040", message, name.span());
            self.say(finding.with_help(if name.eq_ignore_ascii_case("ET") {
                "a circuit counts a block's time in scans; one more timer with the same IN, and the time that is compared with as its PT, says by its Q when that has passed"
            } else {
                "a circuit holds the block's outputs, and counts its time in scans"
            }));
            return None;
        }
        let finding = Diagnostic::error("U1041", format!("`{name}` is not declared"), name.span());
        let near = self.nearest(instance, name).filter(|_| native.is_none());
        let near = near.map(str::to_owned);
        self.say(match near {
            Some(near) => finding.with_help(format!("did you mean `{near}`?")),
            None => finding,
        });
        None
    }

    /// A cell that holds what is used more than once.
    pub(super) fn hold(&mut self, number: Number, span: &Range<usize>) -> Number {
        if matches!(number, Number::Constant(_) | Number::Cell(_)) {
            return number;
        }
        // Wide enough for everything that is calculated with numbers of 32 bits; what it needs is found out.
        self.hold_as((-(1 << 62), 1 << 62), number, span)
    }

    /// A cell of a type that holds `wide`, past which the number wraps around.
    pub(super) fn hold_as(
        &mut self,
        wide: (i64, i64),
        number: Number,
        span: &Range<usize>,
    ) -> Number {
        let cell = Cell {
            name: self.unique("number"),
            kind: Kind::Number {
                declared: wide,
                wide,
            },
            role: Role::Memory,
            initial: 0,
            is_given: false,
            address: None,
            description: None,
        };
        let cell = self.add_cell(cell, span.clone());
        if self.is_full {
            return Number::Constant(0);
        }
        self.push(Action::SetNumber(cell, number), span.clone(), Vec::new());
        Number::Cell(cell)
    }
}

fn relation(operator: Operator) -> Option<Relation> {
    Some(match operator {
        Operator::Equal => Relation::Equal,
        Operator::NotEqual => Relation::NotEqual,
        Operator::Less => Relation::Less,
        Operator::LessOrEqual => Relation::LessOrEqual,
        Operator::Greater => Relation::Greater,
        Operator::GreaterOrEqual => Relation::GreaterOrEqual,
        _ => return None,
    })
}
