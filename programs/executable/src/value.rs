//! Values of points as people write them: in cluster files, scenarios, commands and properties.

use std::time::Duration;

use understudy_text::duration;
use understudy_text::tables::Constant;
use understudy_typed::Elementary;

/// How Structured Text begins a duration, in small letters.
const TIME_LITERAL: &[&str] = &["t#", "time#"];

/// The value of a signal as a person types it, such as `true`, `12.5`, `1.5 s` or `T#1s500ms`, as the process image stores it.
///
/// # Errors
/// What is written instead for a signal of that type.
pub fn typed_value(text: &str, of: Elementary) -> Result<u64, String> {
    let word = text.to_ascii_lowercase();
    let literal = if of.is_time() { TIME_LITERAL } else { &[] };
    let literal = literal.iter().find_map(|sign| word.strip_prefix(sign));
    let text = literal.unwrap_or(text);
    if !of.is_real()
        && !of.is_time()
        && let Some(number) = whole(&word)
    {
        let stored = number as u64 & of.mask();
        return match of {
            Elementary::Bool if number <= 1 => Ok(number as u64),
            _ if of != Elementary::Bool && of.signed(stored) == number => Ok(stored),
            _ => stored_value(&Constant::Text(text.to_owned()), of),
        };
    }
    let value = match (of, word.as_str()) {
        (Elementary::Bool, "true") => Constant::Flag(true),
        (Elementary::Bool, "false") => Constant::Flag(false),
        _ => match (text.parse(), text.parse()) {
            (Ok(whole), _) => Constant::Whole(whole),
            (_, Ok(number)) => Constant::Number(number),
            _ => Constant::Text(text.to_owned()),
        },
    };
    stored_value(&value, of)
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
pub fn value_text(of: Elementary, stored: u64) -> String {
    match of {
        Elementary::Bool => (stored != 0).to_string(),
        Elementary::Real => format!("{:?}", f32::from_bits(stored as u32)),
        Elementary::Lreal => format!("{:?}", f64::from_bits(stored)),
        _ if of.is_time() => {
            let sign = if (stored as i64) < 0 { "-" } else { "" };
            let time = Duration::from_nanos((stored as i64).unsigned_abs());
            format!("\"{sign}{}\"", duration::text(time))
        }
        _ => of.signed(stored).to_string(),
    }
}

/// The value as a signal of that type stores it.
///
/// # Errors
/// What is written instead for that type.
pub fn stored_value(value: &Constant, of: Elementary) -> Result<u64, String> {
    let whole = |number: i64| {
        let stored = number as u64 & of.mask();
        (of.signed(stored) == i128::from(number)).then_some(stored)
    };
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
        (Elementary::Bool, _) => None,
        (_, Constant::Whole(number)) if !of.is_time() => whole(*number),
        _ => None,
    };
    found.ok_or_else(|| match of {
        Elementary::Bool => "write `true` or `false`".to_owned(),
        Elementary::Time => "write a duration, such as \"1.5 s\" or \"-20ms\"".to_owned(),
        _ if of.is_real() => "write a finite number, such as 12.5".to_owned(),
        _ if of.is_time() => "dates have no value here".to_owned(),
        _ => whole_number(of.limits()),
    })
}

/// What is written for a whole number between two others.
pub fn whole_number((least, most): (i128, i128)) -> String {
    format!("write a whole number from {least} to {most}")
}

#[cfg(test)]
mod tests {
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
            assert_eq!(typed_value(text, of).ok(), stored, "{text}");
        }
    }

    /// What is shown of a duration is taken as it is shown, below 0 too.
    #[test]
    fn a_duration_is_read_as_it_is_written() {
        for nanoseconds in [0, 1, 20_000_000, 1_500_000_000, 3_600_000_000_000] {
            for stored in [nanoseconds, -nanoseconds].map(|signed: i64| signed as u64) {
                let text = value_text(Elementary::Time, stored);
                let bare = text.trim_matches('"');
                assert_eq!(typed_value(bare, Elementary::Time), Ok(stored), "{bare}");
            }
        }
        for wrong in ["-", "--1s", "1.5", "-1", "1s-", ""] {
            assert!(typed_value(wrong, Elementary::Time).is_err(), "{wrong}");
        }
    }
}
