//! Values that an operator puts in the place of a signal of a program, for a limited time.
//!
//! An input is forced before it is sampled: the sample, its lineage and everything that follows from them are those of
//! the forced value, so that all replicas of the program agree about it. An output is forced after the selection, where
//! it is driven: the recorded proven output stays as it is. Invariant: every force ends by itself, and is gone when its
//! remote I/O starts again.

use serde::{Deserialize, Serialize};

use crate::identifier::{ConfigurationHash, Moment, PointsHash};
use crate::set::StationSet;

/// Maximum duration of one force, in seconds.
pub const MAXIMUM_FORCE_SECONDS: u32 = 3600;

/// Maximum number of characters of the operator's name.
pub const MAXIMUM_OWNER_LENGTH: usize = 40;

/// Maximum number of characters of the reason.
pub const MAXIMUM_REASON_LENGTH: usize = 120;

/// A signal of the program of a remote I/O, by its first bit in the process image, counted from 0.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum SignalPlace {
    /// In u(i).
    Input(u16),
    /// In y(i).
    Output(u16),
}

/// Value of a point, as it is forced or written.
///
/// As JSON `true` or `false` for a BOOL, and `{"width":32,"stored":1095237632}` for a number.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(untagged)]
pub enum PointValue {
    /// Of a BOOL.
    Bit(bool),
    /// Of a number: all its bits at once.
    Number {
        /// Width of the number in bits: 8, 16, 32 or 64.
        width: u8,
        /// Its bits, as the process image stores them; those above the width are 0.
        stored: u64,
    },
}

impl From<bool> for PointValue {
    fn from(bit: bool) -> Self {
        Self::Bit(bit)
    }
}

impl PointValue {
    /// A value of `width` bits, 1 for a BOOL.
    pub fn new(width: u32, stored: u64) -> Self {
        match width {
            1 => Self::Bit(stored & 1 == 1),
            _ => Self::Number { width: u8::try_from(width).unwrap_or(u8::MAX), stored },
        }
    }

    /// Its bits, the lowest first.
    pub fn bits(self) -> impl Iterator<Item = bool> {
        let (width, stored) = (self.width(), self.stored());
        (0..width.min(64)).map(move |bit| stored >> bit & 1 == 1)
    }

    /// Width in bits.
    pub fn width(self) -> u16 {
        match self {
            Self::Bit(_) => 1,
            Self::Number { width, .. } => width.into(),
        }
    }

    /// Its bits, as the process image stores them.
    pub fn stored(self) -> u64 {
        match self {
            Self::Bit(bit) => bit.into(),
            Self::Number { stored, .. } => stored,
        }
    }

    /// Whether it has one of the widths, and no bit above it.
    fn is_valid(self) -> bool {
        match self {
            Self::Bit(_) => true,
            Self::Number { width, stored } => {
                matches!(width, 8 | 16 | 32 | 64) && (width == 64 || stored >> width == 0)
            }
        }
    }
}

impl SignalPlace {
    /// The first bit in u(i) or y(i).
    pub fn first_bit(self) -> u16 {
        let (Self::Input(bit) | Self::Output(bit)) = self;
        bit
    }
}

/// Value in the place of a signal's own.
#[derive(Debug, Clone, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct Force {
    /// Signal that is forced.
    pub signal: SignalPlace,
    /// Forced value.
    pub value: PointValue,
    /// Duration in seconds, 1 to [`MAXIMUM_FORCE_SECONDS`].
    pub seconds: u32,
    /// Operator who forces it.
    pub owner: String,
    /// Reason.
    pub reason: String,
    /// Points by which the signal was found; nothing where the caller does not know them.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub points: Option<PointsHash>,
}

/// The end of a force.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct Unforce {
    /// Signal that has its own value again.
    pub signal: SignalPlace,
    /// As [`Force::points`].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub points: Option<PointsHash>,
}

/// Why a signal is not taken for the one that the caller has named, where an online change has replaced inputs or outputs.
pub(crate) const OTHER_POINTS: &str = "the signal was found by other inputs and outputs than those of the program that runs, which an online change has replaced or may replace: \
     use the cluster file with which the program runs, and repeat the order";

/// Reason why a force is refused.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum ForceError {
    /// Its duration is zero or too long.
    #[error("a force lasts 1 to {MAXIMUM_FORCE_SECONDS} seconds, not {0}")]
    Seconds(u32),
    /// Its value has a width that no number has, or more bits than its width, or crosses the bits of two numbers.
    #[error("a forced number has 8, 16, 32 or 64 bits, at a multiple of its width")]
    Value,
    /// Its operator is missing, too long or not readable.
    #[error("the operator's name has 1 to {MAXIMUM_OWNER_LENGTH} readable characters")]
    Owner,
    /// Its reason is missing, too long or not readable.
    #[error("the reason has 1 to {MAXIMUM_REASON_LENGTH} readable characters")]
    Reason,
}

/// Reason why a remote I/O refuses an order of an operator.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize, thiserror::Error)]
#[serde(tag = "reason", rename_all = "kebab-case")]
pub enum OrderRefusal {
    /// No signal of the program begins at this bit.
    #[error("no signal of the program begins at this bit; a number is forced as a whole")]
    NoSignal,
    /// The value has another width than the signal, or is not a finite number.
    #[error("the value does not suit the signal: {width} bits are needed{}", if *.real { ", and a finite number" } else { "" })]
    Value {
        /// Width of the signal in bits.
        width: u16,
        /// Whether the signal is a REAL or an LREAL.
        real: bool,
    },
    /// The force lacks its duration, its operator or its reason.
    #[error(
        "the force needs a duration of 1 to {MAXIMUM_FORCE_SECONDS} seconds, an operator and a reason"
    )]
    Incomplete,
    /// The signal is not forced.
    #[error("the signal is not forced")]
    NotForced,
    /// The signal was found by other points than those that count.
    #[error("{OTHER_POINTS}")]
    OtherPoints,
    /// The other remote I/O of the program is the author.
    #[error("this remote I/O follows the other one of its program: give the order to that one")]
    NotAuthor,
    /// The program continues, and no choice of a state is asked for.
    #[error("no choice of a state is asked for: the state of the program is not lost")]
    NoChoice,
    /// A release where the state of the program is lost: the outputs wait for a choice.
    #[error(
        "the program waits for the choice of a state, and a release chooses none: accept the newest available state, or start the program cold"
    )]
    WaitsForChoice,
    /// A choice of the newest state where no station has one.
    #[error(
        "no station has a state of the program: wait for one that has, or start the program cold"
    )]
    NoState,
    /// The chosen state is not available, or is not the newest.
    #[error("the newest available state is of cycle {} of the cluster", .newest.cycle.0)]
    OtherState {
        /// Cycle of the newest available state.
        newest: Moment,
    },
    /// Another online change is prepared.
    #[error("another online change is prepared: accept it or cancel it first")]
    AnotherChange,
    /// The order is for another configuration than that of the member.
    #[error("this member runs configuration {own}, which is not the one of the order")]
    OtherConfiguration {
        /// Configuration of the member.
        own: ConfigurationHash,
    },
    /// The member has not loaded the change.
    #[error("this member has not loaded the change: prepare it first")]
    NotPrepared,
    /// The remote I/O runs the new program, and the change is over.
    #[error(
        "the new program runs already, and the change to it is over: to go back, change from the new cluster file to the old one"
    )]
    IsOver,
    /// Stations that compute the program and are received have not loaded the change: they would be silent after the switch.
    #[error("stations that compute the program have not loaded the change: {}", stations_text(*.stations))]
    StationsNotPrepared {
        /// These stations.
        stations: StationSet,
    },
    /// The program does not run, so there is no state to go on from.
    #[error("the program does not run yet: no history of it is known")]
    NotRunning,
    /// The program, or a member that is received, still is that of the other configuration.
    #[error(
        "the other configuration is still needed: by a program that was not switched or is on trial, or by a member that is received and has not accepted"
    )]
    StillNeeded,
    /// A program fault has taken the change back.
    #[error(
        "a program fault has taken the change back, and the program of before runs: end the change with `cancel`, or switch again"
    )]
    TakenBack,
}

fn stations_text(stations: StationSet) -> String {
    let ranks: Vec<_> = stations.iter().map(|station| station.0.to_string()).collect();
    format!("those of rank {}", ranks.join(", "))
}

impl OrderRefusal {
    /// Its code in the documentation of errors.
    pub fn code(self) -> &'static str {
        match self {
            Self::NoSignal | Self::Value { .. } | Self::Incomplete | Self::NotForced => "U0556",
            Self::NotAuthor => "U0556",
            Self::OtherPoints => "U0638",
            Self::NoChoice | Self::WaitsForChoice | Self::NoState | Self::OtherState { .. } => {
                "U0583"
            }
            Self::AnotherChange
            | Self::OtherConfiguration { .. }
            | Self::NotPrepared
            | Self::IsOver
            | Self::TakenBack
            | Self::NotRunning => "U0632",
            Self::StillNeeded => "U0634",
            Self::StationsNotPrepared { .. } => "U0636",
        }
    }
}

impl Force {
    /// Whether both are forces of one bit.
    pub fn overlaps(&self, other: &Self) -> bool {
        let same_side =
            std::mem::discriminant(&self.signal) == std::mem::discriminant(&other.signal);
        let bits = |force: &Self| {
            let first = u32::from(force.signal.first_bit());
            first..first + u32::from(force.value.width())
        };
        let (own, others) = (bits(self), bits(other));
        same_side && own.start < others.end && others.start < own.end
    }

    /// Checks duration, value, operator and reason.
    ///
    /// # Errors
    /// The first of them that is invalid.
    pub fn check(&self) -> Result<(), ForceError> {
        if !(1..=MAXIMUM_FORCE_SECONDS).contains(&self.seconds) {
            return Err(ForceError::Seconds(self.seconds));
        }
        let is_aligned = || self.signal.first_bit().is_multiple_of(self.value.width());
        if !self.value.is_valid() || !is_aligned() {
            return Err(ForceError::Value);
        }
        check_owner_and_reason(&self.owner, &self.reason)
    }
}

/// Checks who intervenes and why.
///
/// # Errors
/// [`ForceError::Owner`] or [`ForceError::Reason`].
pub fn check_owner_and_reason(owner: &str, reason: &str) -> Result<(), ForceError> {
    let readable = |text: &str, most: usize| {
        let length = text.chars().count();
        (1..=most).contains(&length)
            && !text.trim().is_empty()
            && !text.chars().any(char::is_control)
    };
    if !readable(owner, MAXIMUM_OWNER_LENGTH) {
        return Err(ForceError::Owner);
    }
    if !readable(reason, MAXIMUM_REASON_LENGTH) {
        return Err(ForceError::Reason);
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_force_says_for_how_long_who_and_why() {
        let check = |seconds, owner: &str, reason: &str, expected| {
            let force = Force {
                signal: SignalPlace::Input(0),
                value: true.into(),
                seconds,
                owner: owner.to_owned(),
                reason: reason.to_owned(),
                points: None,
            };
            assert_eq!(force.check(), expected, "{force:?}");
        };
        check(1, "anna", "the sensor is dirty", Ok(()));
        check(MAXIMUM_FORCE_SECONDS, "anna", "why", Ok(()));
        check(0, "anna", "why", Err(ForceError::Seconds(0)));
        check(3601, "anna", "why", Err(ForceError::Seconds(3601)));
        check(1, "", "why", Err(ForceError::Owner));
        check(1, "  ", "why", Err(ForceError::Owner));
        check(1, "a\nb", "why", Err(ForceError::Owner));
        check(1, &"a".repeat(41), "why", Err(ForceError::Owner));
        check(1, "anna", "", Err(ForceError::Reason));
        check(1, "anna", &"ä".repeat(120), Ok(()));
        check(1, "anna", &"ä".repeat(121), Err(ForceError::Reason));
    }

    #[test]
    fn a_number_is_forced_as_a_whole() {
        let check = |place, text: &str, expected| {
            let force = Force {
                signal: SignalPlace::Output(place),
                value: serde_json::from_str(text).expect(text),
                seconds: 1,
                owner: "anna".to_owned(),
                reason: "why".to_owned(),
                points: None,
            };
            assert_eq!(serde_json::to_string(&force.value).expect("JSON"), text);
            assert_eq!(force.check(), expected, "{force:?}");
        };
        check(3, "true", Ok(()));
        check(64, r#"{"width":32,"stored":4294967295}"#, Ok(()));
        check(64, r#"{"width":64,"stored":18446744073709551615}"#, Ok(()));
        check(64, r#"{"width":32,"stored":4294967296}"#, Err(ForceError::Value));
        check(16, r#"{"width":32,"stored":0}"#, Err(ForceError::Value));
        check(0, r#"{"width":1,"stored":0}"#, Err(ForceError::Value));
        check(0, r#"{"width":0,"stored":0}"#, Err(ForceError::Value));
    }

    #[test]
    fn forces_of_one_bit_overlap() {
        let force = |signal, value| Force {
            signal,
            value,
            seconds: 1,
            owner: "anna".to_owned(),
            reason: "why".to_owned(),
            points: None,
        };
        let number = PointValue::Number { width: 32, stored: 0 };
        let wide = force(SignalPlace::Input(32), number);
        for (signal, expected) in [
            (SignalPlace::Input(31), false),
            (SignalPlace::Input(32), true),
            (SignalPlace::Input(63), true),
            (SignalPlace::Input(64), false),
            (SignalPlace::Output(32), false),
        ] {
            let bit = force(signal, true.into());
            assert_eq!((wide.overlaps(&bit), bit.overlaps(&wide)), (expected, expected));
        }
    }
}
