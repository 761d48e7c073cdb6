//! Poisson probabilities for uniformisation, after Fox and Glynn (1988): computed outwards from the mode by ratios, so that nothing
//! underflows or overflows, and made to sum to one afterwards, the smallest first.
//!
//! What is cut off is bounded by a geometric series on either side; cutting ends where that bound is below [`CUT`] of the mode.

/// What may be cut off on each side, relative to the mode.
const CUT: f64 = 1e-20;

/// Weights of the counts `first`, `first + 1`, ... in a Poisson law.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct PoissonWeights {
    /// The least count that is kept.
    pub(crate) first: usize,
    /// Their probabilities; they sum to one.
    pub(crate) weights: Vec<f64>,
}

impl PoissonWeights {
    /// Of the law with this mean, which is not negative.
    pub(crate) fn new(mean: f64) -> Self {
        if mean <= 0.0 {
            return Self {
                first: 0,
                weights: vec![1.0],
            };
        }
        let mode = mean.floor();
        let mut below = Vec::new();
        let (mut count, mut weight) = (mode, 1.0);
        while count >= 1.0 {
            let ratio = count / mean;
            weight *= ratio;
            count -= 1.0;
            below.push(weight);
            if ratio < 1.0 && weight * ratio / (1.0 - ratio) < CUT {
                break;
            }
        }
        let first = count as usize;
        let mut above = Vec::new();
        let (mut count, mut weight) = (mode, 1.0);
        loop {
            count += 1.0;
            let ratio = mean / count;
            weight *= ratio;
            above.push(weight);
            if ratio < 1.0 && weight * ratio / (1.0 - ratio) < CUT {
                break;
            }
        }
        let sum = |side: &[f64]| side.iter().rev().sum::<f64>();
        let total = sum(&below) + sum(&above) + 1.0;
        let weights = below.into_iter().rev().chain([1.0]).chain(above);
        Self {
            first,
            weights: weights.map(|weight| weight / total).collect(),
        }
    }

    /// The largest count that is kept.
    pub(crate) fn last(&self) -> usize {
        self.first + self.weights.len() - 1
    }

    /// The weight of a count.
    pub(crate) fn at(&self, count: usize) -> f64 {
        let place = count.checked_sub(self.first);
        place
            .and_then(|place| self.weights.get(place))
            .copied()
            .unwrap_or(0.0)
    }
}

#[cfg(test)]
mod tests {
    use statrs::distribution::{Discrete, Poisson};

    use super::*;

    fn check(mean: f64) {
        let weights = PoissonWeights::new(mean);
        let sum: f64 = weights.weights.iter().sum();
        assert!((sum - 1.0).abs() < 1e-13, "{mean}: {sum}");
        let law = Poisson::new(mean).expect("a mean");
        for count in [weights.first, mean as usize, weights.last()] {
            let expected = law.pmf(count as u64);
            let found = weights.at(count);
            assert!(
                (found - expected).abs() <= 1e-8 * expected + 1e-22,
                "{mean}, {count}: {found} instead of {expected}"
            );
        }
        assert_eq!(weights.at(weights.last() + 1), 0.0);
    }

    #[test]
    fn they_are_poisson() {
        for mean in [1e-9, 0.3, 1.0, 7.5, 42.0, 1e3, 123_456.7, 4e6] {
            check(mean);
        }
        assert_eq!(PoissonWeights::new(0.0).weights, [1.0]);
    }
}
