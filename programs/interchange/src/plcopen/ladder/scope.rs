//! The variables of a program and what becomes of each: an input, an output, a memory bit, a constant, a block.

use std::cell::RefCell;
use std::collections::{HashMap, HashSet};
use std::time::Duration;
use understudy_text::spelling;

use understudy_ladder::{Address, Area, KEYWORDS, Name, Signal, legal_name, parse_address};
use understudy_text::Diagnostic;

use crate::plcopen::document::{Ignored, Pou, Project, Section, Variable, VariableType};
use crate::plcopen::literal::{boolean, integer, time};
use crate::plcopen::standard::StandardBlock;

/// The meaning of a name.
#[derive(Debug, Clone)]
pub(super) enum Binding {
    /// A bit, by its name in the ladder.
    Bit(String),
    /// A time that nothing writes.
    Time(Duration),
    /// A whole number that nothing writes.
    Number(i64),
    /// An instance of a standard block, by its name in the ladder.
    Instance(String),
    /// Something else, in words.
    Other(String),
}

/// The variables of one program.
pub(super) struct Scope<'a> {
    variables: Vec<&'a Variable>,
    /// By name in capitals: names of IEC 61131-3 do not differ by case.
    bindings: HashMap<String, Binding>,
    /// Bits by address, of which several names may stand for one.
    located: RefCell<HashMap<String, String>>,
    /// Bits that are named by their address only, in the order of their first use.
    direct: RefCell<Vec<(String, Address, Name)>>,
    taken: RefCell<HashSet<String>>,
    /// Second names of one address: they need no signal.
    aliases: HashSet<String>,
    /// Names in capitals that something has asked for.
    used: RefCell<HashSet<String>>,
}

impl<'a> Scope<'a> {
    pub(super) fn new(pou: &'a Pou, project: &'a Project) -> Self {
        let globals = &project.globals;
        let mut scope = Self {
            variables: Vec::new(),
            bindings: HashMap::new(),
            located: RefCell::default(),
            direct: RefCell::default(),
            taken: RefCell::default(),
            aliases: HashSet::new(),
            used: RefCell::default(),
        };
        for variable in &pou.variables {
            let global =
                globals.iter().find(|global| global.name.eq_ignore_ascii_case(&variable.name));
            match (variable.section, global) {
                (Section::External, Some(global)) => scope.declare(global),
                _ => scope.declare(variable),
            }
        }
        // An input or output of the configuration that no unit names is one of each program.
        let is_named = |global: &Variable| {
            let mut variables = project.pous.iter().flat_map(|pou| &pou.variables);
            variables.any(|known| {
                known.section == Section::External && known.name.eq_ignore_ascii_case(&global.name)
            })
        };
        for global in globals.iter().filter(|global| is_wired(global) && !is_named(global)) {
            scope.declare(global);
        }
        scope
    }

    /// Whether only the program itself can read a variable that it declares.
    pub(super) fn is_private(&self, name: &Name) -> bool {
        let mut variables = self.variables.iter();
        let found = variables.find(|variable| variable.name.eq_ignore_ascii_case(name));
        found.is_some_and(|variable| {
            matches!(variable.section, Section::Local | Section::Temporary)
                && variable.address.is_none()
        })
    }

    /// The declared outputs that are no bits.
    pub(super) fn outputs_of_numbers(&self) -> Vec<&'a Variable> {
        let is_bit = |variable: &&Variable| {
            let binding = self.bindings.get(&variable.name.to_uppercase());
            matches!(binding, Some(Binding::Bit(_)))
        };
        let outputs = self.variables.iter().copied();
        outputs.filter(|variable| is_output(variable) && !is_bit(variable)).collect()
    }

    fn declare(&mut self, variable: &'a Variable) {
        let key = variable.name.to_uppercase();
        if self.bindings.contains_key(&key) {
            return;
        }
        let initial = variable.initial.as_deref();
        let binding = match &variable.kind {
            kind if kind.is_bool() => {
                let address = variable.address.as_ref().and_then(|address| bit_address(address));
                let known = address
                    .as_ref()
                    .and_then(|address| self.located.borrow().get(&address.to_string()).cloned());
                let alias = known.is_some();
                let name = known.unwrap_or_else(|| self.fresh(&variable.name));
                if let Some(address) = address {
                    self.located.borrow_mut().insert(address.to_string(), name.clone());
                }
                if alias {
                    self.aliases.insert(key.clone());
                }
                Binding::Bit(name)
            }
            VariableType::Elementary(kind) if is_given(variable) => Binding::Other(kind.clone()),
            VariableType::Elementary(kind) if kind == "TIME" => {
                match time(initial.unwrap_or("T#0s")) {
                    Some(time) => Binding::Time(time),
                    None => Binding::Other("a TIME".to_owned()),
                }
            }
            VariableType::Elementary(kind) if kind.ends_with("INT") => {
                match integer(initial.unwrap_or("0")) {
                    Some(number) => Binding::Number(number),
                    None => Binding::Other(kind.clone()),
                }
            }
            VariableType::Derived(kind) if StandardBlock::of(kind).is_some() => {
                Binding::Instance(self.fresh(&variable.name))
            }
            VariableType::Derived(kind) => Binding::Other(kind.to_string()),
            VariableType::Elementary(kind) | VariableType::Foreign(kind) => {
                Binding::Other(kind.clone())
            }
            VariableType::Range(kind, lower, upper) => {
                Binding::Other(format!("{kind} ({lower}..{upper})"))
            }
        };
        self.bindings.insert(key, binding);
        self.variables.push(variable);
    }

    /// A bit that the reader has made.
    pub(super) fn declare_bit(&mut self, name: &str) {
        let binding = Binding::Bit(name.to_owned());
        self.bindings.insert(name.to_uppercase(), binding);
    }

    /// The meaning of a name; an address means a bit.
    pub(super) fn find(&self, name: &Name) -> Option<Binding> {
        let name_text = name.trim();
        let key = name_text.to_uppercase();
        if let Some(binding) = self.bindings.get(&key) {
            self.used.borrow_mut().insert(key);
            return Some(binding.clone());
        }
        let address = bit_address(name_text)?;
        let key = address.to_string();
        if let Some(bit) = self.located.borrow().get(&key) {
            return Some(Binding::Bit(bit.clone()));
        }
        let wanted = key.trim_start_matches('%').replace('.', "_");
        let bit = self.fresh(&wanted);
        self.located.borrow_mut().insert(key, bit.clone());
        self.direct.borrow_mut().push((bit.clone(), address, name.clone()));
        Some(Binding::Bit(bit))
    }

    /// The instance of a standard block that the file does not declare.
    pub(super) fn declare_instance(&mut self, name: &Name) -> String {
        let key = name.to_uppercase();
        if let Some(Binding::Instance(known)) = self.bindings.get(&key) {
            return known.clone();
        }
        let fresh = self.fresh(name);
        self.bindings.insert(key, Binding::Instance(fresh.clone()));
        fresh
    }

    pub(super) fn nearest(&self, name: &str) -> Option<&str> {
        let variables = self.variables.iter();
        spelling::nearest(name, variables.map(|variable| variable.name.as_str()))
    }

    pub(super) fn program_name(&self, pou: &Pou) -> Name {
        let name = legal(&pou.name);
        let name = if KEYWORDS.contains(&name.as_str()) { format!("{name}_") } else { name };
        Name::at(name, pou.name.span())
    }

    /// A name of the ladder that nothing has yet, as near to the wanted one as can be.
    pub(super) fn fresh(&self, wanted: &str) -> String {
        let legal = legal(wanted);
        let mut taken = self.taken.borrow_mut();
        let mut name = legal.clone();
        let mut count = 2;
        while KEYWORDS.contains(&name.as_str()) || !taken.insert(name.to_uppercase()) {
            name = format!("{legal}_{count}");
            count += 1;
        }
        name
    }

    /// The inputs, outputs and memory bits in the order of their declaration.
    pub(super) fn signals(
        &self,
        ignored: &mut Vec<Ignored>,
        diagnostics: &mut Vec<Diagnostic>,
    ) -> (Vec<Signal>, Vec<Signal>, Vec<Signal>) {
        let (mut inputs, mut outputs, mut memory) = (Vec::new(), Vec::new(), Vec::new());
        for variable in &self.variables {
            let mut ignore =
                |what: String| ignored.push(Ignored { what, span: variable.name.span() });
            if variable.retain {
                ignore(format!("the retention of `{}` over a loss of power", variable.name));
            }
            let key = variable.name.to_uppercase();
            let name = match self.bindings.get(&key) {
                Some(Binding::Bit(name)) => name,
                None => continue,
                Some(_) => {
                    if !self.used.borrow().contains(&key) {
                        let kind = variable.kind.text();
                        ignore(format!("`{}`, a {kind} that nothing uses,", variable.name));
                    }
                    continue;
                }
            };
            if self.aliases.contains(&key) {
                ignore(format!(
                    "`{}` as a second name of `{name}`, whose address it has,",
                    variable.name
                ));
                continue;
            }
            if *name != variable.name.as_str() {
                ignore(format!("the name `{}`, which is `{name}` here,", variable.name));
            }
            let address = match &variable.address {
                None => None,
                Some(text) => {
                    let address = bit_address(text);
                    if address.is_none() {
                        let message = format!("`{text}` is not the address of a bit");
                        diagnostics.push(
                            Diagnostic::error("U1011", message, text.span())
                                .with_help("addresses look like %IX0.3, %QX1.0 or %MX2.7"),
                        );
                    }
                    address
                }
            };
            let initial = variable.initial.as_ref().and_then(|text| {
                let value = boolean(text);
                if value.is_none() {
                    let message = format!("invalid initial value `{text}` of a BOOL");
                    diagnostics.push(Diagnostic::error("U1011", message, text.span()));
                }
                value
            });
            let mut signal = Signal {
                name: Name::at(name.as_str(), variable.name.span()),
                initial,
                description: variable.documentation.clone(),
                ..Signal::default()
            };
            let area = address.as_ref().map(|address| address.area);
            signal.address = address;
            match (area, variable.section) {
                (Some(Area::Input), _) | (None, Section::Input) => {
                    if signal.initial.take().is_some() {
                        ignore(format!("the initial value of the input `{name}`"));
                    }
                    inputs.push(signal);
                }
                (Some(Area::Output), _) | (_, Section::Output) => outputs.push(signal),
                _ => memory.push(signal),
            }
        }
        for (name, address, place) in self.direct.borrow().iter() {
            let signal = Signal {
                name: Name::at(name.as_str(), place.span()),
                address: Some(address.clone()),
                ..Signal::default()
            };
            match address.area {
                Area::Input => inputs.push(signal),
                Area::Output => outputs.push(signal),
                Area::Memory => memory.push(signal),
            }
        }
        (inputs, outputs, memory)
    }
}

/// Whether its value comes from outside, so that it is not a constant.
fn is_given(variable: &Variable) -> bool {
    let located = variable.address.as_ref();
    matches!(variable.section, Section::Input | Section::InOut)
        || located.is_some_and(|address| address.to_ascii_uppercase().starts_with("%I"))
}

/// Whether the world reads it.
fn is_output(variable: &Variable) -> bool {
    match area(variable).as_deref() {
        Some("%Q") => true,
        Some("%I") => false,
        _ => variable.section == Section::Output,
    }
}

/// Whether a variable is at the address of an input or an output.
fn is_wired(variable: &Variable) -> bool {
    matches!(area(variable).as_deref(), Some("%I" | "%Q"))
}

/// The beginning of an address, in capitals.
fn area(variable: &Variable) -> Option<String> {
    let address = variable.address.as_ref()?.trim();
    Some(address.get(..2)?.to_ascii_uppercase())
}

/// `%IX0.3`, in any case.
fn bit_address(text: &str) -> Option<Address> {
    parse_address(&text.trim().strip_prefix('%')?.to_ascii_uppercase())
}

/// A name of the ladder without dots, and with room for a number.
fn legal(wanted: &str) -> String {
    legal_name(&wanted.trim().replace('.', "_"))
}
