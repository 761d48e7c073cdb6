//! Typed programs: numbers, texts, arrays and structures, beside the Boolean circuits of `understudy-logic`.
//!
//! ```text
//! x(t+1) = f(x(t), u(t))      y(t) = h(x(t), u(t))
//! ```
//!
//! Every language of IEC 61131-3 lowers to one form, [`Program`]; `Interpreter` gives its meaning and `Machine` executes it.
//! x, u and y are images of bits as those of a circuit are, so everything that carries, adds and compares images holds for numbers too: a
//! point is a name, a type and a range of bits ([`Point`]).

mod carried;
mod cost;
mod edges;
mod fault;
mod form;
mod image;
mod interpreter;
mod machine;
mod naming;
mod notation;
mod operation;
mod retention;
mod row;
mod scan;
mod stops;
mod types;
mod validate;
mod visit;

pub use self::carried::{
    CarriedPath, CarriedState, Fate, Origin, Renamed, Successor, Taken, Told, WrongPair,
};
pub use self::cost::Cost;
pub use self::edges::EdgeMemory;
pub use self::fault::{Cause, Fault};
pub use self::form::{
    Argument, Branch, Call, Case, Detail, Expression, ExpressionKind, For, Index, Initial, Place,
    Program, Root, Routine, RoutineId, RoutineKind, Statement, StatementKind, Task, Timer,
    Variable,
};
pub use self::image::{Declared, Point, Points};
pub use self::interpreter::{Done, Effect, Interpreter, Made, Read, Trace};
pub use self::machine::{Machine, Scratch};
pub use self::naming::{Part, Parts, indices, is_within, is_within_in_any_case};
pub use self::operation::{
    Comparison, Operand, Operation, RealFunction, Signature, TextOperand, TextOperation,
    text_literal,
};
pub use self::types::{
    Array, Elementary, Enumeration, EnumerationId, Field, Structure, StructureId, Type,
};
pub use self::validate::Violation;
pub use self::visit::{Uses, bodies};
