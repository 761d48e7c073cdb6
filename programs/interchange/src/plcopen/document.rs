//! The content of a PLCopen file with its places, before its meaning is checked.

mod macro_step;
mod objects;
mod read;
mod rungs;

use std::ops::Range;
use std::time::Duration;

use understudy_ladder::Name;

use super::xml::Passage;

pub(crate) use objects::CONDITION;
pub(crate) use read::{read, read_bodies};

/// A whole file.
#[derive(Debug, Default)]
pub(crate) struct Project {
    pub(crate) pous: Vec<Pou>,
    /// Global variables of configurations and resources.
    pub(crate) globals: Vec<Variable>,
    /// What runs: the tasks in the order of the file.
    pub(crate) instances: Vec<Instance>,
    /// Content of the file that is not used.
    pub(crate) ignored: Vec<Ignored>,
    /// Written by a tool that declares no instances of blocks; it puts units where the schema has none.
    pub(crate) lacks_instances: bool,
}

/// Something that is not kept, and does not change what the program does.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Ignored {
    pub(crate) what: String,
    pub(crate) span: Range<usize>,
}

/// A program that a task runs.
#[derive(Debug)]
pub(crate) struct Instance {
    pub(crate) type_name: Name,
    pub(crate) interval: Option<Duration>,
    /// An event starts it in place of an interval.
    pub(crate) has_event: bool,
}

/// What a program organisation unit is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum PouKind {
    Program,
    FunctionBlock,
    Function,
}

/// A program organisation unit.
#[derive(Debug)]
pub(crate) struct Pou {
    pub(crate) name: Name,
    pub(crate) kind: PouKind,
    pub(crate) documentation: Option<String>,
    pub(crate) variables: Vec<Variable>,
    pub(crate) body: Option<Body>,
    pub(crate) actions: Vec<Part>,
    pub(crate) transitions: Vec<Part>,
}

/// A named action or transition.
#[derive(Debug)]
pub(crate) struct Part {
    pub(crate) name: Name,
    pub(crate) body: Option<Body>,
}

/// A declared variable, as far as what is lost of a file depends on it.
#[derive(Debug, Clone)]
pub(crate) struct Variable {
    pub(crate) name: Name,
    pub(crate) is_external: bool,
    pub(crate) kind: VariableType,
}

/// A type as it is named.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum VariableType {
    Bool,
    /// A function block, or a type of the file.
    Derived(Name),
    Other,
}

/// What a unit does.
#[derive(Debug)]
pub(crate) enum Body {
    /// LD and FBD, and the networks of an SFC.
    Graph(Graph),
    StructuredText(Passage),
    InstructionList(Passage),
}

/// Objects and the wires between them.
#[derive(Debug, Default)]
pub(crate) struct Graph {
    pub(crate) language: Language,
    pub(crate) objects: Vec<Object>,
}

impl Graph {
    /// Whether a tool has written it as rungs, which are not of the schema.
    pub(crate) fn has_rungs(&self) -> bool {
        self.objects.iter().any(|object| object.id >= rungs::FIRST_ID)
    }
}

#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(crate) enum Language {
    #[default]
    Ladder,
    FunctionBlocks,
    Sequence,
}

/// One object of a graph.
#[derive(Debug)]
pub(crate) struct Object {
    pub(crate) id: u64,
    pub(crate) span: Range<usize>,
    /// Top left corner in thousandths of the file's unit; x, then y.
    pub(crate) position: (i64, i64),
    /// `executionOrderId`; 0 where it is absent.
    pub(crate) order: u64,
    pub(crate) kind: Kind,
    /// What comes in, in the order of the file.
    pub(crate) inputs: Vec<Pin>,
    /// What goes out; power rails, contacts and coils have one without a name.
    pub(crate) outputs: Vec<Pin>,
}

/// What an object is.
#[derive(Debug)]
pub(crate) enum Kind {
    LeftRail,
    RightRail,
    /// A variable and how it is read.
    Contact(Name, Modifier),
    /// A variable and how it is written.
    Coil(Name, Modifier),
    Block(Block),
    /// An expression that is read.
    InVariable(Name, Modifier),
    /// A variable that is written.
    OutVariable(Name, Modifier),
    /// A variable that is written, and then read.
    InOutVariable(Name, Modifier, Modifier),
    Connector(Name),
    Continuation(Name),
    Comment(String),
    /// A step, and whether it is an initial one.
    Step(Name, bool),
    Transition(Transition),
    SelectionDivergence,
    SelectionConvergence,
    SimultaneousDivergence,
    SimultaneousConvergence,
    JumpStep(Name),
    Actions(Vec<Action>),
    /// To the label of that name.
    Jump(Name),
    Label(Name),
    /// To the end of the body.
    Return,
    /// What has no meaning here, by the name of its element.
    Other(&'static str),
}

/// A call of a function or a function block.
#[derive(Debug)]
pub(crate) struct Block {
    pub(crate) type_name: Name,
    pub(crate) instance: Option<Name>,
}

/// When a transition fires.
#[derive(Debug)]
pub(crate) struct Transition {
    pub(crate) priority: u64,
    pub(crate) negated: bool,
    pub(crate) condition: Condition,
}

#[derive(Debug)]
pub(crate) enum Condition {
    /// A transition of the unit, by its name.
    Reference(Name),
    Inline(Body),
    /// The power at the input `condition`.
    Wired,
    Missing,
}

/// What a step does.
#[derive(Debug)]
pub(crate) struct Action {
    pub(crate) span: Range<usize>,
    pub(crate) qualifier: Name,
    /// Of the qualifiers that take their time.
    pub(crate) duration: Option<Name>,
    pub(crate) content: ActionContent,
}

#[derive(Debug)]
pub(crate) enum ActionContent {
    /// An action of the unit, or a Boolean variable.
    Reference(Name),
    Inline(Body),
    Missing,
}

/// How a value is changed on its way.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(crate) struct Modifier {
    pub(crate) negated: bool,
    pub(crate) edge: Option<Edge>,
    pub(crate) storage: Option<Storage>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Edge {
    Rising,
    Falling,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Storage {
    Set,
    Reset,
}

/// An input or output of an object.
#[derive(Debug, Clone, Default)]
pub(crate) struct Pin {
    /// Its formal parameter; empty where it needs none.
    pub(crate) name: Name,
    pub(crate) modifier: Modifier,
    /// Where it comes from; outputs have none.
    pub(crate) wires: Vec<Wire>,
}

/// One connection.
#[derive(Debug, Clone)]
pub(crate) struct Wire {
    /// The object that it comes from.
    pub(crate) from: u64,
    /// The output there, where it is named.
    pub(crate) pin: Option<Name>,
    pub(crate) span: Range<usize>,
}
