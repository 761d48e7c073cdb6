//! Values that an operator writes to inputs of a program.
//!
//! A write goes to the remote I/O of the program, becomes part of its next sample, and so of the lineage: a replica
//! that has missed it cannot publish. Invariant *One effect*: the newest write of each session is in the sample
//! together with its value, so that a remote I/O that restarts knows both or neither, and a repeated write is answered
//! and not taken again.

use serde::{Deserialize, Serialize};

use crate::force::{ForceError, OTHER_POINTS, PointValue, check_owner_and_reason};
use crate::identifier::{Moment, PointsHash};

/// Sessions whose newest write a sample carries: the undecided, and then the newest.
pub const MAXIMUM_SESSIONS: usize = 16;

/// Identifier of a write: the caller's session, and the number of the write in it.
///
/// A caller draws a session at random, counts its writes from 1, and repeats a write under its identifier until it has
/// an answer.
#[derive(
    Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Default, Serialize, Deserialize,
)]
pub struct WriteId {
    /// Session, drawn at random by the caller.
    pub session: u64,
    /// Number of the write in its session, from 1.
    pub number: u32,
}

impl WriteId {
    /// Identifier of the next write of the session; `None` where all numbers are used.
    pub fn next(self) -> Option<Self> {
        let number = self.number.checked_add(1)?;
        Some(Self { number, ..self })
    }
}

/// Pulses that a sample carries. A further one ends early where its remote I/O restarts.
pub const MAXIMUM_PULSES: usize = 16;

/// A pulse that is not over: a remote I/O that restarts continues it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct Pulse {
    /// Operator input, by its bit in u(i), counted from 0.
    pub input: u16,
    /// Samples until it is over: those in which it is TRUE, and the FALSE after them.
    pub left: u32,
}

/// Rights of the person or program that writes, in ascending order.
#[derive(
    Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Default, Serialize, Deserialize,
)]
#[serde(rename_all = "kebab-case")]
pub enum Role {
    /// Reads only.
    #[default]
    Viewer,
    /// Writes operator inputs.
    Operator,
    /// Also forces signals, releases outputs, and writes the inputs of engineers.
    Engineer,
}

impl Role {
    /// The role of that name.
    pub fn of_word(word: &str) -> Option<Self> {
        let all = [Self::Viewer, Self::Operator, Self::Engineer];
        all.into_iter().find(|role| role.word() == word)
    }

    /// Its name in files and messages.
    pub fn word(self) -> &'static str {
        match self {
            Self::Viewer => "viewer",
            Self::Operator => "operator",
            Self::Engineer => "engineer",
        }
    }
}

/// A value for an operator input.
#[derive(Debug, Clone, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct Write {
    /// Identifier.
    pub id: WriteId,
    /// Input, by its first bit in u(i), counted from 0.
    pub input: u16,
    /// Value.
    pub value: PointValue,
    /// Rights of the writer, as the receiver of the request has found them.
    #[serde(default)]
    pub role: Role,
    /// Person or program that writes.
    pub owner: String,
    /// Reason.
    pub reason: String,
    /// Points by which the input was found; nothing where the caller does not know them.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub points: Option<PointsHash>,
}

impl Write {
    /// Checks operator and reason.
    ///
    /// # Errors
    /// The first of them that is invalid.
    pub fn check(&self) -> Result<(), ForceError> {
        check_owner_and_reason(&self.owner, &self.reason)
    }
}

/// Answer to a write.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct WriteAnswer {
    /// The write.
    pub id: WriteId,
    /// Outcome.
    #[serde(flatten)]
    pub outcome: WriteOutcome,
}

/// Outcome of a write.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(tag = "outcome", rename_all = "kebab-case")]
pub enum WriteOutcome {
    /// The program has the value, and outputs computed from it were applied: no failure takes it back.
    InEffect {
        /// Cycle of the first sample with the value.
        since: Moment,
    },
    /// The write has no effect.
    Refused {
        /// Reason.
        refusal: WriteRefusal,
    },
}

/// Reason why a write has no effect.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize, thiserror::Error)]
#[serde(tag = "reason", rename_all = "kebab-case")]
pub enum WriteRefusal {
    /// The program has no operator input there.
    #[error("the input is not declared as an operator input in the cluster file")]
    NotWritable,
    /// The input was found by other points than those that count.
    #[error("{OTHER_POINTS}")]
    OtherPoints,
    /// The value has another type than the input.
    #[error("the value has another type than the input")]
    Type,
    /// The value is outside the limits of the setpoint.
    #[error("the value is outside the limits of the setpoint")]
    Limits,
    /// The role of the writer is lower than the one that the input requires.
    #[error("the input requires the role `{}`", required.word())]
    Role {
        /// Role that the input requires.
        required: Role,
    },
    /// The number does not follow the one before it in its session.
    #[error("the write is replayed or out of order: the next number of its session is {expected}")]
    Order {
        /// The next number of the session; 1 for a session that is not known.
        expected: u32,
    },
    /// The input has a write that is not sampled or a pulse that is not over, or this person has too many sessions.
    #[error(
        "another write of this input is not over, or too many writes of this person are: repeat the write"
    )]
    Busy,
    /// The program does not run: its state is not known yet, is lost, or its sensors are unknown, or a fault has stopped it and the write is a pulse.
    #[error("the program does not run")]
    NotRunning,
    /// The value ended, or another one replaced it, before outputs of a sample with it were applied.
    #[error("no output that was computed with the value was applied while it lasted")]
    Void,
    /// The input is forced: no sample has the value.
    #[error(
        "the input is forced for at most {seconds} s more: end the force or wait, then repeat the write"
    )]
    Forced {
        /// Seconds until the force ends by itself.
        seconds: u32,
    },
}

impl WriteRefusal {
    /// Its code in the documentation of errors.
    pub fn code(self) -> &'static str {
        match self {
            Self::NotWritable => "U0640",
            Self::OtherPoints => "U0638",
            Self::Type => "U0641",
            Self::Limits => "U0642",
            Self::Role { .. } => "U0643",
            Self::Order { .. } => "U0644",
            Self::Busy => "U0645",
            Self::NotRunning => "U0646",
            Self::Void => "U0647",
            Self::Forced { .. } => "U0649",
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_answer_is_flat_json() {
        let id = WriteId { session: 7, number: 1 };
        let check = |outcome, expected: &str| {
            let answer = WriteAnswer { id, outcome };
            let text = serde_json::to_string(&answer).expect("JSON");
            assert_eq!(text, expected);
            let read: WriteAnswer = serde_json::from_str(&text).expect("the same");
            assert_eq!(read, answer);
        };
        let since = Moment::default().plus(3);
        check(
            WriteOutcome::InEffect { since },
            r#"{"id":{"session":7,"number":1},"outcome":"in-effect","since":{"epoch":0,"cycle":3}}"#,
        );
        let required = Role::Engineer;
        let refusal = WriteRefusal::Role { required };
        check(
            WriteOutcome::Refused { refusal },
            r#"{"id":{"session":7,"number":1},"outcome":"refused","refusal":{"reason":"role","required":"engineer"}}"#,
        );
    }
}
