//! Where a value is in a process image, and which values its type has.

use understudy_typed::{Elementary, Point};
use understudy_wire::{Image, PointValue};

/// Place of a value in a process image.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct PointPlace {
    /// First bit in u(i) or y(i), counted from 0.
    pub bit: u16,
    /// Type.
    pub of: Elementary,
}

impl PointPlace {
    /// Place of a point.
    pub fn of(point: &Point) -> Self {
        // Images are at most 64 Kbit wide, which is checked elsewhere.
        Self { bit: u16::try_from(point.bit).unwrap_or(u16::MAX), of: point.of }
    }

    /// BOOLs, one for each bit of an image.
    pub fn booleans(width: u16) -> Vec<Self> {
        (0..width).map(|bit| Self { bit, of: Elementary::Bool }).collect()
    }

    /// Whether the signal can have a value: one of its width, and a finite number where it is a REAL or an LREAL.
    pub fn takes(self, value: PointValue) -> bool {
        u32::from(value.width()) == self.of.bits() && is_number(self.of, value.stored())
    }

    /// Stores a value.
    pub fn set(self, image: &mut Image, stored: u64) {
        for bit in 0..self.of.bits() {
            image.set(usize::from(self.bit) + bit as usize, stored >> bit & 1 == 1);
        }
    }

    /// The stored value.
    pub fn get(self, image: &Image) -> u64 {
        let bits = (0..self.of.bits()).map(|at| image.get(usize::from(self.bit) + at as usize));
        bits.rev().fold(0, |value, bit| value << 1 | u64::from(bit))
    }
}

fn is_number(of: Elementary, stored: u64) -> bool {
    !of.is_real() || of.number(stored).is_finite()
}

/// Whether one value is at most the other.
pub fn in_order(of: Elementary, one: u64, other: u64) -> bool {
    if of.is_real() {
        of.number(one) <= of.number(other)
    } else {
        of.signed(one) <= of.signed(other)
    }
}
