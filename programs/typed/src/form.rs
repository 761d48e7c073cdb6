//! The program form: routines of structured statements over memory with constant layout.
//!
//! Memory is a row of slots of 64 bits (see [`crate::types`]): first the *state*, which is x, then the *frames*, which hold what lives in one
//! call only. There are no pointers, no allocation and no recursion; every loop is charged to a budget. So memory and the worst-case
//! number of operations are known when a program is read.
//!
//! The first slots of the state are the program's own: [`Program::HEADER`].

use std::collections::{BTreeMap, HashMap};
use std::ops::Range;
use std::sync::Arc;

use crate::image::Points;
use crate::operation::Operation;
use crate::types::{Elementary, Enumeration, Structure, Type};

/// Index of a [`Routine`] in its program.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct RoutineId(pub u32);

/// A typed program.
///
/// Invariants, checked by [`Program::validate`]: every place lies in memory and is of the type it claims; operands have the types their operation
/// wants; no routine calls itself, directly or through others.
#[derive(Debug, Clone, Default)]
pub struct Program {
    /// Its name; of several programs that run together, their names with commas between.
    pub name: String,
    /// Nanoseconds from one scan to the next.
    pub period: i64,
    /// Operations that the loops of one scan may take together; see `Cost`.
    pub budget: u64,
    /// Enumerated types.
    pub enumerations: Vec<Arc<Enumeration>>,
    /// Structures, and the memory of function blocks.
    pub structures: Vec<Structure>,
    /// What can be run.
    pub routines: Vec<Routine>,
    /// What is run in a scan, in order.
    pub tasks: Vec<Task>,
    /// Variables of the programs and the global ones, in the order in which people see them; parts are found through their types.
    pub variables: Vec<Variable>,
    /// Memory of the programs that no person declared, such as that of their charts: an online change finds it by these names.
    pub hidden: Vec<Variable>,
    /// u; the last one is the reset, where [`Program::seal_points`] was called.
    pub inputs: Points,
    /// y; the last one is the fault, where [`Program::seal_points`] was called.
    pub outputs: Points,
    /// Slots of the state, with its header.
    pub state: u32,
    /// Slots of all frames.
    pub frames: u32,
    /// What of the state is not 0 at the start, in order of slots.
    pub initial: Vec<Initial>,
    /// Slots of retentive variables, in order and apart; see [`Program::retain`].
    pub retained: Vec<Range<u32>>,
    /// What the declarations of variables and of parts of them say besides their types, by names with `[]` for all indices: `recipe[].pause`. No scan
    /// depends on it.
    pub details: BTreeMap<String, Detail>,
}

/// What a declaration says besides the type.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Detail {
    /// The least and the greatest value of a subrange.
    pub range: Option<(i128, i128)>,
    /// It is declared as LTIME, LDATE and the like.
    pub is_long: bool,
}

impl Program {
    /// Slots at the start of the state that no variable has: the fault (0 while the program runs; see `Fault`), two values that explain it,
    /// and the number of scans since the start.
    pub const HEADER: u32 = 4;

    /// The name of the input that restarts a program after a fault: the state becomes the initial one, and the scan runs as the first. It
    /// has no effect while the program runs.
    pub const RESET: &str = "program.reset";

    /// The name of the output that is TRUE while the program is stopped by a fault.
    pub const FAULT: &str = "program.fault";

    /// Appends [`Program::RESET`] and [`Program::FAULT`], both of type BOOL, unless they are there, and gives all points the initial values of their
    /// variables. A Boolean program that [cannot stop](Program::can_fault) has neither. A front end calls it after the declared points, the routines
    /// and the initial state.
    ///
    /// They stand at slot 0, which no variable has: the input there is the reset and is not stored, the output there is whether slot 0 holds a fault.
    pub fn seal_points(&mut self) {
        let mut points = self.inputs.iter().chain(&self.outputs);
        let stops = points.any(|point| point.of != Elementary::Bool) || self.can_fault();
        if stops && self.inputs.iter().all(|point| point.slot != 0) {
            self.inputs.push(Self::RESET, Elementary::Bool, 0);
        }
        if stops && self.outputs.iter().all(|point| point.slot != 0) {
            self.outputs.push(Self::FAULT, Elementary::Bool, 0);
        }
        let state = self.initial_state();
        self.inputs.begin_with(&state);
        self.outputs.begin_with(&state);
    }

    /// The routine of an id.
    ///
    /// # Panics
    /// If the program has no such routine.
    pub fn routine(&self, id: RoutineId) -> &Routine {
        &self.routines[id.0 as usize]
    }

    /// What has a name in the state: the variables, and the memory that no person declared.
    pub(crate) fn named(&self) -> impl Iterator<Item = &Variable> {
        self.variables.iter().chain(&self.hidden)
    }

    /// Gives variables and points other names: each name is found with its new one.
    pub fn rename(&mut self, names: &HashMap<String, String>) {
        let new = |name: &mut String| {
            if let Some(new) = names.get(name) {
                name.clone_from(new);
            }
        };
        self.variables.iter_mut().for_each(|variable| new(&mut variable.name));
        self.inputs.names_mut().for_each(new);
        self.outputs.names_mut().for_each(new);
    }

    /// x(0).
    pub fn initial_state(&self) -> Vec<u64> {
        let mut state = vec![0; self.state as usize];
        for initial in &self.initial {
            state[initial.slot as usize] = initial.value;
        }
        state
    }
}

/// A slot that does not begin as 0.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Initial {
    /// Which one.
    pub slot: u32,
    /// Its content.
    pub value: u64,
}

/// A program in the order of a scan.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Task {
    /// The routine of the program.
    pub routine: RoutineId,
    /// Where its variables begin.
    pub own: u32,
    /// It is run in every so many-th scan, the first included; at least 1.
    pub every: u32,
}

/// A variable that people can see.
#[derive(Debug, Clone, PartialEq)]
pub struct Variable {
    /// Its name; that of a program's variable stands behind the program's name and a dot where there are several programs.
    pub name: String,
    /// Its type.
    pub of: Type,
    /// Its first slot in the state.
    pub slot: u32,
    /// Its address, such as `%IX0.3`.
    pub address: Option<String>,
    /// Its description.
    pub description: Option<String>,
}

/// What a routine is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum RoutineKind {
    /// A PROGRAM, a FUNCTION_BLOCK or a method of one: its variables stand in an instance, [`Root::Own`].
    Block,
    /// A FUNCTION: all its variables stand in its frame.
    Function,
}

/// A body with what it needs to run.
#[derive(Debug, Clone)]
pub struct Routine {
    /// Its name, as declared; that of a method stands behind its block's and a dot.
    pub name: String,
    /// What it is.
    pub kind: RoutineKind,
    /// Its frame: the first slot, counted from the start of all frames, and how many. No two routines share one.
    pub frame: (u32, u32),
    /// What of the frame is not 0 when a call, an invocation or a task begins, slots counted from the start of all frames.
    pub initial: Vec<Initial>,
    /// What it does.
    pub body: Vec<Statement>,
    /// Which timer of the standard it is, of such a block.
    pub timer: Option<Timer>,
}

/// A timer of the standard. Its variables are IN, PT, Q and ET, and what it keeps from call to call.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Timer {
    /// `TP`: Q for PT from the rise of IN on.
    Pulse,
    /// `TON`: Q when IN has been TRUE for PT.
    OnDelay,
    /// `TOF`: Q until IN has been FALSE for PT.
    OffDelay,
}

impl Timer {
    /// The one of this name, in capitals.
    pub fn of(name: &str) -> Option<Self> {
        match name {
            "TP" => Some(Self::Pulse),
            "TON" => Some(Self::OnDelay),
            "TOF" => Some(Self::OffDelay),
            _ => None,
        }
    }
}

/// A statement and the line of its text, from 1; 0 where it has none.
#[derive(Debug, Clone)]
pub struct Statement {
    /// Line in the text of its routine.
    pub line: u32,
    /// What it does.
    pub kind: StatementKind,
}

/// What a statement does.
#[derive(Debug, Clone)]
pub enum StatementKind {
    /// `place := value`, of types that are stored alike; aggregates are copied, a text too long for its place is a fault. The value
    /// is evaluated before the indices of the place.
    Assign(Place, Expression),
    /// Stores the address of the second into the slot of the first, for [`Root::OwnReference`]. The first is the slot itself, found as any
    /// place, with the type of the variable that it refers to. The address is found before the slot.
    Bind(Place, Place),
    /// Runs the body of a block on the instance at a place.
    Invoke(RoutineId, Place),
    /// Calls a function for what it does.
    Evaluate(Expression),
    /// `IF … ELSIF … ELSE`
    If(Vec<Branch>, Vec<Statement>),
    /// `CASE` over a selector of an integer or enumerated type.
    Case(Expression, Vec<Case>, Vec<Statement>),
    /// `FOR`
    For(Box<For>),
    /// `WHILE condition DO`
    While(Expression, Vec<Statement>),
    /// `REPEAT … UNTIL condition`
    Repeat(Vec<Statement>, Expression),
    /// Leaves the innermost loop.
    Exit,
    /// Goes on with the next turn of the innermost loop.
    Continue,
    /// Leaves the routine.
    Return,
}

/// A condition and what is done where it is the first that holds.
#[derive(Debug, Clone)]
pub struct Branch {
    /// Of type BOOL.
    pub condition: Expression,
    /// What is done.
    pub body: Vec<Statement>,
}

/// Values of a selector and what is done for them; the first case that has the value counts.
#[derive(Debug, Clone)]
pub struct Case {
    /// First and last value of each range.
    pub ranges: Vec<(i64, i64)>,
    /// What is done.
    pub body: Vec<Statement>,
}

/// `FOR counter := from TO to BY by DO body END_FOR`
///
/// Indices of the counter are evaluated first, once. `from` is assigned then; `to` and `by` are evaluated once, in that order. A turn is made while the counter has not passed `to` in the direction of `by`. The step behind a turn
/// ends the loop where it would leave the counter's type. Where `by` is 0, no turn passes `to`: the budget ends it.
#[derive(Debug, Clone)]
pub struct For {
    /// Of an integer type.
    pub counter: Place,
    /// Of the counter's type.
    pub from: Expression,
    /// Of the counter's type.
    pub to: Expression,
    /// Of the counter's type; for one that is unsigned only upwards.
    pub by: Expression,
    /// What is done in each turn.
    pub body: Vec<Statement>,
}

/// Where a place is counted from.
///
/// An address is the number of a bit: 64 · slot + bit, the slots of the frames behind those of the state. A reference whose slot holds
/// 0, or what is no address of its type, is a fault when it is used.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Root {
    /// This slot of the state.
    Global(u32),
    /// This slot of the instance on which the routine runs.
    Own(u32),
    /// This slot of the frames.
    Frame(u32),
    /// The address in this slot of the instance.
    OwnReference(u32),
    /// The address in this slot of the frames.
    FrameReference(u32),
}

/// A variable or a part of one.
#[derive(Debug, Clone)]
pub struct Place {
    /// Where it is counted from.
    pub root: Root,
    /// Slots from there, of the structures' parts and of constant indices.
    pub offset: u32,
    /// Bits from there, of a constant index into a packed array: a multiple of the element's width, less than 64.
    pub bit: u32,
    /// It is an element of an array of an elementary type, so other elements may lie in its slot.
    pub is_packed: bool,
    /// What is added for the indices that are computed.
    pub indices: Vec<Index>,
    /// What lies there.
    pub of: Type,
    /// Least and greatest value of the subrange that it is declared with, or that its elements are. It bounds no calculation.
    pub range: Option<(i128, i128)>,
}

impl Place {
    /// A variable.
    pub fn new(root: Root, of: Type) -> Self {
        Self { root, offset: 0, bit: 0, is_packed: false, indices: Vec::new(), of, range: None }
    }

    /// What it may mean, whatever the values of its indices, in bits from its root.
    pub fn extent(&self) -> Range<u64> {
        64 * u64::from(self.offset) + u64::from(self.bit)..self.reach()
    }

    /// Bits from its root to the end of what it may mean, whatever the values of its indices; saturates.
    pub(crate) fn reach(&self) -> u64 {
        let size = match self.of.elementary() {
            Some(elementary) => u64::from(elementary.bits()),
            None => self.of.slots().saturating_mul(64),
        };
        let first = 64 * u64::from(self.offset) + u64::from(self.bit);
        let indices = self.indices.iter().map(|index| {
            let last = index.high.abs_diff(index.low);
            last.saturating_mul(index.stride)
        });
        indices.fold(first.saturating_add(size), u64::saturating_add)
    }

    /// The slot at the place, for an address that it holds.
    pub(crate) fn holder(&self) -> Self {
        Self { of: Type::Elementary(Elementary::Lword), ..self.clone() }
    }

    /// Whether it is found through an address that is stored.
    pub(crate) fn is_by_reference(&self) -> bool {
        matches!(self.root, Root::OwnReference(_) | Root::FrameReference(_))
    }
}

/// An index that is computed.
#[derive(Debug, Clone)]
pub struct Index {
    /// Of type LINT.
    pub value: Expression,
    /// First index of the dimension.
    pub low: i64,
    /// Last index of the dimension. One outside is a fault.
    pub high: i64,
    /// Bits from one element to the next.
    pub stride: u64,
}

/// An expression and its type.
#[derive(Debug, Clone)]
pub struct Expression {
    /// Its type.
    pub of: Type,
    /// What it is.
    pub kind: ExpressionKind,
}

/// What an expression is. Operands are evaluated from left to right.
#[derive(Debug, Clone)]
pub enum ExpressionKind {
    /// An elementary value as it is stored.
    Constant(u64),
    /// A text.
    Text(Arc<[u8]>),
    /// What is stored at a place, of any type.
    Load(Box<Place>),
    /// An operation on operands.
    Apply(Operation, Vec<Expression>),
    /// The second where the first, of type BOOL, is TRUE, else the third; the other one is not evaluated (AND_THEN, OR_ELSE).
    Choose(Box<[Expression; 3]>),
    /// A call of a function, or of a method on an instance.
    Call(Box<Call>),
}

/// A call in an expression.
///
/// The instance, the arguments and the places that take the outputs are evaluated, in this order and from left to right; then the frame is set to its
/// initial content and the arguments are stored; then the body runs; then the outputs are copied; then the result is read.
/// Places of the routine are in its frame, without computed indices.
#[derive(Debug, Clone)]
pub struct Call {
    /// What is called.
    pub routine: RoutineId,
    /// The instance, for a method.
    pub own: Option<Place>,
    /// What is given.
    pub arguments: Vec<Argument>,
    /// What is taken: from a variable of the routine, to a place of the caller.
    pub outputs: Vec<(Place, Place)>,
    /// The variable of the routine that holds the result; `None` for a call that has none, which only [`StatementKind::Evaluate`] may make.
    pub result: Option<Place>,
}

/// What a call gives to a variable of the routine.
#[derive(Debug, Clone)]
pub enum Argument {
    /// A value.
    Value(Place, Expression),
    /// The address of a variable, into the slot of a [`Root::FrameReference`].
    Reference(Place, Place),
}
