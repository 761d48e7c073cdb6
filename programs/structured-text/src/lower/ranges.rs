//! Which numbers an expression can be, from the types of its parts.

use understudy_typed::{Elementary, Expression, ExpressionKind, Operation};

use super::convert::{is_whole, limits};
use super::facts::Facts;

/// From the least to the greatest number.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Interval(i128, i128);

/// The numbers that an expression can be.
#[derive(Debug, Clone, Copy)]
pub(super) struct Range {
    /// All of them.
    pub(super) possible: Interval,
    /// Those where no sum and no difference leaves the types of its parts, and bits that are inverted are those of a type. Every counter can
    /// leave its type, so only what is beyond these numbers is worth a warning.
    pub(super) likely: Interval,
}

impl Interval {
    pub(super) fn new(low: i128, high: i128) -> Self {
        Self(low, high)
    }

    pub(super) fn just(number: i128) -> Self {
        Self(number, number)
    }

    pub(super) fn is_within(self, (least, most): (i128, i128)) -> bool {
        least <= self.0 && self.1 <= most
    }

    pub(super) fn ends(self) -> (i128, i128) {
        (self.0, self.1)
    }

    fn corners(self, other: Self, join: impl Fn(i128, i128) -> i128) -> Self {
        let all = [
            join(self.0, other.0),
            join(self.0, other.1),
            join(self.1, other.0),
            join(self.1, other.1),
        ];
        let first = all[0];
        Self(all.into_iter().fold(first, i128::min), all.into_iter().fold(first, i128::max))
    }

    fn plus(self, other: Self) -> Self {
        Self(self.0.saturating_add(other.0), self.1.saturating_add(other.1))
    }

    fn negated(self) -> Self {
        Self(self.1.saturating_neg(), self.0.saturating_neg())
    }

    pub(super) fn times(self, other: Self) -> Self {
        self.corners(other, i128::saturating_mul)
    }

    /// Towards 0; a divisor of 0 is a fault.
    fn by(self, other: Self) -> Self {
        let quotient = |left: i128, right: i128| left.checked_div(right).unwrap_or(0);
        // The divisors of the least size give the largest quotients.
        let near = |divisor: i128| divisor == 0 || other.0 <= divisor && divisor <= other.1;
        let mut found = self.corners(other, quotient);
        for divisor in [-1, 1].into_iter().filter(|divisor| near(*divisor)) {
            found = found.hull(self.corners(Self(divisor, divisor), quotient));
        }
        if other.0 <= 0 && 0 <= other.1 { found.hull(Self(0, 0)) } else { found }
    }

    fn remainder(self, other: Self) -> Self {
        let most = other.0.saturating_abs().max(other.1.saturating_abs()).saturating_sub(1).max(0);
        let low = if self.0 < 0 { (-most).max(self.0) } else { 0 };
        let high = if self.1 > 0 { most.min(self.1) } else { 0 };
        Self(low, high)
    }

    pub(super) fn hull(self, other: Self) -> Self {
        Self(self.0.min(other.0), self.1.max(other.1))
    }

    /// What both have; the first where they have nothing.
    pub(super) fn meet(self, other: Self) -> Self {
        let both = Self(self.0.max(other.0), self.1.min(other.1));
        if both.0 <= both.1 { both } else { self }
    }

    /// How many bits its numbers have, beside the sign.
    fn bits(self) -> u32 {
        let bits =
            |value: i128| i128::BITS - if value < 0 { !value } else { value }.leading_zeros();
        bits(self.0).max(bits(self.1))
    }
}

/// What an expression can be. With what is known of variables, it is for warnings: nothing keeps a variable within its subrange.
pub(super) fn ranges(value: &Expression, known: Option<&Facts>) -> Range {
    found(value, known).0
}

fn exactly(range: Interval) -> (Range, Interval) {
    (Range { possible: range, likely: range }, range)
}

/// The range, and the hull of the types of the parts.
fn found(value: &Expression, known: Option<&Facts>) -> (Range, Interval) {
    use Operation as O;
    let Some(of) = value.of.elementary().filter(|of| is_whole(*of)) else {
        return exactly(Interval(i128::MIN, i128::MAX));
    };
    let (least, most) = limits(of);
    let whole = Interval(least, most);
    let (operation, operands) = match &value.kind {
        ExpressionKind::Constant(stored) => {
            let number = of.signed(*stored);
            return exactly(Interval(number, number));
        }
        ExpressionKind::Apply(operation, operands) => (*operation, operands.as_slice()),
        ExpressionKind::Load(place) => {
            let Some(known) = known else {
                return exactly(whole);
            };
            let declared = place.range.map_or(whole, |(low, high)| Interval(low, high));
            let found = known.of(place).unwrap_or(declared);
            return (Range { possible: found, likely: found }, declared);
        }
        ExpressionKind::Call(call) if known.is_some() => {
            let range = call.result.as_ref().and_then(|result| result.range);
            return exactly(range.map_or(whole, |(low, high)| Interval(low, high)));
        }
        ExpressionKind::Choose(parts) => {
            let [_, then, otherwise] = &**parts;
            return either(found(then, known), found(otherwise, known));
        }
        _ => return exactly(whole),
    };
    if let O::Not(_) | O::And(_) | O::Or(_) | O::Xor(_) = operation {
        return bitwise(operation, operands, known);
    }
    let found = match (operation, operands) {
        (O::Convert(from, _) | O::Reinterpret(from, _), [inner]) if is_whole(from) => {
            let (inner, types) = found(inner, known);
            let kept = |range: Interval| match range.is_within((least, most)) {
                true => range,
                false => whole,
            };
            let likely = kept(inner.likely);
            return (Range { possible: kept(inner.possible), likely }, types.meet(whole));
        }
        (O::Convert(Elementary::Bool, _), _) => return exactly(Interval(0, 1)),
        (O::Negate(_), [inner]) => {
            let (inner, types) = found(inner, known);
            let possible = inner.possible.negated();
            let likely = inner.likely.negated().meet(types.hull(Interval(0, 0)));
            (Range { possible, likely }, types)
        }
        (O::Select(_), [_, no, yes]) => either(found(no, known), found(yes, known)),
        (
            O::Add(_)
            | O::Subtract(_)
            | O::Multiply(_)
            | O::Divide(_)
            | O::Modulo(_)
            | O::Minimum(_)
            | O::Maximum(_),
            [left, right],
        ) => {
            let ((left, one), (right, other)) = (found(left, known), found(right, known));
            let types = one.hull(other);
            let joined = |left: Interval, right: Interval| match operation {
                O::Add(_) => left.plus(right),
                O::Subtract(_) => left.plus(right.negated()),
                O::Multiply(_) => left.times(right),
                O::Divide(_) => left.by(right),
                O::Modulo(_) => left.remainder(right),
                O::Minimum(_) => Interval(left.0.min(right.0), left.1.min(right.1)),
                _ => Interval(left.0.max(right.0), left.1.max(right.1)),
            };
            let possible = joined(left.possible, right.possible);
            let likely = joined(left.likely, right.likely);
            let of_types =
                left.likely.is_within(types.ends()) && right.likely.is_within(types.ends());
            let likely = match operation {
                O::Add(_) | O::Subtract(_) if of_types => likely.meet(types),
                _ => likely,
            };
            (Range { possible, likely }, types)
        }
        _ => return exactly(whole),
    };
    let (range, types) = found;
    let kept = |range: Interval| if range.is_within((least, most)) { range } else { whole };
    (Range { possible: kept(range.possible), likely: kept(range.likely) }, types)
}

/// One of two values.
fn either(
    (one, its): (Range, Interval),
    (other, of_other): (Range, Interval),
) -> (Range, Interval) {
    let possible = one.possible.hull(other.possible);
    (Range { possible, likely: one.likely.hull(other.likely) }, its.hull(of_other))
}

/// Bit by bit: the result has as many bits as the operands.
fn bitwise(
    operation: Operation,
    operands: &[Expression],
    known: Option<&Facts>,
) -> (Range, Interval) {
    let operands: Vec<(Range, Interval)> =
        operands.iter().map(|operand| found(signed(operand), known)).collect();
    let bits = operands.iter().map(|(range, _)| range.possible.bits()).max().unwrap_or(0);
    let size = 1_i128 << bits.min(64);
    let inverts = matches!(operation, Operation::Not(_));
    let mut natural = operands.iter().map(|(range, _)| range.likely);
    let is_natural = natural.all(|range| range.0 >= 0);
    let is_positive = !inverts && operands.iter().all(|(range, _)| range.possible.0 >= 0);
    let masks = operands.iter().filter(|(range, _)| range.possible.0 >= 0);
    let mask = masks.map(|(range, _)| range.possible.1).min();
    let possible = match (operation, mask) {
        (Operation::And(_), Some(mask)) => Interval(0, mask),
        _ if is_positive => Interval(0, size - 1),
        _ => Interval(-size, size - 1),
    };
    let likely = match possible.0 < 0 && is_natural {
        true => Interval(0, size - 1),
        false => possible,
    };
    let types = operands.iter().map(|(_, types)| *types).reduce(Interval::hull);
    (Range { possible, likely }, types.unwrap_or(possible))
}

/// The number whose bits these are.
fn signed(value: &Expression) -> &Expression {
    match &value.kind {
        ExpressionKind::Apply(Operation::Reinterpret(Elementary::Dint, _), operands) => {
            operands.first().unwrap_or(value)
        }
        _ => value,
    }
}
