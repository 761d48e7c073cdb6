//! Configuration of a remote I/O.

use std::sync::Arc;

use serde::{Deserialize, Serialize};
use understudy_cycle::Agreement;
use understudy_wire::{Image, ProgramHash, ProgramId};

use crate::channel::Channel;
use crate::diagnosis::Diagnosis;

/// Configuration of one remote I/O.
#[derive(Debug, Clone)]
pub struct Settings {
    /// The program whose plant it serves.
    pub program: ProgramId,
    /// Configuration shared by all members.
    pub agreement: Arc<Agreement>,
    /// Hash of the program's circuit.
    pub hash: ProgramHash,
    /// Width of u(i) in bits.
    pub inputs: usize,
    /// Inputs whose channels report their own failure.
    pub channels: Vec<Channel>,
    /// Ladder that finds failed channels that do not report it.
    pub diagnosis: Option<Arc<Diagnosis>>,
    /// Cycles for which the last proven outputs are held.
    pub hold_cycles: u32,
    /// Fail-safe y(i), applied after that; its width is that of the outputs.
    pub fail_safe: Image,
    /// Who releases the outputs after a cold start.
    pub release: Release,
    /// Reaction to a value fault that no majority locates.
    pub value_fault: ValueFault,
    /// Reaction to a lost state.
    pub stale_state: StaleState,
}

/// Reaction where no living station can prove the state of the newest applied output, and one holds an older state.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum StaleState {
    /// The outputs are held, then fail-safe, until the operator chooses the older state or a cold start.
    #[default]
    Operator,
    /// The program starts cold.
    Cold,
}

/// Reaction where two stations publish different outputs of one history, and no third one makes a majority.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ValueFault {
    /// The last proven outputs for the configured cycles, then the fail-safe ones, until the stations agree again, a
    /// third one makes a majority, or the operator releases them.
    #[default]
    Hold,
    /// The outputs of the controller, which may be wrong.
    Alarm,
    /// The fail-safe outputs, at once, until the operator releases them.
    FailSafe,
}

/// Who releases the outputs after a program has started cold.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Release {
    /// No release is needed: outputs are applied as soon as they are proven.
    #[default]
    Automatic,
    /// The operator, by a command; fail-safe until then.
    Operator,
}
