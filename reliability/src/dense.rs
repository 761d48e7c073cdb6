//! P(h) of a small chain as a full matrix, for times that would take uniformisation more work: the matrix of one unit of time, squared
//! again and again, so that any number of units is a product of a few of the squares. All entries are probabilities and each row is
//! brought back to the sum 1 after every squaring; so relative errors of the small entries add up and do not double.

use crate::extended::{Extended, split, two_sum};
use crate::poisson_weights::PoissonWeights;

/// States of a chain that is handled this way, at most.
pub(crate) const MAXIMUM_DENSE: usize = 300;

/// What may be left out of a sum, relative to its least term.
const LEFT_OUT: f64 = 1e-20;

/// Decides when a series of probabilities is summed: what is to come must be small beside each of the sums, and none may be left at 0
/// that later terms reach.
#[derive(Debug, Default)]
pub(crate) struct Series {
    reached: usize,
}

impl Series {
    /// Whether the terms that follow, together at most `rest` each, can be left out of `sums`.
    pub(crate) fn is_summed(&mut self, rest: f64, sums: &[f64]) -> bool {
        if rest > LEFT_OUT {
            return false;
        }
        let positive = sums.iter().filter(|sum| **sum > 0.0);
        let (reached, least) =
            positive.fold((0, 1.0_f64), |(reached, least), sum| (reached + 1, least.min(*sum)));
        // Each step reaches further, until one reaches nothing new.
        let all = reached == self.reached;
        self.reached = reached;
        all && rest <= least * LEFT_OUT
    }
}

/// P(1), P(2), P(4), ... in units of time.
#[derive(Debug)]
pub(crate) struct Squares {
    squares: Vec<Dense>,
}

impl Squares {
    /// From the matrix of one step of the discrete chain, of which one comes in one unit of time on average.
    pub(crate) fn new(step: &Dense) -> Self {
        let weights = PoissonWeights::new(1.0);
        let mut power = Dense::identity(step.size);
        let mut sum = Dense::zero(step.size);
        let mut series = Series::default();
        for count in 0..=weights.last() {
            sum.add(weights.at(count), &power);
            if series.is_summed(weights.past(count), &sum.high) {
                break;
            }
            power = step.times(&power);
        }
        sum.balance();
        Self { squares: vec![sum] }
    }

    /// A distribution after `units` of time, a whole number.
    pub(crate) fn advance(&mut self, mut state: Vec<Extended>, units: u128) -> Vec<Extended> {
        for place in 0..(u128::BITS - units.leading_zeros()) as usize {
            while self.squares.len() <= place {
                let last = &self.squares[self.squares.len() - 1];
                let mut square = last.times(last);
                square.balance();
                self.squares.push(square);
            }
            if units >> place & 1 == 1 {
                state = self.squares[place].apply(&state);
            }
        }
        state
    }
}

/// A stochastic matrix, row by row; high and low parts apart.
#[derive(Debug, Clone)]
pub(crate) struct Dense {
    size: usize,
    high: Vec<f64>,
    low: Vec<f64>,
}

impl Dense {
    pub(crate) fn zero(size: usize) -> Self {
        Self { size, high: vec![0.0; size * size], low: vec![0.0; size * size] }
    }

    fn identity(size: usize) -> Self {
        let mut matrix = Self::zero(size);
        for place in 0..size {
            matrix.set(place, place, Extended::ONE);
        }
        matrix
    }

    fn at(&self, row: usize, column: usize) -> Extended {
        let place = row * self.size + column;
        Extended { high: self.high[place], low: self.low[place] }
    }

    pub(crate) fn set(&mut self, row: usize, column: usize, value: Extended) {
        let place = row * self.size + column;
        (self.high[place], self.low[place]) = (value.high, value.low);
    }

    /// Adds `factor` times `other`.
    fn add(&mut self, factor: Extended, other: &Self) {
        for row in 0..self.size {
            for column in 0..self.size {
                let sum = self.at(row, column) + factor * other.at(row, column);
                self.set(row, column, sum);
            }
        }
    }

    fn apply(&self, distribution: &[Extended]) -> Vec<Extended> {
        let column = |column| {
            let terms = distribution.iter().enumerate();
            terms.map(|(row, share)| *share * self.at(row, column)).sum()
        };
        (0..self.size).map(column).collect()
    }

    /// The product, with the inner loop over neighbours in memory.
    fn times(&self, other: &Self) -> Self {
        let size = self.size;
        let mut product = Self::zero(size);
        for row in 0..size {
            let range = row * size..(row + 1) * size;
            let (high, low) = (&mut product.high[range.clone()], &mut product.low[range]);
            for middle in 0..size {
                let factor = self.at(row, middle);
                if factor.high > 0.0 {
                    let others = middle * size..(middle + 1) * size;
                    let other = (&other.high[others.clone()], &other.low[others]);
                    accumulate((high, low), factor, other);
                }
            }
            for (high, low) in high.iter_mut().zip(low) {
                (*high, *low) = two_sum(*high, *low);
            }
        }
        product
    }

    fn balance(&mut self) {
        for row in 0..self.size {
            let total: Extended = (0..self.size).map(|column| self.at(row, column)).sum();
            if total.high > 0.0 {
                for column in 0..self.size {
                    self.set(row, column, self.at(row, column) / total);
                }
            }
        }
    }
}

/// Adds `factor` times a row to a row; the errors of the high parts are gathered in the low ones.
fn accumulate((high, low): (&mut [f64], &mut [f64]), factor: Extended, other: (&[f64], &[f64])) {
    let (upper, lower) = split(factor.high);
    let sums = high.iter_mut().zip(low.iter_mut());
    for ((high, low), (&other, &rest)) in sums.zip(other.0.iter().zip(other.1)) {
        let (other1, other2) = split(other);
        let product = factor.high * other;
        let error = ((upper * other1 - product) + upper * other2 + lower * other1) + lower * other2;
        let (sum, lost) = two_sum(*high, product);
        *high = sum;
        *low += lost + (error + (factor.high * rest + factor.low * other));
    }
}
