//! A measured campaign of failures compared with the model: estimates with intervals, goodness of fit, contradictions.

use std::collections::BTreeMap;

use rand_pcg::Pcg64;
use rand_pcg::rand_core::SeedableRng;
use serde::Serialize;

use crate::error::ReliabilityError;
use crate::measured::{
    Fit, Interval, Law, Null, RareEvent, Stopped, fit, proportion, rare_event, times_to_failure,
};
use crate::quantity::grouped;
use crate::system::System;

/// Lines of the test log that are kept, at most.
const MAXIMUM_LOG: usize = 50;

/// Points of the running estimate, at most.
const MAXIMUM_RUNNING: usize = 400;

/// One failure of the system.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SystemFailure {
    /// Since the plant was whole, in its own hours (not accelerated).
    pub hours: f64,
    /// The cause, such as `robot after understudy`.
    pub cause: String,
}

/// Results of a campaign.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Campaign {
    /// Where the campaign ran: `simulator` or `processes`.
    pub world: String,
    /// Seed of all random numbers.
    pub seed: u64,
    /// Acceleration compared with the plant.
    pub acceleration: f64,
    /// Failures of the system in the order of their occurrence.
    pub failures: Vec<SystemFailure>,
    /// Hours of runs that were given up before they failed.
    pub censored_hours: Vec<f64>,
    /// Failures of single stations that should have been masked.
    pub box_failures: u64,
    /// Number of these failures that were masked.
    pub masked: u64,
    /// Times from a failure of a box to its detection, in hours of the machine (not scaled).
    pub detection_hours: Vec<f64>,
    /// Times of repairs that were finished, in hours of the plant.
    pub repair_hours: Vec<f64>,
    /// Durations of repairs that the failure of the system interrupted, in hours of the plant.
    pub unfinished_repair_hours: Vec<f64>,
}

/// A campaign compared with the model.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Assessment {
    /// Where the campaign ran.
    pub world: String,
    /// Seed of the campaign.
    pub seed: u64,
    /// Acceleration compared with the plant.
    pub acceleration: f64,
    /// Failures of the system.
    pub failures: usize,
    /// Runs given up before.
    pub censored: usize,
    /// Measured MTTF in hours.
    pub mttf_hours: Interval,
    /// MTTF of the model in hours.
    pub model_hours: f64,
    /// Whether the model lies in the interval.
    pub agrees: bool,
    /// Share of masked station failures.
    pub coverage: Option<Interval>,
    /// Mean time to detect, in hours.
    pub detection_hours: Option<Interval>,
    /// Mean time to repair, in hours.
    pub repair_hours: Option<Interval>,
    /// Does the law of the model fit? Nothing with fewer than 5 failures.
    pub fit: Option<Fit>,
    /// Does its shape fit, whatever the mean is?
    pub shape_fit: Option<Fit>,
    /// The model by simulation with failure biasing.
    pub rare_event: RareEvent,
    /// Number of occurrences of each cause.
    pub causes: BTreeMap<String, u64>,
    /// Estimate with its interval after a number of failures.
    pub running: Vec<(usize, Interval)>,
    /// The failures, the first of them.
    pub log: Vec<SystemFailure>,
    /// Findings that contradict the model, as sentences.
    pub doubts: Vec<String>,
}

/// Holds `campaign` against the model of `system`. `seed` is that of the samples for the p-values.
///
/// # Errors
/// A model that cannot be had, or times that are no times.
pub fn assess(
    campaign: &Campaign,
    system: &System,
    confidence: f64,
    seed: u64,
) -> Result<Assessment, Vec<ReliabilityError>> {
    let one = |error| vec![error];
    let chain = system.chain()?;
    let law = Law::of_chain(&chain).map_err(one)?;
    let mut random = Pcg64::seed_from_u64(seed);
    let hours: Vec<f64> = campaign.failures.iter().map(|failure| failure.hours).collect();
    let mttf_hours = times_to_failure(&hours, &campaign.censored_hours, confidence).map_err(one)?;
    let tested = |null, random: &mut Pcg64| {
        let enough = hours.len() >= 5 && campaign.censored_hours.is_empty();
        enough.then(|| fit(&hours, &law, null, 1_000, random)).transpose().map_err(one)
    };
    let mean_of = |times: &[f64], unfinished: &[f64]| {
        let total = (!times.is_empty()).then_some(times);
        total.map(|times| times_to_failure(times, unfinished, confidence)).transpose().map_err(one)
    };
    let mut causes = BTreeMap::new();
    for failure in &campaign.failures {
        *causes.entry(failure.cause.clone()).or_insert(0) += 1;
    }
    let coverage = match campaign.box_failures {
        0 => None,
        trials => Some(proportion(campaign.masked, trials, confidence).map_err(one)?),
    };
    let mut found = Assessment {
        world: campaign.world.clone(),
        seed: campaign.seed,
        acceleration: campaign.acceleration,
        failures: hours.len(),
        censored: campaign.censored_hours.len(),
        model_hours: law.mean(),
        agrees: mttf_hours.covers(law.mean()),
        mttf_hours,
        coverage,
        detection_hours: mean_of(&campaign.detection_hours, &[])?,
        repair_hours: mean_of(&campaign.repair_hours, &campaign.unfinished_repair_hours)?,
        fit: tested(Null::Specified, &mut random)?,
        shape_fit: tested(Null::ScaleFitted, &mut random)?,
        rare_event: rare_event(&chain, 100_000, confidence, &mut random).map_err(one)?,
        causes,
        running: running(&hours, confidence).map_err(one)?,
        log: campaign.failures.iter().take(MAXIMUM_LOG).cloned().collect(),
        doubts: Vec::new(),
    };
    found.doubts = doubts(&found, system);
    Ok(found)
}

/// The estimate after 1, 2, ... failures, thinned out.
fn running(hours: &[f64], confidence: f64) -> Result<Vec<(usize, Interval)>, ReliabilityError> {
    let every = hours.len().div_ceil(MAXIMUM_RUNNING).max(1);
    let mut total = 0.0;
    let mut points = Vec::new();
    for (place, time) in hours.iter().enumerate() {
        total += time;
        let count = place + 1;
        if count % every == 0 || count == hours.len() {
            let interval =
                crate::measured::mean_time(count as u64, total, Stopped::AtFailure, confidence)?;
            points.push((count, interval));
        }
    }
    Ok(points)
}

fn doubts(found: &Assessment, system: &System) -> Vec<String> {
    let mut doubts = Vec::new();
    if !found.agrees {
        doubts.push(format!(
            "The model's MTTF of {} h is outside of the measured interval.",
            grouped(found.model_hours)
        ));
    }
    if let Some(coverage) = &found.coverage
        && !coverage.covers(system.coverage.get())
    {
        doubts.push(format!(
            "The model takes a coverage of {}, which is outside of the measured interval.",
            system.coverage.get()
        ));
    }
    for (fit, what) in [
        (&found.fit, "The times do"),
        (&found.shape_fit, "The shape of the times, whatever their mean is, does"),
    ] {
        if let Some(fit) = fit
            && fit.anderson_darling_p < 0.01
        {
            doubts.push(format!(
                "{what} not fit the law of the model: p = {:.4}.",
                fit.anderson_darling_p
            ));
        }
    }
    doubts
}
