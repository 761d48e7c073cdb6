//! What a remote I/O is told when it starts.

use std::sync::Arc;

use serde::{Deserialize, Serialize};
use understudy_cycle::Agreement;
use understudy_wire::{Image, ProgramHash, ProgramId};

use crate::channel::Channel;
use crate::diagnosis::Diagnosis;

/// A remote I/O's own settings.
#[derive(Debug, Clone)]
pub struct Settings {
    /// The program whose plant it serves.
    pub program: ProgramId,
    /// What all agreed on.
    pub agreement: Arc<Agreement>,
    /// Of the program's circuit.
    pub hash: ProgramHash,
    /// Width of u(i) in bits.
    pub inputs: usize,
    /// Inputs whose channels say when they are failed.
    pub channels: Vec<Channel>,
    /// What finds failed channels that do not say so.
    pub diagnosis: Option<Arc<Diagnosis>>,
    /// Cycles for which the last true outputs are kept when nothing true is there.
    pub hold_cycles: u32,
    /// y(i) after that; its width is that of the outputs.
    pub fail_safe: Image,
    /// Who releases the outputs after a cold start.
    pub release: Release,
    /// What is driven while nobody can say which of two stations is right.
    pub value_fault: ValueFault,
    /// What follows where the state of the program is lost.
    pub stale_state: StaleState,
}

/// What follows where no living station can prove the state that the newest applied output came from, and one holds an older state.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum StaleState {
    /// The outputs are held, then fail-safe, until the operator chooses the older state or a cold start.
    #[default]
    Operator,
    /// The program starts cold.
    Cold,
}

/// What is driven while two stations say different outputs from one history, and no third one says which is right.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ValueFault {
    /// The last true outputs for the configured cycles, then the fail-safe ones, until they agree again, a third one
    /// says who is right, or the operator releases them.
    #[default]
    Hold,
    /// The outputs of the controller itself, which may be wrong.
    Alarm,
    /// The fail-safe outputs, at once, until the operator releases them.
    FailSafe,
}

/// Who releases the outputs after a program has started cold.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Release {
    /// Nobody has to: they are driven as soon as they are true.
    #[default]
    Automatic,
    /// The operator, by a command; fail-safe until then.
    Operator,
}
