//! Values that an operator puts in the place of a signal of a program, for a limited time.
//!
//! An input is forced before it is sampled: the sample, its lineage and everything that follows from them are those of
//! the forced value, so that all replicas of the program agree about it. An output is forced after the selection, where
//! it is driven: the recorded proven output stays as it is. Invariant: every force ends by itself, and is gone when its
//! remote I/O starts again.

use serde::{Deserialize, Serialize};

/// Maximum duration of one force, in seconds.
pub const MAXIMUM_FORCE_SECONDS: u32 = 3600;

/// Maximum number of characters of the operator's name.
pub const MAXIMUM_OWNER_LENGTH: usize = 40;

/// Maximum number of characters of the reason.
pub const MAXIMUM_REASON_LENGTH: usize = 120;

/// A signal of the program of a remote I/O, counted from 0.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum SignalPlace {
    /// An element of u(i).
    Input(u16),
    /// An element of y(i).
    Output(u16),
}

/// Value in the place of a signal's own.
#[derive(Debug, Clone, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct Force {
    /// Signal that is forced.
    pub signal: SignalPlace,
    /// Forced value.
    pub value: bool,
    /// Duration in seconds, 1 to [`MAXIMUM_FORCE_SECONDS`].
    pub seconds: u32,
    /// Operator who forces it.
    pub owner: String,
    /// Reason.
    pub reason: String,
}

/// Reason why a force is refused.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum ForceError {
    /// Its duration is zero or too long.
    #[error("a force lasts 1 to {MAXIMUM_FORCE_SECONDS} seconds, not {0}")]
    Seconds(u32),
    /// Its operator is missing, too long or not readable.
    #[error("who forces is 1 to {MAXIMUM_OWNER_LENGTH} readable characters")]
    Owner,
    /// Its reason is missing, too long or not readable.
    #[error("the reason is 1 to {MAXIMUM_REASON_LENGTH} readable characters")]
    Reason,
}

impl Force {
    /// Checks duration, operator and reason.
    ///
    /// # Errors
    /// The first of them that is invalid.
    pub fn check(&self) -> Result<(), ForceError> {
        let readable = |text: &str, most: usize| {
            let length = text.chars().count();
            (1..=most).contains(&length)
                && !text.trim().is_empty()
                && !text.chars().any(char::is_control)
        };
        if !(1..=MAXIMUM_FORCE_SECONDS).contains(&self.seconds) {
            return Err(ForceError::Seconds(self.seconds));
        }
        if !readable(&self.owner, MAXIMUM_OWNER_LENGTH) {
            return Err(ForceError::Owner);
        }
        if !readable(&self.reason, MAXIMUM_REASON_LENGTH) {
            return Err(ForceError::Reason);
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_force_says_for_how_long_who_and_why() {
        let check = |seconds, owner: &str, reason: &str, expected| {
            let force = Force {
                signal: SignalPlace::Input(0),
                value: true,
                seconds,
                owner: owner.to_owned(),
                reason: reason.to_owned(),
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
}
