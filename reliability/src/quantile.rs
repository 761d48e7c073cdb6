//! The time at which a probability of failure is reached, by bisection on what keeps its digits: the probability of having failed up
//! to one half, the logarithm of the reliability past it.

/// The time in hours at which the unreliability is `probability`; `scale` is of the order of the mean.
pub(crate) fn quantile(
    probability: f64,
    scale: f64,
    unreliability: impl Fn(f64) -> f64,
    log_reliability: impl Fn(f64) -> f64,
) -> f64 {
    if probability <= 0.0 {
        return 0.0;
    }
    if probability >= 1.0 {
        return f64::INFINITY;
    }
    let goal = (-probability).ln_1p();
    let reached = |hours: f64| {
        if probability <= 0.5 {
            unreliability(hours) >= probability
        } else {
            log_reliability(hours) <= goal
        }
    };
    let (mut low, mut high) = (0.0, scale);
    while !reached(high) && high.is_finite() {
        low = high;
        high *= 2.0;
    }
    // First by halves of the exponent, so that a time far below the mean is found with all its digits.
    while low == 0.0 && high > f64::MIN_POSITIVE {
        let middle = high / 16.0;
        if reached(middle) {
            high = middle;
        } else {
            low = middle;
        }
    }
    for _ in 0..80 {
        let middle = f64::midpoint(low, high);
        if middle <= low || middle >= high {
            break;
        }
        if reached(middle) {
            high = middle;
        } else {
            low = middle;
        }
    }
    high
}
