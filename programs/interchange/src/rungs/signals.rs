//! Declarations as signals and blocks of a ladder.

use std::collections::{BTreeMap, HashMap, HashSet};

use understudy_ladder::{
    BlockKind, Element, Language, Name, Namer, Program, Series, Signal, parse_address, visit,
};
use understudy_structured_text::print::type_name;
use understudy_structured_text::syntax::{
    Class, Declaration, File, Initializer, Name as SourceName, Path, Span, TypeKind, Unit,
};
use understudy_typed::{Interpreter, Point, Program as Typed};

use super::drawn::{Uses, is_made};
use super::lost::Lost;
use super::network::constant;
use super::{Found, Refused, Writer, refused};
use crate::typed_text::written_name;

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
    /// The edge of a contact or coil that a drawing has, where its trigger was called.
    Edge {
        /// `R_TRIG` or `F_TRIG`.
        is_rising: bool,
        /// What it looks at.
        power: Series,
    },
    /// Something else, with its type.
    Other(String),
}

/// Inputs and outputs of a program by their names in capitals.
#[derive(Debug, Default)]
pub(super) struct Points {
    inputs: BTreeMap<String, Point>,
    outputs: BTreeMap<String, Point>,
}

impl Points {
    fn of(program: &Typed) -> Self {
        let named = |points: &understudy_typed::Points| {
            let own = points.iter().filter(|point| point.slot != 0);
            own.map(|point| (point.name.to_ascii_uppercase(), point.clone())).collect()
        };
        Self { inputs: named(&program.inputs), outputs: named(&program.outputs) }
    }
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
            points: Points::of(typed),
            retained: typed.retentive_names().iter().map(|it| it.to_ascii_uppercase()).collect(),
            lost: Lost::default(),
            comments: Vec::new(),
            place: 0..0,
            uses: Uses::of(unit),
            shared: HashSet::new(),
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
            let key = declaration.name.key();
            if !writer.known.contains_key(&key) {
                writer.declare(declaration, &initial);
                if let Some(Known::Bit { name, .. }) = writer.known.get(&key) {
                    writer.lost.globals.push((&declaration.name, name.clone()));
                }
            }
        }
        writer
    }

    /// `initial` has the values of variables before the first scan, by their names in capitals.
    fn declare(&mut self, declaration: &'f Declaration, initial: &HashMap<String, bool>) {
        let key = declaration.name.key();
        let is_kept = !matches!(declaration.class, Class::Temporary | Class::InOut);
        let known = match &declaration.of.kind {
            _ if declaration.class == Class::Temporary => Known::Other("a VAR_TEMP".to_owned()),
            _ if declaration.class == Class::InOut => Known::Other("a VAR_IN_OUT".to_owned()),
            TypeKind::Named(_) if declaration.edge.is_some() => {
                Known::Other("an input with R_EDGE or F_EDGE".to_owned())
            }
            TypeKind::Named(of) if of.is("BOOL") => match (initial.get(&key), &declaration.initial)
            {
                (Some(value), _) if is_kept => self.signal(declaration, *value),
                (None, None) if is_made(&declaration.name) => {
                    let known = self.signal(declaration, false);
                    if let Known::Bit { name, .. } = &known {
                        self.shared.insert(name.clone());
                    }
                    known
                }
                (None, _) if self.at_address(declaration).is_some() => {
                    self.signal(declaration, false)
                }
                (None, Some(Initializer::Value(value)))
                    if declaration.constant && constant(value).is_some() =>
                {
                    self.signal(declaration, constant(value) == Some(true))
                }
                _ => Known::Other("no BOOL of the program".to_owned()),
            },
            TypeKind::Named(of) => match self.block(&of.key(), declaration) {
                Some(kind) if is_kept => {
                    Known::Block { name: self.namer.name(&wanted(&declaration.name)), kind }
                }
                _ if BlockKind::of_word(&of.key()).is_some() => {
                    Known::Other(format!("{of}, with initial values or a body of its own"))
                }
                _ => Known::Other(of.to_string()),
            },
            _ => Known::Other(type_name(&declaration.of)),
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
        let address = declaration.address.as_ref()?.key();
        // `%I*` is a place that is still to be chosen, another one for each variable.
        self.known.get(&bit_address(&address)).filter(|_| !address.ends_with('*'))
    }

    fn signal(&mut self, declaration: &'f Declaration, initial: bool) -> Known {
        if let Some(known) = self.at_address(declaration) {
            return known.clone();
        }
        let address = declaration.address.as_ref();
        let initial = Some(initial).filter(|value| *value || declaration.initial.is_some());
        let name = self.namer.name(&wanted(&declaration.name));
        if name != declaration.name.as_str() && !is_made(&declaration.name) {
            self.lost.renamed.push((&declaration.name, name.clone()));
        }
        let located = address.and_then(|it| parse_address(it.as_str().trim_start_matches('%')));
        let signal = Signal {
            name: Name::at(name.as_str(), declaration.name.span()),
            address: located,
            initial,
            description: declaration.description.clone(),
            comments: Vec::new(),
        };
        let known = self.place(&declaration.name.key(), signal);
        if let Some(address) = address.filter(|address| !address.as_str().ends_with('*')) {
            self.known.insert(bit_address(&address.key()), known.clone());
        }
        known
    }

    /// Declares the signal of a name or an address in capitals, as the input, the output or the memory that it is in the program.
    fn place(&mut self, key: &str, mut signal: Signal) -> Known {
        let name = signal.name.to_string();
        let is_input = self.points.inputs.contains_key(key);
        if is_input {
            signal.initial = None;
            self.ladder.inputs.push(signal);
        } else if self.points.outputs.contains_key(key) {
            self.ladder.outputs.push(signal);
        } else {
            self.ladder.memory.push(signal);
        }
        Known::Bit { name, is_input }
    }

    /// Refuses each input and output of the program that is none of the rungs.
    pub(super) fn points_are_signals(&mut self) {
        let sides = [
            (&self.points.inputs, &self.ladder.inputs, "input"),
            (&self.points.outputs, &self.ladder.outputs, "output"),
        ];
        let mut missing = Vec::new();
        for (points, signals, side) in sides {
            for (key, point) in points {
                let is_signal = match self.known.get(key) {
                    Some(Known::Bit { name, .. }) => {
                        signals.iter().any(|it| it.name.as_str() == name)
                    }
                    _ => false,
                };
                if !is_signal {
                    // An element of an array or a part of a structure is a point of its own, and is declared with the whole.
                    let whole = key.split(['[', '.']).next().unwrap_or(key);
                    let mut declared = self.unit.declarations.iter().chain(&self.file.globals);
                    let place = declared.find(|found| found.name.key() == whole);
                    let (shown, of, span) = match place {
                        Some(found) => {
                            (found.name.as_str(), type_name(&found.of), found.name.span())
                        }
                        None => {
                            let of = point.declared().to_string();
                            (point.name.as_str(), of, self.unit.name.span())
                        }
                    };
                    let what = format!("its {side} `{shown}` : {of} is no signal of rungs");
                    missing.push(Refused { what, span });
                }
            }
        }
        missing.sort_by_key(|refused| refused.span.start);
        missing.dedup_by(|one, other| one.what == other.what);
        self.refused.extend(missing);
    }

    /// Leaves out the global variables that no rung reads or writes.
    pub(super) fn drop_unused_globals(&mut self) {
        let mut used: HashSet<&str> = HashSet::new();
        for rung in &self.ladder.rungs {
            visit(&rung.network, &mut |element| {
                if let Element::Contact(contact) = element {
                    used.insert(contact.operand.as_str());
                }
            });
            used.extend(rung.coils.iter().map(|coil| coil.target.as_str()));
        }
        let unused = self.lost.globals.iter().filter(|(_, name)| !used.contains(name.as_str()));
        let unused: HashSet<String> = unused.map(|(_, name)| name.clone()).collect();
        self.ladder.memory.retain(|signal| !unused.contains(signal.name.as_str()));
        let signals = self.ladder.inputs.iter().chain(&self.ladder.outputs);
        let signals = signals.chain(&self.ladder.memory);
        let kept: HashSet<&str> = signals.map(|signal| signal.name.as_str()).collect();
        self.lost.globals.retain(|(_, name)| kept.contains(name.as_str()));
    }

    /// Declares the retentive signals and blocks.
    pub(super) fn declare_retained(&mut self) {
        let signals = self.ladder.outputs.iter().chain(&self.ladder.memory);
        let mut left: HashSet<&str> = signals.map(|signal| signal.name.as_str()).collect();
        left.extend(self.called.iter().map(String::as_str));
        let declared = self.unit.declarations.iter().chain(&self.file.globals);
        let kept = declared.filter(|found| self.retained.contains(&found.name.key()));
        let names = kept.filter_map(|found| match self.known.get(&found.name.key())? {
            Known::Bit { name, .. } | Known::Block { name, .. } => {
                let name = left.take(name.as_str())?;
                Some(Name::at(name, found.name.span()))
            }
            Known::Edge { .. } | Known::Other(_) => None,
        });
        self.ladder.retained = names.collect();
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
            let signal = Signal { address: Some(address), ..Signal::new(name.as_str()) };
            let signal = Signal { name: Name::at(name, span.clone()), ..signal };
            let known = self.place(key, signal);
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

/// The name that a declaration should have in the ladder.
fn wanted(name: &SourceName) -> String {
    if is_made(name) { written_name(name.as_str()) } else { name.as_str().to_owned() }
}

/// A bit's address with its X, which may be left out.
fn bit_address(address: &str) -> String {
    let rest = address.trim_start_matches('%');
    match parse_address(rest) {
        Some(address) => address.to_string(),
        None => address.to_owned(),
    }
}
