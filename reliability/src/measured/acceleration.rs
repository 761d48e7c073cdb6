//! Campaigns that are faster than life. Failures and repairs are drawn faster by one factor; detection takes the time that it takes, and
//! so weighs more. The bias of that is computed from the model.

use serde::Serialize;

use crate::error::ReliabilityError;
use crate::quantity::Hours;
use crate::system::System;

/// Accelerations past this one say more about the detection than about the plant.
pub const MAXIMUM_ACCELERATION: f64 = 1e4;

/// Effect of an acceleration on the MTTF.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct AccelerationBias {
    /// The acceleration.
    pub factor: f64,
    /// MTTF of the plant in hours, with its detection.
    pub true_hours: f64,
    /// MTTF that the campaign will show, scaled back to the plant's hours.
    pub shown_hours: f64,
    /// Shown over true, minus one; negative: the campaign shows the plant as worse than it is.
    pub relative: f64,
}

/// The bias of a campaign at `factor` times the speed, where detection takes `detection` in both.
///
/// # Errors
/// A factor below 1 or not finite; above [`MAXIMUM_ACCELERATION`] unless `forced`; or a system that has no model.
pub fn acceleration_bias(
    system: &System,
    detection: Hours,
    factor: f64,
    forced: bool,
) -> Result<AccelerationBias, Vec<ReliabilityError>> {
    if !(factor.is_finite() && factor >= 1.0) {
        return Err(vec![ReliabilityError::Measurement {
            why: format!("an acceleration of {factor} is none; it must be 1 or more"),
        }]);
    }
    if factor > MAXIMUM_ACCELERATION && !forced {
        return Err(vec![ReliabilityError::Acceleration { factor, maximum: MAXIMUM_ACCELERATION }]);
    }
    let mean = |hours: f64| -> Result<f64, Vec<ReliabilityError>> {
        let mut system = system.clone();
        let latency =
            Hours::new("the detection in the plant's hours", hours).map_err(|error| vec![error])?;
        system.detection = Some(latency);
        system.chain()?.mttf().map_err(|error| vec![error])
    };
    let true_hours = mean(detection.get())?;
    let shown_hours = mean(detection.get() * factor)?;
    Ok(AccelerationBias {
        factor,
        true_hours,
        shown_hours,
        relative: shown_hours / true_hours - 1.0,
    })
}
