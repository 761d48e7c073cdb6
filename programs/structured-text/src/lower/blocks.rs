//! The memory of programs and function blocks, and what can be called.

use std::collections::HashMap;
use std::rc::Rc;
use std::sync::Arc;

use understudy_typed::{Array, Field, Place, Root, RoutineId, Structure, Type};

use crate::syntax::{Class, Declaration, Retention, Span, TypeKind, TypeName, UnitKind};

use super::images::{Builder, Image};
use super::names::{Owner, Symbol, Variable};
use super::types::{Resolved, StructureInfo};
use super::{BlockState, Lowering};

/// A body and what it is lowered for.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub(super) struct Key {
    pub(super) owner: Owner,
    /// The block on whose instance it runs, perhaps one that extends that of the body.
    pub(super) class: Option<usize>,
    /// The types of parameters whose bounds are open.
    pub(super) open: Vec<Type>,
}

/// A body that can be called.
pub(super) struct Routine {
    pub(super) id: RoutineId,
    pub(super) parameters: Vec<Parameter>,
    /// The variable that holds the answer.
    pub(super) result: Option<Place>,
    pub(super) symbols: Rc<HashMap<String, Symbol>>,
}

/// An input or output of a block, a function or a method.
#[derive(Debug, Clone)]
pub(super) struct Parameter {
    pub(super) name: String,
    pub(super) class: Class,
    pub(super) of: Type,
    pub(super) range: Option<(i128, i128)>,
    /// Counted from the start of the block's memory, or of all frames.
    pub(super) slot: u32,
    /// Its type depends on what it is given.
    pub(super) is_open: bool,
}

impl Parameter {
    /// It, where its memory begins at a root.
    pub(super) fn place(&self, root: Root) -> Place {
        Place { range: self.range, ..Place::new(root, self.of.clone()) }
    }
}

/// A variable of a block.
#[derive(Clone)]
pub(super) struct Member {
    pub(super) class: Class,
    pub(super) description: Option<String>,
    pub(super) address: Option<String>,
    pub(super) symbol: Symbol,
}

/// An input with R_EDGE or F_EDGE.
#[derive(Debug, Clone, Copy)]
pub(super) struct Edge {
    pub(super) input: u32,
    /// Whether the edge is seen in this call.
    pub(super) seen: u32,
    pub(super) last: u32,
    pub(super) is_rising: bool,
}

/// The memory of a program or function block.
#[derive(Clone)]
pub(super) struct Block {
    pub(super) of: Type,
    pub(super) image: Image,
    /// By names in capitals.
    pub(super) members: HashMap<String, Member>,
    /// The members' names in capitals, those of the base first.
    pub(super) order: Vec<String>,
    pub(super) parameters: Vec<Parameter>,
    pub(super) edges: Vec<Edge>,
}

/// A block whose memory is being laid out.
struct Layout {
    fields: Vec<Field>,
    image: Builder,
    /// Bounds of the fields that are subranges, by their slots.
    ranges: HashMap<u32, (i128, i128)>,
    /// What is said of the fields' retention, by their slots.
    retention: HashMap<u32, Retention>,
    slots: u64,
    /// Slots that it may take.
    most: u64,
    block: Block,
}

impl Layout {
    fn add(&mut self, name: &str, resolved: &Resolved, is_reference: bool) -> u32 {
        let slot = self.slots.min(u64::from(u32::MAX)) as u32;
        self.slots += if is_reference { 1 } else { resolved.of.slots() };
        if !is_reference && self.slots <= self.most {
            self.image.put(u64::from(slot) * 64, &resolved.of, &resolved.image);
        }
        self.ranges.extend(resolved.range.map(|range| (slot, range)));
        self.fields.push(Field {
            name: name.to_owned(),
            of: resolved.of.clone(),
            slot,
            is_reference,
        });
        slot
    }
}

impl<'a> Lowering<'a> {
    /// The type of a block's instances.
    pub(super) fn block_type(&mut self, unit: usize, span: Span) -> Option<Resolved> {
        let found = self.units[unit].unit;
        if found.kind != UnitKind::FunctionBlock {
            let message = format!("`{}` is not a type: it is called, not declared", found.name);
            self.error("U1043", message, span);
            return None;
        }
        let block = self.block(unit, &span)?;
        Some(Resolved::new(block.of.clone(), block.image.clone()))
    }

    /// The memory of a program or function block.
    pub(super) fn block(&mut self, unit: usize, span: &Span) -> Option<Rc<Block>> {
        match &self.units[unit].block {
            BlockState::Done(block) => return Some(block.clone()),
            BlockState::Faulty => {
                self.blamed += 1;
                return None;
            }
            BlockState::Busy => {
                let name = &self.units[unit].unit.name;
                let message = format!("the block `{name}` contains itself");
                self.error("U1047", message, span.clone());
                return None;
            }
            BlockState::New => {}
        }
        self.units[unit].block = BlockState::Busy;
        let outside = self.leave_unit();
        self.scope.unit = Some(unit);
        let block = self.deeper(span, |own| own.layout(unit)).map(Rc::new);
        self.scope = outside;
        self.units[unit].block = match &block {
            Some(block) => BlockState::Done(block.clone()),
            None => BlockState::Faulty,
        };
        block
    }

    fn layout(&mut self, unit: usize) -> Option<Block> {
        let found = self.units[unit].unit;
        let mut layout = Layout {
            fields: Vec::new(),
            image: Builder::default(),
            ranges: HashMap::new(),
            retention: HashMap::new(),
            slots: 0,
            most: self.most,
            block: Block {
                of: Type::Text(1),
                image: super::images::zero(),
                members: HashMap::new(),
                order: Vec::new(),
                parameters: Vec::new(),
                edges: Vec::new(),
            },
        };
        if let Some(name) = &found.extends {
            let base = self.base_of(unit);
            let is_block = |base: &usize| self.units[*base].unit.kind == UnitKind::FunctionBlock;
            let Some(base) = base.filter(is_block) else {
                let message = format!("the block `{name}` to extend is not declared");
                self.error("U1041", message, name.span());
                return None;
            };
            let base = self.block(base, &name.span())?;
            let Type::Structure(id, slots) = base.of else {
                return None;
            };
            layout.fields = self.program.structures[id.0 as usize].fields.clone();
            layout.ranges = self.structures[id.0 as usize].ranges.clone();
            layout.retention = self.structures[id.0 as usize].retention.clone();
            layout.image = Builder::of(&base.image);
            layout.slots = u64::from(slots);
            layout.block = (*base).clone();
        }
        for declaration in &found.declarations {
            if declaration.class != Class::Temporary {
                self.member(unit, declaration, &mut layout);
            }
        }
        if layout.slots > self.most {
            self.too_large(layout.slots, &found.name.span());
            return None;
        }
        let fields = layout.fields.iter().enumerate();
        let fields = fields.map(|(at, field)| (field.name.to_ascii_uppercase(), at));
        let image = layout.image.done();
        let info = StructureInfo {
            fields: fields.collect(),
            ranges: layout.ranges,
            retention: layout.retention,
            is_mixed: false,
            unit: Some(unit),
        };
        let structure = Structure { name: found.name.as_str().to_owned(), fields: layout.fields };
        let id = self.add_structure(structure, info);
        Some(Block { of: Type::Structure(id, layout.slots as u32), image, ..layout.block })
    }

    fn member(&mut self, unit: usize, declaration: &'a Declaration, layout: &mut Layout) {
        let key = declaration.name.key();
        if layout.block.members.contains_key(&key) {
            let name = &declaration.name;
            let mut others = self.units[unit].unit.declarations.iter();
            let other = others.find(|other| other.name == *name);
            let message = match other.filter(|other| other.name.as_str() != name.as_str()) {
                Some(other) => {
                    format!("`{}` and `{name}` are one name, and both are declared", other.name)
                }
                None => format!("`{name}` is declared twice"),
            };
            let help = "remove or rename one of them; a block has the variables of its base";
            self.error_with("U1042", message, declaration.name.span(), help);
            return;
        }
        let symbol = self.member_symbol(unit, declaration, layout);
        let member = Member {
            class: declaration.class,
            description: declaration.description.clone(),
            address: declaration.address.as_ref().map(|found| found.as_str().to_owned()),
            symbol,
        };
        layout.block.members.insert(key.clone(), member);
        layout.block.order.push(key);
    }

    fn member_symbol(
        &mut self,
        unit: usize,
        declaration: &'a Declaration,
        layout: &mut Layout,
    ) -> Symbol {
        // One that is called is as a block is.
        let is_program =
            self.units[unit].unit.kind == UnitKind::Program && self.running.contains(&unit);
        if declaration.class == Class::External {
            return self.external(declaration);
        }
        if declaration.constant {
            let owner = Owner { unit, method: None };
            let symbol = self.constant_symbol(Some(owner), declaration);
            if matches!(symbol, Symbol::Constant(_)) {
                return symbol;
            }
        }
        // The VAR_IN_OUT of a PROGRAM is given no variable, and is one of its own.
        let is_reference = declaration.class == Class::InOut && !is_program;
        if declaration.class == Class::InOut && is_program {
            let message = format!(
                "nothing gives the VAR_IN_OUT `{}` of a PROGRAM a variable: it is one of its own",
                declaration.name
            );
            let help = "declare it as VAR, or as VAR_GLOBAL";
            self.warn("U1055", message, declaration.name.span(), help);
        }
        let found = if is_reference {
            self.reference_type(&declaration.of)
        } else {
            self.declared_type(declaration).map(|found| (found, false))
        };
        let Some((resolved, is_open)) = found else {
            return Symbol::Faulty;
        };
        if declaration.address.is_some() {
            return self.located(declaration, &resolved);
        }
        let name = declaration.name.as_str();
        let slot = layout.add(name, &resolved, is_reference);
        let retention = match declaration.class {
            // A scan samples it.
            Class::Input if is_program => Retention::NotRetained,
            _ => declaration.retention,
        };
        if retention != Retention::Unstated {
            layout.retention.insert(slot, retention);
        }
        let mut root = if is_reference { Root::OwnReference(slot) } else { Root::Own(slot) };
        if let Some(is_rising) = declaration.edge {
            let hidden: Resolved = Type::Elementary(understudy_typed::Elementary::Bool).into();
            if resolved.of != hidden.of {
                let message = "R_EDGE and F_EDGE are for inputs of type BOOL";
                self.error("U1043", message, declaration.name.span());
                return Symbol::Faulty;
            }
            let seen = layout.add(&format!("{name}.edge"), &hidden, false);
            let last = layout.add(&format!("{name}.last"), &hidden, false);
            root = Root::Own(seen);
            layout.block.edges.push(Edge { input: slot, seen, last, is_rising });
        }
        let is_parameter = match declaration.class {
            Class::Input | Class::Output => true,
            Class::InOut => is_reference,
            _ => false,
        };
        if is_parameter {
            layout.block.parameters.push(Parameter {
                name: name.to_owned(),
                class: declaration.class,
                of: resolved.of.clone(),
                range: resolved.range,
                slot,
                is_open,
            });
        }
        Symbol::Variable(Rc::new(Variable {
            name: name.to_owned(),
            root,
            of: resolved.of,
            class: declaration.class,
            is_constant: declaration.constant,
            is_point: is_program && declaration.class == Class::Input,
            range: resolved.range,
            span: declaration.name.span(),
        }))
    }

    /// The type of a VAR_IN_OUT, and whether it depends on what is given.
    pub(super) fn reference_type(&mut self, of: &TypeName) -> Option<(Resolved, bool)> {
        match &of.kind {
            TypeKind::OpenArray(dimensions, element) => {
                let Resolved { of: element, range, .. } = self.resolve(element)?;
                let array = Array { ranges: vec![(0, 0); (*dimensions).clamp(1, 16)], element };
                let resolved = Resolved::from(Type::Array(Arc::new(array)));
                Some((Resolved { range, ..resolved }, true))
            }
            TypeKind::Text { .. } => Some((self.resolve(of)?, true)),
            _ => Some((self.resolve(of)?, false)),
        }
    }

    /// A VAR_EXTERNAL of a library, whose VAR_GLOBAL stands in the programs that use it.
    fn assumed(&mut self, declaration: &Declaration) -> Symbol {
        let name = &declaration.name;
        let found = self.resolve(&declaration.of);
        let slot = found.as_ref().and_then(|found| self.state(found.of.slots(), &name.span()));
        let symbol = match (found, slot) {
            (Some(found), Some(slot)) => Symbol::Variable(Rc::new(Variable {
                name: name.as_str().to_owned(),
                root: Root::Global(slot),
                of: found.of,
                class: Class::Global,
                is_constant: declaration.constant,
                is_point: false,
                range: found.range,
                span: name.span(),
            })),
            _ => Symbol::Faulty,
        };
        self.globals.insert(name.key(), symbol.clone());
        symbol
    }

    /// A VAR_EXTERNAL is the global variable of its name.
    pub(super) fn external(&mut self, declaration: &Declaration) -> Symbol {
        let name = &declaration.name;
        let Some(found) = self.global(&name.key()) else {
            if self.is_library {
                return self.assumed(declaration);
            }
            let message = format!("`{name}` is VAR_EXTERNAL, and no VAR_GLOBAL has that name");
            let help = "declare it with VAR_GLOBAL in the file";
            self.error_with("U1041", message, name.span(), help);
            return Symbol::Faulty;
        };
        let of = match &found {
            Symbol::Variable(variable) => variable.of.clone(),
            Symbol::Constant(constant) => constant.expression().of,
            Symbol::Faulty => {
                self.blamed += 1;
                return Symbol::Faulty;
            }
        };
        match self.resolve(&declaration.of) {
            Some(resolved) if resolved.of != of => {
                let (own, global) = (self.describe(&resolved.of), self.describe(&of));
                let is_text = matches!((&resolved.of, &of), (Type::Text(_), Type::Text(_)));
                if !is_text {
                    let message = format!("`{name}` is {own} here and {global} in VAR_GLOBAL");
                    self.error("U1043", message, name.span());
                    return Symbol::Faulty;
                }
                found
            }
            Some(_) => found,
            None => Symbol::Faulty,
        }
    }
}
