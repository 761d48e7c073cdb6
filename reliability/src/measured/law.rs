//! The law that a model implies for the time to failure, as a table: its distribution function at ascending times, and back.
//!
//! Between two entries the hazard is taken as even, so that ln R is a straight line; the table is made fine enough for tests of fit.

use crate::chain::Chain;
use crate::error::ReliabilityError;
use crate::transient::AfterFailure;

/// Entries of a table.
const ENTRIES: usize = 2_000;

/// A law of times to failure, in hours.
#[derive(Debug, Clone, PartialEq)]
pub struct Law {
    mean: f64,
    hours: Vec<f64>,
    /// -ln R(t), which ascends from 0.
    exposure: Vec<f64>,
}

impl Law {
    /// The law of the first failure of a chain.
    ///
    /// # Errors
    /// The errors of [`Chain::mttf`] and [`Chain::transients`].
    pub fn of_chain(chain: &Chain) -> Result<Self, ReliabilityError> {
        let mean = chain.mttf()?;
        let hours = times(mean);
        let found = chain.transients(&hours, AfterFailure::Final)?;
        let exposure = found.iter().map(|at| -at.log_working()).collect();
        Ok(Self { mean, hours, exposure })
    }

    /// Mean, in hours.
    pub fn mean(&self) -> f64 {
        self.mean
    }

    /// The probability of a failure before `hours`.
    pub fn unreliability(&self, hours: f64) -> f64 {
        -(-between(&self.hours, &self.exposure, hours)).exp_m1()
    }

    /// The time before which a failure has the probability `probability`.
    pub fn quantile(&self, probability: f64) -> f64 {
        between(&self.exposure, &self.hours, -(-probability).ln_1p())
    }
}

/// Even in the bulk and closer at the start, where the hazard rises.
fn times(mean: f64) -> Vec<f64> {
    (0..ENTRIES)
        .map(|entry| {
            let share = entry as f64 / (ENTRIES - 1) as f64;
            12.0 * mean * share * share
        })
        .collect()
}

/// The straight line through the table at `x`; past its end, the last piece goes on.
fn between(from: &[f64], to: &[f64], x: f64) -> f64 {
    if x <= 0.0 {
        return 0.0;
    }
    let after = from.partition_point(|entry| *entry < x).clamp(1, from.len() - 1);
    let (x0, x1) = (from[after - 1], from[after]);
    let (y0, y1) = (to[after - 1], to[after]);
    if x1 > x0 { y0 + (y1 - y0) * (x - x0) / (x1 - x0) } else { y1 }
}
