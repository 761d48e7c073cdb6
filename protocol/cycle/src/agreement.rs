//! The configuration that all members of one cluster share, because they read the same cluster file.

use serde::{Deserialize, Serialize};

use crate::schedule::Schedule;
use understudy_wire::{ClusterHash, ConfigurationHash};

/// Configuration of the cluster, equal in every member. A member with another hash of it is refused.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Agreement {
    /// Hash of the cluster's name, in every frame.
    pub cluster: ClusterHash,
    /// Hash of the programs and of all values below.
    pub configuration: ConfigurationHash,
    /// Slots of a cycle.
    pub schedule: Schedule,
    /// Number of failures that are masked.
    pub mode: Mode,
    /// Samples that a remote I/O keeps and sends, this cycle's included: 1 to [`understudy_wire::MAXIMUM_HISTORY`].
    pub history: usize,
    /// Cycles without a turn after which a station is flagged, θ = 1: at least 1.
    pub flag_after: u32,
    /// Cycles for which an adopted state is computed in shadow mode before its outputs are published.
    pub shadow_cycles: u32,
    /// Cycles for which a member that has started waits for a state from other members: at least 1.
    pub listen_cycles: u32,
}

/// Number of failures that are masked.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Mode {
    /// One parity word over the programs whose controllers were received, and one for each other program: any number of
    /// failed controllers, as long as one understudy is synchronised.
    #[default]
    Full,
    /// The paper's mode: one parity word over all programs. The second failure is the paper's state S2, and all outputs
    /// fall safe.
    Paper,
}
