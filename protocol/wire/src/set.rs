//! Sets of programs and of stations, one 128-bit word each.

use std::fmt;
use std::hash::{Hash, Hasher};
use std::marker::PhantomData;

use serde::de::{self, Visitor};
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use crate::identifier::{MAXIMUM_PROGRAMS, MAXIMUM_STATIONS, ProgramId, StationId};

/// Member of a [`Set`]: an index below [`Element::MAXIMUM`].
pub trait Element: Copy {
    /// Maximum number of members, at most 127.
    const MAXIMUM: usize;
    /// The member with an index below the maximum.
    fn from_index(index: u8) -> Self;
    /// Its index; a member with an index of the maximum or above is in no set.
    fn to_index(self) -> u8;
}

impl Element for ProgramId {
    const MAXIMUM: usize = MAXIMUM_PROGRAMS;
    fn from_index(index: u8) -> Self {
        Self(index)
    }
    fn to_index(self) -> u8 {
        self.0
    }
}

impl Element for StationId {
    const MAXIMUM: usize = MAXIMUM_STATIONS;
    fn from_index(index: u8) -> Self {
        Self(index)
    }
    fn to_index(self) -> u8 {
        self.0
    }
}

/// A set of members, bit k being the member with index k.
pub struct Set<E>(u128, PhantomData<E>);

/// A set of programs, such as the mask of a parity word.
pub type ProgramSet = Set<ProgramId>;

/// A set of stations, such as those received in a cycle.
pub type StationSet = Set<StationId>;

impl<E: Element> Set<E> {
    /// The empty set.
    pub const EMPTY: Self = Self(0, PhantomData);

    const ALL: u128 = (1 << E::MAXIMUM) - 1;

    /// The members of a bit mask; bits of no member are left out.
    pub fn from_bits(bits: u128) -> Self {
        Self(bits & Self::ALL, PhantomData)
    }

    /// The members as a bit mask.
    pub fn bits(self) -> u128 {
        self.0
    }

    /// The members with an index below `count`.
    pub fn first(count: usize) -> Self {
        Self::from_bits((1 << count.min(E::MAXIMUM)) - 1)
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

fn bit<E: Element>(member: E) -> u128 {
    let index = usize::from(member.to_index());
    if index < E::MAXIMUM { 1 << index } else { 0 }
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

// In a text, a mask of more than 64 bits is a string of hexadecimal digits: readers of JSON take integers of 64 bits.
impl<E> Serialize for Set<E> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        if !serializer.is_human_readable() {
            return serializer.serialize_u128(self.0);
        }
        match u64::try_from(self.0) {
            Ok(bits) => serializer.serialize_u64(bits),
            Err(_) => serializer.collect_str(&format_args!("{:x}", self.0)),
        }
    }
}

impl<'de, E: Element> Deserialize<'de> for Set<E> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let bits = if deserializer.is_human_readable() {
            deserializer.deserialize_any(Mask)?
        } else {
            u128::deserialize(deserializer)?
        };
        if bits & !Self::ALL != 0 {
            return Err(de::Error::custom("a set with a member above the maximum"));
        }
        Ok(Self(bits, PhantomData))
    }
}

/// The bit mask of a set in a text.
struct Mask;

impl Visitor<'_> for Mask {
    type Value = u128;

    fn expecting(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str("a bit mask: an integer, or a string of at most 32 hexadecimal digits")
    }

    fn visit_u64<E>(self, bits: u64) -> Result<u128, E> {
        Ok(bits.into())
    }

    fn visit_str<E: de::Error>(self, digits: &str) -> Result<u128, E> {
        u128::from_str_radix(digits, 16)
            .map_err(|_| E::invalid_value(de::Unexpected::Str(digits), &self))
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
        let set: ProgramSet = [ProgramId(63), ProgramId(0), ProgramId(5)].into_iter().collect();
        assert_eq!(set.iter().map(|program| program.0).collect::<Vec<_>>(), [0, 5, 63]);
        assert_eq!(set.without(ProgramSet::only(ProgramId(5))).len(), 2);
        assert_eq!(ProgramSet::first(64).len(), 64);
        assert_eq!(StationSet::first(65).len(), 65);
        assert_eq!(StationSet::first(MAXIMUM_STATIONS).len(), MAXIMUM_STATIONS);
        assert_eq!(ProgramSet::first(0), ProgramSet::EMPTY);
    }

    #[test]
    fn a_member_past_the_bound_is_in_no_set() {
        let mut set = StationSet::EMPTY;
        set.insert(StationId(MAXIMUM_STATIONS as u8));
        assert!(set.is_empty());
        assert!(!StationSet::first(128).contains(StationId(200)));
        assert_eq!(ProgramSet::from_bits(u128::MAX), ProgramSet::first(MAXIMUM_PROGRAMS));
    }

    #[test]
    fn a_set_in_a_text_is_an_integer_while_it_fits_and_digits_above() {
        for (set, text) in [
            (StationSet::EMPTY, "0"),
            (StationSet::first(3), "7"),
            (StationSet::first(64), "18446744073709551615"),
            (StationSet::first(65), "\"1ffffffffffffffff\""),
            (StationSet::only(StationId(71)), "\"800000000000000000\""),
        ] {
            assert_eq!(serde_json::to_string(&set).unwrap(), text);
            assert_eq!(serde_json::from_str::<StationSet>(text).unwrap(), set);
        }
        for text in ["-1", "\"\"", "\"g\"", "\"1000000000000000000\"", "1.5", "[]"] {
            assert!(serde_json::from_str::<StationSet>(text).is_err(), "{text}");
        }
    }
}
