//! Literals of IEC 61131-3: truth values, whole numbers, times.

use std::time::Duration;

use understudy_ladder::MAXIMUM_PRESET_TIME;

/// `TRUE`, `FALSE`, `1`, `0`, `BOOL#1`, in any case.
pub(crate) fn boolean(text: &str) -> Option<bool> {
    let bare = strip_prefix(text.trim(), "BOOL#");
    match bare.to_ascii_uppercase().as_str() {
        "TRUE" | "1" => Some(true),
        "FALSE" | "0" => Some(false),
        _ => None,
    }
}

/// A whole number: `5`, `INT#5`, `16#1F`, `2#1010`, `1_000`.
pub(crate) fn integer(text: &str) -> Option<i64> {
    const TYPES: [&str; 8] = [
        "SINT", "INT", "DINT", "LINT", "USINT", "UINT", "UDINT", "ULINT",
    ];
    let text = text.trim();
    let bare = match text.split_once('#') {
        Some((name, rest)) if TYPES.contains(&name.to_ascii_uppercase().as_str()) => rest,
        _ => text,
    };
    let (negative, bare) = match bare.strip_prefix('-') {
        Some(rest) => (true, rest),
        None => (false, bare.strip_prefix('+').unwrap_or(bare)),
    };
    let (base, digits) = match bare.split_once('#') {
        Some((base @ ("2" | "8" | "16"), digits)) => (base.parse().ok()?, digits),
        Some(_) => return None,
        None => (10, bare),
    };
    if digits.starts_with(['+', '-', '_']) {
        return None;
    }
    let value = i64::from_str_radix(&digits.replace('_', ""), base).ok()?;
    Some(if negative { -value } else { value })
}

/// `T#1m30s`, `TIME#1.5s`, `t#250ms`: at most the longest preset.
pub(crate) fn time(text: &str) -> Option<Duration> {
    const UNITS: [(&str, u64); 7] = [
        ("d", 86_400_000_000_000),
        ("h", 3_600_000_000_000),
        ("m", 60_000_000_000),
        ("s", 1_000_000_000),
        ("ms", 1_000_000),
        ("us", 1_000),
        ("ns", 1),
    ];
    let text = text.trim();
    let rest = strip_prefix(strip_prefix(strip_prefix(text, "TIME#"), "T#"), "LTIME#");
    if rest.len() == text.len() || rest.is_empty() {
        return None;
    }
    let mut rest = rest.replace('_', "").to_ascii_lowercase();
    let mut nanoseconds: u64 = 0;
    let mut last = None;
    while !rest.is_empty() {
        let end = rest.find(|letter: char| letter.is_ascii_alphabetic())?;
        let (number, behind) = rest.split_at(end);
        let stop = behind
            .find(|letter: char| !letter.is_ascii_alphabetic())
            .unwrap_or(behind.len());
        let place = UNITS
            .iter()
            .position(|(unit, _)| *unit == &behind[..stop])?;
        if last.is_some_and(|last| last >= place) {
            return None;
        }
        last = Some(place);
        nanoseconds = nanoseconds.checked_add(scaled(number, UNITS[place].1)?)?;
        rest = behind[stop..].to_owned();
    }
    let time = Duration::from_nanos(nanoseconds);
    (time <= MAXIMUM_PRESET_TIME).then_some(time)
}

/// A decimal number of units in nanoseconds, exactly.
fn scaled(number: &str, unit: u64) -> Option<u64> {
    let (whole, part) = number.split_once('.').unwrap_or((number, ""));
    let digits = |text: &str| text.bytes().all(|byte| byte.is_ascii_digit());
    if whole.is_empty() || part.len() > 9 || !digits(whole) || !digits(part) {
        return None;
    }
    let whole = whole.parse::<u64>().ok()?.checked_mul(unit)?;
    let scale = 10_u64.pow(u32::try_from(part.len()).ok()?);
    let part = if part.is_empty() {
        0
    } else {
        part.parse::<u64>().ok()?
    };
    whole.checked_add(u64::try_from(u128::from(part) * u128::from(unit) / u128::from(scale)).ok()?)
}

fn strip_prefix<'a>(text: &'a str, prefix: &str) -> &'a str {
    match text.get(..prefix.len()) {
        Some(start) if start.eq_ignore_ascii_case(prefix) => &text[prefix.len()..],
        _ => text,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn literals_are_those_of_the_standard() {
        let times = [
            ("T#5s", Some(5_000_000)),
            ("TIME#1m30s", Some(90_000_000)),
            ("t#1.5s", Some(1_500_000)),
            ("T#1h_0m_1s", Some(3_601_000_000)),
            (" T#2s", Some(2_000_000)),
            ("T#20ms", Some(20_000)),
            ("T#", None),
            ("5s", None),
            ("T#5", None),
            ("T#1s1h", None),
            ("T#99999999999d", None),
            ("T#-1s", None),
        ];
        for (text, microseconds) in times {
            assert_eq!(
                time(text),
                microseconds.map(Duration::from_micros),
                "{text}"
            );
        }
        let integers = [
            ("5", Some(5)),
            ("-7", Some(-7)),
            ("INT#16#1F", Some(31)),
            ("2#1010", Some(10)),
            ("1_000", Some(1000)),
            ("1.5", None),
            ("", None),
            ("3#1", None),
            ("--1", None),
        ];
        for (text, value) in integers {
            assert_eq!(integer(text), value, "{text}");
        }
        assert_eq!(boolean("bool#true"), Some(true));
        assert_eq!(boolean("0"), Some(false));
        assert_eq!(boolean("a"), None);
    }
}
