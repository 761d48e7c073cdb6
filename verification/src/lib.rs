//! Independent proofs about circuits, by code that shares nothing with what made them.

pub mod induction;
mod parity;
pub mod program;
pub mod property;
pub mod smv;
pub mod symbolic;
mod table;

pub use parity::{Assignment, Place, Proof, Refutation, prove_parity, prove_parity_within};
pub use table::scan_table;
