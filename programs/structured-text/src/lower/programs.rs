//! What a file says beside its bodies: global variables, addresses, programs and their tasks.

use std::collections::HashMap;
use std::rc::Rc;

use understudy_text::spelling;
use understudy_typed::{
    EdgeMemory, Elementary, Points, Program, Root, Task, Type, Variable as Shown,
};

use crate::syntax::{
    Argument, Class, Declaration, Expression, File, Name, Retention, Span, Unit, UnitKind,
};

use super::addresses;
use super::blocks::{Block, Key, Parameter};
use super::called::roots;
use super::images::initial;
use super::names::{Owner, Symbol, Variable};
use super::tasks::{interval, shortest, task};
use super::types::{Resolved, TypeState};
use super::{DEFAULT_PERIOD, Lowering, Options};

/// A PROGRAM that is run.
pub(super) struct Instance<'a> {
    pub(super) name: &'a Name,
    unit: usize,
    /// Nanoseconds, and how urgent it is.
    pub(super) interval: Option<i64>,
    priority: i64,
    /// What its inputs and outputs are connected to.
    pub(super) connections: &'a [Argument],
    /// What is said of all its variables.
    retention: Retention,
    /// The event that runs it, SINGLE.
    pub(super) event: Option<&'a Expression>,
}

impl<'a> Lowering<'a> {
    /// Types, constants and global variables.
    pub(super) fn declare(&mut self, file: &'a File, library: &'static File) {
        for definition in &library.types {
            let state = TypeState::New(definition);
            self.types.insert(definition.name.key(), state);
        }
        let mut first: std::collections::HashMap<String, Span> = std::collections::HashMap::new();
        let units = file.units.iter().map(|unit| &unit.name);
        for name in units.chain(file.types.iter().map(|definition| &definition.name)) {
            if let Some(before) = first.insert(name.key(), name.span()) {
                let message = format!("`{name}` is declared twice");
                let found = understudy_text::Diagnostic::error("U1042", message, name.span());
                self.report(found.with_related(before, "declared here first"));
            }
        }
        for definition in &file.types {
            let state = TypeState::New(definition);
            self.types.insert(definition.name.key(), state);
        }
        for declaration in &file.globals {
            let key = declaration.name.key();
            if self.global_declarations.insert(key, declaration).is_some() {
                let message = format!("`{}` is declared twice in VAR_GLOBAL", declaration.name);
                let help = "remove or rename one of them";
                self.error_with("U1042", message, declaration.name.span(), help);
            }
        }
        for definition in &file.types {
            let span = definition.name.span();
            let kind = crate::syntax::TypeKind::Named(definition.name.clone());
            self.resolve(&crate::syntax::TypeName { kind, span });
        }
        for declaration in &file.globals {
            self.global_variable(declaration);
        }
        self.check_retention(file);
    }

    fn global_variable(&mut self, declaration: &'a Declaration) {
        let key = declaration.name.key();
        if self.globals.contains_key(&key) {
            return;
        }
        if declaration.constant
            && let Symbol::Constant(_) = self.constant_symbol(None, declaration)
        {
            return;
        }
        let symbol = self.global_symbol(declaration);
        self.globals.insert(key, symbol.unwrap_or(Symbol::Faulty));
    }

    fn global_symbol(&mut self, declaration: &Declaration) -> Option<Symbol> {
        let resolved = self.declared_type(declaration)?;
        if declaration.address.is_some() {
            let symbol = self.located(declaration, &resolved);
            self.publish(declaration.name.as_str(), declaration, &symbol);
            return Some(symbol);
        }
        let slot = self.state(resolved.of.slots(), &declaration.name.span())?;
        self.program.initial.extend(initial(&resolved.image, slot));
        self.keep(declaration.retention, &resolved.of, slot);
        let symbol = variable(declaration, Root::Global(slot), &resolved);
        self.publish(declaration.name.as_str(), declaration, &symbol);
        Some(symbol)
    }

    /// Shows a variable to people.
    fn publish(&mut self, name: &str, declaration: &Declaration, symbol: &Symbol) {
        if let Symbol::Variable(variable) = symbol
            && let Root::Global(slot) = variable.root
        {
            self.ranges.extend(variable.range.map(|range| (name.to_owned(), range)));
            self.program.variables.push(Shown {
                name: name.to_owned(),
                of: variable.of.clone(),
                slot,
                address: declaration.address.as_ref().map(|found| found.as_str().to_owned()),
                description: declaration.description.clone(),
            });
        }
    }

    /// Lowers the programs that run; for a library its units, whose names are the answer.
    pub(super) fn programs(&mut self, file: &'a File, options: &Options<'_>) -> Vec<String> {
        let is_program = |unit: &&Unit| unit.kind == UnitKind::Program;
        let programs: Vec<&Unit> = file.units.iter().filter(is_program).collect();
        if programs.is_empty() {
            self.is_library = true;
            let is_empty =
                file.units.is_empty() && file.types.is_empty() && file.globals.is_empty();
            if options.program.is_some() || is_empty {
                let message = "the file has no PROGRAM";
                self.error_with("U1051", message, 0..0, "add a PROGRAM that calls its blocks");
            }
            return self.library(file);
        }
        let instances = self.instances(file, &programs, options);
        if instances.is_empty() {
            return Vec::new();
        }
        self.running = instances.iter().map(|instance| instance.unit).collect();
        let base = self.base(&instances, options.period);
        let period = options.period.or(base.map(|base| base.common));
        self.program.period = period.unwrap_or(DEFAULT_PERIOD);
        let names: Vec<&str> = instances.iter().map(|instance| instance.name.as_str()).collect();
        self.program.name = match names.len() {
            1 => self.units[instances[0].unit].unit.name.as_str().to_owned(),
            _ => names.join(", "),
        };
        let are_several = instances.len() > 1;
        for instance in &instances {
            let every = match (instance.interval, base) {
                (Some(interval), Some(base)) => base.every(interval),
                _ => 1,
            };
            let is_only = instances.iter().filter(|other| other.unit == instance.unit).count() == 1;
            self.run(instance, every, are_several, is_only);
        }
        self.bodies();
        self.copy_elements();
        self.check_idle(&programs, options.program.is_some());
        self.recursion();
        self.program.initial.sort_by_key(|initial| initial.slot);
        Vec::new()
    }

    /// The programs that run, in the order of a scan.
    fn instances(
        &mut self,
        file: &'a File,
        programs: &[&'a Unit],
        options: &Options<'_>,
    ) -> Vec<Instance<'a>> {
        let names = || programs.iter().map(|program| program.name.as_str());
        let alone = if file.instances.is_empty() { shortest(file) } else { None };
        let whole = |unit: &'a Unit, index: usize| Instance {
            name: &unit.name,
            unit: index,
            interval: alone,
            priority: 0,
            connections: &[],
            retention: Retention::Unstated,
            event: None,
        };
        if let Some(chosen) = options.program {
            let found = programs.iter().find(|program| program.name.is(chosen));
            let Some(unit) = found else {
                let message = format!("the file has no PROGRAM `{chosen}`");
                let help = spelling::suggestion(chosen, names());
                self.error_with("U1013", message, 0..0, help);
                return Vec::new();
            };
            let mut instance = whole(unit, self.unit_names[&unit.name.key()]);
            let declared = file.instances.iter().find(|found| found.of.is(chosen));
            instance.retention = declared.map(|found| found.retention).unwrap_or_default();
            return match declared.and_then(|found| found.task.as_ref()) {
                Some(task) if !self.give_task(file, task, &mut instance) => Vec::new(),
                _ => vec![instance],
            };
        }
        if file.instances.is_empty() {
            let roots = roots(file);
            if let [_, second, ..] = roots.as_slice() {
                let list: Vec<&str> = roots.iter().map(|unit| unit.name.as_str()).collect();
                let message = format!(
                    "the file has {} programs and no CONFIGURATION that says which of them run: each scan runs all, in this order",
                    roots.len()
                );
                let help = format!("choose one with --program, of {}", list.join(", "));
                self.warn("U1013", message, second.name.span(), help);
            }
            let runs = roots.into_iter();
            return runs.map(|unit| whole(unit, self.unit_names[&unit.name.key()])).collect();
        }
        let mut instances = Vec::new();
        for declared in &file.instances {
            let Some(unit) = programs.iter().find(|program| program.name == declared.of) else {
                let message = format!("the file has no PROGRAM `{}`", declared.of);
                let help = spelling::suggestion(declared.of.as_str(), names());
                self.error_with("U1013", message, declared.of.span(), help);
                continue;
            };
            let mut instance = whole(unit, self.unit_names[&unit.name.key()]);
            instance.name = &declared.name;
            instance.connections = &declared.connections;
            instance.retention = declared.retention;
            instance.priority = i64::MAX;
            if let Some(name) = &declared.task
                && !self.give_task(file, name, &mut instance)
            {
                continue;
            }
            instances.push(instance);
        }
        instances.sort_by_key(|instance| instance.priority);
        instances
    }

    /// Gives a program the interval, the event and the priority of its task; false where the task has an error.
    fn give_task(&mut self, file: &'a File, name: &Name, instance: &mut Instance<'a>) -> bool {
        let Some(task) = task(file, name) else {
            let message = format!("the task `{name}` is not declared");
            let known = file.tasks.iter().map(|task| task.name.as_str());
            let help = spelling::suggestion(name.as_str(), known);
            self.error_with("U1041", message, name.span(), help);
            return false;
        };
        if task.single.is_some() && task.interval.is_some_and(|interval| interval > 0) {
            let message = format!("the task `{name}` has an INTERVAL and an event (SINGLE)");
            self.error_with("U1084", message, task.name.span(), "give it one of them");
            return false;
        }
        instance.event = task.single.as_ref();
        instance.interval = interval(task);
        instance.priority = task.priority.unwrap_or(i64::MAX);
        true
    }

    fn run(&mut self, instance: &Instance<'a>, every: u32, are_several: bool, is_only: bool) {
        let span = instance.name.span();
        let Some(block) = self.block(instance.unit, &span) else {
            return;
        };
        let Some(own) = self.state(block.of.slots(), &span) else {
            return;
        };
        let key = Key {
            owner: Owner { unit: instance.unit, method: None },
            class: Some(instance.unit),
            open: Vec::new(),
        };
        let Some(routine) = self.routine(key, &span) else {
            return;
        };
        self.program.initial.extend(initial(&block.image, own));
        self.keep(instance.retention, &block.of, own);
        if instance.retention == Retention::Retained {
            self.keep_located(&self.units[instance.unit].unit.declarations);
        }
        if is_only {
            self.name_program(instance.unit, own, &block.of);
        }
        let connected = self.connected(instance, &routine, &block);
        self.program.tasks.push(Task { routine: connected.unwrap_or(routine.id), own, every });
        let prefix = match are_several {
            true => format!("{}.", instance.name),
            false => String::new(),
        };
        self.program_variables(&block, own, &prefix, instance.connections);
    }

    fn program_variables(
        &mut self,
        block: &Block,
        own: u32,
        prefix: &str,
        connections: &[Argument],
    ) {
        // Of two of a name, which were reported, the first one.
        let parameters: HashMap<&str, &Parameter> =
            block.parameters.iter().rev().map(|found| (found.name.as_str(), found)).collect();
        for name in &block.order {
            let Some(member) = block.members.get(name) else {
                continue;
            };
            let Symbol::Variable(variable) = &member.symbol else {
                continue;
            };
            // Memories that no person declared, as of charts; what sees the edges of something is named by it.
            let is_hidden =
                variable.name.contains('.') && EdgeMemory::named(&variable.name).is_none();
            let parameter = parameters.get(variable.name.as_str()).copied();
            let slot = match (variable.root, parameter) {
                (_, Some(parameter)) => own + parameter.slot,
                (Root::Own(slot), None) => own + slot,
                (Root::Global(slot), None) if member.class != Class::External => slot,
                _ => continue,
            };
            let shown = format!("{prefix}{}", variable.name);
            let is_connected = connections.iter().any(|connection| match connection {
                Argument::Given(name, _) | Argument::Taken { from: name, .. } => {
                    name.is(&variable.name)
                }
                Argument::Placed(_) => false,
            });
            // At %I and %Q its address has made it one; an output at %M is one by its declaration.
            let is_memory = member.class == Class::Output
                && member.address.as_deref().is_some_and(|address| {
                    address.get(..2).is_some_and(|area| area.eq_ignore_ascii_case("%M"))
                });
            if !is_connected
                && (matches!(variable.root, Root::Own(_)) || is_memory)
                && let Class::Input | Class::Output = member.class
            {
                self.point(&shown, variable, slot, member.class == Class::Input);
            }
            self.ranges.extend(variable.range.map(|range| (shown.clone(), range)));
            let Program { variables, hidden, .. } = &mut self.program;
            let of_it = if is_hidden { hidden } else { variables };
            of_it.push(Shown {
                name: shown,
                of: variable.of.clone(),
                slot,
                address: member.address.clone(),
                description: member.description.clone(),
            });
        }
        for edge in &block.edges {
            for (slot, what) in [(edge.seen, "edge"), (edge.last, "last")] {
                let input = block.parameters.iter().find(|found| found.slot == edge.input);
                let name = input.map_or("", |input| &input.name);
                self.program.variables.push(Shown {
                    name: format!("{prefix}{name}.{what}"),
                    of: Type::Elementary(Elementary::Bool),
                    slot: own + slot,
                    address: None,
                    description: None,
                });
            }
        }
    }

    fn point(&mut self, name: &str, variable: &Variable, slot: u32, is_input: bool) {
        let mut points = Vec::new();
        let root = (&variable.of, variable.range);
        if let Err((part, of)) = self.points_of(root, (name, slot), true, &mut points) {
            let found = self.describe(&variable.of);
            // Of a structure the part that is in the way.
            let why = match part == name {
                true => String::new(),
                false => format!(" with `{part}` : {}", self.describe(&of)),
            };
            let message = match is_input {
                true => format!(
                    "the input `{name}` is {found}{why}: nothing writes it, and it keeps its initial value"
                ),
                false => {
                    format!(
                        "the output `{name}` is {found}{why}: only the program itself can read it"
                    )
                }
            };
            let help = "a point is a number, a bit, a time or a value of an enumeration, or such a part of an array or a structure with up to 1,000 of them; declare each part as a variable of its own, or use VAR";
            self.warn("U1055", message, variable.span.clone(), help);
            return;
        }
        for point in points {
            match point {
                addresses::Points::One(name, declared, slot) => {
                    self.points_mut(is_input).push_declared(name, declared, slot);
                }
                addresses::Points::Elements(name, array, declared, slot) => {
                    let root = (array.as_ref(), &declared, slot);
                    let elements = self.elements_of(&name, root, &variable.span, is_input);
                    for (name, own) in elements.unwrap_or_default() {
                        self.points_mut(is_input).push_declared(name, declared.clone(), own);
                    }
                }
            }
        }
    }

    pub(super) fn points_mut(&mut self, are_inputs: bool) -> &mut Points {
        match are_inputs {
            true => &mut self.program.inputs,
            false => &mut self.program.outputs,
        }
    }

    /// Lowers each unit of a file without a PROGRAM by itself.
    fn library(&mut self, file: &'a File) -> Vec<String> {
        let types = file.types.iter().map(|definition| &definition.name);
        let globals = file.globals.iter().map(|declaration| &declaration.name);
        let names = types.chain(globals);
        let mut checked: Vec<String> = names.map(|name| name.as_str().to_owned()).collect();
        // The file's units come first among all.
        for (index, unit) in file.units.iter().enumerate() {
            let class = (unit.kind == UnitKind::FunctionBlock).then_some(index);
            self.check(index, None, class, unit);
            for method in 0..unit.methods.len() {
                self.check(index, Some(method), class, &unit.methods[method]);
            }
            checked.push(unit.name.as_str().to_owned());
            self.bodies();
        }
        self.recursion();
        checked
    }

    pub(super) fn check(
        &mut self,
        index: usize,
        method: Option<usize>,
        class: Option<usize>,
        unit: &'a Unit,
    ) {
        let owner = Owner { unit: index, method };
        let mut open = Vec::new();
        let outside = self.leave_unit();
        self.scope.unit = Some(index);
        self.scope.method = method;
        for declaration in &unit.declarations {
            let dimensions = match (&declaration.of.kind, declaration.class) {
                (crate::syntax::TypeKind::OpenArray(..), Class::InOut | Class::Input)
                | (crate::syntax::TypeKind::Text { .. }, Class::InOut) => {
                    self.reference_type(&declaration.of)
                }
                _ => None,
            };
            open.extend(dimensions.map(|(resolved, _)| match resolved.of {
                Type::Array(array) => {
                    let mut array = (*array).clone();
                    array.ranges.fill((-100, 100));
                    Type::Array(std::sync::Arc::new(array))
                }
                other => other,
            }));
        }
        self.scope = outside;
        let key = Key { owner, class, open };
        self.routine(key, &unit.name.span());
    }
}

fn variable(declaration: &Declaration, root: Root, resolved: &Resolved) -> Symbol {
    Symbol::Variable(Rc::new(Variable {
        name: declaration.name.as_str().to_owned(),
        root,
        of: resolved.of.clone(),
        class: declaration.class,
        is_constant: declaration.constant,
        is_point: false,
        range: resolved.range,
        span: declaration.name.span(),
    }))
}
