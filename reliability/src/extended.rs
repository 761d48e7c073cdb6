//! Numbers of 106 bits as unevaluated sums of two doubles, after Dekker (1971): enough for sums and products of as many terms as
//! a transient has, without a loss that shows in its sixteen digits.

use std::iter::Sum;
use std::ops::{Add, AddAssign, Div, Mul, Sub};

/// 2^27 + 1, which splits a double into two halves of 26 bits.
const SPLITTER: f64 = 134_217_729.0;

/// `high + low`, with `low` at most half a unit of the last place of `high`.
#[derive(Debug, Clone, Copy, PartialEq, PartialOrd, Default)]
pub(crate) struct Extended {
    pub(crate) high: f64,
    pub(crate) low: f64,
}

impl Extended {
    pub(crate) const ZERO: Self = Self { high: 0.0, low: 0.0 };
    pub(crate) const ONE: Self = Self { high: 1.0, low: 0.0 };

    /// The nearest double.
    pub(crate) fn get(self) -> f64 {
        self.high + self.low
    }

    /// `high + low` where `high` is the larger one.
    fn renormalised(high: f64, low: f64) -> Self {
        let sum = high + low;
        Self { high: sum, low: low - (sum - high) }
    }
}

/// The sum of two doubles and its rounding error.
#[inline(always)]
pub(crate) fn two_sum(a: f64, b: f64) -> (f64, f64) {
    let sum = a + b;
    let second = sum - a;
    (sum, (a - (sum - second)) + (b - second))
}

/// Two halves whose products are exact.
#[inline(always)]
pub(crate) fn split(value: f64) -> (f64, f64) {
    let scaled = SPLITTER * value;
    let upper = scaled - (scaled - value);
    (upper, value - upper)
}

/// The product of two doubles and its rounding error.
#[inline(always)]
pub(crate) fn two_product(a: f64, b: f64) -> (f64, f64) {
    let ((a1, a2), (b1, b2)) = (split(a), split(b));
    let product = a * b;
    (product, ((a1 * b1 - product) + a1 * b2 + a2 * b1) + a2 * b2)
}

impl From<f64> for Extended {
    fn from(value: f64) -> Self {
        Self { high: value, low: 0.0 }
    }
}

impl Add for Extended {
    type Output = Self;

    #[inline(always)]
    fn add(self, other: Self) -> Self {
        let (sum, error) = two_sum(self.high, other.high);
        let (low, lowest) = two_sum(self.low, other.low);
        let first = Self::renormalised(sum, error + low);
        Self::renormalised(first.high, first.low + lowest)
    }
}

impl AddAssign for Extended {
    #[inline(always)]
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl Sub for Extended {
    type Output = Self;

    fn sub(self, other: Self) -> Self {
        self + Self { high: -other.high, low: -other.low }
    }
}

impl Mul for Extended {
    type Output = Self;

    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        let (product, error) = two_product(self.high, other.high);
        Self::renormalised(product, error + (self.high * other.low + self.low * other.high))
    }
}

impl Mul<f64> for Extended {
    type Output = Self;

    #[inline(always)]
    fn mul(self, other: f64) -> Self {
        let (product, error) = two_product(self.high, other);
        Self::renormalised(product, error + self.low * other)
    }
}

impl Div for Extended {
    type Output = Self;

    fn div(self, other: Self) -> Self {
        let first = self.high / other.high;
        let rest = self - other * first;
        let second = rest.high / other.high;
        let rest = rest - other * second;
        let third = rest.high / other.high;
        Self::renormalised(first, second) + Self::from(third)
    }
}

impl Sum for Extended {
    fn sum<I: Iterator<Item = Self>>(terms: I) -> Self {
        terms.fold(Self::ZERO, Add::add)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The quotient times the divisor, and the parts of a sum, come back to 31 digits.
    #[test]
    fn results_have_thirty_digits() {
        for (a, b) in [(1.0, 3.0), (0.7, 1e-9), (1e-280, 7e11), (2.0 / 3.0, 1e15)] {
            let (a, b) = (Extended::from(a), Extended::from(b));
            let quotient = a / b;
            let back = quotient * b - a;
            assert!(back.get().abs() <= 1e-30 * a.get(), "{a:?}/{b:?}: {back:?}");
            let sum = (a + b) - b;
            let lost = (sum - a).get().abs();
            assert!(lost <= 1e-31 * (a + b).get(), "{a:?} + {b:?}: {lost:e}");
        }
        let third = Extended::ONE / Extended::from(3.0);
        let thirds: Extended = [third; 3].into_iter().sum();
        assert!((thirds - Extended::ONE).get().abs() < 1e-31);
    }
}
