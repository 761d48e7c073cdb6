//! Transients by uniformisation: P(t) is a mixture, with Poisson weights, of the states after 0, 1, 2, ... steps of a discrete chain.
//! All terms are probabilities, so nothing cancels: also the least probability of failure, or of survival, has its digits.
//!
//! Steps are many, and a loss in each would add up. So the discrete chain steps at a power of two per hour, by which rates are divided
//! exactly, and probabilities are [`Extended`]: twelve digits are left for both R(t) and 1 - R(t) down to [`MINIMUM_PROBABILITY`].

use crate::chain::Chain;
use crate::dense::{Dense, MAXIMUM_DENSE, Series, Squares};
use crate::error::ReliabilityError;
use crate::extended::Extended;
use crate::poisson_weights::PoissonWeights;
use crate::quantity::MINIMUM_PROBABILITY;

/// Steps times transitions of one computation, at most: some tens of seconds.
const MAXIMUM_WORK: f64 = 5e9;

/// Steps of one computation by squaring, at most; a bound for its memory.
const MAXIMUM_UNITS: f64 = 1e30;

/// Steps taken at once: past it, P(t) is computed in several strides, which bounds the weights in memory.
const STRIDE_STEPS: f64 = 1e7;

/// Terms of a series with a mean of 1, mostly.
const TERMS: f64 = 40.0;

/// State of the chain at a time.
#[derive(Debug, Clone, PartialEq)]
pub struct Transient {
    /// Probability of each state; where failures are final, of having failed before it was left.
    pub probabilities: Vec<f64>,
    /// Probability of a state that is no failure.
    pub working: f64,
    /// Probability of a failure state.
    pub failed: f64,
}

impl Transient {
    /// ln of the probability of a state that is no failure.
    pub fn log_working(&self) -> f64 {
        if self.failed < 0.5 { (-self.failed).ln_1p() } else { self.working.ln() }
    }
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
    /// Density of the first failure at the time of `at`, per hour: the rate at which the states that work enter a failure.
    pub fn failure_density(&self, at: &Transient) -> f64 {
        let working = (0..self.states()).filter(|state| !self.is_failure(*state));
        let flows = working.map(|state| {
            let exits = self.successors(state).filter(|(to, _)| self.is_failure(*to));
            let rate: f64 = exits.map(|(_, rate)| rate).sum();
            at.probabilities[state] * rate
        });
        flows.sum()
    }

    /// R(t): the probability that no failure state was met by `hours`.
    ///
    /// # Errors
    /// The errors of [`Chain::transients`], and R(t) below [`MINIMUM_PROBABILITY`].
    pub fn reliability(&self, hours: f64) -> Result<f64, ReliabilityError> {
        let found = self.transient(hours, AfterFailure::Final)?;
        if found.working < MINIMUM_PROBABILITY {
            return Err(ReliabilityError::OutOfRange {
                what: format!("the reliability at {hours} hours, which is below 1e-300,"),
            });
        }
        Ok(found.working)
    }

    /// P(t) at `hours`.
    ///
    /// # Errors
    /// The errors of [`Chain::transients`].
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
        let steps = Steps::new(self, after)?;
        let mut squares = if steps.squared_is_cheaper(hours) {
            Some(Squares::new(&steps.matrix()))
        } else {
            None
        };
        let (needed, longest) = match squares {
            Some(_) => (steps.fastest * last, MAXIMUM_UNITS),
            None => (steps.count(hours), MAXIMUM_WORK / steps.work()),
        };
        if needed > longest {
            return Err(ReliabilityError::TooManySteps {
                steps: needed,
                hours: last,
                per_hour: steps.fastest,
                maximum: longest,
            });
        }
        let mut state = vec![Extended::ZERO; self.states()];
        state[self.start()] = Extended::ONE;
        let mut now = 0.0;
        let mut found = Vec::with_capacity(hours.len());
        for &time in hours {
            // In units of one step on average.
            let mut stride = steps.fastest * (time - now);
            if let Some(squares) = &mut squares {
                state = squares.advance(state, stride.floor() as u128);
                stride -= stride.floor();
            }
            let strides = (stride / STRIDE_STEPS).ceil().max(1.0);
            for _ in 0..strides as u64 {
                state = steps.advance(state, stride / strides);
            }
            now = time;
            found.push(self.found(&state));
        }
        Ok(found)
    }

    fn found(&self, state: &[Extended]) -> Transient {
        let sum = |failure: bool| {
            let places = (0..self.states()).filter(|place| self.is_failure(*place) == failure);
            places.map(|place| state[place]).sum::<Extended>().get()
        };
        Transient {
            working: sum(false),
            failed: sum(true),
            probabilities: state.iter().map(|share| share.get()).collect(),
        }
    }
}

/// The discrete chain: in one step, state i goes to a source's target with rate / fastest.
struct Steps {
    /// Steps per hour, a power of two.
    fastest: f64,
    stays: Vec<Extended>,
    /// By target: sources and probabilities.
    rows: Vec<usize>,
    sources: Vec<u32>,
    shares: Vec<f64>,
}

impl Steps {
    fn new(chain: &Chain, after: AfterFailure) -> Result<Self, ReliabilityError> {
        let states = chain.states();
        let counts = |state: usize| after == AfterFailure::Repaired || !chain.is_failure(state);
        let mut leaving: f64 = 0.0;
        let mut rows = vec![0; states + 1];
        for state in (0..states).filter(|state| counts(*state)) {
            leaving = leaving.max(chain.leaving(state));
            for (to, _) in chain.successors(state) {
                rows[to + 1] += 1;
            }
        }
        for state in 0..states {
            rows[state + 1] += rows[state];
        }
        // A little faster than the fastest state, so that none is left for certain and the chain does not swing.
        let fastest =
            if leaving > 0.0 { 2.0_f64.powi((leaving * 1.01).log2().ceil() as i32) } else { 0.0 };
        if !fastest.is_finite() || (leaving > 0.0 && fastest < f64::MIN_POSITIVE) {
            return Err(ReliabilityError::OutOfRange {
                what: format!("a rate of {leaving:e} per hour"),
            });
        }
        let mut fill = rows.clone();
        let transitions = rows.last().copied().unwrap_or(0);
        let (mut sources, mut shares) = (vec![0; transitions], vec![0.0; transitions]);
        let mut stays = vec![Extended::ONE; states];
        for state in (0..states).filter(|state| counts(*state)) {
            for (to, rate) in chain.successors(state) {
                let share = rate / fastest;
                sources[fill[to]] = state as u32;
                shares[fill[to]] = share;
                stays[state] = stays[state] - Extended::from(share);
                fill[to] += 1;
            }
        }
        Ok(Self { fastest, stays, rows, sources, shares })
    }

    /// As a full matrix.
    fn matrix(&self) -> Dense {
        let mut matrix = Dense::zero(self.stays.len());
        for target in 0..self.stays.len() {
            matrix.set(target, target, self.stays[target]);
            for at in self.rows[target]..self.rows[target + 1] {
                let source = self.sources[at] as usize;
                matrix.set(source, target, Extended::from(self.shares[at]));
            }
        }
        matrix
    }

    /// Multiplications of one step.
    fn work(&self) -> f64 {
        (self.sources.len() + 2 * self.stays.len()) as f64
    }

    /// Steps that uniformisation takes up to each of `hours`, from the one before.
    fn count(&self, hours: &[f64]) -> f64 {
        let befores = [0.0].into_iter().chain(hours.iter().copied());
        let strides = hours.iter().zip(befores);
        let steps = strides.map(|(time, before)| {
            let mean = self.fastest * (time - before);
            mean + 12.0 * mean.sqrt() + TERMS
        });
        steps.sum()
    }

    /// Whether squaring a full matrix takes less than the steps do.
    fn squared_is_cheaper(&self, hours: &[f64]) -> bool {
        let longest = self.fastest * hours.last().copied().unwrap_or(0.0);
        let size = self.stays.len();
        if size > MAXIMUM_DENSE || longest < 1.0 {
            return false;
        }
        let (states, squares) = (size as f64, longest.log2() + 1.0);
        let series = TERMS * (self.sources.len() as f64 + 2.0 * states) * states;
        let applied = hours.len() as f64 * (squares * states * states + TERMS * self.work());
        states.powi(3) * squares + series + applied < self.work() * self.count(hours)
    }

    fn advance(&self, mut state: Vec<Extended>, mean: f64) -> Vec<Extended> {
        let weights = PoissonWeights::new(mean);
        let mut next = vec![Extended::ZERO; state.len()];
        let mut mixed = vec![Extended::ZERO; state.len()];
        let mut series = Series::default();
        let mut sums = vec![0.0; state.len()];
        for count in 0..=weights.last() {
            let weight = weights.at(count);
            if weight.high > 0.0 {
                for ((mixed, state), sum) in mixed.iter_mut().zip(&state).zip(&mut sums) {
                    *mixed += weight * *state;
                    *sum = mixed.high;
                }
            }
            if series.is_summed(weights.past(count), &sums) {
                break;
            }
            for (target, next) in next.iter_mut().enumerate() {
                let row = self.rows[target]..self.rows[target + 1];
                let arriving = self.sources[row.clone()].iter().zip(&self.shares[row]);
                *next = self.stays[target] * state[target]
                    + arriving
                        .map(|(source, share)| state[*source as usize] * *share)
                        .sum::<Extended>();
            }
            std::mem::swap(&mut state, &mut next);
        }
        mixed
    }
}
