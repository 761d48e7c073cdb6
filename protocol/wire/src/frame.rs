//! Frames of a cycle. Their bytes are in [`crate::encode`].
//!
//! ```text
//!  0 ─ Sync ─ Samples ─┬─ Turn of controller 1 ─ … ─ Turn of controller N ─ Turn of each understudy ─┬─ Join, Transfer ─ T
//!      cycle master    │  the token: a turn passes it on, as does the end of a slot without a turn      │  rest
//!                      └─ Field comes before, Actuation at the deadline ──────────────────────────────┘
//! ```
//!
//! A controller's output is a [`Word`] whose mask is its own program; an understudy's words have wider masks. So one
//! kind of [`Turn`] serves both, and what may be applied is decided on words alone.

use serde::{Deserialize, Serialize};
use smallvec::SmallVec;

use crate::identifier::{
    ClusterHash, ConfigurationHash, Member, Moment, ProgramHash, ProgramId, StationId,
};
use crate::image::Image;
use crate::lineage::{Digest, Lineage};
use crate::segment::{Segment, SegmentMask};
use crate::set::{ProgramSet, StationSet};
use crate::time::Time;
use crate::write::{Pulse, WriteId};

/// Samples that one [`Sample`] may carry, this cycle's included.
pub const MAXIMUM_HISTORY: usize = 32;

/// Change marks among them, at most: a further change waits until the first of them has left the history.
pub const MAXIMUM_CHANGE_MARKS: usize = 4;

/// Content of one datagram.
#[derive(Debug, Clone, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct Frame {
    /// Sender, cycle and cluster.
    pub header: Header,
    /// Content.
    pub body: Body,
}

/// Header of every frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct Header {
    /// Cluster that it is sent to.
    pub cluster: ClusterHash,
    /// Configuration of the sender; a frame of another configuration is refused.
    pub configuration: ConfigurationHash,
    /// Epoch and cycle in which it was sent.
    pub moment: Moment,
    /// Sender.
    pub sender: Member,
    /// The configuration that the sender has loaded beside its own, for an online change: members of either admit the frames of the other.
    pub prepared: Option<ConfigurationHash>,
    /// Whether the sender has received no other member in this epoch yet; an epoch that only its founder knows binds no
    /// member.
    pub alone: bool,
}

/// The configuration of a member, and the one that it has loaded beside it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct Configurations {
    /// The one that it runs.
    pub own: ConfigurationHash,
    /// The one that an online change leads to, or came from.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub prepared: Option<ConfigurationHash>,
}

impl Configurations {
    /// Whether a member with these takes a frame with this header: sender and receiver have a configuration in common.
    pub fn admit(&self, header: &Header) -> bool {
        header.configuration == self.own
            || header.prepared == Some(self.own)
            || self.prepared == Some(header.configuration)
    }

    /// Whether members with these and with `other` take each other's frames.
    pub fn agree(&self, other: &Self) -> bool {
        self.own == other.own
            || other.prepared == Some(self.own)
            || self.prepared == Some(other.own)
    }
}

/// Content of a frame, by kind.
#[derive(Debug, Clone, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum Body {
    /// The cycle master starts a cycle.
    Sync,
    /// A remote I/O sends its sample.
    Sample(Sample),
    /// A station publishes its outputs and passes the token.
    Turn(Turn),
    /// A station asks for states that it lacks, and reports those that it holds.
    Join(Join),
    /// A station transfers a state to the station that asked.
    Transfer(Transfer),
    /// A simulated plant sends its sensors.
    Field(Field),
    /// A remote I/O drives its simulated plant.
    Actuation(Actuation),
    /// One of two remote I/Os of a program reports to the other one.
    Pair(Pair),
}

/// u(i) of this and of the last few cycles, with the lineage before the oldest of them.
#[derive(Debug, Clone, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct Sample {
    /// Moment of the last start of this program, cold or warm; the lineage that it started with is a function of it.
    pub born: Moment,
    /// The lineage before the oldest sample of `history`.
    pub base: Lineage,
    /// The lineage before this cycle's sample, the last of `history`: L(i)(t).
    pub before: Lineage,
    /// The lineage after it, L(i)(t+1): a sample that does not lead to it was changed after it was sampled.
    pub after: Lineage,
    /// Oldest first; the last is that of this cycle. Never empty.
    pub history: SmallVec<[Step; 2]>,
    /// The cycle of the newest sample whose outputs were applied, direct or reconstructed: the history never continues
    /// from a state before it. `None` where no output of this history was applied.
    pub applied: Option<Moment>,
    /// Stations whose state of this program was found faulty: they publish none of its outputs until the operator
    /// releases them.
    pub excluded: StationSet,
    /// Stations that can hold this program and that were not received for so long that none of them can come back
    /// without a state from another one.
    pub gone: StationSet,
    /// Whether this remote I/O drives the outputs that it can prove: they are released, and no station is suspected.
    pub drives: bool,
    /// The newest write of each session that has written lately; the values are in `history`.
    pub writes: SmallVec<[WriteId; 1]>,
    /// Pulses that are not over after this sample, in the order of inputs.
    pub pulses: SmallVec<[Pulse; 1]>,
    /// u(i)(t) as it would be without the forces of operators; `None` where no force changes it.
    pub unforced: Option<Image>,
    /// Version of the program that takes u(i)(t), where an online change that the sender has loaded replaces its points: it tells what each bit of the
    /// inputs and the outputs is. `None` where they have one layout in all configurations that the sender has loaded, and where the remote I/O does not know it.
    pub version: Option<ProgramHash>,
}

impl Sample {
    /// u(i)(t) without the forces of operators: what a remote I/O that restarts goes on from, because a force ends with its process. `None`
    /// without history.
    pub fn without_forces(&self) -> Option<&Image> {
        self.unforced.as_ref().or(self.history.last().map(|step| &step.inputs))
    }

    /// Whether its last step leads from [`Self::before`] to [`Self::after`]; another one was changed on its way.
    pub fn is_intact(&self) -> bool {
        self.history.last().is_some_and(|newest| self.before.after_step(newest) == self.after)
    }
}

/// One step of a program: what it reads, and the program that takes it from here on, where that changes.
#[derive(Debug, Clone, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct Step {
    /// The change mark: this program takes the step, with the state of the one before it as its own. `None` where the program stays.
    pub change: Option<ProgramHash>,
    /// u(i)(t).
    pub inputs: Image,
}

impl Step {
    /// A step without a change of the program.
    pub fn of(inputs: Image) -> Self {
        Self { change: None, inputs }
    }
}

/// Source of an applied output.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Source {
    /// Received from the controller, in this cycle and of the true lineage.
    Direct,
    /// Reconstructed from a parity word by (12).
    Reconstructed,
    /// The last proven output, applied again.
    Held,
    /// The configured fail-safe values.
    FailSafe,
}

/// Frame of the station that holds the token.
#[derive(Debug, Clone, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct Turn {
    /// Stations that published in this cycle before it did, as far as it knows.
    pub heard: StationSet,
    /// The states that it holds, one for each program at most, in the order of programs.
    pub holdings: SmallVec<[Holding; 2]>,
    /// Its outputs of this cycle; members are among `holdings`, and stepped with this cycle's sample.
    pub words: SmallVec<[Word; 2]>,
    /// Recalled samples of programs whose remote I/Os were not received in this cycle; one for each at most.
    pub recalled: Vec<Recalled>,
    /// Programs that it runs and whose samples did not come from their remote I/Os in this cycle: others relay them.
    pub lacks: ProgramSet,
    /// Samples of this cycle that other stations lack; one for each program at most.
    pub relayed: Vec<Relayed>,
}

/// Sample of a program in this cycle, from a station that has received it, for stations that have not.
#[derive(Debug, Clone, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct Relayed {
    /// Program of the sample.
    pub program: ProgramId,
    /// As its remote I/O sent it.
    pub sample: Sample,
}

/// State of a program that a station holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct Holding {
    /// Program of the state.
    pub program: ProgramId,
    /// Moment of the last cold start of that program.
    pub born: Moment,
    /// Lineage after the last sample in the state: L(i)(t+1) where that was the sample of this cycle.
    pub lineage: Lineage,
    /// Cycle of that last sample.
    pub stepped: Moment,
    /// Digest of the state *before* that step, x(i)(t): the state that the words of this turn were computed from.
    pub digest: Digest,
    /// Version of the program whose state it is, where an online change that the sender has loaded replaces its points: it tells what each bit of the
    /// inputs and the outputs is. `None` where they have one layout in all configurations that the sender has loaded.
    pub version: Option<ProgramHash>,
}

impl Holding {
    /// The holding of a program, among those of one turn or join, which are in the order of programs.
    pub fn of(holdings: &[Self], program: ProgramId) -> Option<&Self> {
        // An understudy that holds all states has each at the index of its program.
        let at_index = holdings.get(program.index());
        at_index.filter(|holding| holding.program == program).or_else(|| {
            let place = holdings.binary_search_by_key(&program, |holding| holding.program);
            place.ok().map(|place| &holdings[place])
        })
    }
}

/// State that a station has kept on disk.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct Kept {
    /// The state, as of one that a station holds.
    pub holding: Holding,
    /// Hash of the program that was in this state: another one than that of the cluster where its values were taken over.
    pub of: ProgramHash,
    /// Whether each of its retentive values is in what the program starts from.
    pub is_whole: bool,
}

/// A sum of outputs over GF(2): of all members of its mask, (9) where the mask is every program.
#[derive(Debug, Clone, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct Word {
    /// Never empty.
    pub mask: ProgramSet,
    /// Σ h(j)(x(j), u(j)) over the members, as wide as the widest.
    pub sum: Image,
}

/// Sent in the rest of a cycle by a station that lacks a state or does not publish yet.
#[derive(Debug, Clone, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct Join {
    /// Programs whose state it asks for.
    pub wants: ProgramSet,
    /// States that it holds.
    pub holdings: SmallVec<[Holding; 2]>,
    /// States that it has kept on disk, of programs whose state it does not hold: they can start warm from these.
    pub retained: Vec<Kept>,
    /// As in a [`Turn`].
    pub recalled: Vec<Recalled>,
    /// As in a [`Turn`].
    pub lacks: ProgramSet,
    /// States of several segments of which it has some; one for each program of `wants` at most.
    pub partial: Vec<Partial>,
}

/// A state of which a station has received some segments.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct Partial {
    /// Program of the state.
    pub program: ProgramId,
    /// Lineage of the state.
    pub lineage: Lineage,
    /// Segments that are missing.
    pub missing: SegmentMask,
    /// Whether no segment came for so long that a station with another state may send that.
    pub waits: bool,
}

/// The newest sample of a program as recalled by a station that has received none in this cycle: the program's remote
/// I/O may have lost its memory, and restores it from here.
#[derive(Debug, Clone, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct Recalled {
    /// Program of the sample.
    pub program: ProgramId,
    /// Moment of the sample.
    pub sampled: Moment,
    /// Samples of the program that this station has received since it started.
    pub received: SamplesReceived,
    /// The newest applied sample that it knows of, as in a [`Sample`].
    pub applied: Option<Moment>,
    /// Stations that the remote I/O had excluded.
    pub excluded: StationSet,
    /// Stations that cannot have proved an output of a newer sample: gone, as in a [`Sample`], or received after the
    /// remote I/O had become silent, with a state that is no newer.
    pub accounted_for: StationSet,
    /// As in a [`Sample`].
    pub writes: SmallVec<[WriteId; 1]>,
    /// As in a [`Sample`].
    pub pulses: SmallVec<[Pulse; 1]>,
    /// u(i) without the forces of operators, with the channels that were failed and the values that they kept, and the values that operators
    /// wrote.
    pub inputs: Image,
    /// As in the [`Sample`].
    pub version: Option<ProgramHash>,
}

/// Samples of a program that a station has received since it started: what they tell of the outputs that it may have proved.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum SamplesReceived {
    /// None: it has proved no output since it started, whatever state it holds.
    Nothing,
    /// Of one cycle, in which it may have started: outputs of that sample may have been proved in an earlier life of this station.
    First,
    /// Of a cycle that began after it started: outputs that it proved in an earlier life are covered by [`Recalled::applied`].
    Later,
}

/// x(i), or a segment of it, for the station that asked.
#[derive(Debug, Clone, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct Transfer {
    /// Station that asked.
    pub to: StationId,
    /// Program of the state.
    pub program: ProgramId,
    /// Hash of that program.
    pub hash: ProgramHash,
    /// Moment of the last cold start of that program.
    pub born: Moment,
    /// Lineage of the state.
    pub lineage: Lineage,
    /// Cycle of the last sample in it.
    pub stepped: Moment,
    /// Digest of the state before that sample, as in [`Holding`].
    pub digest: Digest,
    /// x(i) after that sample.
    pub state: Segment,
}

/// Sensors and counts of a simulated plant.
#[derive(Debug, Clone, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct Field {
    /// u(i).
    pub sensors: Image,
    /// Parts handed over to the plant that it feeds, since its start.
    pub handed_over: u64,
    /// Parts finished, since its start.
    pub finished: u64,
    /// Plant faults, such as a dropped part or a collision with an end stop, since its start.
    pub plant_faults: u64,
    /// Positions of its moving parts, for the figures; each from 0 to 1000.
    pub positions: SmallVec<[u16; 4]>,
}

/// Outputs that a remote I/O drives.
#[derive(Debug, Clone, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct Actuation {
    /// y(i).
    pub outputs: Image,
}

/// What one of two remote I/Os of a program reports to the other one.
#[derive(Debug, Clone, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct Pair {
    /// Its part.
    pub part: Part,
    /// Whether it can become the author: its field device answered it when it was connected to it last.
    pub able: bool,
    /// Whether it receives a station that can hold the state of the program.
    pub receives_stations: bool,
    /// When it was sent, on the clock of the sender.
    pub sent: Time,
    /// The newest [`Self::sent`] of the other one by which this one is bound: it does not become the author for `take_over_after` deadlines after
    /// it received that frame. `None` where it is not bound.
    pub bound_by: Option<Time>,
    /// Values of the modules, where both remote I/Os are wired to the plant; `None` where only the author is.
    pub modules: Option<Modules>,
}

/// What one of two remote I/Os that are both wired to the plant sends to the other one.
#[derive(Debug, Clone, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum Modules {
    /// The author.
    Author {
        /// Outputs that the modules of the other one drive from the deadline of this cycle on; `None` in any other frame than the one of a deadline.
        outputs: Option<Image>,
        /// What these outputs are of the numbers that the modules of both drive together; the whole without such numbers.
        share: Share,
        /// [`Pair::sent`] of the newest frame of the other one: the outputs were sent later.
        answers: Option<Time>,
        /// Inputs, by their first bits, whose module is not trusted, at the first remote I/O and at the twin: at one of them where it is excluded, at both
        /// where they differ for too long.
        distrusted: [Image; 2],
    },
    /// The other one.
    Follower {
        /// Inputs as its modules show them; `None` where its field does not answer.
        inputs: Option<Image>,
        /// Whether its modules drive the outputs of the author.
        follows: bool,
    },
}

/// What one of two modules drives of a number that both drive together.
#[derive(
    Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Default, Serialize, Deserialize,
)]
pub enum Share {
    /// 0.
    Nothing,
    /// Half of it.
    Half,
    /// The number itself.
    #[default]
    Whole,
}

impl Share {
    /// What the other one may drive.
    #[must_use]
    pub fn rest(self) -> Self {
        match self {
            Self::Nothing => Self::Whole,
            Self::Half => Self::Half,
            Self::Whole => Self::Nothing,
        }
    }
}

/// The part of one of two remote I/Os of a program.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Part {
    /// It takes no samples. Its modules are not driven, or drive the outputs of the author where both remote I/Os are wired to the plant.
    Follower,
    /// It connects to its field, and samples nothing and drives nothing yet.
    TakingOver,
    /// It makes u(i) and drives y(i).
    Author,
}
