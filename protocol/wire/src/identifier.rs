//! Identifiers of members, programs and moments.

use std::fmt;

use serde::{Deserialize, Serialize};

/// Maximum number of programs in one cluster.
pub const MAXIMUM_PROGRAMS: usize = 64;

/// Maximum number of stations in one cluster: the controllers of all programs and eight understudies.
pub const MAXIMUM_STATIONS: usize = MAXIMUM_PROGRAMS + 8;

/// A program's 0-based index in the cluster; the paper's i is `index + 1`. Controller i, remote I/O i and plant i share
/// it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(transparent)]
pub struct ProgramId(pub u8);

impl ProgramId {
    /// The index, as a `usize`.
    pub fn index(self) -> usize {
        usize::from(self.0)
    }

    /// The station that is its controller: the one of its rank.
    pub fn controller(self) -> StationId {
        StationId(self.0)
    }
}

/// A station's 0-based rank: controllers 0..N in the order of their programs, then the understudies N..N+S.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(transparent)]
pub struct StationId(pub u8);

impl StationId {
    /// The rank, as a `usize`.
    pub fn index(self) -> usize {
        usize::from(self.0)
    }

    /// The program that it controls, where it is a controller.
    pub fn controlled(self) -> ProgramId {
        ProgramId(self.0)
    }
}

/// Sender of a frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Member {
    /// A controller or an understudy, by rank.
    Station(StationId),
    /// The remote I/O of a program.
    RemoteIo(ProgramId),
    /// The simulated plant behind the remote I/O of a program.
    Plant(ProgramId),
    /// The second remote I/O of a program.
    Twin(ProgramId),
}

impl Member {
    /// The program whose plant it samples and drives: that of a remote I/O or of a twin.
    pub fn sampled_program(self) -> Option<ProgramId> {
        match self {
            Self::RemoteIo(program) | Self::Twin(program) => Some(program),
            Self::Station(_) | Self::Plant(_) => None,
        }
    }

    /// The other remote I/O of its program, of a remote I/O or of a twin.
    pub fn partner(self) -> Option<Self> {
        match self {
            Self::RemoteIo(program) => Some(Self::Twin(program)),
            Self::Twin(program) => Some(Self::RemoteIo(program)),
            Self::Station(_) | Self::Plant(_) => None,
        }
    }
}

/// One life of the cluster from a common start; raised by a cold start.
#[derive(
    Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default, Serialize, Deserialize,
)]
#[serde(transparent)]
pub struct Epoch(pub u64);

/// One sample, one turn of every station, one actuation; numbered, never repeated within an epoch.
#[derive(
    Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default, Serialize, Deserialize,
)]
#[serde(transparent)]
pub struct Cycle(pub u64);

/// A cycle of an epoch. Moments of a later epoch are later, whatever their cycles.
#[derive(
    Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default, Serialize, Deserialize,
)]
pub struct Moment {
    /// Epoch.
    pub epoch: Epoch,
    /// Cycle of the epoch.
    pub cycle: Cycle,
}

impl Moment {
    /// The last moment: no moment follows it.
    pub const LAST: Self = Self { epoch: Epoch(u64::MAX), cycle: Cycle(u64::MAX) };

    /// The moment `cycles` later: the next epoch follows the last cycle that can be numbered, and [`Moment::LAST`] follows itself.
    #[must_use]
    pub fn plus(self, cycles: u64) -> Self {
        let left = u64::MAX - self.cycle.0;
        match cycles.checked_sub(left) {
            None | Some(0) => Self { epoch: self.epoch, cycle: Cycle(self.cycle.0 + cycles) },
            Some(over) => match self.epoch.0.checked_add(1) {
                Some(epoch) => Self { epoch: Epoch(epoch), cycle: Cycle(over - 1) },
                None => Self::LAST,
            },
        }
    }

    /// The first moment of the next epoch, [`Moment::LAST`] if there is no other epoch.
    #[must_use]
    pub fn next_epoch(self) -> Self {
        Self { epoch: self.epoch, cycle: Cycle(u64::MAX) }.plus(1)
    }
}

impl fmt::Display for Moment {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{}:{}", self.epoch.0, self.cycle.0)
    }
}

macro_rules! hashes {
    ($($(#[$documentation:meta])* $name:ident;)*) => {$(
        $(#[$documentation])*
        #[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default, Serialize, Deserialize)]
        #[serde(transparent)]
        pub struct $name(pub u64);

        impl $name {
            /// The hash of the canonical text of the named object.
            pub fn of(text: &[u8]) -> Self {
                Self(xxhash_rust::xxh3::xxh3_64(text))
            }
        }

        impl fmt::Display for $name {
            fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
                write!(formatter, "{:016x}", self.0)
            }
        }
    )*};
}

hashes! {
    /// Identifies a cluster; frames of other clusters on the same network are dropped.
    ClusterHash;
    /// Identifies all programs, roles and timings of a cluster; a member with another one is refused.
    ConfigurationHash;
    /// Identifies one program's circuit.
    ProgramHash;
    /// Identifies the inputs and outputs of one program: their names, types and places.
    PointsHash;
    /// Identifies the authority that issued the keys of a member, by its certificate.
    AuthorityHash;
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn moments_count_on_into_the_next_epoch() {
        let at = |epoch, cycle| Moment { epoch: Epoch(epoch), cycle: Cycle(cycle) };
        let end = u64::MAX;
        let check = |from: Moment, cycles: u64, expected: Moment| {
            assert_eq!(from.plus(cycles), expected, "{from} plus {cycles}");
            assert!(from <= expected);
        };
        check(at(3, 0), 0, at(3, 0));
        check(at(3, 5), 2, at(3, 7));
        check(at(3, end - 1), 1, at(3, end));
        check(at(3, end), 0, at(3, end));
        check(at(3, end), 1, at(4, 0));
        check(at(3, end - 1), 4, at(4, 2));
        check(at(3, end), end, at(4, end - 1));
        check(at(end, end - 1), 1, Moment::LAST);
        check(at(end, end - 1), 2, Moment::LAST);
        check(Moment::LAST, 1, Moment::LAST);
        check(at(end, 7), end, Moment::LAST);
        assert_eq!(at(3, 9).next_epoch(), at(4, 0));
        assert_eq!(at(end, 9).next_epoch(), Moment::LAST);
    }
}
