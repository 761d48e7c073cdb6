//! How a link misbehaves, and how people write it.

use std::fmt;
use std::str::FromStr;
use std::time::Duration;
use understudy_text::duration::{self, InvalidDuration};

use serde::{Deserialize, Serialize};

/// The longest delay, jitter included.
const MAXIMUM_DELAY: Duration = Duration::from_secs(60);

/// What one direction of a link does to what passes. The default does nothing.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Impairment {
    /// Never arrives. Over TCP, where the system sends it again, it is late by [`crate::Shaper::RETRANSMISSION`].
    pub loss: Share,
    /// Arrives so much later.
    pub delay: Duration,
    /// By up to so much earlier or later than that, evenly; the order stays.
    pub jitter: Duration,
    /// Arrives twice.
    pub duplicate: Share,
    /// Is overtaken by what comes behind it.
    pub reorder: Share,
    /// Arrives with one bit turned over.
    pub corrupt: Share,
    /// The link carries no more.
    pub rate: Option<Rate>,
}

/// A probability.
#[derive(Debug, Clone, Copy, PartialEq, PartialOrd, Default, Serialize, Deserialize)]
#[serde(try_from = "f64", into = "f64")]
pub struct Share(f64);

/// Bits a second, at least 1000.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "u64", into = "u64")]
pub struct Rate(u64);

/// A text that is not what it should be.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{found:?} is no {what}, such as {example}")]
pub struct WrittenImpairment {
    found: String,
    what: &'static str,
    example: &'static str,
}

impl Share {
    /// Nothing where it is no probability.
    pub fn new(share: f64) -> Option<Self> {
        (0.0..=1.0).contains(&share).then_some(Self(share))
    }

    /// From 0 to 1.
    pub fn get(self) -> f64 {
        self.0
    }

    /// Whether it never happens.
    pub fn is_never(self) -> bool {
        self.0 == 0.0
    }
}

impl Rate {
    const LEAST: u64 = 1000;

    /// Nothing below 1000 bits a second, at which a frame would take seconds.
    pub fn new(bits_a_second: u64) -> Option<Self> {
        (bits_a_second >= Self::LEAST).then_some(Self(bits_a_second))
    }

    /// How long so many bytes are on their way.
    pub fn time_of(self, bytes: usize) -> Duration {
        let nanoseconds = bytes as u128 * 8 * 1_000_000_000 / u128::from(self.0);
        Duration::from_nanos(u64::try_from(nanoseconds).unwrap_or(u64::MAX))
    }
}

impl Impairment {
    /// Whether it does nothing.
    pub fn is_none(&self) -> bool {
        *self == Self::default()
    }

    /// A time of an impairment as people write it, such as `1ms`.
    ///
    /// # Errors
    /// Where it is not a duration, or longer than a minute.
    pub fn parse_delay(text: &str) -> Result<Duration, InvalidDuration> {
        duration::parse_up_to(text, MAXIMUM_DELAY)
    }
}

impl FromStr for Share {
    type Err = WrittenImpairment;

    /// `1%` or `0.01`.
    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let (number, unit) = match text.strip_suffix('%') {
            Some(number) => (number, 0.01),
            None => (text, 1.0),
        };
        plain_number(number)
            .and_then(|number| Self::new(number * unit))
            .ok_or_else(|| wrong(text, "share from 0 to 100 %", "1% or 0.01"))
    }
}

impl FromStr for Rate {
    type Err = WrittenImpairment;

    /// `10mbit`, `64kbit`, `1gbit`.
    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let units = [("kbit", 1e3), ("mbit", 1e6), ("gbit", 1e9)];
        units
            .iter()
            .find_map(|(unit, bits)| Some(plain_number(text.strip_suffix(unit)?)? * bits))
            .filter(|rate| *rate <= 1e15)
            .and_then(|rate| Self::new(rate as u64))
            .ok_or_else(|| wrong(text, "rate of at least 1kbit", "10mbit or 64kbit"))
    }
}

impl fmt::Display for Share {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        // A tenth of a part in a million is as fine as anybody writes it.
        let percent = format!("{:.5}", self.0 * 100.0);
        let percent = percent.trim_end_matches('0').trim_end_matches('.');
        write!(formatter, "{percent} %")
    }
}

impl TryFrom<f64> for Share {
    type Error = WrittenImpairment;

    fn try_from(share: f64) -> Result<Self, Self::Error> {
        Self::new(share).ok_or_else(|| wrong(&share.to_string(), "share", "0.01"))
    }
}

impl From<Share> for f64 {
    fn from(share: Share) -> Self {
        share.0
    }
}

impl TryFrom<u64> for Rate {
    type Error = WrittenImpairment;

    fn try_from(rate: u64) -> Result<Self, Self::Error> {
        Self::new(rate).ok_or_else(|| wrong(&rate.to_string(), "rate in bits a second", "10000000"))
    }
}

impl From<Rate> for u64 {
    fn from(rate: Rate) -> Self {
        rate.0
    }
}

/// Without the words and signs that a float may have.
fn plain_number(text: &str) -> Option<f64> {
    let text = text.trim();
    let plain = text.starts_with(|first: char| first.is_ascii_digit())
        && text.bytes().all(|byte| byte.is_ascii_digit() || byte == b'.');
    plain.then(|| text.parse().ok()).flatten()
}

fn wrong(found: &str, what: &'static str, example: &'static str) -> WrittenImpairment {
    WrittenImpairment { found: found.to_owned(), what, example }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_are_written_in_percent_or_in_parts() {
        let check = |text: &str, expected: Option<f64>| {
            let found = text.parse::<Share>().ok().map(Share::get);
            assert_eq!(found, expected, "{text}");
        };
        check("1%", Some(0.01));
        check("0.25", Some(0.25));
        check("100 %", Some(1.0));
        check("0", Some(0.0));
        for text in ["", "%", "101%", "1.5", "-1%", "nan", "inf", "1e-2"] {
            check(text, None);
        }
    }

    #[test]
    fn rates_and_delays_have_units() {
        let rate = |text: &str| text.parse::<Rate>().ok().map(u64::from);
        assert_eq!(rate("10mbit"), Some(10_000_000));
        assert_eq!(rate("1.5 kbit"), Some(1500));
        assert_eq!(rate("0.5kbit"), None);
        assert_eq!(rate("10"), None);
        let delay = |text: &str| Impairment::parse_delay(text).ok();
        assert_eq!(delay("1ms"), Some(Duration::from_millis(1)));
        assert_eq!(delay("0.2s"), Some(Duration::from_millis(200)));
        assert_eq!(delay("61s"), None);
        assert_eq!(delay("1"), None);
    }

    #[test]
    fn a_rate_says_how_long_bytes_take() {
        let rate = Rate::new(8000).expect("enough");
        assert_eq!(rate.time_of(1000), Duration::from_secs(1));
    }

    #[test]
    fn what_is_stored_is_read_and_checked() {
        let text = r#"{"loss":0.1,"rate":64000}"#;
        let read: Impairment = serde_json::from_str(text).expect("an impairment");
        assert_eq!(read.loss.to_string(), "10 %");
        assert!(serde_json::from_str::<Impairment>(r#"{"loss":2.0}"#).is_err());
        assert!(serde_json::from_str::<Impairment>(r#"{"los":0.1}"#).is_err());
    }
}
