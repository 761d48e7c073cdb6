//! Variables, types and the configuration.

use super::expression::{expression, initializer, list, type_name};
use super::{Printer, block_word, harmless};
use crate::syntax::{Declaration, File, Retention, TypeDefinition, TypeKind};

/// `name AT %IX0.0 : type := value;`
pub(super) fn declared(of: &Declaration) -> String {
    let mut text = of.name.to_string();
    if let Some(address) = &of.address {
        text += &format!(" AT {address}");
    }
    text += &format!(" : {}", type_name(&of.of));
    match of.edge {
        Some(true) => text += " R_EDGE",
        Some(false) => text += " F_EDGE",
        None => {}
    }
    if let Some(initial) = &of.initial {
        text += &format!(" := {}", initializer(initial));
    }
    text.push(';');
    text
}

/// The qualifier of a block, with a space before it.
pub(super) fn retention_word(retention: Retention) -> &'static str {
    match retention {
        Retention::Unstated => "",
        Retention::Retained => " RETAIN",
        Retention::NotRetained => " NON_RETAIN",
    }
}

impl Printer {
    /// Blocks of variables: a new one wherever class or qualifiers change, since the order counts.
    pub(super) fn declarations(&mut self, declarations: &[Declaration]) {
        let like = |of: &Declaration| (of.class, of.constant, of.retention);
        for block in declarations.chunk_by(|first, second| like(first) == like(second)) {
            let (class, constant, retention) = like(&block[0]);
            let mut header = block_word(class).to_owned();
            if constant {
                header += " CONSTANT";
            }
            header += retention_word(retention);
            self.line(&header);
            self.within(|printer| block.iter().for_each(|of| printer.declaration(of)));
            self.line("END_VAR");
        }
    }

    fn declaration(&mut self, of: &Declaration) {
        let mut line = declared(of);
        if let Some(description) = &of.description {
            line += &format!(" (* {} *)", harmless(description));
        }
        self.line(&line);
    }

    /// `TYPE … END_TYPE`, with a line for each field of a structure.
    pub(super) fn types(&mut self, types: &[TypeDefinition]) {
        if types.is_empty() {
            return;
        }
        self.line("TYPE");
        self.within(|printer| {
            for definition in types {
                let initial = definition.initial.as_ref();
                let initial = initial.map(|value| format!(" := {}", initializer(value)));
                let initial = initial.unwrap_or_default();
                let TypeKind::Structure(fields) = &definition.of.kind else {
                    let of = type_name(&definition.of);
                    printer.line(&format!("{} : {of}{initial};", definition.name));
                    continue;
                };
                printer.line(&format!("{} : STRUCT", definition.name));
                printer.within(|printer| fields.iter().for_each(|of| printer.declaration(of)));
                printer.line(&format!("END_STRUCT{initial};"));
            }
        });
        self.line("END_TYPE");
    }

    /// Global variables, tasks and instances of programs.
    pub(super) fn configuration(&mut self, file: &File) {
        let has_tasks = !file.tasks.is_empty() || !file.instances.is_empty();
        if !has_tasks && file.globals.is_empty() {
            return;
        }
        self.gap();
        if !has_tasks {
            self.declarations(&file.globals);
            return;
        }
        self.line("CONFIGURATION Config");
        self.within(|printer| {
            printer.declarations(&file.globals);
            printer.line("RESOURCE Resource1 ON PLC");
            printer.within(|printer| printer.resource(file));
            printer.line("END_RESOURCE");
        });
        self.line("END_CONFIGURATION");
    }

    fn resource(&mut self, file: &File) {
        for task in &file.tasks {
            let mut settings = Vec::new();
            if let Some(single) = &task.single {
                settings.push(format!("SINGLE := {}", expression(single)));
            }
            if let Some(interval) = task.interval {
                let of = understudy_typed::Elementary::Time;
                let literal = crate::syntax::Literal::Time { nanoseconds: interval, of };
                settings.push(format!("INTERVAL := {}", super::expression::literal(&literal)));
            }
            if let Some(priority) = task.priority {
                settings.push(format!("PRIORITY := {priority}"));
            }
            let settings = match settings.is_empty() {
                true => String::new(),
                false => format!(" ({})", settings.join(", ")),
            };
            self.line(&format!("TASK {}{settings};", task.name));
        }
        for instance in &file.instances {
            let task = instance.task.as_ref();
            let task = task.map(|task| format!(" WITH {task}")).unwrap_or_default();
            let connections = match instance.connections.is_empty() {
                true => String::new(),
                false => format!(" ({})", list(&instance.connections)),
            };
            let (name, of) = (&instance.name, &instance.of);
            let retention = retention_word(instance.retention);
            self.line(&format!("PROGRAM{retention} {name}{task} : {of}{connections};"));
        }
    }
}
