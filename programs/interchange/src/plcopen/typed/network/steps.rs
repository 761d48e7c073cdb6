//! The steps of a plan: writes, calls, what is kept, jumps.

use std::collections::HashMap;
use std::ops::Range;

use understudy_ladder::{BlockKind, Name as Written};
use understudy_structured_text::syntax::{
    Argument, Class, Declaration, Expression, Name, Statement, StatementKind, TypeKind, TypeName,
    Unit, UnitKind,
};
use understudy_text::Diagnostic;

use super::{NEXT, Network, arguments};
use crate::plcopen::document::{Modifier, Storage};
use crate::plcopen::plan::{Action, Call, Plan, Step};
use crate::plcopen::power::Power;
use crate::plcopen::standard;
use crate::plcopen::typed::make;
use crate::plcopen::typed::values::unit;

/// How often the types of values that go round in a ring are made wider: as often as there are wider ones.
const MAXIMUM_WIDENINGS: usize = 16;

impl Network<'_> {
    /// The parts of a plan by their labels; none where nothing jumps to one.
    pub(super) fn labels(&mut self, plan: &Plan) -> Option<HashMap<String, usize>> {
        let mut labels = HashMap::new();
        let mut places: HashMap<String, Range<usize>> = HashMap::new();
        for step in &plan.steps {
            if let Action::Label(name) = &step.action {
                let key = name.to_uppercase();
                let part = labels.len() + 1;
                labels.insert(key.clone(), part);
                if let Some(first) = places.insert(key, step.span.clone()) {
                    let message = format!("two labels are called `{name}`");
                    let error = Diagnostic::error("U1016", message, step.span.clone());
                    self.diagnostics.push(error.with_related(first, "the first"));
                }
            }
        }
        let mut jumps = false;
        for step in &plan.steps {
            if let Action::Jump { label: Some(label), .. } = &step.action {
                jumps = true;
                if !labels.contains_key(&label.to_uppercase()) {
                    let message = format!("a jump goes to `{label}`, and no label is called so");
                    self.error("U1016", message, step.span.clone());
                }
            }
        }
        let span = plan.steps.first()?.span.clone();
        if jumps {
            self.declare(NEXT, make::named("DINT", &span));
        }
        jumps.then_some(labels)
    }

    /// Names the values that are kept, since they are asked for before their steps, and finds their types.
    pub(super) fn keep_early(&mut self, plan: &Plan) {
        let mut kept = Vec::new();
        for step in &plan.steps {
            if let Action::Keep { object, power, .. } = &step.action {
                let name = format!("kept.{}", self.made.len() + kept.len());
                self.kept.insert(*object, name.clone());
                kept.push((*object, name, power, &step.span));
            }
        }
        // What is wrong with them is found where they are written.
        let found = self.diagnostics.len();
        let mut types: HashMap<&str, usize> = HashMap::new();
        loop {
            self.keep_types(&kept, &mut types);
            let mut untyped =
                kept.iter().filter(|(_, name, ..)| !types.contains_key(name.as_str()));
            let Some((_, first, power, span)) = untyped.clone().next() else {
                break;
            };
            // A number without a type has that of the variable which it goes to.
            let of_target = untyped
                .find_map(|(object, name, ..)| Some((name, self.type_of_target(plan, *object)?)));
            let (name, of) = of_target.unwrap_or_else(|| {
                let value = self.value(power, span);
                (first, self.type_of(&value))
            });
            types.insert(name, self.made.len());
            self.declare_named(name, of);
        }
        self.diagnostics.truncate(found);
    }

    /// Types what is kept by what it is made of, and makes the types in rings as wide as what comes in there.
    fn keep_types<'k>(
        &mut self,
        kept: &'k [(usize, String, &Power, &Range<usize>)],
        types: &mut HashMap<&'k str, usize>,
    ) {
        for _ in 0..=MAXIMUM_WIDENINGS {
            let mut is_changed = false;
            for (_, name, power, span) in kept {
                let value = self.value(power, span);
                let Some(of) = self.certain_type_of(&value) else {
                    continue;
                };
                match types.get(name.as_str()) {
                    Some(&at) if is_same(&of, &self.made[at].of) => continue,
                    Some(&at) => self.made[at].of = of,
                    None => {
                        types.insert(name, self.made.len());
                        self.declare_named(name, of);
                    }
                }
                is_changed = true;
            }
            if !is_changed {
                return;
            }
        }
    }

    /// The type of the first variable that takes what an object has kept.
    fn type_of_target(&mut self, plan: &Plan, object: usize) -> Option<TypeName> {
        let mut taken = plan.steps.iter().filter_map(|other| match &other.action {
            Action::Write { targets, power, .. } if *power == Power::Kept(object) => {
                targets.first()
            }
            _ => None,
        });
        let (target, _) = taken.next()?;
        let target = self.target(target)?;
        self.certain_type_of(&make::read(target))
    }

    pub(super) fn declare_named(&mut self, name: &str, of: TypeName) {
        let span = of.span.clone();
        let made: Declaration = make::declare(name, Class::Local, of, &span);
        self.made.push(made);
    }

    pub(super) fn step(&mut self, step: &Step, labels: Option<&HashMap<String, usize>>) {
        let before = self.parts.last().map_or(0, Vec::len);
        let span = &step.span;
        match &step.action {
            Action::Label(_) => {
                if labels.is_some() {
                    self.parts.push(Vec::new());
                }
            }
            Action::Jump { label, power } => {
                let condition = self.prepared(power, span);
                let target = label
                    .as_ref()
                    .and_then(|label| labels.and_then(|labels| labels.get(&label.to_uppercase())));
                let body = match (label, target) {
                    (Some(_), Some(part)) => {
                        let next = make::path(&self.next(), None, span);
                        let part = make::integer(*part as i128, span);
                        vec![
                            make::assign(next, part, span),
                            make::statement(StatementKind::Continue, span),
                        ]
                    }
                    _ => vec![make::statement(StatementKind::Return, span)],
                };
                self.push(make::when(condition, body, span));
            }
            Action::Write { targets, power, guard } => {
                self.write(targets, power, guard.as_ref(), span)
            }
            Action::Keep { object, power, edge, guard } => {
                let value = self.prepared(power, span);
                let name = self.kept.get(object).cloned().unwrap_or_default();
                let value = self.changed(value, (false, *edge), None, span);
                let kept = make::assign(make::path(&name, None, span), value, span);
                self.guarded(guard.as_ref(), vec![kept], span);
            }
            Action::Call(call) => self.call(call, span),
        }
        let first = self.parts.last_mut().and_then(|part| part.get_mut(before));
        if let Some(first) = first {
            first.comments.clone_from(&step.comments);
        }
    }

    fn guarded(&mut self, guard: Option<&Power>, body: Vec<Statement>, span: &Range<usize>) {
        match guard {
            None => body.into_iter().for_each(|statement| self.push(statement)),
            Some(guard) => {
                let condition = self.prepared(guard, span);
                self.push(make::when(condition, body, span));
            }
        }
    }

    fn write(
        &mut self,
        targets: &[(Written, Modifier)],
        power: &Power,
        guard: Option<&Power>,
        span: &Range<usize>,
    ) {
        let mut value = self.prepared(power, span);
        // All coils take the power from before the first of them, and an edge is asked for once.
        let is_changed = |(target, _): &(Written, Modifier)| match power {
            Power::Read(read) => read.edge.is_some() || self.places.overlap(&read.text, target),
            _ => false,
        };
        let is_shared = power.measure().0 > 1 || targets.iter().rev().skip(1).any(is_changed);
        if targets.len() > 1 && is_shared {
            let shared = self.declare("power", make::named("BOOL", span));
            self.push(make::assign(make::path(&shared, None, span), value, span));
            value = make::variable(&shared, span);
        }
        for (written, modifier) in targets {
            if self.is_unread(&written.to_uppercase()) {
                continue;
            }
            let sign = (modifier.negated, modifier.edge);
            let value = self.changed(value.clone(), sign, Some(written), span);
            let Some(target) = self.target(written) else {
                continue;
            };
            let statement = match modifier.storage {
                None => make::assign(target, value, span),
                Some(storage) => {
                    let stored = make::boolean(storage == Storage::Set, span);
                    make::when(value, vec![make::assign(target, stored, span)], span)
                }
            };
            self.guarded(guard, vec![statement], span);
        }
    }

    fn call(&mut self, call: &Call, span: &Range<usize>) {
        let mut inputs: Vec<(Written, Expression)> = Vec::new();
        for input in &call.inputs {
            let value = match self.preset_in_scans(call, &input.pin, &input.power) {
                Some(preset) => preset,
                None => self.prepared(&input.power, span),
            };
            let sign = (input.modifier.negated, input.modifier.edge);
            // A block without an instance has no name that stays.
            let pin = call.is_named.then(|| format!("{}.{}", call.instance, input.pin));
            let value = self.changed(value, sign, pin.as_deref(), span);
            let known = unit(self.file, &call.type_name);
            let pin = BlockKind::of_word(&call.type_name)
                .and_then(|kind| standard::input(kind, &input.pin))
                .filter(|_| !known.is_some_and(|known| has(known, &input.pin)));
            let pin = match pin {
                Some(pin) => Written::at(pin, input.pin.span()),
                None => input.pin.clone(),
            };
            inputs.push((pin, value));
        }
        let found = unit(self.file, &call.type_name);
        if let Some(found) = found {
            for (pin, value) in &inputs {
                let in_out = found
                    .declarations
                    .iter()
                    .any(|known| known.class == Class::InOut && known.name.is(pin));
                if in_out {
                    let key = (call.instance.to_uppercase(), pin.to_uppercase());
                    self.results.insert(key, value.clone());
                }
            }
        }
        let statement = match found.filter(|found| found.kind == UnitKind::Function) {
            Some(_) => self.function_call(call, inputs, span),
            None => {
                let inputs =
                    inputs.into_iter().map(|(pin, value)| Argument::Given(make::name(&pin), value));
                let inputs = inputs.collect();
                let path = self.instance(&call.instance);
                make::statement(StatementKind::Call(path, inputs), span)
            }
        };
        self.guarded(call.enable.as_ref(), vec![statement], span);
    }

    /// A function whose outputs are variables that were made for it.
    fn function_call(
        &mut self,
        call: &Call,
        inputs: Vec<(Written, Expression)>,
        span: &Range<usize>,
    ) -> Statement {
        let mut arguments = arguments(inputs, true);
        let instance = call.instance.to_uppercase();
        let mut result = String::new();
        for (of, pin, name) in &self.outputs {
            if *of != instance {
                continue;
            }
            let to = make::path(name, None, span);
            match pin.is_empty() {
                true => result.clone_from(name),
                false => arguments.push(Argument::Taken {
                    from: Name::new(pin, span.clone()),
                    to,
                    negated: false,
                }),
            }
        }
        let value = make::call(make::name(&call.type_name), arguments, span);
        make::assign(make::path(&result, None, span), value, span)
    }

    /// What a call needs and nobody declared: its instance, or the variables of a function's outputs.
    pub(super) fn declared(&mut self, call: &Call, span: &Range<usize>) {
        let file = self.file;
        if let Some(function) = unit(file, &call.type_name)
            && function.kind == UnitKind::Function
        {
            let outputs = function.declarations.iter();
            let outputs = outputs.filter(|output| output.class == Class::Output);
            let outputs = outputs.map(|output| (output.name.key(), output.of.clone()));
            let result = function.result.clone();
            let result = result.unwrap_or_else(|| make::named("BOOL", span));
            for (pin, of) in outputs.chain([(String::new(), result)]) {
                let name = self.declare("output", of);
                let instance = call.instance.to_uppercase();
                let value = make::variable(&name, span);
                self.results.insert((instance.clone(), pin.clone()), value);
                self.outputs.push((instance, pin, name));
            }
            return;
        }
        let root = call.instance.split(['.', '[']).next().unwrap_or_default();
        let own = self.declarations.iter().chain(&self.made);
        let mut known = own.chain(&self.file.globals);
        if call.is_named && known.any(|known| known.name.is(root)) {
            return;
        }
        let of = make::named(&call.type_name, &call.type_name.span());
        if !call.is_named {
            let name = self.declare("block", of);
            self.instances.insert(call.instance.to_string(), name);
            return;
        }
        let span = call.instance.span();
        let message = format!("the block `{}` is not declared", call.instance);
        let help = format!("declare the variable `{}` of type {}", call.instance, call.type_name);
        let found = if self.lacks_instances {
            let message = format!("{message}; it is read as a separate {}", call.type_name);
            Diagnostic::warning("U1012", message, span)
        } else {
            Diagnostic::error("U1012", message, span)
        };
        self.diagnostics.push(found.with_help(help));
        self.declare_named(&call.instance, of);
    }
}

/// Whether two types are the same; types without names are compared where they are used.
fn is_same(left: &TypeName, right: &TypeName) -> bool {
    match (&left.kind, &right.kind) {
        (TypeKind::Named(left), TypeKind::Named(right)) => left.key() == right.key(),
        (TypeKind::Named(_), _) | (_, TypeKind::Named(_)) => false,
        _ => true,
    }
}

fn has(unit: &Unit, pin: &str) -> bool {
    unit.declarations.iter().any(|known| known.name.is(pin))
}
