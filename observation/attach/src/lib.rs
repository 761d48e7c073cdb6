//! A cluster that runs elsewhere, as an operator sees it from his desk.
//!
//! ```text
//!   member ──(mutual TLS: each line of its journal)──► a thread for each ──┐
//!   member ──────────────────────────────────────────► …                  ├──► Recorder ──► runs/<time>/journal.jsonl
//!   page, terminal ──► Commander ──(release, force)─► the member it is for ─┘
//! ```
//!
//! What the members say becomes the journal of a run like any other, so that whatever shows a run shows a cluster elsewhere too. The
//! members write it anyway: the cycle does not depend on readers. Cycles are counted as the cluster counts them.
//!
//! Invariants: a line counts only if it comes from the member that it speaks of, by a certificate of this cluster's authority; a member of which
//! nothing is received for 2 s is detached and called again, and the journal says since when it lacks its lines.

#![allow(
    clippy::disallowed_methods,
    reason = "members that do not answer are called again after a while"
)]

mod error;
mod follower;
mod found;
mod in_effect;
mod recorder;

pub use error::AttachError;
pub use found::{Found, find};
pub use recorder::{Attached, impossible};
