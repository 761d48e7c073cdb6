//! The three-state model played out, some ten million paths a second.
//!
//! A path visits S0 and S1 in turns until it leaves S1, or S0 uncovered, for S2. How often it returns is geometric, and the
//! times in one state, all of one exponential law, add up to a gamma law. So a path needs one geometric and two gamma numbers however
//! often it returns, and has the same law as one that is played step by step.

use rand::{Rng, RngExt};
use rand_distr::{Distribution, Exp1, Gamma};
use serde::Serialize;
use statrs::distribution::{ContinuousCDF, Normal};

use super::estimate::{Interval, significance};
use crate::error::ReliabilityError;
use crate::three_state::ThreeState;

/// Means of many paths.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Simulated {
    /// Paths played.
    pub paths: u64,
    /// Mean time to failure, in hours, with its interval.
    pub mean_hours: Interval,
    /// Share of the paths that had not failed at the mission's end, where one was given.
    pub reliability: Option<Interval>,
    /// Variance of the time to failure, in hours squared.
    pub variance_hours_squared: f64,
}

impl ThreeState {
    /// One time to failure in hours.
    pub fn draw(&self, random: &mut impl Rng) -> f64 {
        let (covered, uncovered, repair, second) = self.rates();
        let (first, leaving) = (covered + uncovered, repair + second);
        // A round is S0, S1 and back; it ends otherwise with the probability `end`.
        let survive_first = covered / first;
        let end = uncovered / first + survive_first * (second / leaving);
        let rounds = geometric(end, random);
        // The last visit of S0 ends in S2 at once, or leads to S1 once more.
        let from_first = random.random::<f64>() * end < uncovered / first;
        let visits = rounds + 1.0;
        let later = if from_first { rounds } else { visits };
        erlang(visits, random) / first + erlang(later, random) / leaving
    }
}

/// How many rounds are survived where each ends it with probability `end`.
fn geometric(end: f64, random: &mut impl Rng) -> f64 {
    let exponential: f64 = Exp1.sample(random);
    (exponential / -(-end).ln_1p()).floor()
}

/// The sum of `count` exponential numbers of mean 1; `count` is whole.
fn erlang(count: f64, random: &mut impl Rng) -> f64 {
    if count < 1.0 {
        return 0.0;
    }
    if count == 1.0 {
        return Exp1.sample(random);
    }
    Gamma::new(count, 1.0).map_or(0.0, |law| law.sample(random))
}

/// Plays `paths` paths.
///
/// # Errors
/// Fewer than 2 paths, or a confidence that is not inside (0, 1).
pub fn simulate(
    model: &ThreeState,
    paths: u64,
    mission_hours: Option<f64>,
    confidence: f64,
    random: &mut impl Rng,
) -> Result<Simulated, ReliabilityError> {
    if paths < 2 {
        return Err(ReliabilityError::Count {
            what: "the number of paths".into(),
            count: paths,
            minimum: 2,
            maximum: u64::MAX,
        });
    }
    // Around the mean that is expected, so that the squares do not cancel.
    let centre = model.mttf();
    let (mut sum, mut squares, mut survivors) = (0.0, 0.0, 0_u64);
    for _ in 0..paths {
        let hours = model.draw(random);
        let offset = hours - centre;
        sum += offset;
        squares += offset * offset;
        survivors += u64::from(mission_hours.is_some_and(|mission| hours > mission));
    }
    let count = paths as f64;
    let mean = sum / count;
    let variance = (squares - sum * mean) / (count - 1.0);
    let half = normal_quantile(confidence)? * (variance / count).sqrt();
    let estimate = centre + mean;
    Ok(Simulated {
        paths,
        mean_hours: Interval {
            estimate: Some(estimate),
            lower: (estimate - half).max(0.0),
            upper: Some(estimate + half),
            confidence,
        },
        reliability: match mission_hours {
            Some(_) => Some(super::estimate::proportion(survivors, paths, confidence)?),
            None => None,
        },
        variance_hours_squared: variance,
    })
}

/// How many standard errors a two-sided interval reaches to each side.
pub(crate) fn normal_quantile(confidence: f64) -> Result<f64, ReliabilityError> {
    let alpha = significance(confidence)?;
    Ok(Normal::standard().inverse_cdf(1.0 - alpha / 2.0))
}
