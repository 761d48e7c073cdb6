//! Program faults: why a program stopped, packed into the first slots of its state, and told to people.
//!
//! ```text
//! slot 0   code in bits 0–7, routine + 1 in bits 8–31 (0: no routine), line in bits 32–63; 0 while the program runs
//! slot 1   first value
//! slot 2   second value
//! ```
//!
//! All replicas of a program fault in the same scan with the same three slots, since they have the same state and the same inputs.

use crate::form::{Program, RoutineId};
use crate::operation::number_text;
use crate::types::Elementary;

/// Why an operation has no result, with the values that explain it. The codes are stable.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Cause {
    /// Code 1: an integer division by 0.
    DivisionByZero {
        /// What was to be divided, as it is stored.
        dividend: u64,
        /// Its type.
        of: Elementary,
    },
    /// Code 2: an index outside its array.
    IndexOutOfRange {
        /// The index.
        index: i64,
        /// The bound that it passed: the first or the last index.
        bound: i64,
    },
    /// Code 3: MUX with a number that none of its operands has.
    NoSuchOperand {
        /// The number.
        number: i64,
        /// How many operands there are, counted from 0.
        count: u64,
    },
    /// Code 4: a text longer than the variable that was to take it.
    TextTooLong {
        /// Its length in bytes.
        length: u64,
        /// What the variable can take.
        capacity: u64,
    },
    /// Code 5: the loops of one scan took more operations than the program's budget.
    BudgetExceeded {
        /// The budget.
        budget: u64,
    },
    /// Code 6: an output of type REAL or LREAL is infinite or NaN, which no actuator can follow.
    OutputNotFinite {
        /// Which one, counted from 0 in the output image.
        output: u64,
        /// Its value, as it is stored.
        value: u64,
    },
    /// Code 7: a VAR_IN_OUT that was never given a variable.
    UnboundReference {
        /// What is found in place of an address.
        address: u64,
    },
    /// Any other code: not of this version.
    Unknown(u8),
}

impl Cause {
    /// Its code.
    pub fn code(self) -> u8 {
        match self {
            Self::DivisionByZero { .. } => 1,
            Self::IndexOutOfRange { .. } => 2,
            Self::NoSuchOperand { .. } => 3,
            Self::TextTooLong { .. } => 4,
            Self::BudgetExceeded { .. } => 5,
            Self::OutputNotFinite { .. } => 6,
            Self::UnboundReference { .. } => 7,
            Self::Unknown(code) => code,
        }
    }

    fn values(self) -> [u64; 2] {
        match self {
            Self::DivisionByZero { dividend, of } => [dividend, of as u64],
            Self::IndexOutOfRange { index, bound } => [index as u64, bound as u64],
            Self::NoSuchOperand { number, count } => [number as u64, count],
            Self::TextTooLong { length, capacity } => [length, capacity],
            Self::BudgetExceeded { budget } => [budget, 0],
            Self::OutputNotFinite { output, value } => [output, value],
            Self::UnboundReference { address } => [address, 0],
            Self::Unknown(_) => [0; 2],
        }
    }

    fn new(code: u8, [first, second]: [u64; 2]) -> Self {
        match code {
            1 => Self::DivisionByZero {
                dividend: first,
                of: *usize::try_from(second)
                    .ok()
                    .and_then(|index| Elementary::ALL.get(index))
                    .unwrap_or(&Elementary::Ulint),
            },
            2 => Self::IndexOutOfRange { index: first as i64, bound: second as i64 },
            3 => Self::NoSuchOperand { number: first as i64, count: second },
            4 => Self::TextTooLong { length: first, capacity: second },
            5 => Self::BudgetExceeded { budget: first },
            6 => Self::OutputNotFinite { output: first, value: second },
            7 => Self::UnboundReference { address: first },
            other => Self::Unknown(other),
        }
    }
}

/// A program fault: why, and where.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Fault {
    /// Why.
    pub cause: Cause,
    /// The routine whose statement could not be executed; `None` for what belongs to no routine.
    pub routine: Option<RoutineId>,
    /// Line of the statement in the text of its routine; 0 where it has none.
    pub line: u32,
}

impl Fault {
    /// Routines that a program may have, so that a fault can name each.
    pub const ROUTINES: usize = (1 << 24) - 1;

    /// The fault that a state holds; `None` while the program runs.
    ///
    /// # Panics
    /// If the state is shorter than [`Program::HEADER`].
    pub fn read(state: &[u64]) -> Option<Self> {
        let first = state[0];
        let routine = (first >> 8 & 0xff_ffff) as u32;
        (first != 0).then(|| Self {
            cause: Cause::new(first as u8, [state[1], state[2]]),
            routine: routine.checked_sub(1).map(RoutineId),
            line: (first >> 32) as u32,
        })
    }

    /// Writes it into the first slots of a state.
    ///
    /// # Panics
    /// If the state is shorter than [`Program::HEADER`].
    pub fn write(&self, state: &mut [u64]) {
        let routine = self.routine.map_or(0, |routine| u64::from(routine.0 & 0xff_ffff) + 1);
        state[0] =
            u64::from(self.cause.code()) | (routine & 0xff_ffff) << 8 | u64::from(self.line) << 32;
        let [first, second] = self.cause.values();
        (state[1], state[2]) = (first, second);
    }

    /// Takes the fault of a state away: the program goes on with the values of before the scan of the fault.
    ///
    /// # Panics
    /// If the state is shorter than [`Program::HEADER`].
    pub fn clear(state: &mut [u64]) {
        state[..3].fill(0);
    }

    /// What an operator reads: where, what, the values.
    pub fn describe(&self, program: &Program) -> String {
        let routine = self.routine.and_then(|routine| program.routines.get(routine.0 as usize));
        let what = self.what(program);
        match routine {
            Some(routine) if self.line > 0 => {
                format!("{}, line {}: {what}", routine.name, self.line)
            }
            Some(routine) => format!("{}: {what}", routine.name),
            None => what,
        }
    }

    fn what(&self, program: &Program) -> String {
        match self.cause {
            Cause::DivisionByZero { dividend, of } => {
                format!("division of {} by zero", number_text::write(of, dividend))
            }
            Cause::IndexOutOfRange { index, bound } if index < bound => {
                format!("index {index} is outside the array, whose first index is {bound}")
            }
            Cause::IndexOutOfRange { index, bound } => {
                format!("index {index} is outside the array, whose last index is {bound}")
            }
            Cause::NoSuchOperand { number, count } => {
                format!(
                    "MUX selects input {number}, but the inputs are 0 to {}",
                    count.saturating_sub(1)
                )
            }
            Cause::TextTooLong { length, capacity } => {
                format!("a text of {length} bytes does not fit into STRING[{capacity}]")
            }
            Cause::BudgetExceeded { budget } => {
                format!("the loops of one scan exceed the budget of {budget} operations")
            }
            Cause::OutputNotFinite { output, value } => {
                let point = usize::try_from(output)
                    .ok()
                    .and_then(|output| program.outputs.iter().nth(output));
                let (name, of) =
                    point.map_or(("?", Elementary::Lreal), |point| (point.name.as_str(), point.of));
                format!(
                    "output {name} is {}, which is not a finite number",
                    number_text::write(of, value)
                )
            }
            Cause::UnboundReference { .. } => {
                "a VAR_IN_OUT variable is used before it is given a variable".to_owned()
            }
            Cause::Unknown(code) => format!("fault {code}, unknown to this version"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_fault_is_read_as_it_was_written() {
        let causes = [
            Cause::DivisionByZero { dividend: 0xfff9, of: Elementary::Int },
            Cause::IndexOutOfRange { index: -3, bound: 1 },
            Cause::NoSuchOperand { number: 7, count: 3 },
            Cause::TextTooLong { length: 81, capacity: 80 },
            Cause::BudgetExceeded { budget: 1_000 },
            Cause::OutputNotFinite { output: 0, value: f64::INFINITY.to_bits() },
            Cause::UnboundReference { address: 0 },
        ];
        let mut program = Program::default();
        program.outputs.push("valve", Elementary::Lreal, 4);
        let told: Vec<String> = causes
            .into_iter()
            .map(|cause| {
                let fault =
                    Fault { cause, routine: Some(RoutineId(0xff_fffd)), line: 4_000_000_000 };
                let mut state = [0; 4];
                fault.write(&mut state);
                assert_eq!(Fault::read(&state), Some(fault));
                fault.describe(&program)
            })
            .collect();
        assert_eq!(
            told,
            [
                "division of -7 by zero",
                "index -3 is outside the array, whose first index is 1",
                "MUX selects input 7, but the inputs are 0 to 2",
                "a text of 81 bytes does not fit into STRING[80]",
                "the loops of one scan exceed the budget of 1000 operations",
                "output valve is INF, which is not a finite number",
                "a VAR_IN_OUT variable is used before it is given a variable",
            ]
        );
        assert_eq!(Fault::read(&[0; 4]), None);
    }
}
