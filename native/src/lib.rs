//! A circuit as machine code: straight-line, without a branch, one word operation for a contact.
//!
//! ```text
//! Circuit ──> Plan: statements in the order of the scan, and where each value is kept ──> Cranelift ──> Machine
//! ```
//!
//! [`Machine`] holds the code and [`Frame`] one run of it, or 64 runs at once: bit l of every word is the run l, and a step costs the same.
//! `logic::Scan` is the reference, and `ladder::Interpreter` is that of both; the tests hold all three against each other.
//!
//! This is the only crate with `unsafe` code: it calls what it has compiled. Why that is sound stands at the call.

#![deny(unsafe_op_in_unsafe_fn)]

mod emit;
mod frame;
mod machine;
mod plan;
pub mod sample;

pub use frame::Frame;
pub use machine::{Machine, MachineError};
