//! Functions: the standard ones, and the text's own, which are executed where they are called.

use std::ops::Range;

use understudy_ladder::{Name, Relation};
use understudy_text::Diagnostic;

use super::super::program::{Action, Number, Role, Truth};
use super::super::syntax::{Argument, UnitKind};
use super::expression::Value;
use super::types::whole_range;
use super::{Entity, Resolver};

impl Resolver {
    /// The value of a function.
    pub(super) fn function(
        &mut self,
        instance: usize,
        name: &Name,
        arguments: &[Argument],
        span: &Range<usize>,
    ) -> Value {
        let key = name.to_ascii_uppercase();
        let user = self.by_name.get(&key).copied();
        if let Some(unit) = user.filter(|unit| self.units[*unit].kind == UnitKind::Function) {
            return self.call_function(instance, unit, name, arguments, span);
        }
        let mut values = Vec::new();
        for argument in arguments {
            match argument {
                Argument::Placed(value) | Argument::Given(_, value) => {
                    values.push(self.expression(instance, value))
                }
                Argument::Taken(name, _) => {
                    self.error("U1049", "a function has no other output", name.span());
                }
            }
        }
        if values.iter().any(|value| matches!(value, Value::Error)) {
            return Value::Error;
        }
        match self.standard_function(&key, values, span) {
            Some(value) => value,
            None => {
                let message = format!("the function `{name}` with these values is not supported");
                let finding = Diagnostic::error("U1040", message, name.span());
                self.say(finding.with_help("taken are NOT, AND, OR, XOR, comparisons, ADD, SUB, MUL, ABS, MIN, MAX, LIMIT, SEL, MOVE and conversions"));
                Value::Error
            }
        }
    }

    fn call_function(
        &mut self,
        instance: usize,
        unit: usize,
        name: &Name,
        arguments: &[Argument],
        span: &Range<usize>,
    ) -> Value {
        if self.is_full {
            return Value::Error;
        }
        if self.stack.contains(&unit) {
            self.error("U1047", format!("`{name}` calls itself"), span.clone());
            return Value::Error;
        }
        let path = self.unique(name);
        let blame = self.blame.clone();
        if self.units[unit].foreign && self.blame.is_none() {
            self.blame = Some(span.clone());
        }
        let called = self.instantiate(unit, path, false);
        self.blame = blame;
        self.give(instance, called, arguments, span);
        self.execute_called(called, span);
        match self.entity(called, name) {
            Some(Entity::Cell(cell)) => self.value_of(*cell),
            _ => Value::Error,
        }
    }

    fn standard_function(
        &mut self,
        key: &str,
        mut values: Vec<Value>,
        span: &Range<usize>,
    ) -> Option<Value> {
        let all_truths = values.iter().all(|value| matches!(value, Value::Truth(_)));
        let all_numbers = values.iter().all(|value| matches!(value, Value::Number(_)));
        let truths = || {
            values.iter().filter_map(|value| match value {
                Value::Truth(truth) => Some(truth.clone()),
                _ => None,
            })
        };
        let relation = match key {
            "GT" => Some(Relation::Greater),
            "GE" => Some(Relation::GreaterOrEqual),
            "EQ" => Some(Relation::Equal),
            "NE" => Some(Relation::NotEqual),
            "LE" => Some(Relation::LessOrEqual),
            "LT" => Some(Relation::Less),
            _ => None,
        };
        match (key, values.len()) {
            ("NOT", 1) if all_truths => truths()
                .next()
                .map(|truth| Value::Truth(Truth::Not(Box::new(truth)))),
            ("AND", 2..) if all_truths => Some(Value::Truth(Truth::All(truths().collect()))),
            ("OR", 2..) if all_truths => Some(Value::Truth(Truth::Any(truths().collect()))),
            ("XOR", 2..) if all_truths => Some(Value::Truth(Truth::Odd(truths().collect()))),
            ("MOVE", 1) => values.pop(),
            ("SEL", 3) => self.select(values, span),
            _ if all_numbers => {
                let numbers: Vec<Number> = values
                    .into_iter()
                    .filter_map(|value| match value {
                        Value::Number(number) => Some(number),
                        _ => None,
                    })
                    .collect();
                match (relation, numbers.as_slice()) {
                    (Some(relation), [left, right]) => {
                        let (left, right) = (Box::new(left.clone()), Box::new(right.clone()));
                        Some(Value::Truth(Truth::Compare(relation, left, right)))
                    }
                    (Some(_), _) => None,
                    (None, _) => self.number_function(key, numbers, span),
                }
            }
            (_, 1) if key.starts_with("BOOL_TO_") && all_truths => {
                let truth = truths().next()?;
                let choice = Number::Choice(
                    Box::new(truth),
                    Box::new(Number::Constant(1)),
                    Box::new(Number::Constant(0)),
                );
                whole_range(&key["BOOL_TO_".len()..]).map(|_| Value::Number(choice))
            }
            _ => None,
        }
    }

    fn select(&mut self, values: Vec<Value>, span: &Range<usize>) -> Option<Value> {
        let mut values = values.into_iter();
        let Some(Value::Truth(which)) = values.next() else {
            return None;
        };
        match (values.next()?, values.next()?) {
            (Value::Number(first), Value::Number(second)) => Some(Value::Number(Number::Choice(
                Box::new(which),
                Box::new(second),
                Box::new(first),
            ))),
            (Value::Truth(first), Value::Truth(second)) => {
                let which = self.hold_truth(which, span);
                let taken = Truth::All(vec![which.clone(), second]);
                let untaken = Truth::All(vec![Truth::Not(Box::new(which)), first]);
                Some(Value::Truth(Truth::Any(vec![taken, untaken])))
            }
            _ => None,
        }
    }

    fn hold_truth(&mut self, truth: Truth, span: &Range<usize>) -> Truth {
        if matches!(truth, Truth::Cell(_) | Truth::Constant(_)) {
            return truth;
        }
        let cell = self.add_bit("chosen".to_owned(), Role::Memory, span);
        if self.is_full {
            return Truth::Constant(false);
        }
        self.push(Action::SetTruth(cell, truth), span.clone(), Vec::new());
        Truth::Cell(cell)
    }

    fn number_function(
        &mut self,
        key: &str,
        numbers: Vec<Number>,
        span: &Range<usize>,
    ) -> Option<Value> {
        let count = numbers.len();
        let mut numbers = numbers.into_iter();
        let number = match (key, count) {
            ("ADD", 2..) => Number::Sum(numbers.map(|number| (false, number)).collect()),
            ("SUB", 2) => Number::Sum(vec![(false, numbers.next()?), (true, numbers.next()?)]),
            ("MUL", 2..=16) => Number::Product(numbers.collect()),
            ("ABS", 1) => {
                let number = self.hold(numbers.next()?, span);
                let negative = compare(Relation::Less, &number, &Number::Constant(0));
                let negated = Number::Sum(vec![(true, number.clone())]);
                Number::Choice(Box::new(negative), Box::new(negated), Box::new(number))
            }
            ("MIN" | "MAX", 2..) => {
                let relation = if key == "MIN" {
                    Relation::Less
                } else {
                    Relation::Greater
                };
                let first = numbers.next()?;
                numbers.fold(first, |best, other| {
                    self.better(relation, best, other, span)
                })
            }
            ("LIMIT", 3) => {
                let (least, number, most) = (numbers.next()?, numbers.next()?, numbers.next()?);
                let raised = self.better(Relation::Greater, least, number, span);
                self.better(Relation::Less, raised, most, span)
            }
            (_, 1) => {
                let (from, to) = key.split_once("_TO_")?;
                let number = numbers.next()?;
                whole_range(from)?;
                if to == "BOOL" {
                    return Some(Value::Truth(compare(
                        Relation::NotEqual,
                        &number,
                        &Number::Constant(0),
                    )));
                }
                let wide = whole_range(to)?;
                let kept = number
                    .constant()
                    .filter(|value| (wide.0..=wide.1).contains(value));
                match kept {
                    Some(value) => Number::Constant(value),
                    None => self.hold_as(wide, number, span),
                }
            }
            _ => return None,
        };
        Some(Value::Number(
            number.constant().map_or(number, Number::Constant),
        ))
    }

    /// The one of two numbers that has `relation` to the other.
    fn better(
        &mut self,
        relation: Relation,
        left: Number,
        right: Number,
        span: &Range<usize>,
    ) -> Number {
        let (left, right) = (self.hold(left, span), self.hold(right, span));
        let chosen = compare(relation, &left, &right);
        Number::Choice(Box::new(chosen), Box::new(left), Box::new(right))
    }
}

fn compare(relation: Relation, left: &Number, right: &Number) -> Truth {
    Truth::Compare(relation, Box::new(left.clone()), Box::new(right.clone()))
}
