//! P(h) of a small chain as a full matrix, for times that would take uniformisation millions of steps: a short step, squared again and
//! again. All entries are probabilities and each row is brought back to the sum 1 after every squaring; so relative errors of
//! the small entries add up and do not double.

use crate::poisson_weights::PoissonWeights;

/// States of a chain that is handled this way, at most.
pub(crate) const MAXIMUM_DENSE: usize = 160;

/// A stochastic matrix, row by row.
#[derive(Debug, Clone)]
pub(crate) struct Dense {
    size: usize,
    entries: Vec<f64>,
}

impl Dense {
    /// The matrix of one step, from its entries by row.
    pub(crate) fn new(size: usize, entries: Vec<f64>) -> Self {
        debug_assert_eq!(entries.len(), size * size);
        Self { size, entries }
    }

    /// The mixture of the powers of this matrix with Poisson weights of `mean`, which is e^(mean (P - I)).
    pub(crate) fn exponential(&self, mean: f64) -> Self {
        let halvings = mean.log2().ceil().max(0.0) as u32;
        let weights = PoissonWeights::new(mean / 2.0_f64.powi(halvings as i32));
        let mut power = Self::identity(self.size);
        let mut sum = Self::new(self.size, vec![0.0; self.size * self.size]);
        for count in 0..=weights.last() {
            for (sum, power) in sum.entries.iter_mut().zip(&power.entries) {
                *sum += weights.at(count) * power;
            }
            if count < weights.last() {
                power = power.times(self);
            }
        }
        sum.balance();
        for _ in 0..halvings {
            sum = sum.times(&sum);
            sum.balance();
        }
        sum
    }

    /// A distribution after this matrix.
    pub(crate) fn apply(&self, distribution: &[f64]) -> Vec<f64> {
        let mut after = vec![0.0; self.size];
        for (row, &probability) in self.entries.chunks_exact(self.size).zip(distribution) {
            for (after, entry) in after.iter_mut().zip(row) {
                *after += probability * entry;
            }
        }
        after
    }

    fn identity(size: usize) -> Self {
        let mut entries = vec![0.0; size * size];
        for place in 0..size {
            entries[place * size + place] = 1.0;
        }
        Self { size, entries }
    }

    fn times(&self, other: &Self) -> Self {
        let size = self.size;
        let mut entries = vec![0.0; size * size];
        for (row, product) in self
            .entries
            .chunks_exact(size)
            .zip(entries.chunks_exact_mut(size))
        {
            for (&factor, other) in row.iter().zip(other.entries.chunks_exact(size)) {
                if factor > 0.0 {
                    for (product, entry) in product.iter_mut().zip(other) {
                        *product += factor * entry;
                    }
                }
            }
        }
        Self { size, entries }
    }

    fn balance(&mut self) {
        for row in self.entries.chunks_exact_mut(self.size) {
            let sum: f64 = row.iter().sum();
            if sum > 0.0 {
                row.iter_mut().for_each(|entry| *entry /= sum);
            }
        }
    }
}
