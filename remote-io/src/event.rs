//! What a remote I/O reports, for the journal.

use std::time::Duration;

use serde::{Deserialize, Serialize};
use understudy_wire::{
    ConfigurationHash, Force, Image, Lineage, Moment, Party, ProgramId, SignalPlace, Source,
    StationId, StationSet,
};

use crate::settings::ValueFault;

/// One thing that happened to a remote I/O.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(tag = "event", rename_all = "kebab-case")]
pub enum Event {
    /// u(i) of a cycle. Reported before the sample leaves, so that there is a record of it even of one who dies before the deadline.
    Sampled {
        /// This cycle.
        moment: Moment,
        /// u(i).
        inputs: Image,
        /// When the program was last started cold; its genesis lineage is a function of it.
        born: Moment,
        /// The lineage that this sample extends, L(i)(t).
        before: Lineage,
    },
    /// A deadline: what was sampled in this cycle, and what is driven from now on.
    Applied {
        /// This cycle.
        moment: Moment,
        /// u(i); nothing where no cycle was started or the history is not known yet.
        sampled: Option<Image>,
        /// y(i).
        outputs: Image,
        /// Where it came from.
        source: Source,
        /// Whose word restored it.
        word_of: Option<StationId>,
        /// Why nothing true was left, where the outputs are held or fail-safe.
        missing: Option<Missing>,
        /// Stations that spoke in this cycle, as heard here.
        heard: StationSet,
    },
    /// The program starts from its initial state.
    StartedCold {
        /// Its genesis.
        born: Moment,
        /// Whether the operator has to release the outputs.
        awaits_release: bool,
    },
    /// After a restart, or when no living station is on this remote I/O's history: it goes on from a lineage that one still has.
    AdoptedLineage {
        /// In this cycle.
        moment: Moment,
        /// The lineage.
        lineage: Lineage,
        /// Who has it.
        from: StationId,
    },
    /// After a restart: living stations hold different states of one cycle. The operator decides, by releasing the outputs, for
    /// the first of them.
    Disputed {
        /// In this cycle.
        moment: Moment,
        /// Who holds them.
        stations: StationSet,
    },
    /// Samples that nobody heard are void: the program goes on from an older state that a station still has.
    Voided {
        /// In this cycle.
        moment: Moment,
        /// How many.
        samples: usize,
        /// Where it goes on from.
        lineage: Lineage,
    },
    /// The operator has released the outputs, and the stations that were excluded or accused.
    Released {
        /// In this cycle.
        moment: Moment,
    },
    /// The operator has put a value in the place of a signal. An input is sampled so; an output is driven so, whatever is applied.
    Forced {
        /// From this cycle.
        moment: Moment,
        /// Which signal, what, for how long, who and why.
        force: Force,
    },
    /// The signal is its own again.
    Unforced {
        /// From this cycle.
        moment: Moment,
        /// Which signal.
        signal: SignalPlace,
        /// Whether its time was over; the operator has taken it back otherwise.
        expired: bool,
    },
    /// After a restart: stations recall whom this remote I/O had excluded.
    RecalledExclusion {
        /// In this cycle.
        moment: Moment,
        /// They stay excluded until the operator releases them.
        stations: StationSet,
    },
    /// The diagnosis finds other channels failed than before.
    Diagnosed {
        /// From this cycle.
        moment: Moment,
        /// Their statuses, as bits of u(i).
        failed: Image,
    },
    /// A station was silent for too long: θ = 1.
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
    /// All outputs of the word are there and their sum is not 0: a value fault, (10) does not hold.
    Syndrome {
        /// In this cycle.
        moment: Moment,
        /// The sum.
        syndrome: Image,
        /// One of these is wrong.
        accused: StationSet,
    },
    /// Stations say different outputs, or have different states, of one history of this program. Reported when it begins.
    ValueFault {
        /// In this cycle.
        moment: Moment,
        /// Those of them that can be wrong: by majority where it is located.
        accused: StationSet,
        /// Whether it is known who is wrong; then the outputs of the others are driven, and the accused excluded.
        located: bool,
        /// What is driven otherwise.
        answer: ValueFault,
    },
    /// Equal lineages and unequal digests of a program's state: a value fault in one of two stations.
    DigestDiffers {
        /// In this cycle.
        moment: Moment,
        /// Whose state.
        program: ProgramId,
        /// One of these is wrong.
        accused: StationSet,
    },
    /// A party of this cluster runs another configuration; its frames are dropped.
    Refused {
        /// Who.
        party: Party,
        /// Its configuration.
        theirs: ConfigurationHash,
        /// The configuration of this remote I/O.
        ours: ConfigurationHash,
    },
    /// The host woke this remote I/O too late to keep its times.
    Stalled {
        /// In this cycle.
        moment: Moment,
        /// Behind the time that it had asked for.
        late: Duration,
    },
}

/// Why there was nothing true to apply.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Missing {
    /// No cycle was started in time.
    NoCycle,
    /// The host woke this remote I/O more than a period after the deadline.
    TooLate,
    /// The sensors cannot be seen: their device is lost, or refuses.
    BadQuality,
    /// This remote I/O does not know its program's history yet.
    NoHistory,
    /// The operator has not released the outputs after a cold start, or after a value fault.
    NotReleased,
    /// Stations disagree, and nobody says who is right.
    ValueFault,
    /// Neither the controller nor any word of an understudy was there with the true lineage.
    NobodyInStep,
    /// A word was there, and another member of it was not.
    TwoErasures,
    /// The paper's S2: two stations have failed.
    SecondFailure,
}
