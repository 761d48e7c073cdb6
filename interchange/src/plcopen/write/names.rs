//! Names of IEC 61131-3 for everything in a program: ASCII, no dots, whatever their case only once.

use std::collections::{HashMap, HashSet};

use understudy_ladder::{Name, Program};

/// What a variable must not be called.
const RESERVED: [&str; 64] = [
    "ABS",
    "ACTION",
    "ADD",
    "AND",
    "ANY",
    "ARRAY",
    "AT",
    "BOOL",
    "BY",
    "BYTE",
    "CASE",
    "CONFIGURATION",
    "CONSTANT",
    "CTD",
    "CTU",
    "CTUD",
    "DATE",
    "DINT",
    "DIV",
    "DO",
    "DT",
    "DWORD",
    "ELSE",
    "ELSIF",
    "EN",
    "ENO",
    "EQ",
    "EXIT",
    "FALSE",
    "FOR",
    "FUNCTION",
    "GE",
    "GT",
    "IF",
    "INT",
    "LE",
    "LIMIT",
    "LT",
    "MAX",
    "MIN",
    "MOD",
    "MOVE",
    "MUL",
    "MUX",
    "NE",
    "NOT",
    "OF",
    "ON",
    "OR",
    "PROGRAM",
    "REAL",
    "REPEAT",
    "RETURN",
    "SEL",
    "STEP",
    "STRING",
    "STRUCT",
    "SUB",
    "TASK",
    "TIME",
    "TO",
    "TRUE",
    "VAR",
    "XOR",
];

/// More of them.
const RESERVED_TOO: [&str; 32] = [
    "F_TRIG",
    "R_TRIG",
    "RS",
    "SR",
    "TOF",
    "TON",
    "TP",
    "LD",
    "LDN",
    "ST",
    "STN",
    "S",
    "R",
    "CAL",
    "JMP",
    "RET",
    "THEN",
    "TOD",
    "TRANSITION",
    "TYPE",
    "UINT",
    "UNTIL",
    "USING",
    "WHILE",
    "WITH",
    "WORD",
    "LINT",
    "SINT",
    "USINT",
    "UDINT",
    "ULINT",
    "LREAL",
];

/// The names of a program in its file.
pub(super) struct Names {
    program: String,
    known: HashMap<String, String>,
    /// In capitals.
    taken: HashSet<String>,
    added: Vec<String>,
}

impl Names {
    pub(super) fn of(program: &Program) -> Self {
        let mut names = Self {
            program: legal(&program.name),
            known: HashMap::new(),
            taken: HashSet::new(),
            added: Vec::new(),
        };
        if is_reserved(&names.program) {
            names.program.push('0');
        }
        names.taken.insert(names.program.to_uppercase());
        let signals = program
            .inputs
            .iter()
            .chain(&program.outputs)
            .chain(&program.memory);
        let blocks = program.blocks();
        let blocks = blocks.iter().map(|block| &block.name);
        for name in signals.map(|signal| &signal.name).chain(blocks) {
            let free = names.free(name);
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
        let free = self.free(wanted);
        self.added.push(free.clone());
        free
    }

    pub(super) fn added(&self) -> &[String] {
        &self.added
    }

    fn free(&mut self, wanted: &str) -> String {
        let legal = legal(wanted);
        let mut name = legal.clone();
        let mut count = 2;
        while is_reserved(&name) || !self.taken.insert(name.to_uppercase()) {
            name = format!("{legal}_{count}");
            count += 1;
        }
        name
    }
}

fn is_reserved(name: &str) -> bool {
    let capitals = name.to_uppercase();
    RESERVED.contains(&capitals.as_str()) || RESERVED_TOO.contains(&capitals.as_str())
}

fn legal(wanted: &str) -> String {
    let mut name = String::new();
    for letter in wanted.chars() {
        let letter = if letter.is_ascii_alphanumeric() {
            letter
        } else {
            '_'
        };
        if !(letter == '_' && name.ends_with('_')) {
            name.push(letter);
        }
    }
    let trimmed = name.trim_end_matches('_');
    match trimmed.chars().next() {
        Some(first) if first.is_ascii_digit() => format!("x{trimmed}"),
        Some(_) => trimmed.to_owned(),
        None => "x".to_owned(),
    }
}
