//! Inputs of a program that do not come from its field: operators write them, or another program computes them.

use understudy_typed::{Elementary, Point};
use understudy_wire::{Image, PointValue, ProgramId, Role};

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
    pub(crate) fn set(self, image: &mut Image, stored: u64) {
        for bit in 0..self.of.bits() {
            image.set(usize::from(self.bit) + bit as usize, stored >> bit & 1 == 1);
        }
    }

    /// The stored value.
    pub fn get(self, image: &Image) -> u64 {
        read(image, self.bit, self.of)
    }
}

/// Value of `of` in an image from `bit` on.
fn read(image: &Image, bit: u16, of: Elementary) -> u64 {
    let bits = (0..of.bits()).map(|at| image.get(usize::from(bit) + at as usize));
    bits.rev().fold(0, |value, bit| value << 1 | u64::from(bit))
}

/// Input that operators write.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct OperatorInput {
    /// Place in u(i).
    pub place: PointPlace,
    /// Behaviour of the written value.
    pub kind: OperatorInputKind,
    /// Stored value before the first write.
    pub initial: u64,
    /// Lowest role that may write it.
    pub role: Role,
    /// Whether it keeps its value over a power failure: a level or a setpoint.
    pub retains: bool,
}

/// Behaviour of a value that an operator writes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum OperatorInputKind {
    /// A BOOL that keeps its value until the next write.
    Level,
    /// A BOOL that is TRUE for this number of samples, at least 1, after `TRUE` is written.
    Pulse(u32),
    /// A number between two stored values, both included, that keeps its value until the next write.
    Setpoint {
        /// Lowest value.
        low: u64,
        /// Highest value.
        high: u64,
    },
    /// A signal of another group: a value holds for this number of samples, at least 1, after it is written, and then the
    /// initial value does.
    Group {
        /// Samples.
        stale_after: u32,
        /// Bit of u(i) that is TRUE while a written value holds.
        valid: Option<u16>,
    },
}

/// Reason why an operator input cannot take a value.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ValueMismatch {
    /// The value has another type, or is not a number.
    Type,
    /// The value is outside the limits.
    Limits,
}

impl OperatorInput {
    /// Checks a value against type and limits.
    ///
    /// # Errors
    /// [`ValueMismatch`].
    pub fn check(&self, value: PointValue) -> Result<(), ValueMismatch> {
        if !self.place.takes(value) {
            return Err(ValueMismatch::Type);
        }
        let stored = value.stored();
        match self.kind {
            OperatorInputKind::Level
            | OperatorInputKind::Pulse(_)
            | OperatorInputKind::Group { .. } => Ok(()),
            OperatorInputKind::Setpoint { .. } => {
                self.admits(stored).then_some(()).ok_or(ValueMismatch::Limits)
            }
        }
    }

    /// Whether a stored value of its type is within the limits.
    pub fn admits(&self, stored: u64) -> bool {
        let of = self.place.of;
        match self.kind {
            OperatorInputKind::Setpoint { low, high } => {
                in_order(of, low, stored) && in_order(of, stored, high)
            }
            _ => true,
        }
    }
}

/// The number that a stored REAL or LREAL stands for.
fn real(of: Elementary, stored: u64) -> f64 {
    if of == Elementary::Real {
        f32::from_bits(stored as u32).into()
    } else {
        f64::from_bits(stored)
    }
}

fn is_number(of: Elementary, stored: u64) -> bool {
    !of.is_real() || real(of, stored).is_finite()
}

/// Whether one value is at most the other.
pub fn in_order(of: Elementary, one: u64, other: u64) -> bool {
    if of.is_real() { real(of, one) <= real(of, other) } else { of.signed(one) <= of.signed(other) }
}

/// Input whose value is an output of another program.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct SignalInput {
    /// Program that computes the value.
    pub from: ProgramId,
    /// First bit of the value in the outputs of that program.
    pub output: u16,
    /// Place in u(i), of the type of the output.
    pub place: PointPlace,
    /// Bit of u(i) that is TRUE while the value is at most `stale_after` cycles older than usual.
    pub valid: Option<u16>,
    /// Stored value while it is not.
    pub default: u64,
    /// Cycles for which a value that is missing is held.
    pub stale_after: u32,
}

impl SignalInput {
    /// The stored value in the outputs of the program that computes it.
    pub fn value_in(&self, outputs: &Image) -> u64 {
        read(outputs, self.output, self.place.of)
    }
}

/// Program of which this one reads signals.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct SignalSource {
    /// The program.
    pub program: ProgramId,
    /// Width of its outputs in bits.
    pub outputs: usize,
    /// Bit of its outputs by which it reports a program fault; `None` for a program that has none.
    pub stopped: Option<usize>,
}
