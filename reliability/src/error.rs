//! What is wrong with a question about reliability. Every error carries the value concerned and has a code for people.

/// A number in a message: very large and very small ones with an exponent.
fn written(value: f64) -> String {
    let size = value.abs();
    if size == 0.0 || !size.is_finite() || (1e-6..1e16).contains(&size) {
        value.to_string()
    } else {
        format!("{value:e}")
    }
}

/// A question that has no answer, or none of the precision asked for.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ReliabilityError {
    /// A time that is zero, negative, infinite, not a number, or beyond [`MINIMUM_HOURS`](crate::MINIMUM_HOURS) and
    /// [`MAXIMUM_HOURS`](crate::MAXIMUM_HOURS).
    #[error(
        "U0701: {what} is {} hours; a time must be positive and between 1e-12 and 1e15 hours",
        written(*hours)
    )]
    Time {
        /// Name of the time.
        what: String,
        /// The given value.
        hours: f64,
    },
    /// A rate that is zero, negative, infinite or not a number.
    #[error(
        "U0702: {what} is {} per hour; a rate must be positive and finite",
        written(*per_hour)
    )]
    Rate {
        /// Name of the rate.
        what: String,
        /// The given value.
        per_hour: f64,
    },
    /// A probability outside [0, 1].
    #[error("U0703: {what} is {}; a probability lies between 0 and 1", written(*value))]
    Probability {
        /// Name of the probability.
        what: String,
        /// The given value.
        value: f64,
    },
    /// A count that is too small or too large.
    #[error("U0704: {what} is {count}; it must be between {minimum} and {maximum}")]
    Count {
        /// Name of the count.
        what: String,
        /// The given value.
        count: u64,
        /// Lower bound.
        minimum: u64,
        /// Upper bound.
        maximum: u64,
    },
    /// A text that is no time.
    #[error("U0705: {text:?} is not a time: {why}")]
    TimeText {
        /// The given text.
        text: String,
        /// The reason.
        why: String,
    },
    /// The failure is never reached, so there is no time to it.
    #[error("U0706: the chain has no failure state; without one there is no time to failure")]
    NoFailureState,
    /// Some reachable state cannot come to a failure: the mean time is infinite.
    #[error(
        "U0707: no failure can be reached from the state {state}, so the mean time to failure is infinite"
    )]
    NeverFails {
        /// One such state.
        state: String,
    },
    /// A state that cannot be reached.
    #[error("U0708: the state {state} cannot be reached from where the chain starts")]
    Unreachable {
        /// One such state.
        state: String,
    },
    /// A transition or a start names a state that is not there.
    #[error("U0709: there is no state {place}; the chain has {states} states, counted from 0")]
    NoSuchState {
        /// The given number of the state.
        place: usize,
        /// Number of states.
        states: usize,
    },
    /// A transition from a state to itself changes nothing.
    #[error("U0710: the transition from the state {state} leads to itself")]
    SelfLoop {
        /// The state.
        state: String,
    },
    /// The chain does not return to its start in the long run.
    #[error(
        "U0711: the chain has no steady state: the state {state} cannot be reached again once it is left"
    )]
    NotErgodic {
        /// One such state.
        state: String,
    },
    /// More states than memory or time allow.
    #[error("U0712: the model has more than {maximum} states")]
    TooManyStates {
        /// The bound.
        maximum: usize,
    },
    /// More steps than time allows.
    #[error(
        "U0713: {steps:.3e} steps are needed to reach {hours} hours with rates up to {per_hour} per hour; at most {maximum:.0e} are taken"
    )]
    TooManySteps {
        /// Steps needed.
        steps: f64,
        /// Time asked for.
        hours: f64,
        /// Largest rate of leaving a state.
        per_hour: f64,
        /// The bound.
        maximum: f64,
    },
    /// The iteration ended before the precision was reached.
    #[error(
        "U0714: a relative precision of {asked:e} was asked for and only {reached:e} was reached"
    )]
    Precision {
        /// Asked for, relative.
        asked: f64,
        /// Reached, relative.
        reached: f64,
    },
    /// A result that no double holds.
    #[error("U0715: {what} is outside of the numeric range")]
    OutOfRange {
        /// Name of the result.
        what: String,
    },
    /// A measurement that allows no estimate.
    #[error("U0716: {why}")]
    Measurement {
        /// The missing or contradictory item.
        why: String,
    },
    /// An acceleration that hides what detection and repair really cost.
    #[error(
        "U0717: an acceleration of {factor} is more than {maximum}; detection is not accelerated, so the result would be about the detection (force it if that is wanted)"
    )]
    Acceleration {
        /// The given acceleration.
        factor: f64,
        /// The bound.
        maximum: f64,
    },
    /// Controllers that cannot be shared out in equal groups.
    #[error("U0718: {controllers} controllers do not divide into {groups} equal groups")]
    Groups {
        /// Controllers in all.
        controllers: u64,
        /// Groups asked for.
        groups: u64,
    },
    /// Invalid text of stations or of a shared part.
    #[error("U0720: {text:?} names no boxes with their times: {why}")]
    BoxText {
        /// The given text.
        text: String,
        /// The reason.
        why: String,
    },
    /// A drawing that the plotting library refused, or a template that does not fit.
    #[error("U0719: the report could not be made: {why}")]
    Report {
        /// Message of the library.
        why: String,
    },
}

impl ReliabilityError {
    /// Stable code for people.
    pub fn code(&self) -> &'static str {
        match self {
            Self::Time { .. } => "U0701",
            Self::Rate { .. } => "U0702",
            Self::Probability { .. } => "U0703",
            Self::Count { .. } => "U0704",
            Self::TimeText { .. } => "U0705",
            Self::NoFailureState => "U0706",
            Self::NeverFails { .. } => "U0707",
            Self::Unreachable { .. } => "U0708",
            Self::NoSuchState { .. } => "U0709",
            Self::SelfLoop { .. } => "U0710",
            Self::NotErgodic { .. } => "U0711",
            Self::TooManyStates { .. } => "U0712",
            Self::TooManySteps { .. } => "U0713",
            Self::Precision { .. } => "U0714",
            Self::OutOfRange { .. } => "U0715",
            Self::Measurement { .. } => "U0716",
            Self::Acceleration { .. } => "U0717",
            Self::Groups { .. } => "U0718",
            Self::Report { .. } => "U0719",
            Self::BoxText { .. } => "U0720",
        }
    }
}

#[cfg(test)]
mod tests {
    use super::written;

    #[test]
    fn numbers_of_any_size_are_short() {
        let check = |value: f64, expected: &str| assert_eq!(written(value), expected);
        check(-4.0, "-4");
        check(0.0, "0");
        check(1e300, "1e300");
        check(-2.5e-200, "-2.5e-200");
        check(1e15, "1000000000000000");
        check(f64::NAN, "NaN");
        check(f64::INFINITY, "inf");
    }
}
