//! Programs that others name: in TwinCAT and CODESYS a PROGRAM has one memory, and one that no task runs is called like an instance.

use std::collections::HashSet;
use std::rc::Rc;

use understudy_typed::{Root, Type, Variable as Shown};

use crate::syntax::{Body, Class, File, Name, Retention, Statement, StatementKind, Unit, UnitKind};

use super::Lowering;
use super::images::initial;
use super::names::{Symbol, Variable};

/// The programs that run where no task says which: those that no other calls, or all of them, where each is called.
pub fn roots(file: &File) -> Vec<&Unit> {
    let programs = file.units.iter().filter(|unit| unit.kind == UnitKind::Program);
    let programs: Vec<&Unit> = programs.collect();
    let called = called(&file.units);
    let is_root = |unit: &&Unit| !called.contains(&unit.name.key());
    let roots: Vec<&Unit> = programs.iter().copied().filter(is_root).collect();
    if roots.is_empty() { programs } else { roots }
}

/// Names in capitals of what the bodies of units call by one name alone.
fn called(units: &[Unit]) -> HashSet<String> {
    let mut found = HashSet::new();
    for unit in units {
        for body in unit.methods.iter().map(|method| &method.body).chain([&unit.body]) {
            if let Body::Statements(statements) = body {
                calls(statements, &mut found);
            }
        }
    }
    found
}

fn calls(statements: &[Statement], found: &mut HashSet<String>) {
    for statement in statements {
        match &statement.kind {
            StatementKind::Call(path, _) if path.steps.is_empty() => {
                found.insert(path.root.key());
            }
            StatementKind::If(branches, otherwise) => {
                branches.iter().for_each(|(_, body)| calls(body, found));
                calls(otherwise, found);
            }
            StatementKind::Case(_, branches, otherwise) => {
                branches.iter().for_each(|(_, body)| calls(body, found));
                calls(otherwise, found);
            }
            StatementKind::For(of) => calls(&of.body, found),
            StatementKind::While(_, body) | StatementKind::Repeat(body, _) => calls(body, found),
            _ => {}
        }
    }
}

impl<'a> Lowering<'a> {
    /// The only instance of a program that runs has its memory under its name too.
    pub(super) fn name_program(&mut self, unit: usize, own: u32, of: &Type) {
        let symbol = self.program_variable(unit, own, of);
        self.named_programs.insert(unit, symbol);
    }

    fn program_variable(&self, unit: usize, slot: u32, of: &Type) -> Symbol {
        let name = &self.units[unit].unit.name;
        Symbol::Variable(Rc::new(Variable {
            name: name.as_str().to_owned(),
            root: Root::Global(slot),
            of: of.clone(),
            class: Class::Local,
            is_constant: false,
            is_point: self.running.contains(&unit),
            range: None,
            span: name.span(),
        }))
    }

    /// The memory of the program of a name in capitals, where it has one.
    pub(super) fn named_program(&mut self, key: &str) -> Option<Symbol> {
        let unit = *self.unit_names.get(key)?;
        if self.units[unit].unit.kind != UnitKind::Program || self.is_library {
            return None;
        }
        if let Some(known) = self.named_programs.get(&unit) {
            return Some(known.clone());
        }
        if self.running.contains(&unit) {
            return None;
        }
        let name = &self.units[unit].unit.name;
        let symbol = match self.block(unit, &name.span()) {
            Some(block) => self.state(block.of.slots(), &name.span()).map(|slot| {
                self.program.initial.extend(initial(&block.image, slot));
                self.keep(Retention::Unstated, &block.of, slot);
                self.program.variables.push(Shown {
                    name: name.as_str().to_owned(),
                    of: block.of.clone(),
                    slot,
                    address: None,
                    description: None,
                });
                self.program_variable(unit, slot, &block.of)
            }),
            None => None,
        };
        let symbol = symbol.unwrap_or(Symbol::Faulty);
        self.named_programs.insert(unit, symbol.clone());
        Some(symbol)
    }

    /// Whether a name that is called is that of a program which runs by itself.
    pub(super) fn runs_by_itself(&self, name: &Name) -> bool {
        let unit = self.unit_names.get(&name.key());
        let is_variable = |key: &String| {
            let own = self.scope.symbols.as_ref();
            own.is_some_and(|own| own.contains_key(key)) || self.globals.contains_key(key)
        };
        unit.is_some_and(|unit| self.running.contains(unit)) && !is_variable(&name.key())
    }
}
