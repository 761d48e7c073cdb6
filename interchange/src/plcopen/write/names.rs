//! Names of IEC 61131-3 for everything in a program: ASCII, no dots, whatever their case only once.

use std::collections::HashMap;

use understudy_ladder::{Language, Name, Namer, Program};

/// The names of a program in its file.
pub(super) struct Names {
    program: String,
    known: HashMap<String, String>,
    namer: Namer,
    added: Vec<String>,
}

impl Names {
    pub(super) fn of(program: &Program) -> Self {
        let mut namer = Namer::new(Language::StructuredText);
        let mut names = Self {
            program: namer.name(&program.name),
            known: HashMap::new(),
            namer,
            added: Vec::new(),
        };
        let signals = program
            .inputs
            .iter()
            .chain(&program.outputs)
            .chain(&program.memory);
        let blocks = program.blocks();
        let blocks = blocks.iter().map(|block| &block.name);
        for name in signals.map(|signal| &signal.name).chain(blocks) {
            let free = names.namer.name(name);
            names.known.insert(name.to_string(), free);
        }
        names
    }

    pub(super) fn program(&self) -> &str {
        &self.program
    }

    /// The name of a signal or block.
    pub(super) fn signal<'a>(&'a self, name: &'a Name) -> &'a str {
        self.known
            .get(name.as_str())
            .map_or(name.as_str(), String::as_str)
    }

    /// The name of what a contact reads: a signal, or block and output.
    pub(super) fn operand(&self, name: &str) -> String {
        if let Some(known) = self.known.get(name) {
            return known.clone();
        }
        match name.rsplit_once('.') {
            Some((block, pin)) => {
                let block = self.known.get(block).map_or(block, String::as_str);
                format!("{block}.{pin}")
            }
            None => name.to_owned(),
        }
    }

    /// A new bit.
    pub(super) fn add(&mut self, wanted: &str) -> String {
        let free = self.namer.name(wanted);
        self.added.push(free.clone());
        free
    }

    pub(super) fn added(&self) -> &[String] {
        &self.added
    }
}
