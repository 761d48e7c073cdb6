//! What each object does once everything that feeds it is there.

use understudy_ladder::Name;
use understudy_text::Diagnostic;

use super::Walk;
use crate::plcopen::document::{CONDITION, Edge, Kind, Modifier, Object, Pin};
use crate::plcopen::plan::links::{Source, is_eno};
use crate::plcopen::plan::{Action, Call, Input, Step};
use crate::plcopen::power::{Power, Read};
use crate::plcopen::structure::wired;

/// Power that is used more than once and has more readings is kept.
const MAXIMUM_SHARED: usize = 40;

/// Power with more readings, or deeper, is kept in any case.
const MAXIMUM_SIZE: usize = 400;
const MAXIMUM_DEPTH: usize = 24;

impl Walk<'_> {
    pub(super) fn finish(&mut self, place: usize, diagnostics: &mut Vec<Diagnostic>) {
        let object = self.object(place);
        match &object.kind {
            Kind::Contact(variable, modifier) => {
                self.named(variable, object, diagnostics);
                if object.inputs.iter().all(|pin| pin.wires.is_empty()) {
                    unconnected(object, "the contact", diagnostics);
                }
                let own = read(variable, *modifier, place);
                let power = self.power(place, 0).and(own);
                self.pass(place, power);
            }
            Kind::InVariable(expression, modifier) => {
                self.named(expression, object, diagnostics);
                let power = read(expression, *modifier, place);
                self.pass(place, power);
            }
            Kind::Coil(variable, modifier) => {
                self.named(variable, object, diagnostics);
                if object.inputs.iter().all(|pin| pin.wires.is_empty()) {
                    unconnected(object, "the coil", diagnostics);
                    return;
                }
                self.coil(place, variable, *modifier);
            }
            Kind::OutVariable(variable, modifier) => {
                self.named(variable, object, diagnostics);
                self.written(place, variable, *modifier, diagnostics);
            }
            Kind::InOutVariable(variable, to, from) => {
                self.named(variable, object, diagnostics);
                if object.inputs.iter().any(|pin| !pin.wires.is_empty()) {
                    self.written(place, variable, *to, diagnostics);
                }
                let power = read(variable, *from, place);
                self.pass(place, power);
            }
            Kind::Transition(_) => {
                let input = object.inputs.iter().position(|pin| pin.name.as_str() == CONDITION);
                let power = self.power(place, input.unwrap_or(0));
                let target = Name::at(wired(object), object.span.clone());
                let targets = vec![(target, Modifier::default())];
                self.step(place, Action::Write { targets, power, guard: None });
            }
            Kind::Jump(label) => self.jump(place, Some(label.clone()), diagnostics),
            Kind::Return => self.jump(place, None, diagnostics),
            Kind::Label(name) => self.step(place, Action::Label(name.clone())),
            Kind::Block(_) if self.links.is_block[place] => self.call(place),
            Kind::Block(_) => self.function(place),
            _ => {}
        }
    }

    fn named(&self, variable: &Name, object: &Object, diagnostics: &mut Vec<Diagnostic>) {
        if variable.is_empty() {
            let message = format!("object {} names no variable", object.id);
            diagnostics.push(Diagnostic::error("U1002", message, object.span.clone()));
        }
    }

    /// Remembers what an object lets through, or keeps it in a step of its own.
    fn pass(&mut self, place: usize, power: Power) {
        let (size, depth) = power.measure();
        let shared = self.links.fan_out[place] > 1 && size > MAXIMUM_SHARED;
        let large = size > MAXIMUM_SIZE || depth > MAXIMUM_DEPTH;
        let guard = self.guard(place);
        if guard.is_none() && !shared && !large && !self.keep.contains(&place) {
            self.powers[place] = Some(power);
            return;
        }
        self.powers[place] = Some(Power::Kept(place));
        self.step(place, Action::Keep { object: place, power, edge: None, guard });
    }

    /// The power without which a function does not act.
    fn guard(&self, place: usize) -> Option<Power> {
        self.enables.get(&place).filter(|_| !self.links.is_block[place]).cloned()
    }

    /// Keeps what is at an input of an object.
    fn keep_input(
        &mut self,
        place: usize,
        number: usize,
        power: Power,
        edge: Option<Edge>,
    ) -> Power {
        self.last_coils = None;
        self.plan.steps.push(Step {
            comments: Vec::new(),
            span: self.object(place).span.clone(),
            action: Action::Keep { object: number, power, edge, guard: None },
        });
        Power::Kept(number)
    }

    fn step(&mut self, place: usize, action: Action) {
        self.last_coils = None;
        self.trace.step[place] = Some(self.plan.steps.len());
        self.plan.steps.push(Step {
            comments: Vec::new(),
            span: self.object(place).span.clone(),
            action,
        });
    }

    /// Coils that follow each other on the same wires are one step.
    fn coil(&mut self, place: usize, variable: &Name, modifier: Modifier) {
        let sources = self.links.sources[place].first().cloned().unwrap_or_default();
        if self.last_coils.as_ref() == Some(&sources)
            && let Some(step) = self.plan.steps.last_mut()
            && let Action::Write { targets, .. } = &mut step.action
        {
            targets.push((variable.clone(), modifier));
            self.trace.step[place] = Some(self.plan.steps.len() - 1);
            return;
        }
        let power = self.power(place, 0);
        let targets = vec![(variable.clone(), modifier)];
        self.step(place, Action::Write { targets, power, guard: None });
        self.last_coils = Some(sources);
    }

    fn written(
        &mut self,
        place: usize,
        variable: &Name,
        modifier: Modifier,
        diagnostics: &mut Vec<Diagnostic>,
    ) {
        let object = self.object(place);
        if object.inputs.iter().all(|pin| pin.wires.is_empty()) {
            unconnected(object, "the variable", diagnostics);
            return;
        }
        let sources = self.links.sources[place].first().cloned().unwrap_or_default();
        let guard = match sources.as_slice() {
            // ENO is known also while the function does not act.
            [Source::Output(from, pin)] if !is_eno(pin.as_ref()) => self.guard(*from),
            _ => None,
        };
        let power = self.power(place, 0);
        let targets = vec![(variable.clone(), modifier)];
        self.step(place, Action::Write { targets, power, guard });
    }

    fn jump(&mut self, place: usize, label: Option<Name>, diagnostics: &mut Vec<Diagnostic>) {
        let object = self.object(place);
        if object.inputs.iter().all(|pin| pin.wires.is_empty()) {
            unconnected(object, "the jump", diagnostics);
            return;
        }
        let power = self.power(place, 0);
        self.step(place, Action::Jump { label, power });
    }

    /// What is connected to the inputs but EN, with their numbers.
    fn inputs(&self, place: usize) -> Vec<(usize, Input)> {
        let object = self.object(place);
        let connected = |pin: &Pin| !pin.wires.is_empty() && !pin.name.eq_ignore_ascii_case("EN");
        let pins = object.inputs.iter().enumerate();
        pins.filter(|(_, pin)| connected(pin))
            .map(|(input, pin)| {
                let power = self.power(place, input);
                let number = self.links.pin(place, input);
                (number, Input { pin: pin.name.clone(), modifier: pin.modifier, power })
            })
            .collect()
    }

    /// The power at EN, where it is connected.
    fn enable(&mut self, place: usize) -> Option<Power> {
        let input = self.enable_input(place)?;
        let modifier = self.object(place).inputs[input].modifier;
        let power = self.power(place, input);
        let mut power = if modifier.negated { power.not() } else { power };
        let number = self.links.enable(place);
        if modifier.edge.is_some() || self.keep.contains(&number) {
            power = self.keep_input(place, number, power, modifier.edge);
        }
        if power == Power::Constant(true) {
            return None;
        }
        self.enables.insert(place, power.clone());
        Some(power)
    }

    fn call(&mut self, place: usize) {
        let object = self.object(place);
        let Kind::Block(block) = &object.kind else {
            return;
        };
        let enable = self.enable(place);
        let call = Call {
            type_name: block.type_name.clone(),
            instance: self.instance(object),
            is_named: block.instance.is_some(),
            inputs: self.inputs(place).into_iter().map(|(_, input)| input).collect(),
            enable,
        };
        self.step(place, Action::Call(call));
    }

    fn function(&mut self, place: usize) {
        let object = self.object(place);
        let Kind::Block(block) = &object.kind else {
            return;
        };
        self.enable(place);
        let mut inputs: Vec<(Name, Power)> = Vec::new();
        for (number, input) in self.inputs(place) {
            let power = if input.modifier.negated { input.power.not() } else { input.power };
            let power = match input.modifier.edge {
                None => power,
                edge => self.keep_input(place, number, power, edge),
            };
            inputs.push((input.pin, power));
        }
        self.pass(place, function(&block.type_name, inputs));
    }
}

/// The Boolean functions are power itself; `EQ` and the like stay functions.
fn function(name: &Name, inputs: Vec<(Name, Power)>) -> Power {
    let values = || inputs.iter().map(|(_, power)| power.clone());
    match name.to_ascii_uppercase().as_str() {
        "AND" => values().fold(Power::Constant(true), Power::and),
        "OR" => Power::any(values().collect()),
        "NOT" if inputs.len() == 1 => values().fold(Power::Constant(true), Power::and).not(),
        "MOVE" if inputs.len() == 1 => values().fold(Power::Constant(true), Power::and),
        _ => Power::Function(name.clone(), inputs),
    }
}

pub(super) fn read(text: &Name, modifier: Modifier, object: usize) -> Power {
    let read = Power::Read(Read { text: text.clone(), edge: modifier.edge, object });
    if modifier.negated { read.not() } else { read }
}

fn unconnected(object: &Object, what: &str, diagnostics: &mut Vec<Diagnostic>) {
    let message = format!("nothing is connected to {what}, object {}", object.id);
    diagnostics.push(Diagnostic::error("U1009", message, object.span.clone()));
}
