//! What must never happen.

use serde::{Deserialize, Serialize};
use understudy_wire::{Image, Lineage, Moment, Source, StationId};

/// Something that must never happen.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, thiserror::Error)]
#[serde(tag = "violation", rename_all = "kebab-case")]
pub enum Violation {
    /// An output was driven as true and is not.
    #[error("{source_:?} output {driven} in cycle {moment}, where the reference run has {}", text(.truth))]
    Wrong {
        /// The cycle in which it happened.
        moment: Moment,
        /// As what it was driven.
        #[serde(rename = "source")]
        source_: Source,
        /// What was driven.
        driven: Image,
        /// What was true, where that is known.
        truth: Option<Image>,
    },
    /// An output was held that was not the last true one, or for longer than configured.
    #[error("held output {driven} in cycle {moment}, for {cycles} cycles, where the last true one was {}", text(.last_true))]
    WronglyHeld {
        /// The cycle in which it happened.
        moment: Moment,
        /// What was driven.
        driven: Image,
        /// Cycles held in a row.
        cycles: u32,
        /// The last output that was true.
        last_true: Option<Image>,
    },
    /// Something else than the configured values was driven as fail-safe.
    #[error("fail-safe output {driven} in cycle {moment}, where {configured} is configured")]
    NotTheFailSafe {
        /// The cycle in which it happened.
        moment: Moment,
        /// What was driven.
        driven: Image,
        /// What is configured.
        configured: Image,
    },
    /// The program goes on from a state before the newest sample whose outputs were applied.
    #[error(
        "in cycle {moment} the program continued from its state of cycle {from}, although outputs of cycle {applied} were applied"
    )]
    WentBack {
        /// The cycle in which it happened.
        moment: Moment,
        /// The cycle of the newest sample in the state that it continued from.
        from: Moment,
        /// The cycle of the newest sample whose outputs were applied.
        applied: Moment,
    },
    /// The program started from its initial state although a living station had a state to continue from.
    #[error("in cycle {moment} the program started cold although station {} had its state", station.0)]
    NeedlessColdStart {
        /// The cycle in which it happened.
        moment: Moment,
        /// The station.
        station: StationId,
    },
    /// The operator was asked for the state of a program although a living station holds it, and no station that could hold a newer one has lost
    /// its memory.
    #[error("in cycle {moment} the operator was asked although station {} had the state", station.0)]
    NeedlessQuestion {
        /// The cycle in which it happened.
        moment: Moment,
        /// The station.
        station: StationId,
    },
    /// Both remote I/Os of a program drove its outputs within one cycle.
    #[error("in cycle {moment} both remote I/Os of the program drove its outputs")]
    TwoWriters {
        /// The cycle in which it happened.
        moment: Moment,
    },
    /// The modules of a remote I/O that is not the author drive outputs that no author has driven lately.
    #[error(
        "in cycle {moment} modules next to those of the author drive {driven}, which no author has driven lately"
    )]
    NotFollowed {
        /// The cycle in which it happened.
        moment: Moment,
        /// What they drive.
        driven: Image,
    },
    /// What the modules of both remote I/Os drive of a number adds up to more than an author has decided.
    #[error(
        "in cycle {moment} the modules of both remote I/Os drive more of a number than its value"
    )]
    TooMuch {
        /// The cycle in which it happened.
        moment: Moment,
    },
    /// The two modules of an input have shown different values for long, and no remote I/O has reported it, or the report has ended meanwhile.
    #[error(
        "in cycle {moment} the modules of the input at bit {input} show different values for too long, and it is not reported"
    )]
    InputsNotReported {
        /// The cycle in which it happened.
        moment: Moment,
        /// First bit in u(i), counted from 0.
        input: u16,
    },
    /// A signal of another program was sampled with a value that the other program did not compute.
    #[error(
        "in cycle {moment} the signal at input bit {input} was sampled as {value:#x}, which the other program did not compute"
    )]
    WrongSignal {
        /// The cycle in which it happened.
        moment: Moment,
        /// First bit in u(i), counted from 0.
        input: u16,
        /// The stored value.
        value: u64,
    },
    /// The program goes on from a state that none of its samples led to.
    #[error(
        "in cycle {moment} the program continued from lineage {lineage}, which none of its samples led to"
    )]
    UnknownHistory {
        /// The cycle in which it happened.
        moment: Moment,
        /// The lineage.
        lineage: Lineage,
    },
}

fn text(image: &Option<Image>) -> String {
    image.as_ref().map_or_else(|| "none".to_owned(), Image::to_string)
}
