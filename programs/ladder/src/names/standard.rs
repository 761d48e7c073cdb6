//! Names of IEC 61131-3 for everything in a program: ASCII, no dots, whatever their case only once.

use std::collections::HashMap;

use super::{Language, Namer};
use crate::program::{Name, Program};

/// The names of a program in a file of the standard.
#[derive(Debug, Clone)]
pub struct StandardNames {
    program: String,
    known: HashMap<String, String>,
    namer: Namer,
}

impl StandardNames {
    /// Names for the program, its signals and its blocks.
    pub fn of(program: &Program) -> Self {
        let mut namer = Namer::new(Language::StructuredText);
        let mut names = Self { program: namer.name(&program.name), known: HashMap::new(), namer };
        let signals = program.inputs.iter().chain(&program.outputs).chain(&program.memory);
        let blocks = program.blocks();
        let blocks = blocks.iter().map(|block| &block.name);
        for name in signals.map(|signal| &signal.name).chain(blocks) {
            let free = names.namer.name(name);
            names.known.insert(name.to_string(), free);
        }
        names
    }

    /// The name of the program.
    pub fn program(&self) -> &str {
        &self.program
    }

    /// The name of a signal or block.
    pub fn signal<'a>(&'a self, name: &'a Name) -> &'a str {
        self.known.get(name.as_str()).map_or(name.as_str(), String::as_str)
    }

    /// The name of what a contact reads: a signal, or block and output.
    pub fn operand(&self, name: &str) -> String {
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

    /// Another name, like `wanted`, that nothing has.
    pub fn add(&mut self, wanted: &str) -> String {
        self.namer.name(wanted)
    }

    /// The names of all signals and blocks: their own, and in a file of the standard.
    pub(crate) fn all(&self) -> impl Iterator<Item = (&str, &str)> {
        self.known.iter().map(|(own, written)| (own.as_str(), written.as_str()))
    }

    pub(crate) fn namer(&mut self) -> &mut Namer {
        &mut self.namer
    }
}
