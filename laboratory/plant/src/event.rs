//! What a plant reports, for the journal.

use serde::{Deserialize, Serialize};
use understudy_cycle::Refusal;
use understudy_wire::{ConfigurationHash, Field, Image, Member, Moment};

/// One thing that happened to a plant.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(tag = "event", rename_all = "kebab-case")]
pub enum Event {
    /// It moved on by one cycle.
    Stepped {
        /// The cycle of the actuation that drives it.
        moment: Moment,
        /// What made it step.
        pace: Pace,
        /// y(i), as it took effect.
        outputs: Image,
        /// What its sensors see afterwards, and what it has counted since its start.
        field: Field,
    },
    /// A member of this cluster runs another configuration; its frames are dropped.
    Refused {
        /// Who.
        member: Member,
        /// Its configuration.
        theirs: ConfigurationHash,
        /// The configuration of this plant.
        ours: ConfigurationHash,
    },
}

/// What made a plant step.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Pace {
    /// An actuation of a cycle that it had not seen yet.
    Driven,
    /// Time: no actuation came, and the last outputs stay in force.
    Alone,
    /// Time: no actuation has come for so long that the watchdog has put the fail-safe outputs in force.
    Watchdog,
}

impl From<Refusal> for Event {
    fn from(refusal: Refusal) -> Self {
        let Refusal {
            member,
            theirs,
            ours,
        } = refusal;
        Self::Refused {
            member,
            theirs,
            ours,
        }
    }
}
