//! What a remote I/O reports, for the journal.

use std::time::Duration;

use serde::{Deserialize, Serialize};
use smallvec::SmallVec;
use understudy_cycle::{Notice, Refusal};
use understudy_wire::{
    ConfigurationHash, Force, Image, Lineage, Member, Moment, ProgramId, SignalPlace, Source,
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
        /// Stations that published in this cycle, as heard here.
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
    /// No living station can prove the state that the newest applied output came from: the outputs are held, then fail-safe.
    StateLost {
        /// In this cycle.
        moment: Moment,
        /// The cycle of the newest sample whose outputs were applied; not known after a restart.
        applied: Option<Moment>,
        /// The cycle of the newest state that a living station holds.
        newest: Moment,
        /// The station that holds it.
        holder: StationId,
        /// Whether the operator is asked; the program starts cold otherwise.
        asks: bool,
    },
    /// A station has returned that can prove the state: the program continues.
    StateRecovered {
        /// In this cycle.
        moment: Moment,
        /// The station.
        from: StationId,
    },
    /// The operator chose a state that is not the newest available one, or where no choice was asked for.
    ChoiceRefused {
        /// In this cycle.
        moment: Moment,
        /// The cycle of the newest available state, where a choice is asked for.
        newest: Option<Moment>,
    },
    /// The failure of one station would be masked from now on.
    Protected {
        /// From this cycle.
        moment: Moment,
    },
    /// The failure of one station would not be masked any more.
    Unprotected {
        /// In this cycle.
        moment: Moment,
        /// The first cycle of those in a row in which it would not have been masked.
        since: Moment,
        /// The stations that could not prove the program's output, and why.
        lacking: SmallVec<[Lacking; 2]>,
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
    /// A member of this cluster runs another configuration; its frames are dropped.
    Refused {
        /// Who.
        member: Member,
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

/// A station that cannot stand in for a program, as its remote I/O sees it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct Lacking {
    /// The station.
    pub station: StationId,
    /// Why.
    #[serde(flatten)]
    pub reason: LackingReason,
}

/// Why a station cannot stand in for a program.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(tag = "reason", rename_all = "kebab-case")]
pub enum LackingReason {
    /// Its turn was not received: it is down, or the link from it to this remote I/O is.
    NotReceived,
    /// It asks for a state.
    Joining,
    /// Its state is behind: it has not received the newest samples.
    Behind {
        /// The cycle of its newest sample.
        stepped: Moment,
    },
    /// It was found faulty, and waits for the operator.
    Excluded,
    /// In the paper's mode: it has failed, and so no further failure is masked.
    Failed,
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
    /// No living station can prove the program's state.
    StateLost,
    /// The operator has not released the outputs after a cold start, or after a value fault.
    NotReleased,
    /// Stations disagree, and nobody says who is right.
    ValueFault,
    /// Neither the controller nor any word of an understudy was there with the true lineage.
    NotSynchronised,
    /// A word was there, and another member of it was not.
    TwoErasures,
    /// The paper's S2: two stations have failed.
    SecondFailure,
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
