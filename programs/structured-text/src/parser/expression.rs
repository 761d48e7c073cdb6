//! Expressions, by the ranks of their operators.

use understudy_typed::Comparison;

use super::Parser;
use crate::lexer::Lexeme;
use crate::syntax::{
    Argument, Expression, ExpressionKind, Literal, Name, Operator, Path, Span, Step,
};

/// Functions of other dialects that work on addresses or on memory made at run time.
const REFUSED_FUNCTIONS: [&str; 7] =
    ["ADRINST", "BITADR", "INDEXOF", "__NEW", "__DELETE", "__QUERYINTERFACE", "__QUERYPOINTER"];

/// Operators that are functions as well.
const FUNCTION_OPERATORS: [&str; 6] = ["AND", "OR", "XOR", "MOD", "AND_THEN", "OR_ELSE"];

impl Parser<'_> {
    pub(super) fn expression(&mut self) -> Expression {
        self.chain(0)
    }

    fn operator(&self) -> Option<Operator> {
        Some(match self.peek() {
            Lexeme::Word(word) => {
                let is = |other: &str| word.eq_ignore_ascii_case(other);
                match word.len() {
                    2 if is("OR") => Operator::Or,
                    3 if is("XOR") => Operator::Xor,
                    3 if is("AND") => Operator::And,
                    3 if is("MOD") => Operator::Modulo,
                    3 if is("DIV") && self.is_siemens => Operator::Divide,
                    7 if is("OR_ELSE") => Operator::OrElse,
                    8 if is("AND_THEN") => Operator::AndThen,
                    _ => return None,
                }
            }
            Lexeme::Sign("&") => Operator::And,
            Lexeme::Sign(sign) => return Operator::of_sign(sign),
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
            let span = self.since(left.span.start);
            left = Expression { kind: ExpressionKind::Chain(Box::new(left), rest), span };
        }
        left
    }

    /// What an operator in front is applied to. In SCL a NOT reaches over comparisons, and a sign over powers.
    fn signed(&mut self, rank_in_siemens: u8) -> Box<Expression> {
        Box::new(match self.is_siemens {
            true => self.deeper(|parser| parser.chain(rank_in_siemens)),
            false => self.deeper(Self::operand),
        })
    }

    pub(super) fn operand(&mut self) -> Expression {
        let start = self.span().start;
        let kind = match self.peek() {
            Lexeme::Sign("+") => {
                self.skip();
                return *self.signed(Operator::Power.rank());
            }
            Lexeme::Sign("-") => {
                self.skip();
                ExpressionKind::Minus(self.signed(Operator::Power.rank()))
            }
            Lexeme::Sign("(") => {
                self.skip();
                let inner = self.deeper(Self::expression);
                self.need_sign(")");
                let span = self.since(start);
                return Expression { span, ..inner };
            }
            Lexeme::Literal(_) if self.at_quoted_name() => self.variable(start),
            Lexeme::Literal(literal) => {
                let literal = ExpressionKind::Literal((**literal).clone());
                self.skip();
                literal
            }
            Lexeme::Qualified(_) => self.qualified(),
            Lexeme::Faulty | Lexeme::Code(_) => {
                self.expected("a value");
                self.skip();
                ExpressionKind::Faulty
            }
            Lexeme::Address(_) => self.variable(start),
            Lexeme::Word(word) => match word.len() {
                4 if word.eq_ignore_ascii_case("TRUE") => self.boolean(true),
                5 if word.eq_ignore_ascii_case("FALSE") => self.boolean(false),
                3 if word.eq_ignore_ascii_case("NOT") => {
                    self.skip();
                    ExpressionKind::Not(self.signed(Operator::Compare(Comparison::Equal).rank()))
                }
                _ => self.variable(start),
            },
            Lexeme::Sign(".") => {
                let span = self.span();
                self.refuse(
                    "names of the global namespace, with a point in front, are",
                    span,
                    Some(
                        "write the name without the point, and give a local variable another name",
                    ),
                );
                self.skip();
                return self.operand_behind_point();
            }
            Lexeme::Sign(_) | Lexeme::End => {
                self.expected("a value");
                ExpressionKind::Faulty
            }
        };
        let span = self.since(start);
        Expression { kind, span }
    }

    fn operand_behind_point(&mut self) -> Expression {
        let span = self.span();
        if self.word().is_some() {
            self.path();
        }
        let kind = ExpressionKind::Faulty;
        Expression { kind, span }
    }

    fn boolean(&mut self, value: bool) -> ExpressionKind {
        self.skip();
        ExpressionKind::Literal(Literal::Boolean(value))
    }

    /// `Colour#red`
    fn qualified(&mut self) -> ExpressionKind {
        let span = self.span();
        let written = self.written();
        self.skip();
        let Some((of, name)) = written.split_once('#') else {
            return ExpressionKind::Faulty;
        };
        let middle = span.start + of.len();
        ExpressionKind::Qualified(
            Name::new(of, span.start..middle),
            Name::new(name, middle + 1..span.end),
        )
    }

    /// A variable or a call.
    fn variable(&mut self, start: usize) -> ExpressionKind {
        let is_function = self.at_any(&FUNCTION_OPERATORS) && *self.ahead(1) == Lexeme::Sign("(");
        let path = if is_function {
            let span = self.span();
            let root = self.part_name("a function");
            root.map(|root| Path { root, steps: Vec::new(), span })
        } else {
            self.path()
        };
        let Some(path) = path else {
            return ExpressionKind::Faulty;
        };
        if !self.at_sign("(") {
            return ExpressionKind::Variable(path);
        }
        let arguments = self.arguments();
        if self.refuse_function(&path) || self.refuse_parts(start) {
            return ExpressionKind::Faulty;
        }
        ExpressionKind::Call(path, arguments)
    }

    /// Refuses functions that work on addresses.
    pub(super) fn refuse_function(&mut self, path: &Path) -> bool {
        let refused = REFUSED_FUNCTIONS.iter().find(|name| path.root.is(name));
        let Some(name) = refused.filter(|_| path.steps.is_empty()) else {
            return false;
        };
        let help = "programs have no pointers; pass the variable as VAR_IN_OUT";
        self.refuse(&format!("`{name}` is"), path.root.span(), Some(help));
        true
    }

    /// Refuses `f(x).part` and `f(x)[1]`.
    pub(super) fn refuse_parts(&mut self, start: usize) -> bool {
        if !self.at_sign(".") && !self.at_sign("[") && !self.at_sign("^") {
            return false;
        }
        while self.at_sign(".") || self.at_sign("[") || self.at_sign("^") || self.at_sign("(") {
            if self.at_sign("(") {
                self.arguments();
            } else if self.take_sign(".") {
                self.skip();
            } else if self.take_sign("[") {
                self.index();
            } else {
                self.skip();
            }
        }
        let span = self.since(start);
        let help = "assign the result to a variable first";
        self.refuse("parts of the result of a call are", span, Some(help));
        true
    }

    pub(super) fn deeper(&mut self, read: impl FnOnce(&mut Self) -> Expression) -> Expression {
        let span = self.span();
        let kind = ExpressionKind::Faulty;
        self.enter(read).unwrap_or_else(|| {
            self.recover_expression();
            Expression { kind, span }
        })
    }

    /// Skips what is too deep.
    pub(super) fn recover_expression(&mut self) {
        while !self.at_sign(";") && !self.at_any(&["THEN", "DO", "OF"]) && !self.at_end() {
            self.skip();
        }
    }

    /// `pause.Q`, `a[1, i].b^`, `word.3` or `%IX0.0`.
    pub(super) fn path(&mut self) -> Option<Path> {
        let start = self.span().start;
        let root = match self.peek() {
            Lexeme::Address(address) => {
                let root = Name::new(address.to_ascii_uppercase(), self.span());
                self.skip();
                root
            }
            _ => self.name("a value")?,
        };
        let mut steps = Vec::new();
        loop {
            if self.take_sign(".") {
                steps.push(self.part()?);
            } else if self.take_sign("[") {
                steps.push(Step::Index(self.index()));
            } else if self.take_sign("^") {
                steps.push(Step::Follow);
            } else {
                break;
            }
        }
        let span = self.since(start);
        Some(Path { root, steps, span })
    }

    /// What is behind a point.
    fn part(&mut self) -> Option<Step> {
        let span = self.span();
        match self.peek() {
            Lexeme::Literal(literal) => {
                if let Literal::Integer { value, of: None, .. } = **literal
                    && let Ok(number) = u32::try_from(value)
                {
                    self.skip();
                    let width = 1;
                    return Some(Step::Bits { width, number, span });
                }
            }
            Lexeme::Address(address) => {
                let bits = partial(address, span.clone());
                if bits.is_some() {
                    self.skip();
                    return bits;
                }
            }
            _ => {}
        }
        self.part_name("a part of the variable").map(Step::Field)
    }

    /// The content of `[…]`, behind its bracket.
    fn index(&mut self) -> Vec<Expression> {
        let mut indices = Vec::new();
        loop {
            indices.push(self.deeper(Self::expression));
            if !self.take_sign(",") {
                break;
            }
        }
        self.need_sign("]");
        indices
    }

    /// The content of the brackets of a call.
    pub(super) fn arguments(&mut self) -> Vec<Argument> {
        let mut arguments = Vec::new();
        self.need_sign("(");
        while !self.at_sign(")") && !self.at_sign(";") && !self.at_end() {
            match self.enter(Self::argument) {
                Some(argument) => arguments.extend(argument),
                None => self.recover_expression(),
            }
            if !self.take_sign(",") {
                break;
            }
        }
        self.need_sign(")");
        arguments
    }

    pub(super) fn argument(&mut self) -> Option<Argument> {
        let is_negated = self.at_word("NOT") && *self.ahead(2) == Lexeme::Sign("=>");
        if is_negated {
            self.skip();
        }
        match self.ahead(1) {
            Lexeme::Sign(":=") => {
                let name = self.part_name("an input of the block")?;
                self.skip();
                let is_left_out = self.at_sign(",") || self.at_sign(")");
                (!is_left_out).then(|| Argument::Given(name, self.expression()))
            }
            Lexeme::Sign("=>") => {
                let from = self.part_name("an output of the block")?;
                self.skip();
                if self.at_sign(",") || self.at_sign(")") {
                    return None;
                }
                Some(Argument::Taken { from, to: self.path()?, negated: is_negated })
            }
            _ => Some(Argument::Placed(self.expression())),
        }
    }
}

/// `%X3`, `%B1`, `%W0`, `%D1`, and `%3` for a bit.
fn partial(address: &str, span: Span) -> Option<Step> {
    let rest = address.strip_prefix('%')?;
    let (width, digits) = match rest.bytes().next()? {
        b'X' | b'x' => (1, &rest[1..]),
        b'B' | b'b' => (8, &rest[1..]),
        b'W' | b'w' => (16, &rest[1..]),
        b'D' | b'd' => (32, &rest[1..]),
        _ => (1, rest),
    };
    let number = digits.parse().ok()?;
    Some(Step::Bits { width, number, span })
}
