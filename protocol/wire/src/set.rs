//! Sets of programs and of stations, one 64-bit word each.

use std::fmt;
use std::hash::{Hash, Hasher};
use std::marker::PhantomData;

use serde::{Deserialize, Serialize};

use crate::identifier::{ProgramId, StationId};

/// Member of a [`Set`]: an index below 64.
pub trait Element: Copy {
    /// The member with an index below 64.
    fn from_index(index: u8) -> Self;
    /// Its index; a member with an index of 64 or above is in no set.
    fn to_index(self) -> u8;
}

impl Element for ProgramId {
    fn from_index(index: u8) -> Self {
        Self(index)
    }
    fn to_index(self) -> u8 {
        self.0
    }
}

impl Element for StationId {
    fn from_index(index: u8) -> Self {
        Self(index)
    }
    fn to_index(self) -> u8 {
        self.0
    }
}

/// A set of members, bit k being the member with index k.
#[derive(Serialize, Deserialize)]
#[serde(transparent)]
pub struct Set<E>(u64, #[serde(skip)] PhantomData<E>);

/// A set of programs, such as the mask of a parity word.
pub type ProgramSet = Set<ProgramId>;

/// A set of stations, such as those received in a cycle.
pub type StationSet = Set<StationId>;

impl<E: Element> Set<E> {
    /// The empty set.
    pub const EMPTY: Self = Self(0, PhantomData);

    /// The members of a bit mask.
    pub fn from_bits(bits: u64) -> Self {
        Self(bits, PhantomData)
    }

    /// The members as a bit mask.
    pub fn bits(self) -> u64 {
        self.0
    }

    /// The members with an index below `count`.
    pub fn first(count: usize) -> Self {
        Self::from_bits(if count >= 64 {
            u64::MAX
        } else {
            (1 << count) - 1
        })
    }

    /// The set of one member.
    pub fn only(member: E) -> Self {
        Self::from_bits(bit(member))
    }

    /// Whether it holds `member`.
    pub fn contains(self, member: E) -> bool {
        self.0 & bit(member) != 0
    }

    /// Adds a member.
    pub fn insert(&mut self, member: E) {
        self.0 |= bit(member);
    }

    /// Removes a member.
    pub fn remove(&mut self, member: E) {
        self.0 &= !bit(member);
    }

    /// The members of this set that are not in `other`.
    #[must_use]
    pub fn without(self, other: Self) -> Self {
        Self::from_bits(self.0 & !other.0)
    }

    /// The members of both sets.
    #[must_use]
    pub fn and(self, other: Self) -> Self {
        Self::from_bits(self.0 & other.0)
    }

    /// The members of either set.
    #[must_use]
    pub fn or(self, other: Self) -> Self {
        Self::from_bits(self.0 | other.0)
    }

    /// Number of members.
    pub fn len(self) -> usize {
        self.0.count_ones() as usize
    }

    /// Whether the set has no member.
    pub fn is_empty(self) -> bool {
        self.0 == 0
    }

    /// The members in ascending order.
    pub fn iter(self) -> impl Iterator<Item = E> {
        let mut rest = self.0;
        std::iter::from_fn(move || {
            (rest != 0).then(|| {
                let index = rest.trailing_zeros();
                rest &= rest - 1;
                E::from_index(index as u8)
            })
        })
    }
}

fn bit<E: Element>(member: E) -> u64 {
    1_u64.checked_shl(u32::from(member.to_index())).unwrap_or(0)
}

impl<E: Element> FromIterator<E> for Set<E> {
    fn from_iter<T: IntoIterator<Item = E>>(members: T) -> Self {
        let mut set = Self::EMPTY;
        for member in members {
            set.insert(member);
        }
        set
    }
}

// Written out, because a derive would ask the same of `E`, which is only a marker.
impl<E> Hash for Set<E> {
    fn hash<H: Hasher>(&self, hasher: &mut H) {
        self.0.hash(hasher);
    }
}

impl<E> Clone for Set<E> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<E> Copy for Set<E> {}

impl<E> PartialEq for Set<E> {
    fn eq(&self, other: &Self) -> bool {
        self.0 == other.0
    }
}

impl<E> Eq for Set<E> {}

impl<E> Default for Set<E> {
    fn default() -> Self {
        Self(0, PhantomData)
    }
}

impl<E: Element + fmt::Debug> fmt::Debug for Set<E> {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.debug_set().entries(self.iter()).finish()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_set_holds_what_was_put_in_in_order() {
        let set: ProgramSet = [ProgramId(63), ProgramId(0), ProgramId(5)]
            .into_iter()
            .collect();
        assert_eq!(
            set.iter().map(|program| program.0).collect::<Vec<_>>(),
            [0, 5, 63]
        );
        assert_eq!(set.without(ProgramSet::only(ProgramId(5))).len(), 2);
        assert_eq!(ProgramSet::first(64).len(), 64);
        assert_eq!(ProgramSet::first(0), ProgramSet::EMPTY);
    }

    #[test]
    fn a_member_past_the_bound_is_in_no_set() {
        let mut set = StationSet::EMPTY;
        set.insert(StationId(64));
        assert!(set.is_empty());
        assert!(!StationSet::first(64).contains(StationId(200)));
    }
}
