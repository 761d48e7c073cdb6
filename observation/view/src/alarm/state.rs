//! State of an alarm.

use schemars::JsonSchema;
use serde::Serialize;

/// State of an alarm, in the sense of ISA-18.2.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum AlarmState {
    /// Not active, and acknowledged.
    Normal,
    /// Active and not acknowledged.
    Unacknowledged,
    /// Active and acknowledged.
    Acknowledged,
    /// Over and not acknowledged.
    Returned,
    /// Shelved by an operator until a cycle.
    Shelved,
    /// The value of its signal is unknown, or it was not long enough known.
    Unknown,
}

impl AlarmState {
    /// All states.
    pub const ALL: [Self; 6] = [
        Self::Normal,
        Self::Unacknowledged,
        Self::Acknowledged,
        Self::Returned,
        Self::Shelved,
        Self::Unknown,
    ];

    /// The state as JSON and the page write it.
    pub fn word(self) -> &'static str {
        match self {
            Self::Normal => "normal",
            Self::Unacknowledged => "unacknowledged",
            Self::Acknowledged => "acknowledged",
            Self::Returned => "returned",
            Self::Shelved => "shelved",
            Self::Unknown => "unknown",
        }
    }
}
