//! Equipment behind a remote I/O: where it is, and which signal lies at which of its addresses.

use std::fmt;
use std::net::SocketAddr;
use std::str::FromStr;
use std::time::Duration;

/// A device that is reached by Modbus TCP.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct FieldDevice {
    /// Where it listens.
    pub address: SocketAddr,
    /// The unit behind that address.
    pub unit: u8,
    /// How long one exchange with it may take.
    pub timeout: Duration,
    /// The age at which its last answer is worth nothing any more.
    pub stale_after: Duration,
    /// For each input of the program, in order; one without a place stays 0.
    pub inputs: Vec<Option<Point>>,
    /// For each output of the program, in order; one without a place moves nothing.
    pub outputs: Vec<Option<Point>>,
}

/// One bit of a device, by its table and its address there, counted from 0 as on the wire.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Point {
    /// A discrete input, read only.
    Discrete(u16),
    /// A coil.
    Coil(u16),
    /// A bit of an input register, read only; bit 0 counts 1.
    Input(u16, u8),
    /// A bit of a holding register; bit 0 counts 1.
    Holding(u16, u8),
}

impl Point {
    /// How one is written.
    pub const EXAMPLES: &str =
        "\"discrete:0\", \"coil:3\", \"input:10.4\" or \"holding:10.4\" (register and bit)";

    /// Whether it may be written.
    pub fn is_writable(self) -> bool {
        matches!(self, Self::Coil(_) | Self::Holding(..))
    }
}

/// A text that is no place of a device.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{0:?} is no place of a Modbus device")]
pub struct NoPoint(String);

impl FromStr for Point {
    type Err = NoPoint;

    fn from_str(text: &str) -> Result<Self, NoPoint> {
        let read = || {
            let (table, place) = text.split_once(':')?;
            let number = |text: &str| -> Option<u16> {
                // A sign is no part of an address.
                let digits = text.bytes().all(|byte| byte.is_ascii_digit());
                digits.then(|| text.parse().ok()).flatten()
            };
            let bit_of = |place: &str| {
                let (register, bit) = place.split_once('.')?;
                let bit = number(bit).filter(|bit| *bit < 16)?;
                Some((number(register)?, bit as u8))
            };
            Some(match table {
                "discrete" => Self::Discrete(number(place)?),
                "coil" => Self::Coil(number(place)?),
                "input" => bit_of(place).map(|(register, bit)| Self::Input(register, bit))?,
                "holding" => bit_of(place).map(|(register, bit)| Self::Holding(register, bit))?,
                _ => return None,
            })
        };
        read().ok_or_else(|| NoPoint(text.to_owned()))
    }
}

impl fmt::Display for Point {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Discrete(address) => write!(formatter, "discrete:{address}"),
            Self::Coil(address) => write!(formatter, "coil:{address}"),
            Self::Input(register, bit) => write!(formatter, "input:{register}.{bit}"),
            Self::Holding(register, bit) => write!(formatter, "holding:{register}.{bit}"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_are_read_as_they_are_written() {
        for point in [
            Point::Discrete(0),
            Point::Coil(65_535),
            Point::Input(10, 15),
            Point::Holding(0, 0),
        ] {
            assert_eq!(point.to_string().parse(), Ok(point));
        }
        for text in [
            "",
            "coil",
            "coil:",
            "coil:65536",
            "coil:-1",
            "coil:+1",
            "coil:1.0",
            "input:1",
            "input:1.16",
            "holding:1.",
            "relay:1",
            "coil:1 ",
        ] {
            assert!(text.parse::<Point>().is_err(), "{text}");
        }
    }
}
