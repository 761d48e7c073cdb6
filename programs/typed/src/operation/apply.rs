//! What each operation gives for elementary operands.

use crate::fault::Cause;
use crate::operation::real::{Float, binary, unary};
use crate::operation::{Comparison, Operation, RealFunction};
use crate::types::Elementary;

impl Operation {
    /// The result for stored operands, as it is stored. [`Operation::Elapsed`] is given the number of scans and the period.
    ///
    /// # Errors
    /// If a divisor is 0, or a number selects no operand.
    ///
    /// # Panics
    /// If there are fewer operands than [`Operation::signature`] wants, or if it is an operation on texts.
    pub fn apply(self, operands: &[u64]) -> Result<u64, Cause> {
        use Operation as O;
        Ok(match self {
            O::Add(of) => arithmetic(of, operands, u64::wrapping_add, Float::add, Float::add),
            O::Subtract(of) => {
                arithmetic(of, operands, u64::wrapping_sub, Float::subtract, Float::subtract)
            }
            O::Multiply(of) => {
                arithmetic(of, operands, u64::wrapping_mul, Float::multiply, Float::multiply)
            }
            O::Divide(Elementary::Real) => binary(operands, f32::divide),
            O::Divide(Elementary::Lreal) => binary(operands, f64::divide),
            O::Divide(of) => quotient(of, operands)?,
            O::Modulo(of) => remainder(of, operands),
            O::Negate(Elementary::Real) => unary(operands, f32::negate),
            O::Negate(Elementary::Lreal) => unary(operands, f64::negate),
            O::Negate(of) => operands[0].wrapping_neg() & of.mask(),
            O::Absolute(Elementary::Real) => unary(operands, f32::absolute),
            O::Absolute(Elementary::Lreal) => unary(operands, f64::absolute),
            O::Absolute(of) => of.signed(operands[0]).unsigned_abs() as u64 & of.mask(),
            O::Minimum(of) => extreme(Comparison::Less, of, operands),
            O::Maximum(of) => extreme(Comparison::Greater, of, operands),
            O::Power(Elementary::Real) => binary(operands, f32::power),
            O::Power(_) => binary(operands, f64::power),
            O::Real(function, of) => real(function, of, operands),
            O::Not(of) => !operands[0] & of.mask(),
            O::And(_) => operands[0] & operands[1],
            O::Or(_) => operands[0] | operands[1],
            O::Xor(_) => operands[0] ^ operands[1],
            O::ShiftLeft(of) => shift(of, operands, u64::checked_shl),
            O::ShiftRight(of) => shift(of, operands, u64::checked_shr),
            O::RotateLeft(of) => rotate(of, operands[0], operands[1] as i64),
            O::RotateRight(of) => rotate(of, operands[0], (operands[1] as i64).wrapping_neg()),
            O::Compare(comparison, of) => {
                u64::from(stands(comparison, of, operands[0], operands[1]))
            }
            O::Select(_) => operands[1 + usize::from(operands[0] != 0)],
            O::Multiplex(_) => {
                let number = operands[0] as i64;
                let chosen = usize::try_from(number).ok();
                let among = &operands[1..];
                *chosen
                    .and_then(|chosen| among.get(chosen))
                    .ok_or(Cause::NoSuchOperand { number, count: among.len() as u64 })?
            }
            O::Convert(from, to) => convert(from, to, operands[0]),
            O::Truncate(from, to) => truncate(from, to, operands[0]),
            O::Reinterpret(_, to) => operands[0] & to.mask(),
            O::Extract { to, at, .. } => operands[0] >> (at & 63) & to.mask(),
            O::Insert { of, part, at } => {
                let at = at & 63;
                let hole = part.mask() << at;
                (operands[0] & !hole | (operands[1] & part.mask()) << at) & of.mask()
            }
            O::FromBcd(from, to) => from_bcd(from, operands[0]) & to.mask(),
            O::ToBcd(_, to) => to_bcd(to, operands[0]),
            O::Elapsed => operands[0].wrapping_mul(operands[1]),
            O::Text(_) => panic!("an operation on texts has no stored operands"),
        })
    }
}

fn arithmetic(
    of: Elementary,
    operands: &[u64],
    integer: fn(u64, u64) -> u64,
    single: fn(f32, f32) -> f32,
    double: fn(f64, f64) -> f64,
) -> u64 {
    match of {
        Elementary::Real => binary(operands, single),
        Elementary::Lreal => binary(operands, double),
        _ => integer(operands[0], operands[1]) & of.mask(),
    }
}

fn real(function: RealFunction, of: Elementary, operands: &[u64]) -> u64 {
    match of {
        Elementary::Real => unary(operands, |value: f32| value.function(function)),
        _ => unary(operands, |value: f64| value.function(function)),
    }
}

/// Quotient, towards 0; it wraps.
fn quotient(of: Elementary, operands: &[u64]) -> Result<u64, Cause> {
    let (dividend, divisor) = (of.signed(operands[0]), of.signed(operands[1]));
    if divisor == 0 {
        return Err(Cause::DivisionByZero { dividend: operands[0], of });
    }
    // Of 65 bits at most, so it does not overflow here.
    Ok((dividend / divisor) as u64 & of.mask())
}

/// Remainder of that quotient, with the sign of the dividend; 0 for a divisor of 0, as the standard has it.
fn remainder(of: Elementary, operands: &[u64]) -> u64 {
    let (dividend, divisor) = (of.signed(operands[0]), of.signed(operands[1]));
    dividend.checked_rem(divisor).unwrap_or(0) as u64 & of.mask()
}

fn extreme(comparison: Comparison, of: Elementary, operands: &[u64]) -> u64 {
    let best = operands
        .iter()
        .copied()
        .reduce(|best, next| if stands(comparison, of, next, best) { next } else { best });
    canonical(of, best.unwrap_or(0))
}

/// A value with the canonical NaN in place of any other.
fn canonical(of: Elementary, stored: u64) -> u64 {
    match of {
        Elementary::Real => f32::unpack(stored).pack(),
        Elementary::Lreal => f64::unpack(stored).pack(),
        _ => stored,
    }
}

/// Whether two stored values stand so to each other.
fn stands(comparison: Comparison, of: Elementary, left: u64, right: u64) -> bool {
    match of {
        Elementary::Real => comparison.holds(f32::unpack(left), f32::unpack(right)),
        Elementary::Lreal => comparison.holds(f64::unpack(left), f64::unpack(right)),
        _ => comparison.holds(of.signed(left), of.signed(right)),
    }
}

fn shift(of: Elementary, operands: &[u64], by: fn(u64, u32) -> Option<u64>) -> u64 {
    let within = operands[1] < u64::from(of.bits());
    let shifted = within.then(|| by(operands[0], operands[1] as u32)).flatten();
    shifted.unwrap_or(0) & of.mask()
}

fn rotate(of: Elementary, value: u64, left: i64) -> u64 {
    let bits = of.bits();
    let left = left.rem_euclid(i64::from(bits)) as u32;
    if left == 0 {
        return value;
    }
    (value << left | value >> (bits - left)) & of.mask()
}

fn convert(from: Elementary, to: Elementary, stored: u64) -> u64 {
    match (from, to) {
        (Elementary::Real, _) => from_real(f32::unpack(stored), to, f64::from),
        (Elementary::Lreal, _) => from_real(f64::unpack(stored), to, |value| value),
        (_, Elementary::Real) => f32::from_integer(from.signed(stored)).pack(),
        (_, Elementary::Lreal) => f64::from_integer(from.signed(stored)).pack(),
        (_, Elementary::Bool) => u64::from(stored != 0),
        _ => from.signed(stored) as u64 & to.mask(),
    }
}

fn from_real<F: Float>(value: F, to: Elementary, wide: fn(F) -> f64) -> u64 {
    match to {
        Elementary::Bool => u64::from(wide(value) != 0.0),
        Elementary::Real => (wide(value) as f32).pack(),
        Elementary::Lreal => wide(value).pack(),
        _ => saturate(to, value.round().truncate()),
    }
}

fn truncate(from: Elementary, to: Elementary, stored: u64) -> u64 {
    saturate(
        to,
        match from {
            Elementary::Real => f32::unpack(stored).truncate(),
            _ => f64::unpack(stored).truncate(),
        },
    )
}

/// The nearest number that the type has, stored.
fn saturate(to: Elementary, number: i128) -> u64 {
    let mask = i128::from(to.mask());
    let (least, greatest) = match to.is_signed() {
        true => (-(mask >> 1) - 1, mask >> 1),
        false => (0, mask),
    };
    number.clamp(least, greatest) as u64 & to.mask()
}

fn from_bcd(from: Elementary, stored: u64) -> u64 {
    let digits = (0..from.bits().div_ceil(4)).rev();
    digits.fold(0_u64, |number, digit| {
        number.wrapping_mul(10).wrapping_add(stored >> (4 * digit) & 0xf)
    })
}

fn to_bcd(to: Elementary, mut number: u64) -> u64 {
    let mut digits = 0;
    for digit in 0..to.bits().div_ceil(4) {
        digits |= (number % 10) << (4 * digit);
        number /= 10;
    }
    digits & to.mask()
}
