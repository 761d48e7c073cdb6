//! Inputs of a program that do not come from its field: operators write them, or another program computes them.

use understudy_wire::{Image, PointValue, ProgramId, Role};

use crate::place::{PointPlace, in_order};

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

    /// Whether values of both mean the same: orders that last, numbers, presses of a button, or values of another group.
    pub fn is_of_kind(&self, other: &Self) -> bool {
        std::mem::discriminant(&self.kind) == std::mem::discriminant(&other.kind)
    }

    /// Bit of u(i) that is TRUE while a value of another group holds.
    pub fn valid(&self) -> Option<u16> {
        match self.kind {
            OperatorInputKind::Group { valid, .. } => valid,
            _ => None,
        }
    }
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
        PointPlace { bit: self.output, ..self.place }.get(outputs)
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
