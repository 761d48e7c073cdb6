//! A date as it stands in files and certificates: UTC, whole seconds.

use std::fmt;
use std::str::FromStr;
use std::time::SystemTime;

use serde::{Deserialize, Deserializer, Serialize, Serializer, de};
use time::{Date as Day, Duration, Month, OffsetDateTime, PrimitiveDateTime, Time};

/// Written as `2026-11-21T18:05:00Z`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct Date(OffsetDateTime);

impl Date {
    /// The date of a clock.
    pub fn of(now: SystemTime) -> Self {
        let date = OffsetDateTime::from(now);
        Self(date.replace_nanosecond(0).unwrap_or(date))
    }

    /// So many days later; the last date that there is where there is no such date.
    #[must_use]
    pub fn plus_days(self, days: u32) -> Self {
        let later = self.0.checked_add(Duration::days(i64::from(days)));
        Self(later.unwrap_or(OffsetDateTime::new_utc(Day::MAX, Time::MIDNIGHT)))
    }

    /// Whole days until `other`, negative where that lies before.
    pub fn days_until(self, other: Self) -> i64 {
        (other.0 - self.0).whole_days()
    }

    /// Seconds since 1970.
    pub fn seconds(self) -> i64 {
        self.0.unix_timestamp()
    }

    pub(crate) fn inner(self) -> OffsetDateTime {
        self.0
    }
}

impl From<OffsetDateTime> for Date {
    fn from(date: OffsetDateTime) -> Self {
        Self(date)
    }
}

impl fmt::Display for Date {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (hour, minute, second) = self.0.to_hms();
        write!(
            formatter,
            "{:04}-{:02}-{:02}T{hour:02}:{minute:02}:{second:02}Z",
            self.0.year(),
            u8::from(self.0.month()),
            self.0.day()
        )
    }
}

impl FromStr for Date {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let wrong = || format!("{text:?} is no date such as 2026-11-21T18:05:00Z");
        let shape = |(place, byte): (usize, u8)| match place {
            4 | 7 => byte == b'-',
            10 => byte == b'T',
            13 | 16 => byte == b':',
            19 => byte == b'Z',
            _ => byte.is_ascii_digit(),
        };
        if text.len() != 20 || !text.bytes().enumerate().all(shape) {
            return Err(wrong());
        }
        let number = |from: usize, to: usize| text[from..to].parse::<u8>().unwrap_or(0);
        let year = text[..4].parse().map_err(|_| wrong())?;
        let month = Month::try_from(number(5, 7)).map_err(|_| wrong())?;
        let day = Day::from_calendar_date(year, month, number(8, 10)).map_err(|_| wrong())?;
        let time = Time::from_hms(number(11, 13), number(14, 16), number(17, 19));
        let time = time.map_err(|_| wrong())?;
        Ok(Self(PrimitiveDateTime::new(day, time).assume_utc()))
    }
}

impl Serialize for Date {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

impl<'de> Deserialize<'de> for Date {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let text = String::deserialize(deserializer)?;
        text.parse().map_err(de::Error::custom)
    }
}

#[cfg(test)]
mod tests {
    use std::time::{Duration, UNIX_EPOCH};

    use super::*;

    #[test]
    fn dates_are_read_back() {
        for seconds in [0, 951_782_400, 1_795_197_900, 4_102_444_799] {
            let date = Date::of(UNIX_EPOCH + Duration::new(seconds, 999));
            assert_eq!(date.to_string().parse(), Ok(date));
            assert_eq!(date.seconds(), seconds as i64);
        }
        let date: Date = "2026-11-21T18:05:00Z".parse().expect("a date");
        assert_eq!(date.plus_days(365).to_string(), "2027-11-21T18:05:00Z");
        assert_eq!(date.days_until(date.plus_days(30)), 30);
        assert_eq!(date.plus_days(u32::MAX).to_string(), "9999-12-31T00:00:00Z");
    }

    #[test]
    fn what_is_no_date_is_refused() {
        for text in [
            "",
            "2026-11-21",
            "2026-13-21T18:05:00Z",
            "2026-02-29T18:05:00Z",
            "2026-11-21T24:05:00Z",
            "2026-11-21T18:05:00+",
            "２026-11-21T18:05Z",
        ] {
            assert!(text.parse::<Date>().is_err(), "{text}");
        }
    }
}
