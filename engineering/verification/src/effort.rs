//! How long a proof may go on. Who has a clock is asked again and again; here there is none.

use std::fmt;

use understudy_logic::bdd::BddError;

/// What is being done, for whoever waits.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Work {
    /// Sets of states are computed as decision diagrams, in so many steps so far.
    Diagrams(u64),
    /// So many states were listed.
    States(usize),
    /// Runs of so many scans are searched as clauses.
    Scans(u32),
}

impl fmt::Display for Work {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Diagrams(steps) => {
                write!(formatter, "{steps} steps through sets of states")
            }
            Self::States(states) => write!(formatter, "{states} states listed"),
            Self::Scans(scans) => write!(formatter, "runs of {scans} scans"),
        }
    }
}

/// Whether to go on, asked many times a second; never again after the first no.
pub type GoOn<'a> = &'a dyn Fn(Work) -> bool;

/// Goes on for ever.
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
