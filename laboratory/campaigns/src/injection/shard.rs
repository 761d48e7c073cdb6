//! A part of a campaign, for one of many machines.

use std::fmt;
use std::str::FromStr;

use serde::{Deserialize, Serialize};

/// Every `of`-th run, beginning with the `number`-th; numbers count from 1.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(into = "String", try_from = "String")]
pub struct Shard {
    number: u64,
    of: u64,
}

/// A text that is no shard.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{0:?} is no shard: it is written K/N, such as 3/8, with K from 1 to N")]
pub struct NoShard(String);

impl Shard {
    /// The whole campaign.
    pub const WHOLE: Self = Self { number: 1, of: 1 };

    /// Its place, from 1.
    pub fn number(self) -> u64 {
        self.number
    }

    /// How many there are.
    pub fn of(self) -> u64 {
        self.of
    }

    /// The run that is its `place`-th, from 0; none past `runs`.
    pub(super) fn run(self, place: u64, runs: u64) -> Option<u64> {
        let run = place.checked_mul(self.of)?.checked_add(self.number - 1)?;
        (run < runs).then_some(run)
    }

    /// How many of `runs` runs are its own.
    pub fn share(self, runs: u64) -> u64 {
        (runs + self.of - self.number) / self.of
    }
}

impl FromStr for Shard {
    type Err = NoShard;

    fn from_str(text: &str) -> Result<Self, NoShard> {
        let parse = || {
            let (number, of) = text.split_once('/')?;
            let (number, of) = (number.parse().ok()?, of.parse().ok()?);
            (number >= 1 && number <= of && of <= 1_000_000).then_some(Self { number, of })
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

    /// Whatever the numbers, every run belongs to one shard, and shares are what is counted.
    #[test]
    fn shards_divide_a_campaign() {
        for runs in 0..20 {
            for of in 1..=7 {
                let mut all = Vec::new();
                for number in 1..=of {
                    let shard: Shard = format!("{number}/{of}").parse().expect("a shard");
                    let own: Vec<u64> = (0..).map_while(|place| shard.run(place, runs)).collect();
                    assert_eq!(own.len() as u64, shard.share(runs), "{shard} of {runs}");
                    all.extend(own);
                }
                all.sort_unstable();
                assert_eq!(all, (0..runs).collect::<Vec<_>>());
            }
        }
    }

    #[test]
    fn what_is_no_shard() {
        for text in ["", "3", "0/3", "4/3", "1/0", "a/b", "-1/3", "1/3/5", "1/10000000"] {
            assert!(text.parse::<Shard>().is_err(), "{text}");
        }
    }
}
