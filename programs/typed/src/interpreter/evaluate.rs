//! Expressions, places and calls of the interpreter.

use crate::fault::{Cause, Fault};
use crate::form::{Argument, Call, Expression, ExpressionKind, Place, Root};
use crate::interpreter::memory::{Address, Value};
use crate::interpreter::{Context, Run};
use crate::operation::{Operation, TextOperand, TextOperation};

impl Run<'_> {
    /// The address of a place.
    pub(super) fn address(
        &mut self,
        context: Context,
        line: u32,
        place: &Place,
    ) -> Result<Address, Fault> {
        let fault = |cause| Fault { cause, routine: Some(context.routine), line };
        let frames = u64::from(self.program.state);
        let mut address = match place.root {
            Root::Global(slot) => 64 * u64::from(slot),
            Root::Own(slot) => 64 * (context.own + u64::from(slot)),
            Root::Frame(slot) => 64 * (frames + u64::from(slot)),
            Root::OwnReference(slot) => {
                self.reference(context.own + u64::from(slot), place).map_err(fault)?
            }
            Root::FrameReference(slot) => {
                self.reference(frames + u64::from(slot), place).map_err(fault)?
            }
        };
        address += 64 * u64::from(place.offset) + u64::from(place.bit);
        for index in &place.indices {
            let value = self.number(context, line, &index.value)? as i64;
            if value < index.low || value > index.high {
                let bound = if value < index.low { index.low } else { index.high };
                return Err(fault(Cause::IndexOutOfRange { index: value, bound }));
            }
            address += value.abs_diff(index.low) * index.stride;
        }
        Ok(Address(address))
    }

    /// The address that a reference holds.
    fn reference(&self, slot: u64, place: &Place) -> Result<u64, Cause> {
        let address = self.memory.slots()[slot as usize];
        if self.memory.holds(address, place.reach()) {
            Ok(address)
        } else {
            Err(Cause::UnboundReference { address })
        }
    }

    /// The value of an expression of an elementary type.
    pub(super) fn number(
        &mut self,
        context: Context,
        line: u32,
        expression: &Expression,
    ) -> Result<u64, Fault> {
        match self.value(context, line, expression)? {
            Value::Number(number) => Ok(number),
            other => panic!("{other:?} is no number"),
        }
    }

    pub(super) fn value(
        &mut self,
        context: Context,
        line: u32,
        expression: &Expression,
    ) -> Result<Value, Fault> {
        match &expression.kind {
            ExpressionKind::Constant(stored) => Ok(Value::Number(*stored)),
            ExpressionKind::Text(text) => Ok(Value::Text(text.to_vec())),
            ExpressionKind::Load(place) => {
                let address = self.address(context, line, place)?;
                self.loaded(address, &place.of);
                Ok(self.memory.load(address, &place.of))
            }
            ExpressionKind::Apply(operation, operands) => {
                let mut values = Vec::with_capacity(operands.len());
                for operand in operands {
                    values.push(self.value(context, line, operand)?);
                }
                let value = self.apply(*operation, &values).map_err(|cause| Fault {
                    cause,
                    routine: Some(context.routine),
                    line,
                })?;
                self.made(*operation, &expression.of, &value);
                Ok(value)
            }
            ExpressionKind::Choose(parts) => {
                let [condition, first, second] = &**parts;
                if self.number(context, line, condition)? != 0 {
                    self.value(context, line, first)
                } else {
                    self.value(context, line, second)
                }
            }
            ExpressionKind::Call(call) => self.call(context, line, call),
        }
    }

    fn apply(&self, operation: Operation, values: &[Value]) -> Result<Value, Cause> {
        match operation {
            Operation::Text(operation) => Ok(apply_to_texts(operation, values)),
            Operation::Elapsed => Ok(Value::Number(self.elapsed)),
            _ => {
                let numbers = values.iter().map(|value| match value {
                    Value::Number(number) => *number,
                    other => panic!("{other:?} is no number"),
                });
                let numbers: Vec<u64> = numbers.collect();
                Ok(Value::Number(operation.apply(&numbers)?))
            }
        }
    }

    fn call(&mut self, context: Context, line: u32, call: &Call) -> Result<Value, Fault> {
        let fault = |cause| Fault { cause, routine: Some(context.routine), line };
        let own = match &call.own {
            Some(place) => self.address(context, line, place)?.0 / 64,
            None => 0,
        };
        let inner = Context { routine: call.routine, own };
        let mut given = Vec::with_capacity(call.arguments.len());
        for argument in &call.arguments {
            given.push(match argument {
                Argument::Value(_, value) => self.value(context, line, value)?,
                Argument::Reference(_, place) => {
                    Value::Number(self.address(context, line, place)?.0)
                }
            });
        }
        let mut taken = Vec::with_capacity(call.outputs.len());
        for (_, to) in &call.outputs {
            taken.push(self.address(context, line, to)?);
        }
        self.clear_frame(call.routine);
        for (argument, value) in call.arguments.iter().zip(given) {
            match (argument, value) {
                (Argument::Reference(slot, _), Value::Number(address)) => {
                    let slot = self.address(inner, line, &slot.holder())?;
                    self.memory.set_word(slot, address);
                }
                (Argument::Value(place, _) | Argument::Reference(place, _), value) => {
                    let to = self.address(inner, line, place)?;
                    let stored = self.memory.store(to, &place.of, value);
                    stored.map_err(fault)?;
                }
            }
        }
        self.body(inner)?;
        for ((from, to), address) in call.outputs.iter().zip(taken) {
            let source = self.address(inner, line, from)?;
            let value = self.memory.load(source, &from.of);
            let stored = self.memory.store(address, &to.of, value);
            stored.map_err(fault)?;
            let reads = self.mark();
            self.loaded(source, &from.of);
            self.assigned(context, line, address, &to.of, reads);
        }
        match &call.result {
            Some(place) => {
                let address = self.address(inner, line, place)?;
                self.loaded(address, &place.of);
                Ok(self.memory.load(address, &place.of))
            }
            None => Ok(Value::Number(0)),
        }
    }
}

fn apply_to_texts(operation: TextOperation, values: &[Value]) -> Value {
    let operands = values.iter().map(|value| match value {
        Value::Number(number) => TextOperand::Number(*number),
        Value::Text(text) => TextOperand::Text(text),
        Value::Slots(_) => panic!("an array or a structure is no text"),
    });
    let operands: Vec<TextOperand<'_>> = operands.collect();
    let mut text = Vec::new();
    let number = operation.apply(&operands, &mut text);
    match operation.number() {
        Some(_) => Value::Number(number),
        None => Value::Text(text),
    }
}
