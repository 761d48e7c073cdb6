//! Hours, rates and probabilities, checked once where they enter.

use std::fmt;
use std::str::FromStr;

use serde::Serialize;

use crate::error::ReliabilityError;

/// The shortest time that is taken, in hours.
pub const MINIMUM_HOURS: f64 = 1e-12;
/// The longest time that is taken, in hours.
pub const MAXIMUM_HOURS: f64 = 1e15;

/// The least probability that is stated; twelve digits cannot be had of much smaller ones.
pub const MINIMUM_PROBABILITY: f64 = 1e-300;

/// Units of a time and their length in hours.
const UNITS: [(&str, f64); 7] = [
    ("us", 1.0 / 3_600_000_000.0),
    ("ms", 1.0 / 3_600_000.0),
    ("s", 1.0 / 3_600.0),
    ("min", 1.0 / 60.0),
    ("h", 1.0),
    ("d", 24.0),
    ("y", 8_760.0),
];

/// A positive, finite time in hours.
#[derive(Debug, Clone, Copy, PartialEq, PartialOrd, Serialize)]
#[serde(transparent)]
pub struct Hours(f64);

impl Hours {
    /// A time of `hours`; `what` names it where it is refused.
    ///
    /// # Errors
    /// [`ReliabilityError::Time`] where it is not positive, not finite or out of bounds.
    pub fn new(what: &str, hours: f64) -> Result<Self, ReliabilityError> {
        if (MINIMUM_HOURS..=MAXIMUM_HOURS).contains(&hours) {
            Ok(Self(hours))
        } else {
            Err(ReliabilityError::Time { what: what.into(), hours })
        }
    }

    /// The number of hours.
    pub fn get(self) -> f64 {
        self.0
    }

    /// Once in this time, per hour.
    pub fn rate(self) -> f64 {
        1.0 / self.0
    }
}

impl FromStr for Hours {
    type Err = ReliabilityError;

    /// `10000h`, `24 h`, `30d`, `1.5e4h`, `20min`, `10ms`; a year (`y`) has 365 days.
    fn from_str(text: &str) -> Result<Self, ReliabilityError> {
        let refused = |why: String| ReliabilityError::TimeText { text: text.into(), why };
        let trimmed = text.trim();
        let unit_at = trimmed
            .rfind(|character: char| !character.is_ascii_alphabetic())
            .map_or(0, |last| last + trimmed[last..].chars().next().map_or(1, char::len_utf8));
        let (number, unit) = (trimmed[..unit_at].trim_end(), &trimmed[unit_at..]);
        if unit.is_empty() {
            return Err(refused(format!(
                "it has no unit; write {}",
                if number.is_empty() {
                    "a number and a unit, such as 10000h".into()
                } else {
                    format!("{number}h for hours, {number}d for days")
                }
            )));
        }
        let Some(length) = unit_length(unit) else {
            return Err(refused(format!(
                "{unit:?} is not a unit; expected us, ms, s, min, h, d and y"
            )));
        };
        let value: f64 =
            number.parse().map_err(|_| refused(format!("{number:?} is not a number")))?;
        Self::new(trimmed, value * length)
    }
}

/// The length in hours of a unit of time.
pub(crate) fn unit_length(unit: &str) -> Option<f64> {
    UNITS.iter().find(|(name, _)| *name == unit).map(|(_, length)| *length)
}

impl fmt::Display for Hours {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{} h", grouped(self.0))
    }
}

/// A probability.
#[derive(Debug, Clone, Copy, PartialEq, PartialOrd, Serialize)]
#[serde(transparent)]
pub struct Probability(f64);

impl Probability {
    /// A certain event.
    pub const ONE: Self = Self(1.0);
    /// An impossible event.
    pub const ZERO: Self = Self(0.0);

    /// A probability of `value`; `what` names it where it is refused.
    ///
    /// # Errors
    /// [`ReliabilityError::Probability`] outside [0, 1].
    pub fn new(what: &str, value: f64) -> Result<Self, ReliabilityError> {
        if (0.0..=1.0).contains(&value) {
            Ok(Self(value))
        } else {
            Err(ReliabilityError::Probability { what: what.into(), value })
        }
    }

    /// The probability as a number.
    pub fn get(self) -> f64 {
        self.0
    }
}

/// A probability that is positive, or nothing where it is below [`MINIMUM_PROBABILITY`].
pub(crate) fn stated(probability: f64) -> Option<f64> {
    (probability >= MINIMUM_PROBABILITY).then_some(probability)
}

/// A probability for people with some decimals, or in powers of ten where it is small; nothing is one below [`MINIMUM_PROBABILITY`].
pub(crate) fn probability(stated: Option<f64>, decimals: usize) -> String {
    match stated {
        None => "below 1e-300".into(),
        Some(value) if value == 0.0 || value >= 1e-3 => format!("{value:.decimals$}"),
        Some(value) => format!("{value:.6e}"),
    }
}

/// A rate per hour that is positive and finite.
///
/// # Errors
/// [`ReliabilityError::Rate`] with the value.
pub(crate) fn rate(what: &str, per_hour: f64) -> Result<f64, ReliabilityError> {
    if is_rate(per_hour) {
        Ok(per_hour)
    } else {
        Err(ReliabilityError::Rate { what: what.into(), per_hour })
    }
}

pub(crate) fn is_rate(per_hour: f64) -> bool {
    per_hour > 0.0 && per_hour.is_finite()
}

/// A number as people read it: six significant digits, thousands apart, powers of ten where it is very large or small.
pub fn grouped(value: f64) -> String {
    let magnitude = value.abs();
    if value == 0.0 {
        return "0".into();
    }
    if !(1e-4..1e7).contains(&magnitude) {
        let text = format!("{value:.4e}");
        let (mantissa, exponent) = text.split_once('e').unwrap_or((&text, "0"));
        let mantissa = mantissa.trim_end_matches('0').trim_end_matches('.');
        return format!("{mantissa}e{exponent}");
    }
    let decimals = (5 - magnitude.log10().floor() as i32).clamp(0, 9) as usize;
    let text = format!("{value:.decimals$}");
    let (whole, fraction) = text.split_once('.').unwrap_or((&text, ""));
    let (sign, digits) = whole.strip_prefix('-').map_or(("", whole), |digits| ("-", digits));
    let mut spaced = String::new();
    for (place, digit) in digits.chars().enumerate() {
        if place > 0 && (digits.len() - place).is_multiple_of(3) {
            spaced.push(',');
        }
        spaced.push(digit);
    }
    let fraction = fraction.trim_end_matches('0');
    let point = if fraction.is_empty() { "" } else { "." };
    format!("{sign}{spaced}{point}{fraction}")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check(text: &str, expected: Result<f64, &str>) {
        let found = text.parse::<Hours>().map(Hours::get);
        match expected {
            Ok(hours) => assert!(
                found.as_ref().is_ok_and(|found| (found / hours - 1.0).abs() < 1e-15),
                "{text}: {found:?}"
            ),
            Err(part) => {
                let message = found.expect_err(text).to_string();
                assert!(message.contains(part), "{text}: {message}");
            }
        }
    }

    #[test]
    fn a_time_carries_its_unit() {
        check("10000h", Ok(10_000.0));
        check(" 24 h ", Ok(24.0));
        check("30d", Ok(720.0));
        check("1.5e4h", Ok(15_000.0));
        check("90min", Ok(1.5));
        check("36s", Ok(0.01));
        check("2y", Ok(17_520.0));
        check("10000", Err("write 10000h for hours"));
        check("", Err("such as 10000h"));
        check("h", Err("\"\" is not a number"));
        check("3 weeks", Err("\"weeks\" is not a unit"));
        check("12½h", Err("\"12½\" is not a number"));
        check("½", Err("no unit"));
        check("0h", Err("0h is 0 hours"));
        check("-4h", Err("is -4 hours"));
        check("1e99h", Err("U0701"));
        check("infh", Err("infh"));
    }

    #[test]
    fn numbers_are_said_as_people_read_them() {
        for (value, expected) in [
            (0.0, "0"),
            (110_905.852_197, "110,906"),
            (24.0, "24"),
            (1234.5, "1,234.5"),
            (-0.25, "-0.25"),
            (30_298_955.65, "3.0299e7"),
            (1e-9, "1e-9"),
            (999_999.7, "1,000,000"),
        ] {
            assert_eq!(grouped(value), expected);
        }
    }
}
