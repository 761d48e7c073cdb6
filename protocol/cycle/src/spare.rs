//! When a spare wakes, and where: what a spare knows of its groups, and the rule that follows from that.
//!
//! ```text
//!   reports of a few remote I/Os ──► Attention (by group) ──► Standing ──► Rule ──► Order
//! ```
//!
//! A spare as a process and one in the simulator follow the same rule.

mod attendance;
mod attention;
mod rule;

pub use attendance::{AttendanceCount, AttendanceReport, REPORTED_EVERY};
pub use attention::{Attention, Standing, WITNESSES};
pub use rule::{Order, Rule, wanted};
