//! Events of a station, for the journal.

use std::time::Duration;

use serde::{Deserialize, Serialize};
use smallvec::SmallVec;
use understudy_cycle::{Notice, Outvoted, Refusal};
use understudy_wire::{
    ConfigurationHash, Configurations, Image, Lineage, Member, Moment, ProgramHash, ProgramId,
    ProgramSet, StationId, Word,
};

/// Event of a station.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(tag = "event", rename_all = "kebab-case")]
pub enum Event {
    /// It published its turn.
    Published {
        /// Current cycle.
        moment: Moment,
        /// Its parity words.
        words: SmallVec<[Word; 2]>,
    },
    /// The state of a program that it holds. Reported periodically, so that a viewer of a running cluster can follow
    /// its programs from there.
    Holds {
        /// Cycle of the newest sample in the state.
        moment: Moment,
        /// Program of the state.
        program: ProgramId,
        /// Hash of that program; nothing in journals of earlier releases, where it is that of the cluster file.
        #[serde(default, alias = "changed", skip_serializing_if = "Option::is_none")]
        of: Option<ProgramHash>,
        /// Lineage of the state.
        lineage: Lineage,
        /// x(t+1).
        state: Image,
    },
    /// It starts the cycles from now on: it is the cycle master.
    BecameCycleMaster {
        /// First cycle that it starts.
        moment: Moment,
    },
    /// Another station was not received for `flag_after` cycles: θ = 1, and its slot is closed.
    Flagged {
        /// Current cycle.
        moment: Moment,
        /// Flagged station.
        station: StationId,
    },
    /// A flagged station was received again: θ = 0.
    Cleared {
        /// Current cycle.
        moment: Moment,
        /// Station that was received.
        station: StationId,
    },
    /// It listens, and asks for the states that it lacks.
    Joins {
        /// Current cycle.
        moment: Moment,
        /// The programs whose states it lacks.
        wants: ProgramSet,
    },
    /// It has the state of a program: from another station, or by replaying from the initial state.
    Adopted {
        /// Current cycle.
        moment: Moment,
        /// Program of the state.
        program: ProgramId,
        /// Lineage of the state.
        lineage: Lineage,
        /// Station that transferred it; `None` where it was replayed from the initial state.
        from: Option<StationId>,
    },
    /// A replica has ended its shadow mode: from now on the station publishes its outputs.
    Synchronised {
        /// Current cycle.
        moment: Moment,
        /// Program of the state.
        program: ProgramId,
    },
    /// Equal lineages and unequal digests: a value fault in one of two stations.
    DigestDiffers {
        /// Current cycle.
        moment: Moment,
        /// Program of the state.
        program: ProgramId,
        /// The station with the other digest.
        station: StationId,
    },
    /// The remote I/O has found this station's state of the program faulty: the station publishes none of its outputs
    /// until the operator releases it.
    Excluded {
        /// Current cycle.
        moment: Moment,
        /// Program of the state.
        program: ProgramId,
    },
    /// The operator has released it: it starts again, without that state.
    Readmitted {
        /// Current cycle.
        moment: Moment,
        /// Program of the state.
        program: ProgramId,
    },
    /// No sample of a program was received for a second or some cycles, from its remote I/O or relayed: its remote I/O does not live, is not
    /// received, or samples nothing.
    SamplesMissing {
        /// Current cycle.
        moment: Moment,
        /// The program.
        program: ProgramId,
    },
    /// Samples of the program are received again.
    SamplesReturned {
        /// Current cycle.
        moment: Moment,
        /// The program.
        program: ProgramId,
    },
    /// A member of this cluster runs another configuration; its frames are dropped.
    Refused {
        /// Member whose frames are dropped.
        member: Member,
        /// Its configuration.
        theirs: ConfigurationHash,
        /// The configuration of this station.
        ours: ConfigurationHash,
    },
    /// A member whose frames were dropped is no longer received with another configuration.
    RefusalEnded {
        /// Member that was refused.
        member: Member,
    },
    /// This station does not take part yet, and more stations have one other configuration than have its own: its process ends.
    Outvoted {
        /// The other configuration.
        theirs: ConfigurationHash,
        /// Stations with its own configuration, it included.
        stations: u32,
        /// Stations with the other one.
        others: u32,
    },
    /// The configuration that it runs, and the one that it has loaded beside it, after a step of an online change.
    Configured(Configurations),
    /// The history of a program changes to a program that this station has not loaded: it does not compute it from here on.
    NotPrepared {
        /// Current cycle.
        moment: Moment,
        /// Program that changes.
        program: ProgramId,
        /// Hash of the program that is missing.
        missing: ProgramHash,
    },
    /// The host woke this station too late to keep its times.
    Stalled {
        /// Current cycle.
        moment: Moment,
        /// Delay behind the time that it had asked for.
        late: Duration,
    },
}

impl From<Refusal> for Event {
    fn from(refusal: Refusal) -> Self {
        match refusal {
            Refusal::Begins { member, theirs, ours } => Self::Refused { member, theirs, ours },
            Refusal::Ends { member } => Self::RefusalEnded { member },
        }
    }
}

impl From<Notice> for Event {
    fn from(notice: Notice) -> Self {
        match notice {
            Notice::Flagged { moment, station } => Self::Flagged { moment, station },
            Notice::Cleared { moment, station } => Self::Cleared { moment, station },
            Notice::Outvoted(Outvoted { theirs, stations, others, .. }) => {
                Self::Outvoted { theirs, stations, others }
            }
            Notice::Configured(configurations) => Self::Configured(configurations),
            Notice::Stalled { moment, late } => Self::Stalled { moment, late },
        }
    }
}
