//! Values as files of scans write them.
//!
//! | type | written |
//! |---|---|
//! | BOOL | `0` or `1` |
//! | integers, bit strings | decimal |
//! | REAL, LREAL | the hexadecimal bit pattern, 8 or 16 digits; read also as a decimal number with a point or an exponent |
//! | TIME, DATE and their like | nanoseconds, decimal |
//! | enumerations | the name of the value; read also as a decimal number |

use crate::image::Declared;
use crate::types::Elementary;

impl Declared {
    /// A stored value as it is written in a file of scans.
    pub fn write(&self, stored: u64) -> String {
        self.value_name(stored).map_or_else(|| self.of.write(stored), str::to_owned)
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
            _ => {
                let number: i128 = text.parse().ok()?;
                let stored = number as u64 & self.mask();
                (self.signed(stored) == number).then_some(stored)
            }
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
