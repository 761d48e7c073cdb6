//! The one form of a duration in text: numbers with their units, the larger units first, such as `10ms`, `1.5s` or `1m30s`.
//!
//! Command lines, TOML files, ladders and the JSON schemas share it: [`parse`] reads what [`pattern`] matches, and
//! reads back what [`text`] writes.

use std::fmt::{self, Write};
use std::time::Duration;

/// The longest duration.
pub const MAXIMUM: Duration = Duration::from_secs(100 * 24 * 3600);

/// The units in nanoseconds, the largest first. `min` is read as `m`.
const UNITS: [(&str, u64); 7] = [
    ("d", 86_400_000_000_000),
    ("h", 3_600_000_000_000),
    ("m", 60_000_000_000),
    ("s", 1_000_000_000),
    ("ms", 1_000_000),
    ("us", 1_000),
    ("ns", 1),
];

/// Digits of a fraction that count; a nanosecond is 14 digits behind the point of a day.
const SIGNIFICANT_DIGITS: usize = 18;

/// A text that is not a duration.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct InvalidDuration {
    text: String,
    expected: String,
}

impl InvalidDuration {
    fn new(text: &str, expected: impl Into<String>) -> Self {
        Self { text: text.to_owned(), expected: expected.into() }
    }
}

impl fmt::Display for InvalidDuration {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { text, expected } = self;
        write!(formatter, "invalid duration `{text}`: expected {expected}")
    }
}

impl std::error::Error for InvalidDuration {}

/// The duration that a text means: parts in descending units, of which the last may have a fraction.
///
/// # Errors
/// Where the text is not a duration, or one longer than [`MAXIMUM`].
pub fn parse(text: &str) -> Result<Duration, InvalidDuration> {
    let form = || InvalidDuration::new(text, "a number with a unit, such as `10ms`");
    let nanoseconds = nanoseconds(text).ok_or_else(form)?;
    let duration = u64::try_from(nanoseconds).ok().map(Duration::from_nanos);
    let duration = duration.filter(|duration| *duration <= MAXIMUM);
    duration.ok_or_else(|| InvalidDuration::new(text, "at most 100 days"))
}

/// As [`parse`], for a duration that cannot be zero.
///
/// # Errors
/// As [`parse`], and for zero.
pub fn parse_positive(text: &str) -> Result<Duration, InvalidDuration> {
    let duration = parse(text)?;
    if duration.is_zero() {
        return Err(InvalidDuration::new(text, "more than zero"));
    }
    Ok(duration)
}

/// As [`parse`], for a duration up to `most`.
///
/// # Errors
/// As [`parse`], and for a longer one.
pub fn parse_up_to(text: &str, most: Duration) -> Result<Duration, InvalidDuration> {
    let duration = parse(text)?;
    if duration > most {
        return Err(InvalidDuration::new(text, format!("at most {}", self::text(most))));
    }
    Ok(duration)
}

/// The longest duration of which both are multiples; the other one where one is zero.
pub fn common(one: Duration, other: Duration) -> Duration {
    let nanoseconds = |duration: Duration| u64::try_from(duration.as_nanos()).unwrap_or(u64::MAX);
    let (mut one, mut other) = (nanoseconds(one), nanoseconds(other));
    while other != 0 {
        (one, other) = (other, one % other);
    }
    Duration::from_nanos(one)
}

/// The sum of the parts; the largest number where it is larger still.
fn nanoseconds(text: &str) -> Option<u128> {
    let mut rest = text.trim_matches(' ');
    let mut total: u128 = 0;
    let mut next_unit = 0;
    loop {
        let is_number = |character: char| character.is_ascii_digit() || character == '.';
        let (number, behind) = split_while(rest, is_number);
        let (word, behind) = split_while(behind.trim_start_matches(' '), |character| {
            character.is_ascii_alphabetic()
        });
        let word = if word == "min" { "m" } else { word };
        let unit = UNITS.iter().position(|(unit, _)| *unit == word)?;
        if unit < next_unit {
            return None;
        }
        next_unit = unit + 1;
        total = total.saturating_add(scaled(number, UNITS[unit].1)?);
        rest = behind.trim_start_matches(' ');
        if rest.is_empty() {
            return Some(total);
        }
        if number.contains('.') {
            return None;
        }
    }
}

fn split_while(text: &str, belongs: impl Fn(char) -> bool) -> (&str, &str) {
    let end = text.find(|character| !belongs(character));
    text.split_at(end.unwrap_or(text.len()))
}

/// A decimal number of units in nanoseconds, rounded down.
fn scaled(number: &str, unit: u64) -> Option<u128> {
    let (whole, fraction) = number.split_once('.').unwrap_or((number, "0"));
    let is_digits = |text: &str| !text.is_empty() && text.bytes().all(|byte| byte.is_ascii_digit());
    if !is_digits(whole) || !is_digits(fraction) {
        return None;
    }
    let unit = u128::from(unit);
    // Digits are the only content, so what cannot be parsed is too large.
    let whole = whole.parse::<u128>().unwrap_or(u128::MAX);
    let fraction = &fraction[..fraction.len().min(SIGNIFICANT_DIGITS)];
    let scale = 10_u128.pow(u32::try_from(fraction.len()).ok()?);
    let part = fraction.parse::<u128>().ok()? * unit / scale;
    Some(whole.saturating_mul(unit).saturating_add(part))
}

/// A duration as [`parse`] reads it, in whole numbers.
pub fn text(duration: Duration) -> String {
    let mut rest = duration.as_nanos();
    let mut text = String::new();
    for (unit, nanoseconds) in UNITS {
        let nanoseconds = u128::from(nanoseconds);
        if rest >= nanoseconds {
            let _ = write!(text, "{}{unit}", rest / nanoseconds);
            rest %= nanoseconds;
        }
    }
    if text.is_empty() { "0ms".into() } else { text }
}

/// The form of a duration as a regular expression of JSON Schema. Only the bounds are beyond it.
pub fn pattern() -> String {
    let mut pattern = String::new();
    for (unit, _) in UNITS.iter().rev() {
        let unit = if *unit == "m" { "m(in)?" } else { unit };
        let last = format!("[0-9]+([.][0-9]+)? *{unit}");
        pattern = if pattern.is_empty() {
            last
        } else {
            format!("({last}|([0-9]+ *{unit} *)?{pattern})")
        };
    }
    format!("^ *{pattern} *$")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check(text: &str, expected: Option<u64>) {
        let nanoseconds = parse(text).ok().map(|duration| duration.as_nanos() as u64);
        assert_eq!(nanoseconds, expected, "{text}");
    }

    #[test]
    fn a_duration_carries_its_units() {
        check("10ms", Some(10_000_000));
        check("1.5 s", Some(1_500_000_000));
        check(" 0.2us ", Some(200));
        check("7ns", Some(7));
        check("10min", Some(600_000_000_000));
        check("1m30s", Some(90_000_000_000));
        check("1h 0.5 m", Some(3_630_000_000_000));
        check("100d", Some(8_640_000_000_000_000));
        check("0.0000000000000000000000000001d", Some(0));
        for text in [
            "", " ", "10", "ms", "-1ms", "+1ms", "1e3ms", "1.2.3s", "10 MS", "1s1s", "1s1m",
            "1.5s1ms", "1.s", ".5s", "½s", "5 minuts", "1\u{a0}s", "1\ts",
        ] {
            check(text, None);
        }
    }

    #[test]
    fn a_message_says_what_is_expected() {
        let check = |text, expected: &str| {
            let message = parse_positive(text).expect_err(text).to_string();
            assert_eq!(message, expected);
        };
        check(
            "5 minuts",
            "invalid duration `5 minuts`: expected a number with a unit, such as `10ms`",
        );
        check(
            "99999999999999999999999999999999999999999s",
            "invalid duration `99999999999999999999999999999999999999999s`: expected at most 100 days",
        );
        check("101d", "invalid duration `101d`: expected at most 100 days");
        check("0s", "invalid duration `0s`: expected more than zero");
    }

    #[test]
    fn a_duration_is_written_as_it_is_read() {
        let check = |nanoseconds, expected: &str| {
            let written = text(Duration::from_nanos(nanoseconds));
            assert_eq!(written, expected);
            check(&written, Some(nanoseconds));
        };
        check(0, "0ms");
        check(999, "999ns");
        check(10_000_000, "10ms");
        check(1_500_000_000, "1s500ms");
        check(90_000_000_000, "1m30s");
        check(8_640_000_000_000_000, "100d");
    }
}
