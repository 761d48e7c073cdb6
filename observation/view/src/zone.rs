//! The zone in which times of day are shown. Records, JSON and interfaces have UTC; a zone is the choice of the reader.

use understudy_journal::TimeOfDay;

/// A zone: by how many seconds it is ahead of UTC at a time, in seconds since 1970-01-01 UTC.
#[derive(Debug, Clone, Copy)]
pub struct Zone(fn(i64) -> i32);

impl Default for Zone {
    fn default() -> Self {
        Self::UTC
    }
}

impl Zone {
    /// Coordinated Universal Time.
    pub const UTC: Self = Self(|_| 0);

    /// A zone with these offsets.
    pub const fn of(offsets: fn(i64) -> i32) -> Self {
        Self(offsets)
    }

    fn offset(self, time: TimeOfDay) -> i32 {
        (self.0)(time.unix_seconds())
    }

    /// `14:03:12.345`.
    pub fn clock(self, time: TimeOfDay) -> String {
        time.at_offset(self.offset(time)).1
    }

    /// `14:03:12`.
    pub fn seconds(self, time: TimeOfDay) -> String {
        let clock = self.clock(time);
        clock.split('.').next().unwrap_or_default().to_owned()
    }

    /// `2026-11-26`.
    pub fn date(self, time: TimeOfDay) -> String {
        time.at_offset(self.offset(time)).0
    }

    /// `UTC` or `UTC+01:00`.
    pub fn name(self, time: TimeOfDay) -> String {
        let minutes = self.offset(time) / 60;
        if minutes == 0 {
            return "UTC".to_owned();
        }
        let sign = if minutes < 0 { '-' } else { '+' };
        let minutes = minutes.abs();
        format!("UTC{sign}{:02}:{:02}", minutes / 60, minutes % 60)
    }

    /// `2026-11-26 14:03:12.345 UTC+01:00`.
    pub fn whole(self, time: TimeOfDay) -> String {
        format!("{} {} {}", self.date(time), self.clock(time), self.name(time))
    }
}
