//! Declarations as signals and blocks of a ladder.

use std::collections::{HashMap, HashSet};

use understudy_ladder::{
    Area, BlockKind, Element, Language, Name, Namer, Program, Signal, parse_address, visit,
};
use understudy_structured_text::syntax::{
    Class, Declaration, File, Initializer, Path, Span, TypeKind, Unit,
};
use understudy_typed::{Interpreter, Program as Typed};

use super::network::constant;
use super::{Found, Writer, refused};

/// What a name of the text stands for.
#[derive(Debug, Clone)]
pub(super) enum Known {
    /// A signal.
    Bit {
        /// In the ladder.
        name: String,
        /// Coils may not write it.
        is_input: bool,
    },
    /// An instance of a standard block, without its preset.
    Block {
        /// In the ladder.
        name: String,
        /// Which block.
        kind: BlockKind,
    },
    /// Something else, with its type.
    Other(String),
}

impl<'f> Writer<'f> {
    pub(super) fn new(file: &'f File, unit: &'f Unit, typed: &Typed) -> Self {
        let name = Namer::new(Language::Ladder).name(unit.name.as_str());
        let name = Name::at(name, unit.name.span());
        let ladder = Program { name, comments: unit.comments.clone(), ..Program::default() };
        let mut writer = Self {
            file,
            unit,
            ladder,
            namer: Namer::new(Language::Ladder),
            known: HashMap::new(),
            called: HashSet::new(),
            read: Vec::new(),
            comments: Vec::new(),
            refused: Vec::new(),
        };
        let state = Interpreter::new(typed).initial().to_vec();
        let initial = typed.variables.iter().map(|variable| {
            let value = state.get(variable.slot as usize).is_some_and(|value| *value != 0);
            (variable.name.to_ascii_uppercase(), value)
        });
        let initial: HashMap<String, bool> = initial.collect();
        for declaration in &unit.declarations {
            if declaration.class != Class::External {
                writer.declare(declaration, &initial);
            }
        }
        for declaration in &file.globals {
            if !writer.known.contains_key(&declaration.name.key()) {
                writer.declare(declaration, &initial);
            }
        }
        writer
    }

    /// `initial` has the values of variables before the first scan, by their names in capitals.
    fn declare(&mut self, declaration: &Declaration, initial: &HashMap<String, bool>) {
        let key = declaration.name.key();
        let is_kept = !matches!(declaration.class, Class::Temporary | Class::InOut);
        let known = match &declaration.of.kind {
            TypeKind::Named(_) if declaration.edge.is_some() => Known::Other("an edge".to_owned()),
            TypeKind::Named(of) if of.is("BOOL") => match (initial.get(&key), &declaration.initial)
            {
                (Some(value), _) if is_kept => self.signal(declaration, *value),
                (None, _) if self.at_address(declaration).is_some() => {
                    self.signal(declaration, false)
                }
                (None, Some(Initializer::Value(value)))
                    if declaration.constant && constant(value).is_some() =>
                {
                    self.signal(declaration, constant(value) == Some(true))
                }
                _ => Known::Other("no BOOL that is kept".to_owned()),
            },
            TypeKind::Named(of) => match self.block(&of.key(), declaration) {
                Some(kind) if is_kept => {
                    Known::Block { name: self.namer.name(declaration.name.as_str()), kind }
                }
                _ => Known::Other(of.key()),
            },
            _ => Known::Other("no BOOL".to_owned()),
        };
        self.known.insert(key, known);
    }

    /// The standard block that is declared, where no unit of the file has its name and nothing but its preset has an initial value.
    fn block(&self, of: &str, declaration: &Declaration) -> Option<BlockKind> {
        let is_preset = match &declaration.initial {
            Some(Initializer::Structure(parts, _)) => {
                parts.iter().all(|(name, _)| name.is("PT") || name.is("PV"))
            }
            given => given.is_none(),
        };
        let is_own = self.file.units.iter().any(|unit| unit.name.is(of));
        BlockKind::of_word(of).filter(|_| is_preset && !is_own && declaration.address.is_none())
    }

    /// The signal that has the address of a declaration.
    fn at_address(&self, declaration: &Declaration) -> Option<&Known> {
        self.known.get(&bit_address(&declaration.address.as_ref()?.key()))
    }

    fn signal(&mut self, declaration: &Declaration, initial: bool) -> Known {
        if let Some(known) = self.at_address(declaration) {
            return known.clone();
        }
        let address = declaration.address.as_ref();
        let initial = Some(initial).filter(|value| *value || declaration.initial.is_some());
        let name = self.namer.name(declaration.name.as_str());
        let located = address.and_then(|it| parse_address(it.as_str().trim_start_matches('%')));
        let area = located.as_ref().map(|address| address.area);
        let signal = Signal {
            name: Name::at(name.as_str(), declaration.name.span()),
            address: located,
            initial,
            description: declaration.description.clone(),
            comments: Vec::new(),
        };
        let known = self.place(signal, area, declaration.class);
        if let Some(address) = address {
            self.known.insert(bit_address(&address.key()), known.clone());
        }
        known
    }

    fn place(&mut self, mut signal: Signal, area: Option<Area>, class: Class) -> Known {
        let name = signal.name.to_string();
        let is_input = class == Class::Input || area == Some(Area::Input);
        if is_input {
            signal.initial = None;
            self.ladder.inputs.push(signal);
        } else if class == Class::Output || area == Some(Area::Output) {
            self.ladder.outputs.push(signal);
        } else {
            self.ladder.memory.push(signal);
        }
        Known::Bit { name, is_input }
    }

    /// What a path begins with.
    pub(super) fn known(&mut self, path: &Path) -> Found<Known> {
        let key = path.root.key();
        let is_address = key.starts_with('%');
        let key = if is_address { bit_address(&key) } else { key };
        if is_address && !self.known.contains_key(&key) {
            self.address(&key, &path.span);
        }
        match self.known.get(&key) {
            Some(Known::Other(of)) => {
                refused(format!("it uses `{}`, which is {of}", path.root), &path.span)
            }
            Some(known) => Ok(known.clone()),
            None => refused(format!("it uses `{}`", path.root), &path.span),
        }
    }

    /// Declares the signal of an address that has no name in the text.
    fn address(&mut self, key: &str, span: &Span) {
        let plain = key.trim_start_matches('%');
        if let Some(address) = parse_address(plain) {
            let name = self.namer.name(plain);
            let (address, area) = (Some(address.clone()), address.area);
            let signal = Signal { address, ..Signal::new(name.as_str()) };
            let signal = Signal { name: Name::at(name, span.clone()), ..signal };
            let known = self.place(signal, Some(area), Class::Local);
            self.known.insert(key.to_owned(), known);
        }
    }

    /// The signal that an assignment writes.
    pub(super) fn target(&mut self, path: &Path) -> Found<String> {
        match (self.known(path)?, path.steps.as_slice()) {
            (Known::Bit { name, is_input: false, .. }, []) => Ok(name),
            (Known::Bit { name, .. }, []) => {
                refused(format!("it assigns the input `{name}`"), &path.span)
            }
            _ => refused(format!("it assigns a part of `{}`", path.root), &path.span),
        }
    }

    /// A memory bit of the ladder's own.
    pub(super) fn memory(&mut self, wanted: &str) -> String {
        let name = self.namer.name(&format!("{wanted}_1"));
        self.ladder.memory.push(Signal::new(name.as_str()));
        name
    }

    /// Gives an initial value to what is read above the rung that writes it: the last scan's value is meant.
    pub(super) fn states(&mut self) {
        let (mut written, mut states) = (HashSet::new(), HashSet::new());
        for rung in &self.ladder.rungs {
            visit(&rung.network, &mut |element| {
                if let Element::Contact(contact) = element
                    && !written.contains(&contact.operand)
                {
                    states.insert(contact.operand.clone());
                }
            });
            for coil in &rung.coils {
                if coil.kind.is_latch() && !written.contains(&coil.target) {
                    states.insert(coil.target.clone());
                }
                written.insert(coil.target.clone());
            }
        }
        for signal in self.ladder.outputs.iter_mut().chain(&mut self.ladder.memory) {
            if signal.initial.is_none() && states.contains(&signal.name) {
                signal.initial = Some(false);
            }
        }
    }
}

/// A bit's address with its X, which may be left out.
fn bit_address(address: &str) -> String {
    let rest = address.trim_start_matches('%');
    match parse_address(rest) {
        Some(address) => address.to_string(),
        None => address.to_owned(),
    }
}
