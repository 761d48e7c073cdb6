//! What a text says, before anybody asks what it means: program organisation units, declarations, statements, expressions.
//!
//! Operators of one rank stand in one [`ExpressionKind::Chain`], so the depth of a tree is that of its brackets, which the
//! parser bounds, and every walk over it may recurse.

use std::ops::Range;
use std::time::Duration;

use understudy_ladder::Name;

/// A whole text.
#[derive(Debug, Clone, Default)]
pub(crate) struct File {
    /// Programs, function blocks and functions, in the order of the text.
    pub(crate) units: Vec<Unit>,
    /// `VAR_GLOBAL` of configurations and resources.
    pub(crate) globals: Vec<Declaration>,
    /// Enumerated and subrange types.
    pub(crate) types: Vec<TypeDefinition>,
    /// The interval of the first task.
    pub(crate) period: Option<Duration>,
}

/// What a unit is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum UnitKind {
    Program,
    FunctionBlock,
    Function,
}

/// A program organisation unit.
#[derive(Debug, Clone)]
pub(crate) struct Unit {
    pub(crate) kind: UnitKind,
    pub(crate) name: Name,
    pub(crate) comments: Vec<String>,
    /// Comments behind the last statement.
    pub(crate) footer: Vec<String>,
    /// What a function answers.
    pub(crate) result: Option<TypeName>,
    pub(crate) declarations: Vec<Declaration>,
    pub(crate) body: Vec<Statement>,
    /// Its text is another one than that of the units that use it, so its places mean nothing there.
    pub(crate) foreign: bool,
}

/// Of which block of declarations a variable is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Class {
    /// `VAR_INPUT`
    Input,
    /// `VAR_OUTPUT`
    Output,
    /// `VAR_IN_OUT`
    InOut,
    /// `VAR` and `VAR_TEMP`; located at an input or output address it is an input or output of the program.
    Local,
    /// `VAR_EXTERNAL`: declared in the configuration.
    External,
}

/// One variable.
#[derive(Debug, Clone)]
pub(crate) struct Declaration {
    pub(crate) name: Name,
    pub(crate) class: Class,
    pub(crate) constant: bool,
    /// Begins anew in every execution (`VAR_TEMP`).
    pub(crate) temporary: bool,
    /// Without its `%`, in capitals.
    pub(crate) address: Option<Name>,
    pub(crate) type_name: TypeName,
    pub(crate) initial: Option<Expression>,
    pub(crate) description: Option<String>,
}

/// A type as it is named, with its subrange.
#[derive(Debug, Clone)]
pub(crate) struct TypeName {
    pub(crate) name: Name,
    pub(crate) range: Option<(i64, i64)>,
}

/// `TYPE name : …; END_TYPE`
#[derive(Debug, Clone)]
pub(crate) struct TypeDefinition {
    pub(crate) name: Name,
    pub(crate) meaning: TypeMeaning,
}

/// What a defined type is.
#[derive(Debug, Clone)]
pub(crate) enum TypeMeaning {
    /// Its values, counted from 0.
    Enumeration(Vec<Name>),
    /// Another name, perhaps with a subrange.
    Alias(TypeName),
}

/// One statement.
#[derive(Debug, Clone)]
pub(crate) struct Statement {
    pub(crate) kind: StatementKind,
    pub(crate) span: Range<usize>,
    pub(crate) comments: Vec<String>,
}

#[derive(Debug, Clone)]
pub(crate) enum StatementKind {
    Assign(Path, Expression),
    Call(Path, Vec<Argument>),
    If(Vec<(Expression, Vec<Statement>)>, Vec<Statement>),
    Case(
        Expression,
        Vec<(Vec<Label>, Vec<Statement>)>,
        Vec<Statement>,
    ),
    For(Box<Loop>),
    Leave(Leave),
    /// Understood, and unsupported: what it is.
    Refused(&'static str),
    /// Not understood and already diagnosed, or nothing but a semicolon.
    Nothing,
}

/// What is left before its end.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Leave {
    /// `RETURN`: the unit.
    Unit,
    /// `EXIT`: the loop around.
    Loop,
    /// `CONTINUE`: this turn of the loop around.
    Turn,
}

/// `FOR counter := from TO to BY by DO body END_FOR`
#[derive(Debug, Clone)]
pub(crate) struct Loop {
    pub(crate) counter: Name,
    pub(crate) from: Expression,
    pub(crate) to: Expression,
    pub(crate) by: Option<Expression>,
    pub(crate) body: Vec<Statement>,
}

/// One value or range of values of a CASE.
#[derive(Debug, Clone)]
pub(crate) struct Label {
    pub(crate) first: Expression,
    pub(crate) last: Option<Expression>,
}

/// A variable, or a variable of an instance: `pause.Q`. One part that begins with `%` is an address.
#[derive(Debug, Clone)]
pub(crate) struct Path {
    pub(crate) parts: Vec<Name>,
    pub(crate) span: Range<usize>,
}

impl Path {
    /// As written.
    pub(crate) fn text(&self) -> String {
        let parts: Vec<&str> = self.parts.iter().map(Name::as_str).collect();
        parts.join(".")
    }
}

/// What a call gives or takes.
#[derive(Debug, Clone)]
pub(crate) enum Argument {
    /// A value for the input at this place.
    Placed(Expression),
    /// `IN := a`
    Given(Name, Expression),
    /// `Q => y`
    Taken(Name, Path),
}

/// One expression.
#[derive(Debug, Clone)]
pub(crate) struct Expression {
    pub(crate) kind: ExpressionKind,
    pub(crate) span: Range<usize>,
}

#[derive(Debug, Clone)]
pub(crate) enum ExpressionKind {
    Boolean(bool),
    Integer(i64),
    Time(Duration),
    /// Something that no circuit can hold, in words.
    Foreign(&'static str),
    Variable(Path),
    Not(Box<Expression>),
    Minus(Box<Expression>),
    /// Operators of one rank, from left to right.
    Chain(Box<Expression>, Vec<(Operator, Expression)>),
    Call(Name, Vec<Argument>),
    /// Already diagnosed.
    Faulty,
}

/// An operator between two operands.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Operator {
    Or,
    Xor,
    And,
    Equal,
    NotEqual,
    Less,
    LessOrEqual,
    Greater,
    GreaterOrEqual,
    Add,
    Subtract,
    Multiply,
    Divide,
    Modulo,
    Power,
}

impl Operator {
    /// How tightly it binds; more is tighter.
    pub(crate) fn rank(self) -> u8 {
        match self {
            Self::Or => 0,
            Self::Xor => 1,
            Self::And => 2,
            Self::Equal | Self::NotEqual => 3,
            Self::Less | Self::LessOrEqual | Self::Greater | Self::GreaterOrEqual => 4,
            Self::Add | Self::Subtract => 5,
            Self::Multiply | Self::Divide | Self::Modulo => 6,
            Self::Power => 7,
        }
    }
}
