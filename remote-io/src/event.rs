//! Events of a remote I/O, for the journal.

mod reason;

use std::time::Duration;

use serde::{Deserialize, Serialize};
use smallvec::SmallVec;
use understudy_cycle::{Notice, Outvoted, Refusal, ValueFault};
use understudy_wire::{
    ConfigurationHash, Configurations, Force, Image, Lineage, Member, Moment, OrderRefusal, Part,
    ProgramHash, ProgramId, SignalPlace, Source, StationId, StationSet, Write, WriteId,
    WriteRefusal,
};

pub use self::reason::{
    AskReason, ForceEnd, Lacking, LackingReason, Missing, OldInputs, PartnerLack,
};

/// Event of a remote I/O.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(tag = "event", rename_all = "kebab-case")]
pub enum Event {
    /// u(i) of a cycle. Reported before the sample is sent, so that it is recorded even if the remote I/O fails before
    /// the deadline.
    Sampled {
        /// Cycle of the sample.
        moment: Moment,
        /// u(i).
        inputs: Image,
        /// When the program was last started cold; its genesis lineage is a function of it.
        born: Moment,
        /// The lineage that this sample extends, L(i)(t).
        before: Lineage,
        /// The program that takes this sample and all after it, where that changes.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        change: Option<ProgramHash>,
    },
    /// The program of an online change takes this sample and all after it; outputs of this cycle are those of the new program.
    ProgramChanged {
        /// Cycle of the sample.
        moment: Moment,
        /// Hash of the program before; none where it is not known, since this remote I/O has taken over its state.
        from: Option<ProgramHash>,
        /// Hash of the program after.
        to: ProgramHash,
    },
    /// The version of the program whose points count from the start of the process on.
    Points {
        /// Hash of the version.
        version: ProgramHash,
    },
    /// The points of another version of the program count from now on: for all that is reported of inputs and outputs after this.
    PointsChanged {
        /// Cycle.
        moment: Moment,
        /// Hash of the version before.
        from: ProgramHash,
        /// Hash of the version after.
        to: ProgramHash,
    },
    /// A station holds a state of a version of the program whose points are not loaded here: nothing is sampled until they are.
    PointsUnknown {
        /// Cycle.
        moment: Moment,
        /// Hash of the version.
        version: ProgramHash,
    },
    /// A program fault has stopped the new program of an online change while it was on trial: the program before takes the next sample and all after it,
    /// with the values of before the scan of the fault.
    ChangeTakenBack {
        /// Cycle of the deadline that shows the fault.
        moment: Moment,
        /// Hash of the program that was stopped.
        from: ProgramHash,
        /// Hash of the program before.
        to: ProgramHash,
    },
    /// The configuration that it runs, and the one that it has loaded beside it, after a step of an online change.
    Configured(Configurations),
    /// A deadline: the sample of this cycle, and the outputs that are driven from now on.
    Applied {
        /// Cycle of the deadline.
        moment: Moment,
        /// u(i); `None` where no cycle was started or the history is not known yet.
        sampled: Option<Image>,
        /// y(i): direct, reconstructed, held or fail-safe, before forces.
        outputs: Image,
        /// What the device gets, where that differs from these outputs: a signal is forced, or the program is stopped.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        driven: Option<Image>,
        /// Source of the outputs.
        source: Source,
        /// Understudy whose word the output was reconstructed from.
        word_of: Option<StationId>,
        /// Reason why no output was provable, where the outputs are held or fail-safe.
        missing: Option<Missing>,
        /// The version of the program whose points these inputs and outputs have, while a change of points is loaded.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        points: Option<ProgramHash>,
        /// Stations whose turns of this cycle were received here; the last key, which a reader of lines finds.
        heard: StationSet,
    },
    /// The program starts from its initial state.
    StartedCold {
        /// Genesis lineage.
        born: Moment,
        /// Whether the operator has to release the outputs.
        awaits_release: bool,
        /// The newest applied output, where the state that it came from is lost with all stations that held it; nothing at a first start, and
        /// where the operator has chosen the initial state.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        lost: Option<Moment>,
    },
    /// The program starts after a power failure, from its initial state with the retentive values that a station has kept.
    StartedWarm {
        /// Current cycle.
        born: Moment,
        /// The station.
        from: StationId,
        /// Cycle of the state whose values were kept.
        retained: Moment,
        /// Cycles with applied outputs after that state: their changes of retentive values are lost. Not known without a note of
        /// the newest applied output.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        lost: Option<u64>,
        /// What the retained operator inputs have now, where that is not what they had in that state.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        inputs: Option<OldInputs>,
        /// Whether the operator has to release the outputs.
        awaits_release: bool,
    },
    /// After a restart, or when no living station is on this remote I/O's history: it continues from a lineage that a
    /// station holds.
    AdoptedLineage {
        /// Current cycle.
        moment: Moment,
        /// The lineage.
        lineage: Lineage,
        /// Station that holds it.
        from: StationId,
    },
    /// After a restart: living stations hold different states of one cycle. The operator chooses; a release of the
    /// outputs chooses the first of them.
    Disputed {
        /// Current cycle.
        moment: Moment,
        /// Stations that hold them.
        stations: StationSet,
    },
    /// No station holds a state, and members of this cluster are received that have another configuration: this remote I/O may be the one with
    /// the wrong program, so it starts nothing cold. The operator chooses, unless the others get its configuration, or more stations than others
    /// have it.
    ConfigurationDisputed {
        /// Current cycle.
        moment: Moment,
        /// Living stations with the configuration of this remote I/O.
        stations: u32,
        /// Members that are received with another one.
        others: u32,
    },
    /// No living station can prove the state that the newest applied output came from: the outputs are held, then
    /// fail-safe.
    StateLost {
        /// Current cycle.
        moment: Moment,
        /// The cycle of the newest sample whose outputs were applied; not known after a restart.
        applied: Option<Moment>,
        /// Cycle of the newest state that a living station holds, or has kept over a power failure.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        newest: Option<Moment>,
        /// The station that has it.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        holder: Option<StationId>,
        /// Whether the operator is asked; the program starts cold otherwise.
        asks: bool,
        /// Why the program does not go on from the newest state by itself.
        #[serde(default, skip_serializing_if = "AskReason::is_doubt")]
        reason: AskReason,
        /// What the retained operator inputs have after the start from the newest state, where that is not what they had in it.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        inputs: Option<OldInputs>,
    },
    /// The state that was lost or disputed can be proved again: the program continues, and nothing is asked any more.
    StateRecovered {
        /// Current cycle.
        moment: Moment,
        /// The station that has returned with it; none where the other remote I/O of the program has it, or stations have come that decide it.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        from: Option<StationId>,
    },
    /// The operator chose a state that is not the newest available one, or where no choice was asked for; or released what waits for a choice.
    ChoiceRefused {
        /// Current cycle.
        moment: Moment,
        /// Why.
        refusal: OrderRefusal,
    },
    /// The failure of one station would be masked from now on.
    Protected {
        /// First cycle with it.
        moment: Moment,
    },
    /// The failure of one station would not be masked any more.
    Unprotected {
        /// Current cycle.
        moment: Moment,
        /// The first cycle of those in a row in which it would not have been masked.
        since: Moment,
        /// The stations that could not prove the program's output, and why.
        lacking: SmallVec<[Lacking; 2]>,
    },
    /// Samples that no station received are void: the program continues from an older state that a station still has.
    Voided {
        /// Current cycle.
        moment: Moment,
        /// Number of void samples.
        samples: usize,
        /// Lineage from which it continues.
        lineage: Lineage,
    },
    /// The operator has released the outputs, and the stations that were excluded or accused.
    Released {
        /// Current cycle.
        moment: Moment,
    },
    /// The operator has forced a signal: an input is sampled with the value, an output is driven with it, whatever is
    /// applied.
    Forced {
        /// First cycle with it.
        moment: Moment,
        /// Signal, value, duration, operator and reason.
        force: Force,
    },
    /// A force was refused and has no effect.
    ForceRefused {
        /// Current cycle.
        moment: Moment,
        /// The force.
        force: Force,
        /// Reason.
        refusal: OrderRefusal,
    },
    /// The end of a force was refused: the signal is not forced.
    UnforceRefused {
        /// Current cycle.
        moment: Moment,
        /// The signal.
        signal: SignalPlace,
        /// Reason.
        refusal: OrderRefusal,
    },
    /// A force has ended.
    Unforced {
        /// First cycle with it.
        moment: Moment,
        /// Signal that was forced.
        signal: SignalPlace,
        /// What has ended it.
        #[serde(alias = "expired", deserialize_with = "reason::read_force_end")]
        by: ForceEnd,
    },
    /// An operator has written a value, which becomes part of the next sample.
    Written {
        /// Current cycle.
        moment: Moment,
        /// Identifier, input, value, operator and reason.
        write: Write,
    },
    /// A written value is in effect: outputs of a sample with it were applied.
    WriteInEffect {
        /// Cycle of these outputs.
        moment: Moment,
        /// Identifier of the write.
        id: WriteId,
        /// Cycle of the first sample with the value.
        since: Moment,
    },
    /// A write was refused and has no effect.
    WriteRefused {
        /// Current cycle.
        moment: Moment,
        /// The write.
        write: Write,
        /// Reason.
        refusal: WriteRefusal,
    },
    /// A write that was taken has no effect: all samples with its value became void, and it is over, or the input was forced.
    WriteVoid {
        /// Current cycle.
        moment: Moment,
        /// Identifier of the write.
        id: WriteId,
        /// Reason.
        #[serde(default = "before_reasons")]
        refusal: WriteRefusal,
    },
    /// The value of a signal of another program has become valid, or too old.
    SignalValidity {
        /// Current cycle.
        moment: Moment,
        /// Input, by its first bit in u(i), counted from 0.
        input: u16,
        /// Whether it is valid; otherwise the default value is sampled.
        valid: bool,
    },
    /// After a restart: stations recall the ones that this remote I/O had excluded.
    RecalledExclusion {
        /// Current cycle.
        moment: Moment,
        /// Stations that stay excluded until the operator releases them.
        stations: StationSet,
    },
    /// The diagnosis finds other failed channels than before.
    Diagnosed {
        /// First cycle with it.
        moment: Moment,
        /// Statuses of the channels, as bits of u(i).
        failed: Image,
    },
    /// A station was not received for `flag_after` cycles: θ = 1.
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
    /// All outputs of a word were received and their sum is not 0: a value fault, (10) does not hold.
    Syndrome {
        /// Current cycle.
        moment: Moment,
        /// Syndrome.
        syndrome: Image,
        /// Stations of which one is wrong.
        accused: StationSet,
    },
    /// Stations publish different outputs, or have different states, of one history of this program. Reported when it
    /// begins.
    ValueFault {
        /// Current cycle.
        moment: Moment,
        /// Stations that may be wrong: the minority where the fault is located.
        accused: StationSet,
        /// Whether a majority locates the fault; then its outputs are applied, and the others are excluded.
        located: bool,
        /// Reaction where it is not located.
        answer: ValueFault,
    },
    /// Equal lineages and unequal digests of a program's state: a value fault in one of two stations.
    DigestDiffers {
        /// Current cycle.
        moment: Moment,
        /// Program of the state.
        program: ProgramId,
        /// Stations of which one is wrong.
        accused: StationSet,
    },
    /// A member of this cluster runs another configuration; its frames are dropped.
    Refused {
        /// Member whose frames are dropped.
        member: Member,
        /// Its configuration.
        theirs: ConfigurationHash,
        /// The configuration of this remote I/O.
        ours: ConfigurationHash,
    },
    /// A member whose frames were dropped is no longer received with another configuration.
    RefusalEnded {
        /// Member that was refused.
        member: Member,
    },
    /// This remote I/O does not take part yet, and more stations have one other configuration than have its own: its process ends.
    Outvoted {
        /// The other configuration.
        theirs: ConfigurationHash,
        /// Stations with its own configuration.
        stations: u32,
        /// Stations with the other one.
        others: u32,
    },
    /// The host woke this remote I/O too late to keep its times.
    Stalled {
        /// Current cycle.
        moment: Moment,
        /// Delay behind the time that it had asked for.
        late: Duration,
    },
    /// This one of two remote I/Os of the program has another part from now on.
    PartChanged {
        /// Current cycle.
        moment: Moment,
        /// Its part.
        part: Part,
    },
    /// The other remote I/O of the program could not take over any more.
    PartnerLost {
        /// Current cycle.
        moment: Moment,
        /// Why it could not.
        #[serde(default)]
        lack: PartnerLack,
    },
    /// The other remote I/O of the program is received again.
    PartnerReceived {
        /// Current cycle.
        moment: Moment,
    },
    /// The modules of the two remote I/Os show different values of an input for too long: the value on which they agreed last is sampled.
    InputsDiffer {
        /// Current cycle.
        moment: Moment,
        /// Input, by its first bit in u(i), counted from 0.
        input: u16,
    },
    /// A module of an input does not count until the operator releases it: the other one has moved while the two differed.
    InputExcluded {
        /// Current cycle.
        moment: Moment,
        /// Input, by its first bit in u(i), counted from 0.
        input: u16,
        /// The remote I/O whose module it is.
        at: Member,
    },
    /// The modules of an input agree again, or the operator has released the one that was excluded.
    InputsAgree {
        /// Current cycle.
        moment: Moment,
        /// Input, by its first bit in u(i), counted from 0.
        input: u16,
    },
    /// The other remote I/O of the program reports that it is the author, as this one was until now.
    SecondAuthor {
        /// Current cycle.
        moment: Moment,
    },
}

/// The only reason of a `write-void` of journals that do not state it.
fn before_reasons() -> WriteRefusal {
    WriteRefusal::Void
}

impl Event {
    /// The outputs that the device gets from a deadline on: those of the program, or held or fail-safe ones, and in their place the forced values.
    /// Everything that states a driven value reads it here.
    pub fn driven(&self) -> Option<&Image> {
        match self {
            Self::Applied { outputs, driven, .. } => Some(driven.as_ref().unwrap_or(outputs)),
            _ => None,
        }
    }
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
