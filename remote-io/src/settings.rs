//! Configuration of a remote I/O.

use std::sync::Arc;

use serde::{Deserialize, Serialize};
use understudy_cycle::Agreement;
use understudy_wire::{Image, ProgramHash, ProgramId};

use crate::channel::Channel;
use crate::diagnosis::Diagnosis;
use crate::paired_inputs::PairedInput;
use crate::ramp::Ramp;
use crate::source::{OperatorInput, PointPlace, SignalInput, SignalSource};

/// Configuration of one remote I/O.
#[derive(Debug, Clone)]
pub struct Settings {
    /// The program whose plant it serves.
    pub program: ProgramId,
    /// Configuration shared by all members.
    pub agreement: Arc<Agreement>,
    /// Hash of the program's circuit.
    pub hash: ProgramHash,
    /// u(i) where nothing drives it: the initial values of its variables.
    pub undriven: Image,
    /// Signals of u(i), in the order of their bits.
    pub input_points: Vec<PointPlace>,
    /// Signals of y(i), in the order of their bits.
    pub output_points: Vec<PointPlace>,
    /// Inputs that operators write; no two share a bit with each other or with a signal.
    pub operator_inputs: Vec<OperatorInput>,
    /// Inputs that are outputs of other programs.
    pub signals: Vec<SignalInput>,
    /// The programs that compute them, each once.
    pub signal_sources: Vec<SignalSource>,
    /// Inputs whose channels report their own failure.
    pub channels: Vec<Channel>,
    /// Where the program reports a program fault; `None` for a program that has none.
    pub stop: Option<StopPoints>,
    /// Ladder that finds failed channels that do not report it.
    pub diagnosis: Option<Arc<Diagnosis>>,
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
    /// Where the program has a second remote I/O.
    pub pair: Option<PairSettings>,
    /// Inputs that modules of both remote I/Os read; of no importance where only the author is wired to the plant.
    pub paired_inputs: Vec<PairedInput>,
}

/// Configuration of one of two remote I/Os of a program.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct PairSettings {
    /// Whether this is the twin; the other one goes first where neither is the author.
    pub is_twin: bool,
    /// Cycles without the author after which the other one takes over: at least 1.
    pub take_over_after: u32,
    /// How the two are wired to the plant.
    pub wiring: Wiring,
}

impl PairSettings {
    /// The first of two remote I/Os at one device, to which the author only connects.
    pub fn exclusive(take_over_after: u32) -> Self {
        Self { is_twin: false, take_over_after, wiring: Wiring::Exclusive }
    }

    /// Periods for which modules drive outputs that are not renewed: of a remote I/O that does not receive the author, and by their own watchdogs. As long
    /// as a switchover may take, and one more.
    pub fn lasting(&self) -> u32 {
        self.take_over_after.saturating_add(SWITCHOVER + 1)
    }
}

/// Cycles of a switchover after `take_over_after`: the one in which the other remote I/O begins, and one until it may.
pub const SWITCHOVER: u32 = 2;

/// How the two remote I/Os of a program are wired to the plant.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Wiring {
    /// Both reach one device, and the author only connects to it.
    Exclusive,
    /// Each has modules of its own. Two input modules read each sensor, and two output modules drive each actuator through diodes: it is on where one of
    /// them drives it.
    Parallel {
        /// Samples in a row in which two readings of an input differ until an operator is told: at least 1.
        discrepancy_cycles: u32,
    },
}

impl Settings {
    /// Bits of u(i) that do not come from the field.
    pub fn sourced_bits(&self) -> impl Iterator<Item = usize> + '_ {
        let operators = self.operator_inputs.iter().map(|input| input.place);
        let signals = self.signals.iter().map(|signal| signal.place);
        let places = operators.chain(signals).flat_map(|place| {
            let first = usize::from(place.bit);
            first..first + place.of.bits() as usize
        });
        let of_groups = self.operator_inputs.iter().filter_map(|input| input.valid());
        let valid = self.signals.iter().filter_map(|signal| signal.valid);
        places.chain(valid.chain(of_groups).map(usize::from))
    }
}

/// The points by which a program with numbers reports a program fault.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct StopPoints {
    /// Bit of y(i): a fault has stopped the program.
    pub stopped: usize,
    /// Bit of u(i): the program starts again from its initial state.
    pub reset: usize,
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
