//! What a station reports, for the journal.

use std::time::Duration;

use serde::{Deserialize, Serialize};
use smallvec::SmallVec;
use understudy_cycle::{Notice, Refusal};
use understudy_wire::{
    ConfigurationHash, Image, Lineage, Member, Moment, ProgramId, ProgramSet, StationId, Word,
};

/// One thing that happened to a station.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(tag = "event", rename_all = "kebab-case")]
pub enum Event {
    /// It took its turn.
    Published {
        /// In this cycle.
        moment: Moment,
        /// Its outputs.
        words: SmallVec<[Word; 2]>,
    },
    /// The state of a program as it holds it. Said now and then, so that whoever begins to look at a cluster that runs can follow
    /// its programs from there.
    Holds {
        /// After the sample of this cycle.
        moment: Moment,
        /// Whose state.
        program: ProgramId,
        /// Where it stands.
        lineage: Lineage,
        /// x(t+1).
        state: Image,
    },
    /// It starts the cycles from now on.
    BecameCycleMaster {
        /// From this cycle.
        moment: Moment,
    },
    /// Another station was silent for too long: θ = 1, and its slot is closed.
    Flagged {
        /// In this cycle.
        moment: Moment,
        /// Who was silent.
        station: StationId,
    },
    /// A flagged station speaks again.
    Cleared {
        /// In this cycle.
        moment: Moment,
        /// Who speaks.
        station: StationId,
    },
    /// It listens, and asks for the states that it lacks.
    Joins {
        /// In this cycle.
        moment: Moment,
        /// The programs whose states it lacks.
        wants: ProgramSet,
    },
    /// It has the state of a program: from another station, or by replaying from the initial state.
    Adopted {
        /// In this cycle.
        moment: Moment,
        /// Whose state.
        program: ProgramId,
        /// Where it stands now.
        lineage: Lineage,
        /// Who gave it; nobody where it was replayed from the initial state.
        from: Option<StationId>,
    },
    /// A copy proved itself in shadow: from now on it takes part in the turns.
    Synchronised {
        /// In this cycle.
        moment: Moment,
        /// Whose state.
        program: ProgramId,
    },
    /// Equal lineages and unequal digests: a value fault here or there.
    DigestDiffers {
        /// In this cycle.
        moment: Moment,
        /// Whose state.
        program: ProgramId,
        /// The station with the other digest.
        station: StationId,
    },
    /// The program's remote I/O has found this station's state of it faulty: it says nothing of it until the operator releases it.
    Excluded {
        /// In this cycle.
        moment: Moment,
        /// Whose state.
        program: ProgramId,
    },
    /// The operator has released it: it begins again, without that state.
    Readmitted {
        /// In this cycle.
        moment: Moment,
        /// Whose state.
        program: ProgramId,
    },
    /// A member of this cluster runs another configuration; its frames are dropped.
    Refused {
        /// Who.
        member: Member,
        /// Its configuration.
        theirs: ConfigurationHash,
        /// The configuration of this station.
        ours: ConfigurationHash,
    },
    /// The host woke this station too late to keep its times.
    Stalled {
        /// In this cycle.
        moment: Moment,
        /// Behind the time that it had asked for.
        late: Duration,
    },
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

impl From<Notice> for Event {
    fn from(notice: Notice) -> Self {
        match notice {
            Notice::Flagged { moment, station } => Self::Flagged { moment, station },
            Notice::Cleared { moment, station } => Self::Cleared { moment, station },
            Notice::Stalled { moment, late } => Self::Stalled { moment, late },
        }
    }
}
