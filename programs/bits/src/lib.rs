//! A scan of a program as terms, and the circuit that has all its runs.
//!
//! ```text
//! typed program ── execute ──► system: a term for each cell after a scan ── derive ──► circuit, with a meaning for each of its inputs
//! ```
//!
//! Values are followed bit by bit where they are finite: BOOLs, bit strings, integers, and times that are counted in periods. What is not
//! followed, such as a product of reals, is a free input of the circuit, and a *gap*: the circuit then has every run of the program, and more. A circuit
//! without gaps is exact.

mod beside;
mod circuit;
mod exact;
mod execute;
mod extent;
mod layout;
mod number;
mod program;
mod statements;
mod system;
mod term;
#[cfg(test)]
mod tests;

pub use beside::Disagreement;
pub use circuit::boundaries::{between, boundary_text, position};
pub use circuit::{Derivation, Meaning};
pub use exact::{Compared, Exact, Gap, Inexact, Shown, exact};
pub use execute::Unsupported;
pub use layout::{Layout, Registers};
pub use program::{AnyValue, InTheWay, Member, POWER_RETURNS, SameNames, Switch};
pub use system::{Cell, Input, Source, System};
pub use term::{Node, Term, Terms, Variable};
