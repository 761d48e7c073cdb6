//! Places between numbers, of which an abstraction asks on which side a number is.

use understudy_typed::Elementary;

/// A number as a position on a line: one is at most a boundary where its position is. Reals: below or at a constant are
/// two boundaries. `None` for NaN.
pub fn position(of: Elementary, stored: u64) -> Option<i128> {
    match real(of, stored) {
        None => Some(of.signed(stored)),
        Some(value) if value.is_nan() => None,
        Some(value) => Some(2 * i128::from(rank(value)) + 1),
    }
}

/// The boundary of `< stored`, or of `<= stored`.
pub(crate) fn boundary(of: Elementary, stored: u64, is_included: bool) -> Option<i128> {
    match real(of, stored) {
        None => Some(of.signed(stored) - i128::from(!is_included)),
        Some(value) if value.is_nan() => None,
        Some(value) => Some(2 * i128::from(rank(value)) + i128::from(is_included)),
    }
}

pub(crate) fn real(of: Elementary, stored: u64) -> Option<f64> {
    of.is_real().then(|| of.number(stored))
}

/// Reals in their order as integers; both zeros are 0.
pub(crate) fn rank(value: f64) -> i64 {
    let bits = value.to_bits() as i64;
    if bits < 0 { i64::MIN.wrapping_sub(bits) } else { bits }
}

/// A number of type `of` above one boundary and at most at the next.
pub fn between(of: Elementary, above: Option<i128>, at_most: Option<i128>) -> Option<u64> {
    if !of.is_real() {
        let (least, greatest) = of.limits();
        let low = above.map_or(least, |above| above + 1).max(least);
        let high = at_most.unwrap_or(greatest).min(greatest);
        if low > high {
            return None;
        }
        // Small numbers are read more easily.
        let value = 0.clamp(low, high);
        return Some(value as u64 & of.mask());
    }
    let unrank = |rank: i64| {
        let bits = if rank < 0 { i64::MIN.wrapping_sub(rank) } else { rank };
        f64::from_bits(bits as u64)
    };
    let greatest = match of {
        Elementary::Real => f64::from(f32::MAX),
        _ => f64::MAX,
    };
    let (least, greatest) = (rank(-greatest), rank(greatest));
    // The position 2 r + 1 lies above `above` and is at most `at_most`.
    let low = above.map_or(least.into(), |above| above.div_euclid(2) + above.rem_euclid(2));
    let high = at_most.map_or(greatest.into(), |at_most| (at_most - 1).div_euclid(2));
    let low = i64::try_from(low.max(least.into())).ok()?;
    let high = i64::try_from(high.min(greatest.into())).ok()?;
    if low > high {
        return None;
    }
    let (low, high) = (unrank(low), unrank(high));
    let middle = readable(low, high);
    match of {
        Elementary::Real => {
            let near = middle as f32;
            let candidates = [near, near.next_up(), near.next_down()];
            let fits = |value: &f32| low <= f64::from(*value) && f64::from(*value) <= high;
            let found = candidates.into_iter().find(fits)?;
            Some(u64::from(found.to_bits()))
        }
        _ => Some(middle.to_bits()),
    }
}

/// A number between two that has few digits.
pub(crate) fn readable(low: f64, high: f64) -> f64 {
    if low <= 0.0 && 0.0 <= high {
        return 0.0;
    }
    let middle = match (low.abs() > 1e30, high.abs() > 1e30) {
        (false, true) => (low * 2.0).max(low + 10.0).min(high),
        (true, false) => (high * 2.0).min(high - 10.0).max(low),
        _ => low / 2.0 + high / 2.0,
    };
    for digits in 0..12 {
        let scale = 10f64.powi(digits);
        let round = (middle * scale).round() / scale;
        if low <= round && round <= high {
            return round;
        }
    }
    middle
}

/// A boundary as people write it.
pub fn boundary_text(of: Elementary, boundary: i128) -> String {
    if !of.is_real() {
        return format!("<= {}", of.text(boundary as u64 & of.mask()));
    }
    let is_included = boundary.rem_euclid(2) == 1;
    let rank = i64::try_from(boundary.div_euclid(2)).unwrap_or(0);
    let bits = if rank < 0 { i64::MIN.wrapping_sub(rank) } else { rank };
    let value = f64::from_bits(bits as u64);
    let stored = match of {
        Elementary::Real => u64::from((value as f32).to_bits()),
        _ => value.to_bits(),
    };
    let sign = if is_included { "<=" } else { "<" };
    format!("{sign} {}", of.text(stored))
}
