//! Statements.

use super::super::lexer::Lexeme;
use super::super::syntax::{Label, Leave, Loop, Statement, StatementKind};
use super::{Parser, is_keyword};

/// Words at which a list of statements ends.
const ENDS: [&str; 15] = [
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
    "END_WHILE",
    "FUNCTION",
    "FUNCTION_BLOCK",
    "PROGRAM",
    "UNTIL",
];

impl Parser {
    /// Statements up to one of `ends`, or to a word that ends some other list; that word is not consumed.
    pub(super) fn statements(&mut self, ends: &[&str]) -> Vec<Statement> {
        let mut statements = Vec::new();
        while *self.peek() != Lexeme::End
            && !self.at_any(ends)
            && !self.at_any(&ENDS)
            && !self.at_label(ends)
        {
            let before = self.place;
            let comments = self.placed().comments.clone();
            let span = self.span();
            let kind = self.statement();
            if self.place == before {
                self.skip();
            }
            match kind {
                StatementKind::Nothing => {}
                kind => statements.push(Statement {
                    kind,
                    span: span.start..self.end(),
                    comments,
                }),
            }
        }
        statements
    }

    /// Whether a branch of the CASE around begins here: `3:`, `1, 2..5:`, `Idle:`.
    fn at_label(&self, ends: &[&str]) -> bool {
        if !ends.contains(&"END_CASE") {
            return false;
        }
        let mut place = self.place;
        // A label is short; what is longer is none.
        while let Some(next) = self.lexemes.get(place).filter(|_| place < self.place + 400) {
            match &next.lexeme {
                Lexeme::Sign(":") => return place > self.place,
                Lexeme::Word(word) if is_keyword(word) => return false,
                Lexeme::Number(_) | Lexeme::Word(_) | Lexeme::Sign("," | ".." | "-" | ".") => {
                    place += 1
                }
                _ => return false,
            }
        }
        false
    }

    fn statement(&mut self) -> StatementKind {
        let Lexeme::Word(word) = self.peek() else {
            return self.simple();
        };
        let read = match word.to_ascii_uppercase().as_str() {
            "IF" => Self::if_statement,
            "CASE" => Self::case_statement,
            "FOR" => Self::for_statement,
            "WHILE" => Self::while_statement,
            "REPEAT" => Self::repeat_statement,
            "RETURN" => return self.leave(Leave::Unit),
            "EXIT" => return self.leave(Leave::Loop),
            "CONTINUE" => return self.leave(Leave::Turn),
            _ => return self.simple(),
        };
        let statement = self.enter(|parser| {
            parser.skip();
            read(parser)
        });
        statement.unwrap_or_else(|| {
            self.skip();
            self.recover(&ENDS);
            StatementKind::Nothing
        })
    }

    fn leave(&mut self, what: Leave) -> StatementKind {
        self.skip();
        self.need_sign(";");
        StatementKind::Leave(what)
    }

    /// An assignment, a call, or a semicolon alone.
    fn simple(&mut self) -> StatementKind {
        if self.take_sign(";") {
            return StatementKind::Nothing;
        }
        let Some(path) = self.path() else {
            self.recover(&ENDS);
            return StatementKind::Nothing;
        };
        let kind = if self.at_sign("(") {
            StatementKind::Call(path, self.arguments())
        } else if self.take_sign(":=") {
            StatementKind::Assign(path, self.expression())
        } else {
            if self.at_sign("[") {
                self.expected("`:=` or `(` (arrays are not supported)");
            } else {
                self.expected("`:=` or `(`");
            }
            self.recover(&ENDS);
            return StatementKind::Nothing;
        };
        if !self.need_sign(";") {
            self.recover(&ENDS);
        }
        kind
    }

    fn close(&mut self, word: &str) {
        if self.need_word(word) {
            self.take_sign(";");
        }
    }

    fn if_statement(&mut self) -> StatementKind {
        let mut branches = Vec::new();
        let mut otherwise = Vec::new();
        loop {
            let condition = self.expression();
            if !self.take_word("THEN") {
                self.expected("`THEN`");
            }
            branches.push((condition, self.statements(&["END_IF"])));
            if !self.take_word("ELSIF") {
                break;
            }
        }
        if self.take_word("ELSE") {
            otherwise = self.statements(&["END_IF"]);
        }
        self.close("END_IF");
        StatementKind::If(branches, otherwise)
    }

    fn case_statement(&mut self) -> StatementKind {
        let selector = self.expression();
        self.need_word("OF");
        let mut branches = Vec::new();
        let mut otherwise = Vec::new();
        while !self.at_any(&ENDS) && *self.peek() != Lexeme::End {
            let before = self.place;
            let mut labels = Vec::new();
            loop {
                let first = self.expression();
                let last = self.take_sign("..").then(|| self.expression());
                labels.push(Label { first, last });
                if !self.take_sign(",") {
                    break;
                }
            }
            self.need_sign(":");
            branches.push((labels, self.statements(&["END_CASE"])));
            if self.place == before {
                self.skip();
            }
        }
        if self.take_word("ELSE") {
            self.take_sign(":");
            otherwise = self.statements(&["END_CASE"]);
        }
        self.close("END_CASE");
        StatementKind::Case(selector, branches, otherwise)
    }

    fn for_statement(&mut self) -> StatementKind {
        let counter = self.name("the variable that counts");
        self.need_sign(":=");
        let from = self.expression();
        self.need_word("TO");
        let to = self.expression();
        let by = self.take_word("BY").then(|| self.expression());
        self.need_word("DO");
        let body = self.statements(&["END_FOR"]);
        self.close("END_FOR");
        match counter {
            Some(counter) => StatementKind::For(Box::new(Loop {
                counter,
                from,
                to,
                by,
                body,
            })),
            None => StatementKind::Nothing,
        }
    }

    fn while_statement(&mut self) -> StatementKind {
        self.expression();
        self.need_word("DO");
        self.statements(&["END_WHILE"]);
        self.close("END_WHILE");
        StatementKind::Refused("WHILE loops are")
    }

    fn repeat_statement(&mut self) -> StatementKind {
        self.statements(&["UNTIL"]);
        self.need_word("UNTIL");
        self.expression();
        self.close("END_REPEAT");
        StatementKind::Refused("REPEAT loops are")
    }
}
