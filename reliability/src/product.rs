//! Many unequal units, each up or down by itself: 2^n states that are never written down as a matrix.
//!
//! The state is a bit mask, 1 where a unit is down. The generator is a sum over units, so a step of uniformisation is one pass over
//! pairs of states for each unit. Where every state may be passed through (availability, or units that are not repaired), the number
//! of units that are down is Poisson-binomial and no vector is needed at all.

use serde::Serialize;

use crate::error::ReliabilityError;
use crate::poisson_weights::PoissonWeights;
use crate::quantity::rate;

/// Units of one product, at most: 2^24 states.
pub const MAXIMUM_UNITS: usize = 24;

/// Steps times states times units, at most.
const MAXIMUM_WORK: f64 = 4e11;

/// States that are worked on while they are in the nearest cache.
const BLOCK_BITS: usize = 11;

/// One unit. Rates per hour; a repair rate of 0 means that it is not repaired.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Unit {
    /// Of failing while it is up.
    pub failure_rate: f64,
    /// Of coming back while it is down.
    pub repair_rate: f64,
}

impl Unit {
    /// A checked unit.
    ///
    /// # Errors
    /// A failure rate that is not positive and finite, or a repair rate that is negative or not finite.
    pub fn new(failure_rate: f64, repair_rate: f64) -> Result<Self, ReliabilityError> {
        rate("the failure rate of a unit", failure_rate)?;
        if repair_rate != 0.0 {
            rate("the repair rate of a unit", repair_rate)?;
        }
        Ok(Self {
            failure_rate,
            repair_rate,
        })
    }

    /// Probability that it is down at `hours`, having been up at 0.
    pub fn down(&self, hours: f64) -> f64 {
        let sum = self.failure_rate + self.repair_rate;
        self.failure_rate / sum * -(-sum * hours).exp_m1()
    }
}

/// Probabilities that 0, 1, ..., n of independent units are down, where `down` gives each unit's (Poisson-binomial).
pub fn poisson_binomial(down: &[f64]) -> Vec<f64> {
    let mut count = vec![0.0; down.len() + 1];
    count[0] = 1.0;
    for (units, &probability) in down.iter().enumerate() {
        for k in (0..=units).rev() {
            count[k + 1] += count[k] * probability;
            count[k] *= 1.0 - probability;
        }
    }
    count
}

/// Probability that at most `tolerated` of units are down at `hours`. It is the reliability where no unit is repaired, and the point
/// availability where they are.
pub fn at_most_down(units: &[Unit], tolerated: usize, hours: f64) -> f64 {
    let down: Vec<f64> = units.iter().map(|unit| unit.down(hours)).collect();
    poisson_binomial(&down)
        .into_iter()
        .take(tolerated + 1)
        .sum()
}

/// R(t) of a system of `units` that has failed for good as soon as `works`, given the mask of units that are down, is false; by
/// uniformisation without a matrix.
///
/// # Errors
/// No unit or too many, a time that is not finite or negative, or more steps than time allows.
pub fn product_reliability(
    units: &[Unit],
    works: impl Fn(u32) -> bool,
    hours: f64,
) -> Result<f64, ReliabilityError> {
    if units.is_empty() || units.len() > MAXIMUM_UNITS {
        return Err(ReliabilityError::Count {
            what: "the number of units".into(),
            count: units.len() as u64,
            minimum: 1,
            maximum: MAXIMUM_UNITS as u64,
        });
    }
    if !hours.is_finite() || hours < 0.0 {
        return Err(ReliabilityError::Time {
            what: "the mission".into(),
            hours,
        });
    }
    let states = 1_usize << units.len();
    let works: Vec<bool> = (0..states as u32).map(works).collect();
    if !works[0] {
        return Ok(0.0);
    }
    let fastest = fastest(units, &works);
    let steps = fastest * hours;
    let work = steps * (states * units.len()) as f64;
    if work > MAXIMUM_WORK {
        return Err(ReliabilityError::TooManySteps {
            steps,
            hours,
            per_hour: fastest,
            maximum: MAXIMUM_WORK / (states * units.len()) as f64,
        });
    }
    Ok(uniformise(units, &works, fastest, hours))
}

/// The largest rate of leaving a state in which the system works.
fn fastest(units: &[Unit], works: &[bool]) -> f64 {
    let mut fastest: f64 = 0.0;
    for mask in (0..works.len()).filter(|mask| works[*mask]) {
        fastest = fastest.max(leaving(units, mask));
    }
    fastest
}

fn leaving(units: &[Unit], mask: usize) -> f64 {
    let rates = units.iter().enumerate().map(|(bit, unit)| {
        if mask >> bit & 1 == 1 {
            unit.repair_rate
        } else {
            unit.failure_rate
        }
    });
    rates.sum()
}

fn uniformise(units: &[Unit], works: &[bool], fastest: f64, hours: f64) -> f64 {
    let states = works.len();
    let scaled: Vec<(f64, f64)> = units
        .iter()
        .map(|unit| (unit.failure_rate / fastest, unit.repair_rate / fastest))
        .collect();
    // Probability of staying; a failed state keeps nothing, for what arrives there is lost.
    let stays: Vec<f64> = (0..states)
        .map(|mask| {
            if works[mask] {
                (fastest - leaving(units, mask)).max(0.0) / fastest
            } else {
                0.0
            }
        })
        .collect();
    let alive: Vec<f64> = works
        .iter()
        .map(|works| f64::from(u8::from(*works)))
        .collect();
    let weights = PoissonWeights::new(fastest * hours);
    let mut state = vec![0.0; states];
    state[0] = 1.0;
    let mut next = vec![0.0; states];
    let mut reliability = 0.0;
    for count in 0..=weights.last() {
        let weight = weights.at(count);
        if weight > 0.0 {
            reliability += weight * state.iter().sum::<f64>();
        }
        if count < weights.last() {
            step(&scaled, &stays, &alive, &state, &mut next);
            std::mem::swap(&mut state, &mut next);
        }
    }
    reliability
}

/// One step of the discrete chain, block by block.
fn step(scaled: &[(f64, f64)], stays: &[f64], alive: &[f64], state: &[f64], next: &mut [f64]) {
    let block = (1 << BLOCK_BITS).min(state.len());
    for (number, target) in next.chunks_exact_mut(block).enumerate() {
        let first = number * block;
        let here = &state[first..first + block];
        for ((target, here), stays) in target
            .iter_mut()
            .zip(here)
            .zip(&stays[first..first + block])
        {
            *target = here * stays;
        }
        for (bit, &(failure, repair)) in scaled.iter().enumerate() {
            let distance = 1 << bit;
            if distance < block {
                for (pair, from) in target
                    .chunks_exact_mut(2 * distance)
                    .zip(here.chunks_exact(2 * distance))
                {
                    let (up, down) = pair.split_at_mut(distance);
                    let (from_up, from_down) = from.split_at(distance);
                    for place in 0..distance {
                        up[place] += repair * from_down[place];
                        down[place] += failure * from_up[place];
                    }
                }
            } else {
                let other = first ^ distance;
                let rate = if first & distance == 0 {
                    repair
                } else {
                    failure
                };
                for (target, from) in target.iter_mut().zip(&state[other..other + block]) {
                    *target += rate * from;
                }
            }
        }
        for (target, alive) in target.iter_mut().zip(&alive[first..first + block]) {
            *target *= alive;
        }
    }
}
