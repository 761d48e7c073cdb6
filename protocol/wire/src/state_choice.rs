//! The operator's answer where the state of a program is lost: where it continues.

use serde::{Deserialize, Serialize};

use crate::identifier::Cycle;

/// From which state a program continues whose own state no living station can prove.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum StateChoice {
    /// From its initial state.
    Cold,
    /// From the newest state that a living station holds, although outputs of later samples were applied.
    Newest {
        /// The cycle of that state as the operator has seen it; another one is refused. Whatever it is where this is absent.
        cycle: Option<Cycle>,
    },
}
