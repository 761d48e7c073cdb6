//! The live view: a page that shows a run, without external files.
//!
//! ```text
//!   journal ──► follower (a thread) ──► model ──► snapshot(cycle) ──► newest state ──► one stream for each viewer
//!                                         ▲
//!                    requests by GET ─────┘      commands by POST ──► the laboratory, where it runs in this process
//! ```
//!
//! Invariant: it disturbs no cycle. The members are other processes and do nothing for it; it reads the journal on two threads of a low
//! priority. A slow viewer costs nothing: it gets the newest state when it can take it, and no missed states.
//!
//! The page of a plant ([`serve_plant`]) shows all groups of a plant file and its spares; it is read-only.
//!
//! It is read-only unless commands are allowed. It is served to this machine only, unless there are logins, and then only over TLS.

#![allow(
    clippy::disallowed_methods,
    reason = "sessions expire by the clock, and a journal is polled"
)]

mod api;
mod app;
mod assets;
mod error;
mod follower;
mod guard;
mod listener;
mod login;
mod model;
mod plant;
mod renamed;
mod server;
mod shown;
mod tls;

pub use app::Commanding;
pub use error::WatchError;
pub use login::Logins;
pub use server::{Place, Served, Settings, serve, serve_plant};
pub use shown::page_state;
pub use tls::Certificate;
