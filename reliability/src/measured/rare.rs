//! Failures that are too rare to wait for: regenerative simulation with balanced failure biasing (Goyal, Shahabuddin, Heidelberger,
//! Nicola, Glynn 1992).
//!
//! Each return to the start begins anew, so MTTF = E[length of a cycle, ended by a failure if one comes]/P(a cycle ends in a failure).
//! The length is sampled as the chain is. For the probability, failures are made as likely as repairs and all equally likely, and each
//! path is weighted with the ratio of its true probability to that with which it was drawn. Times in states are replaced by their means.
//!
//! A transition counts as a failure where it leads away from the start, in steps, or to a failure state.

use rand::{Rng, RngExt};
use serde::Serialize;

use super::estimate::{Interval, normal_quantile};
use crate::chain::Chain;
use crate::error::ReliabilityError;

/// Steps of one cycle, at most; one that is longer makes the estimate refuse.
const MAXIMUM_STEPS: u32 = 1_000_000;

/// Probability of a failure in a state that also has repairs.
const BIAS: f64 = 0.5;

/// MTTF by simulation.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct RareEvent {
    /// Cycles played, half of them biased.
    pub cycles: u64,
    /// MTTF in hours with its interval.
    pub mean_hours: Interval,
    /// Probability that a cycle ends in a failure.
    pub failure_probability: f64,
    /// Mean length of a cycle in hours.
    pub cycle_hours: f64,
    /// Factor by which biasing lowers the variance of that probability, compared with the same number of plain cycles.
    pub variance_reduction: f64,
    /// Half the interval, relative to the estimate.
    pub relative_half_width: f64,
}

/// One transition from a state.
struct Exit {
    to: usize,
    probability: f64,
    biased: f64,
}

/// What a simulated cycle needs of a state.
struct Place {
    mean_hours: f64,
    exits: Vec<Exit>,
}

/// Estimates the MTTF of `chain` from `cycles` cycles, drawn with `random`.
///
/// # Errors
/// The errors of [`Chain::mttf`]; fewer than 100 cycles, no failing cycle, or a cycle without an end.
pub fn rare_event(
    chain: &Chain,
    cycles: u64,
    confidence: f64,
    random: &mut impl Rng,
) -> Result<RareEvent, ReliabilityError> {
    chain.check_fails()?;
    let reach = normal_quantile(confidence)?;
    if cycles < 100 {
        return Err(ReliabilityError::Count {
            what: "the number of cycles".into(),
            count: cycles,
            minimum: 100,
            maximum: u64::MAX,
        });
    }
    let places = places(chain);
    let half = cycles / 2;
    let (mut length, mut weight) = (Moments::default(), Moments::default());
    for _ in 0..half {
        length.add(plain_cycle(chain, &places, random)?);
        weight.add(biased_cycle(chain, &places, random)?);
    }
    let (hours, probability) = (length.mean(), weight.mean());
    if probability <= 0.0 {
        return Err(ReliabilityError::Measurement {
            why: format!("none of {half} biased cycles ended in a failure; take more"),
        });
    }
    let estimate = hours / probability;
    // Delta method; both parts are independent.
    let relative =
        (length.variance() / hours.powi(2) + weight.variance() / probability.powi(2)) / half as f64;
    let margin = reach * relative.sqrt();
    Ok(RareEvent {
        cycles: 2 * half,
        mean_hours: Interval {
            estimate: Some(estimate),
            lower: estimate * (1.0 - margin).max(0.0),
            upper: Some(estimate * (1.0 + margin)),
            confidence,
        },
        failure_probability: probability,
        cycle_hours: hours,
        variance_reduction: probability * (1.0 - probability) / weight.variance(),
        relative_half_width: margin,
    })
}

#[derive(Default)]
struct Moments {
    count: f64,
    mean: f64,
    squares: f64,
}

impl Moments {
    /// Welford's update.
    fn add(&mut self, value: f64) {
        self.count += 1.0;
        let before = value - self.mean;
        self.mean += before / self.count;
        self.squares += before * (value - self.mean);
    }

    fn mean(&self) -> f64 {
        self.mean
    }

    fn variance(&self) -> f64 {
        self.squares / (self.count - 1.0).max(1.0)
    }
}

fn places(chain: &Chain) -> Vec<Place> {
    let levels = chain.levels();
    (0..chain.states())
        .map(|state| {
            let leaving = chain.leaving(state);
            let fails = |to: usize| chain.is_failure(to) || levels[to] > levels[state];
            let failures = chain.successors(state).filter(|(to, _)| fails(*to)).count() as f64;
            let repairing: f64 =
                chain.successors(state).filter(|(to, _)| !fails(*to)).map(|(_, rate)| rate).sum();
            let exits = chain.successors(state).map(|(to, rate)| Exit {
                to,
                probability: rate / leaving,
                biased: if repairing == 0.0 {
                    1.0 / failures
                } else if failures == 0.0 {
                    rate / repairing
                } else if fails(to) {
                    BIAS / failures
                } else {
                    (1.0 - BIAS) * rate / repairing
                },
            });
            Place { mean_hours: 1.0 / leaving, exits: exits.collect() }
        })
        .collect()
}

/// The length of one cycle in hours, each visit counted with its mean.
fn plain_cycle(
    chain: &Chain,
    places: &[Place],
    random: &mut impl Rng,
) -> Result<f64, ReliabilityError> {
    let mut state = chain.start();
    let mut hours = 0.0;
    for _ in 0..MAXIMUM_STEPS {
        let place = &places[state];
        hours += place.mean_hours;
        state = choose(place, random, |exit| exit.probability).to;
        if state == chain.start() || chain.is_failure(state) {
            return Ok(hours);
        }
    }
    Err(endless())
}

/// The weight of one biased cycle: 0 where it comes back without a failure.
fn biased_cycle(
    chain: &Chain,
    places: &[Place],
    random: &mut impl Rng,
) -> Result<f64, ReliabilityError> {
    let mut state = chain.start();
    let mut weight = 1.0;
    for _ in 0..MAXIMUM_STEPS {
        let exit = choose(&places[state], random, |exit| exit.biased);
        weight *= exit.probability / exit.biased;
        state = exit.to;
        if chain.is_failure(state) {
            return Ok(weight);
        }
        if state == chain.start() {
            return Ok(0.0);
        }
    }
    Err(endless())
}

fn choose<'a>(
    place: &'a Place,
    random: &mut impl Rng,
    probability: impl Fn(&Exit) -> f64,
) -> &'a Exit {
    let mut left: f64 = random.random();
    let last = place.exits.len() - 1;
    for exit in &place.exits[..last] {
        left -= probability(exit);
        if left < 0.0 {
            return exit;
        }
    }
    &place.exits[last]
}

fn endless() -> ReliabilityError {
    ReliabilityError::Measurement {
        why: format!(
            "a cycle took more than {MAXIMUM_STEPS} steps; the chain hardly ever comes back to its start"
        ),
    }
}
