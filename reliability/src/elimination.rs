//! Mean times by GTH elimination (Grassmann, Taksar, Heyman 1985): states are taken out one by one, and what is left is the chain that
//! sees only the others. Nothing is ever subtracted, so every result has a small *relative* error, however stiff the chain is.
//!
//! A state is taken out by sending each rate into it on to where it leads, in proportion; the time spent in it is added to the weight
//! of the state that was left. A return to where one came from is dropped on both sides, and so the rate of leaving is a sum.
//! States are numbered as they are found from the start, which keeps the rates near the diagonal; only that band is stored.

use crate::chain::{Chain, Sources};
use crate::error::ReliabilityError;

/// Doubles in one band, at most: 512 MiB.
const MAXIMUM_BAND: usize = 1 << 26;

/// Multiplications of an elimination that is not worth avoiding.
const CHEAP_WORK: u64 = 300_000_000;

/// Multiplications of one elimination, at most: some seconds.
const MAXIMUM_WORK: u64 = 6_000_000_000;

/// Relative precision of the iteration that is used where the band is too wide.
const PRECISION: f64 = 1e-13;

/// Sweeps of that iteration, at most.
const MAXIMUM_SWEEPS: u32 = 20_000;

/// Mean and variance of the time to the first failure.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct TimeToFailure {
    /// Mean in hours.
    pub mean_hours: f64,
    /// Variance in hours squared.
    pub variance_hours_squared: f64,
}

impl Chain {
    /// Mean time to the first failure, in hours.
    ///
    /// # Errors
    /// No failure state, a state that never fails, or a precision that is not reached.
    pub fn mttf(&self) -> Result<f64, ReliabilityError> {
        let alive = Alive::failing(self)?;
        if alive.order.is_empty() {
            return Ok(0.0);
        }
        let mean = match alive.band() {
            Some(width) if alive.work(width) <= CHEAP_WORK => alive.mean(width)?,
            width => self.wide_mean(&alive, width)?,
        };
        in_range(mean)
    }

    /// Where elimination is expensive or impossible: by sweeps, which mostly converge at once, and by elimination only if not.
    fn wide_mean(&self, alive: &Alive<'_>, width: Option<usize>) -> Result<f64, ReliabilityError> {
        self.check_fails()?;
        match (alive.regenerate(), width) {
            (Err(_), Some(width)) => alive.mean(width),
            (found, _) => found,
        }
    }

    /// Mean and variance of the time to the first failure.
    ///
    /// # Errors
    /// The errors of [`Chain::mttf`], and a chain too large to eliminate.
    pub fn time_to_failure(&self) -> Result<TimeToFailure, ReliabilityError> {
        let alive = Alive::failing(self)?;
        if alive.order.is_empty() {
            return Ok(TimeToFailure { mean_hours: 0.0, variance_hours_squared: 0.0 });
        }
        let Some(width) = alive.band() else {
            return Err(ReliabilityError::TooManyStates {
                maximum: MAXIMUM_BAND / alive.order.len(),
            });
        };
        let eliminated = alive.eliminate(width)?;
        alive.check_start(&eliminated)?;
        let ones = vec![1.0; alive.order.len()];
        let first = eliminated.solve(&ones);
        let twice: Vec<f64> = first.iter().map(|mean| 2.0 * mean).collect();
        let second = eliminated.solve(&twice)[0];
        Ok(TimeToFailure {
            mean_hours: in_range(first[0])?,
            variance_hours_squared: in_range(second - first[0] * first[0])?,
        })
    }

    /// Probabilities of the states in the long run.
    ///
    /// # Errors
    /// A state that cannot be reached again once it is left, or a chain too large to eliminate.
    pub fn steady_state(&self) -> Result<Vec<f64>, ReliabilityError> {
        self.check_ergodic()?;
        let all = Alive::everything(self);
        let Some(width) = all.band() else {
            return Err(ReliabilityError::TooManyStates {
                maximum: MAXIMUM_BAND / all.order.len().max(1),
            });
        };
        let eliminated = all.eliminate(width)?;
        let mut probability = vec![0.0; self.states()];
        let by_place = eliminated.visits();
        let total: f64 = by_place.iter().sum();
        if !total.is_finite() {
            return Err(ReliabilityError::OutOfRange { what: "the steady state".into() });
        }
        for (place, state) in all.order.iter().enumerate() {
            probability[*state] = by_place[place] / total;
        }
        Ok(probability)
    }

    fn check_ergodic(&self) -> Result<(), ReliabilityError> {
        let sources = Sources::new(self.states(), || {
            let leaving = |state| self.successors(state).map(move |(to, _)| (state, to));
            (0..self.states()).flat_map(leaving)
        });
        let mut returns = vec![false; self.states()];
        let mut pending = vec![self.start()];
        returns[self.start()] = true;
        while let Some(state) = pending.pop() {
            for source in sources.of(state) {
                if !std::mem::replace(&mut returns[source], true) {
                    pending.push(source);
                }
            }
        }
        match returns.iter().position(|returns| !returns) {
            Some(state) => Err(ReliabilityError::NotErgodic { state: self.name(state) }),
            None => Ok(()),
        }
    }
}

fn in_range(value: f64) -> Result<f64, ReliabilityError> {
    if value.is_finite() {
        Ok(value)
    } else {
        Err(ReliabilityError::OutOfRange { what: "the mean time to failure".into() })
    }
}

/// The states that count, in the order of elimination (backwards), with the rates among them.
struct Alive<'a> {
    chain: &'a Chain,
    order: Vec<usize>,
    /// For each state of the chain its place in `order`; `u32::MAX` where it is a failure.
    place: Vec<u32>,
}

impl<'a> Alive<'a> {
    /// The states before the first failure.
    fn failing(chain: &'a Chain) -> Result<Self, ReliabilityError> {
        if !(0..chain.states()).any(|state| chain.is_failure(state)) {
            return Err(ReliabilityError::NoFailureState);
        }
        Ok(Self::ordered(chain, chain.alive()))
    }

    /// All states, failures too: for the long run.
    fn everything(chain: &'a Chain) -> Self {
        let level = chain.levels();
        let mut order: Vec<usize> = (0..chain.states()).collect();
        order.sort_by_key(|state| level[*state]);
        Self::ordered(chain, order)
    }

    fn ordered(chain: &'a Chain, order: Vec<usize>) -> Self {
        let mut place = vec![u32::MAX; chain.states()];
        for (index, state) in order.iter().enumerate() {
            place[*state] = index as u32;
        }
        Self { chain, order, place }
    }

    /// Rates out of the state at `place`: to another place, or (nothing) to a failure.
    fn rates(&self, place: usize) -> impl Iterator<Item = (Option<usize>, f64)> + '_ {
        self.chain
            .successors(self.order[place])
            .map(|(to, rate)| ((self.place[to] != u32::MAX).then(|| self.place[to] as usize), rate))
    }

    /// Half the width of the band, where the elimination is affordable.
    fn band(&self) -> Option<usize> {
        let mut width = 0;
        for place in 0..self.order.len() {
            for (to, _) in self.rates(place) {
                width = width.max(to.map_or(0, |to| to.abs_diff(place)));
            }
        }
        let states = self.order.len();
        let band = states.checked_mul(2 * width + 1)?;
        (band <= MAXIMUM_BAND && self.work(width) <= MAXIMUM_WORK).then_some(width)
    }

    /// Multiplications of the elimination.
    fn work(&self, width: usize) -> u64 {
        (self.order.len() as u64) * (width as u64 + 1) * (width as u64 + 1)
    }

    fn mean(&self, width: usize) -> Result<f64, ReliabilityError> {
        let eliminated = self.eliminate(width)?;
        self.check_start(&eliminated)?;
        let gathered = eliminated.gather(vec![1.0; self.order.len()]);
        Ok(gathered[0] / eliminated.leaving[0])
    }

    /// The start is out last; where nothing leads from it to a failure, the chain never fails.
    fn check_start(&self, eliminated: &Eliminated) -> Result<(), ReliabilityError> {
        if eliminated.leaving[0] > 0.0 {
            return Ok(());
        }
        Err(ReliabilityError::NeverFails { state: self.chain.name(self.order[0]) })
    }

    /// A state that leads nowhere but to states that are already out belongs to a set that is never left.
    fn eliminate(&self, width: usize) -> Result<Eliminated, ReliabilityError> {
        let states = self.order.len();
        let stride = 2 * width + 1;
        // Row i, entry j is the rate from place i to place i + j - width.
        let mut band = vec![0.0; states * stride];
        let mut lethal = vec![0.0; states];
        for place in 0..states {
            for (to, rate) in self.rates(place) {
                match to {
                    Some(to) => band[place * stride + to + width - place] += rate,
                    None => lethal[place] += rate,
                }
            }
        }
        let mut leaving = vec![0.0; states];
        for gone in (1..states).rev() {
            let first = gone.saturating_sub(width);
            let (before, row) = band.split_at_mut(gone * stride);
            // Rates of the state that goes, to the places first..gone.
            let row = &row[first + width - gone..width];
            let out = row.iter().sum::<f64>() + lethal[gone];
            leaving[gone] = out;
            if out == 0.0 {
                return Err(ReliabilityError::NeverFails {
                    state: self.chain.name(self.order[gone]),
                });
            }
            let dying = lethal[gone];
            for source in first..gone {
                let place = source * stride + gone + width - source;
                let into = before[place];
                if into == 0.0 {
                    continue;
                }
                // Kept as the share of visits that come from there.
                let share = into / out;
                before[place] = share;
                lethal[source] += share * dying;
                let start = source * stride + first + width - source;
                for (kept, rate) in before[start..start + row.len()].iter_mut().zip(row) {
                    *kept += share * rate;
                }
                // What leads back to the source itself is no transition.
                before[source * stride + width] = 0.0;
            }
        }
        leaving[0] = lethal[0];
        Ok(Eliminated { width, band, leaving })
    }

    /// The mean time by cycles through the start: the mean length of a cycle, over the probability that it ends in a failure. Both are
    /// sums of positive terms, found by sweeps (Gauss-Seidel); repair is fast, so cycles are short and the sweeps converge.
    fn regenerate(&self) -> Result<f64, ReliabilityError> {
        let states = self.order.len();
        let mut time = vec![0.0; states];
        let mut failure = vec![0.0; states];
        let mut change = f64::INFINITY;
        let mut sweeps = 0;
        let step = |place: usize, time: &[f64], failure: &[f64]| {
            let (mut out, mut length, mut lethal) = (0.0, 1.0, 0.0);
            for (to, rate) in self.rates(place) {
                out += rate;
                match to {
                    None => lethal += rate,
                    Some(0) => {}
                    Some(to) => {
                        length += rate * time[to];
                        lethal += rate * failure[to];
                    }
                }
            }
            (length / out, lethal / out)
        };
        let mut last = (0.0, 0.0);
        let mut before = f64::INFINITY;
        while sweeps < MAXIMUM_SWEEPS {
            for place in (1..states).rev() {
                (time[place], failure[place]) = step(place, &time, &failure);
            }
            let now = step(0, &time, &failure);
            before = std::mem::replace(
                &mut change,
                ((now.0 - last.0) / now.0).max((now.1 - last.1) / now.1),
            );
            last = now;
            sweeps += 1;
            // The sum of all changes to come, as a geometric series.
            let ratio = change / before;
            let rest = if change == 0.0 { 0.0 } else { change * ratio / (1.0 - ratio) };
            if sweeps > 2 && ratio < 1.0 && (0.0..PRECISION).contains(&rest) && last.1 > 0.0 {
                return Ok(last.0 / last.1);
            }
        }
        let ratio = change / before;
        Err(ReliabilityError::Precision {
            asked: PRECISION,
            reached: if ratio < 1.0 { change / (1.0 - ratio) } else { 1.0 },
        })
    }
}

/// What is left after the elimination: below the diagonal rates, above it shares, and the rates of leaving.
struct Eliminated {
    width: usize,
    band: Vec<f64>,
    leaving: Vec<f64>,
}

impl Eliminated {
    fn stride(&self) -> usize {
        2 * self.width + 1
    }

    /// The weight of each place with that of what was taken out after it.
    fn gather(&self, mut value: Vec<f64>) -> Vec<f64> {
        let (width, stride) = (self.width, self.stride());
        for gone in (1..value.len()).rev() {
            let weight = value[gone];
            let first = gone.saturating_sub(width);
            for (value, source) in value[first..gone].iter_mut().zip(first..) {
                *value += self.band[source * stride + gone + width - source] * weight;
            }
        }
        value
    }

    /// For every place, the expected sum of `weight` times the time spent, until the failure.
    fn solve(&self, weight: &[f64]) -> Vec<f64> {
        let (width, stride) = (self.width, self.stride());
        let states = self.leaving.len();
        let mut value = self.gather(weight.to_vec());
        value[0] /= self.leaving[0];
        for place in 1..states {
            let first = place.saturating_sub(width);
            let row = &self.band[place * stride + first + width - place..place * stride + width];
            let known: f64 = row.iter().zip(&value[first..place]).map(|(a, b)| a * b).sum();
            value[place] = (value[place] + known) / self.leaving[place];
        }
        value
    }

    /// Time in each place in a cycle through the first, which has 1.
    fn visits(&self) -> Vec<f64> {
        let (width, stride) = (self.width, self.stride());
        let states = self.leaving.len();
        let mut visits = vec![0.0; states];
        visits[0] = 1.0;
        for place in 1..states {
            let sources = place.saturating_sub(width)..place;
            visits[place] = sources
                .map(|source| visits[source] * self.band[source * stride + place + width - source])
                .sum();
        }
        visits
    }
}
