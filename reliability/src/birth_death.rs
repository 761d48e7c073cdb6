//! Chains that go up and down one step at a time and fail from any level: the lumped duplex system and its like, in O(n) by the same
//! elimination as in [`Chain::mttf`](crate::Chain::mttf), without a matrix.

use crate::error::ReliabilityError;

/// Rates out of one level, per hour.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Level {
    /// To the next level, one more failure that is tolerated.
    pub up: f64,
    /// To the level before, one repair.
    pub down: f64,
    /// To the failure of the system.
    pub lethal: f64,
}

/// Mean time in hours from the first level to the failure. `level(k)` gives the rates out of level k, for k from 0 to `levels` - 1;
/// those that lead out of the range are not looked at.
///
/// Level k is taken out after all above it: a visit to k lasts w(k)/(d(k) + K(k)), where K and w include what happens above.
///
/// # Errors
/// No level, a rate that is negative or not finite, or no way to the failure.
pub fn birth_death_mttf(
    levels: usize,
    level: impl Fn(usize) -> Level,
) -> Result<f64, ReliabilityError> {
    let (mut lethal, mut weight, mut share) = (0.0, 0.0, 0.0);
    for k in (0..levels).rev() {
        let rates = level(k);
        for (what, value) in [
            ("up", rates.up),
            ("down", rates.down),
            ("lethal", rates.lethal),
        ] {
            if !(value.is_finite() && value >= 0.0) {
                return Err(ReliabilityError::Rate {
                    what: format!("the rate {what} of level {k}"),
                    per_hour: value,
                });
            }
        }
        if k + 1 < levels {
            lethal = rates.lethal + rates.up * lethal * share;
            weight = 1.0 + rates.up * weight * share;
        } else {
            lethal = rates.lethal;
            weight = 1.0;
        }
        let leaving = lethal + if k > 0 { rates.down } else { 0.0 };
        share = 1.0 / leaving;
        if leaving <= 0.0 {
            return Err(ReliabilityError::NeverFails {
                state: format!("level {k}"),
            });
        }
    }
    if levels == 0 {
        return Err(ReliabilityError::NoFailureState);
    }
    let mean = weight / lethal;
    if mean.is_finite() {
        Ok(mean)
    } else {
        Err(ReliabilityError::OutOfRange {
            what: "the mean time to failure".into(),
        })
    }
}
