//! Calls of blocks and functions.

use std::ops::Range;

use understudy_ladder::BlockKind;
use understudy_text::Diagnostic;

use super::super::program::{Action, Truth};
use super::super::syntax::{Argument, Class, Expression, Path};
use super::expression::Value;
use super::types::inputs;
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
                let message = format!("`{}` is not a block and cannot be called", path.text());
                self.error("U1041", message, path.span.clone());
            }
        }
    }

    pub(super) fn execute_called(&mut self, called: usize, span: &Range<usize>) {
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
    pub(super) fn give(
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
        self.instances[called].called = true;
        let path = self.instances[called].path.clone();
        let names: Vec<String> = inputs(word).iter().map(|name| (*name).to_owned()).collect();
        let given = self.given(&names, arguments);
        if let Some(timer) = self.instances[called].timer {
            self.call_timer(instance, called, timer, &given, span);
            return;
        }
        let mut time = None;
        let mut preset = None;
        let mut values = Vec::new();
        for &pin in inputs(word) {
            let found = given
                .iter()
                .find(|(name, _)| name == pin)
                .map(|(_, value)| *value);
            match (pin, found) {
                // What is never started needs no time.
                ("PT", None) if matches!(values.first(), Some((_, Truth::Constant(false)))) => {}
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

    /// A timer that not every execution calls once.
    fn call_timer(
        &mut self,
        instance: usize,
        called: usize,
        timer: usize,
        given: &[(String, &Expression)],
        span: &Range<usize>,
    ) {
        let value = |pin| given.iter().find(|(name, _)| name == pin);
        let word = self.program.timers[timer].word;
        let preset =
            value("PT").and_then(|(_, found)| self.preset_time(instance, Some(*found), word, span));
        let wire = match value("IN") {
            Some((_, found)) => {
                let wire = self.truth(instance, found);
                match self.through(called, "IN", wire.clone(), span) {
                    // That it is stopped is worth knowing.
                    _ if matches!(wire, Truth::Constant(_)) => wire,
                    kept => kept,
                }
            }
            None => match self.entity(called, "IN") {
                Some(Entity::Cell(cell)) => Truth::Cell(*cell),
                _ => Truth::Constant(false),
            },
        };
        let action = Action::Timer {
            timer,
            wire,
            preset,
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
}
