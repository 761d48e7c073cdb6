//! What a program means, beyond its grammar: names, double coils, reads before writes.
//!
//! The rule for reads: a rung that reads a signal *above* the rung that writes it sees the last scan's value. That is
//! reported, except where it is plainly meant: in the writing rung itself (a seal-in), where the signal is only set and reset
//! (a latch lasts over scans), and where its declaration gives an initial value (`memory step = 0`: a state).

mod report;
mod retention;
mod size;

use std::collections::HashMap;
use std::collections::hash_map::Entry;
use std::ops::Range;

use understudy_text::Diagnostic;

use crate::lexer::{MAXIMUM_NAME_LENGTH, MAXIMUM_PRESET_TIME, is_name_part, is_name_start};
use crate::parser::{KEYWORDS, MAXIMUM_NESTING, MAXIMUM_PRESET_VALUE};
use crate::program::{Block, CoilKind, Element, Name, Program, Series, Signal};

/// All errors and warnings about what `program` means, in no order.
pub fn check(program: &Program) -> Vec<Diagnostic> {
    let mut checker = Checker::default();
    checker.declare(program);
    for (rung, content) in program.rungs.iter().enumerate() {
        checker.series(&content.network, rung, 0);
        for coil in &content.coils {
            checker.write(&coil.target, coil.kind, rung);
        }
    }
    checker.retained(&program.retained);
    checker.report_undefined();
    checker.report_use();
    checker.diagnostics
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Role {
    Input,
    Output,
    Memory,
    /// An output pin of a block.
    Pin,
}

impl Role {
    fn words(self) -> &'static str {
        match self {
            Self::Input => "the input",
            Self::Output => "the output",
            Self::Memory => "the memory bit",
            Self::Pin => "the block's output",
        }
    }
}

struct Symbol {
    name: Name,
    role: Role,
    has_initial: bool,
    /// The first read: rung and place.
    read: Option<(usize, Range<usize>)>,
    /// Rung, kind and place of each coil.
    writes: Vec<(usize, CoilKind, Range<usize>)>,
}

#[derive(Default)]
struct Checker<'a> {
    symbols: Vec<Symbol>,
    places: HashMap<String, usize>,
    blocks: HashMap<&'a str, &'a Block>,
    /// Undefined names in the order of their first use, with all places.
    undefined: Vec<(Name, Vec<Range<usize>>)>,
    undefined_places: HashMap<String, usize>,
    too_deep: bool,
    diagnostics: Vec<Diagnostic>,
}

impl<'a> Checker<'a> {
    fn declare(&mut self, program: &'a Program) {
        let mut addresses = HashMap::new();
        let signals = [
            (Role::Input, &program.inputs),
            (Role::Output, &program.outputs),
            (Role::Memory, &program.memory),
        ];
        for (role, signals) in signals {
            for signal in signals {
                self.declare_signal(role, signal);
                let Some(address) = &signal.address else {
                    continue;
                };
                match addresses.entry(address) {
                    Entry::Vacant(place) => {
                        place.insert(&signal.name);
                    }
                    Entry::Occupied(first) => self.diagnostics.push(
                        Diagnostic::error(
                            "U0108",
                            format!(
                                "`{}` and `{}` have the same address {address}",
                                first.get(),
                                signal.name
                            ),
                            signal.name.span(),
                        )
                        .with_related(first.get().span(), "the first is here"),
                    ),
                }
            }
        }
        for block in program.blocks() {
            self.declare_block(block);
        }
    }

    fn declare_signal(&mut self, role: Role, signal: &Signal) {
        self.check_name(&signal.name);
        self.declare_symbol(&signal.name, signal.name.to_string(), role, signal.initial);
    }

    fn declare_symbol(&mut self, name: &Name, text: String, role: Role, initial: Option<bool>) {
        let place = self.symbols.len();
        match self.places.entry(text) {
            Entry::Vacant(free) => {
                let symbol = Name::at(free.key().as_str(), name.span());
                free.insert(place);
                self.symbols.push(Symbol {
                    name: symbol,
                    role,
                    has_initial: initial.is_some(),
                    read: None,
                    writes: Vec::new(),
                });
            }
            Entry::Occupied(taken) => {
                let first = &self.symbols[*taken.get()];
                self.diagnostics.push(
                    Diagnostic::error(
                        "U0105",
                        format!("`{}` is declared twice", first.name),
                        name.span(),
                    )
                    .with_related(first.name.span(), "the first declaration"),
                );
            }
        }
    }

    fn declare_block(&mut self, block: &'a Block) {
        self.check_name(&block.name);
        let word = block.kind.word();
        let clash = match self.blocks.entry(block.name.as_str()) {
            Entry::Vacant(free) => {
                free.insert(block);
                self.places.get(block.name.as_str()).map(|&signal| {
                    let span = self.symbols[signal].name.span();
                    let message = format!("`{}` is a signal and a block", block.name);
                    Diagnostic::error("U0105", message, block.name.span())
                        .with_related(span, "the signal")
                })
            }
            Entry::Occupied(taken) => Some(
                Diagnostic::error(
                    "U0107",
                    format!("the block `{}` is used twice", block.name),
                    block.name.span(),
                )
                .with_related(taken.get().name.span(), "used first here")
                .with_help(format!(
                    "each {word} needs a name of its own; read the first as `{}.{}`",
                    block.name,
                    taken.get().kind.outputs()[0]
                )),
            ),
        };
        match clash {
            Some(clash) => self.diagnostics.push(clash),
            None => {
                for pin in block.kind.outputs() {
                    let text = format!("{}.{pin}", block.name);
                    self.declare_symbol(&block.name, text, Role::Pin, None);
                }
            }
        }
        self.check_presets(block);
        self.check_pins(block);
    }

    fn check_presets(&mut self, block: &Block) {
        if let Some(time) = block.kind.preset_time()
            && time > MAXIMUM_PRESET_TIME
        {
            let message = format!("the preset of `{}` is longer than 100 days", block.name);
            self.diagnostics.push(Diagnostic::error("U0110", message, block.name.span()));
        }
        if let Some(value) = block.kind.preset_value()
            && value > MAXIMUM_PRESET_VALUE
        {
            let message = format!(
                "the preset {value} of `{}` is more than {MAXIMUM_PRESET_VALUE}",
                block.name
            );
            self.diagnostics.push(Diagnostic::error("U0110", message, block.name.span()));
        }
    }

    fn check_pins(&mut self, block: &Block) {
        let word = block.kind.word();
        let known = block.kind.side_inputs();
        for (place, feed) in block.pins.iter().enumerate() {
            if !known.iter().any(|(pin, _)| *pin == feed.pin.as_str()) {
                let names: Vec<&str> = known.iter().map(|(pin, _)| *pin).collect();
                let wire = block.kind.wire_input();
                let help = match (feed.pin.as_str() == wire, names.is_empty()) {
                    (true, _) => format!("the rung's own power feeds {wire}"),
                    (_, true) => format!("{word} has no other input than its power"),
                    _ => format!("{word} has {}", names.join(", ")),
                };
                self.diagnostics.push(
                    Diagnostic::error(
                        "U0111",
                        format!("{word} has no input `{}` to be fed here", feed.pin),
                        feed.pin.span(),
                    )
                    .with_help(help),
                );
            }
            if let Some(first) = block.pins[..place].iter().find(|first| first.pin == feed.pin) {
                let message = format!("the input `{}` is fed twice", feed.pin);
                self.diagnostics.push(
                    Diagnostic::error("U0111", message, feed.pin.span())
                        .with_related(first.pin.span(), "fed first here")
                        .with_help("put both into one pair of brackets: [ a | b ]"),
                );
            }
        }
        for (pin, required) in known {
            if *required && !block.pins.iter().any(|feed| feed.pin.as_str() == *pin) {
                self.diagnostics.push(
                    Diagnostic::error(
                        "U0111",
                        format!("nothing feeds the input {pin} of `{}`", block.name),
                        block.name.span(),
                    )
                    .with_help(format!("write {{{word} {} … {pin}=signal}}", block.name)),
                );
            }
        }
    }

    fn check_name(&mut self, name: &Name) {
        let parts_are_fine = name
            .split('.')
            .all(|part| part.chars().all(is_name_part) && part.chars().next().is_some());
        let fine = parts_are_fine
            && name.chars().next().is_some_and(is_name_start)
            && name.chars().count() <= MAXIMUM_NAME_LENGTH
            && !KEYWORDS.contains(&name.as_str());
        if !fine {
            self.diagnostics.push(
                Diagnostic::error("U0114", format!("`{name}` is not a name"), name.span())
                    .with_help("a name has letters, digits and _, begins with a letter or _, and is not a reserved word"),
            );
        }
    }

    fn series(&mut self, series: &Series, rung: usize, depth: usize) {
        if depth > MAXIMUM_NESTING {
            if !self.too_deep {
                let message = format!("brackets nest deeper than {MAXIMUM_NESTING}");
                self.diagnostics.push(Diagnostic::error("U0113", message, 0..0));
            }
            self.too_deep = true;
            return;
        }
        for element in series {
            match element {
                Element::Contact(contact) => self.read(&contact.operand, rung),
                Element::Comparison(comparison) => self.compare(&comparison.counter),
                Element::Branches(branches) => {
                    if branches.len() < 2 || branches.iter().any(Vec::is_empty) {
                        let message = "branches are two or more, each with an element";
                        self.diagnostics.push(Diagnostic::error("U0118", message, 0..0));
                    }
                    for branch in branches {
                        self.series(branch, rung, depth + 1);
                    }
                }
                Element::Block(block) => {
                    for feed in &block.pins {
                        if feed.network.is_empty() {
                            let message = format!("nothing feeds the input `{}`", feed.pin);
                            self.diagnostics.push(
                                Diagnostic::error("U0118", message, feed.pin.span())
                                    .with_help(format!("write {}=signal", feed.pin)),
                            );
                        }
                        self.series(&feed.network, rung, depth + 1);
                    }
                }
            }
        }
    }

    fn read(&mut self, operand: &Name, rung: usize) {
        match self.places.get(operand.as_str()) {
            Some(&place) => {
                let symbol = &mut self.symbols[place];
                symbol.read.get_or_insert((rung, operand.span()));
            }
            None => self.undefined(operand),
        }
    }

    fn compare(&mut self, counter: &Name) {
        match self.blocks.get(counter.as_str()) {
            Some(block) if block.kind.preset_value().is_some() => {}
            Some(block) => self.diagnostics.push(Diagnostic::error(
                "U0111",
                format!("`{counter}` is a {} and has no CV", block.kind.word()),
                counter.span(),
            )),
            None if self.places.contains_key(counter.as_str()) => {
                self.diagnostics.push(Diagnostic::error(
                    "U0111",
                    format!("`{counter}` is not a counter and has no CV"),
                    counter.span(),
                ));
            }
            None => self.undefined(counter),
        }
    }

    fn write(&mut self, target: &Name, kind: CoilKind, rung: usize) {
        let Some(&place) = self.places.get(target.as_str()) else {
            self.undefined(target);
            return;
        };
        let symbol = &mut self.symbols[place];
        match symbol.role {
            Role::Output | Role::Memory => symbol.writes.push((rung, kind, target.span())),
            Role::Input | Role::Pin => self.diagnostics.push(
                Diagnostic::error(
                    "U0106",
                    format!("{} `{target}` cannot be written", symbol.role.words()),
                    target.span(),
                )
                .with_related(symbol.name.span(), "declared here")
                .with_help("a coil writes an output or a memory bit"),
            ),
        }
    }

    fn undefined(&mut self, name: &Name) {
        match self.undefined_places.entry(name.to_string()) {
            Entry::Occupied(known) => self.undefined[*known.get()].1.push(name.span()),
            Entry::Vacant(free) => {
                free.insert(self.undefined.len());
                self.undefined.push((name.clone(), vec![name.span()]));
            }
        }
    }
}
