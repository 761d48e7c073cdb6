//! Values as files of scans write them.
//!
//! | type | written |
//! |---|---|
//! | BOOL | `0` or `1` |
//! | integers, bit strings | decimal |
//! | REAL, LREAL | the hexadecimal bit pattern, 8 or 16 digits; read also as a decimal number with a point or an exponent |
//! | TIME, DATE and their like | the literal, such as `T#1s500ms`, `D#2024-02-29`; nanoseconds where it has none, such as a DATE within a day. Read also without the word before the `#`, and as nanoseconds |
//! | enumerations | the name of the value; read also as a decimal number |

use crate::image::Declared;
use crate::operation::number_text;
use crate::types::Elementary;

impl Declared {
    /// A stored value as it is written in a file of scans.
    pub fn write(&self, stored: u64) -> String {
        self.value_name(stored).map_or_else(|| self.long(self.of.write(stored)), str::to_owned)
    }

    /// The stored value of a text of a file of scans; `None` where the declaration has no such value. Numbers outside a subrange are read.
    pub fn read(&self, text: &str) -> Option<u64> {
        self.value_named(text).or_else(|| self.of.read(text))
    }
}

impl Elementary {
    /// A stored value as it is written in a file of scans.
    pub fn write(self, stored: u64) -> String {
        match self {
            Self::Real => format!("{stored:08x}"),
            Self::Lreal => format!("{stored:016x}"),
            _ if self.is_time() => {
                let literal = self.text(stored);
                let is_it = self.literal(&literal) == Some(stored);
                if is_it { literal } else { self.signed(stored).to_string() }
            }
            _ => self.signed(stored).to_string(),
        }
    }

    /// The stored value of a text of a file of scans; `None` where it is none of this type.
    pub fn read(self, text: &str) -> Option<u64> {
        let digits = self.bits() as usize / 4;
        match self {
            Self::Bool => match text {
                "0" | "FALSE" => Some(0),
                "1" | "TRUE" => Some(1),
                _ => None,
            },
            Self::Real | Self::Lreal
                if text.len() == digits && text.bytes().all(|digit| digit.is_ascii_hexdigit()) =>
            {
                u64::from_str_radix(text, 16).ok()
            }
            Self::Real | Self::Lreal if !text.contains(['.', 'e', 'E']) => None,
            Self::Real => text.parse().ok().map(|real: f32| u64::from(real.to_bits())),
            Self::Lreal => text.parse().ok().map(f64::to_bits),
            _ => self.whole(text).or_else(|| self.literal(text).filter(|_| self.is_time())),
        }
    }

    fn whole(self, text: &str) -> Option<u64> {
        let number: i128 = text.parse().ok()?;
        let stored = number as u64 & self.mask();
        (self.signed(stored) == number).then_some(stored)
    }

    /// The stored value of the literal of a time.
    fn literal(self, text: &str) -> Option<u64> {
        match self {
            Self::Time => number_text::duration(text).map(i64::cast_unsigned),
            _ => self.moment(text),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_are_read_as_they_are_written() {
        for of in Elementary::ALL {
            for stored in [0, 1, of.mask() >> 1, of.mask()] {
                assert_eq!(of.read(&of.write(stored)), Some(stored), "{of} {stored}");
            }
        }
    }

    #[test]
    fn times_are_written_as_literals_and_read_as_nanoseconds_too() {
        for (of, stored, written, others) in [
            (
                Elementary::Time,
                1_500_000_000,
                "T#1s500ms",
                &["1500000000", "T#1.5s", "t#1500ms", "LTIME#1s_500ms"][..],
            ),
            (Elementary::Time, -1_000, "T#-1us", &["-1000", "-1us", "lt#-1000ns"]),
            (
                Elementary::Date,
                1_709_164_800_000_000_000,
                "D#2024-02-29",
                &["DATE#2024-02-29", "2024-02-29"],
            ),
            (Elementary::Date, 1, "1", &[]),
            (Elementary::TimeOfDay, 45_296_500_000_000, "TOD#12:34:56.5", &["12:34:56.5"]),
            (Elementary::TimeOfDay, -1, "-1", &[]),
            (Elementary::DateAndTime, 1_000_000_000, "DT#1970-01-01-00:00:01", &["1000000000"]),
        ] {
            let stored = i64::cast_unsigned(stored);
            assert_eq!(of.write(stored), written, "{of}");
            for text in others.iter().chain([&written]) {
                assert_eq!(of.read(text), Some(stored), "{of} {text}");
            }
        }
        for wrong in [
            "T#",
            "T#5",
            "T#5s1",
            "T#1ms1s",
            "T#1s1s",
            "TT#1s",
            "D#1970-01-01",
            "T#1.5s1ms",
            "T#9999999999d",
            "T#.s",
            "1,5s",
            "T#--1s",
        ] {
            assert_eq!(Elementary::Time.read(wrong), None, "{wrong}");
        }
    }

    #[test]
    fn what_is_no_value_of_a_type_is_refused() {
        for (of, texts) in [
            (Elementary::Bool, &["2", "", "true "][..]),
            (Elementary::Sint, &["128", "-129", "1.0", "x"]),
            (Elementary::Usint, &["256", "-1"]),
            (Elementary::Ulint, &["18446744073709551616", "-1"]),
            (Elementary::Real, &["1", "nan", "c02400000", "1.0.0"]),
        ] {
            for text in texts {
                assert_eq!(of.read(text), None, "{of} {text}");
            }
        }
        assert_eq!(Elementary::Real.read("1.5"), Some(0x3fc0_0000));
        assert_eq!(Elementary::Lreal.read("-1e0"), Some(0xbff0_0000_0000_0000));
    }
}
