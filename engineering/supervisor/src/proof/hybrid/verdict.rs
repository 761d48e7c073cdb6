use std::fmt;

use crate::proof::verdict::{ScanRecord, write_scans};

/// What the proof of a hybrid ladder has found.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum HybridVerdict {
    /// Every scan does what net and supervisors say.
    Proved(HybridProof),
    /// A scan does not.
    Refuted(Box<HybridCounterexample>),
}

/// Extent of the exploration.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct HybridProof {
    /// States of the ladder with its inputs' last values.
    pub states: usize,
    /// Scans: states times what may happen in each.
    pub scans: u64,
    /// Markings of the net that were reached under the supervisors.
    pub markings: usize,
    /// Transitions that never fire, whatever the inputs do.
    pub never_fired: Vec<String>,
}

/// The shortest run (in scans) to a scan that net and supervisors do not allow, which is the last one.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct HybridCounterexample {
    /// The scans; their events are the transitions that fire, their states the tokens and the supervisors' states.
    pub scans: Vec<ScanRecord>,
    /// What is wrong with the last one.
    pub deviation: HybridDeviation,
}

/// How a scan departs from net and supervisors.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum HybridDeviation {
    /// A transition fires that the marking does not enable.
    NotEnabled {
        /// The transition.
        transition: String,
    },
    /// A transition fires without its condition, or before its delay.
    WithoutCondition {
        /// The transition.
        transition: String,
    },
    /// A transition fires that a supervisor disables.
    Disabled {
        /// The transition.
        transition: String,
        /// The supervisor.
        supervisor: String,
    },
    /// A supervisor has no transition for an uncontrollable event that the net can generate: it is not controllable.
    Uncontrollable {
        /// The transition.
        transition: String,
        /// The supervisor.
        supervisor: String,
    },
    /// A transition does not fire where nothing holds it back.
    Omitted {
        /// The transition.
        transition: String,
    },
    /// A token comes to a place and goes from it in one scan, and may not.
    Passed {
        /// The transition that takes it.
        transition: String,
        /// The place.
        place: String,
    },
    /// The bits of a place do not say how many tokens it holds.
    Tokens {
        /// The place.
        place: String,
        /// How many it holds.
        expected: u32,
    },
    /// The bits of a supervisor do not say its state.
    State {
        /// The supervisor.
        supervisor: String,
        /// Its state.
        expected: String,
    },
    /// A timer runs where its transition is not enabled, or does not where it is.
    Delay {
        /// The transition.
        transition: String,
    },
    /// An action is on without its token, or off with it.
    Action {
        /// Its signal.
        signal: String,
    },
}

impl fmt::Display for HybridDeviation {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NotEnabled { transition } => {
                write!(formatter, "{transition} fires, and no token enables it")
            }
            Self::WithoutCondition { transition } => {
                write!(formatter, "{transition} fires without its condition")
            }
            Self::Disabled { transition, supervisor } => {
                write!(formatter, "{transition} fires, and {supervisor} disables it")
            }
            Self::Uncontrollable { transition, supervisor } => {
                write!(formatter, "{supervisor} would have to forbid {transition}, and cannot")
            }
            Self::Omitted { transition } => {
                write!(formatter, "{transition} does not fire, and nothing holds it back")
            }
            Self::Passed { transition, place } => write!(
                formatter,
                "{transition} takes a token from {place} in the scan in which it came"
            ),
            Self::Tokens { place, expected } => {
                write!(formatter, "{place} holds {expected}, and its bits say otherwise")
            }
            Self::State { supervisor, expected } => {
                write!(formatter, "{supervisor} is in {expected}, and its bits say otherwise")
            }
            Self::Delay { transition } => write!(
                formatter,
                "the delay of {transition} lasts where it should not, or not where it should"
            ),
            Self::Action { signal } => {
                write!(formatter, "{signal} is not what the tokens say")
            }
        }
    }
}

impl fmt::Display for HybridCounterexample {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write_scans(formatter, &self.scans)?;
        writeln!(formatter, "{}", self.deviation)
    }
}
