//! The live view: a page that shows a run, from this program alone.
//!
//! ```text
//!   journal ──► follower (a thread) ──► model ──► what is newest ──► one stream for each viewer (server-sent events)
//!                                         ▲
//!                    questions by GET ────┘      commands by POST ──► the laboratory, where it runs in this process
//! ```
//!
//! Invariant: it disturbs no cycle. The members are other processes and do nothing for it; it reads what the journal holds, on two threads that run when
//! nobody else wants to. A slow viewer costs nothing: it is given what is newest when it can take it, and never what it has missed.
//!
//! It looks only, unless it was told that it may command; it is served to this machine only, unless it was told who may log in, and then
//! only over TLS.

#![allow(
    clippy::disallowed_methods,
    reason = "sessions end by the clock, and a journal is looked at now and then"
)]

mod api;
mod app;
mod assets;
mod changes;
mod error;
mod follower;
mod foreseen;
mod guard;
mod listener;
mod login;
mod model;
mod renamed;
mod server;
mod shown;
mod tls;

pub use app::Commanding;
pub use error::WatchError;
pub use login::Logins;
pub use server::{Served, Settings, serve};
pub use tls::Certificate;
