//! Estimates with exact intervals: chi-squared for mean times, Clopper-Pearson for proportions.

use serde::Serialize;
use statrs::distribution::{Beta, ChiSquared, ContinuousCDF, Normal};

use crate::error::ReliabilityError;
use crate::quantity::Probability;

/// An estimate and the interval that holds the true value in at least the share `confidence` of all measurements.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Interval {
    /// The estimate; nothing where the measurement shows only a bound.
    pub estimate: Option<f64>,
    /// Lower end.
    pub lower: f64,
    /// Upper limit, if any.
    pub upper: Option<f64>,
    /// Two-sided.
    pub confidence: f64,
}

impl Interval {
    /// Whether a value lies inside.
    pub fn covers(&self, value: f64) -> bool {
        value >= self.lower && self.upper.is_none_or(|upper| value <= upper)
    }
}

/// The end of a measurement.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Stopped {
    /// The last of the failures that were waited for.
    AtFailure,
    /// A time that was set before; the last run is censored.
    AtTime,
}

/// MTTF from `failures` in `hours` of observation, all runs together, with a chi-squared interval.
///
/// With r failures in T hours it is [2T/χ²(1 - α/2; 2r), 2T/χ²(α/2; 2r)]; stopped at a time, the lower end takes 2r + 2 degrees of
/// freedom, and without any failure it is the one-sided bound 2T/χ²(1 - α; 2) = T/ln(1/α). It is exact for exponential times; the sum
/// of two exponential phases varies less, so there it covers a little more than it promises.
///
/// # Errors
/// No hours, no failure where one ended the measurement, or a confidence that is not inside (0, 1).
pub fn mean_time(
    failures: u64,
    hours: f64,
    stopped: Stopped,
    confidence: f64,
) -> Result<Interval, ReliabilityError> {
    let alpha = significance(confidence)?;
    if !(hours > 0.0 && hours.is_finite()) {
        return Err(ReliabilityError::Time { what: "the time of observation".into(), hours });
    }
    if failures == 0 {
        if stopped == Stopped::AtFailure {
            return Err(ReliabilityError::Measurement {
                why: "the measurement ended at a failure, and none was counted".into(),
            });
        }
        return Ok(Interval {
            estimate: None,
            lower: hours / -alpha.ln(),
            upper: None,
            confidence,
        });
    }
    let r = failures as f64;
    let more = if stopped == Stopped::AtTime { 2.0 } else { 0.0 };
    Ok(Interval {
        estimate: Some(hours / r),
        lower: 2.0 * hours / chi_squared(1.0 - alpha / 2.0, 2.0 * r + more)?,
        upper: Some(2.0 * hours / chi_squared(alpha / 2.0, 2.0 * r)?),
        confidence,
    })
}

/// MTTF from the times of runs that ended in a failure and of those that were given up before one.
///
/// # Errors
/// The errors of [`mean_time`], and a time that is negative or not finite.
pub fn times_to_failure(
    failed_hours: &[f64],
    censored_hours: &[f64],
    confidence: f64,
) -> Result<Interval, ReliabilityError> {
    for &hours in failed_hours.iter().chain(censored_hours) {
        if !(hours >= 0.0 && hours.is_finite()) {
            return Err(ReliabilityError::Time { what: "the time of a run".into(), hours });
        }
    }
    let hours = failed_hours.iter().chain(censored_hours).sum();
    let stopped = if censored_hours.is_empty() { Stopped::AtFailure } else { Stopped::AtTime };
    mean_time(failed_hours.len() as u64, hours, stopped, confidence)
}

/// A proportion, such as coverage, from `successes` in `trials`: the exact (Clopper-Pearson) interval.
///
/// # Errors
/// No trial, more successes than trials, or a confidence that is not inside (0, 1).
pub fn proportion(
    successes: u64,
    trials: u64,
    confidence: f64,
) -> Result<Interval, ReliabilityError> {
    let alpha = significance(confidence)?;
    if trials == 0 || successes > trials {
        return Err(ReliabilityError::Measurement {
            why: format!("{successes} successes in {trials} trials give no proportion"),
        });
    }
    let (k, n) = (successes as f64, trials as f64);
    let lower = match successes {
        0 => 0.0,
        // Closed: I(x; n, 1) = x^n.
        _ if successes == trials => ((alpha / 2.0).ln() / n).exp(),
        _ => beta(alpha / 2.0, k, n - k + 1.0)?,
    };
    let upper = match successes {
        0 => -((alpha / 2.0).ln() / n).exp_m1(),
        _ if successes == trials => 1.0,
        _ => beta(1.0 - alpha / 2.0, k + 1.0, n - k)?,
    };
    Ok(Interval { estimate: Some(k / n), lower, upper: Some(upper), confidence })
}

/// α of a confidence 1 - α.
pub(crate) fn significance(confidence: f64) -> Result<f64, ReliabilityError> {
    let confidence = Probability::new("the confidence", confidence)?.get();
    if confidence == 0.0 || confidence == 1.0 {
        return Err(ReliabilityError::Measurement {
            why: format!("a confidence of {confidence} says nothing; take one between 0 and 1"),
        });
    }
    Ok(1.0 - confidence)
}

/// Number of standard errors by which a two-sided interval extends to each side.
pub(crate) fn normal_quantile(confidence: f64) -> Result<f64, ReliabilityError> {
    let alpha = significance(confidence)?;
    Ok(Normal::standard().inverse_cdf(1.0 - alpha / 2.0))
}

/// The quantile of the chi-squared law.
pub(crate) fn chi_squared(probability: f64, freedom: f64) -> Result<f64, ReliabilityError> {
    let law = ChiSquared::new(freedom)
        .map_err(|error| ReliabilityError::Measurement { why: error.to_string() })?;
    Ok(polished(law.inverse_cdf(probability), probability, |x| (law.cdf(x), density(&law, x))))
}

/// The quantile of the beta law.
pub(crate) fn beta(probability: f64, a: f64, b: f64) -> Result<f64, ReliabilityError> {
    let law = Beta::new(a, b)
        .map_err(|error| ReliabilityError::Measurement { why: error.to_string() })?;
    Ok(polished(law.inverse_cdf(probability), probability, |x| (law.cdf(x), density(&law, x))))
}

fn density(law: &impl statrs::distribution::Continuous<f64, f64>, x: f64) -> f64 {
    law.pdf(x)
}

/// A quantile, made better by Newton's steps: the library stops at its own precision.
fn polished(mut x: f64, probability: f64, law: impl Fn(f64) -> (f64, f64)) -> f64 {
    for _ in 0..4 {
        let (reached, slope) = law(x);
        let step = (reached - probability) / slope;
        if !step.is_finite() || step.abs() > 0.1 * x {
            break;
        }
        x -= step;
    }
    x
}
