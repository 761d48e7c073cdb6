//! Expressions: what is known of them, or what they become.

use std::collections::HashSet;

use understudy_typed::{Elementary, Expression, ExpressionKind, Operation};

use super::super::program::{Action, Number, Role, Step, Truth, walk};
use super::{Context, Found, Kind, Unrolling, kind_of};

/// What an expression is.
#[derive(Debug, Clone)]
pub(super) enum Value {
    /// This value, as it is stored.
    Known(Elementary, u64),
    Truth(Truth),
    Number(Number),
    /// The count of a counter that is a block of the ladder.
    Count(u64),
    /// What a ladder cannot say, and why; it is refused where it is used.
    Unknown(String),
}

impl Value {
    pub(super) fn known(&self) -> Option<u64> {
        match self {
            Self::Known(_, value) => Some(*value),
            _ => None,
        }
    }

    /// Its number, where it is known.
    pub(super) fn constant(&self) -> Option<i64> {
        match self {
            Self::Known(of, value) => i64::try_from(of.signed(*value)).ok(),
            _ => None,
        }
    }

    /// Whether what it means changes where one of the cells is written.
    fn mentions(&self, cells: &HashSet<usize>) -> bool {
        let mut read = HashSet::new();
        match self {
            Self::Truth(truth) => read_truth(truth, &mut read),
            Self::Number(number) => read_number(number, &mut read),
            Self::Known(..) | Self::Count(_) | Self::Unknown(_) => {}
        }
        !read.is_disjoint(cells)
    }
}

/// The cells that steps write.
pub(super) fn written(steps: &[Step]) -> HashSet<usize> {
    let mut cells = HashSet::new();
    walk(steps, &mut |step| {
        if let Action::SetTruth(cell, _) | Action::SetNumber(cell, _) = step.action {
            cells.insert(cell);
        }
    });
    cells
}

/// The cells that steps read.
pub(super) fn read(steps: &[Step]) -> HashSet<usize> {
    let mut cells = HashSet::new();
    walk(steps, &mut |step| match &step.action {
        Action::SetTruth(_, truth) | Action::Timer { wire: truth, .. } => {
            read_truth(truth, &mut cells);
        }
        Action::SetNumber(_, number) => read_number(number, &mut cells),
        Action::If(branches, _) => {
            for (condition, _) in branches {
                read_truth(condition, &mut cells);
            }
        }
        Action::Block { wire, feeds, .. } => {
            read_truth(wire, &mut cells);
            for (_, feed) in feeds {
                read_truth(feed, &mut cells);
            }
        }
    });
    cells
}

fn read_truth(truth: &Truth, cells: &mut HashSet<usize>) {
    match truth {
        Truth::Constant(_) | Truth::Counter(..) => {}
        Truth::Cell(cell) => {
            cells.insert(*cell);
        }
        Truth::Not(inner) => read_truth(inner, cells),
        Truth::All(parts) | Truth::Any(parts) | Truth::Odd(parts) => {
            for part in parts {
                read_truth(part, cells);
            }
        }
        Truth::Compare(_, left, right) => {
            read_number(left, cells);
            read_number(right, cells);
        }
    }
}

fn read_number(number: &Number, cells: &mut HashSet<usize>) {
    match number {
        Number::Constant(_) => {}
        Number::Cell(cell) => {
            cells.insert(*cell);
        }
        Number::Sum(parts) => parts.iter().for_each(|(_, part)| read_number(part, cells)),
        Number::Product(parts) => parts.iter().for_each(|part| read_number(part, cells)),
        Number::Quotient(inner, _) | Number::Remainder(inner, _) | Number::Wrapped(inner, _) => {
            read_number(inner, cells);
        }
        Number::Choice(condition, then, otherwise) => {
            read_truth(condition, cells);
            read_number(then, cells);
            read_number(otherwise, cells);
        }
    }
}

impl Unrolling<'_> {
    /// The value of an expression; calls in it become steps.
    pub(super) fn value(&mut self, context: Context, expression: &Expression) -> Found<Value> {
        let of = expression.of.elementary();
        match &expression.kind {
            ExpressionKind::Constant(value) => match of {
                Some(of) => Ok(Value::Known(of, *value)),
                None => Err(self.refuse("it uses a value with parts")),
            },
            ExpressionKind::Text(_) => Err(self.refuse("it uses a STRING")),
            ExpressionKind::Load(place) => {
                let address = self.address(context, place)?;
                match of {
                    Some(of) => self.load(address, of),
                    None => Err(self.refuse("it uses a value with parts")),
                }
            }
            ExpressionKind::Apply(Operation::Text(_), _) => Err(self.refuse("it uses a STRING")),
            ExpressionKind::Apply(operation, operands) => {
                let values = self.operands(context, operands.iter())?;
                let known: Option<Vec<u64>> = values.iter().map(Value::known).collect();
                match (known, of) {
                    (Some(known), Some(of)) if *operation != Operation::Elapsed => {
                        match operation.apply(&known) {
                            Ok(value) => Ok(Value::Known(of, value)),
                            Err(_) => Err(self.refuse("it divides by 0 or has a wrong index")),
                        }
                    }
                    _ => self.operate(*operation, values),
                }
            }
            ExpressionKind::Choose(parts) => self.choose(context, parts),
            ExpressionKind::Call(call) => {
                let found = self.call(context, call)?;
                found.ok_or_else(|| self.refuse("it uses a call without a result"))
            }
        }
    }

    /// Values from left to right; what a later one changes is held before.
    pub(super) fn operands<'e>(
        &mut self,
        context: Context,
        operands: impl Iterator<Item = &'e Expression>,
    ) -> Found<Vec<Value>> {
        let mut values: Vec<Value> = Vec::new();
        for operand in operands {
            let before = self.steps.len();
            let value = self.value(context, operand)?;
            if self.steps.len() > before {
                let changed = written(&self.steps[before..]);
                for earlier in &mut values {
                    if earlier.mentions(&changed) {
                        *earlier = self.held_at(before, earlier.clone())?;
                    }
                }
            }
            values.push(value);
        }
        Ok(values)
    }

    /// The value in a cell of its own, written before the step of that number.
    fn held_at(&mut self, before: usize, value: Value) -> Found<Value> {
        let later = self.steps.split_off(before);
        let held = match value {
            Value::Truth(truth) => Value::Truth(self.hold_truth_always(truth)?),
            Value::Number(number) => Value::Number(self.hold_number_always(number)?),
            other => other,
        };
        self.steps.extend(later);
        Ok(held)
    }

    /// Arguments of a call of a routine whose frame holds these cells: none of them changes when the frame is begun.
    pub(super) fn held_off(&mut self, values: &mut [Value], cells: &HashSet<usize>) -> Found<()> {
        for value in values {
            if value.mentions(cells) {
                *value = self.held_at(self.steps.len(), value.clone())?;
            }
        }
        Ok(())
    }

    fn choose(&mut self, context: Context, parts: &[Expression; 3]) -> Found<Value> {
        let [condition, then, otherwise] = parts;
        let condition = self.value(context, condition)?;
        if let Some(known) = condition.known() {
            let taken = if known == 1 { then } else { otherwise };
            return self.value(context, taken);
        }
        let condition = self.truth_of(condition)?;
        let mut sides = Vec::new();
        for side in [then, otherwise] {
            sides.push(self.arm(|own| own.value(context, side))?);
        }
        let [then, otherwise]: [_; 2] = sides.try_into().map_err(|_| self.refuse("it chooses"))?;
        let of = parts[1].of.elementary();
        if then.steps.is_empty() && otherwise.steps.is_empty() {
            self.merge(&[then.known, otherwise.known]);
            return self.chosen(condition, then.result, otherwise.result, of);
        }
        // What is not evaluated has no effect.
        let kind = of.and_then(kind_of);
        let Some(kind) = kind else {
            return Err(self.refuse("it chooses between values that a ladder does not have"));
        };
        let cell = self.fresh("chosen", kind, Role::Memory)?;
        let mut bodies = Vec::new();
        let mut known = Vec::new();
        for arm in [then, otherwise] {
            let around = std::mem::replace(&mut self.steps, arm.steps);
            match kind {
                Kind::Truth => {
                    let truth = self.truth_of(arm.result)?;
                    self.push(Action::SetTruth(cell, truth))?;
                }
                Kind::Number { .. } => {
                    let number = self.number_of(arm.result)?;
                    self.push(Action::SetNumber(cell, number))?;
                }
            }
            bodies.push(std::mem::replace(&mut self.steps, around));
            known.push(arm.known);
        }
        self.merge(&known);
        let otherwise = bodies.pop().unwrap_or_default();
        let then = bodies.pop().unwrap_or_default();
        self.push(Action::If(vec![(condition, then)], otherwise))?;
        Ok(match kind {
            Kind::Truth => Value::Truth(Truth::Cell(cell)),
            Kind::Number { .. } => Value::Number(Number::Cell(cell)),
        })
    }

    pub(super) fn chosen(
        &mut self,
        condition: Truth,
        then: Value,
        otherwise: Value,
        of: Option<Elementary>,
    ) -> Found<Value> {
        if let (Value::Unknown(what), _) | (_, Value::Unknown(what)) = (&then, &otherwise) {
            return Ok(Value::Unknown(what.clone()));
        }
        match of.and_then(kind_of) {
            Some(Kind::Truth) => {
                let (then, otherwise) = (self.truth_of(then)?, self.truth_of(otherwise)?);
                Ok(Value::Truth(match (then, otherwise) {
                    (then, Truth::Constant(false)) => Truth::All(vec![condition, then]),
                    (Truth::Constant(true), otherwise) => Truth::Any(vec![condition, otherwise]),
                    (then, otherwise) => {
                        let condition = self.hold_truth(condition)?;
                        let not = Truth::Not(Box::new(condition.clone()));
                        let then = Truth::All(vec![condition, then]);
                        Truth::Any(vec![then, Truth::All(vec![not, otherwise])])
                    }
                }))
            }
            Some(Kind::Number { .. }) => {
                let (then, otherwise) = (self.number_of(then)?, self.number_of(otherwise)?);
                let (then, otherwise) = (Box::new(then), Box::new(otherwise));
                Ok(Value::Number(Number::Choice(Box::new(condition), then, otherwise)))
            }
            None => Ok(Value::Unknown("it chooses between times".into())),
        }
    }

    pub(super) fn truth_of(&mut self, value: Value) -> Found<Truth> {
        match value {
            Value::Known(_, value) => Ok(Truth::Constant(value & 1 == 1)),
            Value::Truth(truth) => Ok(truth),
            Value::Unknown(what) => Err(self.refuse(what)),
            Value::Number(_) | Value::Count(_) => Err(self.refuse("it uses a number as a BOOL")),
        }
    }

    pub(super) fn number_of(&mut self, value: Value) -> Found<Number> {
        match value {
            Value::Known(of, value) => match i64::try_from(of.signed(value)) {
                Ok(value) => Ok(Number::Constant(value)),
                Err(_) => Err(self.refuse("it uses a number of more than 63 bits")),
            },
            Value::Number(number) => Ok(number),
            Value::Count(block) => {
                // Next time the counter's statements are executed, and its count is a number like others.
                self.expand(block);
                Ok(Number::Constant(0))
            }
            Value::Unknown(what) => Err(self.refuse(what)),
            Value::Truth(_) => Err(self.refuse("it uses a BOOL as a number")),
        }
    }

    fn hold_truth(&mut self, truth: Truth) -> Found<Truth> {
        match truth {
            Truth::Cell(_) | Truth::Constant(_) => Ok(truth),
            _ => self.hold_truth_always(truth),
        }
    }

    fn hold_truth_always(&mut self, truth: Truth) -> Found<Truth> {
        let cell = self.fresh("chosen", Kind::Truth, Role::Memory)?;
        self.push(Action::SetTruth(cell, truth))?;
        Ok(Truth::Cell(cell))
    }

    pub(super) fn hold_number(&mut self, number: Number) -> Found<Number> {
        match number {
            Number::Cell(_) | Number::Constant(_) => Ok(number),
            _ => self.hold_number_always(number),
        }
    }

    fn hold_number_always(&mut self, number: Number) -> Found<Number> {
        let wide = (i64::MIN >> 1, i64::MAX >> 1);
        let kind = Kind::Number { declared: wide, wide };
        let cell = self.fresh("value", kind, Role::Memory)?;
        self.push(Action::SetNumber(cell, number))?;
        Ok(Number::Cell(cell))
    }
}
