//! The three-state model of section IV, (14) to (20), with imperfect coverage: all boxes work, one is down, the system has failed.
//!
//! ```text
//!        q c               p - μ
//!   S0 ───────▶ S1 ──────────────▶ S2        q  rate of a first failure, (N+1) λ in (14)
//!    │  ◀─────── │                 ▲         c  probability that it is covered, 1 in (14)
//!    │     μ                       │         p  rate of leaving S1, N λ + μ in (14)
//!    └──────────── q (1-c) ────────┘
//! ```
//!
//! With -a and -b the eigenvalues of (14), a > b, theta = a - b and E = e^(-theta t), every quantity is a sum of terms that are not
//! negative; a difference is taken only of numbers that were given. So no digit is lost however large μ/λ or N is, and nothing
//! overflows for any t, as (15) to (18) do as printed. The probability of failure is a divided difference of the exponential
//! function, which is summed as a series of positive terms while at is small.

use crate::error::ReliabilityError;
use crate::quantity::{Probability, rate};

/// Up to this value of a t, the divided difference is summed as a series; past it, its closed form loses nothing.
const SERIES_UP_TO: f64 = 30.0;

/// State probabilities, (15) to (17).
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct StateProbabilities {
    /// All stations work.
    pub p0: f64,
    /// One box is down, and nothing is lost.
    pub p1: f64,
    /// The system has failed.
    pub p2: f64,
}

/// The three-state model. Rates are per hour, times in hours.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ThreeState {
    /// q
    first: f64,
    /// q c
    covered: f64,
    /// q (1 - c)
    uncovered: f64,
    /// p
    leaving: f64,
    /// a
    fast: f64,
    /// b
    slow: f64,
    /// theta = a - b
    spread: f64,
    /// p - b = a - q
    above: f64,
    /// q - b = a - p
    beside: f64,
    /// b - k with k = q (1 - c)
    excess: f64,
    /// second failures, p - μ
    second: f64,
}

impl ThreeState {
    /// The paper's model: one spare for `controllers` boxes, each with `failure_rate` and `repair_rate`, (14).
    ///
    /// # Errors
    /// A rate that is not positive and finite, or a count of 0.
    pub fn new(
        controllers: u64,
        failure_rate: f64,
        repair_rate: f64,
    ) -> Result<Self, ReliabilityError> {
        Self::with_coverage(controllers, failure_rate, repair_rate, Probability::ONE)
    }

    /// As [`ThreeState::new`], where a first failure is lethal with probability 1 - `coverage`.
    ///
    /// # Errors
    /// A rate that is not positive and finite, or a count of 0.
    pub fn with_coverage(
        controllers: u64,
        failure_rate: f64,
        repair_rate: f64,
        coverage: Probability,
    ) -> Result<Self, ReliabilityError> {
        let maximum = crate::MAXIMUM_BOXES as u64;
        if !(1..=maximum).contains(&controllers) {
            return Err(ReliabilityError::Count {
                what: "the number of controllers".into(),
                count: controllers,
                minimum: 1,
                maximum,
            });
        }
        let lambda = rate("the failure rate", failure_rate)?;
        let mut repair = rate("the repair rate", repair_rate)?;
        if coverage == Probability::ZERO {
            // S1 is never entered; any rate will do, and this one keeps the eigenvalues apart.
            repair = 2.0 * lambda;
        }
        let n = controllers as f64;
        let (first, second) = ((n + 1.0) * lambda, n * lambda);
        let covered = first * coverage.get();
        let uncovered = first * (1.0 - coverage.get());
        let leaving = second + repair;
        // (p - b)(q - b) = μ c q and (p - b) - (q - b) = p - q: the larger root by a sum, the smaller by the product.
        let product = repair * covered;
        // p - q = μ - λ; both are given, so this difference loses nothing.
        let difference = repair - lambda;
        let spread = difference.hypot(2.0 * product.sqrt());
        let larger = f64::midpoint(spread, difference.abs());
        let (above, beside) = if difference >= 0.0 {
            (larger, product / larger)
        } else {
            (product / larger, larger)
        };
        let fast = first + above;
        // a b = q p - μ c q = q (N λ + μ (1 - c)), (19)
        let slow = (first * second + uncovered * repair) / fast;
        let excess = covered * (second - uncovered) / (above + covered);
        let model = Self {
            first,
            covered,
            uncovered,
            leaving,
            fast,
            slow,
            spread,
            above,
            beside,
            excess,
            second,
        };
        if model.mttf().is_normal() && model.variance().is_normal() {
            Ok(model)
        } else {
            Err(ReliabilityError::OutOfRange {
                what: "the mean time to failure".into(),
            })
        }
    }

    /// MTTF in hours, (19): ((2N+1) λ + μ) / (N (N+1) λ²) where coverage is perfect.
    pub fn mttf(&self) -> f64 {
        (self.leaving + self.covered) / self.fast / self.slow
    }

    /// Variance of the time to failure, in hours squared; 1/a² + 1/b² where coverage is perfect.
    pub fn variance(&self) -> f64 {
        // With k = q (1 - c) it is (a² + b² - k²)/(a b)², and a - k = (p - b) + q c.
        let (a, b, k) = (self.fast, self.slow, self.uncovered);
        ((self.above + self.covered) * (a + k) + b * b) / (a * b) / (a * b)
    }

    /// State probabilities at `hours`, (15) to (17).
    pub fn probabilities(&self, hours: f64) -> StateProbabilities {
        let slow = (-self.slow * hours).exp();
        let fast = (-self.spread * hours).exp();
        StateProbabilities {
            p0: slow * (self.above + self.beside * fast) / self.spread,
            p1: self.covered * self.first_difference(hours),
            p2: self.unreliability(hours),
        }
    }

    /// R(t), (18).
    pub fn reliability(&self, hours: f64) -> f64 {
        self.log_reliability(hours).exp()
    }

    /// ln R(t), which does not underflow when R does.
    pub fn log_reliability(&self, hours: f64) -> f64 {
        let away = -(-self.spread * hours).exp_m1();
        -self.slow * hours + (self.excess / self.spread * away).ln_1p()
    }

    /// 1 - R(t) with all its digits, however small.
    pub fn unreliability(&self, hours: f64) -> f64 {
        if hours <= 0.0 {
            return 0.0;
        }
        if self.fast * hours > SERIES_UP_TO {
            let reliability = self.reliability(hours);
            if reliability < 0.5 {
                return 1.0 - reliability;
            }
        }
        self.uncovered * self.first_difference(hours)
            + self.fast * self.slow * self.second_difference(hours)
    }

    /// Density of the time to failure, per hour.
    pub fn density(&self, hours: f64) -> f64 {
        let slow = (-self.slow * hours).exp();
        let fast = (-self.spread * hours).exp();
        let p0 = slow * (self.above + self.beside * fast) / self.spread;
        self.uncovered * p0 + self.second * self.covered * self.first_difference(hours)
    }

    /// Rate of failing at `hours` of a system that has worked until then, per hour.
    pub fn hazard(&self, hours: f64) -> f64 {
        let fast = (-self.spread * hours).exp();
        let away = -(-self.spread * hours).exp_m1();
        let lethal =
            self.uncovered * (self.above + self.beside * fast) + self.second * self.covered * away;
        lethal / (self.spread + self.excess * away)
    }

    /// The time at which the probability of having failed is `probability`, in hours.
    pub fn quantile(&self, probability: Probability) -> f64 {
        crate::quantile::quantile(
            probability.get(),
            self.mttf(),
            |hours| self.unreliability(hours),
            |hours| self.log_reliability(hours),
        )
    }

    /// Rates of the chain: first failures that are covered, those that are not, repairs, second failures.
    pub(crate) fn rates(&self) -> (f64, f64, f64, f64) {
        let repair = self.leaving - self.second;
        (self.covered, self.uncovered, repair, self.second)
    }

    /// (e^(-bt) - e^(-at))/theta
    fn first_difference(&self, hours: f64) -> f64 {
        (-self.slow * hours).exp() * -(-self.spread * hours).exp_m1() / self.spread
    }

    /// The integral of [`Self::first_difference`]: t² times the divided difference of exp at 0, -bt and -at.
    fn second_difference(&self, hours: f64) -> f64 {
        let (a, b, theta) = (self.fast, self.slow, self.spread);
        let (x, y) = (a * hours, theta * hours);
        if x > SERIES_UP_TO {
            return (-(-b * hours).exp_m1() / b + (-x).exp_m1() / a) / theta;
        }
        // Shifted by at, the nodes at, theta t and 0 are not negative, and so is every term h(k)/(k+2)! of the series, where h(k) is
        // the sum of x^i y^(k-i).
        let (mut power, mut term, mut sum) = (1.0, 0.5, 0.5);
        for k in 1..400 {
            // term = h(k)/(k+2)!, power = y^k/(k+2)! up to the factor below.
            let step = f64::from(k) + 2.0;
            power *= y / step;
            term = term * x / step + 0.5 * power;
            sum += term;
            if term < sum * 1e-18 {
                break;
            }
        }
        hours * hours * (-x).exp() * sum
    }
}
