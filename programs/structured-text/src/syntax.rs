//! What a text says, before anybody asks what it means: declarations, statements, expressions.
//!
//! Operators of one rank stand in one [`ExpressionKind::Chain`], so the depth of a tree is that of its brackets, which the
//! parser bounds, and every walk over it may recurse.

mod statement;

use std::fmt;
use std::ops::Range;

pub use statement::{
    Argument, Expression, ExpressionKind, For, Label, Literal, Operator, Path, Statement,
    StatementKind, Step,
};

/// A place in a text, in bytes.
pub type Span = Range<usize>;

/// A name and where it stands. Equal to another where the letters are, in capitals or not.
#[derive(Debug, Clone)]
pub struct Name {
    text: String,
    span: Span,
}

impl Name {
    /// A name at a place.
    pub fn new(text: impl Into<String>, span: Span) -> Self {
        Self { text: text.into(), span }
    }

    /// As written.
    pub fn as_str(&self) -> &str {
        &self.text
    }

    /// In capitals, for comparing.
    pub fn key(&self) -> String {
        self.text.to_ascii_uppercase()
    }

    /// Where it stands.
    pub fn span(&self) -> Span {
        self.span.clone()
    }

    /// Whether it is this word, in capitals or not.
    pub fn is(&self, word: &str) -> bool {
        self.text.eq_ignore_ascii_case(word)
    }
}

impl PartialEq for Name {
    fn eq(&self, other: &Self) -> bool {
        self.is(&other.text)
    }
}

impl Eq for Name {}

impl fmt::Display for Name {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(&self.text)
    }
}

/// A whole text.
#[derive(Debug, Clone, Default)]
pub struct File {
    /// Programs, function blocks and functions, in the order of the text.
    pub units: Vec<Unit>,
    /// `VAR_GLOBAL`, of the file, of configurations and of resources.
    pub globals: Vec<Declaration>,
    /// `TYPE`
    pub types: Vec<TypeDefinition>,
    /// Tasks of all resources.
    pub tasks: Vec<Task>,
    /// `PROGRAM name WITH task : type`
    pub instances: Vec<ProgramInstance>,
    /// `INTERFACE`, of which only the names are kept.
    pub interfaces: Vec<Name>,
    /// `VAR_CONFIG`, `VAR_ACCESS` and what stands in an `INTERFACE`, which are read past: where they stand.
    pub read_past: Vec<Span>,
}

impl File {
    /// Adds what another text declares.
    pub fn append(&mut self, other: Self) {
        let Self { units, globals, types, tasks, instances, interfaces, read_past } = other;
        self.units.extend(units);
        self.globals.extend(globals);
        self.types.extend(types);
        self.tasks.extend(tasks);
        self.instances.extend(instances);
        self.interfaces.extend(interfaces);
        self.read_past.extend(read_past);
    }

    /// Removes what was there of `before`, at the beginning of each list.
    pub fn remove_first(&mut self, before: &Self) {
        self.units.drain(..before.units.len());
        self.globals.drain(..before.globals.len());
        self.types.drain(..before.types.len());
        self.tasks.drain(..before.tasks.len());
        self.instances.drain(..before.instances.len());
        self.interfaces.drain(..before.interfaces.len());
        self.read_past.drain(..before.read_past.len());
    }
}

/// What a unit is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum UnitKind {
    /// `PROGRAM`
    Program,
    /// `FUNCTION_BLOCK`
    FunctionBlock,
    /// `FUNCTION`
    Function,
    /// `METHOD` of a function block.
    Method,
}

/// A program organisation unit.
#[derive(Debug, Clone)]
pub struct Unit {
    /// What it is.
    pub kind: UnitKind,
    /// Its name.
    pub name: Name,
    /// Comments above it.
    pub comments: Vec<String>,
    /// What a function or method answers with.
    pub result: Option<TypeName>,
    /// Its variables, in the order of the text.
    pub declarations: Vec<Declaration>,
    /// Its statements, or its chart.
    pub body: Body,
    /// Methods of a function block.
    pub methods: Vec<Unit>,
    /// `EXTENDS`
    pub extends: Option<Name>,
    /// `IMPLEMENTS`; `ABSTRACT`, `FINAL` and access words are read past.
    pub implements: Vec<Name>,
    /// The whole unit.
    pub span: Span,
}

/// The body of a unit.
#[derive(Debug, Clone)]
pub enum Body {
    /// Structured Text.
    Statements(Vec<Statement>),
    /// A sequential function chart.
    Chart(Chart),
    /// An instruction list.
    Instructions(Vec<Instruction>),
}

impl Default for Body {
    fn default() -> Self {
        Self::Statements(Vec::new())
    }
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
    /// `VAR`
    Local,
    /// `VAR_TEMP`
    Temporary,
    /// `VAR_STAT`: kept from call to call, also in a method or function of dialects.
    Static,
    /// `VAR_EXTERNAL`
    External,
    /// `VAR_GLOBAL`
    Global,
}

/// What a block of declarations says of the restart after a loss of power.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Retention {
    /// Nothing: a variable of an instance is kept where its instance is, any other is not kept.
    #[default]
    Unstated,
    /// `RETAIN` or `PERSISTENT`: it is kept.
    Retained,
    /// `NON_RETAIN`: it begins with its initial value.
    NotRetained,
}

/// One variable.
#[derive(Debug, Clone)]
pub struct Declaration {
    /// Its name.
    pub name: Name,
    /// Its block.
    pub class: Class,
    /// `CONSTANT`
    pub constant: bool,
    /// `RETAIN`, `PERSISTENT` or `NON_RETAIN`
    pub retention: Retention,
    /// `R_EDGE` (true) or `F_EDGE` (false).
    pub edge: Option<bool>,
    /// With its `%`, in capitals.
    pub address: Option<Name>,
    /// Its type.
    pub of: TypeName,
    /// Its initial value.
    pub initial: Option<Initializer>,
    /// The comment at it.
    pub description: Option<String>,
}

/// A type as it is written.
#[derive(Debug, Clone)]
pub struct TypeName {
    /// What it is.
    pub kind: TypeKind,
    /// Where it stands.
    pub span: Span,
}

/// What is written for a type.
#[derive(Debug, Clone)]
pub enum TypeKind {
    /// A name, elementary or defined; with its namespaces left out.
    Named(Name),
    /// `INT (0..9)`
    Subrange(Name, Box<Expression>, Box<Expression>),
    /// `STRING`, `STRING[n]`, `STRING(n)`; wide ones too.
    Text {
        /// `WSTRING`
        wide: bool,
        /// The number in brackets.
        length: Option<Box<Expression>>,
    },
    /// `ARRAY [a..b, c..d] OF element`
    Array(Vec<(Expression, Expression)>, Box<TypeName>),
    /// `ARRAY [*, *] OF element`: of any bounds, for `VAR_IN_OUT`.
    OpenArray(usize, Box<TypeName>),
    /// `STRUCT … END_STRUCT`
    Structure(Vec<Declaration>),
    /// `(red, green := 5)`, perhaps with the type of its values.
    Enumeration(Vec<(Name, Option<Expression>)>, Option<Name>),
    /// `POINTER TO`, `REF_TO`, `REFERENCE TO`
    Pointer(Box<TypeName>),
}

/// `TYPE name : … := initial; END_TYPE`
#[derive(Debug, Clone)]
pub struct TypeDefinition {
    /// Its name.
    pub name: Name,
    /// What it stands for.
    pub of: TypeName,
    /// The initial value of its variables.
    pub initial: Option<Initializer>,
}

/// An initial value.
#[derive(Debug, Clone)]
pub enum Initializer {
    /// `5`, `a + 1`
    Value(Expression),
    /// `[1, 2, 3(0), 2(1, 2)]`: how often (none: once) and what.
    Array(Vec<(Option<Expression>, Vec<Initializer>)>, Span),
    /// `(a := 1, b := [1, 2])`
    Structure(Vec<(Name, Initializer)>, Span),
}

/// `TASK name (INTERVAL := T#10ms, PRIORITY := 1)`
#[derive(Debug, Clone)]
pub struct Task {
    /// Its name.
    pub name: Name,
    /// Nanoseconds.
    pub interval: Option<i64>,
    /// Less is more urgent.
    pub priority: Option<i64>,
    /// `SINGLE`: run by an event.
    pub single: Option<Expression>,
}

/// `PROGRAM name WITH task : type;`
#[derive(Debug, Clone)]
pub struct ProgramInstance {
    /// Its name.
    pub name: Name,
    /// What is said of all its variables.
    pub retention: Retention,
    /// Its task.
    pub task: Option<Name>,
    /// The PROGRAM that it is one of.
    pub of: Name,
    /// What its inputs and outputs are connected to: `(in := a, q => b)`.
    pub connections: Vec<Argument>,
}

/// A sequential function chart.
#[derive(Debug, Clone, Default)]
pub struct Chart {
    /// Its steps; one of them is the initial one.
    pub steps: Vec<ChartStep>,
    /// Its transitions.
    pub transitions: Vec<Transition>,
    /// `ACTION name: … END_ACTION`
    pub actions: Vec<Action>,
}

/// `STEP name: action(N); END_STEP`
#[derive(Debug, Clone)]
pub struct ChartStep {
    /// Its name.
    pub name: Name,
    /// `INITIAL_STEP`
    pub is_initial: bool,
    /// What is done while it is active.
    pub associations: Vec<Association>,
}

/// An action at a step.
#[derive(Debug, Clone)]
pub struct Association {
    /// An action of the chart, or a BOOL variable.
    pub action: Name,
    /// `N`, `R`, `S`, `P`, `P0`, `P1`, `L`, `D`, `SD`, `DS`, `SL`; N where it is left out.
    pub qualifier: Name,
    /// The duration of L, D, SD, DS and SL.
    pub duration: Option<Expression>,
    /// Indicator variables, which are read past.
    pub indicators: Vec<Name>,
}

/// `TRANSITION FROM a TO b := condition; END_TRANSITION`
#[derive(Debug, Clone)]
pub struct Transition {
    /// Its name.
    pub name: Option<Name>,
    /// `(PRIORITY := n)`: less is first.
    pub priority: Option<i64>,
    /// Steps that are left, all of which must be active.
    pub from: Vec<Name>,
    /// Steps that are entered.
    pub to: Vec<Name>,
    /// Of type BOOL.
    pub condition: Expression,
    /// Where it stands.
    pub span: Span,
}

/// `ACTION name: statements END_ACTION`
#[derive(Debug, Clone)]
pub struct Action {
    /// Its name.
    pub name: Name,
    /// What it does.
    pub body: Vec<Statement>,
}

/// A line of an instruction list: `label: LDN a`.
#[derive(Debug, Clone)]
pub struct Instruction {
    /// The label in front.
    pub label: Option<Name>,
    /// The operator with its modifiers, in capitals: `LDN`, `JMPC`, `AND(`, `)`; empty where a label stands alone.
    pub operator: String,
    /// Its operand, or that of a function its operands.
    pub operands: Vec<Argument>,
    /// Where it stands.
    pub span: Span,
}
