//! Durations, dates and times of day, in nanoseconds.

use understudy_typed::Elementary;

/// What a literal of time is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Moment {
    Duration,
    Date,
    TimeOfDay,
    DateAndTime,
}

impl Moment {
    pub(super) fn elementary(self) -> Elementary {
        match self {
            Self::Duration => Elementary::Time,
            Self::Date => Elementary::Date,
            Self::TimeOfDay => Elementary::TimeOfDay,
            Self::DateAndTime => Elementary::DateAndTime,
        }
    }
}

/// What a word in front of a `#` announces.
pub(super) fn kind(word: &str) -> Option<Moment> {
    Some(match word.to_ascii_uppercase().as_str() {
        "T" | "TIME" | "LT" | "LTIME" => Moment::Duration,
        "D" | "DATE" | "LD" | "LDATE" => Moment::Date,
        "TOD" | "TIME_OF_DAY" | "LTOD" | "LTIME_OF_DAY" => Moment::TimeOfDay,
        "DT" | "DATE_AND_TIME" | "LDT" | "LDATE_AND_TIME" | "DTL" => Moment::DateAndTime,
        _ => return None,
    })
}

/// The units in nanoseconds, the largest first.
const UNITS: [(&str, i128); 7] = [
    ("d", 86_400_000_000_000),
    ("h", 3_600_000_000_000),
    ("m", 60_000_000_000),
    ("s", 1_000_000_000),
    ("ms", 1_000_000),
    ("us", 1_000),
    ("ns", 1),
];

const DAY: i128 = UNITS[0].1;

/// Digits of a fraction that count; a nanosecond is 14 digits behind the point of a day.
const SIGNIFICANT_DIGITS: usize = 18;

/// Bytes at the start of `text` that belong to a value of this kind.
pub(super) fn length(kind: Moment, text: &str) -> usize {
    let bytes = text.as_bytes();
    let is_digit = |place: usize| bytes.get(place).is_some_and(u8::is_ascii_digit);
    let mut place = 0;
    if kind == Moment::Duration && text.starts_with(['-', '+']) {
        place = 1;
    }
    while let Some(byte) = bytes.get(place) {
        let belongs = match (kind, byte) {
            (_, b'0'..=b'9') => true,
            (_, b'.') => is_digit(place + 1),
            (Moment::Duration, b'_') => true,
            (Moment::Duration, next) if next.is_ascii_alphabetic() => true,
            // Some dialects have spaces between the parts.
            (Moment::Duration, b' ') => {
                let spaces = bytes[place..].iter().take_while(|next| **next == b' ').count();
                let next = place + spaces;
                if place > 0 && bytes[place - 1].is_ascii_alphabetic() && is_digit(next) {
                    place = next;
                    true
                } else {
                    false
                }
            }
            (Moment::Date | Moment::DateAndTime, b'-') => is_digit(place + 1),
            (Moment::TimeOfDay | Moment::DateAndTime, b':') => is_digit(place + 1),
            _ => false,
        };
        if !belongs {
            break;
        }
        place += 1;
    }
    place
}

/// The nanoseconds of a value, or what was expected of it.
pub(super) fn nanoseconds(kind: Moment, text: &str) -> Result<i64, &'static str> {
    let form = match kind {
        Moment::Duration => {
            "numbers with their units, the larger first, such as `1m30s` or `-2.5ms`"
        }
        Moment::Date => "a date such as `2026-11-23`",
        Moment::TimeOfDay => "a time of day such as `14:30:20.5`",
        Moment::DateAndTime => "a date and time such as `2026-11-23-14:30:20`",
    };
    let found = match kind {
        Moment::Duration => duration(text),
        Moment::Date => date(text),
        Moment::TimeOfDay => time_of_day(text),
        Moment::DateAndTime => {
            let split = text.match_indices('-').nth(2).map(|(place, _)| place);
            split.and_then(|place| Some(date(&text[..place])? + time_of_day(&text[place + 1..])?))
        }
    };
    let range = "a value of at most 2^63 nanoseconds, which are 292 years";
    i64::try_from(found.ok_or(form)?).map_err(|_| range)
}

/// Parts in descending units.
fn duration(text: &str) -> Option<i128> {
    let plain = text.replace(['_', ' '], "").to_ascii_lowercase();
    let (negative, plain) = match plain.strip_prefix('-') {
        Some(rest) => (true, rest),
        None => (false, plain.strip_prefix('+').unwrap_or(&plain)),
    };
    let mut rest = plain;
    let mut total: i128 = 0;
    let mut next_unit = 0;
    while !rest.is_empty() || next_unit == 0 {
        let number = rest.find(|next: char| !next.is_ascii_digit() && next != '.')?;
        let (number, behind) = rest.split_at(number);
        let word = behind.find(|next: char| !next.is_ascii_alphabetic());
        let (word, behind) = behind.split_at(word.unwrap_or(behind.len()));
        let unit = UNITS.iter().position(|(unit, _)| *unit == word)?;
        if unit < next_unit {
            return None;
        }
        next_unit = unit + 1;
        total = total.saturating_add(scaled(number, UNITS[unit].1)?);
        rest = behind;
    }
    Some(if negative { -total } else { total })
}

/// A decimal number of units in nanoseconds, rounded down.
fn scaled(number: &str, unit: i128) -> Option<i128> {
    let (whole, fraction) = number.split_once('.').unwrap_or((number, "0"));
    let is_digits = |text: &str| !text.is_empty() && text.bytes().all(|byte| byte.is_ascii_digit());
    if !is_digits(whole) || !is_digits(fraction) {
        return None;
    }
    // Digits are the only content, so what cannot be parsed is too large.
    let whole = whole.parse::<i128>().unwrap_or(i128::MAX);
    let fraction = &fraction[..fraction.len().min(SIGNIFICANT_DIGITS)];
    let scale = 10_i128.pow(u32::try_from(fraction.len()).ok()?);
    let part = fraction.parse::<i128>().ok()? * unit / scale;
    Some(whole.saturating_mul(unit).saturating_add(part))
}

/// `2026-11-23`
fn date(text: &str) -> Option<i128> {
    let mut parts = text.split('-');
    let mut part = || parts.next().and_then(|part| part.parse::<u32>().ok());
    let (year, month, day) = (part()?, part()?, part()?);
    if parts.next().is_some() || year > 9999 || !(1..=12).contains(&month) {
        return None;
    }
    let is_leap = year % 4 == 0 && (year % 100 != 0 || year % 400 == 0);
    let days_of_month = match month {
        2 if is_leap => 29,
        2 => 28,
        4 | 6 | 9 | 11 => 30,
        _ => 31,
    };
    if !(1..=days_of_month).contains(&day) {
        return None;
    }
    Some(days(i64::from(year), i64::from(month), i64::from(day)) * DAY)
}

/// Days from 1970-01-01 in the Gregorian calendar. Years begin in March, so a leap day is the last of its year.
fn days(year: i64, month: i64, day: i64) -> i128 {
    let year = if month <= 2 { year - 1 } else { year };
    let era = year.div_euclid(400);
    let year_of_era = year.rem_euclid(400);
    let day_of_year = (153 * ((month + 9) % 12) + 2) / 5 + day - 1;
    let day_of_era = year_of_era * 365 + year_of_era / 4 - year_of_era / 100 + day_of_year;
    i128::from(era * 146_097 + day_of_era - 719_468)
}

/// The date of a number of days from 1970-01-01: year, month, day.
pub(crate) fn calendar(days: i64) -> (i64, i64, i64) {
    let days = days + 719_468;
    let era = days.div_euclid(146_097);
    let day_of_era = days.rem_euclid(146_097);
    let year_of_era =
        (day_of_era - day_of_era / 1_460 + day_of_era / 36_524 - day_of_era / 146_096) / 365;
    let day_of_year = day_of_era - (365 * year_of_era + year_of_era / 4 - year_of_era / 100);
    let shifted = (5 * day_of_year + 2) / 153;
    let day = day_of_year - (153 * shifted + 2) / 5 + 1;
    let month = if shifted < 10 { shifted + 3 } else { shifted - 9 };
    let year = year_of_era + era * 400 + i64::from(month <= 2);
    (year, month, day)
}

/// `14:30:20.5`; seconds may be left out.
fn time_of_day(text: &str) -> Option<i128> {
    let mut parts = text.split(':');
    let hours: i128 = parts.next()?.parse().ok()?;
    let minutes: i128 = parts.next()?.parse().ok()?;
    let seconds = scaled(parts.next().unwrap_or("0"), UNITS[3].1)?;
    let is_valid = (0..24).contains(&hours)
        && (0..60).contains(&minutes)
        && seconds < UNITS[2].1
        && parts.next().is_none();
    is_valid.then(|| hours * UNITS[1].1 + minutes * UNITS[2].1 + seconds)
}
