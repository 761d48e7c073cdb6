//! The symbolic engine: sets of states as decision diagrams, for products too large to enumerate.
//!
//! A component's state is a block of bits, one component a level; the order of the levels is chosen so that components that share
//! events stand together. What is reached, forwards or backwards, is found by saturation (G. Ciardo, G. Lüttgen, R. Siminiescu, 2001;
//! with a constraint: Y. Zhao and G. Ciardo, 2009): lower levels are closed before higher ones look at them, so that few of
//! the sets in between are ever made. The fixed point is that of the explicit engine, and both are compared on all models that fit.
//!
//! Diagrams come from [`understudy_logic::bdd`], the one place that knows the library behind them.

#![expect(
    clippy::mutable_key_type,
    reason = "what a diagram is never changes; what changes inside counts its users"
)]

mod explain;
mod order;
mod saturation;
mod space;
mod supervisor;

pub use supervisor::{
    SymbolicSupervisor, Verdict, nonconflicting_symbolically, synthesise_symbolically,
};

use understudy_logic::bdd::BddError;

/// What the symbolic engine may use.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SymbolicBounds {
    /// Nodes of diagrams alive at once; about 30 bytes each.
    pub nodes: usize,
}

impl Default for SymbolicBounds {
    fn default() -> Self {
        Self { nodes: 16_000_000 }
    }
}

/// The diagrams do not fit.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error(
    "U0832: the sets of states take more than {nodes} nodes of decision diagrams; raise the bound, or synthesise with --engine modular"
)]
pub struct TooComplex {
    /// The bound.
    pub nodes: usize,
}

impl TooComplex {
    /// Stable code for people.
    pub fn code(&self) -> &'static str {
        "U0832"
    }

    fn of(error: &BddError, bounds: SymbolicBounds) -> Self {
        debug_assert!(matches!(error, BddError::TooManyNodes { .. }));
        Self { nodes: bounds.nodes }
    }
}
