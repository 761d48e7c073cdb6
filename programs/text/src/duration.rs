//! Times as they stand in a file: a decimal number and its unit.

use std::time::Duration;

const UNITS: [(&str, u128); 4] = [
    ("s", 1_000_000_000),
    ("ms", 1_000_000),
    ("us", 1_000),
    ("ns", 1),
];

/// A time in the largest unit in which it is whole.
pub fn written_time(time: Duration) -> String {
    let nanoseconds = time.as_nanos();
    let (unit, length) = UNITS
        .into_iter()
        .find(|(_, length)| nanoseconds.is_multiple_of(*length))
        .unwrap_or(("ns", 1));
    format!("{}{unit}", nanoseconds / length)
}

/// `10ms`, `1.5s`, `200us`: a decimal number and its unit. At most a day.
pub fn parse_time(text: &str) -> Option<Duration> {
    let text = text.trim();
    let unit_at = text.find(|character: char| character.is_ascii_alphabetic())?;
    let (number, unit) = (text[..unit_at].trim(), &text[unit_at..]);
    let (_, length) = UNITS.into_iter().find(|(name, _)| *name == unit)?;
    let (whole, fraction) = number.split_once('.').unwrap_or((number, ""));
    let digits = |text: &str| text.len() <= 18 && text.bytes().all(|byte| byte.is_ascii_digit());
    if whole.is_empty() || !digits(whole) || !digits(fraction) {
        return None;
    }
    let scale = 10_u128.pow(fraction.len() as u32);
    let fraction = if fraction.is_empty() { "0" } else { fraction };
    let units = whole.parse::<u128>().ok()? * scale + fraction.parse::<u128>().ok()?;
    let nanoseconds = u64::try_from(units * length / scale).ok()?;
    let time = Duration::from_nanos(nanoseconds);
    (time <= Duration::from_secs(24 * 3600)).then_some(time)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check(text: &str, expected: Option<u64>) {
        let nanoseconds = parse_time(text).map(|time| time.as_nanos() as u64);
        assert_eq!(nanoseconds, expected, "{text}");
    }

    #[test]
    fn a_time_carries_its_unit() {
        check("10ms", Some(10_000_000));
        check("1.5 s", Some(1_500_000_000));
        check("0.2us", Some(200));
        check("7ns", Some(7));
        for text in [
            "",
            "10",
            "ms",
            "-1ms",
            "1e3ms",
            "1.2.3s",
            "10 MS",
            "1m",
            "99999999999999999999s",
            "99999999s",
            "½s",
            ".5s",
        ] {
            check(text, None);
        }
    }

    #[test]
    fn a_time_is_said_as_it_can_be_read() {
        for nanoseconds in [1, 999, 1_000, 10_000_000, 1_500_000_000, 60_000_000_000] {
            check(
                &written_time(Duration::from_nanos(nanoseconds)),
                Some(nanoseconds),
            );
        }
    }
}
