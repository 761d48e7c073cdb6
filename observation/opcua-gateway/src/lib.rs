//! A run as an OPC UA server that can only be read.
//!
//! ```text
//!   journal ──► Followed ──► Observation ──► tree: what each variable says, and how far that can be trusted ──► server
//! ```
//!
//! A reader of the journal only, as the other gateways are. A binary of its own, so that nobody who does without OPC UA carries it.

#![allow(
    clippy::disallowed_methods,
    reason = "it looks at a run again and again, by the clock"
)]

mod error;
mod security;
mod server;
mod tree;
mod trust;

pub use error::OpcuaError;
pub use security::{Login, Settings};
pub use server::serve;
pub use tree::{Kind, Variable, variables};
