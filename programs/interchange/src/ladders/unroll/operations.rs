//! Operations on values.

use understudy_ladder::Relation;
use understudy_typed::{Comparison, Elementary, Operation};

use super::super::program::{Number, Truth};
use super::values::Value;
use super::{Found, Kind, Unrolling, kind_of, range_of};

impl Unrolling<'_> {
    pub(super) fn operate(&mut self, operation: Operation, values: Vec<Value>) -> Found<Value> {
        use Operation as O;
        if let O::Divide(_) | O::Modulo(_) = operation
            && values[1].constant().is_none_or(|by| by == 0)
        {
            return Err(self.refuse("it divides by a number that varies"));
        }
        let unknown = values.iter().find_map(|value| match value {
            Value::Unknown(what) => Some(what.clone()),
            _ => None,
        });
        if let Some(what) = unknown {
            return match operation {
                O::Multiplex(_) => Err(self.refuse(what)),
                _ => Ok(Value::Unknown(what)),
            };
        }
        match operation {
            O::Elapsed => Ok(Value::Unknown("it uses TIME()".into())),
            O::Not(Elementary::Bool) => {
                let truth = self.truths(values)?.remove(0);
                Ok(Value::Truth(Truth::Not(Box::new(truth))))
            }
            O::And(Elementary::Bool) | O::Minimum(Elementary::Bool) => {
                Ok(Value::Truth(Truth::All(self.truths(values)?)))
            }
            O::Or(Elementary::Bool) | O::Maximum(Elementary::Bool) => {
                Ok(Value::Truth(Truth::Any(self.truths(values)?)))
            }
            O::Xor(Elementary::Bool) => Ok(Value::Truth(Truth::Odd(self.truths(values)?))),
            O::Compare(comparison, of) => self.compare(comparison, of, values),
            O::Select(of) => {
                let mut values = values.into_iter();
                let (Some(which), Some(first), Some(second)) =
                    (values.next(), values.next(), values.next())
                else {
                    return Err(self.refuse("it uses SEL with too few values"));
                };
                let which = self.truth_of(which)?;
                self.chosen(which, second, first, Some(of))
            }
            O::Multiplex(_) => {
                let which = values[0].constant().and_then(|which| usize::try_from(which).ok());
                let found = which.and_then(|which| values.get(which.saturating_add(1)).cloned());
                found.ok_or_else(|| self.refuse("it uses MUX with a number that varies"))
            }
            O::Convert(from, to) => self.convert(from, to, values),
            O::Add(of)
            | O::Subtract(of)
            | O::Multiply(of)
            | O::Divide(of)
            | O::Modulo(of)
            | O::Negate(of)
            | O::Absolute(of)
            | O::Minimum(of)
            | O::Maximum(of)
                if range_of(of).is_some() =>
            {
                self.arithmetic(operation, of, values)
            }
            O::Reinterpret(from, to) if range_of(from).is_some() && range_of(to).is_some() => {
                self.convert(from, to, values)
            }
            _ => Err(self.refuse(format!(
                "it uses an operation that a ladder does not have: {operation:?}"
            ))),
        }
    }

    pub(super) fn truths(&mut self, values: Vec<Value>) -> Found<Vec<Truth>> {
        values.into_iter().map(|value| self.truth_of(value)).collect()
    }

    pub(super) fn arithmetic(
        &mut self,
        operation: Operation,
        of: Elementary,
        values: Vec<Value>,
    ) -> Found<Value> {
        use Operation as O;
        let by = values.get(1).and_then(Value::constant).unwrap_or(1);
        let mut numbers = Vec::new();
        for value in values {
            numbers.push(self.number_of(value)?);
        }
        let number = match operation {
            O::Add(_) => Number::Sum(numbers.into_iter().map(|number| (false, number)).collect()),
            O::Subtract(_) | O::Negate(_) => {
                let is_one = numbers.len() == 1;
                let parts = numbers.into_iter().enumerate();
                Number::Sum(parts.map(|(at, part)| (is_one || at > 0, part)).collect())
            }
            O::Multiply(_) => Number::Product(numbers),
            O::Divide(_) => Number::Quotient(Box::new(numbers.remove(0)), by),
            O::Modulo(_) => Number::Remainder(Box::new(numbers.remove(0)), by),
            O::Absolute(_) => {
                let number = self.hold_number(numbers.remove(0))?;
                let zero = Box::new(Number::Constant(0));
                let is_negative = Truth::Compare(Relation::Less, Box::new(number.clone()), zero);
                let negated = Number::Sum(vec![(true, number.clone())]);
                Number::Choice(Box::new(is_negative), Box::new(negated), Box::new(number))
            }
            _ => {
                let is_least = matches!(operation, O::Minimum(_));
                let relation = if is_least { Relation::Less } else { Relation::Greater };
                let mut numbers = numbers.into_iter();
                let mut best = numbers.next().unwrap_or(Number::Constant(0));
                for other in numbers {
                    let (left, right) = (self.hold_number(best)?, self.hold_number(other)?);
                    let (one, two) = (Box::new(right.clone()), Box::new(left.clone()));
                    let is_better = Truth::Compare(relation, one, two);
                    best = Number::Choice(Box::new(is_better), Box::new(right), Box::new(left));
                }
                best
            }
        };
        Ok(Value::Number(wrapped(number, of)))
    }

    pub(super) fn compare(
        &mut self,
        comparison: Comparison,
        of: Elementary,
        values: Vec<Value>,
    ) -> Found<Value> {
        let relation = relation(comparison);
        if of == Elementary::Bool {
            let mut truths = self.truths(values)?;
            let (Some(right), Some(left)) = (truths.pop(), truths.pop()) else {
                return Err(self.refuse("it compares one value"));
            };
            let not = |truth| Truth::Not(Box::new(truth));
            return Ok(Value::Truth(match relation {
                Relation::Equal => not(Truth::Odd(vec![left, right])),
                Relation::NotEqual => Truth::Odd(vec![left, right]),
                Relation::Less => Truth::All(vec![not(left), right]),
                Relation::LessOrEqual => Truth::Any(vec![not(left), right]),
                Relation::Greater => Truth::All(vec![left, not(right)]),
                Relation::GreaterOrEqual => Truth::Any(vec![left, not(right)]),
            }));
        }
        let bound = |value: &Value| value.constant().and_then(|value| u16::try_from(value).ok());
        let (count, relation_of, with) = match values.as_slice() {
            [Value::Count(block), other] => (Some(*block), relation, bound(other)),
            [other, Value::Count(block)] => (Some(*block), relation.mirrored(), bound(other)),
            _ => (None, relation, None),
        };
        if let (Some(block), Some(with)) = (count, with) {
            let name = self.block_name(block);
            return Ok(Value::Truth(Truth::Counter(name, relation_of, with)));
        }
        let mut numbers = Vec::new();
        for value in values {
            numbers.push(Box::new(self.number_of(value)?));
        }
        match (numbers.pop(), numbers.pop()) {
            (Some(right), Some(left)) => Ok(Value::Truth(Truth::Compare(relation, left, right))),
            _ => Err(self.refuse("it compares one value")),
        }
    }

    pub(super) fn convert(
        &mut self,
        from: Elementary,
        to: Elementary,
        values: Vec<Value>,
    ) -> Found<Value> {
        let Some(value) = values.into_iter().next() else {
            return Err(self.refuse("it converts nothing"));
        };
        match (kind_of(from), kind_of(to)) {
            (Some(Kind::Truth), Some(Kind::Truth)) => Ok(value),
            (Some(Kind::Truth), Some(Kind::Number { .. })) => {
                let truth = Box::new(self.truth_of(value)?);
                let (one, zero) = (Number::Constant(1), Number::Constant(0));
                Ok(Value::Number(Number::Choice(truth, Box::new(one), Box::new(zero))))
            }
            (Some(Kind::Number { .. }), Some(Kind::Truth)) => {
                let number = Box::new(self.number_of(value)?);
                let zero = Box::new(Number::Constant(0));
                Ok(Value::Truth(Truth::Compare(Relation::NotEqual, number, zero)))
            }
            (Some(Kind::Number { wide: from, .. }), Some(Kind::Number { wide, .. })) => {
                let fits = wide.0 <= from.0 && from.1 <= wide.1;
                match value {
                    // A count is from 0 to its preset, which INT holds.
                    Value::Count(_) if wide.1 >= 0x7fff => Ok(value),
                    _ if fits => Ok(value),
                    _ => Ok(Value::Number(wrapped(self.number_of(value)?, to))),
                }
            }
            (_, None) if to == Elementary::Time => Ok(Value::Unknown("it computes a time".into())),
            _ => Err(self.refuse(format!("it converts {from} to {to}"))),
        }
    }
}

/// A number as its type holds it.
fn wrapped(number: Number, of: Elementary) -> Number {
    match range_of(of) {
        Some(range) => Number::Wrapped(Box::new(number), range),
        None => number,
    }
}

fn relation(comparison: Comparison) -> Relation {
    match comparison {
        Comparison::Equal => Relation::Equal,
        Comparison::NotEqual => Relation::NotEqual,
        Comparison::Less => Relation::Less,
        Comparison::LessOrEqual => Relation::LessOrEqual,
        Comparison::Greater => Relation::Greater,
        Comparison::GreaterOrEqual => Relation::GreaterOrEqual,
    }
}
