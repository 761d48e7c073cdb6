//! Does the law that the model implies fit the measured times? Anderson-Darling's A² and Kolmogorov-Smirnov's D, judged by a bootstrap.
//!
//! The critical values of both depend on what was taken from the sample itself (Lilliefors). A table for a law that is known
//! beforehand is far too forgiving once the mean was fitted; and a table for the exponential law is wrong for a hypoexponential one. So the
//! p-value comes from samples of the law itself that are treated like the measured one.

use rand::{Rng, RngExt};
use serde::Serialize;

use super::law::Law;
use crate::error::ReliabilityError;

/// The part of the null hypothesis that is independent of the sample.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Null {
    /// The law with its mean.
    Specified,
    /// The shape of the law; its mean is the sample's.
    ScaleFitted,
}

/// The outcome of both tests.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Fit {
    /// Times in the sample.
    pub times: usize,
    /// The null hypothesis of the test.
    pub null: Null,
    /// Anderson-Darling's A².
    pub anderson_darling: f64,
    /// Probability of so large an A² where the law is true.
    pub anderson_darling_p: f64,
    /// A² that is exceeded in 5 % of all samples where the law is true.
    pub anderson_darling_critical: f64,
    /// Kolmogorov-Smirnov's D.
    pub kolmogorov_smirnov: f64,
    /// Probability of so large a D where the law is true.
    pub kolmogorov_smirnov_p: f64,
    /// D that is exceeded in 5 % of all samples where the law is true.
    pub kolmogorov_smirnov_critical: f64,
    /// Samples drawn for the p-values.
    pub bootstrap: usize,
}

/// Tests whether `hours` are times to failure from `law`, with `bootstrap` samples drawn with `random`.
///
/// # Errors
/// Fewer than 5 times, a time that is not positive and finite, or fewer than 100 samples.
pub fn fit(
    hours: &[f64],
    law: &Law,
    null: Null,
    bootstrap: usize,
    random: &mut impl Rng,
) -> Result<Fit, ReliabilityError> {
    if hours.len() < 5 {
        return Err(ReliabilityError::Measurement {
            why: format!("{} times are too few for a test of fit; it takes 5", hours.len()),
        });
    }
    if bootstrap < 100 {
        return Err(ReliabilityError::Measurement {
            why: format!("{bootstrap} samples are too few for a p-value; it takes 100"),
        });
    }
    for &hours in hours {
        if !(hours > 0.0 && hours.is_finite()) {
            return Err(ReliabilityError::Time { what: "a time to failure".into(), hours });
        }
    }
    let measured = statistics(&mut hours.to_vec(), law, null);
    let mut sample = vec![0.0; hours.len()];
    let mut drawn: Vec<(f64, f64)> = Vec::with_capacity(bootstrap);
    for _ in 0..bootstrap {
        for time in &mut sample {
            *time = law.quantile(random.random::<f64>());
        }
        drawn.push(statistics(&mut sample, law, null));
    }
    let judge = |measured: f64, mut drawn: Vec<f64>| {
        drawn.sort_by(f64::total_cmp);
        let below = drawn.partition_point(|value| *value < measured);
        // The measured sample is one more of them where the law is true.
        let p = (bootstrap - below + 1) as f64 / (bootstrap + 1) as f64;
        (p, drawn[bootstrap * 95 / 100])
    };
    let (squares, distances): (Vec<f64>, Vec<f64>) = drawn.into_iter().unzip();
    let (anderson_darling_p, anderson_darling_critical) = judge(measured.0, squares);
    let (kolmogorov_smirnov_p, kolmogorov_smirnov_critical) = judge(measured.1, distances);
    Ok(Fit {
        times: hours.len(),
        null,
        anderson_darling: measured.0,
        anderson_darling_p,
        anderson_darling_critical,
        kolmogorov_smirnov: measured.1,
        kolmogorov_smirnov_p,
        kolmogorov_smirnov_critical,
        bootstrap,
    })
}

/// A² and D of a sample, which is sorted.
fn statistics(hours: &mut [f64], law: &Law, null: Null) -> (f64, f64) {
    hours.sort_by(f64::total_cmp);
    let count = hours.len() as f64;
    let scale = match null {
        Null::Specified => 1.0,
        Null::ScaleFitted => law.mean() / (hours.iter().sum::<f64>() / count),
    };
    let shares: Vec<f64> = hours
        .iter()
        .map(|hours| law.unreliability(hours * scale).clamp(1e-300, 1.0 - f64::EPSILON))
        .collect();
    let (mut sum, mut distance) = (0.0, 0.0_f64);
    for (place, &share) in shares.iter().enumerate() {
        let rank = place as f64;
        let opposite = shares[shares.len() - 1 - place];
        sum += (2.0 * rank + 1.0) * (share.ln() + (-opposite).ln_1p());
        distance = distance.max(share - rank / count).max((rank + 1.0) / count - share);
    }
    (-count - sum / count, distance)
}
