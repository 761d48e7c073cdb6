//! Blocks of variables.

use understudy_text::Diagnostic;

use super::Parser;
use crate::lexer::Lexeme;
use crate::syntax::{Class, Declaration, Name, Retention};

/// Words that begin a block of variables.
const BLOCKS: [(&str, Class); 10] = [
    ("VAR", Class::Local),
    ("VAR_INPUT", Class::Input),
    ("VAR_OUTPUT", Class::Output),
    ("VAR_IN_OUT", Class::InOut),
    ("VAR_TEMP", Class::Temporary),
    ("VAR_STAT", Class::Static),
    ("VAR_INST", Class::Static),
    ("VAR_EXTERNAL", Class::External),
    ("VAR_GLOBAL", Class::Global),
    // Of CODESYS: an address and values that depend on the machine.
    ("VAR_GENERIC", Class::Local),
];

/// Words behind the one that begins a block.
const QUALIFIERS: [&str; 9] = [
    "CONSTANT",
    "RETAIN",
    "NON_RETAIN",
    "PERSISTENT",
    "PUBLIC",
    "PRIVATE",
    "PROTECTED",
    "INTERNAL",
    "DB_SPECIFIC",
];

/// Words at which a block of variables ends, the last ones where its END_VAR is missing.
const ENDS: [&str; 9] = [
    "END_VAR",
    "END_STRUCT",
    "END_UNION",
    "END_PROGRAM",
    "END_FUNCTION_BLOCK",
    "END_FUNCTION",
    "END_METHOD",
    "END_TYPE",
    "END_CONFIGURATION",
];

/// Names of one declaration, times the bytes of its type, at most: each name gets the type.
const MAXIMUM_DECLARED_BYTES: usize = 1 << 24;

/// What is said of the variables of one block.
#[derive(Debug, Clone, Copy)]
pub(super) struct Block {
    pub(super) class: Class,
    pub(super) constant: bool,
    pub(super) retention: Retention,
}

impl Parser<'_> {
    /// All blocks of declarations that are here, and `VAR_CONFIG` and `VAR_ACCESS`, which are read past.
    pub(super) fn declaration_blocks(&mut self, declarations: &mut Vec<Declaration>) {
        loop {
            if self.at_any(&["VAR_ACCESS", "VAR_CONFIG"]) {
                self.access_paths();
                continue;
            }
            if self.at_word("CONST") && self.is_siemens {
                self.refuse("`CONST` is", self.span(), Some("write VAR CONSTANT"));
                self.recover_to(&["END_CONST", "VAR", "BEGIN"]);
                self.take_word("END_CONST");
                self.take_sign(";");
                continue;
            }
            let found = BLOCKS.iter().find(|(word, _)| self.at_word(word));
            let Some((_, class)) = found else {
                return;
            };
            self.skip();
            self.variables(*class, declarations);
        }
    }

    /// A block of access paths, as a place.
    pub(super) fn access_paths(&mut self) -> crate::syntax::Span {
        let start = self.span().start;
        let span = self.span();
        self.recover_to(&["END_VAR"]);
        self.need_word("END_VAR");
        self.take_sign(";");
        self.read_past(
            "access paths, and values that a configuration gives to variables of units, are not kept",
            span,
        );
        self.since(start)
    }

    /// The content between `VAR…` and `END_VAR`.
    pub(super) fn variables(&mut self, class: Class, into: &mut Vec<Declaration>) {
        let mut block = Block { class, constant: false, retention: Retention::Unstated };
        // A variable may be called so.
        while self.at_any(&QUALIFIERS) && !matches!(self.ahead(1), Lexeme::Sign(":" | ",")) {
            block.constant |= self.at_word("CONSTANT");
            self.take_retention(&mut block.retention);
            self.skip();
        }
        self.fields(block, into);
        if !self.take_word("END_VAR") {
            self.expected("`END_VAR`");
        }
        self.take_sign(";");
    }

    /// Takes note of what the qualifier that is here says of a loss of power, which may not contradict one before it.
    pub(super) fn take_retention(&mut self, retention: &mut Retention) {
        let Some(found) = self.retention() else {
            return;
        };
        if *retention != Retention::Unstated && *retention != found {
            let message = "variables are RETAIN or NON_RETAIN, not both".to_owned();
            self.error("U1035", message, self.span());
        }
        *retention = found;
    }

    /// What the qualifier that is here says of a loss of power.
    pub(super) fn retention(&self) -> Option<Retention> {
        if self.at_any(&["RETAIN", "PERSISTENT"]) {
            return Some(Retention::Retained);
        }
        self.at_word("NON_RETAIN").then_some(Retention::NotRetained)
    }

    /// Declarations up to a word that ends them.
    pub(super) fn fields(&mut self, block: Block, into: &mut Vec<Declaration>) {
        while !self.at_any(&ENDS) && !self.at_end() {
            let before = self.place;
            if self.take_sign(";") {
                continue;
            }
            match self.declaration(block) {
                Some(found) => into.extend(found),
                None => self.recover(&ENDS),
            }
            if self.place == before {
                self.skip();
            }
        }
    }

    /// `a, b AT %IX0.0 : BOOL := TRUE;`
    fn declaration(&mut self, block: Block) -> Option<Vec<Declaration>> {
        let above = self.comments();
        let mut names: Vec<(Name, Option<Name>)> = Vec::new();
        loop {
            // A variable may be an address alone: `AT %IX0.0 : BOOL`.
            let is_address = self.at_word("AT") && names.is_empty();
            if !is_address {
                names.push((self.name("a variable")?, None));
            }
            if self.at_word("AT") {
                let address = self.address()?;
                match names.last_mut() {
                    Some(last) => last.1 = Some(address),
                    None => {
                        let name = address.as_str().replace('%', "").replace('.', "_");
                        names.push((Name::new(name, address.span()), Some(address)));
                    }
                }
            }
            if !self.take_sign(",") {
                break;
            }
        }
        if !self.need_sign(":") {
            return None;
        }
        let start = self.span().start;
        let of = self.type_name()?;
        let edge = match self.word() {
            Some(word) if word.eq_ignore_ascii_case("R_EDGE") => Some(true),
            Some(word) if word.eq_ignore_ascii_case("F_EDGE") => Some(false),
            _ => None,
        };
        if edge.is_some() {
            self.skip();
        }
        let initial = match self.take_sign(":=") {
            true => Some(self.initial_of(&of)?),
            false => None,
        };
        let bytes = self.end().saturating_sub(start);
        if names.len().saturating_mul(bytes) > MAXIMUM_DECLARED_BYTES {
            let message = "a declaration has too many names for so long a type";
            self.error("U1033", message, names[0].0.span());
            return None;
        }
        if !self.at_any(&ENDS) {
            self.need_semicolon(&ENDS);
        }
        let about: Vec<String> = above.into_iter().chain(self.remark()).collect();
        let description = (!about.is_empty()).then(|| about.join(" "));
        let declared = names.into_iter().map(|(name, address)| Declaration {
            name,
            class: block.class,
            constant: block.constant,
            retention: block.retention,
            edge,
            address,
            of: of.clone(),
            initial: initial.clone(),
            description: description.clone(),
        });
        Some(declared.collect())
    }

    /// `AT %IX0.0`, in capitals.
    fn address(&mut self) -> Option<Name> {
        self.skip();
        let span = self.span();
        let Lexeme::Address(text) = self.peek() else {
            if matches!(self.peek(), Lexeme::Word(_)) || self.at_quoted_name() {
                let help = "assign the parts of the other variable one by one";
                self.refuse("variables in the place of others are", span, Some(help));
            } else if self.at_sign(":") || self.at_sign(",") {
                let message = "AT is a word of the language, not the name of a variable";
                let help = "rename the variable";
                let word = self.end() - "AT".len()..self.end();
                let found = Diagnostic::error("U1034", message, word).with_help(help);
                self.diagnostics.push(found);
            } else {
                self.expected("an address such as %IX0.0");
            }
            return None;
        };
        let address = Name::new(text.to_ascii_uppercase(), span);
        self.skip();
        Some(address)
    }
}
