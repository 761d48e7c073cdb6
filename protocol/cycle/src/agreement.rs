//! What all members of one cluster have agreed on, because they read the same cluster file.

use serde::{Deserialize, Serialize};

use crate::schedule::Schedule;
use understudy_wire::{ClusterHash, ConfigurationHash};

/// Equal in every member; its hash is `configuration`, and a member with another hash is refused.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Agreement {
    /// Whose frames these are.
    pub cluster: ClusterHash,
    /// Of the programs and of everything below.
    pub configuration: ConfigurationHash,
    /// When who speaks.
    pub schedule: Schedule,
    /// How many failures are masked.
    pub mode: Mode,
    /// Samples that a remote I/O keeps and sends, this cycle's included: 1 to [`understudy_wire::MAXIMUM_HISTORY`].
    pub history: usize,
    /// Cycles of silence after which a station is flagged, θ = 1: at least 1.
    pub flag_after: u32,
    /// Cycles for which an adopted state is computed in shadow before it takes part in the turns.
    pub shadow_cycles: u32,
    /// Cycles for which one who has just started listens before it believes that nobody has what it lacks: at least 1.
    pub listen_cycles: u32,
}

/// How many failures are masked.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Mode {
    /// A parity word for those who are synchronised, and one for each that was silent in this cycle: any number of failed
    /// controllers, as long as one understudy lives.
    #[default]
    Full,
    /// The paper's: one word over all programs; the second failure is S2, and everything falls safe.
    Paper,
}
