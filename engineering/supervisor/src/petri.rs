//! Automation Petri nets and hybrid controllers: Uzam and Gelen, sections 2.2, 2.3 and 3.
//!
//! A [`Net`] is an APN = (P, T, Pre, Post, In, En, χ, Q, M0), (1), with delays for its transitions, (2). [`Net::explore`] finds
//! its markings and so its bounds (step 2 of the hybrid method); [`reduce`] makes it smaller (step 3); [`buffers`] and
//! [`Exploration::automaton`] turn it into automata for the synthesis (step 4); [`to_ladder`] makes its ladder by token passing
//! logic, with supervisors beside it (steps 7 to 9), which move with it and inhibit its controllable transitions;
//! [`prove_hybrid`](crate::proof::prove_hybrid) proves that ladder. [`read_net`] and [`write_net`] are the net as a file.

mod buffers;
mod condition;
mod drawing;
mod explore;
mod hybrid;
mod net;
mod read;
mod reduce;
mod to_ladder;
mod tokens;
mod write;

pub use buffers::buffers;
pub use drawing::{draw_net_dot, draw_net_svg};
pub use explore::{Exploration, ExplorationError, Marking};
pub use hybrid::{HybridNetError, hybrid_net, list_arcs, list_control};
pub use net::{Action, Arc, Condition, Net, NetError, NetTransition, Place};
pub use read::{NetFile, ReadNet, read_net};
pub use reduce::{Reduction, reduce};
pub use to_ladder::{HybridError, HybridLadder, to_ladder};
pub use write::write_net;
