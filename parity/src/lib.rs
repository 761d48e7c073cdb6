//! The understudy: a parity controller generated from N programs over GF(2).
//!
//! [`generate`] makes the circuit (7)-(9) of Fujimoto and Sekiguchi, [`words`] computes with its outputs: the syndrome (10)
//! and the reconstruction (12), [`Equations`] prints it as (34)-(40) do.

mod equations;
mod generate;
pub mod words;

pub use equations::{Equation, Equations, Formula, Legend, Style};

pub use generate::{ParityController, ParityError, Summand, generate};
