//! Independent proofs about circuits, by code that shares nothing with what made them.

pub mod assumed;
mod drawing;
mod effort;
pub mod explicit;
pub mod induction;
pub mod numbers;
mod parity;
pub mod program;
pub mod property;
pub mod smv;
pub mod symbolic;
mod table;

pub use drawing::{MAXIMUM_DRAWN, Shown, draw_runs};
pub use effort::{GoOn, Stopped, Work};
pub use parity::{
    Assignment, Place, Proof, Refutation, prove_parity, prove_parity_while, prove_parity_within,
};
pub use table::scan_table;

/// The examples of the codes of this crate are run with its own.
#[cfg(doctest)]
#[doc = include_str!("../../../docs/errors/U04.md")]
pub struct ErrorPages;
