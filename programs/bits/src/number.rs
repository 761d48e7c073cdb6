//! Numbers as bits of a circuit, and what can be done with them exactly.

use understudy_logic::{Expression, Graph};

use crate::extent::Extent;

/// How numbers of an extent stand in bits: as multiples of a unit, in two's complement where some are negative; 0 alone has a unit of 0 and no bits.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Coding {
    pub(crate) unit: i128,
    pub(crate) width: usize,
    pub(crate) is_signed: bool,
}

impl From<Extent> for Coding {
    fn from(extent: Extent) -> Self {
        let by = extent.unit.max(1);
        let (low, high) = (extent.low.div_euclid(by), extent.high.div_euclid(by));
        let bits = |number: i128| (i128::BITS - number.leading_zeros()) as usize;
        let is_signed = low < 0;
        let width = match is_signed {
            true => 1 + bits(high.max(0)).max(bits(-low - 1)),
            false => bits(high),
        };
        Self { unit: extent.unit, width, is_signed }
    }
}

/// A number: its unit times what its bits say, the lowest first.
#[derive(Debug, Clone)]
pub(crate) struct Number {
    pub(crate) bits: Vec<Expression>,
    pub(crate) unit: i128,
    pub(crate) is_signed: bool,
}

impl Number {
    /// The bit that all bits above its own equal.
    fn sign(&self, graph: &mut Graph) -> Expression {
        match self.bits.last() {
            Some(&last) if self.is_signed => last,
            _ => graph.constant(false),
        }
    }

    /// So many of its bits.
    fn extended(&self, graph: &mut Graph, width: usize) -> Vec<Expression> {
        let sign = self.sign(graph);
        self.bits.iter().copied().chain(std::iter::repeat(sign)).take(width).collect()
    }

    /// So many bits of it as a multiple of a unit that divides its own.
    pub(crate) fn scaled(&self, graph: &mut Graph, unit: i128, width: usize) -> Vec<Expression> {
        debug_assert!(self.has_unit(unit), "{} in units of {unit}", self.unit);
        if self.unit == 0 {
            return vec![graph.constant(false); width];
        }
        let bits = self.extended(graph, width);
        times(graph, &bits, self.unit / unit)
    }

    /// Whether it is a multiple of a unit whatever its bits are.
    pub(crate) fn has_unit(&self, unit: i128) -> bool {
        self.unit == 0 || unit != 0 && self.unit % unit == 0
    }

    /// The same number in another coding, which has it.
    pub(crate) fn coded(&self, graph: &mut Graph, coding: Coding) -> Self {
        let Coding { unit, width, is_signed } = coding;
        Self { bits: self.scaled(graph, unit, width), unit, is_signed }
    }

    /// A constant in a coding that has it.
    pub(crate) fn constant(graph: &mut Graph, number: i128, coding: Coding) -> Self {
        let Coding { unit, width, is_signed } = coding;
        let multiple = number.div_euclid(unit.max(1));
        let bits = (0..width).map(|bit| graph.constant(multiple >> bit & 1 == 1));
        Self { bits: bits.collect(), unit, is_signed }
    }

    /// Whether it is at most a constant.
    pub(crate) fn is_at_most(&self, graph: &mut Graph, most: i128) -> Expression {
        let most = most.div_euclid(self.unit.max(1));
        let width = self.bits.len() as u32;
        let (least, greatest) = match self.is_signed {
            true => (-(1_i128 << (width - 1)), (1_i128 << (width - 1)) - 1),
            false => (0, (1_i128 << width) - 1),
        };
        if most < least || most >= greatest {
            return graph.constant(most >= greatest);
        }
        let limit: Vec<Expression> =
            (0..width).map(|bit| graph.constant(most >> bit & 1 == 1)).collect();
        let greater = is_less(graph, &limit, &self.bits, self.is_signed);
        graph.not(greater)
    }

    /// Whether it equals a constant.
    pub(crate) fn is_constant(&self, graph: &mut Graph, number: i128) -> Expression {
        let multiple = number.div_euclid(self.unit.max(1));
        let width = self.bits.len() as u32;
        let above = multiple >> if self.is_signed { width - 1 } else { width };
        let is_held = number.rem_euclid(self.unit.max(1)) == 0
            && (above == 0 || self.is_signed && above == -1);
        if !is_held {
            return graph.constant(false);
        }
        let equal: Vec<Expression> = (0..)
            .zip(&self.bits)
            .map(|(bit, &own)| if multiple >> bit & 1 == 1 { own } else { graph.not(own) })
            .collect();
        graph.all(equal)
    }
}

/// Two numbers in bits of one width and unit; whether they are signed.
pub(crate) fn aligned(
    graph: &mut Graph,
    one: &Number,
    other: &Number,
) -> (Vec<Expression>, Vec<Expression>, bool) {
    let unit = crate::extent::divisor(one.unit, other.unit).max(1);
    let is_signed = one.is_signed || other.is_signed;
    let width = |number: &Number| {
        let factor = number.unit / unit;
        let more = (i128::BITS - factor.leading_zeros()) as usize;
        let more = if factor == 1 { 0 } else { more };
        number.bits.len() + more + usize::from(is_signed && !number.is_signed)
    };
    let width = width(one).max(width(other));
    (one.scaled(graph, unit, width), other.scaled(graph, unit, width), is_signed)
}

/// Whether one row of bits is less than another of its width.
pub(crate) fn is_less(
    graph: &mut Graph,
    left: &[Expression],
    right: &[Expression],
    is_signed: bool,
) -> Expression {
    let mut less = graph.constant(false);
    for (place, (&one, &other)) in left.iter().zip(right).enumerate() {
        // The sign weighs the other way.
        let (one, other) = match is_signed && place + 1 == left.len() {
            true => (other, one),
            false => (one, other),
        };
        let differ = graph.xor(one, other);
        less = graph.if_then_else(differ, other, less);
    }
    less
}

pub(crate) fn is_equal(graph: &mut Graph, left: &[Expression], right: &[Expression]) -> Expression {
    let pairs = left.iter().zip(right);
    let differ: Vec<Expression> = pairs.map(|(&one, &other)| graph.xor(one, other)).collect();
    let differ = graph.any(differ);
    graph.not(differ)
}

/// One of two rows of bits.
pub(crate) fn mux(
    graph: &mut Graph,
    condition: Expression,
    then: &[Expression],
    otherwise: &[Expression],
) -> Vec<Expression> {
    let pairs = then.iter().zip(otherwise);
    pairs.map(|(&then, &otherwise)| graph.if_then_else(condition, then, otherwise)).collect()
}

/// left + right, or left − right; wraps.
pub(crate) fn sum(
    graph: &mut Graph,
    left: &[Expression],
    right: &[Expression],
    minus: bool,
) -> Vec<Expression> {
    let mut carry = graph.constant(minus);
    let mut sum = Vec::with_capacity(left.len());
    for (&one, &other) in left.iter().zip(right) {
        let other = if minus { graph.not(other) } else { other };
        let half = graph.xor(one, other);
        sum.push(graph.xor(half, carry));
        let both = graph.and(one, other);
        let passed = graph.and(half, carry);
        carry = graph.or(both, passed);
    }
    sum
}

/// −a; wraps.
pub(crate) fn negated(graph: &mut Graph, bits: &[Expression]) -> Vec<Expression> {
    let zero = vec![graph.constant(false); bits.len()];
    sum(graph, &zero, bits, true)
}

/// A row of bits times a constant; wraps.
fn times(graph: &mut Graph, bits: &[Expression], factor: i128) -> Vec<Expression> {
    let no = graph.constant(false);
    let shifted = |by: usize| -> Vec<Expression> {
        std::iter::repeat_n(no, by).chain(bits.iter().copied()).take(bits.len()).collect()
    };
    let places = (0..bits.len().min(127)).filter(|&place| factor >> place & 1 == 1);
    let mut product: Option<Vec<Expression>> = None;
    for place in places {
        let part = shifted(place);
        product = Some(match product {
            Some(so_far) => sum(graph, &so_far, &part, false),
            None => part,
        });
    }
    product.unwrap_or_else(|| vec![no; bits.len()])
}

/// left · right; wraps.
pub(crate) fn product(
    graph: &mut Graph,
    left: &[Expression],
    right: &[Expression],
) -> Vec<Expression> {
    let width = left.len();
    let no = graph.constant(false);
    let mut product = vec![no; width];
    for (place, &bit) in right.iter().enumerate() {
        if bit == no {
            continue;
        }
        let shifted: Vec<Expression> = (0..width)
            .map(|at| at.checked_sub(place).map_or(no, |from| graph.and(left[from], bit)))
            .collect();
        product = sum(graph, &product, &shifted, false);
    }
    product
}

/// Quotient towards 0 and remainder; of a divisor of 0 any.
pub(crate) fn quotient(
    graph: &mut Graph,
    dividend: &[Expression],
    divisor: &[Expression],
    is_signed: bool,
) -> (Vec<Expression>, Vec<Expression>) {
    let width = dividend.len();
    let no = graph.constant(false);
    let (minus_dividend, minus_divisor) = match is_signed {
        true => (dividend[width - 1], divisor[width - 1]),
        false => (no, no),
    };
    let opposite = negated(graph, dividend);
    let above = mux(graph, minus_dividend, &opposite, dividend);
    let opposite = negated(graph, divisor);
    let mut below = mux(graph, minus_divisor, &opposite, divisor);
    below.push(no);
    let mut rest = vec![no; width + 1];
    let mut quotient = vec![no; width];
    for place in (0..width).rev() {
        rest.rotate_right(1);
        rest[0] = above[place];
        let less = is_less(graph, &rest, &below, false);
        let fits = graph.not(less);
        let reduced = sum(graph, &rest, &below, true);
        rest = mux(graph, fits, &reduced, &rest);
        quotient[place] = fits;
    }
    rest.truncate(width);
    let is_negative = graph.xor(minus_dividend, minus_divisor);
    let opposite = negated(graph, &quotient);
    let quotient = mux(graph, is_negative, &opposite, &quotient);
    let opposite = negated(graph, &rest);
    let rest = mux(graph, minus_dividend, &opposite, &rest);
    (quotient, rest)
}
