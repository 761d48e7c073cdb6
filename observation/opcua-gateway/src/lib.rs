//! A run as an OPC UA server, whose operator inputs persons with the role write.
//!
//! ```text
//!   journal ──► Followed ──► Observation ──► tree: variables with values and status codes ──► server
//! ```
//!
//! It reads the journal only, as the other gateways do, and writes through their gate. It is a binary of its own, so that other installations do not carry OPC UA.

#![allow(clippy::disallowed_methods, reason = "it polls a run by the clock")]

mod error;
mod manager;
mod security;
mod server;
mod tree;
mod trust;

pub use error::OpcuaError;
pub use security::{Login, Settings};
pub use server::serve;
pub use tree::{Kind, Variable, variables};
