//! Events of a plant, for the journal.

use serde::{Deserialize, Serialize};
use understudy_cycle::Refusal;
use understudy_wire::{ConfigurationHash, Field, Image, Member, Moment};

/// Event of a plant.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(tag = "event", rename_all = "kebab-case")]
pub enum Event {
    /// It stepped by one cycle.
    Stepped {
        /// The cycle of the actuation that drives it.
        moment: Moment,
        /// Cause of the step.
        pace: Pace,
        /// y(i) that took effect.
        outputs: Image,
        /// Its sensors after the step, and its counts since its start.
        field: Field,
    },
    /// A member of this cluster runs another configuration; its frames are dropped.
    Refused {
        /// Member whose frames are dropped.
        member: Member,
        /// Its configuration.
        theirs: ConfigurationHash,
        /// The configuration of this plant.
        ours: ConfigurationHash,
    },
    /// A member whose frames were dropped is no longer received with another configuration.
    RefusalEnded {
        /// Member that was refused.
        member: Member,
    },
}

/// Cause of a step of a plant.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Pace {
    /// An actuation of a new cycle.
    Driven,
    /// Time: no actuation arrived, and the last outputs stay in effect.
    Alone,
    /// Time: no actuation arrived for so long that the watchdog has applied the fail-safe outputs.
    Watchdog,
}

impl From<Refusal> for Event {
    fn from(refusal: Refusal) -> Self {
        match refusal {
            Refusal::Begins { member, theirs, ours } => Self::Refused { member, theirs, ours },
            Refusal::Ends { member } => Self::RefusalEnded { member },
        }
    }
}
