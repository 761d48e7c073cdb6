//! Boolean expressions, polynomials over GF(2) and synchronous circuits.
//!
//! The keystone of the house is [`Circuit`], equations (1)-(2) of Fujimoto and Sekiguchi: a ladder lowers to it, the
//! parity controller is one, a station evaluates it, and proofs explore it. [`transform`] holds (3) and (6), [`Polynomial`] and
//! [`NormalForm`] what (3) is written as, [`bdd`] decides equality and finds short Boolean formulas.

pub mod bdd;
mod circuit;
mod cover;
mod expression;
mod lanes;
mod normal_form;
pub mod notation;
mod polynomial;
mod running;
mod scan;
pub mod transform;

pub use circuit::{Circuit, CircuitBuilder, CircuitError, Output, Register, RegisterId};
pub use cover::{Cover, Literal};
pub use expression::{Expression, Graph, Operation, Variable};
pub use lanes::transpose;
pub use normal_form::{Monomial, NormalForm, TooManyMonomials};
pub use polynomial::Polynomial;
pub use running::Running;
pub use scan::{Scan, Scratch};
