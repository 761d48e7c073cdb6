//! Instruction lists.

use super::{Parser, is_keyword};
use crate::lexer::Lexeme;
use crate::syntax::{Argument, Expression, ExpressionKind, Instruction, Name};

/// Operators without their modifiers C, N and `(`.
const OPERATORS: [&str; 29] = [
    "LD", "ST", "S", "R", "S1", "R1", "CLK", "CU", "CD", "PV", "IN", "PT", "AND", "OR", "XOR",
    "NOT", "ADD", "SUB", "MUL", "DIV", "MOD", "GT", "GE", "EQ", "NE", "LE", "LT", "JMP", "CAL",
];

/// Operators that may be negated.
const NEGATED: [&str; 7] = ["LDN", "STN", "ANDN", "ORN", "XORN", "JMPN", "CALN"];

/// Operators that depend on the result.
const CONDITIONAL: [&str; 8] = ["JMPC", "JMPCN", "CALC", "CALCN", "RETC", "RETCN", "RET", "RETN"];

/// Operators that an expression in brackets may follow, up to its bracket.
const BRACKETED: [&str; 17] = [
    "AND", "ANDN", "OR", "ORN", "XOR", "XORN", "ADD", "SUB", "MUL", "DIV", "MOD", "GT", "GE", "EQ",
    "NE", "LE", "LT",
];

fn is_operator(word: &str) -> bool {
    let mut all = OPERATORS.iter().chain(&NEGATED).chain(&CONDITIONAL);
    all.any(|operator| operator.eq_ignore_ascii_case(word))
}

impl Parser<'_> {
    /// Whether the body that begins here is an instruction list: an operator has its operand behind it, which no statement
    /// has, or it is alone on its line and begins a list.
    pub(super) fn at_instructions(&self) -> bool {
        let mut ahead = 0;
        // Labels, alone on their line or in front of an instruction.
        while matches!(self.ahead(ahead), Lexeme::Word(word) if !is_keyword(word))
            && *self.ahead(ahead + 1) == Lexeme::Sign(":")
        {
            ahead += 2;
        }
        let operator = match self.ahead(ahead) {
            Lexeme::Sign("&") => return true,
            Lexeme::Word(word) if is_operator(word) => word,
            _ => return false,
        };
        let next = &self.lexemes[(self.place + ahead + 1).min(self.lexemes.len() - 1)];
        if next.starts_line {
            return ["LD", "RET", "RETC", "RETCN"]
                .iter()
                .any(|alone| alone.eq_ignore_ascii_case(operator));
        }
        let is_operand = match &next.lexeme {
            Lexeme::Word(word) => {
                !is_keyword(word)
                    || ["TRUE", "FALSE"].iter().any(|value| value.eq_ignore_ascii_case(word))
            }
            Lexeme::Literal(_) | Lexeme::Address(_) | Lexeme::Qualified(_) => true,
            Lexeme::Sign("-") => true,
            _ => false,
        };
        is_operand && !self.line_has_semicolon(ahead)
    }

    fn line_has_semicolon(&self, ahead: usize) -> bool {
        let rest = self.lexemes[self.place + ahead + 1..].iter();
        rest.take_while(|next| !next.starts_line).any(|next| next.lexeme == Lexeme::Sign(";"))
    }

    /// Instructions up to one of `ends`, each on its line.
    pub(super) fn instructions(&mut self, ends: &[&str]) -> Vec<Instruction> {
        let mut instructions = Vec::new();
        while !self.at_end() && !self.at_any(ends) && !self.at_any(&super::statement::ENDS) {
            let before = self.place;
            if let Some(instruction) = self.instruction() {
                instructions.push(instruction);
            }
            if self.place == before {
                self.skip();
            }
        }
        instructions
    }

    fn instruction(&mut self) -> Option<Instruction> {
        let start = self.span().start;
        let mut label = None;
        if matches!(self.peek(), Lexeme::Word(_)) && *self.ahead(1) == Lexeme::Sign(":") {
            label = Some(self.part_name("a label")?);
            self.skip();
        }
        let mut operands = Vec::new();
        let is_alone = label.is_some() && self.placed().starts_line;
        let operator = match self.peek() {
            _ if is_alone => String::new(),
            Lexeme::Sign(")") => {
                self.skip();
                ")".into()
            }
            Lexeme::Sign("&") => {
                self.skip();
                self.operator_with_operands("AND", &mut operands)
            }
            Lexeme::Word(word) => {
                let word = word.to_ascii_uppercase();
                self.skip();
                self.operator_with_operands(&word, &mut operands)
            }
            _ => {
                self.expected("an instruction");
                self.skip();
                self.skip_line();
                return None;
            }
        };
        self.take_sign(";");
        if !self.placed().starts_line && !self.at_end() && !is_alone {
            self.expected("the end of the instruction");
            self.skip_line();
        }
        Some(Instruction { label, operator, operands, span: self.since(start) })
    }

    /// The operator with its bracket, and its operands on this line.
    fn operator_with_operands(&mut self, word: &str, operands: &mut Vec<Argument>) -> String {
        if self.placed().starts_line || self.at_end() {
            return word.to_owned();
        }
        let can_open = BRACKETED.contains(&word);
        if can_open && self.take_sign("(") {
            if !self.placed().starts_line && !self.at_sign(")") {
                operands.push(Argument::Placed(self.instruction_operand()));
                // All of it may be on one line: `AND(a)`.
                if self.at_sign(")") && !self.placed().starts_line {
                    self.skip();
                    return word.to_owned();
                }
            }
            return format!("{word}(");
        }
        if word.starts_with("CAL") && is_operator(word) {
            if let Some(path) = self.path() {
                let kind = ExpressionKind::Variable(path.clone());
                let span = path.span;
                operands.push(Argument::Placed(Expression { kind, span }));
            }
            if self.at_sign("(") {
                operands.extend(self.arguments());
            }
            return word.to_owned();
        }
        // A function with its inputs by name.
        if !is_operator(word) && self.at_sign("(") {
            operands.extend(self.arguments());
            return word.to_owned();
        }
        loop {
            operands.push(Argument::Placed(self.instruction_operand()));
            if !self.take_sign(",") {
                return word.to_owned();
            }
        }
    }

    /// A variable or a value; a label, which may be any word, is a variable too.
    fn instruction_operand(&mut self) -> Expression {
        let span = self.span();
        match self.word() {
            Some(word) if is_keyword(word) && !self.at_any(&["TRUE", "FALSE", "NOT"]) => {
                let root = Name::new(word, span.clone());
                self.skip();
                let path = crate::syntax::Path { root, steps: Vec::new(), span: span.clone() };
                let kind = ExpressionKind::Variable(path);
                Expression { kind, span }
            }
            // What follows on the next line is no operator of this one.
            _ => self.deeper(Self::operand),
        }
    }
}
