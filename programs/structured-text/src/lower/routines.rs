//! Bodies that can be called: their parameters, their frames, the names that they know.

use std::collections::{HashMap, HashSet};
use std::ops::Range;
use std::rc::Rc;

use understudy_typed::{
    Initial, Root, Routine as Lowered, RoutineId, RoutineKind, Timer, Type, Variable as Shown,
};

use crate::syntax::{Class, Declaration, Name, Span, UnitKind};

use super::blocks::{Key, Parameter, Routine};
use super::images::initial;
use super::names::{Symbol, Variable};
use super::types::Resolved;
use super::{Lowering, MAXIMUM_FRAMES, MAXIMUM_ROUTINES};

/// A frame that is being laid out.
struct Frame {
    next: u32,
    initial: Vec<Initial>,
    symbols: HashMap<String, Symbol>,
    own: HashSet<String>,
    parameters: Vec<Parameter>,
    /// The types of open parameters that are still to come.
    open: std::vec::IntoIter<Type>,
}

impl<'a> Lowering<'a> {
    /// The routine of a body; it is lowered later.
    pub(super) fn routine(&mut self, key: Key, span: &Span) -> Option<Rc<Routine>> {
        if let Some(routine) = self.routines.get(&key) {
            return Some(routine.clone());
        }
        if self.program.routines.len() >= MAXIMUM_ROUTINES {
            let message = format!("the program has more than {MAXIMUM_ROUTINES} bodies");
            self.error("U1048", message, span.clone());
            return None;
        }
        let outside = self.leave_unit();
        self.scope.unit = Some(key.owner.unit);
        self.scope.method = key.owner.method;
        let routine = self.deeper(span, |own| own.new_routine(&key, span));
        self.scope = outside;
        let routine = Rc::new(routine?);
        self.routines.insert(key.clone(), routine.clone());
        self.queue.push((key, routine.clone()));
        Some(routine)
    }

    fn new_routine(&mut self, key: &Key, span: &Span) -> Option<Routine> {
        let unit = self.unit_of(key.owner);
        let has_memory = unit.kind != UnitKind::Function;
        let is_body = matches!(unit.kind, UnitKind::Program | UnitKind::FunctionBlock);
        let start = self.program.frames;
        let mut frame = Frame {
            next: start,
            initial: Vec::new(),
            symbols: HashMap::new(),
            own: HashSet::new(),
            parameters: Vec::new(),
            open: key.open.clone().into_iter(),
        };
        if has_memory {
            let block = self.block(key.owner.unit, span)?;
            for (name, member) in &block.members {
                frame.symbols.insert(name.clone(), member.symbol.clone());
            }
            if is_body {
                frame.parameters = block.parameters.clone();
                open_members(&mut frame);
            }
        }
        for declaration in &unit.declarations {
            if is_body && declaration.class != Class::Temporary {
                continue;
            }
            self.frame_variable(key, declaration, &mut frame);
        }
        let mut result = None;
        if let Some(of) = &unit.result
            && let Some(resolved) = self.resolve(of)
        {
            let slot = self.take(&mut frame, &resolved, span)?;
            let variable = result_variable(&unit.name, Root::Frame(slot), resolved);
            result = Some(variable.place());
            frame.symbols.insert(unit.name.key(), Symbol::Variable(Rc::new(variable)));
        }
        if frame.next > MAXIMUM_FRAMES {
            let message = format!(
                "the variables of all functions take more than {} KiB",
                MAXIMUM_FRAMES / 128
            );
            self.error_with("U1048", message, span.clone(), "use smaller arrays");
            return None;
        }
        self.program.frames = frame.next;
        let id = RoutineId(self.program.routines.len() as u32);
        let name = match key.owner.method {
            Some(_) => format!("{}.{}", self.units[key.owner.unit].unit.name, unit.name),
            None => unit.name.as_str().to_owned(),
        };
        frame.initial.sort_by_key(|initial| initial.slot);
        let owner = &self.units[key.owner.unit];
        let is_standard = owner.is_library && is_body;
        let timer = is_standard.then(|| Timer::of(owner.unit.name.as_str())).flatten();
        self.program.routines.push(Lowered {
            name,
            kind: match has_memory {
                true => RoutineKind::Block,
                false => RoutineKind::Function,
            },
            frame: (start, frame.next - start),
            initial: frame.initial,
            body: Vec::new(),
            timer,
        });
        self.calls.push(Vec::new());
        Some(Routine { id, parameters: frame.parameters, result, symbols: Rc::new(frame.symbols) })
    }

    /// Takes slots of a frame for a variable.
    fn take(&mut self, frame: &mut Frame, resolved: &Resolved, span: &Span) -> Option<u32> {
        let slot = frame.next;
        let end = u64::from(slot) + resolved.of.slots();
        if end > u64::from(MAXIMUM_FRAMES) {
            self.too_large(end, span);
            return None;
        }
        frame.next = end as u32;
        frame.initial.extend(initial(&resolved.image, slot));
        Some(slot)
    }

    fn frame_variable(&mut self, key: &Key, declaration: &'a Declaration, frame: &mut Frame) {
        let name = &declaration.name;
        if !frame.own.insert(name.key()) {
            let message = format!("`{name}` is declared twice");
            let help = "remove or rename one of the declarations";
            self.error_with("U1042", message, name.span(), help);
            return;
        }
        let symbol = self.frame_symbol(key, declaration, frame);
        frame.symbols.insert(name.key(), symbol.unwrap_or(Symbol::Faulty));
    }

    /// Gives a retentive variable of a routine a path, by which `check` lists it and a changed program takes it over.
    fn name_static(&mut self, key: &Key, name: &Name, of: &Type, slot: u32) {
        let unit = self.units[key.owner.unit].unit.name.as_str();
        let method = key.owner.method.map(|_| self.unit_of(key.owner).name.as_str());
        let parts: Vec<&str> =
            [Some(unit), method, Some(name.as_str())].into_iter().flatten().collect();
        let path = parts.join(".");
        let is_taken = |path: &str| self.program.variables.iter().any(|known| known.name == path);
        // A routine with open arrays has a body, and memory, for each of their types.
        let mut unique = path.clone();
        let mut number = 1;
        while is_taken(&unique) {
            number += 1;
            unique = format!("{path}#{number}");
        }
        self.program.variables.push(Shown {
            name: unique,
            of: of.clone(),
            slot,
            address: None,
            description: None,
        });
    }

    fn frame_symbol(
        &mut self,
        key: &Key,
        declaration: &'a Declaration,
        frame: &mut Frame,
    ) -> Option<Symbol> {
        let name = &declaration.name;
        if declaration.class == Class::External {
            return Some(self.external(declaration));
        }
        if declaration.constant {
            let symbol = self.constant_symbol(Some(key.owner), declaration);
            if matches!(symbol, Symbol::Constant(_)) {
                return Some(symbol);
            }
        }
        if declaration.edge.is_some() {
            let message = "R_EDGE and F_EDGE need a memory, which a function does not have";
            let help = "use R_TRIG in a FUNCTION_BLOCK";
            self.error_with("U1040", message, name.span(), help);
            return None;
        }
        let is_open_input = declaration.class == Class::Input
            && matches!(declaration.of.kind, crate::syntax::TypeKind::OpenArray(..));
        let is_reference = declaration.class == Class::InOut;
        let (mut resolved, is_open) = if is_reference || is_open_input {
            self.reference_type(&declaration.of)?
        } else {
            (self.declared_type(declaration)?, false)
        };
        if is_open && let Some(of) = frame.open.next() {
            resolved = Resolved { range: resolved.range, ..of.into() };
        }
        if declaration.address.is_some() {
            return Some(self.located(declaration, &resolved));
        }
        let root = if is_reference {
            let slot = frame.next;
            frame.next += 1;
            Root::FrameReference(slot)
        } else if declaration.class == Class::Static {
            let slot = self.state(resolved.of.slots(), &name.span())?;
            self.program.initial.extend(initial(&resolved.image, slot));
            self.keep(declaration.retention, &resolved.of, slot);
            if self.program.retains(slot) {
                self.name_static(key, name, &resolved.of, slot);
            }
            Root::Global(slot)
        } else {
            Root::Frame(self.take(frame, &resolved, &name.span())?)
        };
        if let (
            Class::Input | Class::Output | Class::InOut,
            Root::Frame(slot) | Root::FrameReference(slot),
        ) = (declaration.class, root)
        {
            frame.parameters.push(Parameter {
                name: name.as_str().to_owned(),
                class: declaration.class,
                of: resolved.of.clone(),
                range: resolved.range,
                slot,
                is_open,
            });
        }
        Some(Symbol::Variable(Rc::new(Variable {
            name: name.as_str().to_owned(),
            root,
            of: resolved.of,
            class: declaration.class,
            is_constant: declaration.constant,
            is_point: false,
            range: resolved.range,
            span: name.span(),
        })))
    }

    /// Reports bodies that call themselves.
    pub(super) fn recursion(&mut self) {
        const NEW: u8 = 0;
        const OPEN: u8 = 1;
        const DONE: u8 = 2;
        let mut states = vec![NEW; self.calls.len()];
        let mut found: Vec<(u32, Range<usize>)> = Vec::new();
        for start in 0..self.calls.len() {
            if states[start] != NEW {
                continue;
            }
            states[start] = OPEN;
            let mut stack = vec![(start, 0)];
            while let Some((at, next)) = stack.last_mut() {
                let Some((callee, span)) = self.calls[*at].get(*next) else {
                    states[*at] = DONE;
                    stack.pop();
                    continue;
                };
                *next += 1;
                let to = *callee as usize;
                match states[to] {
                    NEW => {
                        states[to] = OPEN;
                        stack.push((to, 0));
                    }
                    OPEN => found.push((*callee, span.clone())),
                    _ => {}
                }
            }
        }
        for (callee, span) in found {
            let name = &self.program.routines[callee as usize].name;
            let message = format!("`{name}` calls itself, here or through what it calls");
            let help = "use a loop: memory must be known before the program runs";
            self.error_with("U1047", message, span, help);
        }
    }
}

/// Gives the open parameters of a block the types of this call.
fn open_members(frame: &mut Frame) {
    for parameter in &mut frame.parameters {
        if !parameter.is_open {
            continue;
        }
        let Some(of) = frame.open.next() else {
            return;
        };
        parameter.of = of.clone();
        let name = parameter.name.to_ascii_uppercase();
        if let Some(Symbol::Variable(variable)) = frame.symbols.get_mut(&name) {
            *variable = Rc::new(Variable {
                name: variable.name.clone(),
                root: variable.root,
                of,
                class: variable.class,
                is_constant: variable.is_constant,
                is_point: variable.is_point,
                range: variable.range,
                span: variable.span.clone(),
            });
        }
    }
}

fn result_variable(name: &Name, root: Root, resolved: Resolved) -> Variable {
    Variable {
        name: name.as_str().to_owned(),
        root,
        of: resolved.of,
        class: Class::Output,
        is_constant: false,
        is_point: false,
        range: resolved.range,
        span: name.span(),
    }
}
