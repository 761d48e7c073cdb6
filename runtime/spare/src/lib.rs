//! A spare: a machine without a role that serves several groups.
//!
//! ```text
//!   remote I/Os of each group ──(reports, mutual TLS)──► understudy_cycle::spare ──► Post: `understudy node` of the slot
//! ```
//!
//! While its groups are complete, it only follows the reports of a few remote I/Os of each. When a station has been
//! flagged for `spare_after` cycles, it starts the station of its slot as a process, and ends that when the group is
//! complete without it. The station joins like any understudy, so a spare that wakes without need, or beside another one,
//! costs load and nothing else.
//!
//! Invariant: no station of a slot outlives its spare.

#![allow(
    clippy::disallowed_methods,
    reason = "groups that are not received are called again after a while"
)]

mod post;
mod run;
mod unfinished;
mod watch;

pub use run::{Duty, Report, SpareSettings, run};
