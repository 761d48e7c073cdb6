//! Statements and expressions.

use understudy_typed::{Comparison, Elementary};

use super::{Name, Span};

/// One statement.
#[derive(Debug, Clone)]
pub struct Statement {
    /// What it says.
    pub kind: StatementKind,
    /// Where it stands.
    pub span: Span,
    /// Comments above it.
    pub comments: Vec<String>,
}

/// What a statement says.
#[derive(Debug, Clone)]
pub enum StatementKind {
    /// `a := b`; `a ?= b` and `REF=` are refused by the parser.
    Assign(Path, Expression),
    /// `a(IN := b, Q => c);`
    Call(Path, Vec<Argument>),
    /// `IF … ELSIF … ELSE … END_IF`
    If(Vec<(Expression, Vec<Statement>)>, Vec<Statement>),
    /// `CASE`
    Case(Expression, Vec<(Vec<Label>, Vec<Statement>)>, Vec<Statement>),
    /// `FOR`
    For(Box<For>),
    /// `WHILE … DO … END_WHILE`
    While(Expression, Vec<Statement>),
    /// `REPEAT … UNTIL … END_REPEAT`
    Repeat(Vec<Statement>, Expression),
    /// `EXIT`
    Exit,
    /// `CONTINUE`
    Continue,
    /// `RETURN`
    Return,
    /// C code that can write variables, as written; a program that executes it is refused.
    Code(String),
    /// `;`, and what was not understood and is already diagnosed.
    Nothing,
}

/// `FOR counter := from TO to BY by DO body END_FOR`
#[derive(Debug, Clone)]
pub struct For {
    /// What counts.
    pub counter: Path,
    /// Its first value.
    pub from: Expression,
    /// Its last.
    pub to: Expression,
    /// 1 where it is left out.
    pub by: Option<Expression>,
    /// What is repeated.
    pub body: Vec<Statement>,
}

/// One value or range of values of a CASE.
#[derive(Debug, Clone)]
pub struct Label {
    /// The value, or the first of them.
    pub first: Expression,
    /// The last, of a range.
    pub last: Option<Expression>,
}

/// A variable or a part of one: `a`, `a.b[3, i].c`, `word.3`, `%IX0.3`, `SUPER^`.
#[derive(Debug, Clone)]
pub struct Path {
    /// The variable; an address begins with `%`; `THIS` and `SUPER` are names.
    pub root: Name,
    /// What follows.
    pub steps: Vec<Step>,
    /// The whole of it.
    pub span: Span,
}

/// A step into a variable.
#[derive(Debug, Clone)]
pub enum Step {
    /// `.name`
    Field(Name),
    /// `[i, j]`
    Index(Vec<Expression>),
    /// `.3`, `.%X3`, `.%B1`: width in bits and number of the part.
    Bits {
        /// 1, 8, 16 or 32.
        width: u8,
        /// Which, from 0.
        number: u32,
        /// Where it is written.
        span: Span,
    },
    /// `^`
    Follow,
}

/// What a call gives or takes.
#[derive(Debug, Clone)]
pub enum Argument {
    /// A value for the input at this place.
    Placed(Expression),
    /// `IN := a`
    Given(Name, Expression),
    /// `Q => y`, or `NOT Q => y`.
    Taken {
        /// The output.
        from: Name,
        /// Where it goes.
        to: Path,
        /// `NOT`
        negated: bool,
    },
}

/// One expression.
#[derive(Debug, Clone)]
pub struct Expression {
    /// What it says.
    pub kind: ExpressionKind,
    /// Where it stands.
    pub span: Span,
}

/// What an expression says.
#[derive(Debug, Clone)]
pub enum ExpressionKind {
    /// A value written out.
    Literal(Literal),
    /// A variable, or a value of an enumeration; `Colour#red` has its type in front.
    Variable(Path),
    /// `TYPE#name`
    Qualified(Name, Name),
    /// `NOT a`
    Not(Box<Expression>),
    /// `-a`
    Minus(Box<Expression>),
    /// Operators of one rank, from left to right.
    Chain(Box<Expression>, Vec<(Operator, Expression)>),
    /// A call of a function, or of a method through a path; `ADR` and `SIZEOF` too.
    Call(Path, Vec<Argument>),
    /// Not understood and already diagnosed.
    Faulty,
}

/// A value written out. `of` is the type in front of it, `INT#5`.
#[derive(Debug, Clone, PartialEq)]
pub enum Literal {
    /// `TRUE`, `FALSE`, `BOOL#1`
    Boolean(bool),
    /// `5`, `16#FF`, `WORD#2#1010`; without its sign unless the type stands in front.
    Integer {
        /// Its value.
        value: i128,
        /// Its type.
        of: Option<Elementary>,
        /// Its digits are of base 2, 8 or 16: its bits may be meant.
        based: bool,
    },
    /// `1.5`, `REAL#1.5E3`: as written, without `_`, so that it is rounded once, in the type that it gets.
    Real {
        /// What was written.
        text: String,
        /// Its type.
        of: Option<Elementary>,
    },
    /// `T#1s500ms`, `D#2026-11-23`, `TOD#12:00`, `DT#…`: nanoseconds.
    Time {
        /// Its value.
        nanoseconds: i64,
        /// TIME, DATE, TIME_OF_DAY or DATE_AND_TIME.
        of: Elementary,
    },
    /// `'text'`, with `$` sequences resolved; `"wide"` in Latin-1.
    Text {
        /// Its bytes.
        bytes: Vec<u8>,
        /// In double quotes.
        wide: bool,
    },
}

/// An operator between two operands.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Operator {
    /// `OR`
    Or,
    /// `XOR`
    Xor,
    /// `AND`, `&`
    And,
    /// `OR_ELSE`
    OrElse,
    /// `AND_THEN`
    AndThen,
    /// `=` and its like.
    Compare(Comparison),
    /// `+`
    Add,
    /// `-`
    Subtract,
    /// `*`
    Multiply,
    /// `/`
    Divide,
    /// `MOD`
    Modulo,
    /// `**`
    Power,
}

impl Operator {
    /// Each but comparisons with its sign in Structured Text and the name of its function and instruction; OR_ELSE and AND_THEN, which do not look at
    /// all of their operands, have none.
    const WRITTEN: [(Self, &str, Option<&str>); 11] = [
        (Self::Or, "OR", Some("OR")),
        (Self::Xor, "XOR", Some("XOR")),
        (Self::And, "AND", Some("AND")),
        (Self::OrElse, "OR_ELSE", None),
        (Self::AndThen, "AND_THEN", None),
        (Self::Add, "+", Some("ADD")),
        (Self::Subtract, "-", Some("SUB")),
        (Self::Multiply, "*", Some("MUL")),
        (Self::Divide, "/", Some("DIV")),
        (Self::Modulo, "MOD", Some("MOD")),
        (Self::Power, "**", Some("EXPT")),
    ];

    /// As Structured Text writes it.
    pub fn sign(self) -> &'static str {
        if let Self::Compare(comparison) = self {
            return comparison.sign();
        }
        let found = Self::WRITTEN.iter().find(|(of, _, _)| *of == self);
        found.map_or("", |(_, sign, _)| sign)
    }

    /// The function and instruction that it is: `ADD`, `GE`.
    pub fn word(self) -> Option<&'static str> {
        if let Self::Compare(comparison) = self {
            return Some(comparison.word());
        }
        Self::WRITTEN.iter().find(|(of, _, _)| *of == self)?.2
    }

    /// That of a sign of Structured Text; words such as `AND` are among them, in capitals.
    pub fn of_sign(sign: &str) -> Option<Self> {
        let other = || Some(Self::WRITTEN.iter().find(|(_, known, _)| *known == sign)?.0);
        Comparison::of_sign(sign).map(Self::Compare).or_else(other)
    }

    /// That of a function or instruction, in capitals.
    pub fn of_word(word: &str) -> Option<Self> {
        let other = || Some(Self::WRITTEN.iter().find(|(_, _, known)| *known == Some(word))?.0);
        Comparison::of_word(word).map(Self::Compare).or_else(other)
    }

    /// How tightly it binds; more is tighter.
    pub fn rank(self) -> u8 {
        match self {
            Self::Or | Self::OrElse => 0,
            Self::Xor => 1,
            Self::And | Self::AndThen => 2,
            Self::Compare(Comparison::Equal | Comparison::NotEqual) => 3,
            Self::Compare(_) => 4,
            Self::Add | Self::Subtract => 5,
            Self::Multiply | Self::Divide | Self::Modulo => 6,
            Self::Power => 7,
        }
    }
}
