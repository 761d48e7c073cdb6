//! What a running cluster says about itself: rates, coverage and latency as far as its journal shows them, and R over the hours to come.
//!
//! Priors are Jeffreys': a rate with k events in T hours is Gamma(k + 1/2, T), a proportion with k of n is Beta(k + 1/2, n - k + 1/2). R is
//! calculated for rates drawn from these, so its interval holds what is not known about them.

use rand::{Rng, RngExt};
use rand_distr::{Beta, Distribution, Gamma};
use serde::Serialize;

use super::estimate::{Interval, beta, chi_squared, significance};
use crate::error::ReliabilityError;
use crate::quantity::{
    Hours, MAXIMUM_HOURS, MINIMUM_HOURS, MINIMUM_PROBABILITY, Probability, grouped, stated,
};
use crate::system::System;
use crate::transient::AfterFailure;

/// Draws of one prediction, at least.
const MINIMUM_DRAWS: usize = 100;

/// Observations of a journal, summed over all stations.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Observed {
    /// Hours from the first record to the last.
    pub hours: f64,
    /// Total operating hours of all stations.
    pub working_hours: f64,
    /// Times of station failures, in hours since the first record, ascending.
    pub failures_at: Vec<f64>,
    /// Number of these failures that the remaining redundancy should have masked.
    pub asked: u64,
    /// Number of those failures that were masked.
    pub masked: u64,
    /// Repairs that were finished.
    pub repairs: u64,
    /// Total repair hours.
    pub repairing_hours: f64,
    /// Times from failures to their detection, in hours.
    pub detection_hours: Vec<f64>,
}

/// Estimates from observations. Intervals are credible intervals.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Outlook {
    /// λ of one box, per hour.
    pub failure_rate: Interval,
    /// μ of one box, per hour.
    pub repair_rate: Interval,
    /// Share of failures that are masked.
    pub coverage: Interval,
    /// Rate of detection, per hour; nothing where no detection was seen.
    pub detection_rate: Option<Interval>,
    /// The hours to come.
    pub ahead_hours: f64,
    /// R over this period, with all stations working now; the estimate is the posterior median.
    pub reliability: Interval,
    /// The probability of working over them: R averaged over what is not known of the rates.
    pub predicted: f64,
    /// Assumptions that the journal speaks against, in sentences.
    pub doubts: Vec<String>,
}

/// Looks `ahead` from what was observed of `system`; its own rates, coverage and detection are replaced by those observed.
///
/// # Errors
/// Observations that contradict themselves, fewer than 100 draws, or a system that has no model.
pub fn outlook(
    observed: &Observed,
    system: &System,
    ahead: Hours,
    confidence: f64,
    draws: usize,
    random: &mut impl Rng,
) -> Result<Outlook, Vec<ReliabilityError>> {
    let one = |error| vec![error];
    let alpha = significance(confidence).map_err(one)?;
    check(observed, draws).map_err(one)?;
    let failures = observed.failures_at.len() as f64;
    let (masked, unmasked) =
        (observed.masked as f64, observed.asked.saturating_sub(observed.masked) as f64);
    let detections = observed.detection_hours.len() as f64;
    let detecting: f64 = observed.detection_hours.iter().sum();
    let detected = detections > 0.0 && detecting > 0.0;
    let rate = |events: f64, hours: f64| -> Result<Interval, ReliabilityError> {
        let end = |probability| Ok(chi_squared(probability, 2.0 * events + 1.0)? / (2.0 * hours));
        Ok(Interval {
            estimate: Some((events + 0.5) / hours),
            lower: end(alpha / 2.0)?,
            upper: Some(end(1.0 - alpha / 2.0)?),
            confidence,
        })
    };
    let coverage = Interval {
        estimate: Some((masked + 0.5) / (masked + unmasked + 1.0)),
        lower: beta(alpha / 2.0, masked + 0.5, unmasked + 0.5).map_err(one)?,
        upper: Some(beta(1.0 - alpha / 2.0, masked + 0.5, unmasked + 0.5).map_err(one)?),
        confidence,
    };
    let law = |events: f64, hours: f64| {
        Gamma::new(events + 0.5, 1.0 / hours).map_err(|error| contradiction(error.to_string()))
    };
    let failing = law(failures, observed.working_hours).map_err(one)?;
    let repairing = law(observed.repairs as f64, observed.repairing_hours).map_err(one)?;
    let noticing = if detected { Some(law(detections, detecting).map_err(one)?) } else { None };
    let covering = Beta::new(masked + 0.5, unmasked + 0.5)
        .map_err(|error| vec![contradiction(error.to_string())])?;
    let mut reliabilities = Vec::with_capacity(draws);
    for _ in 0..draws {
        // A rate may be drawn that is next to nothing; the times that are taken have bounds.
        let time = |rate: f64| {
            let hours = (1.0 / rate).clamp(MINIMUM_HOURS, MAXIMUM_HOURS);
            Hours::new("a time drawn from what was observed", hours)
        };
        let mut drawn = system.clone();
        let mtbf = time(failing.sample(random)).map_err(one)?;
        let mttr = time(repairing.sample(random)).map_err(one)?;
        for kind in drawn.controllers.iter_mut().chain([&mut drawn.understudies]) {
            (kind.mtbf, kind.mttr) = (mtbf, mttr);
        }
        drawn.coverage = Probability::new("the coverage", covering.sample(random)).map_err(one)?;
        drawn.detection = noticing.map(|law| time(law.sample(random))).transpose().map_err(one)?;
        let at = drawn.chain()?.transient(ahead.get(), AfterFailure::Final);
        reliabilities.push(at.map_err(one)?.working);
    }
    reliabilities.sort_by(f64::total_cmp);
    let at = |share: f64| reliabilities[((draws - 1) as f64 * share).round() as usize];
    let predicted = stated(reliabilities.iter().sum::<f64>() / draws as f64);
    let predicted = predicted.ok_or_else(|| {
        let what = format!("the reliability over the next {ahead}, which is below 1e-300,");
        vec![ReliabilityError::OutOfRange { what }]
    })?;
    Ok(Outlook {
        failure_rate: rate(failures, observed.working_hours).map_err(one)?,
        repair_rate: rate(observed.repairs as f64, observed.repairing_hours).map_err(one)?,
        coverage,
        detection_rate: if detected {
            Some(rate(detections, detecting).map_err(one)?)
        } else {
            None
        },
        ahead_hours: ahead.get(),
        reliability: Interval {
            estimate: stated(at(0.5)),
            lower: at(alpha / 2.0),
            upper: Some(at(1.0 - alpha / 2.0).max(MINIMUM_PROBABILITY)),
            confidence,
        },
        predicted,
        doubts: doubts(observed, random),
    })
}

fn contradiction(why: String) -> ReliabilityError {
    ReliabilityError::Measurement { why }
}

fn check(observed: &Observed, draws: usize) -> Result<(), ReliabilityError> {
    let times = [observed.hours, observed.working_hours, observed.repairing_hours];
    if let Some(&hours) = times.iter().find(|hours| !(**hours > 0.0 && hours.is_finite())) {
        return Err(ReliabilityError::Time { what: "a time of observation".into(), hours });
    }
    if let Some(&hours) =
        observed.detection_hours.iter().find(|hours| !(**hours >= 0.0 && hours.is_finite()))
    {
        return Err(ReliabilityError::Time { what: "a time to detect".into(), hours });
    }
    let failures = &observed.failures_at;
    if observed.masked > observed.asked || observed.asked > failures.len() as u64 {
        return Err(contradiction(format!(
            "{} failures were masked of {} that should have been, and {} were seen",
            observed.masked,
            observed.asked,
            failures.len()
        )));
    }
    let inside = failures.iter().all(|at| (0.0..=observed.hours).contains(at));
    if !inside || failures.windows(2).any(|pair| pair[1] < pair[0]) {
        return Err(contradiction("failures must ascend within the time of observation".into()));
    }
    if draws < MINIMUM_DRAWS {
        return Err(ReliabilityError::Count {
            what: "the number of draws".into(),
            count: draws as u64,
            minimum: MINIMUM_DRAWS as u64,
            maximum: u64::MAX,
        });
    }
    Ok(())
}

/// A rate that drifts, and failures that come in bunches: at constant rates, failures are spread evenly.
fn doubts(observed: &Observed, random: &mut impl Rng) -> Vec<String> {
    const SAMPLES: usize = 1_000;
    const UNLIKELY: f64 = 0.01;
    let count = observed.failures_at.len();
    let mut doubts = Vec::new();
    if count < 5 {
        return doubts;
    }
    let drift =
        |at: &[f64], hours: f64| (at.iter().sum::<f64>() / count as f64 / hours - 0.5).abs();
    // The sum of the squared gaps is large where failures come in bunches.
    let bunching = |at: &[f64], hours: f64| {
        let ends = at.iter().copied().chain([hours]);
        let starts = [0.0].into_iter().chain(at.iter().copied());
        ends.zip(starts).map(|(end, start)| ((end - start) / hours).powi(2)).sum::<f64>()
    };
    let found = (
        drift(&observed.failures_at, observed.hours),
        bunching(&observed.failures_at, observed.hours),
    );
    let (mut as_drifting, mut as_bunched) = (0, 0);
    for _ in 0..SAMPLES {
        let mut even: Vec<f64> = (0..count).map(|_| random.random::<f64>()).collect();
        even.sort_by(f64::total_cmp);
        as_drifting += usize::from(drift(&even, 1.0) >= found.0);
        as_bunched += usize::from(bunching(&even, 1.0) >= found.1);
    }
    let p = |as_extreme: usize| (as_extreme + 1) as f64 / (SAMPLES + 1) as f64;
    let early = observed.failures_at.iter().sum::<f64>() / (count as f64) < observed.hours / 2.0;
    if p(as_drifting) < UNLIKELY {
        doubts.push(format!(
            "The rate of failure is not constant: failures {} over {} h (p = {:.4}).",
            if early { "became rarer" } else { "became more frequent" },
            grouped(observed.hours),
            p(as_drifting)
        ));
    }
    if p(as_bunched) < UNLIKELY {
        doubts.push(format!(
            "Failures are not independent: they are clustered (p = {:.4}); the model should include a common cause.",
            p(as_bunched)
        ));
    }
    doubts
}
