//! The operator's choice where the state of a program is lost: the state from which it continues.

use serde::{Deserialize, Serialize};

use crate::identifier::Cycle;

/// State from which a program continues when no living station can prove the true one.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum StateChoice {
    /// From its initial state.
    Cold,
    /// From the newest state that a living station holds, although outputs of later samples were applied.
    Newest {
        /// Cycle of that state as the operator has seen it; another one is refused. Any cycle is accepted where this is
        /// absent.
        cycle: Option<Cycle>,
    },
}
