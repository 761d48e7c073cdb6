//! Why outputs are not proved, and why a program waits.

use serde::{Deserialize, Deserializer, Serialize};
use understudy_wire::{Moment, StationId};

/// A station that cannot prove the output of a program, from the view of its remote I/O.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct Lacking {
    /// The station.
    pub station: StationId,
    /// Reason.
    #[serde(flatten)]
    pub reason: LackingReason,
}

/// Why a program does not go on from the newest state by itself.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum AskReason {
    /// A newer state was applied, or may have been, or no station has a state.
    #[default]
    Doubt,
    /// Values that were kept over a power failure are not in it, or it was kept under other names or keys.
    NotWhole,
    /// A station that could have a newer one is not received, and may follow the other remote I/O, which is not received either.
    Unreceived,
    /// It is as new as the newest applied output, and the operator chooses each start: `restart = "operator"`.
    Configured,
}

impl AskReason {
    pub(super) fn is_doubt(&self) -> bool {
        *self == Self::Doubt
    }
}

/// Why the other one of two remote I/Os could not take over from the author.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum PartnerLack {
    /// The author does not receive it.
    #[default]
    Silent,
    /// Its modules do not follow those of the author.
    Modules,
    /// It receives no station that has the program, and the author does.
    Stations,
}

/// What has ended a force.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ForceEnd {
    /// Its time.
    Time,
    /// The operator has ended it, or has forced another signal that has a bit of this one.
    Operator,
    /// An online change has replaced the points that its signal was one of.
    OnlineChange,
    /// The other remote I/O of the program drives.
    Handover,
}

/// Journals before had `expired` in its place: whether it was its time, or else the operator.
pub(super) fn read_force_end<'de, D: Deserializer<'de>>(from: D) -> Result<ForceEnd, D::Error> {
    #[derive(Deserialize)]
    #[serde(untagged)]
    enum Read {
        Expired(bool),
        By(ForceEnd),
    }
    Ok(match Read::deserialize(from)? {
        Read::Expired(true) => ForceEnd::Time,
        Read::Expired(false) => ForceEnd::Operator,
        Read::By(by) => by,
    })
}

/// What retained operator inputs have after a start from a state of which there is no note.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum OldInputs {
    /// Their initial values: there is no note that can be used.
    Initial,
    /// The values of the newest note, which is older.
    Of(Moment),
}

/// Reason why a station cannot prove the output of a program.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(tag = "reason", rename_all = "kebab-case")]
pub enum LackingReason {
    /// Its turn was not received: it is down, or the link from it to this remote I/O is.
    NotReceived,
    /// It asks for a state.
    Joining,
    /// Its state is behind: it has not received the newest samples.
    Behind {
        /// Cycle of its newest sample.
        stepped: Moment,
    },
    /// It was found faulty, and waits for the operator.
    Excluded,
    /// In the paper's mode: it has failed, and so no further failure is masked.
    Failed,
}

/// Reason why no output was provable.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Missing {
    /// No cycle was started in time.
    NoCycle,
    /// The host woke this remote I/O more than a period after the deadline.
    TooLate,
    /// The sensors are not known: their device is lost, or refuses.
    BadQuality,
    /// This remote I/O does not know its program's history yet.
    NoHistory,
    /// No living station can prove the program's state.
    StateLost,
    /// The operator has not released the outputs after a cold start, or after a value fault.
    NotReleased,
    /// Stations disagree, and no majority exists.
    ValueFault,
    /// A program fault has stopped the program, in all stations at once.
    ProgramFault,
    /// Neither the controller nor a word of an understudy was received with the true lineage.
    NotSynchronised,
    /// A word was received, and another member of it was not.
    TwoErasures,
    /// The paper's S2: two stations have failed.
    SecondFailure,
}
