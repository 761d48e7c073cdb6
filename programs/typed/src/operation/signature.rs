//! The types that an operation takes and gives.

use crate::operation::{Operation, TextOperation};
use crate::types::Elementary;

/// What an operand or a result is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Operand {
    /// An elementary value.
    Number(Elementary),
    /// A text, of whatever length.
    Text,
}

const LINT: Operand = Operand::Number(Elementary::Lint);
const BOOL: Operand = Operand::Number(Elementary::Bool);

/// What an operation takes and gives.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Signature {
    /// Its operands, in order.
    pub operands: Vec<Operand>,
    /// Its result.
    pub result: Operand,
}

impl Signature {
    fn new(operands: impl Into<Vec<Operand>>, result: Operand) -> Self {
        Self { operands: operands.into(), result }
    }
}

impl Operation {
    /// What it takes and gives where it has so many operands; `None` where it is not defined for its type or for that number.
    pub fn signature(self, count: usize) -> Option<Signature> {
        let (defined, signature) = self.expected(count);
        (defined && signature.operands.len() == count).then_some(signature)
    }

    /// Whether it is defined for its types, and its signature.
    fn expected(self, count: usize) -> (bool, Signature) {
        use Operand::Number;
        let unary = |of| Signature::new([Number(of)], Number(of));
        let binary = |of| Signature::new([Number(of); 2], Number(of));
        let by_count = |of| Signature::new([Number(of), LINT], Number(of));
        let change = |from, to| Signature::new([Number(from)], Number(to));
        let is_whole = |of: Elementary| of.is_integer() || of.is_time();
        let is_number = |of: Elementary| is_whole(of) || of.is_real();
        match self {
            Self::Add(of) | Self::Subtract(of) | Self::Multiply(of) | Self::Divide(of) => {
                (is_number(of), binary(of))
            }
            Self::Modulo(of) => (is_whole(of), binary(of)),
            Self::Negate(of) | Self::Absolute(of) => (is_number(of), unary(of)),
            Self::Minimum(of) | Self::Maximum(of) => {
                (count >= 2, Signature::new(vec![Number(of); count], Number(of)))
            }
            Self::Power(of) => (of.is_real(), binary(of)),
            Self::Real(_, of) => (of.is_real(), unary(of)),
            Self::Not(of) => (of.is_bit_string(), unary(of)),
            Self::And(of) | Self::Or(of) | Self::Xor(of) => (of.is_bit_string(), binary(of)),
            Self::ShiftLeft(of)
            | Self::ShiftRight(of)
            | Self::RotateLeft(of)
            | Self::RotateRight(of) => (!of.is_real(), by_count(of)),
            Self::Compare(_, of) => (true, Signature::new([Number(of); 2], BOOL)),
            Self::Select(of) => (true, Signature::new([BOOL, Number(of), Number(of)], Number(of))),
            Self::Multiplex(of) => {
                let mut operands = vec![Number(of); count];
                if let Some(first) = operands.first_mut() {
                    *first = LINT;
                }
                (count >= 2, Signature::new(operands, Number(of)))
            }
            Self::Convert(from, to) => (true, change(from, to)),
            Self::Truncate(from, to) => (from.is_real() && !to.is_real(), change(from, to)),
            Self::Reinterpret(from, to) => (from.bits() == to.bits(), change(from, to)),
            Self::Extract { from, to, at } => {
                (to.is_bit_string() && u32::from(at) + to.bits() <= from.bits(), change(from, to))
            }
            Self::Insert { of, part, at } => (
                part.is_bit_string() && u32::from(at) + part.bits() <= of.bits(),
                Signature::new([Number(of), Number(part)], Number(of)),
            ),
            Self::FromBcd(from, to) => (from.is_bit_string() && to.is_integer(), change(from, to)),
            Self::ToBcd(from, to) => (from.is_integer() && to.is_bit_string(), change(from, to)),
            Self::Elapsed => (true, Signature::new([], Number(Elementary::Time))),
            Self::Text(operation) => (true, operation.expected(count)),
        }
    }
}

impl TextOperation {
    fn expected(self, count: usize) -> Signature {
        use Operand::{Number, Text};
        match self {
            Self::Length => Signature::new([Text], LINT),
            Self::Left | Self::Right => Signature::new([Text, LINT], Text),
            Self::Middle | Self::Delete => Signature::new([Text, LINT, LINT], Text),
            Self::Concatenate => Signature::new(vec![Text; count.max(1)], Text),
            Self::Insert => Signature::new([Text, Text, LINT], Text),
            Self::Replace => Signature::new([Text, Text, LINT, LINT], Text),
            Self::Find => Signature::new([Text, Text], LINT),
            Self::Compare(_) => Signature::new([Text, Text], BOOL),
            Self::Select => Signature::new([BOOL, Text, Text], Text),
            Self::From(of) => Signature::new([Number(of)], Text),
            Self::To(of) => Signature::new([Text], Number(of)),
            Self::Byte => Signature::new([Text, LINT], Number(Elementary::Byte)),
            Self::UpperCase | Self::LowerCase => Signature::new([Text], Text),
        }
    }
}
