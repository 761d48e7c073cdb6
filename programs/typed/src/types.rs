//! Types and how much memory a value of them takes.
//!
//! Memory is a row of slots of 64 bits. An elementary value takes a slot and is stored zero-extended, a negative number
//! in two's complement of its own width; so the bits above the width are 0 whatever the type. Elements of an array of an elementary type stand
//! packed, at bits that are a multiple of their width.

use std::fmt;
use std::sync::Arc;

/// A type without parts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Elementary {
    /// `FALSE`, `TRUE`.
    Bool,
    /// 8 bits.
    Byte,
    /// 16 bits.
    Word,
    /// 32 bits.
    Dword,
    /// 64 bits.
    Lword,
    /// −2⁷ to 2⁷ − 1.
    Sint,
    /// −2¹⁵ to 2¹⁵ − 1.
    Int,
    /// −2³¹ to 2³¹ − 1.
    Dint,
    /// −2⁶³ to 2⁶³ − 1.
    Lint,
    /// 0 to 2⁸ − 1.
    Usint,
    /// 0 to 2¹⁶ − 1.
    Uint,
    /// 0 to 2³² − 1.
    Udint,
    /// 0 to 2⁶⁴ − 1.
    Ulint,
    /// IEEE 754 binary32.
    Real,
    /// IEEE 754 binary64.
    Lreal,
    /// `TIME` and `LTIME`: a signed number of nanoseconds.
    Time,
    /// `DATE`: nanoseconds from 1970-01-01 to its midnight.
    Date,
    /// `TIME_OF_DAY`: nanoseconds from midnight.
    TimeOfDay,
    /// `DATE_AND_TIME`: nanoseconds from 1970-01-01.
    DateAndTime,
}

impl Elementary {
    /// All of them.
    pub const ALL: [Self; 19] = [
        Self::Bool,
        Self::Byte,
        Self::Word,
        Self::Dword,
        Self::Lword,
        Self::Sint,
        Self::Int,
        Self::Dint,
        Self::Lint,
        Self::Usint,
        Self::Uint,
        Self::Udint,
        Self::Ulint,
        Self::Real,
        Self::Lreal,
        Self::Time,
        Self::Date,
        Self::TimeOfDay,
        Self::DateAndTime,
    ];

    /// Its keyword.
    pub fn name(self) -> &'static str {
        match self {
            Self::Bool => "BOOL",
            Self::Byte => "BYTE",
            Self::Word => "WORD",
            Self::Dword => "DWORD",
            Self::Lword => "LWORD",
            Self::Sint => "SINT",
            Self::Int => "INT",
            Self::Dint => "DINT",
            Self::Lint => "LINT",
            Self::Usint => "USINT",
            Self::Uint => "UINT",
            Self::Udint => "UDINT",
            Self::Ulint => "ULINT",
            Self::Real => "REAL",
            Self::Lreal => "LREAL",
            Self::Time => "TIME",
            Self::Date => "DATE",
            Self::TimeOfDay => "TIME_OF_DAY",
            Self::DateAndTime => "DATE_AND_TIME",
        }
    }

    /// The article of its keyword: `an INT`, `a BOOL`.
    pub fn article(self) -> &'static str {
        if self == Self::Int { "an" } else { "a" }
    }

    /// Width of a value in bits: 1, 8, 16, 32 or 64.
    pub fn bits(self) -> u32 {
        match self {
            Self::Bool => 1,
            Self::Byte | Self::Sint | Self::Usint => 8,
            Self::Word | Self::Int | Self::Uint => 16,
            Self::Dword | Self::Dint | Self::Udint | Self::Real => 32,
            _ => 64,
        }
    }

    /// 1 for each bit of a value.
    pub fn mask(self) -> u64 {
        u64::MAX >> (64 - self.bits())
    }

    /// SINT … LINT and the types of time, which are signed numbers of nanoseconds.
    pub fn is_signed(self) -> bool {
        matches!(self, Self::Sint | Self::Int | Self::Dint | Self::Lint) || self.is_time()
    }

    /// The least and the greatest number that its bits hold.
    pub fn limits(self) -> (i128, i128) {
        let mask = i128::from(self.mask());
        if self.is_signed() { (-(mask >> 1) - 1, mask >> 1) } else { (0, mask) }
    }

    /// SINT … ULINT.
    pub fn is_integer(self) -> bool {
        matches!(
            self,
            Self::Sint
                | Self::Int
                | Self::Dint
                | Self::Lint
                | Self::Usint
                | Self::Uint
                | Self::Udint
                | Self::Ulint
        )
    }

    /// REAL and LREAL.
    pub fn is_real(self) -> bool {
        matches!(self, Self::Real | Self::Lreal)
    }

    /// BOOL, BYTE … LWORD.
    pub fn is_bit_string(self) -> bool {
        matches!(self, Self::Bool | Self::Byte | Self::Word | Self::Dword | Self::Lword)
    }

    /// TIME, DATE and their like.
    pub fn is_time(self) -> bool {
        matches!(self, Self::Time | Self::Date | Self::TimeOfDay | Self::DateAndTime)
    }

    /// The number that a stored integer or time stands for; bit strings count as unsigned.
    pub fn signed(self, stored: u64) -> i128 {
        if self.is_signed() {
            let unused = 64 - self.bits();
            i128::from((stored << unused) as i64 >> unused)
        } else {
            i128::from(stored)
        }
    }

    /// A stored value as a number: what a REAL or LREAL stands for, and all else as [`Self::signed`]. Not a number where a real is none.
    pub fn number(self, stored: u64) -> f64 {
        match self {
            Self::Real => f32::from_bits(stored as u32).into(),
            Self::Lreal => f64::from_bits(stored),
            _ => self.signed(stored) as f64,
        }
    }
}

impl fmt::Display for Elementary {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(self.name())
    }
}

/// Index of an [`Enumeration`] in its program.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct EnumerationId(pub u32);

/// Index of a [`Structure`] in its program.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct StructureId(pub u32);

/// A type.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub enum Type {
    /// A number, a bit string, a time.
    Elementary(Elementary),
    /// Named values.
    Enumeration(EnumerationId, Elementary),
    /// `STRING[n]`: at most so many bytes. A slot with its length, then its bytes, eight to a slot, the first lowest; bytes behind the
    /// end are 0.
    Text(u16),
    /// `ARRAY`.
    Array(Arc<Array>),
    /// `STRUCT`, and the memory of a function block.
    Structure(StructureId, u32),
}

impl Type {
    /// What its values are stored as, where it has no parts.
    pub fn elementary(&self) -> Option<Elementary> {
        match self {
            Self::Elementary(elementary) | Self::Enumeration(_, elementary) => Some(*elementary),
            _ => None,
        }
    }

    /// Whether a value of the other type can be stored as one of this: equal types, enumerations as their numbers, texts of whatever length.
    pub fn is_stored_like(&self, other: &Self) -> bool {
        match (self, other) {
            (Self::Text(_), Self::Text(_)) => true,
            _ => match (self.elementary(), other.elementary()) {
                (Some(one), Some(other)) => one == other,
                _ => self == other,
            },
        }
    }

    /// Slots that a variable of it takes.
    pub fn slots(&self) -> u64 {
        match self {
            Self::Elementary(_) | Self::Enumeration(..) => 1,
            Self::Text(capacity) => 1 + u64::from(*capacity).div_ceil(8),
            Self::Array(array) => array.slots(),
            Self::Structure(_, slots) => u64::from(*slots),
        }
    }
}

/// `ARRAY [low..high, …] OF element`; rows stand one behind the other, the last index counts fastest.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct Array {
    /// First and last index of each dimension; the last is not before the first.
    pub ranges: Vec<(i64, i64)>,
    /// Type of an element.
    pub element: Type,
}

impl Array {
    /// How many elements there are; saturates.
    pub fn length(&self) -> u64 {
        let lengths = self.ranges.iter().map(|&(low, high)| high.abs_diff(low).saturating_add(1));
        lengths.fold(1, u64::saturating_mul)
    }

    /// Bits from one element to the next.
    pub fn stride(&self) -> u64 {
        match self.element.elementary() {
            Some(elementary) => u64::from(elementary.bits()),
            None => self.element.slots().saturating_mul(64),
        }
    }

    fn slots(&self) -> u64 {
        self.length().saturating_mul(self.stride()).div_ceil(64)
    }
}

/// Named values of a type, from 0.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Enumeration {
    /// Its name; empty where it has none.
    pub name: String,
    /// Names and values.
    pub values: Vec<(String, i64)>,
}

impl Enumeration {
    /// Whether each name of another one has the same number here.
    pub fn has_all_of(&self, other: &Self) -> bool {
        other.values.iter().all(|(name, value)| {
            let mut own = self.values.iter();
            own.any(|(known, number)| known.eq_ignore_ascii_case(name) && number == value)
        })
    }
}

/// The parts of a structure or of a function block's memory.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Structure {
    /// Its name.
    pub name: String,
    /// Its parts, in order of their slots.
    pub fields: Vec<Field>,
}

/// A part of a structure.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Field {
    /// Its name, as declared.
    pub name: String,
    /// Its type.
    pub of: Type,
    /// Its first slot, counted from the start of the structure.
    pub slot: u32,
    /// It holds the address of a variable of that type (`VAR_IN_OUT`): one slot.
    pub is_reference: bool,
}
