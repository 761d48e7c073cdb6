//! Declarations: types, variables as cells, instances of blocks.

use std::ops::Range;

use understudy_ladder::{Address, Area, Name, parse_address};
use understudy_text::Diagnostic;

use super::super::program::{Cell, Kind, Number, Role, Timer, Truth};
use super::super::syntax::{Class, Declaration, Expression, UnitKind};
use super::expression::Value;
use super::types::{STANDARD, Type, inputs, is_timer, outputs};
use super::uses::{Uses, uses};
use super::{Entity, Instance, MAXIMUM_INSTANCES, Resolver};

impl Resolver {
    /// Makes the cells of a unit; instances of blocks come last, since their presets may be constants of the unit.
    pub(super) fn instantiate(&mut self, unit: usize, path: String, exclusive: bool) -> usize {
        let number = self.instances.len();
        let content = self.units[unit].clone();
        self.count_step(&content.name.span());
        if number >= MAXIMUM_INSTANCES {
            self.give_up(
                format!("the program has more than {MAXIMUM_INSTANCES} instances"),
                content.name.span(),
            );
        }
        self.instances.push(Instance {
            unit,
            path,
            uses: uses(&content.body),
            exclusive,
            ..Instance::default()
        });
        self.stack.push(unit);
        let blame = self.blame.clone();
        if !content.foreign {
            self.blame = None;
        }
        if let Some(result) = &content.result {
            let result = Declaration {
                name: content.name.clone(),
                class: Class::Local,
                constant: false,
                temporary: true,
                address: None,
                type_name: result.clone(),
                initial: None,
                description: None,
            };
            self.declare(number, &result, false);
        }
        for blocks in [false, true] {
            for declaration in &content.declarations {
                self.declare(number, declaration, blocks);
            }
        }
        self.blame = blame;
        self.stack.pop();
        number
    }

    fn declare(&mut self, instance: usize, declaration: &Declaration, blocks: bool) {
        if self.is_full {
            return;
        }
        if declaration.class == Class::External {
            if !blocks {
                self.declare_external(instance, declaration);
            }
            return;
        }
        let found = self
            .types
            .known
            .get(&declaration.type_name.name.to_ascii_uppercase());
        let is_block = found.is_none() && {
            let key = declaration.type_name.name.to_ascii_uppercase();
            self.by_name.contains_key(&key) || STANDARD.contains(&key.as_str())
        };
        if is_block != blocks {
            return;
        }
        let found = self.type_of(&declaration.type_name);
        if let (Some(address), Some(Type::Time | Type::Block(_) | Type::Standard(_))) =
            (&declaration.address, &found)
        {
            let message = format!(
                "the address `%{address}` of `{}` is not kept",
                declaration.name
            );
            self.say(Diagnostic::warning("U1055", message, address.span()));
        }
        let entity = match found {
            None => Entity::Broken,
            Some(Type::Time) => Entity::Time(self.initial_time(instance, declaration)),
            Some(Type::Elementary(kind)) => self.declare_variable(instance, declaration, kind),
            Some(Type::Block(unit)) => self.declare_block(instance, declaration, unit),
            Some(Type::Standard(word)) => self.declare_standard(instance, declaration, word),
        };
        self.define(instance, &declaration.name, entity);
    }

    fn define(&mut self, instance: usize, name: &Name, entity: Entity) {
        let entities = &mut self.instances[instance].entities;
        if entities.insert(name.to_ascii_uppercase(), entity).is_none() {
            return;
        }
        let unit = &self.units[self.instances[instance].unit];
        let first = unit
            .declarations
            .iter()
            .map(|declaration| &declaration.name);
        let mut first =
            first.filter(|first| first.eq_ignore_ascii_case(name) && first.span() != name.span());
        let finding = match first.next() {
            Some(first) if first.as_str() != name.as_str() => {
                let message = format!("`{first}` and `{name}` are one name, and both are declared");
                Diagnostic::error("U1042", message, name.span())
                    .with_related(first.span(), "the other one")
                    .with_help(
                        "names of IEC 61131-3 do not distinguish case; rename one of the two",
                    )
            }
            Some(first) => {
                let message = format!("`{name}` is declared twice");
                Diagnostic::error("U1042", message, name.span())
                    .with_related(first.span(), "the other one")
            }
            None => Diagnostic::error("U1042", format!("`{name}` is declared twice"), name.span()),
        };
        self.say(finding);
    }

    fn declare_external(&mut self, instance: usize, declaration: &Declaration) {
        let key = declaration.name.to_ascii_uppercase();
        if let Some(entity) = self.global_cells.get(&key) {
            let entity = entity.clone();
            self.define(instance, &declaration.name, entity);
            return;
        }
        let mut globals = self.globals.iter();
        let global = globals.find(|global| global.name.eq_ignore_ascii_case(&declaration.name));
        // Without its configuration, the declaration is all there is.
        let global = global.unwrap_or(declaration).clone();
        let as_local = Declaration {
            class: Class::Local,
            ..global
        };
        let entity = match self.type_of(&as_local.type_name) {
            Some(Type::Elementary(kind)) => self.declare_variable(instance, &as_local, kind),
            Some(Type::Time) => Entity::Time(self.initial_time(instance, &as_local)),
            Some(Type::Block(_) | Type::Standard(_)) => {
                let message = format!(
                    "`{}` is a block that several programs share, which is not supported",
                    declaration.name
                );
                self.error("U1040", message, declaration.name.span());
                Entity::Broken
            }
            None => Entity::Broken,
        };
        self.global_cells.insert(key, entity.clone());
        self.define(instance, &declaration.name, entity);
    }

    pub(super) fn path_of(&self, instance: usize, name: &str) -> String {
        let around = &self.instances[instance].path;
        if around.is_empty() {
            name.to_owned()
        } else {
            format!("{around}.{name}")
        }
    }

    fn initial_time(
        &mut self,
        instance: usize,
        declaration: &Declaration,
    ) -> Option<std::time::Duration> {
        // An input gets its time from the call.
        match &declaration.initial {
            None => (declaration.class != Class::Input).then_some(std::time::Duration::ZERO),
            Some(initial) => match self.expression(instance, initial) {
                Value::Time(time) => time,
                Value::Error => None,
                _ => {
                    let message = format!(
                        "`{}` is a time, and begins with something else",
                        declaration.name
                    );
                    self.error("U1043", message, initial.span.clone());
                    None
                }
            },
        }
    }

    fn initial(&mut self, instance: usize, initial: &Expression, kind: Kind) -> Option<i64> {
        let value = match (self.expression(instance, initial), kind) {
            (Value::Error, _) => return None,
            (Value::Truth(Truth::Constant(value)), Kind::Truth) => Some(i64::from(value)),
            (Value::Number(Number::Constant(value @ (0 | 1))), Kind::Truth) => Some(value),
            (Value::Number(number), Kind::Number { declared, .. }) => number
                .constant()
                .filter(|value| (declared.0..=declared.1).contains(value)),
            _ => None,
        };
        if value.is_none() {
            let message = "the value is not a constant of the variable's type and range";
            self.error("U1043", message, initial.span.clone());
        }
        value
    }

    fn declare_variable(
        &mut self,
        instance: usize,
        declaration: &Declaration,
        kind: Kind,
    ) -> Entity {
        let name = &declaration.name;
        let given = declaration.initial.as_ref();
        let mut initial = given.and_then(|given| self.initial(instance, given, kind));
        if let (Kind::Number { declared, .. }, None) = (kind, initial) {
            // 0, or what is nearest to it, as the standard has it.
            initial = Some(0.clamp(declared.0, declared.1));
        }
        let initial = initial.unwrap_or(0);
        if declaration.constant {
            return match kind {
                Kind::Truth => Entity::Truth(initial == 1),
                Kind::Number { .. } => Entity::Number(initial),
            };
        }
        if declaration.class == Class::InOut {
            let message =
                format!("`{name}` is passed by reference (VAR_IN_OUT), which is not supported");
            self.error("U1040", message, name.span());
            return Entity::Broken;
        }
        let is_program = instance == 0 && self.units[0].kind == UnitKind::Program;
        let address = declaration
            .address
            .as_ref()
            .and_then(|address| self.address(address, kind));
        // One bit may have several names.
        if let Some(known) = address.as_ref().and_then(|address| self.cell_at(address)) {
            let message = format!(
                "`{name}` as a second name of `{}`, whose address it has, is not kept",
                self.program.cells[known].name
            );
            self.say(Diagnostic::warning("U1055", message, name.span()));
            return Entity::Cell(known);
        }
        let located =
            declaration
                .address
                .as_ref()
                .and_then(|address| match address.as_bytes().first() {
                    Some(b'I') => Some(Role::Input),
                    Some(b'Q') => Some(Role::Output),
                    _ => None,
                });
        let role = match declaration.class {
            _ if !is_program && declaration.address.is_none() => {
                self.role_of_block(instance, declaration.class)
            }
            Class::Input => Role::Input,
            Class::Output => Role::Output,
            _ => located.unwrap_or(Role::Memory),
        };
        if role == Role::Input && given.is_some() && initial != 0 {
            let message = format!(
                "the initial value of the input `{name}` is not kept: an input is what is read"
            );
            self.say(Diagnostic::warning("U1055", message, name.span()));
        }
        let wanted = self.path_of(instance, name);
        let cell = Cell {
            name: self.unique(&wanted),
            kind,
            role,
            initial,
            is_given: given.is_some(),
            address,
            description: declaration.description.clone(),
        };
        Entity::Cell(self.add_cell(cell, name.span()))
    }

    /// A block that is lowered by itself shows its inputs and outputs; one in a program keeps them to itself.
    fn role_of_block(&self, instance: usize, class: Class) -> Role {
        match class {
            Class::Input if instance == 0 => Role::Input,
            Class::Output if instance == 0 => Role::Output,
            _ => Role::Memory,
        }
    }

    /// The address of a bit; that of a number or of a byte is not kept, which is said.
    fn address(&mut self, address: &Name, kind: Kind) -> Option<Address> {
        if kind == Kind::Truth {
            let found = parse_address(address);
            if found.is_none() {
                let message = format!("`%{address}` is not the address of a bit");
                let finding = Diagnostic::error("U1036", message, address.span());
                self.say(finding.with_help("addresses look like %IX0.3, %QX1.0 or %MX2.7"));
            }
            return found;
        }
        let message = format!("the address `%{address}` of a number is not kept");
        self.say(Diagnostic::warning("U1055", message, address.span()));
        None
    }

    fn cell_at(&self, address: &Address) -> Option<usize> {
        let mut cells = self.program.cells.iter();
        cells.position(|cell| cell.address.as_ref() == Some(address))
    }

    /// The cell behind an address in a body; it is made where no variable has it.
    pub(super) fn direct(&mut self, address: &Name) -> Option<usize> {
        let text = address.trim_start_matches('%');
        let Some(found) = parse_address(text) else {
            let message = format!("`{address}` is not the address of a bit");
            self.error("U1036", message, address.span());
            return None;
        };
        if let Some(known) = self.cell_at(&found) {
            return Some(known);
        }
        let role = match found.area {
            Area::Input => Role::Input,
            Area::Output => Role::Output,
            Area::Memory => Role::Memory,
        };
        let cell = Cell {
            name: self.unique(&text.replace('.', "_")),
            kind: Kind::Truth,
            role,
            initial: 0,
            is_given: false,
            address: Some(found),
            description: None,
        };
        Some(self.add_cell(cell, address.span()))
    }

    fn uses_of(&self, instance: usize, name: &str) -> Uses {
        let uses = &self.instances[instance].uses;
        uses.get(&name.to_ascii_uppercase())
            .cloned()
            .unwrap_or_default()
    }

    fn declare_block(&mut self, instance: usize, declaration: &Declaration, unit: usize) -> Entity {
        if self.stack.contains(&unit) {
            let message = format!("the block `{}` contains itself", declaration.type_name.name);
            self.error("U1047", message, declaration.type_name.name.span());
            return Entity::Broken;
        }
        let uses = self.uses_of(instance, &declaration.name);
        let exclusive = self.instances[instance].exclusive && uses.calls <= 1 && !uses.conditional;
        let path = self.path_of(instance, &declaration.name);
        let blame = self.blame.clone();
        if self.units[unit].foreign && self.blame.is_none() {
            self.blame = Some(declaration.name.span());
        }
        let made = self.instantiate(unit, path, exclusive);
        self.blame = blame;
        Entity::Instance(made)
    }

    fn declare_standard(
        &mut self,
        instance: usize,
        declaration: &Declaration,
        word: &'static str,
    ) -> Entity {
        let uses = self.uses_of(instance, &declaration.name);
        let exclusive = self.instances[instance].exclusive && uses.calls <= 1 && !uses.conditional;
        let is_counter = inputs(word).contains(&"PV");
        let preset = uses.preset.as_ref().filter(|_| is_counter);
        let preset = preset.and_then(|preset| self.constant(instance, preset));
        let has_preset =
            preset.is_some_and(|preset| (0..=super::uses::MAXIMUM_COMPARED).contains(&preset));
        let fits = exclusive
            && !uses.counts
            && !uses.touched.contains("PV")
            && (has_preset || !is_counter);
        if !is_timer(word) && !fits {
            let unit = self.by_name[word];
            return self.declare_block(instance, declaration, unit);
        }
        let wanted = self.path_of(instance, &declaration.name);
        let path = self.unique(&wanted);
        let made = self.instances.len();
        self.instances.push(Instance {
            native: Some(word),
            path: path.clone(),
            exclusive,
            ..Instance::default()
        });
        let span = declaration.name.span();
        if is_timer(word) && !exclusive {
            let started = self.add_bit(format!("{path}.started"), Role::Memory, &span);
            let output = self.add_bit(format!("{path}.Q"), Role::Held, &span);
            self.instances[made].timer = Some(self.program.timers.len());
            self.instances[made]
                .entities
                .insert("Q".into(), Entity::Cell(output));
            self.program.timers.push(Timer {
                name: path.clone(),
                word,
                started,
                output,
            });
        } else {
            for pin in outputs(word) {
                self.add_pin(made, &path, pin, Role::Pin, &span);
            }
        }
        for pin in inputs(word)
            .iter()
            .filter(|pin| !matches!(**pin, "PT" | "PV"))
        {
            if uses.touched.contains(*pin) {
                self.add_pin(made, &path, pin, Role::Memory, &span);
            }
        }
        if is_counter {
            let entities = &mut self.instances[made].entities;
            entities.insert("CV".into(), Entity::Counter(path));
        }
        Entity::Instance(made)
    }

    fn add_pin(&mut self, instance: usize, path: &str, pin: &str, role: Role, span: &Range<usize>) {
        // A contact reads an output by the names of the block and of the pin; an input is a bit of its own.
        let name = match role {
            Role::Pin => format!("{path}.{pin}"),
            _ => format!("{path}_{pin}"),
        };
        let cell = self.add_bit(name, role, span);
        self.instances[instance]
            .entities
            .insert(pin.to_owned(), Entity::Cell(cell));
    }

    /// A bit of a block, which begins with 0.
    pub(super) fn add_bit(&mut self, name: String, role: Role, span: &Range<usize>) -> usize {
        let cell = Cell {
            name: if role == Role::Pin {
                name
            } else {
                self.unique(&name)
            },
            kind: Kind::Truth,
            role,
            initial: 0,
            is_given: false,
            address: None,
            description: None,
        };
        self.add_cell(cell, span.clone())
    }
}
