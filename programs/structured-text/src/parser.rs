//! Lexemes to syntax. What cannot be read is diagnosed, skipped up to the next statement or declaration, and reading goes on,
//! so that one run shows everything. Depth, and so recursion, is bounded by [`MAXIMUM_NESTING`].
//!
//! Besides both editions of IEC 61131-3 these rules of other compilers are taken without a warning, since they change nothing:
//!
//! - a semicolon may be left out behind `END_IF` and its like, and before `END_VAR`, `END_STRUCT` and `END_TYPE`;
//! - inputs without a value (`IN := ,`) and outputs without a target (`Q => ,`) are as if they were not written;
//! - `a += b` is `a := a + b`, and `a S= b` is `IF b THEN a := TRUE; END_IF`;
//! - access words (`PUBLIC`, `FINAL`, …), namespaces and `USING` are read past; a CLASS is a function block without a body;
//! - an action of a unit that is not a chart is a method of it;
//! - in Siemens SCL a quoted name is a name, in which `_` replaces what a name cannot have; `NOT` binds as there, `DIV` divides
//!   integers, organization blocks are programs and data blocks are global variables.

mod chart;
mod configuration;
mod declaration;
mod expected;
mod expression;
mod initial;
mod instruction;
mod siemens;
mod statement;
mod types;
mod unit;
mod words;

use std::collections::HashSet;

pub use words::is_keyword;

use understudy_text::{Diagnostic, MAXIMUM_FINDINGS};

use crate::lexer::{Lexeme, Lexemes, Placed, lex};
use crate::syntax::{
    Body, Declaration, Expression, ExpressionKind, File, Instruction, Literal, Name, Span,
    Statement, TypeName,
};

/// The place in a larger text of a place in the one that is read. What follows here follows there.
pub type Places<'p> = &'p dyn Fn(Span) -> Span;

/// The largest text.
pub const MAXIMUM_TEXT_BYTES: usize = 16 << 20;

/// The deepest nesting of brackets, types and statements.
pub const MAXIMUM_NESTING: usize = 64;

/// A whole text: programs, blocks, functions, types, configurations. With everything that was wrong with it.
pub fn parse(text: &str) -> (File, Vec<Diagnostic>) {
    read(text, |parser| parser.file())
}

/// As [`parse`], of a text that stands for a larger one, or for one in another language.
pub fn parse_at(text: &str, places: Places<'_>) -> (File, Vec<Diagnostic>) {
    read_at(text, places, |parser| parser.file())
}

/// The declaration part of a unit, a type or a list of variables, as TwinCAT and CODESYS keep them: the header of a unit with
/// its blocks of variables and without its end, `VAR_GLOBAL … END_VAR`, `TYPE … END_TYPE`. A METHOD is a unit of the file.
pub fn parse_declarations(text: &str) -> (File, Vec<Diagnostic>) {
    parse_declarations_at(text, &|span| span)
}

/// As [`parse_declarations`], of a text that stands in a larger one.
pub fn parse_declarations_at(text: &str, places: Places<'_>) -> (File, Vec<Diagnostic>) {
    read_at(text, places, |parser| {
        parser.headers_only = true;
        parser.file()
    })
}

/// Blocks of variables alone, `VAR_INPUT … END_VAR VAR … END_VAR`.
pub fn parse_variables(text: &str) -> (Vec<Declaration>, Vec<Diagnostic>) {
    read(text, |parser| {
        let mut declarations = Vec::new();
        parser.declaration_blocks(&mut declarations);
        parser.need_end("a block of variables");
        declarations
    })
}

/// The body of a unit: statements, a chart or an instruction list.
pub fn parse_body(text: &str) -> (Body, Vec<Diagnostic>) {
    parse_body_at(text, &|span| span)
}

/// As [`parse_body`], of a text that stands in a larger one.
pub fn parse_body_at(text: &str, places: Places<'_>) -> (Body, Vec<Diagnostic>) {
    read_at(text, places, |parser| {
        let mut body = parser.body(&[]);
        while *parser.peek() != Lexeme::End {
            // What ends a statement is where no statement is open.
            parser.expected("a statement");
            parser.skip();
            let more = parser.statements(&[]);
            if let Body::Statements(statements) = &mut body {
                statements.extend(more);
            }
        }
        body
    })
}

/// Statements alone.
pub fn parse_statements(text: &str) -> (Vec<Statement>, Vec<Diagnostic>) {
    parse_statements_at(text, &|span| span)
}

/// As [`parse_statements`], of a text that stands in a larger one.
pub fn parse_statements_at(text: &str, places: Places<'_>) -> (Vec<Statement>, Vec<Diagnostic>) {
    read_at(text, places, |parser| {
        let mut statements = parser.statements(&[]);
        while *parser.peek() != Lexeme::End {
            parser.expected("a statement");
            parser.skip();
            statements.extend(parser.statements(&[]));
        }
        statements
    })
}

/// An instruction list.
pub fn parse_instructions(text: &str) -> (Vec<Instruction>, Vec<Diagnostic>) {
    parse_instructions_at(text, &|span| span)
}

/// As [`parse_instructions`], of a text that stands in a larger one.
pub fn parse_instructions_at(
    text: &str,
    places: Places<'_>,
) -> (Vec<Instruction>, Vec<Diagnostic>) {
    read_at(text, places, |parser| {
        let instructions = parser.instructions(&[]);
        parser.need_end("an instruction");
        instructions
    })
}

/// One type, such as `INT (0..9)`.
pub fn parse_type(text: &str) -> (Option<TypeName>, Vec<Diagnostic>) {
    read(text, |parser| {
        let found = parser.type_name();
        parser.need_end("the end of the type");
        found
    })
}

/// One expression.
pub fn parse_expression(text: &str) -> (Expression, Vec<Diagnostic>) {
    parse_expression_at(text, &|span| span)
}

/// As [`parse_expression`], of a text that stands in a larger one.
pub fn parse_expression_at(text: &str, places: Places<'_>) -> (Expression, Vec<Diagnostic>) {
    read_at(text, places, |parser| {
        let found = parser.expression();
        parser.need_end("the end of the value");
        found
    })
}

/// One initial value, `[1, 2, 3(0)]` and its like.
pub fn parse_initializer(text: &str) -> (Option<crate::syntax::Initializer>, Vec<Diagnostic>) {
    parse_initializer_at(text, &|span| span)
}

/// As [`parse_initializer`], of a text that stands in a larger one.
pub fn parse_initializer_at(
    text: &str,
    places: Places<'_>,
) -> (Option<crate::syntax::Initializer>, Vec<Diagnostic>) {
    read_at(text, places, |parser| {
        let found = parser.initializer();
        parser.need_end("the end of the value");
        found
    })
}

fn read<T: Absent>(text: &str, read: impl FnOnce(&mut Parser<'_>) -> T) -> (T, Vec<Diagnostic>) {
    read_at(text, &|span| span, read)
}

fn read_at<T: Absent>(
    text: &str,
    places: Places<'_>,
    read: impl FnOnce(&mut Parser<'_>) -> T,
) -> (T, Vec<Diagnostic>) {
    if text.len() > MAXIMUM_TEXT_BYTES {
        let message =
            format!("the text has {} bytes; at most {MAXIMUM_TEXT_BYTES} are read", text.len());
        return (T::absent(), vec![Diagnostic::error("U1033", message, 0..0)]);
    }
    let mut parser = Parser::new(text, places);
    let found = read(&mut parser);
    (found, parser.finish())
}

/// What is answered where nothing was read.
trait Absent {
    fn absent() -> Self;
}

impl<T: Default> Absent for T {
    fn absent() -> Self {
        Self::default()
    }
}

impl Absent for Expression {
    fn absent() -> Self {
        let kind = ExpressionKind::Faulty;
        Self { kind, span: 0..0 }
    }
}

struct Parser<'a> {
    text: &'a str,
    lexemes: Vec<Placed<'a>>,
    place: usize,
    depth: usize,
    /// Whether quoted words are names, as in Siemens SCL.
    is_siemens: bool,
    /// Whether units end without their end, as in the files of TwinCAT.
    headers_only: bool,
    diagnostics: Vec<Diagnostic>,
}

impl<'a> Parser<'a> {
    fn new(text: &'a str, places: Places<'_>) -> Self {
        let Lexemes { mut placed, has_local_marks, mut diagnostics } = lex(text);
        for lexeme in &mut placed {
            lexeme.span = places(lexeme.within.clone());
        }
        for found in &mut diagnostics {
            found.span = places(found.span.clone());
        }
        let is_siemens = has_local_marks || siemens::is_siemens(&placed);
        Self {
            text,
            lexemes: placed,
            place: 0,
            depth: 0,
            is_siemens,
            headers_only: false,
            diagnostics,
        }
    }

    /// What was found, once a place.
    fn finish(self) -> Vec<Diagnostic> {
        let mut seen = HashSet::new();
        let mut diagnostics = self.diagnostics;
        diagnostics.retain(|found| seen.insert((found.code, found.span.clone())));
        diagnostics.sort_by_key(|found| found.span.start);
        diagnostics
    }

    fn placed(&self) -> &Placed<'a> {
        &self.lexemes[self.place]
    }

    fn peek(&self) -> &Lexeme<'a> {
        &self.placed().lexeme
    }

    /// The lexeme `ahead` places further on.
    fn ahead(&self, ahead: usize) -> &Lexeme<'a> {
        let last = self.lexemes.len() - 1;
        &self.lexemes[last.min(self.place + ahead)].lexeme
    }

    fn at_end(&self) -> bool {
        *self.peek() == Lexeme::End
    }

    /// The lexeme as it is written.
    fn written(&self) -> &'a str {
        let within = self.placed().within.clone();
        self.text.get(within).unwrap_or_default()
    }

    fn span(&self) -> Span {
        self.placed().span.clone()
    }

    /// The end of what was read last.
    fn end(&self) -> usize {
        match self.place {
            0 => 0,
            place => self.lexemes[place - 1].span.end,
        }
    }

    /// From `start` to the end of what was read last.
    fn since(&self, start: usize) -> Span {
        start..self.end().max(start)
    }

    /// The comments above the lexeme.
    fn comments(&self) -> Vec<String> {
        let comments = self.placed().comments.as_deref();
        comments.map(|comments| comments.above.clone()).unwrap_or_default()
    }

    /// The comment behind what was read last.
    fn remark(&self) -> Option<String> {
        let last = self.place.checked_sub(1)?;
        self.lexemes[last].comments.as_ref()?.behind.clone()
    }

    /// Steps over a lexeme, never over the end.
    fn skip(&mut self) {
        if self.at_end() {
            return;
        }
        self.place += 1;
        if self.diagnostics.len() >= MAXIMUM_FINDINGS {
            let place = self.span().start;
            self.diagnostics.push(Diagnostic::too_many(place));
            self.place = self.lexemes.len() - 1;
        }
    }

    fn word(&self) -> Option<&'a str> {
        match self.peek() {
            Lexeme::Word(word) => Some(word),
            _ => None,
        }
    }

    fn at_word(&self, word: &str) -> bool {
        matches!(self.peek(), Lexeme::Word(found) if found.eq_ignore_ascii_case(word))
    }

    fn at_any(&self, words: &[&str]) -> bool {
        matches!(self.peek(), Lexeme::Word(found)
            if words.iter().any(|word| found.eq_ignore_ascii_case(word)))
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

    /// An identifier.
    fn name(&mut self, what: &str) -> Option<Name> {
        if let Some(word) = self.word()
            && !is_keyword(word)
        {
            let name = Name::new(word, self.span());
            self.skip();
            return Some(name);
        }
        if let Some(name) = self.quoted_name() {
            return Some(name);
        }
        self.expected(what);
        None
    }

    /// A name behind a point, which may be a word of the language.
    fn part_name(&mut self, what: &str) -> Option<Name> {
        match self.word() {
            Some(word) => {
                let name = Name::new(word, self.span());
                self.skip();
                Some(name)
            }
            None => self.name(what),
        }
    }

    /// Names with points between them, of which the last is taken.
    fn dotted_name(&mut self, what: &str) -> Option<Name> {
        let mut name = self.name(what)?;
        while self.take_sign(".") {
            name = self.part_name(what)?;
        }
        Some(name)
    }

    /// A whole number, as for a priority.
    fn whole_number(&mut self) -> Option<i64> {
        let negative = self.take_sign("-");
        if let Lexeme::Literal(literal) = self.peek()
            && let Literal::Integer { value, .. } = **literal
        {
            self.skip();
            let value = i64::try_from(value).ok()?;
            return Some(if negative { -value } else { value });
        }
        self.expected("a whole number");
        None
    }

    /// Goes one level deeper; `None`, diagnosed, past the bound.
    fn enter<T>(&mut self, read: impl FnOnce(&mut Self) -> T) -> Option<T> {
        if self.depth >= MAXIMUM_NESTING {
            let message = format!("this nests deeper than {MAXIMUM_NESTING} levels");
            self.error("U1035", message, self.span());
            return None;
        }
        self.depth += 1;
        let read = read(self);
        self.depth -= 1;
        Some(read)
    }

    /// Skips to behind the next semicolon, or to one of `words`, which is not consumed.
    fn recover(&mut self, words: &[&str]) {
        while !self.at_end() && !self.at_any(words) {
            if self.take_sign(";") {
                return;
            }
            self.skip();
        }
    }

    /// Skips to a word, which is not consumed.
    fn recover_to(&mut self, words: &[&str]) {
        while !self.at_end() && !self.at_any(words) {
            self.skip();
        }
    }

    /// Skips what is left of the line.
    fn skip_line(&mut self) {
        while !self.at_end() && !self.placed().starts_line {
            self.skip();
        }
    }
}

#[cfg(test)]
mod tests;
