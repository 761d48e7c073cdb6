//! The explicit engine: state by state, in arrays.
//!
//! A product state is a tuple of component states, packed into words; it is interned once, in the order of a breadth-first search,
//! so state 0 is the initial one and a shortest way to any state is found by going forward. What is enabled in a tuple is the
//! intersection of one bit set a component. A state takes at most 40 bytes while the search runs and a transition at most 12; past the
//! memory bound the search stops and says so.

mod graph;
mod numbers;
mod product;

pub(crate) use graph::{Predecessors, breadth_first_word, coreachable, restrict};
pub(crate) use product::{Joint, Product};

/// What the explicit engine may use.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Bounds {
    /// Bytes for the states and transitions of one product.
    pub memory_bytes: usize,
}

impl Default for Bounds {
    /// 2 GB: some 25 million states with four transitions each.
    fn default() -> Self {
        Self { memory_bytes: 2_000_000_000 }
    }
}

/// The product does not fit.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum TooLarge {
    /// The memory bound was reached.
    #[error(
        "U0830: after {states} states and {transitions} transitions the explicit product reached its bound of {memory_bytes} bytes; the symbolic engine (--engine symbolic) does not list states"
    )]
    Memory {
        /// States found until then.
        states: usize,
        /// Transitions found until then.
        transitions: usize,
        /// The bound.
        memory_bytes: usize,
    },
    /// Too many components for the widest tuple.
    #[error(
        "U0831: a state of the product takes {bits} bits, and the explicit engine has room for {limit}; use the symbolic engine (--engine symbolic) or fewer components"
    )]
    Tuple {
        /// Bits needed.
        bits: usize,
        /// Bits available.
        limit: usize,
    },
}

impl TooLarge {
    /// Stable code for people.
    pub fn code(&self) -> &'static str {
        match self {
            Self::Memory { .. } => "U0830",
            Self::Tuple { .. } => "U0831",
        }
    }
}
