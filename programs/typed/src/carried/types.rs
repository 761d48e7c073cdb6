//! Which values of one type are values of another one.

use crate::form::Program;
use crate::types::{Elementary, Type};

/// How a value of one type becomes one of another type that has all its values.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Conversion {
    /// The types are equal.
    Same,
    /// To a type that has all values of the first.
    Wider(Elementary, Elementary),
    /// To a type that has some values of the first: this one must be among them.
    Narrower(Elementary, Elementary),
    /// From the number of a name in one enumeration to its number in another one, and whether that has all names.
    ByName(Vec<(u64, u64)>, bool),
}

impl Conversion {
    /// The value as the new type stores it; none for a number without a name, and for a value that the new type does not have.
    pub(super) fn of(&self, stored: u64) -> Option<u64> {
        match self {
            Self::Same => Some(stored),
            Self::Wider(from, to) => Some(widened(*from, *to, stored)),
            Self::Narrower(from, to) => narrowed(*from, *to, stored),
            Self::ByName(numbers, _) => {
                let mut numbers = numbers.iter();
                numbers.find(|(before, _)| *before == stored).map(|(_, now)| *now)
            }
        }
    }
}

/// The conversion between two types without parts, where one of them has all values of the other.
pub(super) fn conversion(
    (old, from): (&Program, &Type),
    (new, to): (&Program, &Type),
) -> Option<Conversion> {
    match (from, to) {
        (Type::Elementary(from), Type::Elementary(to)) if from == to => Some(Conversion::Same),
        (Type::Elementary(from), Type::Elementary(to)) => {
            let wider = is_wider(*from, *to).then_some(Conversion::Wider(*from, *to));
            wider.or_else(|| is_wider(*to, *from).then_some(Conversion::Narrower(*from, *to)))
        }
        (Type::Enumeration(one, from), Type::Enumeration(other, to)) => {
            let before = &old.enumerations[one.0 as usize].values;
            let now = &new.enumerations[other.0 as usize].values;
            if from == to && before == now {
                return Some(Conversion::Same);
            }
            let numbers = before.iter().filter_map(|(name, number)| {
                let (_, same) = now.iter().find(|(known, _)| known.eq_ignore_ascii_case(name))?;
                Some((*number as u64 & from.mask(), *same as u64 & to.mask()))
            });
            let numbers: Vec<(u64, u64)> = numbers.collect();
            let has_all = numbers.len() == before.len();
            Some(Conversion::ByName(numbers, has_all))
        }
        _ => None,
    }
}

/// A value of one type as one of another type; none where that does not have it.
pub(super) fn converted(from: Elementary, to: Elementary, stored: u64) -> Option<u64> {
    if from == to {
        Some(stored)
    } else if is_wider(from, to) {
        Some(widened(from, to, stored))
    } else {
        is_wider(to, from).then(|| narrowed(from, to, stored)).flatten()
    }
}

/// A value of a type that has all values of `to`; none where this one is not among them.
fn narrowed(from: Elementary, to: Elementary, stored: u64) -> Option<u64> {
    let value = match (from, to) {
        (Elementary::Lreal, Elementary::Real) => {
            u64::from((f64::from_bits(stored) as f32).to_bits())
        }
        (Elementary::Lreal, _) => f64::from_bits(stored) as i64 as u64 & to.mask(),
        (Elementary::Real, _) => f32::from_bits(stored as u32) as i64 as u64 & to.mask(),
        _ => from.signed(stored) as u64 & to.mask(),
    };
    (widened(to, from, value) == stored).then_some(value)
}

/// Whether a type has all values of another one, and means the same by them.
fn is_wider(from: Elementary, to: Elementary) -> bool {
    let wider_bits = from.bits() < to.bits();
    if from.is_integer() && to.is_integer() {
        let ((low, high), (least, most)) = (from.limits(), to.limits());
        return least <= low && high <= most;
    }
    match to {
        // 24 and 53 bits of a whole number are exact.
        Elementary::Real => from.is_integer() && from.bits() <= 16,
        Elementary::Lreal => from == Elementary::Real || from.is_integer() && from.bits() <= 32,
        _ => {
            let are_strings = from.is_bit_string() && to.is_bit_string();
            are_strings && wider_bits && from != Elementary::Bool
        }
    }
}

fn widened(from: Elementary, to: Elementary, stored: u64) -> u64 {
    let number = from.signed(stored);
    match to {
        Elementary::Real => u64::from((number as f32).to_bits()),
        Elementary::Lreal if from == Elementary::Real => {
            f64::from(f32::from_bits(stored as u32)).to_bits()
        }
        Elementary::Lreal => (number as f64).to_bits(),
        _ => number as u64 & to.mask(),
    }
}
