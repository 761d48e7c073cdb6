//! What a remote I/O does where nothing is proved: no station agrees with it about any of this, and it may change while the program runs.

use serde::{Deserialize, Serialize};
use understudy_wire::Image;

use crate::ramp::Ramp;

/// What the remote I/O of a program does where it has no proven output, and how its program starts.
#[derive(Debug, Clone, PartialEq)]
pub struct Fallback {
    /// Cycles for which the last proven outputs are held.
    pub hold_cycles: u32,
    /// Cycles after the switch of an online change in which a program fault takes the change back; never where it is 0.
    pub trial_cycles: u32,
    /// Fail-safe y(i), applied after that; its width is that of the outputs.
    pub fail_safe: Image,
    /// Outputs that move to their fail-safe values by a ramp.
    pub ramps: Vec<Ramp>,
    /// Who releases the outputs after a cold start.
    pub release: Release,
    /// Reaction to a value fault that no majority locates.
    pub value_fault: ValueFault,
    /// Reaction to a lost state.
    pub stale_state: StaleState,
    /// Start after a power failure; `None` of a program that has no retentive variables.
    pub restart: Option<Restart>,
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

/// Start of a program with retentive variables after a power failure, where no station holds its state.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Restart {
    /// From the initial state with the retentive values of the newest retained state.
    #[default]
    Warm,
    /// From the initial state, whatever was kept.
    Cold,
    /// The operator chooses between the two.
    Operator,
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
