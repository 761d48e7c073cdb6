//! Places of signals in a Modbus device: a bit of one of the four tables, or a number in whole registers.

use std::fmt;
use std::str::FromStr;

use understudy_typed::Elementary;

/// Place of one signal in a device.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Place {
    /// Of a BOOL.
    Bit(BitPlace),
    /// Of a number.
    Number(Registers),
}

/// One bit of a device, by its table and its address there, counted from 0 as on the wire.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum BitPlace {
    /// A discrete input, read only.
    Discrete(u16),
    /// A coil.
    Coil(u16),
    /// A bit of an input register, read only; bit 0 has the value 1.
    Input(u16, u8),
    /// A bit of a holding register; bit 0 has the value 1.
    Holding(u16, u8),
}

/// A number in one, two or four consecutive registers.
///
/// The signal has the value `raw * scale + offset`, where `raw` is the number in the registers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Registers {
    /// Their table.
    pub table: RegisterTable,
    /// Address of the first, counted from 0 as on the wire.
    pub address: u16,
    /// Type of the number in them, one of [`Registers::TYPES`].
    pub of: Elementary,
    /// Order of its bytes.
    pub order: ByteOrder,
    /// Units of the signal for each unit of the number; finite and not 0.
    pub scale: f64,
    /// Value of the signal where the number is 0; finite.
    pub offset: f64,
}

/// The two tables of registers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum RegisterTable {
    /// Input registers, read only.
    Input,
    /// Holding registers.
    Holding,
}

/// Order of the bytes of a number in its registers; `A` is the most significant byte of a number of 32 bits.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum ByteOrder {
    /// Most significant register first, most significant byte first, as Modbus prescribes for one register.
    #[default]
    Abcd,
    /// Least significant register first, most significant byte first.
    Cdab,
    /// Most significant register first, least significant byte first.
    Badc,
    /// Least significant register first, least significant byte first.
    Dcba,
}

impl ByteOrder {
    /// In the order of [`Self::WORDS`].
    pub(crate) const ALL: [Self; 4] = [Self::Abcd, Self::Cdab, Self::Badc, Self::Dcba];

    /// As the cluster file writes them.
    pub(crate) const WORDS: [&str; 4] = ["abcd", "cdab", "badc", "dcba"];

    /// Whether the least significant register is the first.
    pub fn starts_with_low_register(self) -> bool {
        matches!(self, Self::Cdab | Self::Dcba)
    }

    /// Whether the least significant byte of each register is the first.
    pub fn swaps_bytes(self) -> bool {
        matches!(self, Self::Badc | Self::Dcba)
    }
}

impl Registers {
    /// Types of numbers in registers.
    pub const TYPES: [Elementary; 8] = [
        Elementary::Int,
        Elementary::Uint,
        Elementary::Dint,
        Elementary::Udint,
        Elementary::Lint,
        Elementary::Ulint,
        Elementary::Real,
        Elementary::Lreal,
    ];

    /// [`Self::TYPES`] as the cluster file writes them.
    pub(crate) const TYPE_WORDS: [&str; 8] =
        ["int", "uint", "dint", "udint", "lint", "ulint", "real", "lreal"];

    /// Number of registers: 1, 2 or 4.
    pub fn count(&self) -> u16 {
        (self.of.bits() / 16) as u16
    }

    /// Whether the signal is not the number itself.
    pub fn is_scaled(&self) -> bool {
        self.scale != 1.0 || self.offset != 0.0
    }

    /// Whether all its registers have an address.
    pub(crate) fn is_in_table(&self) -> bool {
        u32::from(self.address) + u32::from(self.count()) <= 1 << 16
    }
}

impl Place {
    /// Whether a signal of 0 is another number in its registers.
    pub fn has_offset(&self) -> bool {
        matches!(self, Self::Number(registers) if registers.offset != 0.0)
    }

    /// Whether its registers hold whole numbers, and a number of this type is rounded to them.
    pub fn rounds(&self, of: Elementary) -> bool {
        let Self::Number(registers) = self else {
            return false;
        };
        !registers.of.is_real() && (of.is_real() || registers.scale != 1.0)
    }

    /// How places are written.
    pub const EXAMPLES: &str = "\"discrete:0\", \"coil:3\", \"input:10.4\" or \"holding:10.4\" (register and bit) for a BOOL, and \"input:10 real\" \
         or \"holding:10 int\" (first register and type) for a number";

    /// Whether it may be written.
    pub fn is_writable(&self) -> bool {
        match self {
            Self::Bit(place) => matches!(place, BitPlace::Coil(_) | BitPlace::Holding(..)),
            Self::Number(registers) => registers.table == RegisterTable::Holding,
        }
    }
}

/// A text that is not a place of a device.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum PlaceError {
    /// It has another form.
    #[error("{0:?} is not a place of a Modbus device")]
    Form(String),
    /// A number of a type that no registers have.
    #[error("{0:?} is not a type of registers: expected {words}", words = Registers::TYPE_WORDS.join(", "))]
    Type(String),
    /// Bytes in an order that no registers have.
    #[error("{0:?} is not an order of bytes: expected {words}", words = ByteOrder::WORDS.join(", "))]
    Order(String),
    /// A register without its bit or its type.
    #[error("{0:?} names neither a bit nor a type")]
    NoType(String),
    /// It ends behind the last register.
    #[error("{0:?} ends behind register 65535")]
    TooFar(String),
}

/// A whole number without a sign: a sign is not part of an address.
fn number(text: &str) -> Option<u16> {
    let digits = text.bytes().all(|byte| byte.is_ascii_digit());
    digits.then(|| text.parse().ok()).flatten()
}

/// The table and the address of `input:10` or `holding:10`.
pub(crate) fn register(text: &str) -> Option<(RegisterTable, u16)> {
    let (table, address) = text.split_once(':')?;
    let table = match table {
        "input" => RegisterTable::Input,
        "holding" => RegisterTable::Holding,
        _ => return None,
    };
    Some((table, number(address)?))
}

fn bit(text: &str) -> Option<BitPlace> {
    let (table, address) = text.split_once(':')?;
    let bit_of = || {
        let (register, bit) = address.split_once('.')?;
        let bit = number(bit).filter(|bit| *bit < 16)?;
        Some((number(register)?, bit as u8))
    };
    Some(match table {
        "discrete" => BitPlace::Discrete(number(address)?),
        "coil" => BitPlace::Coil(number(address)?),
        "input" => bit_of().map(|(register, bit)| BitPlace::Input(register, bit))?,
        "holding" => bit_of().map(|(register, bit)| BitPlace::Holding(register, bit))?,
        _ => return None,
    })
}

impl FromStr for Place {
    type Err = PlaceError;

    fn from_str(text: &str) -> Result<Self, PlaceError> {
        let mut words = text.split(' ');
        let first = words.next().unwrap_or_default();
        let (of, order, more) = (words.next(), words.next(), words.next());
        let form = || PlaceError::Form(text.to_owned());
        let Some(of) = of else {
            return match bit(first) {
                Some(place) => Ok(Self::Bit(place)),
                None if register(first).is_some() => Err(PlaceError::NoType(text.to_owned())),
                None => Err(form()),
            };
        };
        let (table, address) = register(first).ok_or_else(form)?;
        if more.is_some() {
            return Err(form());
        }
        let find = |words: &[&str], wanted: &str| words.iter().position(|word| *word == wanted);
        let of = find(&Registers::TYPE_WORDS, of).ok_or_else(|| PlaceError::Type(of.to_owned()))?;
        let order = match order {
            Some(order) => {
                find(&ByteOrder::WORDS, order).ok_or_else(|| PlaceError::Order(order.to_owned()))?
            }
            None => 0,
        };
        let registers = Registers {
            table,
            address,
            of: Registers::TYPES[of],
            order: ByteOrder::ALL[order],
            scale: 1.0,
            offset: 0.0,
        };
        if !registers.is_in_table() {
            return Err(PlaceError::TooFar(text.to_owned()));
        }
        Ok(Self::Number(registers))
    }
}

impl fmt::Display for BitPlace {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Discrete(address) => write!(formatter, "discrete:{address}"),
            Self::Coil(address) => write!(formatter, "coil:{address}"),
            Self::Input(register, bit) => write!(formatter, "input:{register}.{bit}"),
            Self::Holding(register, bit) => write!(formatter, "holding:{register}.{bit}"),
        }
    }
}

impl fmt::Display for RegisterTable {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(match self {
            Self::Input => "input",
            Self::Holding => "holding",
        })
    }
}

/// Without scale and offset.
impl fmt::Display for Registers {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { table, address, .. } = self;
        let of = self.of.name().to_ascii_lowercase();
        write!(formatter, "{table}:{address} {of}")?;
        let order = ByteOrder::ALL.iter().position(|order| *order == self.order);
        match order {
            Some(place @ 1..) => write!(formatter, " {}", ByteOrder::WORDS[place]),
            _ => Ok(()),
        }
    }
}

impl fmt::Display for Place {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Bit(place) => place.fmt(formatter),
            Self::Number(registers) => registers.fmt(formatter),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_are_read_as_they_are_written() {
        for text in [
            "discrete:0",
            "coil:65535",
            "input:10.15",
            "holding:0.0",
            "input:10 real",
            "holding:65535 int",
            "holding:65532 lreal dcba",
            "input:4 udint cdab",
        ] {
            let place: Place = text.parse().expect(text);
            assert_eq!(place.to_string(), text);
        }
        for text in [
            "",
            "coil",
            "coil:",
            "coil:65536",
            "coil:-1",
            "coil:+1",
            "coil:1.0",
            "coil:1 int",
            "input:1",
            "input:1.16",
            "input:1.1 int",
            "input:1 integer",
            "input:1 real abc",
            "input:1 real abcd 2",
            "input:65535 real",
            "holding:1.",
            "relay:1",
            "coil:1 ",
        ] {
            assert!(text.parse::<Place>().is_err(), "{text}");
        }
    }
}
