//! Alarms on signals of the programs, in the sense of ISA-18.2.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use understudy_remote_io::in_order;
use understudy_typed::{Elementary, Point};
use understudy_wire::ProgramId;

/// Alarms of a cluster, at most.
pub const MAXIMUM_ALARMS: usize = 1000;

/// Urgency of the operator's response.
#[derive(
    Debug,
    Clone,
    Copy,
    PartialEq,
    Eq,
    PartialOrd,
    Ord,
    Hash,
    Default,
    Serialize,
    Deserialize,
    JsonSchema,
)]
#[serde(rename_all = "kebab-case")]
pub enum Priority {
    /// Response within the shift.
    #[default]
    Low,
    /// Prompt response.
    Medium,
    /// Rapid response.
    High,
    /// Immediate response.
    Critical,
}

impl Priority {
    /// All priorities, the lowest first.
    pub const ALL: [Self; 4] = [Self::Low, Self::Medium, Self::High, Self::Critical];

    /// The priority as files and JSON write it.
    pub fn word(self) -> &'static str {
        crate::format::PRIORITIES[self as usize]
    }
}

/// Condition of an alarm. Limits are stored values of the type of the signal.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum AlarmCondition {
    /// The signal, a BOOL or an enumeration, has this stored value.
    Is(u64),
    /// The signal is above the limit.
    Above {
        /// The condition begins above this value.
        limit: u64,
        /// It is over at or below this value: the limit minus the hysteresis.
        over: u64,
    },
    /// The signal is below the limit.
    Below {
        /// The condition begins below this value.
        limit: u64,
        /// It is over at or above this value: the limit plus the hysteresis.
        over: u64,
    },
}

impl AlarmCondition {
    /// Whether the condition holds for a value, where it held or not `before`; nothing where that is unknown: the value is not a number, or it is
    /// within the hysteresis and the condition before is unknown.
    pub fn holds(&self, of: Elementary, value: u64, before: Option<bool>) -> Option<bool> {
        let at_most = |one, other| in_order(of, one, other);
        let (begins, ends) = match *self {
            Self::Is(expected) => return Some(value == expected),
            Self::Above { limit, over } => (!at_most(value, limit), at_most(value, over)),
            Self::Below { limit, over } => (!at_most(limit, value), at_most(over, value)),
        };
        match (begins, ends) {
            _ if !at_most(value, value) => None,
            (true, _) => Some(true),
            (_, true) => Some(false),
            (false, false) => before,
        }
    }
}

/// An alarm on a signal of a program.
#[derive(Debug, Clone, PartialEq)]
pub struct AlarmDeclaration {
    /// Its name, unique among the alarms.
    pub name: String,
    /// The program of the signal.
    pub program: ProgramId,
    /// The input or output of the program.
    pub point: Point,
    /// Whether the signal is an output.
    pub is_output: bool,
    /// When it is active.
    pub condition: AlarmCondition,
    /// Cycles for which the condition must hold before the alarm is active.
    pub on_delay: u32,
    /// Cycles for which the condition must be over before the alarm is.
    pub off_delay: u32,
    /// Its priority.
    pub priority: Priority,
    /// What is wrong.
    pub text: String,
    /// What the operator should do.
    pub action: Option<String>,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_condition_holds_until_the_hysteresis_is_passed() {
        let real = |value: f32| u64::from(value.to_bits());
        let of = Elementary::Real;
        let above = AlarmCondition::Above { limit: real(90.0), over: real(85.0) };
        assert_eq!(above.holds(of, real(90.0), Some(false)), Some(false));
        assert_eq!(above.holds(of, real(90.5), Some(false)), Some(true));
        assert_eq!(above.holds(of, real(86.0), Some(true)), Some(true));
        assert_eq!(above.holds(of, real(86.0), None), None);
        assert_eq!(above.holds(of, real(85.0), Some(true)), Some(false));
        assert_eq!(above.holds(of, real(f32::NAN), Some(true)), None);
        let of = Elementary::Int;
        let below = AlarmCondition::Below { limit: (-3i16) as u16 as u64, over: 2 };
        assert_eq!(below.holds(of, (-4i16) as u16 as u64, None), Some(true));
        assert_eq!(below.holds(of, 1, Some(true)), Some(true));
        assert_eq!(below.holds(of, 2, Some(true)), Some(false));
        let is = AlarmCondition::Is(0);
        assert_eq!(is.holds(Elementary::Bool, 0, None), Some(true));
    }
}
