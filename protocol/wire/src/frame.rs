//! What is said in a cycle. The bytes are in [`crate::encode`].
//!
//! ```text
//!  0 ─ Sync ─ Samples ─┬─ Turn of controller 1 ─ … ─ Turn of controller N ─ Turn of each understudy ─┬─ Join, Transfer ─ T
//!      cycle master       │  the token: speaking passes it on, a silent holder is passed over by time   │  rest
//!                      └─ Field comes before, Actuation at the deadline ──────────────────────────────┘
//! ```
//!
//! A controller's output is a [`Word`] whose mask is its own program; an understudy's words have wider masks. So one kind of
//! [`Turn`] serves both, and what may be applied is decided on words alone.

use serde::{Deserialize, Serialize};
use smallvec::SmallVec;

use crate::identifier::{
    ClusterHash, ConfigurationHash, Member, Moment, ProgramHash, ProgramId, StationId,
};
use crate::image::Image;
use crate::lineage::{Digest, Lineage};
use crate::set::{ProgramSet, StationSet};

/// Samples that one [`Sample`] may carry, this cycle's included.
pub const MAXIMUM_HISTORY: usize = 32;

/// One datagram.
#[derive(Debug, Clone, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct Frame {
    /// Who, when, and of which cluster.
    pub header: Header,
    /// What.
    pub body: Body,
}

/// Stands before every body.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct Header {
    /// The cluster it is meant for.
    pub cluster: ClusterHash,
    /// The sender's configuration; another one is refused.
    pub configuration: ConfigurationHash,
    /// Epoch and cycle in which it was made.
    pub moment: Moment,
    /// Who made it.
    pub sender: Member,
    /// Whether the sender has heard nobody else in this epoch yet; an epoch that only its founder knows binds nobody.
    pub alone: bool,
}

/// The kinds of frames.
#[derive(Debug, Clone, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum Body {
    /// The cycle master starts a cycle.
    Sync,
    /// A remote I/O says what it sampled.
    Sample(Sample),
    /// A station says its outputs, and passes the token by it.
    Turn(Turn),
    /// A station asks for states that it lacks, and says which it has.
    Join(Join),
    /// A station gives a state to one that asked.
    Transfer(Transfer),
    /// A simulated plant says what its sensors see.
    Field(Field),
    /// A remote I/O drives its simulated plant.
    Actuation(Actuation),
}

/// u(i) of this and of the last few cycles, with the lineage before the oldest of them.
#[derive(Debug, Clone, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct Sample {
    /// When this program was last started cold; its genesis lineage is a function of it.
    pub born: Moment,
    /// The lineage before the oldest sample of `history`.
    pub base: Lineage,
    /// The lineage before this cycle's sample, the last of `history`: L(i)(t).
    pub before: Lineage,
    /// The lineage after it, L(i)(t+1): what does not lead there has been changed since it was sampled.
    pub after: Lineage,
    /// Oldest first; the last is u(i)(t). Never empty.
    pub history: SmallVec<[Image; 2]>,
    /// The cycle of the newest sample whose outputs were applied, direct or reconstructed: the history never continues from a
    /// state before it. Nothing where no output of this history was applied.
    pub applied: Option<Moment>,
    /// Stations whose state of this program is proved to be faulty: they say nothing of it until the operator releases them.
    pub excluded: StationSet,
    /// Stations that can hold this program and that were not received for so long that none of them can come back without a
    /// state from another one.
    pub gone: StationSet,
}

/// Where an applied output came from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Source {
    /// From the controller itself, in this cycle and of the true lineage.
    Direct,
    /// By (12), from a parity word.
    Reconstructed,
    /// The last true output, kept.
    Held,
    /// The configured values.
    FailSafe,
}

/// What a station says when it holds the token.
#[derive(Debug, Clone, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct Turn {
    /// Whom it heard in this cycle before it published.
    pub heard: StationSet,
    /// The states that it has, one for each program at most, in the order of programs.
    pub holdings: SmallVec<[Holding; 2]>,
    /// Its outputs of this cycle; members are among `holdings`, and stepped with this cycle's sample.
    pub words: SmallVec<[Word; 2]>,
    /// Of programs whose remote I/Os have said nothing in this cycle; one for each at most.
    pub recalled: Vec<Recalled>,
    /// Programs that it runs and whose samples did not come from their remote I/Os in this cycle: others relay them.
    pub lacks: ProgramSet,
    /// Samples of this cycle that other stations lack; one for each program at most.
    pub relayed: Vec<Relayed>,
}

/// The sample of a program in this cycle, from a station that has received it to those that have not.
#[derive(Debug, Clone, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct Relayed {
    /// Whose sample.
    pub program: ProgramId,
    /// As its remote I/O sent it.
    pub sample: Sample,
}

/// A copy of a program's state that a station has.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct Holding {
    /// Whose state.
    pub program: ProgramId,
    /// When that program was last started cold.
    pub born: Moment,
    /// After the last sample that the copy was stepped with: L(i)(t+1) where that was this cycle's.
    pub lineage: Lineage,
    /// The cycle of that last sample.
    pub stepped: Moment,
    /// Of the state *before* that step, x(i)(t): the state that the words of this turn were computed from.
    pub digest: Digest,
}

/// A sum of outputs over GF(2): of all members of its mask, (9) where the mask is every program.
#[derive(Debug, Clone, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct Word {
    /// Never empty.
    pub mask: ProgramSet,
    /// Σ h(j)(x(j), u(j)) over the members, as wide as the widest.
    pub sum: Image,
}

/// Said in the rest of a cycle by a station that lacks a state or does not speak yet.
#[derive(Debug, Clone, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct Join {
    /// The programs whose state it asks for.
    pub wants: ProgramSet,
    /// What it has.
    pub holdings: SmallVec<[Holding; 2]>,
    /// As in a [`Turn`].
    pub recalled: Vec<Recalled>,
    /// As in a [`Turn`].
    pub lacks: ProgramSet,
}

/// What the newest sample of a program said, from a station that has heard none in this cycle: the program's remote I/O may
/// have lost its memory, and then takes it up from here.
#[derive(Debug, Clone, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct Recalled {
    /// Whose sample.
    pub program: ProgramId,
    /// Whether this station has received samples of two cycles of the program since it started: what it proved in an earlier life is in
    /// `applied` then.
    pub witnessed: bool,
    /// The newest applied sample that it knows of, as in a [`Sample`].
    pub applied: Option<Moment>,
    /// Stations that it excluded.
    pub excluded: StationSet,
    /// Stations that can have proved no output of a newer sample: gone, as in a [`Sample`], or received after this program's remote
    /// I/O had become silent, with a state that is no newer.
    pub accounted_for: StationSet,
    /// u(i), with the channels that were failed and the values that they kept.
    pub inputs: Image,
}

/// x(i), from one who has it to one who asked.
#[derive(Debug, Clone, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct Transfer {
    /// Who asked.
    pub to: StationId,
    /// Whose state.
    pub program: ProgramId,
    /// The program that it is a state of.
    pub hash: ProgramHash,
    /// When that program was last started cold.
    pub born: Moment,
    /// The state's own lineage.
    pub lineage: Lineage,
    /// The cycle of the last sample in it.
    pub stepped: Moment,
    /// Of the state before that sample, as in [`Holding`].
    pub digest: Digest,
    /// x(i) after that sample.
    pub state: Image,
}

/// What a simulated plant's sensors see.
#[derive(Debug, Clone, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct Field {
    /// u(i).
    pub sensors: Image,
    /// Parts that it has handed on to the plant it feeds, since its start.
    pub handed_over: u64,
    /// Parts that it has finished, since its start.
    pub finished: u64,
    /// Things that must not happen to a plant and did (a part dropped, a crash against an end), since its start.
    pub plant_faults: u64,
    /// Where its moving parts are, for the figures; each from 0 to 1000.
    pub positions: SmallVec<[u16; 4]>,
}

/// What a remote I/O drives.
#[derive(Debug, Clone, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct Actuation {
    /// y(i).
    pub outputs: Image,
}
