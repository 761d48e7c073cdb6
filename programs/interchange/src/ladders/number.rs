//! Whole numbers as bits: two's complement where an interval reaches below 0, and as wide as the interval needs.
//!
//! Calculating is exact: a result is as wide as its interval, so nothing is lost before it is stored.

use understudy_ladder::Relation;
use understudy_logic::{Expression, Graph};

use super::bounds::Interval;

/// A number, the low bit first.
#[derive(Debug, Clone)]
pub(super) struct Bits {
    pub(super) bits: Vec<Expression>,
    pub(super) interval: Interval,
}

impl Bits {
    pub(super) fn constant(graph: &mut Graph, value: i64) -> Self {
        let interval = Interval::just(value);
        let (width, _) = interval.width();
        let bits = (0..width).map(|place| graph.constant(value >> place.min(63) & 1 == 1));
        Self { bits: bits.collect(), interval }
    }

    /// Its value where all bits are constant.
    pub(super) fn known(&self, graph: &Graph) -> Option<i64> {
        let (_, signed) = self.interval.width();
        let mut value = 0_i64;
        for (place, bit) in self.bits.iter().enumerate() {
            let understudy_logic::Operation::Constant(bit) = graph.operation(*bit) else {
                return None;
            };
            if bit && place < 63 {
                value |= 1 << place;
            }
            if bit && signed && place + 1 == self.bits.len() {
                value |= -1 << place.min(63);
            }
        }
        Some(value)
    }

    /// `width` bits of it, extended by its sign or cut off.
    fn extended(&self, graph: &mut Graph, width: usize) -> Vec<Expression> {
        let (_, signed) = self.interval.width();
        let fill = match self.bits.last() {
            Some(sign) if signed => *sign,
            _ => graph.constant(false),
        };
        let mut bits = self.bits.clone();
        bits.resize(width, fill);
        bits
    }

    /// Stored in a place for `interval`; what does not fit wraps around.
    pub(super) fn stored(&self, graph: &mut Graph, interval: Interval) -> Self {
        let (width, _) = interval.width();
        Self { bits: self.extended(graph, width), interval }
    }

    pub(super) fn plus(&self, graph: &mut Graph, other: &Self) -> Self {
        let carry = graph.constant(false);
        let interval = self.interval.plus(other.interval);
        self.added(graph, other, carry, interval)
    }

    fn added(
        &self,
        graph: &mut Graph,
        other: &Self,
        mut carry: Expression,
        interval: Interval,
    ) -> Self {
        let (width, _) = interval.width();
        let left = self.extended(graph, width);
        let right = other.extended(graph, width);
        let mut bits = Vec::with_capacity(width);
        for (left, right) in left.into_iter().zip(right) {
            let half = graph.xor(left, right);
            bits.push(graph.xor(half, carry));
            let both = graph.and(left, right);
            let passed = graph.and(half, carry);
            carry = graph.or(both, passed);
        }
        Self { bits, interval }
    }

    pub(super) fn minus(&self, graph: &mut Graph, other: &Self) -> Self {
        let interval = self.interval.plus(other.interval.negated());
        let (width, _) = interval.width();
        // a - b = a + not b + 1, in as many bits as the result has.
        let inverted = other.extended(graph, width);
        let inverted = Self {
            bits: inverted.into_iter().map(|bit| graph.not(bit)).collect(),
            interval: other.interval,
        };
        let carry = graph.constant(true);
        let left = Self { bits: self.extended(graph, width), interval: self.interval };
        left.added(graph, &inverted, carry, interval)
    }

    pub(super) fn times(&self, graph: &mut Graph, other: &Self) -> Self {
        let interval = self.interval.times(other.interval);
        let (width, _) = interval.width();
        let left = self.extended(graph, width);
        let right = other.extended(graph, width);
        // Of no more bits than the result, whatever the signs are: two's complement is arithmetic modulo 2^width.
        let zero = graph.constant(false);
        let mut sum = Self { bits: vec![zero; width], interval };
        for (place, factor) in right.into_iter().enumerate() {
            let mut bits = vec![zero; place];
            for bit in &left[..width - place] {
                bits.push(graph.and(*bit, factor));
            }
            let part = Self { bits, interval };
            sum = sum.added(graph, &part, zero, interval);
        }
        sum
    }

    /// Without its sign.
    fn magnitude(&self, graph: &mut Graph) -> (Self, Expression) {
        let (width, signed) = self.interval.width();
        let zero = graph.constant(false);
        if !signed {
            return (self.clone(), zero);
        }
        let sign = self.bits[width - 1];
        let negated = Self::constant(graph, 0).minus(graph, self);
        let positive = self.chosen(graph, sign, &negated);
        let most = self.interval.high.max(-self.interval.low);
        (positive.stored(graph, Interval::new(0, most)), sign)
    }

    /// `other` where `condition` holds, else itself.
    pub(super) fn chosen(&self, graph: &mut Graph, condition: Expression, other: &Self) -> Self {
        let interval = self.interval.hull(other.interval);
        let (width, _) = interval.width();
        let own = self.extended(graph, width);
        let other = other.extended(graph, width);
        let bits = own.into_iter().zip(other);
        Self {
            bits: bits.map(|(own, other)| choose(graph, condition, other, own)).collect(),
            interval,
        }
    }

    fn signed_by(&self, graph: &mut Graph, sign: Expression, interval: Interval) -> Self {
        let negated = Self::constant(graph, 0).minus(graph, self);
        self.chosen(graph, sign, &negated).stored(graph, interval)
    }

    /// Quotient towards 0 and remainder with the sign of what is divided.
    pub(super) fn divided(&self, graph: &mut Graph, by: i64) -> (Self, Self) {
        let (positive, sign) = self.magnitude(graph);
        let divisor = i128::from(by.unsigned_abs());
        let most = positive.interval.high;
        let mut rest = Self::constant(graph, 0);
        let mut bits = Vec::with_capacity(positive.bits.len());
        for bit in positive.bits.iter().rev() {
            // The rest is below the divisor; twice it and a bit are below twice the divisor.
            let mut shifted = vec![*bit];
            shifted.extend(&rest.bits);
            let (width, _) = Interval::new(0, 2 * divisor - 1).width();
            let zero = graph.constant(false);
            shifted.resize(width, zero);
            let shifted = Self { bits: shifted, interval: Interval::new(0, 2 * divisor - 1) };
            let divisor_bits = Self::constant(graph, i64::try_from(divisor).unwrap_or(i64::MAX));
            let fits = shifted.compare(graph, Relation::GreaterOrEqual, &divisor_bits);
            let less = shifted.minus(graph, &divisor_bits);
            rest = shifted.chosen(graph, fits, &less).stored(graph, Interval::new(0, divisor - 1));
            bits.push(fits);
        }
        bits.reverse();
        let quotient = Self { bits, interval: positive.interval };
        let quotient = quotient.stored(graph, Interval::new(0, most / divisor));
        let negative_divisor = graph.constant(by < 0);
        let quotient_sign = graph.xor(sign, negative_divisor);
        (
            quotient.signed_by(graph, quotient_sign, self.interval.quotient(by)),
            rest.signed_by(graph, sign, self.interval.remainder(by)),
        )
    }

    pub(super) fn compare(
        &self,
        graph: &mut Graph,
        relation: Relation,
        other: &Self,
    ) -> Expression {
        match relation {
            Relation::Equal | Relation::NotEqual => {
                let (left, right) = self.beside(graph, other);
                let mut same = graph.constant(true);
                for (left, right) in left.into_iter().zip(right) {
                    let differs = graph.xor(left, right);
                    let equal = graph.not(differs);
                    same = graph.and(same, equal);
                }
                if relation == Relation::Equal { same } else { graph.not(same) }
            }
            Relation::Less => self.less(graph, other),
            Relation::Greater => other.less(graph, self),
            Relation::LessOrEqual => {
                let more = other.less(graph, self);
                graph.not(more)
            }
            Relation::GreaterOrEqual => {
                let less = self.less(graph, other);
                graph.not(less)
            }
        }
    }

    /// Both as wide as the wider, and with a sign where one has it.
    fn beside(&self, graph: &mut Graph, other: &Self) -> (Vec<Expression>, Vec<Expression>) {
        let (width, _) = self.interval.hull(other.interval).width();
        (self.extended(graph, width), other.extended(graph, width))
    }

    /// From the low bit up, the highest bit that differs decides; the bit of the sign decides the other way round.
    fn less(&self, graph: &mut Graph, other: &Self) -> Expression {
        let (_, signed) = self.interval.hull(other.interval).width();
        let (left, right) = self.beside(graph, other);
        let mut less = graph.constant(false);
        let width = left.len();
        for (place, (left, right)) in left.into_iter().zip(right).enumerate() {
            let (low, high) =
                if signed && place + 1 == width { (right, left) } else { (left, right) };
            less = smaller(graph, low, high, less);
        }
        less
    }
}

/// `high` where the bits differ, else `less`: shorter where one of the bits is known.
fn smaller(graph: &mut Graph, low: Expression, high: Expression, less: Expression) -> Expression {
    let not_low = graph.not(low);
    let here = graph.and(not_low, high);
    let equal_or_less = graph.or(not_low, high);
    let passed = graph.and(equal_or_less, less);
    graph.or(here, passed)
}

/// `then` where `condition` holds, else `otherwise`, without what a constant makes superfluous.
pub(super) fn choose(
    graph: &mut Graph,
    condition: Expression,
    then: Expression,
    otherwise: Expression,
) -> Expression {
    use understudy_logic::Operation::Constant;
    match (graph.operation(then), graph.operation(otherwise)) {
        _ if then == otherwise => then,
        (Constant(true), _) => graph.or(condition, otherwise),
        (Constant(false), _) => {
            let not = graph.not(condition);
            graph.and(not, otherwise)
        }
        (_, Constant(true)) => {
            let not = graph.not(condition);
            graph.or(not, then)
        }
        (_, Constant(false)) => graph.and(condition, then),
        _ => graph.if_then_else(condition, then, otherwise),
    }
}

#[cfg(test)]
mod tests {
    use understudy_logic::Variable;

    use super::*;

    /// A number of `interval` whose bits are the variables from `first`.
    fn variable(graph: &mut Graph, first: u32, interval: Interval) -> Bits {
        let (width, _) = interval.width();
        let bits = (0..width).map(|place| {
            let place = u32::try_from(place).expect("a small width");
            graph.variable(Variable::Input(first + place))
        });
        Bits { bits: bits.collect(), interval }
    }

    fn value(graph: &Graph, number: &Bits, assignment: u64) -> i128 {
        let (width, signed) = number.interval.width();
        assert_eq!(width, number.bits.len());
        let bit = |place: usize| {
            graph.evaluate(number.bits[place], |variable| match variable {
                Variable::Input(index) | Variable::Register(index) => assignment >> index & 1 == 1,
            })
        };
        (0..width).fold(0, |sum, place| {
            let weight = 1_i128 << place;
            let weight = if signed && place + 1 == width { -weight } else { weight };
            sum + if bit(place) { weight } else { 0 }
        })
    }

    /// All pairs of numbers of all signs and of up to four bits.
    #[test]
    fn calculates_as_whole_numbers_do() {
        let intervals =
            [(0, 0), (0, 1), (0, 5), (0, 7), (-1, 0), (-4, 3), (-3, 7), (-8, -2), (2, 6)];
        for (low, high) in intervals {
            for (other_low, other_high) in intervals {
                let left_interval = Interval::new(low, high);
                let right_interval = Interval::new(other_low, other_high);
                let mut graph = Graph::new();
                let left = variable(&mut graph, 0, left_interval);
                let right = variable(&mut graph, 5, right_interval);
                let sum = left.plus(&mut graph, &right);
                let difference = left.minus(&mut graph, &right);
                let product = left.times(&mut graph, &right);
                let less = left.compare(&mut graph, Relation::Less, &right);
                let equal = left.compare(&mut graph, Relation::Equal, &right);
                let divided: Vec<_> =
                    [1, 2, 3, -2, 5, 9].map(|by| (by, left.divided(&mut graph, by))).into();
                for a in low..=high {
                    for b in other_low..=other_high {
                        let bits = |value: i128| u64::try_from(value & 31).expect("5 bits");
                        let assignment = bits(a) | bits(b) << 5;
                        assert_eq!(value(&graph, &left, assignment), a);
                        assert_eq!(value(&graph, &sum, assignment), a + b);
                        assert_eq!(value(&graph, &difference, assignment), a - b);
                        assert_eq!(value(&graph, &product, assignment), a * b, "{a} * {b}");
                        let holds = |truth| {
                            graph.evaluate(truth, |variable| match variable {
                                Variable::Input(index) | Variable::Register(index) => {
                                    assignment >> index & 1 == 1
                                }
                            })
                        };
                        assert_eq!(holds(less), a < b, "{a} < {b}");
                        assert_eq!(holds(equal), a == b);
                        for (by, (quotient, rest)) in &divided {
                            let by = i128::from(*by);
                            assert_eq!(value(&graph, quotient, assignment), a / by, "{a} / {by}");
                            assert_eq!(value(&graph, rest, assignment), a % by, "{a} mod {by}");
                        }
                    }
                }
            }
        }
    }
}
