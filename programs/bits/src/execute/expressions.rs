//! Values of expressions, and calls.

use understudy_typed::{
    Argument, Call, Elementary, Expression, ExpressionKind, Operation, TextOperation, Type,
};

use super::{Context, Either, Execution, Result, Value};
use crate::term::Term;

impl Execution<'_> {
    pub(super) fn number(&mut self, context: Context, expression: &Expression) -> Result<Term> {
        match self.value(context, expression)? {
            Value::Number(number) => Ok(number),
            _ => self.unsupported(context, "a number was expected"),
        }
    }

    pub(super) fn value(&mut self, context: Context, expression: &Expression) -> Result<Value> {
        let of = expression.of.elementary();
        match (&expression.kind, of) {
            (ExpressionKind::Constant(stored), Some(of)) => {
                Ok(Value::Number(self.terms.constant(of, *stored)))
            }
            (ExpressionKind::Constant(_) | ExpressionKind::Text(_), _) => Ok(Value::Text),
            (ExpressionKind::Load(place), _) => {
                let places = self.places(context, place)?;
                let mut loaded: Option<Value> = None;
                for (condition, address) in places.into_iter().rev() {
                    let value = self.load(address, &place.of);
                    loaded = Some(match (loaded, value) {
                        (None, value) => value,
                        (Some(other), value) => self.chosen(condition, value, other),
                    });
                }
                Ok(loaded.unwrap_or(Value::Text))
            }
            (ExpressionKind::Apply(operation, operands), of) => {
                self.apply(context, *operation, operands, of)
            }
            (ExpressionKind::Choose(parts), _) => {
                let [condition, first, second] = &**parts;
                let condition = self.number(context, condition)?;
                let value = self.either(
                    condition,
                    |this| this.value(context, first),
                    |this| this.value(context, second),
                )?;
                Ok(match value {
                    Either::Only(value) => value,
                    Either::Both(one, other) => self.chosen(condition, one, other),
                })
            }
            (ExpressionKind::Call(call), _) => self.call(context, call),
        }
    }

    pub(super) fn chosen(&mut self, condition: Term, then: Value, otherwise: Value) -> Value {
        match (then, otherwise) {
            (Value::Number(then), Value::Number(otherwise)) => {
                Value::Number(self.terms.choose(condition, then, otherwise))
            }
            (Value::Parts(then), Value::Parts(otherwise)) => {
                let pairs = then.into_iter().zip(otherwise);
                Value::Parts(
                    pairs
                        .map(|((offset, one), (_, other))| {
                            (offset, self.terms.choose(condition, one, other))
                        })
                        .collect(),
                )
            }
            _ => Value::Text,
        }
    }

    pub(super) fn apply(
        &mut self,
        context: Context,
        operation: Operation,
        operands: &[Expression],
        of: Option<Elementary>,
    ) -> Result<Value> {
        let mut values = Vec::with_capacity(operands.len());
        for operand in operands {
            values.push(self.value(context, operand)?);
        }
        let Some(of) = of else {
            return Ok(Value::Text);
        };
        if let Operation::Text(text) = operation {
            let of = match text {
                TextOperation::Compare(_) => Elementary::Bool,
                _ => of,
            };
            return Ok(Value::Number(self.terms.unknown(of)));
        }
        if operation == Operation::Elapsed {
            return Ok(Value::Number(self.elapsed));
        }
        let mut numbers = Vec::with_capacity(values.len());
        for value in values {
            match value {
                Value::Number(number) => numbers.push(number),
                _ => return self.unsupported(context, "a number was expected"),
            }
        }
        match operation {
            // A remainder by 0 is 0.
            Operation::Divide(kind) if !kind.is_real() => {
                let zero = self.terms.equals(numbers[1], 0);
                self.fault(zero);
            }
            Operation::Multiplex(_) => {
                let last = numbers.len() as i128 - 2;
                let inside = self.between(numbers[0], 0, last);
                let outside = self.terms.not(inside);
                self.fault(outside);
                let mut chosen = numbers[numbers.len() - 1];
                for (place, &operand) in numbers[1..].iter().enumerate().rev().skip(1) {
                    let here = self.terms.equals(numbers[0], place as u64);
                    chosen = self.terms.choose(here, operand, chosen);
                }
                return Ok(Value::Number(chosen));
            }
            _ => {}
        }
        Ok(Value::Number(self.terms.apply(operation, of, &numbers)))
    }

    pub(super) fn call(&mut self, context: Context, call: &Call) -> Result<Value> {
        let own = match &call.own {
            Some(place) => self.address(context, place)? / 64,
            None => 0,
        };
        let inner = Context { routine: call.routine, own };
        let mut given = Vec::with_capacity(call.arguments.len());
        for argument in &call.arguments {
            given.push(match argument {
                Argument::Value(_, value) => self.value(context, value)?,
                Argument::Reference(_, place) => {
                    let address = self.address(context, place)?;
                    Value::Number(self.terms.constant(Elementary::Lword, address))
                }
            });
        }
        let mut taken = Vec::with_capacity(call.outputs.len());
        for (_, to) in &call.outputs {
            taken.push(self.address(context, to)?);
        }
        let statement = self.terms.statement;
        self.clear_frame(call.routine);
        for (argument, value) in call.arguments.iter().zip(given) {
            match (argument, value) {
                (Argument::Reference(slot, _), Value::Number(address)) => {
                    let mut holder = slot.clone();
                    holder.of = Type::Elementary(Elementary::Lword);
                    let slot = self.address(inner, &holder)?;
                    self.set(slot, address);
                }
                (Argument::Value(place, _) | Argument::Reference(place, _), value) => {
                    self.store(inner, place, value)?;
                }
            }
        }
        self.body(inner)?;
        self.terms.statement = statement;
        for ((from, to), address) in call.outputs.iter().zip(taken) {
            let source = self.address(inner, from)?;
            match self.load(source, &from.of) {
                Value::Number(number) => self.set(address, number),
                Value::Parts(parts) => {
                    for (offset, value) in parts {
                        self.set(address + offset, value);
                    }
                }
                Value::Text => {
                    if matches!(to.of, Type::Text(_)) {
                        let long = self.terms.unknown(Elementary::Bool);
                        self.fault(long);
                    }
                }
            }
        }
        match &call.result {
            Some(place) => {
                let address = self.address(inner, place)?;
                Ok(self.load(address, &place.of))
            }
            None => Ok(Value::Number(self.terms.boolean(false))),
        }
    }
}
