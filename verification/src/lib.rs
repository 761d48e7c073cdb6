//! Independent proofs about circuits, by code that shares nothing with what made them.

mod parity;

pub use parity::{Assignment, Place, Proof, Refutation, prove_parity, prove_parity_within};
