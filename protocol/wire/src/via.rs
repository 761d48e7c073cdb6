//! The paths that frames travel over.

use std::fmt;

use serde::{Deserialize, Serialize};

/// Which path a frame travels over: one of a cluster's networks, or the direct link between the two remote I/Os of a program.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(into = "u8", try_from = "u8")]
pub enum Via {
    /// The network that every cluster has.
    First,
    /// The second network of a cluster with two.
    Second,
    /// A cable between the two remote I/Os of a program, which carries what they send to each other.
    Link,
}

/// A number that no path has.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error(
    "there is no network {0}: there are 1 and 2, and 3 is the direct link between two remote I/Os"
)]
pub struct NoSuchNetwork(u8);

impl Via {
    /// Both networks, in their order.
    pub const NETWORKS: [Self; 2] = [Self::First, Self::Second];

    /// Both networks and the direct link, in the order of [`Self::index`].
    pub const ALL: [Self; 3] = [Self::First, Self::Second, Self::Link];

    /// From 0 to 2.
    pub fn index(self) -> usize {
        match self {
            Self::First => 0,
            Self::Second => 1,
            Self::Link => 2,
        }
    }

    /// The number of a network; nothing for the direct link.
    pub fn network(self) -> Option<u8> {
        Self::NETWORKS.contains(&self).then(|| self.into())
    }

    /// The other one of two networks; nothing for the direct link.
    pub fn other(self) -> Option<Self> {
        match self {
            Self::First => Some(Self::Second),
            Self::Second => Some(Self::First),
            Self::Link => None,
        }
    }

    /// The name under which it is shown.
    pub fn name(self) -> &'static str {
        match self {
            Self::First => "network 1",
            Self::Second => "network 2",
            Self::Link => "direct link",
        }
    }
}

impl From<Via> for u8 {
    fn from(via: Via) -> Self {
        match via {
            Via::First => 1,
            Via::Second => 2,
            Via::Link => 3,
        }
    }
}

impl TryFrom<u8> for Via {
    type Error = NoSuchNetwork;

    fn try_from(number: u8) -> Result<Self, NoSuchNetwork> {
        let found = Self::ALL.into_iter().find(|via| u8::from(*via) == number);
        found.ok_or(NoSuchNetwork(number))
    }
}

/// `network 1`, `network 2` or `the direct link`, as a part of a sentence.
impl fmt::Display for Via {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let article = if *self == Self::Link { "the " } else { "" };
        write!(formatter, "{article}{}", self.name())
    }
}
