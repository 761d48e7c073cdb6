//! What a remote I/O knows of its program's history, from its start on.
//!
//! ```text
//!   Listening ── no living station holds a state ──► ColdStarted ── an output is applied ──► Known
//!       │                                                │                                     ▲
//!       └── a state is adopted ──────────────────────────┴─────────────────────────────────────┘
//! ```
//!
//! It never forgets: a program that is started cold from `Known` keeps its [`Floor`] until an output is applied (*Never
//! back*).

use understudy_wire::{Lineage, Moment};

use crate::history::History;

/// The newest sample whose outputs were applied: an applied output has moved the plant, so the history never continues
/// from a state before it. A cold start of which no output was applied moves nothing.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(super) struct Floor {
    /// Its cycle.
    pub(super) moment: Moment,
    /// The lineage that it led to.
    pub(super) lineage: Lineage,
}

/// A history that is sampled.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub(super) struct Run {
    pub(super) history: History,
    /// Whether the history has the sample of the current cycle.
    pub(super) sampled: bool,
    /// Cycles in a row in which living stations were received and none of them was on this history.
    pub(super) unfollowed: u32,
}

impl Run {
    fn new(history: History) -> Self {
        Self { history, sampled: false, unfollowed: 0 }
    }
}

/// What is known of the history.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub(super) enum Knowledge {
    /// After a restart: neither the history nor the floor is known.
    Listening {
        /// Cycles for which stations were received.
        cycles: u32,
        /// Whether a living station held a state in the last of them.
        held: bool,
        /// Cycles in a row in which the newest state could not be proved: a station that has just taken it over is accounted for some cycles later.
        unproved: u32,
        /// Whether the operator has released all excluded stations meanwhile.
        pardons: bool,
    },
    /// Started cold, and no output was applied since: the floor from before the restart is not known.
    ColdStarted {
        /// The history since the cold start.
        run: Run,
        /// As in `Listening`.
        pardons: bool,
    },
    /// The history and its floor are known.
    Known {
        /// The history.
        run: Run,
        /// Its floor.
        floor: Floor,
    },
}

impl Default for Knowledge {
    fn default() -> Self {
        Self::Listening { cycles: 0, held: false, unproved: 0, pardons: false }
    }
}

impl Knowledge {
    /// The history that is sampled.
    pub(super) fn run(&self) -> Option<&Run> {
        match self {
            Self::Listening { .. } => None,
            Self::ColdStarted { run, .. } | Self::Known { run, .. } => Some(run),
        }
    }

    /// As [`Self::run`].
    pub(super) fn run_mut(&mut self) -> Option<&mut Run> {
        match self {
            Self::Listening { .. } => None,
            Self::ColdStarted { run, .. } | Self::Known { run, .. } => Some(run),
        }
    }

    /// The floor, where it is known.
    pub(super) fn floor(&self) -> Option<Floor> {
        match self {
            Self::Known { floor, .. } => Some(*floor),
            Self::Listening { .. } | Self::ColdStarted { .. } => None,
        }
    }

    /// Starts to sample `history`: from an adopted state, which is its floor, or cold.
    pub(super) fn start(&mut self, history: History, adopted: Option<Floor>) {
        let run = Run::new(history);
        *self = match (adopted.or(self.floor()), self.pardons()) {
            (Some(floor), _) => Self::Known { run, floor },
            (None, pardons) => Self::ColdStarted { run, pardons },
        };
    }

    /// The outputs of the sample of `moment`, the newest of the history, were applied.
    pub(super) fn applied(&mut self, moment: Moment) {
        let floor = |run: &Run| Floor { moment, lineage: run.history.head() };
        match std::mem::take(self) {
            listening @ Self::Listening { .. } => *self = listening,
            Self::ColdStarted { run, .. } | Self::Known { run, .. } => {
                let floor = floor(&run);
                *self = Self::Known { run, floor };
            }
        }
    }

    /// The operator releases all stations: those that other stations recall as excluded too, where the floor is not
    /// known.
    pub(super) fn pardon(&mut self) {
        match self {
            Self::Listening { pardons, .. } | Self::ColdStarted { pardons, .. } => *pardons = true,
            Self::Known { .. } => {}
        }
    }

    /// Whether the operator has released all stations since the restart.
    pub(super) fn pardons(&self) -> bool {
        match self {
            Self::Listening { pardons, .. } | Self::ColdStarted { pardons, .. } => *pardons,
            Self::Known { .. } => false,
        }
    }
}
