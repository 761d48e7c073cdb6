//! The extents of results of operations.

use understudy_typed::{Comparison, Elementary, Operation};

use super::{Extent, divisor};

/// The extent of a BOOL that is known to be so, or not.
fn known(value: bool) -> Extent {
    Extent::new(value.into(), value.into())
}

/// The extent of the result of an operation.
pub(super) fn applied(operation: Operation, of: Elementary, operands: &[Extent]) -> Extent {
    use Operation as O;
    let full = Extent::of(of);
    let between = |low: i128, high: i128, unit: i128| Extent { low, high, unit };
    match (operation, operands) {
        (O::Not(Elementary::Bool), &[one]) => Extent::new(1 - one.high, 1 - one.low),
        (O::And(Elementary::Bool), &[one, other]) => {
            Extent::new(one.low.min(other.low), one.high.min(other.high))
        }
        (O::Or(Elementary::Bool), &[one, other]) => {
            Extent::new(one.low.max(other.low), one.high.max(other.high))
        }
        (O::Compare(comparison, kind), &[one, other]) if !kind.is_real() => {
            let (least, most) = (one.low == one.high && one == other, one.high < other.low);
            let apart = most || other.high < one.low;
            let is = match comparison {
                Comparison::Equal if apart => Some(false),
                Comparison::Equal => least.then_some(true),
                Comparison::NotEqual if apart => Some(true),
                Comparison::NotEqual => least.then_some(false),
                Comparison::Less if most => Some(true),
                Comparison::Less => (one.low >= other.high).then_some(false),
                Comparison::GreaterOrEqual if most => Some(false),
                Comparison::GreaterOrEqual => (one.low >= other.high).then_some(true),
                Comparison::Greater if other.high < one.low => Some(true),
                Comparison::Greater => (one.high <= other.low).then_some(false),
                Comparison::LessOrEqual if other.high < one.low => Some(false),
                Comparison::LessOrEqual => (one.high <= other.low).then_some(true),
            };
            is.map_or(full, known)
        }
        (O::Add(kind), &[one, other]) if !kind.is_real() => {
            let unit = divisor(one.unit, other.unit);
            between(one.low + other.low, one.high + other.high, unit).wrapped(of)
        }
        (O::Subtract(kind), &[one, other]) if !kind.is_real() => {
            let unit = divisor(one.unit, other.unit);
            between(one.low - other.high, one.high - other.low, unit).wrapped(of)
        }
        (O::Negate(kind), &[one]) if !kind.is_real() => {
            between(-one.high, -one.low, one.unit).wrapped(of)
        }
        (O::Absolute(kind), &[one]) if !kind.is_real() => {
            let most = one.low.abs().max(one.high.abs());
            let least = if one.low > 0 { one.low } else { 0.max(-one.high) };
            between(least, most, one.unit).wrapped(of)
        }
        (O::Multiply(kind), &[one, other]) if !kind.is_real() => {
            let corners =
                [one.low, one.high].map(|a| [other.low, other.high].map(|b| a.checked_mul(b)));
            let corners: Option<Vec<i128>> = corners.into_iter().flatten().collect();
            let unit = one.unit.checked_mul(other.unit);
            match (corners, unit) {
                (Some(corners), Some(unit)) => {
                    let low = corners.iter().copied().min().unwrap_or(0);
                    let high = corners.iter().copied().max().unwrap_or(0);
                    between(low, high, unit).wrapped(of)
                }
                _ => full,
            }
        }
        (O::Divide(kind), &[one, other]) if !kind.is_real() => {
            if other.low == other.high && other.low > 0 {
                let by = other.low;
                let unit = if one.unit % by == 0 { one.unit / by } else { 1 };
                return between(one.low / by, one.high / by, unit).wrapped(of);
            }
            let most = one.low.abs().max(one.high.abs());
            let least = if one.is_natural() && other.is_natural() { 0 } else { -most };
            between(least, most, 1).wrapped(of)
        }
        (O::Modulo(kind), &[one, other]) if !kind.is_real() => {
            let most = (other.low.abs().max(other.high.abs()) - 1).max(0);
            let most = most.min(one.low.abs().max(one.high.abs()));
            let least = if one.is_natural() { 0 } else { -most };
            let high = if one.high <= 0 { 0 } else { most };
            between(least, high, 1).wrapped(of)
        }
        (O::Minimum(kind) | O::Maximum(kind), [first, rest @ ..]) if !kind.is_real() => {
            let take = |one: i128, other: i128| match operation {
                O::Minimum(_) => one.min(other),
                _ => one.max(other),
            };
            rest.iter().fold(*first, |known, next| Extent {
                low: take(known.low, next.low),
                high: take(known.high, next.high),
                unit: divisor(known.unit, next.unit),
            })
        }
        (O::Convert(from, to), &[one]) if !from.is_real() && !to.is_real() => {
            if to == Elementary::Bool { full } else { one.wrapped(of) }
        }
        (O::Reinterpret(from, _), &[one]) if !from.is_real() && !of.is_real() => one.wrapped(of),
        (O::And(kind), &[one, other]) if kind != Elementary::Bool => {
            match (one.is_natural(), other.is_natural()) {
                (true, true) => between(0, one.high.min(other.high), 1),
                _ => full,
            }
        }
        (O::Or(kind) | O::Xor(kind), &[one, other])
            if kind != Elementary::Bool && one.is_natural() && other.is_natural() =>
        {
            let high = one.high.max(other.high);
            let high = (1_i128 << (128 - high.leading_zeros())) - 1;
            between(0, high, 1).wrapped(of)
        }
        (O::ShiftRight(_), &[one, by]) if one.is_natural() && (0..64).contains(&by.low) => {
            between(0, one.high >> by.low, 1)
        }
        _ => full,
    }
}
