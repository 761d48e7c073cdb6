//! Numbers as they are written, and read back.
//!
//! | type | form |
//! |---|---|
//! | BOOL | `TRUE`, `FALSE` |
//! | integers, bit strings | decimal |
//! | REAL, LREAL | the shortest form that reads back to the same: `1.5`, `1.0E21`; `INF`, `-INF`, `NAN` |
//! | TIME | `T#1d2h3m4s5ms6us7ns` without the parts that are 0; `T#-1s`, `T#0s` |
//! | DATE | `D#2024-02-29` |
//! | TIME_OF_DAY | `TOD#12:34:56.5` |
//! | DATE_AND_TIME | `DT#2024-02-29-12:34:56.5` |

use crate::operation::real::Float;
use crate::types::Elementary;

const SECOND: i64 = 1_000_000_000;
/// Nanoseconds of a day.
pub(crate) const DAY: i64 = 86_400 * SECOND;

/// Parts of a duration: the unit and its nanoseconds.
const UNITS: [(&str, i64); 7] = [
    ("d", DAY),
    ("h", 3_600 * SECOND),
    ("m", 60 * SECOND),
    ("s", SECOND),
    ("ms", 1_000_000),
    ("us", 1_000),
    ("ns", 1),
];

/// A stored value as it is written.
pub(crate) fn write(of: Elementary, stored: u64) -> String {
    match of {
        Elementary::Bool => if stored == 0 { "FALSE" } else { "TRUE" }.to_owned(),
        Elementary::Real => write_real(&format!("{:?}", f32::unpack(stored))),
        Elementary::Lreal => write_real(&format!("{:?}", f64::unpack(stored))),
        Elementary::Time => write_duration(stored as i64),
        Elementary::Date => format!("D#{}", write_date(stored as i64)),
        Elementary::TimeOfDay => format!("TOD#{}", write_time_of_day(stored as i64)),
        Elementary::DateAndTime => {
            let moment = stored as i64;
            let time = write_time_of_day(moment.rem_euclid(DAY));
            format!("DT#{}-{time}", write_date(moment))
        }
        _ => of.signed(stored).to_string(),
    }
}

/// Appends a stored value as it is written.
pub(crate) fn append(of: Elementary, stored: u64, text: &mut Vec<u8>) {
    text.extend_from_slice(write(of, stored).as_bytes());
}

/// From the form that Rust writes, `1e21`, to that of IEC 61131-3, `1.0E21`.
fn write_real(debug: &str) -> String {
    match debug.split_once('e') {
        Some((mantissa, exponent)) if mantissa.contains('.') => format!("{mantissa}E{exponent}"),
        Some((mantissa, exponent)) => format!("{mantissa}.0E{exponent}"),
        None => debug.to_ascii_uppercase(),
    }
}

fn write_duration(nanoseconds: i64) -> String {
    let mut text = String::from(if nanoseconds < 0 { "T#-" } else { "T#" });
    let mut rest = nanoseconds.unsigned_abs();
    for (unit, size) in UNITS {
        let count = rest / size.unsigned_abs();
        rest %= size.unsigned_abs();
        if count > 0 {
            text.push_str(&format!("{count}{unit}"));
        }
    }
    if nanoseconds == 0 {
        text.push_str("0s");
    }
    text
}

/// Year, month and day of the proleptic Gregorian calendar.
fn write_date(moment: i64) -> String {
    // Days since 0000-03-01, in eras of 400 years.
    let days = moment.div_euclid(DAY) + 719_468;
    let era = days.div_euclid(146_097);
    let day_of_era = days.rem_euclid(146_097);
    let year_of_era =
        (day_of_era - day_of_era / 1_460 + day_of_era / 36_524 - day_of_era / 146_096) / 365;
    let day_of_year = day_of_era - (365 * year_of_era + year_of_era / 4 - year_of_era / 100);
    let shifted = (5 * day_of_year + 2) / 153;
    let day = day_of_year - (153 * shifted + 2) / 5 + 1;
    let month = if shifted < 10 { shifted + 3 } else { shifted - 9 };
    let year = era * 400 + year_of_era + i64::from(month <= 2);
    format!("{year:04}-{month:02}-{day:02}")
}

fn write_time_of_day(nanoseconds: i64) -> String {
    let (seconds, fraction) = (nanoseconds.div_euclid(SECOND), nanoseconds.rem_euclid(SECOND));
    let (hours, minutes) = (seconds.div_euclid(3_600), seconds.rem_euclid(3_600) / 60);
    let mut text = format!("{hours:02}:{minutes:02}:{:02}", seconds.rem_euclid(60));
    if fraction > 0 {
        let digits = format!("{fraction:09}");
        text.push('.');
        text.push_str(digits.trim_end_matches('0'));
    }
    text
}

/// A stored value as it is read from the start of a text, blanks before it left out; 0 where there is none. A whole number
/// beyond its type is the nearest one of the type.
pub(crate) fn read(of: Elementary, text: &[u8]) -> u64 {
    let text = text.trim_ascii_start();
    // What stands behind the first byte that is no ASCII is not of a number.
    let end = text.iter().position(|byte| !byte.is_ascii());
    let text = String::from_utf8_lossy(&text[..end.unwrap_or(text.len())]);
    let text = text.to_ascii_uppercase();
    match of {
        Elementary::Bool => u64::from(text.starts_with("TRUE") || read_integer(&text) != 0),
        Elementary::Real => read_real(&text).parse().unwrap_or(0.0_f32).pack(),
        Elementary::Lreal => read_real(&text).parse().unwrap_or(0.0_f64).pack(),
        Elementary::Time => read_duration(&text) as u64,
        Elementary::Date => read_date(behind_hash(&text)).0 as u64,
        Elementary::TimeOfDay => read_time_of_day(behind_hash(&text)) as u64,
        Elementary::DateAndTime => {
            let (date, rest) = read_date(behind_hash(&text));
            let time = read_time_of_day(rest.strip_prefix('-').unwrap_or(""));
            date.wrapping_add(time) as u64
        }
        _ => {
            let (least, most) = of.limits();
            read_integer(&text).clamp(least, most) as u64 & of.mask()
        }
    }
}

/// What stands behind the prefix, `DT#`.
fn behind_hash(text: &str) -> &str {
    text.split_once('#').map_or(text, |(_, rest)| rest)
}

/// Digits at the start of a text as a number, which wraps, how many they are, and what follows.
fn read_digits(text: &str) -> (u64, usize, &str) {
    let end = text.find(|c: char| !c.is_ascii_digit());
    let (digits, rest) = text.split_at(end.unwrap_or(text.len()));
    let number = digits
        .bytes()
        .fold(0_u64, |number, digit| number.wrapping_mul(10).wrapping_add(u64::from(digit - b'0')));
    (number, digits.len(), rest)
}

/// A whole number at the start of a text, as a literal has it: decimal, or behind `2#`, `8#` or `16#`. More than 64 bits are
/// the largest number.
fn read_integer(text: &str) -> i128 {
    let (is_negative, rest) = read_sign(text);
    let based = [("2#", 2), ("8#", 8), ("16#", 16)];
    let based =
        based.into_iter().find_map(|(prefix, base)| Some((rest.strip_prefix(prefix)?, base)));
    let (digits, base) = based.unwrap_or((rest, 10));
    let mut number = 0_i128;
    let digits = digits.chars().map_while(|digit| digit.to_digit(base));
    for digit in digits {
        number = (number * i128::from(base) + i128::from(digit)).min(i128::from(u64::MAX));
    }
    if is_negative { -number } else { number }
}

fn read_sign(text: &str) -> (bool, &str) {
    match text.strip_prefix('-') {
        Some(rest) => (true, rest),
        None => (false, text.strip_prefix('+').unwrap_or(text)),
    }
}

/// The longest start of a text that is a real.
fn read_real(text: &str) -> &str {
    let (_, rest) = read_sign(text);
    let sign = text.len() - rest.len();
    if rest.starts_with("INF") || rest.starts_with("NAN") {
        return &text[..sign + 3];
    }
    let digits = |from: usize| {
        let rest = &text[from..];
        from + rest.find(|c: char| !c.is_ascii_digit()).unwrap_or(rest.len())
    };
    let mut end = digits(sign);
    if text[end..].starts_with('.') {
        end = digits(end + 1);
    }
    if text[end..].starts_with('E') {
        let (_, behind) = read_sign(&text[end + 1..]);
        let from = text.len() - behind.len();
        let exponent = digits(from);
        if exponent > from {
            end = exponent;
        }
    }
    &text[..end]
}

/// The nanoseconds of a literal of TIME, `T#1s500ms`, whose word may be left out: units from the largest to the smallest, each once, the last one
/// with a fraction; nothing for another text and for a time that has no value.
pub(crate) fn duration(text: &str) -> Option<i64> {
    let text = text.to_ascii_uppercase();
    let bare = match text.split_once('#') {
        Some(("T" | "TIME" | "LT" | "LTIME", bare)) => bare,
        Some(_) => return None,
        None => &text,
    };
    let (is_negative, mut rest) = read_sign(bare);
    let (mut sum, mut last, mut is_last) = (0_i128, i64::MAX, false);
    while !rest.is_empty() {
        let end = rest.find(|letter: char| letter.is_ascii_alphabetic())?;
        let (number, behind) = rest.split_at(end);
        let end = behind.find(|letter: char| !letter.is_ascii_alphabetic());
        let (unit, behind) = behind.split_at(end.unwrap_or(behind.len()));
        let (_, size) = UNITS.into_iter().find(|(known, _)| unit.eq_ignore_ascii_case(known))?;
        let (whole, fraction) = number.split_once('.').unwrap_or((number, ""));
        let are_digits = |digits: &str| digits.bytes().all(|digit| digit.is_ascii_digit());
        if is_last
            || size >= last
            || whole.is_empty()
            || !are_digits(whole)
            || !are_digits(fraction)
        {
            return None;
        }
        sum += whole.parse::<i64>().ok().map(i128::from)? * i128::from(size);
        let mut part = i128::from(size);
        for digit in fraction.bytes() {
            // What is below a nanosecond is left out.
            sum += part * i128::from(digit - b'0') / 10;
            part /= 10;
        }
        (last, is_last) = (size, number.contains('.'));
        rest = behind.trim_start_matches('_');
    }
    let is_empty = last == i64::MAX;
    i64::try_from(if is_negative { -sum } else { sum }).ok().filter(|_| !is_empty)
}

fn read_duration(text: &str) -> i64 {
    let (is_negative, mut rest) = read_sign(behind_hash(text));
    let mut sum = 0_i64;
    loop {
        let (count, digits, behind) = read_digits(rest);
        // Of `MS` and `M` the longer one.
        let unit = UNITS
            .iter()
            .filter(|(unit, _)| behind.starts_with(&unit.to_ascii_uppercase()))
            .max_by_key(|(unit, _)| unit.len());
        let (Some((unit, size)), 1..) = (unit, digits) else {
            break;
        };
        sum = sum.wrapping_add((count as i64).wrapping_mul(*size));
        rest = behind[unit.len()..].trim_start_matches('_');
    }
    if is_negative { sum.wrapping_neg() } else { sum }
}

/// The moment of a date, and what follows it.
fn read_date(text: &str) -> (i64, &str) {
    let (is_negative, text) = read_sign(text);
    let (year, _, rest) = read_digits(text);
    let Some((month, _, rest)) = rest.strip_prefix('-').map(read_digits) else {
        return (0, "");
    };
    let Some((day, 1.., rest)) = rest.strip_prefix('-').map(read_digits) else {
        return (0, "");
    };
    if !(1..=12).contains(&month) || !(1..=31).contains(&day) || year > 9_999 {
        return (0, rest);
    }
    let (year, month, day) = (year as i64, month as i64, day as i64);
    let year = if is_negative { -year } else { year };
    let year = if month <= 2 { year - 1 } else { year };
    let shifted = (month + 9) % 12;
    let year_of_era = year.rem_euclid(400);
    let day_of_era =
        year_of_era * 365 + year_of_era / 4 - year_of_era / 100 + (153 * shifted + 2) / 5 + day - 1;
    let days = year.div_euclid(400) * 146_097 + day_of_era - 719_468;
    (days.wrapping_mul(DAY), rest)
}

fn read_time_of_day(text: &str) -> i64 {
    let (hours, _, rest) = read_digits(text);
    let (minutes, _, rest) = read_digits(rest.strip_prefix(':').unwrap_or(""));
    let (seconds, _, rest) = read_digits(rest.strip_prefix(':').unwrap_or(""));
    let fraction: String = rest
        .strip_prefix('.')
        .unwrap_or("")
        .chars()
        .take_while(char::is_ascii_digit)
        .chain("000000000".chars())
        .take(9)
        .collect();
    let seconds = (hours as i64)
        .wrapping_mul(3_600)
        .wrapping_add((minutes as i64).wrapping_mul(60))
        .wrapping_add(seconds as i64);
    seconds.wrapping_mul(SECOND).wrapping_add(fraction.parse().unwrap_or(0))
}
