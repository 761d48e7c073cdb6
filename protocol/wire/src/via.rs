//! The networks that frames travel over.

use std::fmt;

use serde::{Deserialize, Serialize};

/// Which of a cluster's networks.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(into = "u8", try_from = "u8")]
pub enum Via {
    /// The one that every cluster has.
    First,
    /// The second one of a cluster with two.
    Second,
}

/// A number that no network has.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("there is no network {0}: there are 1 and 2")]
pub struct NoSuchNetwork(u8);

impl Via {
    /// Both, in their order.
    pub const BOTH: [Self; 2] = [Self::First, Self::Second];

    /// 0 or 1.
    pub fn index(self) -> usize {
        match self {
            Self::First => 0,
            Self::Second => 1,
        }
    }

    /// The other one.
    #[must_use]
    pub fn other(self) -> Self {
        match self {
            Self::First => Self::Second,
            Self::Second => Self::First,
        }
    }
}

impl From<Via> for u8 {
    fn from(via: Via) -> Self {
        match via {
            Via::First => 1,
            Via::Second => 2,
        }
    }
}

impl TryFrom<u8> for Via {
    type Error = NoSuchNetwork;

    fn try_from(number: u8) -> Result<Self, NoSuchNetwork> {
        let found = Self::BOTH.into_iter().find(|via| u8::from(*via) == number);
        found.ok_or(NoSuchNetwork(number))
    }
}

/// 1 or 2.
impl fmt::Display for Via {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        u8::from(*self).fmt(formatter)
    }
}
