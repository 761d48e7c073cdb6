//! The understudy: a parity controller generated from N programs over GF(2).
//!
//! [`generate`] makes the circuit (7)-(9) of Fujimoto and Sekiguchi. [`sum`], [`syndrome`] and [`reconstruct`] compute with
//! outputs, (9), (10) and (12). [`Equations`] prints a generated controller as (34)-(40) do.

mod algebra;
mod equations;
mod generate;

pub use algebra::{ErasureError, reconstruct, sum, syndrome};
pub use equations::{Equation, Equations, Formula, Legend, Style};
pub use generate::{ParityController, ParityError, Summand, generate};
