//! Numbers without a type: they take that of what stands beside them.

use understudy_typed::{Elementary, Expression, Operation, Type};

use crate::syntax::Operator;

use super::convert::limits;
use super::names::number;

/// An expression whose type may still be open.
pub(super) enum Operand {
    Typed(Expression),
    /// What an operator makes of numbers of fewer than 32 bits: a DINT, which is of this type where it is stored.
    Wide(Expression, Elementary),
    /// Made of untyped literals only.
    Number(Number),
    /// An error is reported.
    Faulty,
}

impl Operand {
    /// The type that it has where it is stored; nothing where that is open.
    pub(super) fn own_type(&self) -> Option<Type> {
        match self {
            Self::Typed(value) => Some(value.of.clone()),
            Self::Wide(_, own) => Some(Type::Elementary(*own)),
            Self::Number(_) | Self::Faulty => None,
        }
    }
}

/// An untyped number.
#[derive(Debug, Clone, Copy)]
pub(super) enum Number {
    Integer(i128),
    /// As it is when everything in it is computed in REAL, and in LREAL.
    Real(f32, f64),
}

impl Number {
    /// A number with a point or an exponent, rounded once in each type.
    pub(super) fn written(text: &str) -> Option<Self> {
        Some(Self::Real(text.parse().ok()?, text.parse().ok()?))
    }

    /// Whether LREAL has a finite number for it.
    pub(super) fn is_finite(self) -> bool {
        self.real().1.is_finite()
    }

    fn real(self) -> (f32, f64) {
        match self {
            Self::Integer(value) => (value as f32, value as f64),
            Self::Real(single, double) => (single, double),
        }
    }

    /// The number in a real type.
    pub(super) fn in_real(self, of: Elementary) -> Expression {
        let (single, double) = self.real();
        let stored = match of {
            Elementary::Real => u64::from(single.to_bits()),
            _ => double.to_bits(),
        };
        number(Type::Elementary(of), stored)
    }

    pub(super) fn negated(self) -> Option<Self> {
        Some(match self {
            Self::Integer(value) => Self::Integer(value.checked_neg()?),
            Self::Real(single, double) => Self::Real(-single, -double),
        })
    }

    /// The type that it takes where nothing else gives it one.
    pub(super) fn default_type(self) -> Elementary {
        match self {
            Self::Real(..) => Elementary::Lreal,
            Self::Integer(value) => {
                let types =
                    [Elementary::Int, Elementary::Dint, Elementary::Lint, Elementary::Ulint];
                let fits = |of: &Elementary| {
                    let (least, most) = limits(*of);
                    least <= value && value <= most
                };
                types.into_iter().find(fits).unwrap_or(Elementary::Lint)
            }
        }
    }

    /// The result of an operator between two of them; `None` where it has none, such as a division by 0.
    pub(super) fn operate(self, operator: Operator, other: Self) -> Option<Self> {
        match (self, other) {
            (Self::Integer(left), Self::Integer(right)) => {
                let value = match operator {
                    Operator::Add => left.checked_add(right)?,
                    Operator::Subtract => left.checked_sub(right)?,
                    Operator::Multiply => left.checked_mul(right)?,
                    Operator::Divide => left.checked_div(right)?,
                    Operator::Modulo => left.checked_rem(right)?,
                    Operator::Power => {
                        let power = u32::try_from(right).ok()?;
                        left.checked_pow(power)?
                    }
                    Operator::And => left & right,
                    Operator::Or => left | right,
                    Operator::Xor => left ^ right,
                    _ => return None,
                };
                // Nothing of more than 64 bits is ever taken.
                (value.unsigned_abs() <= u128::from(u64::MAX)).then_some(Self::Integer(value))
            }
            _ => {
                let of = |of| match operator {
                    Operator::Add => Some(Operation::Add(of)),
                    Operator::Subtract => Some(Operation::Subtract(of)),
                    Operator::Multiply => Some(Operation::Multiply(of)),
                    Operator::Divide => Some(Operation::Divide(of)),
                    Operator::Power => Some(Operation::Power(of)),
                    _ => None,
                };
                let (left, right) = (self.real(), other.real());
                let single = [left.0, right.0].map(|value| u64::from(value.to_bits()));
                let double = [left.1, right.1].map(f64::to_bits);
                let single = of(Elementary::Real)?.apply(&single).ok()?;
                let double = of(Elementary::Lreal)?.apply(&double).ok()?;
                Some(Self::Real(f32::from_bits(single as u32), f64::from_bits(double)))
            }
        }
    }
}
