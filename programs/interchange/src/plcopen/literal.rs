//! Literals of IEC 61131-3 that are times.

use std::ops::Range;
use std::time::Duration;

use understudy_ladder::PERIODS;
use understudy_text::{Diagnostic, duration};

/// `T#1m30s`, `TIME#1.5s`, `t#250ms`: at most the longest preset.
pub(crate) fn time(text: &str) -> Option<Duration> {
    let text = text.trim();
    let rest = strip_prefix(strip_prefix(strip_prefix(text, "TIME#"), "T#"), "LTIME#");
    (rest.len() < text.len()).then(|| duration(rest))?
}

/// `00:00:00.02`, as PLCopen XML 1.0 writes the interval of a task, or `PT0.02S`, as CODESYS does; more than 0.
pub(crate) fn clock(text: &str) -> Option<Duration> {
    if let Some(seconds) = text.strip_prefix("PT").and_then(|rest| rest.strip_suffix('S')) {
        let found = Duration::try_from_secs_f64(seconds.parse().ok()?).ok()?;
        return (!found.is_zero()).then_some(found);
    }
    let parts: Vec<&str> = text.split(':').collect();
    let [hours, minutes, seconds] = parts[..] else {
        return None;
    };
    let hours: u16 = hours.parse().ok()?;
    let minutes: u16 = minutes.parse().ok()?;
    let seconds: f64 = seconds.parse().ok()?;
    let whole = f64::from(hours) * 3600.0 + f64::from(minutes) * 60.0;
    let found = Duration::try_from_secs_f64(whole + seconds).ok()?;
    (!found.is_zero()).then_some(found)
}

/// The interval of a task: a literal of time, as a clock, or seconds with a point; in the bounds of a period.
pub(crate) fn interval(text: &str) -> Option<Duration> {
    let seconds = || {
        let number = text.contains('.').then(|| text.parse().ok())?;
        Duration::try_from_secs_f64(number?).ok()
    };
    let found = time(text).or_else(|| clock(text)).or_else(seconds);
    found.filter(|interval| PERIODS.contains(interval))
}

/// The finding on an interval that is not a time within the bounds.
pub(crate) fn no_interval(text: &str, span: Range<usize>) -> Diagnostic {
    let message = format!(
        "the interval `{text}` of the task is not a time from {} to {}",
        duration::text(*PERIODS.start()),
        duration::text(*PERIODS.end())
    );
    Diagnostic::error("U1011", message, span).with_help("write it as a literal such as T#20ms")
}

/// The value of a literal of time behind its `T#`: as every other duration, in any case, with `_` between its parts.
pub(crate) fn duration(value: &str) -> Option<Duration> {
    let plain = value.replace('_', "").to_ascii_lowercase();
    let is_standard = !plain.contains(' ') && !plain.contains("min");
    is_standard.then(|| duration::parse(&plain).ok())?
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
            ("T#1m_2.25s", Some(62_250_000)),
            ("T#1M30S", Some(90_000_000)),
            ("T#0ms", Some(0)),
            ("T#1.s", None),
            ("T#1.5", None),
            ("T#101d", None),
            ("T#1min", None),
            ("T#1 s", None),
        ];
        for (text, microseconds) in times {
            assert_eq!(time(text), microseconds.map(Duration::from_micros), "{text}");
        }
    }
}
