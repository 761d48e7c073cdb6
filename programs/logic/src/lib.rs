//! Boolean expressions, polynomials over GF(2) and synchronous circuits.
//!
//! The central structure is [`Circuit`], equations (1)-(2) of Fujimoto and Sekiguchi: a ladder lowers to it, the
//! parity controller is one, a station evaluates it, and proofs explore it. [`Polynomial`] and [`NormalForm`] are written in GF(2),
//! (3); [`bdd`] decides equality and finds short Boolean formulas, (6).

pub mod bdd;
mod circuit;
mod cover;
mod expression;
mod lanes;
mod normal_form;
pub mod notation;
mod packed;
mod polynomial;
mod random;
mod running;
mod scan;

pub use circuit::{Circuit, CircuitBuilder, CircuitError, Output, Register, RegisterId};
pub use cover::{Cover, Literal};
pub use expression::{Expression, Graph, Operation, Variable};
pub use lanes::{LANES, Lanes, Run, transpose};
pub use normal_form::{Monomial, NormalForm, TooManyMonomials};
pub use packed::{bit, ones, ones_in, pack, unpack};
pub use polynomial::Polynomial;
pub use random::Random;
pub use running::Running;
pub use scan::{SPARSE, Scan, Scratch, Sparse, SparseRun};
