//! Configuration of a remote I/O.

use std::sync::Arc;

use understudy_cycle::{Agreement, Fallback, Layout, SharedOutputs};
use understudy_wire::{ProgramHash, ProgramId};

use crate::diagnosis::Diagnosis;
use crate::paired_inputs::PairedInput;

/// Configuration of one remote I/O.
#[derive(Debug, Clone)]
pub struct Settings {
    /// The program whose plant it serves.
    pub program: ProgramId,
    /// Configuration shared by all members.
    pub agreement: Arc<Agreement>,
    /// Hash of the program's circuit.
    pub hash: ProgramHash,
    /// Points of the program.
    pub layout: Arc<Layout>,
    /// Ladder that finds failed channels that do not report it.
    pub diagnosis: Option<Arc<Diagnosis>>,
    /// What it does where nothing is proved.
    pub fallback: Fallback,
    /// Where the program has a second remote I/O.
    pub pair: Option<PairSettings>,
    /// Inputs that modules of both remote I/Os read; of no importance where only the author is wired to the plant.
    pub paired_inputs: Vec<PairedInput>,
    /// Numbers that modules of both remote I/Os drive together.
    pub shared_outputs: SharedOutputs,
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
    /// them drives it. Numbers that both drive add up ([`Settings::shared_outputs`]).
    Parallel {
        /// Samples in a row in which two readings of an input differ until an operator is told: at least 1.
        discrepancy_cycles: u32,
    },
}
