//! Terms as bits: exact, for operations on few bits.

use understudy_logic::Expression;
use understudy_typed::{Elementary, Operation};

use super::{Meaning, PRODUCT, Pass, Pending};
use crate::numbers::term::{Node, Term, Variable};

impl Pass<'_> {
    /// Whether the bits of a term are followed.
    pub(super) fn is_bits(&mut self, term: Term) -> bool {
        if let Some(&known) = self.is_bits.get(&term) {
            return known;
        }
        let of = self.system.terms.of(term);
        let node = self.system.terms.node(term).clone();
        let is = match &node {
            Node::Constant(_) => !of.is_real(),
            Node::Variable(_) | Node::Unknown(_) => has_bits(of),
            Node::Choose([_, then, otherwise]) => self.is_bits(*then) && self.is_bits(*otherwise),
            // A number that is not followed, but for its bits.
            Node::Apply(operation, operands) => {
                has_bits(of)
                    || !of.is_real()
                        && is_by_bits(*operation)
                        && operands.iter().all(|&operand| self.is_bits(operand))
            }
        };
        self.is_bits.insert(term, is);
        is
    }

    /// The bits of a term, lowest first; free where they are not followed.
    pub(super) fn bits(&mut self, term: Term) -> Vec<Expression> {
        if let Some(known) = self.bits.get(&term) {
            return known.clone();
        }
        let of = self.system.terms.of(term);
        let bits = self.new_bits(term, of);
        self.bits.insert(term, bits.clone());
        bits
    }

    pub(super) fn new_bits(&mut self, term: Term, of: Elementary) -> Vec<Expression> {
        let width = of.bits();
        let node = self.system.terms.node(term).clone();
        match node {
            Node::Constant(stored) => {
                (0..width).map(|bit| self.constant(stored >> bit & 1 == 1)).collect()
            }
            Node::Variable(Variable::Input(number)) if has_bits(of) => {
                let name = self.system.inputs[number as usize].name.clone();
                (0..width)
                    .map(|bit| {
                        let name = match of {
                            Elementary::Bool => name.clone(),
                            _ => format!("{name}.{bit}"),
                        };
                        self.input(&name, Meaning::Bit(number, bit))
                    })
                    .collect()
            }
            Node::Variable(Variable::Cell(cell)) if has_bits(of) => {
                let initial = self.system.cells[cell as usize].initial;
                let (registers, values): (Vec<_>, Vec<_>) = (0..width)
                    .map(|bit| {
                        let name = format!("cell {cell}.{bit}");
                        self.builder.register(name, initial >> bit & 1 == 1)
                    })
                    .unzip();
                self.cells.insert(cell, (registers, values.clone()));
                self.pending.push(Pending::Bits(cell));
                values
            }
            Node::Choose([condition, then, otherwise]) => {
                let condition = self.bits(condition)[0];
                let then = self.bits(then);
                let otherwise = self.bits(otherwise);
                self.mux(condition, &then, &otherwise)
            }
            Node::Apply(Operation::Compare(comparison, _), operands) => {
                vec![self.compare(comparison, operands[0], operands[1])]
            }
            Node::Apply(operation, operands) => {
                let all = operands.iter().all(|&operand| self.is_bits(operand));
                let known = match all {
                    true => self.operation(operation, &operands, width),
                    false => None,
                };
                known.unwrap_or_else(|| self.free(term, width))
            }
            Node::Unknown(_) | Node::Variable(_) => self.free(term, width),
        }
    }

    pub(super) fn free(&mut self, term: Term, width: u32) -> Vec<Expression> {
        let name = self.system.describe(term);
        (0..width)
            .map(|bit| self.input(&format!("{name}.{bit}"), Meaning::Free(term, bit)))
            .collect()
    }

    pub(super) fn mux(
        &mut self,
        condition: Expression,
        then: &[Expression],
        otherwise: &[Expression],
    ) -> Vec<Expression> {
        let pairs = then.iter().zip(otherwise);
        pairs
            .map(|(&then, &otherwise)| {
                self.builder.graph().if_then_else(condition, then, otherwise)
            })
            .collect()
    }

    /// An operation whose operands have bits, where it is followed.
    pub(super) fn operation(
        &mut self,
        operation: Operation,
        operands: &[Term],
        width: u32,
    ) -> Option<Vec<Expression>> {
        use Operation as O;
        let width = width as usize;
        let terms: Vec<Vec<Expression>> = operands.iter().map(|&term| self.bits(term)).collect();
        let constant = |this: &Self, place: usize| this.system.terms.value(operands[place]);
        let no = self.constant(false);
        Some(match operation {
            O::Not(_) => terms[0].iter().map(|&bit| self.builder.graph().not(bit)).collect(),
            O::And(_) | O::Or(_) | O::Xor(_) => {
                let pairs = terms[0].iter().zip(&terms[1]);
                pairs
                    .map(|(&one, &other)| {
                        let graph = self.builder.graph();
                        match operation {
                            O::And(_) => graph.and(one, other),
                            O::Or(_) => graph.or(one, other),
                            _ => graph.xor(one, other),
                        }
                    })
                    .collect()
            }
            O::Add(_) => self.sum(&terms[0], &terms[1], false),
            O::Subtract(_) => self.sum(&terms[0], &terms[1], true),
            O::Negate(_) => self.sum(&vec![no; width], &terms[0], true),
            O::Absolute(of) => {
                if !of.is_signed() {
                    return Some(terms[0].clone());
                }
                let negated = self.sum(&vec![no; width], &terms[0], true);
                self.mux(terms[0][width - 1], &negated, &terms[0])
            }
            O::Multiply(_) => {
                let (left, right) = match constant(self, 0) {
                    Some(_) => (&terms[1], &terms[0]),
                    None => (&terms[0], &terms[1]),
                };
                let is_small = constant(self, 0).or(constant(self, 1)).is_some();
                if !is_small && width > PRODUCT {
                    return None;
                }
                let mut product = vec![no; width];
                for (place, &bit) in right.iter().enumerate() {
                    let shifted: Vec<Expression> = (0..width)
                        .map(|at| match at.checked_sub(place) {
                            Some(from) => self.builder.graph().and(left[from], bit),
                            None => no,
                        })
                        .collect();
                    product = self.sum(&product, &shifted, false);
                }
                product
            }
            O::Minimum(of) | O::Maximum(of) => {
                let mut best = terms[0].clone();
                for next in &terms[1..] {
                    let is_less = self.less(of, next, &best);
                    let is_more = self.less(of, &best, next);
                    let taken = match operation {
                        O::Minimum(_) => is_less,
                        _ => is_more,
                    };
                    best = self.mux(taken, next, &best);
                }
                best
            }
            O::Convert(from, to) if !from.is_real() && !to.is_real() => {
                if to == Elementary::Bool {
                    return Some(vec![self.builder.graph().any(terms[0].iter().copied())]);
                }
                let fill = match from.is_signed() {
                    true => terms[0][terms[0].len() - 1],
                    false => no,
                };
                let bits = terms[0].iter().copied().chain(std::iter::repeat(fill));
                bits.take(width).collect()
            }
            O::Reinterpret(from, _) if !from.is_real() => terms[0].clone(),
            O::Extract { at, .. } => {
                let bits = terms[0].iter().copied().chain(std::iter::repeat(no));
                bits.skip(usize::from(at & 63)).take(width).collect()
            }
            O::Insert { part, at, .. } => {
                let mut bits = terms[0].clone();
                let at = usize::from(at & 63);
                for (place, &bit) in terms[1].iter().enumerate().take(part.bits() as usize) {
                    if let Some(into) = bits.get_mut(at + place) {
                        *into = bit;
                    }
                }
                bits
            }
            O::ShiftLeft(_) | O::ShiftRight(_) => {
                let by = usize::try_from(constant(self, 1)?).unwrap_or(usize::MAX);
                (0..width)
                    .map(|at| {
                        let from = match operation {
                            O::ShiftLeft(_) => at.checked_sub(by),
                            _ => at.checked_add(by),
                        };
                        from.and_then(|from| terms[0].get(from).copied()).unwrap_or(no)
                    })
                    .collect()
            }
            O::RotateLeft(_) | O::RotateRight(_) => {
                let by = constant(self, 1)? as i64;
                let by = match operation {
                    O::RotateLeft(_) => by,
                    _ => by.wrapping_neg(),
                };
                let by = by.rem_euclid(width as i64) as usize;
                (0..width).map(|at| terms[0][(at + width - by) % width]).collect()
            }
            O::Divide(of) | O::Modulo(of) => {
                if width > PRODUCT && constant(self, 1).is_none() {
                    return None;
                }
                let (quotient, rest) = self.quotient(of, &terms[0], &terms[1]);
                match operation {
                    O::Divide(_) => quotient,
                    _ => rest,
                }
            }
            _ => return None,
        })
    }

    /// left + right, or left − right; wraps.
    pub(super) fn sum(
        &mut self,
        left: &[Expression],
        right: &[Expression],
        minus: bool,
    ) -> Vec<Expression> {
        let graph = self.builder.graph();
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

    /// Quotient towards 0 and remainder; of a divisor of 0 any.
    pub(super) fn quotient(
        &mut self,
        of: Elementary,
        dividend: &[Expression],
        divisor: &[Expression],
    ) -> (Vec<Expression>, Vec<Expression>) {
        let width = dividend.len();
        let no = self.constant(false);
        let zero = vec![no; width];
        let (minus_dividend, minus_divisor) = match of.is_signed() {
            true => (dividend[width - 1], divisor[width - 1]),
            false => (no, no),
        };
        let negated = self.sum(&zero, dividend, true);
        let above = self.mux(minus_dividend, &negated, dividend);
        let negated = self.sum(&zero, divisor, true);
        let below = self.mux(minus_divisor, &negated, divisor);
        let mut rest = vec![no; width + 1];
        let mut wide = below.clone();
        wide.push(no);
        let mut quotient = vec![no; width];
        for place in (0..width).rev() {
            rest.rotate_right(1);
            rest[0] = above[place];
            let is_less = self.less(Elementary::Ulint, &rest, &wide);
            let fits = self.builder.graph().not(is_less);
            let reduced = self.sum(&rest, &wide, true);
            rest = self.mux(fits, &reduced, &rest);
            quotient[place] = fits;
        }
        rest.truncate(width);
        let is_negative = self.builder.graph().xor(minus_dividend, minus_divisor);
        let negated = self.sum(&zero, &quotient, true);
        let quotient = self.mux(is_negative, &negated, &quotient);
        let negated = self.sum(&zero, &rest, true);
        let rest = self.mux(minus_dividend, &negated, &rest);
        (quotient, rest)
    }
}

/// Whether a number of the type is followed bit by bit where it is stored.
pub(super) fn has_bits(of: Elementary) -> bool {
    !of.is_real() && (of.bits() <= 32 || of.is_bit_string())
}

/// Operations that [`Pass::operation`] follows for numbers of any width.
pub(super) fn is_by_bits(operation: Operation) -> bool {
    use Operation as O;
    match operation {
        O::Add(_)
        | O::Subtract(_)
        | O::Negate(_)
        | O::Not(_)
        | O::And(_)
        | O::Or(_)
        | O::Xor(_)
        | O::Absolute(_)
        | O::Minimum(_)
        | O::Maximum(_)
        | O::Extract { .. }
        | O::Insert { .. } => true,
        O::Convert(from, to) | O::Reinterpret(from, to) => !from.is_real() && !to.is_real(),
        _ => false,
    }
}
