//! Automation Petri nets and hybrid controllers: Uzam and Gelen, sections 2.2, 2.3 and 3.
//!
//! A [`Net`] is an APN = (P, T, Pre, Post, In, En, χ, Q, M0), (1), with delays for its transitions, (2). [`Net::explore`] finds
//! its markings and so its bounds (step 2 of the hybrid method); [`reduce`] makes it smaller (step 3); [`buffers`] and
//! [`Exploration::automaton`] turn it into automata for the synthesis (step 4); [`to_ladder`] makes its ladder by token passing
//! logic, with supervisors beside it (steps 7 to 9), which move with it and inhibit its controllable transitions.

mod buffers;
mod explore;
mod net;
mod reduce;
mod to_ladder;
mod tokens;

pub use buffers::buffers;
pub use explore::{Exploration, ExplorationError, Marking};
pub use net::{Action, Arc, Condition, Net, NetError, NetTransition, Place};
pub use reduce::{Reduction, reduce};
pub use to_ladder::{HybridError, HybridLadder, to_ladder};
