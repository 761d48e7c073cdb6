//! State of a station, from its own records and those of others.
//!
//! ```text
//!   (not started) ─► joining ─► shadow mode ─► publishing ◄──► not received ─► flagged
//!                        ▲                        │  killed, suspended, ended, refused: by the laboratory, or by the others
//!                        └───── started again ────┘
//! ```

use serde::{Deserialize, Serialize};
use understudy_journal::Process;
use understudy_wire::ProgramSet;

/// State of a station.
#[derive(
    Debug,
    Clone,
    Copy,
    PartialEq,
    Eq,
    Hash,
    PartialOrd,
    Ord,
    Serialize,
    Deserialize,
    schemars::JsonSchema,
)]
#[serde(rename_all = "kebab-case")]
pub enum StationState {
    /// No record of it exists yet.
    NotStarted,
    /// It takes its turns, and at least one remote I/O receives them.
    Publishing,
    /// It runs, and no remote I/O received its turn in this cycle.
    NotReceived,
    /// It was not received for `flag_after` cycles, θ = 1: its slot is closed.
    Flagged,
    /// It listens, and asks for the states that it lacks.
    Joining,
    /// It has a state, and computes without sending.
    ShadowMode,
    /// It runs another configuration, and its frames are dropped.
    Refused,
    /// Its process is suspended.
    Suspended,
    /// Its process was killed.
    Killed,
    /// Its process ended unexpectedly.
    Ended,
    /// The slot of a spare, which is empty.
    Standby,
}

impl StationState {
    /// Every state, by its number in the register map of Modbus.
    pub const ALL: [Self; 11] = [
        Self::NotStarted,
        Self::Publishing,
        Self::NotReceived,
        Self::Flagged,
        Self::Joining,
        Self::ShadowMode,
        Self::Refused,
        Self::Suspended,
        Self::Killed,
        Self::Ended,
        Self::Standby,
    ];

    /// The state as JSON, labels of metrics and the page write it.
    pub fn word(self) -> &'static str {
        match self {
            Self::NotStarted => "not-started",
            Self::Publishing => "publishing",
            Self::NotReceived => "not-received",
            Self::Flagged => "flagged",
            Self::Joining => "joining",
            Self::ShadowMode => "shadow-mode",
            Self::Refused => "refused",
            Self::Suspended => "suspended",
            Self::Killed => "killed",
            Self::Ended => "ended",
            Self::Standby => "standby",
        }
    }

    /// The state of the slot of a spare: empty is as it should be.
    pub(crate) fn of_slot(self) -> Self {
        match self {
            Self::NotStarted | Self::NotReceived | Self::Flagged | Self::Killed | Self::Ended => {
                Self::Standby
            }
            other => other,
        }
    }

    /// The state in a sentence.
    pub fn text(self) -> &'static str {
        match self {
            Self::NotStarted => "not started",
            Self::NotReceived => "not received",
            Self::ShadowMode => "shadow mode",
            other => other.word(),
        }
    }
}

/// Standing of a station, from the records up to a cycle, except for its process.
#[derive(Debug, Clone, Default)]
pub(crate) struct StationStanding {
    /// It has taken a turn at least once: it has reported one, or a remote I/O has received one.
    pub(crate) took_turns: bool,
    pub(crate) joining: bool,
    /// Programs whose state it has and is not proved yet.
    pub(crate) shadow: ProgramSet,
    pub(crate) refused: bool,
    /// Programs whose remote I/O has closed its slot.
    pub(crate) flagged_by: ProgramSet,
    /// The last action on it with its cycle.
    pub(crate) done: Option<(String, i64)>,
    /// The last action that may have silenced it and is not over.
    pub(crate) silenced: Option<(String, i64)>,
}

impl StationStanding {
    /// Its process begins anew: it holds no state.
    pub(crate) fn begin(&mut self) {
        self.joining = true;
        self.shadow = ProgramSet::EMPTY;
        self.refused = false;
    }

    /// Whether a remote I/O has closed its slot. Flags of other stations are about their own slots.
    pub(crate) fn is_flagged(&self) -> bool {
        !self.flagged_by.is_empty()
    }

    /// The state in a cycle; `received` says whether a remote I/O received its turn in this cycle.
    pub(crate) fn state(&self, process: Option<Process>, received: bool) -> StationState {
        match process {
            Some(Process::Killed) => StationState::Killed,
            Some(Process::Suspended) => StationState::Suspended,
            Some(Process::Ended) => StationState::Ended,
            _ if received => StationState::Publishing,
            _ if self.refused => StationState::Refused,
            _ if !self.shadow.is_empty() => StationState::ShadowMode,
            _ if self.joining => StationState::Joining,
            _ if self.is_flagged() && self.took_turns => StationState::Flagged,
            _ if self.took_turns => StationState::NotReceived,
            None => StationState::NotStarted,
            Some(Process::Running) => StationState::Joining,
        }
    }
}
