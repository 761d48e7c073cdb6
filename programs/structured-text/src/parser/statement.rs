//! Statements.

use super::{Parser, is_keyword};
use crate::lexer::Lexeme;
use crate::syntax::{
    Body, Expression, ExpressionKind, For, Label, Literal, Operator, Path, Statement, StatementKind,
};

/// Words at which a list of statements ends.
pub(super) const ENDS: [&str; 33] = [
    "ACTION",
    "DATA_BLOCK",
    "ELSE",
    "ELSIF",
    "END_ACTION",
    "END_CASE",
    "END_CLASS",
    "END_CONFIGURATION",
    "END_FOR",
    "END_FUNCTION",
    "END_FUNCTION_BLOCK",
    "END_IF",
    "END_INTERFACE",
    "END_METHOD",
    "END_NAMESPACE",
    "END_ORGANIZATION_BLOCK",
    "END_PROGRAM",
    "END_PROPERTY",
    "END_REPEAT",
    "END_RESOURCE",
    "END_STEP",
    "END_TRANSITION",
    "END_WHILE",
    "FUNCTION",
    "FUNCTION_BLOCK",
    "METHOD",
    "ORGANIZATION_BLOCK",
    "PROGRAM",
    "PROPERTY",
    "TYPE",
    "UNTIL",
    "CONFIGURATION",
    "VAR_GLOBAL",
];

/// Of [`ENDS`] those that can be names of variables too: they end statements where a name follows.
const SOFT_ENDS: [&str; 3] = ["ACTION", "METHOD", "PROPERTY"];

/// Statements at most to which one is repeated in its parts, as for `a S= b`.
const COMPOUND: [(&str, Operator); 4] = [
    ("+=", Operator::Add),
    ("-=", Operator::Subtract),
    ("*=", Operator::Multiply),
    ("/=", Operator::Divide),
];

impl Parser<'_> {
    /// The body of a unit up to one of `ends`.
    pub(super) fn body(&mut self, ends: &[&str]) -> Body {
        if self.at_chart() {
            return Body::Chart(self.chart());
        }
        if self.at_instructions() {
            return Body::Instructions(self.instructions(ends));
        }
        Body::Statements(self.statements(ends))
    }

    /// Whether a word ends a list of statements here.
    fn at_list_end(&self) -> bool {
        if self.at_any(&SOFT_ENDS) {
            return matches!(self.ahead(1), Lexeme::Word(_));
        }
        self.at_any(&ENDS)
    }

    /// Statements up to one of `ends`, or to a word that ends some other list; that word is not consumed.
    pub(super) fn statements(&mut self, ends: &[&str]) -> Vec<Statement> {
        let mut statements = Vec::new();
        while !self.at_end() && !self.at_any(ends) && !self.at_list_end() && !self.at_label(ends) {
            let before = self.place;
            let mut comments = self.comments();
            let start = self.span().start;
            let kind = self.statement();
            if self.place == before {
                self.skip();
            }
            if matches!(kind, StatementKind::Assign(..) | StatementKind::Call(..)) {
                comments.extend(self.remark());
            }
            match kind {
                StatementKind::Nothing => {}
                kind => statements.push(Statement { kind, span: self.since(start), comments }),
            }
        }
        // What is written below the last statement stands at one that does nothing. A body may be a text of its own.
        let comments = self.comments();
        if !comments.is_empty() && (self.at_word("END_PROGRAM") || self.at_end()) {
            statements.push(Statement {
                kind: StatementKind::Nothing,
                span: self.span(),
                comments,
            });
        }
        statements
    }

    /// Whether a branch of the CASE around begins here: `3:`, `1, 2..5:`, `Idle:`.
    fn at_label(&self, ends: &[&str]) -> bool {
        /// A label with more lexemes is none.
        const MAXIMUM_LABEL: usize = 4_000;
        if !ends.contains(&"END_CASE") {
            return false;
        }
        for ahead in 0..MAXIMUM_LABEL {
            match self.ahead(ahead) {
                Lexeme::Sign(":") => return ahead > 0,
                Lexeme::Word(word)
                    if is_keyword(word)
                        && !word.eq_ignore_ascii_case("TRUE")
                        && !word.eq_ignore_ascii_case("FALSE") =>
                {
                    return false;
                }
                Lexeme::Literal(_)
                | Lexeme::Qualified(_)
                | Lexeme::Word(_)
                | Lexeme::Sign("," | ".." | "-" | "." | "+" | "*") => {}
                _ => return false,
            }
        }
        false
    }

    fn statement(&mut self) -> StatementKind {
        if let Lexeme::Code(code) = *self.peek() {
            self.skip();
            return StatementKind::Code(code.to_owned());
        }
        let Some(word) = self.word() else {
            return self.simple();
        };
        let read = match word.to_ascii_uppercase().as_str() {
            "IF" => Self::if_statement,
            "CASE" => Self::case_statement,
            "FOR" => Self::for_statement,
            "WHILE" => Self::while_statement,
            "REPEAT" => Self::repeat_statement,
            "RETURN" => return self.leave(StatementKind::Return),
            "EXIT" => return self.leave(StatementKind::Exit),
            "CONTINUE" => return self.leave(StatementKind::Continue),
            "GOTO" | "JMP" if matches!(self.ahead(1), Lexeme::Word(_)) => return self.jump(),
            "__TRY" | "__CATCH" | "__FINALLY" | "__ENDTRY" => {
                let span = self.span();
                let word = word.to_ascii_uppercase();
                self.refuse(&format!("`{word}` is"), span, None);
                self.skip();
                if word == "__CATCH" && self.take_sign("(") {
                    self.expression();
                    self.take_sign(")");
                }
                return StatementKind::Nothing;
            }
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

    fn leave(&mut self, kind: StatementKind) -> StatementKind {
        self.skip();
        self.need_semicolon(&ENDS);
        kind
    }

    fn jump(&mut self) -> StatementKind {
        let span = self.span();
        let help = "use IF, CASE or a loop";
        self.refuse("jumps in Structured Text are", span, Some(help));
        self.recover(&ENDS);
        StatementKind::Nothing
    }

    /// An assignment, a call, or a semicolon alone.
    fn simple(&mut self) -> StatementKind {
        if self.take_sign(";") {
            return StatementKind::Nothing;
        }
        let start = self.span().start;
        let Some(path) = self.path() else {
            self.recover(&ENDS);
            return StatementKind::Nothing;
        };
        let kind = match self.peek() {
            Lexeme::Sign("(") => self.call(path, start),
            Lexeme::Sign(":=") => self.assignment(path),
            Lexeme::Sign(sign) => match COMPOUND.iter().find(|(found, _)| found == sign) {
                Some((_, operator)) => self.compound(path, *operator),
                None => return self.not_a_statement(start),
            },
            Lexeme::Word(word) if *self.ahead(1) == Lexeme::Sign("=") => match word.len() {
                1 if word.eq_ignore_ascii_case("S") => self.set(path, true),
                1 if word.eq_ignore_ascii_case("R") => self.set(path, false),
                3 if word.eq_ignore_ascii_case("REF") => return self.reference(),
                _ => return self.not_a_statement(start),
            },
            _ => return self.not_a_statement(start),
        };
        self.need_semicolon(&ENDS);
        kind
    }

    fn not_a_statement(&mut self, start: usize) -> StatementKind {
        match self.peek() {
            Lexeme::Sign("?=") => return self.reference(),
            Lexeme::Sign(":") => {
                let span = self.since(start);
                let help = "use IF, CASE or a loop";
                self.refuse("labels in Structured Text are", span, Some(help));
                self.skip();
                return StatementKind::Nothing;
            }
            _ => self.expected("`:=` or `(`"),
        }
        self.recover(&ENDS);
        StatementKind::Nothing
    }

    /// `a REF= b`, `a ?= b`
    fn reference(&mut self) -> StatementKind {
        let start = self.span().start;
        self.skip();
        self.take_sign("=");
        let span = self.since(start);
        let help = "programs have no references; pass the variable as VAR_IN_OUT";
        self.refuse("assignments of references are", span, Some(help));
        self.recover(&ENDS);
        StatementKind::Nothing
    }

    fn call(&mut self, path: Path, start: usize) -> StatementKind {
        let arguments = self.arguments();
        if self.refuse_function(&path) || self.refuse_parts(start) {
            if self.take_sign(":=") {
                self.expression();
            }
            return StatementKind::Nothing;
        }
        StatementKind::Call(path, arguments)
    }

    fn assignment(&mut self, path: Path) -> StatementKind {
        self.skip();
        let value = self.expression();
        if self.at_sign(":=") {
            let span = self.span();
            let help = "write one assignment for each variable";
            self.refuse("several assignments in one statement are", span, Some(help));
            while self.take_sign(":=") {
                self.expression();
            }
            return StatementKind::Nothing;
        }
        StatementKind::Assign(path, value)
    }

    /// `a += b`
    fn compound(&mut self, path: Path, operator: Operator) -> StatementKind {
        self.skip();
        let right = self.expression();
        let left =
            Expression { span: path.span.clone(), kind: ExpressionKind::Variable(path.clone()) };
        let value = Expression {
            span: right.span.clone(),
            kind: ExpressionKind::Chain(Box::new(left), vec![(operator, right)]),
        };
        StatementKind::Assign(path, value)
    }

    /// `a S= b`, `a R= b`
    fn set(&mut self, path: Path, value: bool) -> StatementKind {
        self.skip();
        self.skip();
        let condition = self.expression();
        let span = self.since(path.span.start);
        let value = Expression {
            kind: ExpressionKind::Literal(Literal::Boolean(value)),
            span: span.clone(),
        };
        let statement =
            Statement { kind: StatementKind::Assign(path, value), span, comments: Vec::new() };
        StatementKind::If(vec![(condition, vec![statement])], Vec::new())
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
            self.need_word("THEN");
            branches.push((condition, self.statements(&["END_IF"])));
            if !self.take_word("ELSIF") {
                break;
            }
        }
        if self.take_word("ELSE") {
            self.take_sign(";");
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
        while !self.at_list_end() && !self.at_end() {
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
        let counter = self.path();
        self.need_sign(":=");
        let from = self.expression();
        self.need_word("TO");
        let to = self.expression();
        let by = self.take_word("BY").then(|| self.expression());
        self.need_word("DO");
        let body = self.statements(&["END_FOR"]);
        self.close("END_FOR");
        match counter {
            Some(counter) => StatementKind::For(Box::new(For { counter, from, to, by, body })),
            None => StatementKind::Nothing,
        }
    }

    fn while_statement(&mut self) -> StatementKind {
        let condition = self.expression();
        self.need_word("DO");
        let body = self.statements(&["END_WHILE"]);
        self.close("END_WHILE");
        StatementKind::While(condition, body)
    }

    fn repeat_statement(&mut self) -> StatementKind {
        let body = self.statements(&["UNTIL"]);
        self.need_word("UNTIL");
        let condition = self.expression();
        self.take_sign(";");
        self.close("END_REPEAT");
        StatementKind::Repeat(body, condition)
    }
}
