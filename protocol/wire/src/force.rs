//! What an operator puts in the place of one signal of a program, for a while.
//!
//! An input is forced before it is sampled: the sample, its lineage and everything that follows from them are those of the forced
//! value, so that all copies of the program agree about it. An output is forced behind the selection, where it is driven: what
//! is judged as true stays as it is. Invariant: every force ends by itself, and is gone when its remote I/O starts again.

use serde::{Deserialize, Serialize};

/// The longest time for which a signal can be forced at once.
pub const MAXIMUM_FORCE_SECONDS: u32 = 3600;

/// Characters of the name of who forces, at most.
pub const MAXIMUM_OWNER_LENGTH: usize = 40;

/// Characters of the reason, at most.
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

/// A value in the place of a signal's own.
#[derive(Debug, Clone, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct Force {
    /// Which signal.
    pub signal: SignalPlace,
    /// What it is from now on.
    pub value: bool,
    /// For so long, 1 to [`MAXIMUM_FORCE_SECONDS`].
    pub seconds: u32,
    /// Who wants it.
    pub owner: String,
    /// Why.
    pub reason: String,
}

/// Why a force is none.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum ForceError {
    /// It would last for no time, or for too long.
    #[error("a force lasts 1 to {MAXIMUM_FORCE_SECONDS} seconds, not {0}")]
    Seconds(u32),
    /// Nobody, or a name that is too long or not readable.
    #[error("who forces is 1 to {MAXIMUM_OWNER_LENGTH} readable characters")]
    Owner,
    /// No reason, or one that is too long or not readable.
    #[error("the reason is 1 to {MAXIMUM_REASON_LENGTH} readable characters")]
    Reason,
}

impl Force {
    /// Whether it says for how long, who and why.
    ///
    /// # Errors
    /// The first of them that it does not.
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
