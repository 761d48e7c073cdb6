//! Lexemes to syntax. What cannot be read is diagnosed, skipped up to the next statement or declaration, and reading goes on,
//! so that one run shows everything. Depth, and so recursion, is bounded by [`MAXIMUM_NESTING`].

mod declaration;
mod expression;
mod statement;

use std::collections::HashSet;
use std::ops::Range;

use understudy_ladder::Name;
use understudy_text::{Diagnostic, MAXIMUM_FINDINGS};

use super::lexer::{Lexeme, Placed, lex};
use super::syntax::{File, Statement, Unit};

/// The largest text.
pub(super) const MAXIMUM_TEXT_BYTES: usize = 16 << 20;

/// The deepest nesting of brackets and statements.
pub(super) const MAXIMUM_NESTING: usize = 48;

/// Words of the language that no variable can have for its name.
const KEYWORDS: [&str; 52] = [
    "AND",
    "AT",
    "BY",
    "CASE",
    "CONFIGURATION",
    "CONSTANT",
    "DO",
    "ELSE",
    "ELSIF",
    "END_CASE",
    "END_CONFIGURATION",
    "END_FOR",
    "END_FUNCTION",
    "END_FUNCTION_BLOCK",
    "END_IF",
    "END_PROGRAM",
    "END_REPEAT",
    "END_RESOURCE",
    "END_STRUCT",
    "END_TYPE",
    "END_VAR",
    "END_WHILE",
    "EXIT",
    "FALSE",
    "FOR",
    "FUNCTION",
    "FUNCTION_BLOCK",
    "IF",
    "MOD",
    "NOT",
    "OF",
    "OR",
    "PROGRAM",
    "REPEAT",
    "RESOURCE",
    "RETURN",
    "STRUCT",
    "THEN",
    "TO",
    "TRUE",
    "TYPE",
    "UNTIL",
    "VAR",
    "VAR_EXTERNAL",
    "VAR_GLOBAL",
    "VAR_INPUT",
    "VAR_IN_OUT",
    "VAR_OUTPUT",
    "VAR_TEMP",
    "WHILE",
    "XOR",
    "CONTINUE",
];

/// Whether no variable can be called so.
pub(crate) fn is_keyword(word: &str) -> bool {
    KEYWORDS
        .iter()
        .any(|keyword| keyword.eq_ignore_ascii_case(word))
}

/// A text with everything that was wrong with it.
pub(super) fn parse(text: &str) -> (File, Vec<Diagnostic>) {
    let mut parser = match Parser::new(text) {
        Ok(parser) => parser,
        Err(diagnostic) => return (File::default(), vec![*diagnostic]),
    };
    let file = parser.file();
    (file, parser.finish())
}

/// Statements alone.
pub(super) fn parse_body(text: &str) -> (Vec<Statement>, Vec<Diagnostic>) {
    let mut parser = match Parser::new(text) {
        Ok(parser) => parser,
        Err(diagnostic) => return (Vec::new(), vec![*diagnostic]),
    };
    let mut body = parser.statements(&[]);
    while *parser.peek() != Lexeme::End {
        // What ends a statement stands where no statement is open.
        parser.expected("a statement");
        parser.skip();
        body.extend(parser.statements(&[]));
    }
    (body, parser.finish())
}

/// One type, such as `INT (0..9)`, and one initial value.
pub(super) fn parse_type(text: &str) -> (Option<super::syntax::TypeName>, Vec<Diagnostic>) {
    match Parser::new(text) {
        Ok(mut parser) => {
            let found = parser.type_name();
            if *parser.peek() != Lexeme::End {
                parser.expected("the end of the type");
            }
            (found, parser.finish())
        }
        Err(diagnostic) => (None, vec![*diagnostic]),
    }
}

/// One expression, as for an initial value.
pub(super) fn parse_expression(text: &str) -> (super::syntax::Expression, Vec<Diagnostic>) {
    match Parser::new(text) {
        Ok(mut parser) => {
            let found = parser.expression();
            if *parser.peek() != Lexeme::End {
                parser.expected("the end of the value");
            }
            (found, parser.finish())
        }
        Err(diagnostic) => {
            let kind = super::syntax::ExpressionKind::Faulty;
            (
                super::syntax::Expression { kind, span: 0..0 },
                vec![*diagnostic],
            )
        }
    }
}

struct Parser {
    lexemes: Vec<Placed>,
    place: usize,
    depth: usize,
    diagnostics: Vec<Diagnostic>,
}

impl Parser {
    fn new(text: &str) -> Result<Self, Box<Diagnostic>> {
        if text.len() > MAXIMUM_TEXT_BYTES {
            let message = format!(
                "the text has {} bytes; at most {MAXIMUM_TEXT_BYTES} are read",
                text.len()
            );
            return Err(Box::new(Diagnostic::error("U1033", message, 0..0)));
        }
        let (lexemes, diagnostics) = lex(text);
        Ok(Self {
            lexemes,
            place: 0,
            depth: 0,
            diagnostics,
        })
    }

    /// What was found, once a place.
    fn finish(self) -> Vec<Diagnostic> {
        let mut seen = HashSet::new();
        let mut diagnostics = self.diagnostics;
        diagnostics.retain(|found| seen.insert((found.code, found.span.clone())));
        diagnostics.sort_by_key(|found| found.span.start);
        diagnostics
    }

    fn placed(&self) -> &Placed {
        &self.lexemes[self.place]
    }

    fn peek(&self) -> &Lexeme {
        &self.placed().lexeme
    }

    fn span(&self) -> Range<usize> {
        self.placed().span.clone()
    }

    /// The end of what was read last.
    fn end(&self) -> usize {
        match self.place {
            0 => 0,
            place => self.lexemes[place - 1].span.end,
        }
    }

    fn remark(&self) -> Option<String> {
        let last = self.place.checked_sub(1)?;
        self.lexemes[last].remark.clone()
    }

    /// Steps over a lexeme, never over the end.
    fn skip(&mut self) {
        if *self.peek() == Lexeme::End {
            return;
        }
        self.place += 1;
        if self.diagnostics.len() >= MAXIMUM_FINDINGS {
            let place = self.span().start;
            self.diagnostics.push(Diagnostic::too_many(place));
            self.place = self.lexemes.len() - 1;
        }
    }

    fn at_word(&self, word: &str) -> bool {
        matches!(self.peek(), Lexeme::Word(found) if found.eq_ignore_ascii_case(word))
    }

    fn at_any(&self, words: &[&str]) -> bool {
        words.iter().any(|word| self.at_word(word))
    }

    fn take_word(&mut self, word: &str) -> bool {
        let found = self.at_word(word);
        self.place += usize::from(found);
        found
    }

    fn at_sign(&self, sign: &'static str) -> bool {
        *self.peek() == Lexeme::Sign(sign)
    }

    fn take_sign(&mut self, sign: &'static str) -> bool {
        let found = self.at_sign(sign);
        self.place += usize::from(found);
        found
    }

    /// Reports the lexeme found in place of `what`; a lexeme that was reported already is not reported again.
    fn expected(&mut self, what: &str) {
        if *self.peek() == Lexeme::Faulty {
            return;
        }
        let found = match self.peek() {
            Lexeme::End => "the end of the text".to_owned(),
            Lexeme::Word(word) => format!("`{word}`"),
            Lexeme::Sign(sign) => format!("`{sign}`"),
            Lexeme::Number(number) => format!("`{number}`"),
            Lexeme::Address(address) => format!("`%{address}`"),
            Lexeme::Time(_) => "a time".to_owned(),
            Lexeme::Foreign(what) => (*what).to_owned(),
            Lexeme::Faulty => return,
        };
        // What is missing at the end of a line is missing there.
        let span = self.span();
        let finding = Diagnostic::error("U1034", format!("expected {what}, found {found}"), span);
        self.diagnostics.push(finding);
    }

    fn need_sign(&mut self, sign: &'static str) -> bool {
        let found = self.take_sign(sign);
        if !found {
            self.expected(&format!("`{sign}`"));
        }
        found
    }

    fn need_word(&mut self, word: &str) -> bool {
        let found = self.take_word(word);
        if !found {
            self.expected(&format!("`{word}`"));
        }
        found
    }

    /// An identifier.
    fn name(&mut self, what: &str) -> Option<Name> {
        if let Lexeme::Word(word) = self.peek()
            && !is_keyword(word)
        {
            let name = Name::at(word.clone(), self.span());
            self.skip();
            return Some(name);
        }
        self.expected(what);
        None
    }

    /// Goes one level deeper; `None`, diagnosed, past the bound.
    fn enter<T>(&mut self, read: impl FnOnce(&mut Self) -> T) -> Option<T> {
        if self.depth >= MAXIMUM_NESTING {
            let message = format!("this nests deeper than {MAXIMUM_NESTING} levels");
            self.diagnostics
                .push(Diagnostic::error("U1035", message, self.span()));
            return None;
        }
        self.depth += 1;
        let read = read(self);
        self.depth -= 1;
        Some(read)
    }

    /// Skips to behind the next semicolon, or to one of `words`, which is not consumed.
    fn recover(&mut self, words: &[&str]) {
        while *self.peek() != Lexeme::End && !self.at_any(words) {
            if self.take_sign(";") {
                return;
            }
            self.skip();
        }
    }

    fn file(&mut self) -> File {
        let mut file = File::default();
        while *self.peek() != Lexeme::End {
            let comments = self.placed().comments.clone();
            if let Some((kind, end)) = self.unit_keyword() {
                self.skip();
                if let Some(unit) = self.unit(kind, end, comments) {
                    file.units.push(unit);
                }
            } else if self.take_word("TYPE") {
                self.types(&mut file.types);
            } else if self.take_word("CONFIGURATION") {
                self.configuration(&mut file);
            } else if self.take_word("VAR_GLOBAL") {
                self.declarations(super::syntax::Class::External, false, &mut file.globals);
            } else {
                self.expected("PROGRAM, FUNCTION_BLOCK, FUNCTION, TYPE or CONFIGURATION");
                self.skip();
                while *self.peek() != Lexeme::End
                    && self.unit_keyword().is_none()
                    && !self.at_any(&["TYPE", "CONFIGURATION", "VAR_GLOBAL"])
                {
                    self.skip();
                }
            }
        }
        file
    }

    fn unit(
        &mut self,
        kind: super::syntax::UnitKind,
        end: &'static str,
        comments: Vec<String>,
    ) -> Option<Unit> {
        let name = self.name("a name");
        let result = if self.take_sign(":") {
            self.type_name()
        } else {
            None
        };
        self.take_sign(";");
        let mut declarations = Vec::new();
        self.declaration_blocks(&mut declarations);
        let mut body = self.statements(&[end]);
        while !self.at_word(end) && *self.peek() != Lexeme::End && self.unit_keyword().is_none() {
            self.expected("a statement");
            self.skip();
            body.extend(self.statements(&[end]));
        }
        let footer = self.placed().comments.clone();
        self.need_word(end);
        self.take_sign(";");
        Some(Unit {
            kind,
            name: name?,
            comments,
            footer,
            result,
            declarations,
            body,
            foreign: false,
        })
    }
}
