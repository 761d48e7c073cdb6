//! Calls of blocks and functions.

use std::ops::Range;

use understudy_diagnostic::Diagnostic;
use understudy_ladder::{BlockKind, Name, Relation};

use super::super::program::{Action, Cell, Kind, Number, Role, Truth};
use super::super::syntax::{Argument, Class, Expression, Path, UnitKind};
use super::declare::{inputs, is_timer, whole_range};
use super::expression::Value;
use super::{Entity, Resolver};

impl Resolver {
    pub(super) fn call(
        &mut self,
        instance: usize,
        path: &Path,
        arguments: &[Argument],
        span: Range<usize>,
    ) {
        match self.look_up(instance, path) {
            Some(Entity::Instance(called)) => {
                match self.instances[called].native {
                    Some(word) => self.call_standard(instance, called, word, arguments, &span),
                    None => {
                        self.give(instance, called, arguments, &span);
                        self.execute_called(called, &span);
                    }
                }
                self.take(instance, called, arguments);
            }
            Some(Entity::Broken) | None => {}
            Some(_) => {
                let message = format!("`{}` is no block, and cannot be called", path.text());
                self.error("U1041", message, path.span.clone());
            }
        }
    }

    fn execute_called(&mut self, called: usize, span: &Range<usize>) {
        let unit = self.instances[called].unit;
        if self.stack.contains(&unit) {
            self.error(
                "U1047",
                format!("`{}` calls itself", self.units[unit].name),
                span.clone(),
            );
            return;
        }
        if !self.count_step(span) {
            return;
        }
        self.stack.push(unit);
        let blame = self.blame.clone();
        if self.units[unit].foreign && self.blame.is_none() {
            self.blame = Some(span.clone());
        }
        self.execute(called);
        self.blame = blame;
        self.stack.pop();
        self.instances[called].called = true;
    }

    /// The inputs that the arguments give, by place or by name.
    fn given<'a>(
        &mut self,
        names: &[String],
        arguments: &'a [Argument],
    ) -> Vec<(String, &'a Expression)> {
        let mut given: Vec<(String, &Expression)> = Vec::new();
        let mut place = 0;
        for argument in arguments {
            let (name, value, span) = match argument {
                Argument::Taken(..) => continue,
                Argument::Given(name, value) => (name.to_ascii_uppercase(), value, name.span()),
                Argument::Placed(value) => {
                    place += 1;
                    match names.get(place - 1) {
                        Some(name) => (name.clone(), value, value.span.clone()),
                        None => {
                            self.error(
                                "U1049",
                                "there are more values than inputs",
                                value.span.clone(),
                            );
                            continue;
                        }
                    }
                }
            };
            if !names.contains(&name) {
                let message = format!("the block has no input `{name}`");
                let finding = Diagnostic::error("U1049", message, span);
                self.say(finding.with_help(format!("its inputs are {}", names.join(", "))));
            } else if given.iter().any(|(known, _)| *known == name) {
                self.error("U1049", format!("the input `{name}` is given twice"), span);
            } else {
                given.push((name, value));
            }
        }
        given
    }

    /// Values into the inputs of a block or a function whose text is executed.
    fn give(
        &mut self,
        instance: usize,
        called: usize,
        arguments: &[Argument],
        span: &Range<usize>,
    ) {
        let unit = &self.units[self.instances[called].unit];
        let of_class = unit
            .declarations
            .iter()
            .filter(|declaration| declaration.class == Class::Input);
        let names: Vec<String> = of_class
            .map(|declaration| declaration.name.to_ascii_uppercase())
            .collect();
        for (name, value) in self.given(&names, arguments) {
            let Some(entity) = self.entity(called, &name).cloned() else {
                continue;
            };
            let found = self.expression(instance, value);
            if let (Entity::Time(_), Value::Time(time)) = (&entity, &found) {
                self.give_time(called, &name, *time, &value.span);
                continue;
            }
            self.store(
                &entity,
                &name,
                &value.span,
                found,
                value.span.clone(),
                span.clone(),
            );
        }
    }

    /// A time that a call gives is known from then on; two calls have to agree.
    fn give_time(
        &mut self,
        called: usize,
        name: &str,
        time: Option<std::time::Duration>,
        span: &Range<usize>,
    ) {
        let known = match self.entity(called, name) {
            Some(Entity::Time(known)) if self.instances[called].called => *known,
            _ => time,
        };
        if time.is_none() || known != time {
            let message = format!("the time `{name}` is not the same in every execution");
            self.error("U1045", message, span.clone());
        }
        let entities = &mut self.instances[called].entities;
        entities.insert(name.to_ascii_uppercase(), Entity::Time(time));
    }

    /// Outputs into the variables that the arguments name.
    fn take(&mut self, instance: usize, called: usize, arguments: &[Argument]) {
        for argument in arguments {
            let Argument::Taken(name, target) = argument else {
                continue;
            };
            let Some(entity) = self.look_up(
                called,
                &Path {
                    parts: vec![name.clone()],
                    span: name.span(),
                },
            ) else {
                continue;
            };
            let value = match entity {
                Entity::Cell(cell) => self.value_of(cell),
                _ => {
                    self.error(
                        "U1040",
                        format!("`{name}` cannot be taken out of the block"),
                        name.span(),
                    );
                    continue;
                }
            };
            if let Some(found) = self.look_up(instance, target) {
                let span = name.span().start..target.span.end;
                self.store(
                    &found,
                    &target.text(),
                    &target.span,
                    value,
                    name.span(),
                    span,
                );
            }
        }
    }

    /// A standard block in a rung.
    fn call_standard(
        &mut self,
        instance: usize,
        called: usize,
        word: &'static str,
        arguments: &[Argument],
        span: &Range<usize>,
    ) {
        let path = self.instances[called].path.clone();
        if is_timer(word)
            && (self.conditional > 0
                || self.instances[called].called
                || !self.instances[called].exclusive)
        {
            let message = format!("the {word} `{path}` is not called once in every execution");
            let finding = Diagnostic::error("U1050", message, span.clone());
            self.say(finding.with_help(
                "call it once, outside of IF, CASE and FOR, with the condition in its IN",
            ));
            return;
        }
        self.instances[called].called = true;
        let names: Vec<String> = inputs(word).iter().map(|name| (*name).to_owned()).collect();
        let given = self.given(&names, arguments);
        let mut time = None;
        let mut preset = None;
        let mut values = Vec::new();
        for &pin in inputs(word) {
            let found = given
                .iter()
                .find(|(name, _)| name == pin)
                .map(|(_, value)| *value);
            match (pin, found) {
                ("PT", found) => time = self.preset_time(instance, found, word, span),
                ("PV", Some(found)) => preset = self.constant(instance, found),
                ("PV", None) => {}
                (_, Some(found)) => {
                    let value = self.truth(instance, found);
                    values.push((pin, self.through(called, pin, value, span)));
                }
                (_, None) => {
                    let held = match self.entity(called, pin) {
                        Some(Entity::Cell(cell)) => Truth::Cell(*cell),
                        _ => Truth::Constant(false),
                    };
                    values.push((pin, held));
                }
            }
        }
        let time = time.unwrap_or_default();
        let preset = preset
            .and_then(|preset| u16::try_from(preset).ok())
            .unwrap_or_default();
        let kind = match word {
            "TON" => BlockKind::Ton(time),
            "TOF" => BlockKind::Tof(time),
            "TP" => BlockKind::Tp(time),
            "CTU" => BlockKind::Ctu(preset),
            "CTD" => BlockKind::Ctd(preset),
            "CTUD" => BlockKind::Ctud(preset),
            "SR" => BlockKind::Sr,
            "RS" => BlockKind::Rs,
            "R_TRIG" => BlockKind::RTrig,
            _ => BlockKind::FTrig,
        };
        let wire = values.remove(0).1;
        let action = Action::Block {
            name: path,
            kind,
            wire,
            feeds: values,
        };
        self.push(action, span.clone(), Vec::new());
    }

    /// An input that is also used by name is kept in its cell.
    fn through(&mut self, called: usize, pin: &str, value: Truth, span: &Range<usize>) -> Truth {
        match self.entity(called, pin).cloned() {
            Some(Entity::Cell(cell)) => {
                self.push(Action::SetTruth(cell, value), span.clone(), Vec::new());
                Truth::Cell(cell)
            }
            _ => value,
        }
    }

    fn preset_time(
        &mut self,
        instance: usize,
        found: Option<&Expression>,
        word: &str,
        span: &Range<usize>,
    ) -> Option<std::time::Duration> {
        let Some(found) = found else {
            let message = format!("the {word} is called without its time PT");
            self.error("U1049", message, span.clone());
            return None;
        };
        match self.expression(instance, found) {
            Value::Time(Some(time)) => Some(time),
            Value::Error => None,
            Value::Time(None) => {
                self.error("U1045", "this time is not known", found.span.clone());
                None
            }
            Value::Truth(_) | Value::Number(_) => {
                self.error(
                    "U1043",
                    "a time is expected, such as T#3s",
                    found.span.clone(),
                );
                None
            }
        }
    }

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
                let message = format!("the function `{name}` with these values is not taken");
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
        let cell = Cell {
            name: self.unique("chosen"),
            kind: Kind::Truth,
            role: Role::Memory,
            initial: 0,
            is_given: false,
            address: None,
            description: None,
        };
        let cell = self.add_cell(cell, span.clone());
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

    /// The one of two numbers that stands in `relation` to the other.
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
