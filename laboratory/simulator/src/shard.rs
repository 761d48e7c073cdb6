//! A part of a search, for one of many machines; and whether given parts are the whole search.

use std::collections::BTreeMap;
use std::fmt;
use std::str::FromStr;

use serde::{Deserialize, Serialize};

/// Maximum number of shards of a search.
const MAXIMUM_SHARDS: u64 = 1_000_000;

/// Missing shards that a message lists, at most.
const LISTED_SHARDS: usize = 20;

/// Every `of`-th item of a search, beginning with the `number`-th; numbers count from 1.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(into = "String", try_from = "String")]
pub struct Shard {
    number: u64,
    of: u64,
}

/// A text that is not a shard.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("invalid shard `{0}`: expected K/N, such as 3/8, with K from 1 to N")]
pub struct NoShard(String);

/// Shards that are not the whole of one search.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum ShardError {
    /// No shard was given.
    #[error("there is nothing to merge")]
    Nothing,
    /// Shards of different searches.
    #[error("{name} is of another search than {first}: {what} differs")]
    Other {
        /// Name of the first one.
        first: String,
        /// Name of the one that differs from it.
        name: String,
        /// What differs.
        what: &'static str,
    },
    /// One shard twice.
    #[error("{name} and {other} are both shard {shard}")]
    Twice {
        /// Which shard.
        shard: Shard,
        /// Name of the first one.
        name: String,
        /// Name of the second one.
        other: String,
    },
    /// Shards that were not given.
    #[error("{} of {of} shards are missing: {}", missing.len(), list(missing))]
    Missing {
        /// Their numbers.
        missing: Vec<u64>,
        /// Number of all shards.
        of: u64,
    },
}

/// The first few of many.
fn list(numbers: &[u64]) -> String {
    let shown: Vec<String> = numbers.iter().take(LISTED_SHARDS).map(u64::to_string).collect();
    let more = if numbers.len() > shown.len() { ", ..." } else { "" };
    shown.join(", ") + more
}

impl Shard {
    /// The whole search.
    pub const WHOLE: Self = Self { number: 1, of: 1 };

    /// Number of the shard, from 1.
    pub fn number(self) -> u64 {
        self.number
    }

    /// Number of shards of the search.
    pub fn of(self) -> u64 {
        self.of
    }

    /// The `place`-th item of the shard, from 0; none past `items`.
    pub fn item(self, place: u64, items: u64) -> Option<u64> {
        let item = place.checked_mul(self.of)?.checked_add(self.number - 1)?;
        (item < items).then_some(item)
    }

    /// Whether an item belongs to the shard.
    pub fn has(self, item: u64) -> bool {
        item % self.of == self.number - 1
    }

    /// Number of the items that belong to the shard, of `items`.
    pub fn share(self, items: u64) -> u64 {
        (items + self.of - self.number) / self.of
    }

    /// Everything that keeps the named parts from being each shard of one search once. `difference` says what makes two of them parts of
    /// different searches, such as `the seed`.
    pub fn obstacles<P>(
        parts: &[(String, P)],
        shard: impl Fn(&P) -> Self,
        difference: impl Fn(&P, &P) -> Option<&'static str>,
    ) -> Vec<ShardError> {
        let Some((first_name, first)) = parts.first() else {
            return vec![ShardError::Nothing];
        };
        let of = shard(first).of;
        let mut errors = Vec::new();
        let mut by_number: BTreeMap<u64, &str> = BTreeMap::new();
        for (name, part) in parts {
            let shard = shard(part);
            let what = difference(first, part);
            let what = what.or_else(|| (shard.of != of).then_some("the number of shards"));
            if let Some(what) = what {
                let (first, name) = (first_name.clone(), name.clone());
                errors.push(ShardError::Other { first, name, what });
            } else if let Some(before) = by_number.insert(shard.number, name) {
                let (name, other) = (before.to_owned(), name.clone());
                errors.push(ShardError::Twice { shard, name, other });
            }
        }
        let missing: Vec<u64> = (1..=of).filter(|number| !by_number.contains_key(number)).collect();
        if !missing.is_empty() {
            errors.push(ShardError::Missing { missing, of });
        }
        errors
    }
}

impl FromStr for Shard {
    type Err = NoShard;

    fn from_str(text: &str) -> Result<Self, NoShard> {
        let parse = || {
            let (number, of) = text.split_once('/')?;
            let (number, of) = (number.parse().ok()?, of.parse().ok()?);
            (number >= 1 && number <= of && of <= MAXIMUM_SHARDS).then_some(Self { number, of })
        };
        parse().ok_or_else(|| NoShard(text.to_owned()))
    }
}

impl fmt::Display for Shard {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{}/{}", self.number, self.of)
    }
}

impl From<Shard> for String {
    fn from(shard: Shard) -> Self {
        shard.to_string()
    }
}

impl TryFrom<String> for Shard {
    type Error = NoShard;

    fn try_from(text: String) -> Result<Self, NoShard> {
        text.parse()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every run belongs to one shard, and shares are what is counted.
    #[test]
    fn shards_divide_a_campaign() {
        for runs in 0..20 {
            for of in 1..=7 {
                let mut all = Vec::new();
                for number in 1..=of {
                    let shard: Shard = format!("{number}/{of}").parse().expect("a shard");
                    let own: Vec<u64> = (0..).map_while(|place| shard.item(place, runs)).collect();
                    assert_eq!(own, (0..runs).filter(|run| shard.has(*run)).collect::<Vec<_>>());
                    assert_eq!(own.len() as u64, shard.share(runs), "{shard} of {runs}");
                    all.extend(own);
                }
                all.sort_unstable();
                assert_eq!(all, (0..runs).collect::<Vec<_>>());
            }
        }
    }

    #[test]
    fn other_texts_are_not_shards() {
        for text in ["", "3", "0/3", "4/3", "1/0", "a/b", "-1/3", "1/3/5", "1/10000000"] {
            assert!(text.parse::<Shard>().is_err(), "{text}");
        }
    }
}
