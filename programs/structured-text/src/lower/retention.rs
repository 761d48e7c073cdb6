//! Which variables are retentive.
//!
//! A block of declarations is RETAIN, NON_RETAIN or says nothing. The innermost block that says something decides: RETAIN of an instance is for all
//! in it, of instances inside it too, except for what its own function block declares NON_RETAIN; what a function block declares RETAIN is kept in
//! each of its instances. IEC 61131-3 (6.5.6) says the same, but leaves an instance inside an instance to its own function block.

use std::ops::Range;

use understudy_typed::{Structure, Type};

use crate::syntax::{Class, Declaration, File, Retention, Unit, UnitKind};

use super::Lowering;

/// Ranges of slots, in order.
type Slots = Vec<Range<u32>>;

impl Retention {
    /// Whether a variable is kept of which this is said inside of what is kept or not.
    fn within(self, is_kept: bool) -> bool {
        match self {
            Self::Unstated => is_kept,
            Self::Retained => true,
            Self::NotRetained => false,
        }
    }
}

impl Lowering<'_> {
    /// Makes a variable of the state retentive, as its declaration says.
    pub(super) fn keep(&mut self, retention: Retention, of: &Type, slot: u32) {
        let mut slots = Slots::new();
        self.kept(of, slot, retention.within(false), &mut slots);
        slots.into_iter().for_each(|range| self.program.retain(range));
    }

    /// Slots of a type that are kept, where it begins at a slot.
    fn kept(&self, of: &Type, slot: u32, is_kept: bool, slots: &mut Slots) {
        let all = slot..slot.saturating_add(of.slots() as u32);
        if !self.is_mixed(of) {
            match slots.last_mut() {
                Some(last) if is_kept && last.end == all.start => last.end = all.end,
                _ if is_kept => slots.push(all),
                _ => {}
            }
            return;
        }
        match of {
            Type::Structure(id, _) => {
                let info = self.structures[id.0 as usize].clone();
                for field in &self.program.structures[id.0 as usize].fields {
                    let retention = info.retention.get(&field.slot).copied().unwrap_or_default();
                    let is_kept = retention.within(is_kept);
                    let slot = slot + field.slot;
                    match field.is_reference {
                        true if is_kept => slots.push(slot..slot + 1),
                        true => {}
                        false => self.kept(&field.of, slot, is_kept, slots),
                    }
                }
            }
            Type::Array(array) => {
                let each = array.element.slots() as u32;
                for element in 0..array.length() as u32 {
                    self.kept(&array.element, slot + element * each, is_kept, slots);
                }
            }
            _ => {}
        }
    }

    /// Whether some parts of a type have a retention of their own.
    fn is_mixed(&self, of: &Type) -> bool {
        match of {
            Type::Structure(id, _) => self.structures[id.0 as usize].is_mixed,
            Type::Array(array) => self.is_mixed(&array.element),
            _ => false,
        }
    }

    /// Whether one of the fields of a structure is.
    pub(super) fn has_mixed(&self, structure: &Structure) -> bool {
        structure.fields.iter().any(|field| !field.is_reference && self.is_mixed(&field.of))
    }

    /// The warnings of RETAIN where nothing can be kept.
    pub(super) fn check_retention(&mut self, file: &File) {
        for unit in &file.units {
            self.check_retention_of(unit, unit.kind);
            for method in &unit.methods {
                self.check_retention_of(method, UnitKind::Function);
            }
        }
        for declaration in file.globals.iter().filter(|declaration| declaration.constant) {
            self.check_kept(declaration, UnitKind::Program);
        }
    }

    fn check_retention_of(&mut self, unit: &Unit, kind: UnitKind) {
        for declaration in &unit.declarations {
            self.check_kept(declaration, kind);
        }
    }

    fn check_kept(&mut self, declaration: &Declaration, kind: UnitKind) {
        if declaration.retention != Retention::Retained {
            return;
        }
        let is_input = declaration.address.as_ref().is_some_and(|address| {
            address.as_str().get(..2).is_some_and(|area| area.eq_ignore_ascii_case("%I"))
        });
        let reason = match (declaration.class, kind) {
            _ if declaration.constant => "a constant is never written",
            _ if is_input => "an input is sampled in each scan",
            (Class::Temporary, _) => "VAR_TEMP begins with its initial value in each call",
            (Class::InOut, _) => "VAR_IN_OUT is a variable of the caller",
            (Class::External, _) => "VAR_EXTERNAL is retentive where its VAR_GLOBAL is",
            (Class::Static, _) => return,
            (_, UnitKind::Function) => "a function keeps nothing from call to call",
            (Class::Input, UnitKind::Program) => "an input is sampled in each scan",
            _ => return,
        };
        let message = format!("RETAIN of `{}` has no effect: {reason}", declaration.name);
        let help = match declaration.class {
            Class::External => "write RETAIN in VAR_GLOBAL",
            _ => "remove RETAIN from its declaration",
        };
        self.warn("U1055", message, declaration.name.span(), help);
    }
}
