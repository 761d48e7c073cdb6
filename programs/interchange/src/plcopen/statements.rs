//! A plan as statements of Structured Text, for what rungs have no shape for: numbers, units of the file, EN.
//!
//! Each piece of the text remembers the place in the file that it came from, so that what is wrong with it is shown there.

mod text;

use std::collections::{HashMap, HashSet};
use std::ops::Range;

use understudy_ladder::Name;

pub(crate) use self::text::Text;
use super::document::{Edge, Modifier, Storage};
use super::literal::{boolean, integer, time};
use super::plan::{Action, Call, Input, Plan, Step};
use super::power::{Power, Read};

/// Operators of functions that have one.
pub(super) const OPERATORS: [(&str, &str); 14] = [
    ("AND", "AND"),
    ("OR", "OR"),
    ("XOR", "XOR"),
    ("ADD", "+"),
    ("SUB", "-"),
    ("MUL", "*"),
    ("DIV", "/"),
    ("MOD", "MOD"),
    ("EQ", "="),
    ("NE", "<>"),
    ("LT", "<"),
    ("LE", "<="),
    ("GT", ">"),
    ("GE", ">="),
];

/// Writes the statements of one unit.
pub(crate) struct Statements<'a> {
    pub(crate) text: Text,
    /// Variables that the statements need, with their types.
    pub(crate) declared: Vec<(String, String)>,
    /// In capitals.
    taken: HashSet<String>,
    /// Of a variable of the unit, or of an output of an instance.
    type_of: &'a dyn Fn(&str) -> Option<String>,
    kept: HashMap<usize, (String, String)>,
    /// The triggers of edges.
    triggers: HashMap<usize, String>,
    /// Steps of a sequence, as they are called here.
    pub(crate) renamed: HashMap<String, String>,
}

impl<'a> Statements<'a> {
    pub(crate) fn new(
        taken: impl Iterator<Item = String>,
        type_of: &'a dyn Fn(&str) -> Option<String>,
    ) -> Self {
        Self {
            text: Text::default(),
            declared: Vec::new(),
            taken: taken.map(|name| name.to_uppercase()).collect(),
            type_of,
            kept: HashMap::new(),
            triggers: HashMap::new(),
            renamed: HashMap::new(),
        }
    }

    pub(crate) fn plan(&mut self, plan: &Plan) {
        // Objects are numbered by graph, and a unit may have several.
        self.kept.clear();
        self.triggers.clear();
        // Jumps on their way, with the bits that say whether they are done.
        let mut jumps: Vec<(Option<String>, String)> = Vec::new();
        for step in &plan.steps {
            for line in &step.comments {
                // The end of a comment in it would end it.
                let line = line.replace("*)", "* )").replace("(*", "( *");
                self.push(&format!("(* {line} *)\n"), &step.span);
            }
            match &step.action {
                // More are an error that is said where they are planned.
                Action::Jump { .. } if jumps.len() >= super::plan::MAXIMUM_JUMPS => {}
                Action::Jump { label, power } => {
                    let done = self.jump(&jumps, power, &step.span);
                    let label = label.as_ref().map(|label| label.to_uppercase());
                    jumps.push((label, done));
                }
                Action::Label(name) => {
                    jumps.retain(|(label, _)| label.as_deref() != Some(&name.to_uppercase()));
                }
                _ => self.unless(&jumps, &step.span, |own| own.step(step)),
            }
        }
    }

    /// Only where none of the jumps is done.
    pub(super) fn unless(
        &mut self,
        jumps: &[(Option<String>, String)],
        span: &Range<usize>,
        inner: impl FnOnce(&mut Self),
    ) {
        if jumps.is_empty() {
            inner(self);
            return;
        }
        let done: Vec<&str> = jumps.iter().map(|(_, done)| done.as_str()).collect();
        self.push(&format!("IF NOT ({}) THEN\n", done.join(" OR ")), span);
        inner(self);
        self.push("END_IF;\n", span);
    }

    /// The bit that says whether the jump is done.
    fn jump(
        &mut self,
        jumps: &[(Option<String>, String)],
        power: &Power,
        span: &Range<usize>,
    ) -> String {
        let done = self.declare("jumped", "BOOL");
        self.push(&format!("{done} := FALSE;\n"), span);
        self.unless(jumps, span, |own| {
            own.prepare(power, span);
            own.assign(&done, power, span);
        });
        done
    }

    fn step(&mut self, step: &Step) {
        match &step.action {
            Action::Jump { .. } | Action::Label(_) => {}
            Action::Write {
                targets,
                power,
                guard,
            } => {
                self.write(targets, power, guard.as_ref(), &step.span);
            }
            Action::Keep {
                object,
                power,
                guard,
            } => {
                self.prepare(power, &step.span);
                let kind = self.kind(power);
                let name = self.declare("power", &kind);
                self.kept.insert(*object, (name.clone(), kind));
                self.guarded(guard.as_ref(), &step.span, |own| {
                    own.assign(&name, power, &step.span)
                });
            }
            Action::Call(call) => self.call(call, &step.span),
        }
    }

    /// A new variable.
    pub(crate) fn declare(&mut self, wanted: &str, kind: &str) -> String {
        let mut count = self.declared.len() + 1;
        let mut name = format!("{wanted}_{count}");
        while !self.taken.insert(name.to_uppercase()) {
            count += 1;
            name = format!("{wanted}_{count}");
        }
        self.declared.push((name.clone(), kind.to_owned()));
        name
    }

    /// A variable of exactly that name, once.
    pub(crate) fn declare_as(&mut self, name: &str, kind: &str) {
        if self.taken.insert(name.to_uppercase()) {
            self.declared.push((name.to_owned(), kind.to_owned()));
        }
    }

    pub(crate) fn push(&mut self, text: &str, span: &Range<usize>) {
        self.text.push(text, span.clone());
    }

    fn guarded(
        &mut self,
        guard: Option<&Power>,
        span: &Range<usize>,
        inner: impl FnOnce(&mut Self),
    ) {
        let Some(guard) = guard else {
            inner(self);
            return;
        };
        self.prepare(guard, span);
        self.push("IF ", span);
        self.value(guard, span);
        self.push(" THEN\n", span);
        inner(self);
        self.push("END_IF;\n", span);
    }

    fn assign(&mut self, target: &str, power: &Power, span: &Range<usize>) {
        self.push(target, span);
        self.push(" := ", span);
        self.value(power, span);
        self.push(";\n", span);
    }

    fn write(
        &mut self,
        targets: &[(Name, Modifier)],
        power: &Power,
        guard: Option<&Power>,
        span: &Range<usize>,
    ) {
        self.prepare(power, span);
        let shared;
        let power = if targets.len() > 1 && power.measure().0 > 1 {
            let name = self.declare("power", "BOOL");
            self.assign(&name, power, span);
            shared = read(&name, span);
            &shared
        } else {
            power
        };
        for (target, modifier) in targets {
            let value = self.changed(power, modifier.negated, modifier.edge, span);
            self.guarded(guard, span, |own| match modifier.storage {
                None => {
                    own.name(target);
                    own.push(" := ", span);
                    own.value(&value, span);
                    own.push(";\n", span);
                }
                Some(storage) => {
                    own.push("IF ", span);
                    own.value(&value, span);
                    own.push(" THEN ", span);
                    own.name(target);
                    let literal = if storage == Storage::Set {
                        "TRUE"
                    } else {
                        "FALSE"
                    };
                    own.push(&format!(" := {literal}; END_IF;\n"), span);
                }
            });
        }
    }

    /// The power behind the sign of a coil or pin; an edge is that of a trigger of its own.
    fn changed(
        &mut self,
        power: &Power,
        negated: bool,
        edge: Option<Edge>,
        span: &Range<usize>,
    ) -> Power {
        let power = if negated {
            power.clone().not()
        } else {
            power.clone()
        };
        let Some(edge) = edge else {
            return power;
        };
        let trigger = self.trigger(edge);
        self.push(&format!("{trigger}(CLK := "), span);
        self.value(&power, span);
        self.push(");\n", span);
        Power::Output(trigger.into(), "Q".into())
    }

    fn trigger(&mut self, edge: Edge) -> String {
        let kind = match edge {
            Edge::Rising => "R_TRIG",
            Edge::Falling => "F_TRIG",
        };
        self.declare("edge", kind)
    }

    /// Calls the triggers of the edges that a power reads for the first time.
    fn prepare(&mut self, power: &Power, span: &Range<usize>) {
        let mut edges: Vec<(usize, Edge, Name)> = Vec::new();
        power.visit(&mut |part| {
            if let Power::Read(Read {
                text,
                edge: Some(edge),
                object,
            }) = part
            {
                edges.push((*object, *edge, text.clone()));
            }
        });
        for (object, edge, text) in edges {
            if self.triggers.contains_key(&object) {
                continue;
            }
            let trigger = self.trigger(edge);
            self.push(&format!("{trigger}(CLK := "), span);
            self.name(&text);
            self.push(");\n", span);
            self.triggers.insert(object, trigger);
        }
    }

    fn call(&mut self, call: &Call, span: &Range<usize>) {
        for input in &call.inputs {
            self.prepare(&input.power, span);
        }
        let inputs: Vec<(&Input, Power)> = call
            .inputs
            .iter()
            .map(|input| {
                let power = self.changed(
                    &input.power,
                    input.modifier.negated,
                    input.modifier.edge,
                    span,
                );
                (input, power)
            })
            .collect();
        self.guarded(call.enable.as_ref(), span, |own| {
            own.push(&call.instance, &call.instance.span());
            own.push("(", span);
            for (number, (input, power)) in inputs.iter().enumerate() {
                if number > 0 {
                    own.push(", ", span);
                }
                let pin = super::standard::StandardBlock::of(&call.type_name)
                    .and_then(|block| block.input(&input.pin))
                    .unwrap_or(&input.pin);
                own.push(pin, &input.pin.span());
                own.push(" := ", span);
                own.value(power, span);
            }
            own.push(");\n", span);
        });
    }

    /// A variable as it is called here.
    pub(crate) fn name(&mut self, name: &Name) {
        match self.renamed.get(&name.to_uppercase()).cloned() {
            Some(renamed) => self.push(&renamed, &name.span()),
            None => self.text.copy(name, name.span()),
        }
    }

    pub(crate) fn value(&mut self, power: &Power, span: &Range<usize>) {
        match power {
            Power::Constant(value) => self.push(if *value { "TRUE" } else { "FALSE" }, span),
            Power::Read(read) if read.edge.is_some() => {
                let trigger = self.triggers.get(&read.object).cloned().unwrap_or_default();
                self.push(&format!("{trigger}.Q"), &read.text.span());
            }
            Power::Read(read) => {
                let is_plain = read
                    .text
                    .chars()
                    .all(|letter| letter.is_alphanumeric() || "_.%#".contains(letter));
                if is_plain {
                    self.name(&read.text);
                } else {
                    self.push("(", span);
                    self.name(&read.text);
                    self.push(")", span);
                }
            }
            Power::Not(inner) => {
                self.push("NOT (", span);
                self.value(inner, span);
                self.push(")", span);
            }
            Power::All(parts) => self.joined(parts.iter(), "AND", span),
            Power::Any(parts) => self.joined(parts.iter(), "OR", span),
            Power::Output(instance, pin) => {
                self.push(instance, &instance.span());
                self.push(&format!(".{pin}"), &pin.span());
            }
            Power::Kept(object) => {
                let name = self
                    .kept
                    .get(object)
                    .map(|(name, _)| name.clone())
                    .unwrap_or_default();
                self.push(&name, span);
            }
            Power::Function(name, inputs) => self.function(name, inputs, span),
        }
    }

    fn joined<'p>(
        &mut self,
        parts: impl Iterator<Item = &'p Power>,
        operator: &str,
        span: &Range<usize>,
    ) {
        self.push("(", span);
        for (number, part) in parts.enumerate() {
            if number > 0 {
                self.push(&format!(" {operator} "), span);
            }
            self.value(part, span);
        }
        self.push(")", span);
    }

    fn function(&mut self, name: &Name, inputs: &[(Name, Power)], span: &Range<usize>) {
        let operator = OPERATORS
            .iter()
            .find(|(word, _)| word.eq_ignore_ascii_case(name));
        if let Some((_, operator)) = operator.filter(|_| inputs.len() > 1) {
            self.joined(
                inputs.iter().map(|(_, input)| input),
                operator,
                &name.span(),
            );
            return;
        }
        if name.eq_ignore_ascii_case("NOT") {
            self.push("NOT ", &name.span());
            self.joined(inputs.iter().map(|(_, input)| input), ",", span);
            return;
        }
        self.push(name, &name.span());
        self.push("(", span);
        for (number, (pin, input)) in inputs.iter().enumerate() {
            if number > 0 {
                self.push(", ", span);
            }
            // IN, IN1, IN2, … of the standard functions are known by their place.
            let digits = pin.trim_start_matches(|letter: char| {
                letter.eq_ignore_ascii_case(&'i') || letter.eq_ignore_ascii_case(&'n')
            });
            if !digits.bytes().all(|digit| digit.is_ascii_digit()) {
                self.push(&format!("{pin} := "), &pin.span());
            }
            self.value(input, span);
        }
        self.push(")", span);
    }

    /// The type of a variable, of a literal, or of what a function answers.
    pub(super) fn kind_of(&self, text: &str) -> String {
        self.kind(&read(text, &(0..0)))
    }

    /// The type of a value, as far as it is needed to keep it.
    fn kind(&self, power: &Power) -> String {
        let kind = match power {
            Power::Read(read) => {
                if boolean(&read.text).is_some() {
                    Some("BOOL".to_owned())
                } else if integer(&read.text).is_some() {
                    Some("DINT".to_owned())
                } else if time(&read.text).is_some() {
                    Some("TIME".to_owned())
                } else {
                    (self.type_of)(&read.text)
                }
            }
            Power::Output(instance, pin) => (self.type_of)(&format!("{instance}.{pin}")),
            Power::Kept(object) => self.kept.get(object).map(|(_, kind)| kind.clone()),
            Power::Function(name, inputs) => match name.to_ascii_uppercase().as_str() {
                "ADD" | "SUB" | "MUL" | "DIV" | "MOD" | "SEL" | "MAX" | "MIN" | "LIMIT" | "MUX"
                | "ABS" => {
                    let variable = inputs.iter().rev().find(|(_, input)| {
                        !matches!(input, Power::Read(read) if integer(&read.text).is_some())
                    });
                    variable
                        .or(inputs.last())
                        .map(|(_, input)| self.kind(input))
                }
                _ => (self.type_of)(name),
            },
            _ => None,
        };
        kind.unwrap_or_else(|| "BOOL".to_owned())
    }
}

fn read(name: &str, span: &Range<usize>) -> Power {
    Power::Read(Read {
        text: Name::at(name, span.clone()),
        edge: None,
        object: usize::MAX,
    })
}
