//! The operations of a program and the exact meaning of each.
//!
//! Every operation has one result, whatever the processor: integers wrap; reals are IEEE 754, rounded to nearest even, never evaluated
//! wider, with one NaN; transcendental functions come from `libm`. Stored values are zero-extended ([`crate::types`]).

mod apply;
pub(crate) mod number_text;
pub(crate) mod real;
mod signature;
mod text;

pub use self::signature::{Operand, Signature};
pub use self::text::{TextOperand, text_literal};

use crate::types::Elementary;

/// What is done with operands. The type is that of the operands and of the result, unless something else is said.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Operation {
    /// a + b: integers, reals, times.
    Add(Elementary),
    /// a − b: integers, reals, times.
    Subtract(Elementary),
    /// a · b: integers, reals, times (as integers).
    Multiply(Elementary),
    /// a / b: integers and times towards 0, reals; a divisor of 0 is a fault, but of reals.
    Divide(Elementary),
    /// a − (a / b) · b of integers and times; 0 for a divisor of 0, as in the standard.
    Modulo(Elementary),
    /// −a: integers, reals, times.
    Negate(Elementary),
    /// |a|: integers, reals, times; the least number of a signed type stays as it is.
    Absolute(Elementary),
    /// The least of two or more, any type but texts; of reals as the comparison `a < b` says, so NaN is taken only where it stands first.
    Minimum(Elementary),
    /// The greatest of two or more, as the comparison `a > b` says.
    Maximum(Elementary),
    /// aᵇ of reals.
    Power(Elementary),
    /// A function of a real.
    Real(RealFunction, Elementary),
    /// All bits the other way: bit strings.
    Not(Elementary),
    /// Bit by bit: bit strings.
    And(Elementary),
    /// Bit by bit: bit strings.
    Or(Elementary),
    /// Bit by bit: bit strings.
    Xor(Elementary),
    /// Towards the high bits, with 0 from below; b is a LINT, and from the width on (or negative) nothing is left.
    ShiftLeft(Elementary),
    /// Towards the low bits, with 0 from above.
    ShiftRight(Elementary),
    /// By b, a LINT, modulo the width.
    RotateLeft(Elementary),
    /// By b, a LINT, modulo the width.
    RotateRight(Elementary),
    /// A BOOL: whether a stands so to b. Comparisons with NaN are false, but for `<>`.
    Compare(Comparison, Elementary),
    /// a is a BOOL: b where it is FALSE, c where it is TRUE. Of the elementary type.
    Select(Elementary),
    /// a is a LINT: the operand of that number among those behind it, from 0; another number is a fault.
    Multiplex(Elementary),
    /// From one type to another: between integers, bit strings and times the number wraps; an integer becomes the nearest real,
    /// a real the nearest integer (half to even, saturating, NaN becomes 0); to BOOL whether it is not 0; from BOOL 0 or 1. Between times and reals the number is one of nanoseconds.
    Convert(Elementary, Elementary),
    /// From a real to an integer, towards 0; saturating, NaN becomes 0.
    Truncate(Elementary, Elementary),
    /// The same bits as another type of the same width.
    Reinterpret(Elementary, Elementary),
    /// Bits `at` to `at + width − 1` of a, as a value of that type: `word.3`, `word.%B1`.
    Extract {
        /// Type of a.
        from: Elementary,
        /// Type of the result, a bit string.
        to: Elementary,
        /// The lowest bit.
        at: u8,
    },
    /// a with these bits as b has them.
    Insert {
        /// Type of a and of the result.
        of: Elementary,
        /// Type of b, a bit string.
        part: Elementary,
        /// The lowest bit.
        at: u8,
    },
    /// Number ↔ binary coded decimal: `WORD_BCD_TO_UINT` and its like. A nibble above 9 counts as it stands; digits that do not fit are lost.
    FromBcd(Elementary, Elementary),
    /// The decimal digits of an unsigned integer in the nibbles of a bit string.
    ToBcd(Elementary, Elementary),
    /// TIME from the start to this scan: the number of scans before it times the period. No operands.
    Elapsed,
    /// An operation on texts.
    Text(TextOperation),
}

/// Functions of one real.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum RealFunction {
    /// `SQRT`
    SquareRoot,
    /// `SIN`
    Sine,
    /// `COS`
    Cosine,
    /// `TAN`
    Tangent,
    /// `ASIN`
    ArcSine,
    /// `ACOS`
    ArcCosine,
    /// `ATAN`
    ArcTangent,
    /// `EXP`
    Exponential,
    /// `LN`
    NaturalLogarithm,
    /// `LOG`, of base 10
    Logarithm,
    /// `FLOOR`, as a real.
    Floor,
    /// `CEIL`, as a real.
    Ceiling,
    /// The nearest whole number, half to even, as a real.
    Round,
}

/// How two values stand to each other.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Comparison {
    /// `=`
    Equal,
    /// `<>`
    NotEqual,
    /// `<`
    Less,
    /// `<=`
    LessOrEqual,
    /// `>`
    Greater,
    /// `>=`
    GreaterOrEqual,
}

impl Comparison {
    /// Each with its sign in Structured Text and the name of its function and instruction.
    const WRITTEN: [(Self, &str, &str); 6] = [
        (Self::Equal, "=", "EQ"),
        (Self::NotEqual, "<>", "NE"),
        (Self::Less, "<", "LT"),
        (Self::LessOrEqual, "<=", "LE"),
        (Self::Greater, ">", "GT"),
        (Self::GreaterOrEqual, ">=", "GE"),
    ];

    /// All, in the order of their signs in Structured Text.
    pub const ALL: [Self; 6] = [
        Self::Equal,
        Self::NotEqual,
        Self::Less,
        Self::LessOrEqual,
        Self::Greater,
        Self::GreaterOrEqual,
    ];

    fn written(self) -> (Self, &'static str, &'static str) {
        Self::WRITTEN.into_iter().find(|(of, _, _)| *of == self).expect("each is written")
    }

    /// As Structured Text writes it: `>=`.
    pub fn sign(self) -> &'static str {
        self.written().1
    }

    /// The name of its function and instruction: `GE`.
    pub fn word(self) -> &'static str {
        self.written().2
    }

    /// That of a sign of Structured Text.
    pub fn of_sign(sign: &str) -> Option<Self> {
        Self::WRITTEN.into_iter().find(|(_, known, _)| *known == sign).map(|(of, _, _)| of)
    }

    /// That of a function or instruction, in capitals.
    pub fn of_word(word: &str) -> Option<Self> {
        Self::WRITTEN.into_iter().find(|(_, _, known)| *known == word).map(|(of, _, _)| of)
    }

    /// Whether it holds between two values.
    pub fn holds<T: PartialOrd>(self, left: T, right: T) -> bool {
        match self {
            Self::Equal => left == right,
            Self::NotEqual => left != right,
            Self::Less => left < right,
            Self::LessOrEqual => left <= right,
            Self::Greater => left > right,
            Self::GreaterOrEqual => left >= right,
        }
    }

    /// The one that holds where this one does not; of reals only where neither is NaN.
    #[must_use]
    pub fn opposite(self) -> Self {
        match self {
            Self::Equal => Self::NotEqual,
            Self::NotEqual => Self::Equal,
            Self::Less => Self::GreaterOrEqual,
            Self::LessOrEqual => Self::Greater,
            Self::Greater => Self::LessOrEqual,
            Self::GreaterOrEqual => Self::Less,
        }
    }

    /// The same with its sides exchanged.
    #[must_use]
    pub fn mirrored(self) -> Self {
        match self {
            Self::Less => Self::Greater,
            Self::LessOrEqual => Self::GreaterOrEqual,
            Self::Greater => Self::Less,
            Self::GreaterOrEqual => Self::LessOrEqual,
            same => same,
        }
    }
}

/// Operations on texts. Positions count from 1, lengths and positions are LINTs. A length is cut to the text. A position that the text does
/// not have leaves the text as it is, and gives an empty part; IEC 61131-3 leaves it open.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum TextOperation {
    /// `LEN`: a LINT.
    Length,
    /// `LEFT(text, length)`
    Left,
    /// `RIGHT(text, length)`
    Right,
    /// `MID(text, length, position)`
    Middle,
    /// `CONCAT(text, text, …)`
    Concatenate,
    /// `INSERT(text, inserted, position)`: behind the character at the position; at 0 in front of the text.
    Insert,
    /// `DELETE(text, length, position)`
    Delete,
    /// `REPLACE(text, by, length, position)`
    Replace,
    /// `FIND(text, sought)`: the position of the first occurrence, or 0; a LINT.
    Find,
    /// A BOOL, by the order of the bytes.
    Compare(Comparison),
    /// The second where the first, a BOOL, is FALSE, else the third.
    Select,
    /// A number as it is written: integers and bit strings in decimal, BOOL as `TRUE` and `FALSE`, reals in the shortest form
    /// that reads back to the same (`1.5`, `1.0E21`, `INF`), TIME as `T#1s500ms`, dates as `D#2024-02-29`.
    From(Elementary),
    /// A number as it is read from the start of a text, blanks before it left out; what is none is 0.
    To(Elementary),
    /// `text[position]`, a BYTE: 0 behind the end.
    Byte,
    /// `UPPER_CASE`
    UpperCase,
    /// `LOWER_CASE`
    LowerCase,
}
