//! Poisson probabilities for uniformisation, after Fox and Glynn (1988): computed outwards from the mode by ratios, so that nothing
//! underflows or overflows, and made to sum to one afterwards, the smallest first.
//!
//! What is cut off is bounded by a geometric series on either side; cutting ends where that bound is below [`CUT`] of the mode. That is
//! absolute and not relative to a result: the reliability of a long mission comes from counts far below the mode, and the
//! unreliability of a short one from counts far above it, and both may be as small as a double can be.

use crate::extended::Extended;

/// What may be cut off on each side, relative to the mode: next to the least number that a double holds.
const CUT: f64 = 1e-322;

/// Weights of the counts `first`, `first + 1`, ... in a Poisson law.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct PoissonWeights {
    mean: f64,
    /// The least count that is kept.
    pub(crate) first: usize,
    /// Their probabilities; they sum to one.
    pub(crate) weights: Vec<Extended>,
}

impl PoissonWeights {
    /// Of the law with this mean, which is not negative.
    pub(crate) fn new(mean: f64) -> Self {
        if mean <= 0.0 {
            return Self { mean: 0.0, first: 0, weights: vec![Extended::ONE] };
        }
        let exact = Extended::from(mean);
        let mode = mean.floor();
        let mut below = Vec::new();
        let (mut count, mut weight) = (mode, Extended::ONE);
        while count >= 1.0 {
            let ratio = count / mean;
            weight = weight * (Extended::from(count) / exact);
            count -= 1.0;
            below.push(weight);
            if ratio < 1.0 && weight.high * ratio / (1.0 - ratio) < CUT {
                break;
            }
        }
        let first = count as usize;
        let mut above = Vec::new();
        let (mut count, mut weight) = (mode, Extended::ONE);
        loop {
            count += 1.0;
            let ratio = mean / count;
            weight = weight * (exact / Extended::from(count));
            above.push(weight);
            if ratio < 1.0 && weight.high * ratio / (1.0 - ratio) < CUT {
                break;
            }
        }
        let sum = |side: &[Extended]| side.iter().rev().copied().sum::<Extended>();
        let total = sum(&below) + sum(&above) + Extended::ONE;
        let weights = below.into_iter().rev().chain([Extended::ONE]).chain(above);
        Self { mean, first, weights: weights.map(|weight| weight / total).collect() }
    }

    /// The largest count that is kept.
    pub(crate) fn last(&self) -> usize {
        self.first + self.weights.len() - 1
    }

    /// At least the sum of the weights past a count.
    pub(crate) fn past(&self, count: usize) -> f64 {
        let ratio = self.mean / (count + 2) as f64;
        if ratio < 1.0 { self.at(count + 1).high / (1.0 - ratio) } else { 1.0 }
    }

    /// The weight of a count.
    pub(crate) fn at(&self, count: usize) -> Extended {
        let place = count.checked_sub(self.first);
        place.and_then(|place| self.weights.get(place)).copied().unwrap_or(Extended::ZERO)
    }
}

#[cfg(test)]
mod tests {
    use statrs::distribution::{Discrete, Poisson};

    use super::*;

    fn check(mean: f64) {
        let weights = PoissonWeights::new(mean);
        let sum: Extended = weights.weights.iter().copied().sum();
        assert!((sum - Extended::ONE).get().abs() < 1e-28, "{mean}: {sum:?}");
        let law = Poisson::new(mean).expect("a mean");
        for count in [weights.first, mean as usize, weights.last()] {
            let expected = law.pmf(count as u64);
            let found = weights.at(count).get();
            assert!(
                (found - expected).abs() <= 1e-8 * expected + 1e-22,
                "{mean}, {count}: {found} instead of {expected}"
            );
        }
        assert_eq!(weights.at(weights.last() + 1), Extended::ZERO);
        let middle = weights.first + weights.weights.len() / 2;
        let past = weights.weights[middle + 1 - weights.first..].iter();
        let past = past.copied().sum::<Extended>().get();
        assert!(past <= weights.past(middle) * (1.0 + 1e-12), "{mean}");
    }

    #[test]
    fn they_are_poisson() {
        for mean in [1e-9, 0.3, 1.0, 7.5, 42.0, 1e3, 123_456.7, 4e6] {
            check(mean);
        }
        assert_eq!(PoissonWeights::new(0.0).weights, [Extended::ONE]);
    }

    /// e^-600, and the probability of 150 events where one is expected.
    #[test]
    fn the_least_ones_have_their_digits() {
        let none = PoissonWeights::new(600.0).at(0).get();
        assert!((none / (-600.0_f64).exp() - 1.0).abs() < 1e-12, "{none:e}");
        let weights = PoissonWeights::new(1.0);
        let logarithm = weights.at(150).get().ln();
        let factorial: f64 = (1..=150).map(|k| f64::from(k).ln()).sum();
        assert!((logarithm + 1.0 + factorial).abs() < 1e-11, "{logarithm}");
    }
}
