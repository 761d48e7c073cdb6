//! The kinds of values of the schema.

/// Whether `text` is of `kind`; what it should be where it is not.
pub(super) fn check(kind: &str, text: &str) -> Result<(), String> {
    if let Some(words) = kind
        .strip_prefix('{')
        .and_then(|rest| rest.strip_suffix('}'))
    {
        return if words.split(',').any(|word| word == text) {
            Ok(())
        } else {
            Err(format!("one of {}", words.replace(',', ", ")))
        };
    }
    let trimmed = text.trim();
    let (right, what) = match kind {
        "boolean" => (
            matches!(trimmed, "true" | "false" | "1" | "0"),
            "true or false",
        ),
        "decimal" => (is_decimal(trimmed), "a decimal number"),
        "unsignedLong" => (
            trimmed.trim_start_matches('+').parse::<u64>().is_ok(),
            "a whole number of 64 bits without a sign",
        ),
        "long" => (trimmed.parse::<i64>().is_ok(), "a whole number of 64 bits"),
        "dateTime" => (
            is_date_time(trimmed),
            "a date and time such as 2026-01-31T12:00:00",
        ),
        "ID" => (is_identifier(trimmed), "an XML name"),
        "language" => (is_language(trimmed), "a language such as en or en-US"),
        _ => match kind
            .strip_prefix("integer[")
            .and_then(|rest| rest.strip_suffix(']'))
        {
            Some(range) => (in_range(range, trimmed), "a whole number within the bounds"),
            None => (true, "text"),
        },
    };
    if right { Ok(()) } else { Err(what.to_owned()) }
}

fn in_range(range: &str, text: &str) -> bool {
    let Ok(value) = text.parse::<i64>() else {
        return false;
    };
    range.split_once("..").is_some_and(|(low, high)| {
        low.parse().is_ok_and(|low: i64| low <= value)
            && high.parse().is_ok_and(|high: i64| value <= high)
    })
}

fn digits(text: &str) -> bool {
    text.bytes().all(|byte| byte.is_ascii_digit())
}

fn is_decimal(text: &str) -> bool {
    let unsigned = text.strip_prefix(['+', '-']).unwrap_or(text);
    let (whole, part) = unsigned.split_once('.').unwrap_or((unsigned, ""));
    digits(whole) && digits(part) && !(whole.is_empty() && part.is_empty())
}

fn number(text: &str, length: usize, least: u32, most: u32) -> bool {
    text.len() == length
        && digits(text)
        && text
            .parse()
            .is_ok_and(|value: u32| (least..=most).contains(&value))
}

/// `-?YYYY-MM-DDThh:mm:ss(.f+)?(Z|±hh:mm)?`, as XML Schema has it.
fn is_date_time(text: &str) -> bool {
    let Some((date, time)) = text.split_once('T') else {
        return false;
    };
    let date: Vec<&str> = date.strip_prefix('-').unwrap_or(date).split('-').collect();
    let [year, month, day] = date.as_slice() else {
        return false;
    };
    let (time, zone) = match time.find(['Z', '+', '-']) {
        Some(place) => time.split_at(place),
        None => (time, ""),
    };
    let (clock, fraction) = time.split_once('.').unwrap_or((time, "0"));
    let clock: Vec<&str> = clock.split(':').collect();
    let [hours, minutes, seconds] = clock.as_slice() else {
        return false;
    };
    let zone_right = match zone {
        "" | "Z" => true,
        _ => zone[1..]
            .split_once(':')
            .is_some_and(|(hours, minutes)| number(hours, 2, 0, 14) && number(minutes, 2, 0, 59)),
    };
    let year_right = year.len() >= 4 && digits(year) && !year.bytes().all(|byte| byte == b'0');
    let month_right = number(month, 2, 1, 12);
    let length = match month.parse() {
        Ok(4_u32 | 6 | 9 | 11) => 30,
        Ok(2) if is_leap(year) => 29,
        Ok(2) => 28,
        _ => 31,
    };
    let midnight = *hours == "24" && *minutes == "00" && *seconds == "00";
    year_right
        && month_right
        && number(day, 2, 1, length)
        && (midnight || number(hours, 2, 0, 23))
        && number(minutes, 2, 0, 59)
        && number(seconds, 2, 0, 59)
        && !fraction.is_empty()
        && digits(fraction)
        && zone_right
}

fn is_leap(year: &str) -> bool {
    let year: u64 = year.parse().unwrap_or(1);
    year.is_multiple_of(4) && (!year.is_multiple_of(100) || year.is_multiple_of(400))
}

fn is_identifier(text: &str) -> bool {
    let mut letters = text.chars();
    letters
        .next()
        .is_some_and(|first| first.is_alphabetic() || first == '_')
        && letters.all(|letter| letter.is_alphanumeric() || matches!(letter, '_' | '-' | '.'))
}

fn is_language(text: &str) -> bool {
    let mut parts = text.split('-');
    let part = |part: &str, digits_too: bool| {
        (1..=8).contains(&part.len())
            && part
                .bytes()
                .all(|byte| byte.is_ascii_alphabetic() || digits_too && byte.is_ascii_digit())
    };
    parts.next().is_some_and(|first| part(first, false)) && parts.all(|rest| part(rest, true))
}

#[cfg(test)]
mod tests {
    use super::check;

    #[test]
    fn kinds_take_what_xml_schema_takes() {
        let right = [
            ("boolean", "true 1 false 0"),
            ("decimal", "0 -1.5 +3 .5 7."),
            ("unsignedLong", "0 18446744073709551615"),
            (
                "dateTime",
                "2024-02-29T00:00:00 2022-08-29T07:34:11.5Z 2022-01-01T24:00:00 2022-01-01T00:00:00+14:00",
            ),
            ("ID", "_a a-1 é.b"),
            ("language", "en en-US de-CH-1996"),
            ("integer[0..65535]", "0 65535"),
            ("{set,reset}", "set reset"),
            ("string", "anything"),
        ];
        for (kind, texts) in right {
            for text in texts.split(' ') {
                assert_eq!(check(kind, text), Ok(()), "{kind} {text}");
            }
        }
        let wrong = [
            ("boolean", "negated TRUE"),
            ("decimal", ". 1e3 x 1.2.3 -"),
            ("unsignedLong", "-1 18446744073709551616 1.0"),
            (
                "dateTime",
                "2022-09-01 2023-02-29T00:00:00 2022-13-01T00:00:00 2022-01-01T25:00:00 0000-01-01T00:00:00",
            ),
            ("ID", "1a a:b"),
            ("language", "e1 englishlanguage en--US"),
            ("integer[0..65535]", "65536 -1 a"),
            ("{set,reset}", "sets Set"),
        ];
        for (kind, texts) in wrong {
            for text in texts.split(' ') {
                assert!(check(kind, text).is_err(), "{kind} {text}");
            }
        }
    }
}
