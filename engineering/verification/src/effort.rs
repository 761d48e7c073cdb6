//! Effort of a proof. The caller, who has a clock, decides repeatedly whether to continue.

use std::fmt;

use understudy_logic::bdd::BddError;

/// Current work, for the progress.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Work {
    /// Computing sets of states as decision diagrams.
    Diagrams {
        /// Number of steps so far.
        steps: u64,
        /// Nodes of the diagrams.
        nodes: usize,
    },
    /// So many states were listed.
    States(usize),
    /// Searching runs of this number of scans as clauses.
    Scans(u32),
}

impl fmt::Display for Work {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Diagrams { steps, .. } => {
                write!(formatter, "{steps} steps through sets of states")
            }
            Self::States(states) => write!(formatter, "{states} states listed"),
            Self::Scans(scans) => write!(formatter, "runs of {scans} scans"),
        }
    }
}

/// Whether to go on, asked many times a second. After a no the work ends where it next can.
pub type GoOn<'a> = &'a dyn Fn(Work) -> bool;

/// Never stops.
pub(crate) const ALWAYS: GoOn<'static> = &|_| true;

/// Why a set of states was not computed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum Stopped {
    /// The diagrams grew too large.
    #[error(transparent)]
    Diagrams(#[from] BddError),
    /// Nobody wanted to wait longer.
    #[error("the time for it was over")]
    Time,
}
