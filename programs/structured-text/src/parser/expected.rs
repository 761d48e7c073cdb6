//! What the parser takes as it must be there, and what it says where it is not.

use understudy_text::Diagnostic;

use super::Parser;
use crate::lexer::{Lexeme, code_refused};
use crate::syntax::Span;

impl Parser<'_> {
    pub(super) fn error(&mut self, code: &'static str, message: impl Into<String>, span: Span) {
        self.diagnostics.push(Diagnostic::error(code, message, span));
    }

    /// A construct that is understood and not supported.
    pub(super) fn refuse(&mut self, what: &str, span: Span, help: Option<&str>) {
        let finding = Diagnostic::error("U1040", format!("{what} not supported"), span);
        self.diagnostics.push(match help {
            Some(help) => finding.with_help(help),
            None => finding,
        });
    }

    /// A part of a declaration that is read past.
    pub(super) fn read_past(&mut self, message: impl Into<String>, span: Span) {
        self.diagnostics.push(Diagnostic::warning("U1055", message, span));
    }

    /// Reports the lexeme found in place of `what`; a lexeme that was reported already is not reported again.
    pub(super) fn expected(&mut self, what: &str) {
        self.expected_at(what, self.span());
    }

    pub(super) fn expected_at(&mut self, what: &str, span: Span) {
        let found = match self.peek() {
            Lexeme::Faulty => return,
            Lexeme::Code(_) => return self.diagnostics.push(code_refused(self.span())),
            Lexeme::End => "the end of the text".to_owned(),
            _ => {
                let written: String = self.written().chars().take(60).collect();
                format!("`{}`", written.escape_debug())
            }
        };
        self.error("U1034", format!("expected {what}, found {found}"), span);
    }

    /// Reports a word or sign that is missing: at the end of the line before, where the text goes on with a new line, unless it `begins` one itself.
    /// Whether it was missing there.
    pub(super) fn missing(&mut self, what: &str, begins: bool) -> bool {
        let at_end = self.placed().starts_line && *self.peek() != Lexeme::Faulty && !begins;
        let end = self.end();
        let span = if at_end { end..end } else { self.span() };
        self.expected_at(&format!("`{what}`"), span);
        at_end
    }

    pub(super) fn need_end(&mut self, what: &str) {
        if !self.at_end() {
            self.expected(what);
        }
    }

    pub(super) fn need_sign(&mut self, sign: &'static str) -> bool {
        let found = self.take_sign(sign);
        if !found {
            self.expected(&format!("`{sign}`"));
        }
        found
    }

    pub(super) fn need_word(&mut self, word: &str) -> bool {
        let found = self.take_word(word);
        if !found {
            self.missing(word, word.starts_with("END_"));
        }
        found
    }

    /// Takes the semicolon at the end of a statement or declaration. Where it is missing at the end of a line, reading goes on
    /// with the next line, otherwise behind the next semicolon.
    pub(super) fn need_semicolon(&mut self, ends: &[&str]) {
        if self.take_sign(";") {
            return;
        }
        if !self.missing(";", false) {
            self.recover(ends);
        }
    }
}
