//! What is done to a party, and when.

use serde::{Deserialize, Serialize};
use understudy_wire::Party;

/// One thing done to one party.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Fault {
    /// The cycle, counted from the first in which everybody was in step.
    pub at_cycle: u64,
    /// Where in that cycle, from 0 (its start) to below 1 (the start of the next).
    pub phase: f64,
    /// To whom.
    pub party: Party,
    /// What.
    pub action: Action,
}

/// What can be done to a party.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Action {
    /// It is gone, with all that it knew (kill -9).
    Crash,
    /// It starts again, knowing nothing.
    Restart,
    /// It stands still, and frames wait for it (SIGSTOP).
    Stop,
    /// It goes on (SIGCONT).
    Continue,
    /// The operator releases the outputs of a remote I/O after a cold start.
    Release,
}
