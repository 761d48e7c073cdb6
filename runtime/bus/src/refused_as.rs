//! Why a datagram does not count, as the journal says it.

use serde::{Deserialize, Serialize};

/// Why a datagram does not count.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum RefusedAs {
    /// Nothing that could be a frame.
    NoFrame,
    /// A frame without an authenticator.
    Unsealed,
    /// In the name of somebody who has nothing to say here.
    Foreign,
    /// The authenticator is not the sender's: made by somebody else, or changed on its way.
    Forged,
    /// It counted before, or is too late.
    Replayed,
    /// New, and of a life before the newest: two processes have the sender's keys.
    OfAnotherLife,
    /// The sender's keys are revoked.
    Revoked,
}
