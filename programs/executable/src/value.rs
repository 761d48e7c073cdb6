//! Values of points as people write them: in cluster files, scenarios, commands and properties.

use std::time::Duration;

use understudy_text::duration;
use understudy_text::tables::Constant;
use understudy_typed::{Declared, Elementary};

/// Values of an enumeration that a message names.
const MOST_NAMES: usize = 8;

/// How Structured Text begins a duration, in small letters.
const TIME_LITERAL: &[&str] = &["t#", "time#", "lt#", "ltime#"];

/// The value of a signal as a person types it, such as `true`, `12.5`, `1.5 s`, `T#1s500ms` or `Auto`, as the process image stores it.
///
/// # Errors
/// What is written instead for a signal that is declared so.
pub fn typed_value(text: &str, declared: &Declared) -> Result<u64, String> {
    let of = declared.of;
    let word = text.to_ascii_lowercase();
    let literal = if of == Elementary::Time { TIME_LITERAL } else { &[] };
    let literal = literal.iter().find_map(|sign| word.strip_prefix(sign));
    let text = literal.unwrap_or(text);
    let other = || Constant::Text(text.to_owned());
    let value = match (of, word.as_str()) {
        (Elementary::Bool, "true" | "1") => Constant::Flag(true),
        (Elementary::Bool, "false" | "0") => Constant::Flag(false),
        (Elementary::Bool, _) => other(),
        _ if of.is_time() => other(),
        _ if of.is_real() => text.parse().map_or_else(|_| other(), Constant::Number),
        // A file has no whole numbers beyond 63 bits.
        _ => match whole(&word) {
            Some(number) => return stored_number(number, declared),
            None => other(),
        },
    };
    stored_value(&value, declared)
}

/// A whole number, in decimal digits or behind `16#`, `8#` or `2#`.
fn whole(word: &str) -> Option<i128> {
    let (base, digits) = match word.split_once('#') {
        Some((base, digits)) => {
            (base.parse().ok().filter(|base| [2, 8, 16].contains(base))?, digits)
        }
        None => (10, word),
    };
    i128::from_str_radix(digits, base)
        .ok()
        .filter(|_| base == 10 || !digits.starts_with(['-', '+']))
}

/// A stored value as a file writes it, the inverse of [`stored_value`].
pub fn value_text(declared: &Declared, stored: u64) -> String {
    let of = declared.of;
    match of {
        Elementary::Bool => (stored != 0).to_string(),
        Elementary::Real => format!("{:?}", f32::from_bits(stored as u32)),
        Elementary::Lreal => format!("{:?}", f64::from_bits(stored)),
        Elementary::Time => {
            let sign = if (stored as i64) < 0 { "-" } else { "" };
            let time = Duration::from_nanos((stored as i64).unsigned_abs());
            format!("\"{sign}{}\"", duration::text(time))
        }
        _ if of.is_time() => {
            let text = of.text(stored);
            format!("\"{}\"", text.split_once('#').map_or(text.as_str(), |(_, moment)| moment))
        }
        _ => match declared.value_name(stored) {
            Some(name) => format!("\"{name}\""),
            None => of.signed(stored).to_string(),
        },
    }
}

/// The value as a signal that is declared so stores it.
///
/// # Errors
/// What is written instead for that declaration.
pub fn stored_value(value: &Constant, declared: &Declared) -> Result<u64, String> {
    let of = declared.of;
    let real = |number: f64| match of {
        Elementary::Real => {
            let number = number as f32;
            number.is_finite().then_some(u64::from(number.to_bits()))
        }
        _ => Some(number.to_bits()),
    };
    let found = match (of, value) {
        (Elementary::Bool, Constant::Flag(bit)) => Some(u64::from(*bit)),
        (_, Constant::Whole(number)) if of.is_real() => real(*number as f64),
        (_, Constant::Number(number)) if of.is_real() && number.is_finite() => real(*number),
        (Elementary::Time, Constant::Text(text)) => {
            let negative = text.trim_start().strip_prefix('-');
            let time = understudy_text::duration::parse(negative.unwrap_or(text)).ok();
            let time = time.and_then(|time| i64::try_from(time.as_nanos()).ok());
            time.map(|time| if negative.is_some() { -time } else { time } as u64)
        }
        (_, Constant::Text(text)) if of.is_time() => of.moment(text),
        (_, Constant::Text(text)) => declared.value_named(text),
        (Elementary::Bool, _) => None,
        (_, Constant::Whole(number)) if !of.is_time() => {
            return stored_number(i128::from(*number), declared);
        }
        _ => None,
    };
    found.ok_or_else(|| expected(declared))
}

/// A whole number as a signal that is declared so stores it.
fn stored_number(number: i128, declared: &Declared) -> Result<u64, String> {
    let (least, most) = declared.range.unwrap_or_else(|| declared.of.limits());
    let stored = number as u64 & declared.of.mask();
    let is_named = declared.values.is_none() || declared.value_name(stored).is_some();
    let is_one = (least..=most).contains(&number) && is_named;
    is_one.then_some(stored).ok_or_else(|| expected(declared))
}

/// What is written for a value that is declared so.
fn expected(declared: &Declared) -> String {
    let example = match declared.of {
        Elementary::Bool => "`true` or `false`",
        Elementary::Time => "a duration, such as \"1.5 s\" or \"-20ms\"",
        Elementary::Date => "a date, such as \"2024-02-29\"",
        Elementary::TimeOfDay => "a time of day, such as \"12:34:56\"",
        Elementary::DateAndTime => "a date and a time, such as \"2024-02-29-12:34:56\"",
        of if of.is_real() => "a finite number, such as 12.5",
        of => match &declared.values {
            Some(known) => {
                let names = known.values.iter().take(MOST_NAMES).map(|(name, _)| name.as_str());
                let more = if known.values.len() > MOST_NAMES { ", …" } else { "" };
                return format!("write one of {}{more}", names.collect::<Vec<_>>().join(", "));
            }
            None => {
                let (least, most) = declared.range.unwrap_or_else(|| of.limits());
                return format!("write a whole number from {least} to {most}");
            }
        },
    };
    format!("write {example}")
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use understudy_typed::Enumeration;

    use super::*;

    #[test]
    fn whole_numbers_have_all_values_of_their_type() {
        for (text, of, stored) in [
            ("18446744073709551615", Elementary::Ulint, Some(u64::MAX)),
            ("-9223372036854775808", Elementary::Lint, Some(1 << 63)),
            ("16#ff", Elementary::Word, Some(255)),
            ("16#FFFF_FFFF", Elementary::Dword, None),
            ("2#101", Elementary::Int, Some(5)),
            ("16#-1", Elementary::Int, None),
            ("3#1", Elementary::Int, None),
            ("65536", Elementary::Word, None),
            ("-1", Elementary::Uint, None),
            ("1", Elementary::Bool, Some(1)),
            ("2", Elementary::Bool, None),
        ] {
            assert_eq!(typed_value(text, &of.into()).ok(), stored, "{text}");
        }
    }

    /// What is shown of a duration is taken as it is shown, below 0 too.
    #[test]
    fn a_duration_is_read_as_it_is_written() {
        for nanoseconds in [0, 1, 20_000_000, 1_500_000_000, 3_600_000_000_000] {
            for stored in [nanoseconds, -nanoseconds].map(|signed: i64| signed as u64) {
                let text = value_text(&Elementary::Time.into(), stored);
                let bare = text.trim_matches('"');
                assert_eq!(typed_value(bare, &Elementary::Time.into()), Ok(stored), "{bare}");
            }
        }
        for wrong in ["-", "--1s", "1.5", "-1", "1s-", ""] {
            assert!(typed_value(wrong, &Elementary::Time.into()).is_err(), "{wrong}");
        }
    }

    #[test]
    fn a_moment_is_read_as_it_is_written() {
        for (of, texts) in [
            (Elementary::Date, ["2024-02-29", "D#1970-01-01", "DATE#1999-12-31"]),
            (Elementary::TimeOfDay, ["12:34:56.5", "TOD#00:00:00", "time_of_day#23:59:59"]),
            (
                Elementary::DateAndTime,
                [
                    "2024-02-29-12:34:56.5",
                    "DT#1970-01-01-00:00:00",
                    "date_and_time#2000-01-01-00:00:01",
                ],
            ),
        ] {
            let declared = of.into();
            for text in texts {
                let stored = typed_value(text, &declared).expect(text);
                let bare = value_text(&declared, stored);
                assert!(text.ends_with(bare.trim_matches('"')), "{text} {bare}");
                assert_eq!(typed_value(bare.trim_matches('"'), &declared), Ok(stored), "{text}");
            }
            for wrong in ["", "0", "2024-02-30", "24:00:00", "2024-2-9", "T#1s", "D#", "12:34"] {
                assert!(typed_value(wrong, &declared).is_err(), "{of} {wrong}");
            }
        }
    }

    #[test]
    fn a_value_of_an_enumeration_has_its_name() {
        let values = vec![("Off".to_owned(), 0), ("Auto".to_owned(), 5), ("Fault".to_owned(), -1)];
        let known = Enumeration { name: "Mode".to_owned(), values };
        let mode = Declared { values: Some(Arc::new(known)), ..Elementary::Int.into() };
        for (text, stored) in [
            ("Auto", Some(5)),
            ("auto", Some(5)),
            ("MODE#Off", Some(0)),
            ("fault", Some(0xffff)),
            ("5", Some(5)),
            ("-1", Some(0xffff)),
            ("3", None),
            ("Other#Off", None),
            ("Mode#", None),
            ("", None),
            ("70000", None),
        ] {
            assert_eq!(typed_value(text, &mode).ok(), stored, "{text}");
        }
        assert_eq!(value_text(&mode, 0xffff), "\"Fault\"");
        assert_eq!(value_text(&mode, 3), "3");
        assert_eq!(typed_value("Of", &mode), Err("write one of Off, Auto, Fault".to_owned()));
    }
}
