//! Transients by uniformisation: P(t) is a mixture, with Poisson weights, of the states after 0, 1, 2, ... steps of a discrete chain.
//! All terms are probabilities, so nothing cancels: also the least probability of failure has its digits.

use crate::chain::Chain;
use crate::dense::{Dense, MAXIMUM_DENSE};
use crate::error::ReliabilityError;
use crate::poisson_weights::PoissonWeights;

/// Steps times transitions of one computation, at most: some tens of seconds.
const MAXIMUM_WORK: f64 = 2e10;

/// Steps taken at once: past it, P(t) is computed in several strides, which bounds the weights in memory.
const STRIDE_STEPS: f64 = 1e7;

/// From this number of steps on, a small chain is squared instead.
const SQUARE_FROM: f64 = 3e3;

/// What becomes of the chain by a time.
#[derive(Debug, Clone, PartialEq)]
pub struct Transient {
    /// Probability of each state; where failures are final, of having failed before it was left.
    pub probabilities: Vec<f64>,
    /// Probability of a failure state.
    pub failed: f64,
}

/// Whether a failure is left again.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum AfterFailure {
    /// The first failure is the end: R(t) = 1 - failed.
    Final,
    /// The chain goes on: 1 - failed is the availability at that time.
    Repaired,
}

impl Chain {
    /// R(t): the probability that no failure state was met by `hours`.
    ///
    /// # Errors
    /// As [`Chain::transients`].
    pub fn reliability(&self, hours: f64) -> Result<f64, ReliabilityError> {
        let found = self.transient(hours, AfterFailure::Final)?;
        let alive = (0..self.states()).filter(|state| !self.is_failure(*state));
        Ok(alive.map(|state| found.probabilities[state]).sum())
    }

    /// P(t) at `hours`.
    ///
    /// # Errors
    /// As [`Chain::transients`].
    pub fn transient(
        &self,
        hours: f64,
        after: AfterFailure,
    ) -> Result<Transient, ReliabilityError> {
        let mut found = self.transients(&[hours], after)?;
        found.pop().ok_or(ReliabilityError::NoFailureState)
    }

    /// P(t) at each of `hours`, which ascend; each goes on from the one before.
    ///
    /// # Errors
    /// A time that is negative, not finite or before the last one, or more steps than time allows.
    pub fn transients(
        &self,
        hours: &[f64],
        after: AfterFailure,
    ) -> Result<Vec<Transient>, ReliabilityError> {
        let mut last = 0.0;
        for &time in hours {
            if !time.is_finite() || time < last {
                return Err(ReliabilityError::Time {
                    what: "a time, which must not be before the last one,".into(),
                    hours: time,
                });
            }
            last = time;
        }
        let steps = Steps::new(self, after);
        let (needed, work) = (steps.fastest * last, steps.work() * steps.fastest * last);
        if work > MAXIMUM_WORK && self.states() > MAXIMUM_DENSE {
            return Err(ReliabilityError::TooManySteps {
                steps: needed,
                hours: last,
                per_hour: steps.fastest,
                maximum: MAXIMUM_WORK / steps.work(),
            });
        }
        let mut state = vec![0.0; self.states()];
        state[self.start()] = 1.0;
        let mut now = 0.0;
        let mut found = Vec::with_capacity(hours.len());
        // Of the last stride, for most grids are even.
        let mut squared: Option<(f64, Dense)> = None;
        for &time in hours {
            let stride = time - now;
            if self.states() <= MAXIMUM_DENSE && steps.fastest * stride > SQUARE_FROM {
                let known = squared
                    .take()
                    .filter(|(known, _)| (known / stride - 1.0).abs() < 1e-13);
                let (_, matrix) =
                    squared.insert(known.unwrap_or_else(|| (stride, steps.squared(stride))));
                state = matrix.apply(&state);
                now = time;
                found.push(self.found(&state));
                continue;
            }
            let strides = (steps.fastest * (time - now) / STRIDE_STEPS)
                .ceil()
                .max(1.0);
            for _ in 0..strides as u64 {
                state = steps.advance(state, (time - now) / strides);
            }
            now = time;
            found.push(self.found(&state));
        }
        Ok(found)
    }

    fn found(&self, state: &[f64]) -> Transient {
        let failures = (0..self.states()).filter(|state| self.is_failure(*state));
        Transient {
            failed: failures.fold(0.0, |sum, place| sum + state[place]),
            probabilities: state.to_vec(),
        }
    }
}

/// The discrete chain: in one step, state i goes to a source's target with rate / fastest.
struct Steps {
    fastest: f64,
    stays: Vec<f64>,
    /// By target: sources and probabilities.
    rows: Vec<usize>,
    sources: Vec<u32>,
    shares: Vec<f64>,
}

impl Steps {
    fn new(chain: &Chain, after: AfterFailure) -> Self {
        let states = chain.states();
        let counts = |state: usize| after == AfterFailure::Repaired || !chain.is_failure(state);
        let mut leaving = vec![0.0; states];
        let mut rows = vec![0; states + 1];
        for state in (0..states).filter(|state| counts(*state)) {
            leaving[state] = chain.leaving(state);
            for (to, _) in chain.successors(state) {
                rows[to + 1] += 1;
            }
        }
        for state in 0..states {
            rows[state + 1] += rows[state];
        }
        // A little faster than the fastest state, so that none is left for certain and the chain does not swing.
        let fastest = leaving.iter().fold(0.0, |most: f64, rate| most.max(*rate)) * 1.02;
        let mut fill = rows.clone();
        let transitions = rows.last().copied().unwrap_or(0);
        let (mut sources, mut shares) = (vec![0; transitions], vec![0.0; transitions]);
        for state in (0..states).filter(|state| counts(*state)) {
            for (to, rate) in chain.successors(state) {
                sources[fill[to]] = state as u32;
                shares[fill[to]] = rate / fastest;
                fill[to] += 1;
            }
        }
        let stays = leaving
            .iter()
            .map(|leaving| {
                if fastest > 0.0 {
                    (fastest - leaving) / fastest
                } else {
                    1.0
                }
            })
            .collect();
        Self {
            fastest,
            stays,
            rows,
            sources,
            shares,
        }
    }

    /// The matrix P(h).
    fn squared(&self, hours: f64) -> Dense {
        let states = self.stays.len();
        let mut entries = vec![0.0; states * states];
        for target in 0..states {
            entries[target * states + target] = self.stays[target];
            for at in self.rows[target]..self.rows[target + 1] {
                entries[self.sources[at] as usize * states + target] = self.shares[at];
            }
        }
        Dense::new(states, entries).exponential(self.fastest * hours)
    }

    /// Multiplications of one step.
    fn work(&self) -> f64 {
        (self.sources.len() + 2 * self.stays.len()) as f64
    }

    fn advance(&self, mut state: Vec<f64>, hours: f64) -> Vec<f64> {
        let weights = PoissonWeights::new(self.fastest * hours);
        let mut next = vec![0.0; state.len()];
        let mut mixed = vec![0.0; state.len()];
        for count in 0..=weights.last() {
            let weight = weights.at(count);
            if weight > 0.0 {
                for (mixed, state) in mixed.iter_mut().zip(&state) {
                    *mixed += weight * state;
                }
            }
            if count < weights.last() {
                for (target, next) in next.iter_mut().enumerate() {
                    let row = self.rows[target]..self.rows[target + 1];
                    let arriving = self.sources[row.clone()].iter().zip(&self.shares[row]);
                    *next = self.stays[target] * state[target]
                        + arriving
                            .map(|(source, share)| share * state[*source as usize])
                            .sum::<f64>();
                }
                std::mem::swap(&mut state, &mut next);
            }
        }
        mixed
    }
}
