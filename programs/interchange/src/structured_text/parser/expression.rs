//! Expressions, by the ranks of their operators.

use super::super::lexer::Lexeme;
use super::super::syntax::{Argument, Expression, ExpressionKind, Operator, Path};
use super::Parser;
use understudy_ladder::Name;

impl Parser {
    pub(super) fn expression(&mut self) -> Expression {
        self.chain(0)
    }

    fn operator(&self) -> Option<Operator> {
        Some(match self.peek() {
            Lexeme::Word(word) => match word.to_ascii_uppercase().as_str() {
                "OR" => Operator::Or,
                "XOR" => Operator::Xor,
                "AND" => Operator::And,
                "MOD" => Operator::Modulo,
                _ => return None,
            },
            Lexeme::Sign(sign) => match *sign {
                "=" => Operator::Equal,
                "<>" => Operator::NotEqual,
                "<" => Operator::Less,
                "<=" => Operator::LessOrEqual,
                ">" => Operator::Greater,
                ">=" => Operator::GreaterOrEqual,
                "+" => Operator::Add,
                "-" => Operator::Subtract,
                "*" => Operator::Multiply,
                "/" => Operator::Divide,
                "**" => Operator::Power,
                _ => return None,
            },
            _ => return None,
        })
    }

    /// Operands joined by operators of at least `least` rank.
    fn chain(&mut self, least: u8) -> Expression {
        let mut left = self.operand();
        while let Some(first) = self.operator().filter(|first| first.rank() >= least) {
            let mut rest = Vec::new();
            while let Some(operator) = self.operator().filter(|next| next.rank() == first.rank()) {
                self.skip();
                rest.push((operator, self.chain(first.rank() + 1)));
            }
            let span = left.span.start..self.end();
            left = Expression {
                kind: ExpressionKind::Chain(Box::new(left), rest),
                span,
            };
        }
        left
    }

    fn operand(&mut self) -> Expression {
        let span = self.span();
        let kind = match self.peek().clone() {
            Lexeme::Sign("+") => {
                self.skip();
                return self.deeper(Self::operand);
            }
            Lexeme::Sign("-") => {
                self.skip();
                ExpressionKind::Minus(Box::new(self.deeper(Self::operand)))
            }
            Lexeme::Sign("(") => {
                self.skip();
                let inner = self.deeper(Self::expression);
                self.need_sign(")");
                return Expression {
                    span: span.start..self.end(),
                    ..inner
                };
            }
            Lexeme::Number(number) => self.literal(ExpressionKind::Integer(number)),
            Lexeme::Time(time) => self.literal(ExpressionKind::Time(time)),
            Lexeme::Foreign(what) => self.literal(ExpressionKind::Foreign(what)),
            Lexeme::Faulty => self.literal(ExpressionKind::Faulty),
            Lexeme::Address(_) => match self.path() {
                Some(path) => ExpressionKind::Variable(path),
                None => ExpressionKind::Faulty,
            },
            Lexeme::Word(word) => match word.to_ascii_uppercase().as_str() {
                "TRUE" => self.literal(ExpressionKind::Boolean(true)),
                "FALSE" => self.literal(ExpressionKind::Boolean(false)),
                "NOT" => {
                    self.skip();
                    ExpressionKind::Not(Box::new(self.deeper(Self::operand)))
                }
                // These operators are functions as well.
                "AND" | "OR" | "XOR" | "MOD" if self.next_opens() => {
                    let name = Name::at(word, span.clone());
                    self.skip();
                    ExpressionKind::Call(name, self.arguments())
                }
                _ => match self.path() {
                    Some(path) if self.at_sign("(") && path.parts.len() == 1 => {
                        let name = path.parts[0].clone();
                        ExpressionKind::Call(name, self.arguments())
                    }
                    Some(path) => ExpressionKind::Variable(path),
                    None => ExpressionKind::Faulty,
                },
            },
            Lexeme::Sign(_) | Lexeme::End => {
                self.expected("a value");
                ExpressionKind::Faulty
            }
        };
        Expression {
            kind,
            span: span.start..self.end().max(span.start),
        }
    }

    fn next_opens(&self) -> bool {
        let next = self.lexemes.get(self.place + 1);
        next.is_some_and(|next| next.lexeme == Lexeme::Sign("("))
    }

    fn literal(&mut self, kind: ExpressionKind) -> ExpressionKind {
        self.skip();
        kind
    }

    fn deeper(&mut self, read: fn(&mut Self) -> Expression) -> Expression {
        let span = self.span();
        let kind = ExpressionKind::Faulty;
        self.enter(read).unwrap_or_else(|| {
            self.recover_expression();
            Expression { kind, span }
        })
    }

    /// Skips what is too deep.
    fn recover_expression(&mut self) {
        while !self.at_sign(";")
            && !self.at_any(&["THEN", "DO", "OF"])
            && *self.peek() != Lexeme::End
        {
            self.skip();
        }
    }

    /// `pause.Q` or `%IX0.0`.
    pub(super) fn path(&mut self) -> Option<Path> {
        let start = self.span().start;
        if let Lexeme::Address(address) = self.peek().clone() {
            let span = self.span();
            self.skip();
            let parts = vec![Name::at(format!("%{address}"), span.clone())];
            return Some(Path { parts, span });
        }
        let mut parts = vec![self.name("a value")?];
        while self.take_sign(".") {
            parts.push(self.name("a variable of the block")?);
        }
        let span = start..self.end();
        Some(Path { parts, span })
    }

    /// The content of the brackets of a call.
    pub(super) fn arguments(&mut self) -> Vec<Argument> {
        let mut arguments = Vec::new();
        self.need_sign("(");
        while !self.at_sign(")") && !self.at_sign(";") && *self.peek() != Lexeme::End {
            let before = self.place;
            match self.enter(Self::argument) {
                Some(argument) => arguments.extend(argument),
                None => self.recover_expression(),
            }
            if !self.take_sign(",") {
                break;
            }
            if self.place == before {
                self.skip();
            }
        }
        self.need_sign(")");
        arguments
    }

    fn argument(&mut self) -> Option<Argument> {
        let next = self.lexemes.get(self.place + 1).map(|next| &next.lexeme);
        match next {
            Some(Lexeme::Sign(":=")) => {
                let name = self.name("an input of the block")?;
                self.skip();
                Some(Argument::Given(name, self.expression()))
            }
            Some(Lexeme::Sign("=>")) => {
                let name = self.name("an output of the block")?;
                self.skip();
                Some(Argument::Taken(name, self.path()?))
            }
            _ => Some(Argument::Placed(self.expression())),
        }
    }
}
