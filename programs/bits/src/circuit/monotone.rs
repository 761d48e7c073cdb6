//! Comparisons of a result as comparisons of its operand, where one grows with the other.
//!
//! ```text
//! 2.0 * (60.0 - t) <= 40.0      t >= 40.0
//! INT_TO_REAL(n) * 0.1 <= 5.0   n <= 50
//! ```
//!
//! Sums, products and quotients with a finite constant and conversions are rounded to the nearest number, so they keep the order of their operand or
//! turn it around: at most at a boundary is the result for all operands up to one of them, or from one on. That one is searched with the operation
//! itself, so its rounding counts.

use understudy_logic::Expression;
use understudy_typed::{Elementary, Operation};

use super::Pass;
use super::boundaries::{position, real};
use crate::term::{Node, Term, Variable};

/// An operation with one operand that is no constant.
pub(super) struct Monotone {
    operation: Operation,
    operands: Vec<Term>,
    /// The place of that operand.
    place: usize,
    /// Whether the result grows with it.
    grows: bool,
}

impl Monotone {
    pub(super) fn operand(&self) -> Term {
        self.operands[self.place]
    }
}

impl Pass<'_> {
    /// The term as such an operation, where its boundaries can be those of its operand.
    pub(super) fn monotone(&mut self, term: Term) -> Option<Monotone> {
        let Node::Apply(operation, operands) = self.system.terms.node(term).clone() else {
            return None;
        };
        let constant = |place: usize| {
            let operand: Term = *operands.get(place)?;
            let value = self.system.terms.value(operand)?;
            real(self.system.terms.of(operand), value).filter(|value| value.is_finite())
        };
        // The place of the operand that is no constant, and the constant.
        let known = || match (operands.len(), constant(0), constant(1)) {
            (2, None, Some(by)) => Some((0, by)),
            (2, Some(by), None) => Some((1, by)),
            _ => None,
        };
        use Operation as O;
        let (place, grows) = match operation {
            O::Convert(from, to) if to.is_real() && (from.is_real() || from.is_integer()) => {
                (0, true)
            }
            O::Add(of) if of.is_real() => (known()?.0, true),
            O::Subtract(of) if of.is_real() => {
                let (place, _) = known()?;
                (place, place == 0)
            }
            O::Multiply(of) | O::Divide(of) if of.is_real() => {
                let (place, by) = known()?;
                let is_divided_by = matches!(operation, O::Divide(_)) && place == 1;
                if by == 0.0 || is_divided_by {
                    return None;
                }
                (place, by > 0.0)
            }
            _ => return None,
        };
        let monotone = Monotone { operation, operands: operands.to_vec(), place, grows };
        let operand = monotone.operand();
        // A conversion of reals keeps the boundary, or the nearest one; another operation shifts it.
        let is_kept = matches!(operation, Operation::Convert(from, _) if from.is_real());
        (is_kept || self.ends(operand)).then_some(monotone)
    }

    /// Whether boundaries of a number end at inputs, at bits or at what is not followed. Boundaries that are shifted and then asked of a cell would be
    /// asked of its next value, shifted once more, without an end.
    fn ends(&mut self, term: Term) -> bool {
        if let Some(&known) = self.ends.get(&term) {
            return known;
        }
        let ends = self.is_bits(term)
            || match self.system.terms.node(term).clone() {
                Node::Constant(_) | Node::Unknown(_) | Node::Variable(Variable::Input(_)) => true,
                Node::Variable(Variable::Cell(_)) => false,
                Node::Choose([_, then, otherwise]) => self.ends(then) && self.ends(otherwise),
                Node::Apply(
                    Operation::Negate(_)
                    | Operation::Absolute(_)
                    | Operation::Minimum(_)
                    | Operation::Maximum(_),
                    operands,
                ) => operands.iter().all(|&operand| self.ends(operand)),
                Node::Apply(Operation::Convert(from, to), operands)
                    if from.is_real() && to.is_real() =>
                {
                    self.ends(operands[0])
                }
                // Its operand ends, or it is not followed.
                Node::Apply(..) => true,
            };
        self.ends.insert(term, ends);
        ends
    }

    /// Whether the result is at most at a boundary; NaN is not.
    pub(super) fn result_at_most(&mut self, monotone: &Monotone, boundary: i128) -> Expression {
        let operand = monotone.operand();
        let of = self.system.terms.of(operand);
        let result = match monotone.operation {
            Operation::Convert(_, to) => to,
            _ => of,
        };
        let mut values: Vec<u64> = monotone
            .operands
            .iter()
            .map(|&operand| self.system.terms.value(operand).unwrap_or(0))
            .collect();
        let mut is_below = |place: i128| {
            values[monotone.place] = stored(of, place);
            let found = monotone.operation.apply(&values).ok();
            let found = found.and_then(|stored| position(result, stored));
            found.is_some_and(|found| found <= boundary) == monotone.grows
        };
        // The last place whose result is at the side of the lower operands.
        let (mut low, mut high) = places(of);
        let nan = self.nan(operand);
        let number = self.builder.graph().not(nan);
        let last = match (is_below(low), is_below(high)) {
            (false, _) => None,
            (true, true) => Some(high),
            (true, false) => {
                while high - low > 1 {
                    let middle = low + (high - low) / 2;
                    if is_below(middle) {
                        low = middle;
                    } else {
                        high = middle;
                    }
                }
                Some(low)
            }
        };
        let below = match last {
            None => self.constant(false),
            Some(last) if last == places(of).1 => number,
            Some(last) => match position(of, stored(of, last)) {
                Some(position) => self.at_most(operand, position),
                None => number,
            },
        };
        if monotone.grows {
            return below;
        }
        let graph = self.builder.graph();
        let above = graph.not(below);
        graph.and(above, number)
    }
}

/// The places of the least and of the greatest value of a type in their order; infinite ones are among them.
fn places(of: Elementary) -> (i128, i128) {
    match of {
        Elementary::Real => {
            let greatest = i128::from(f32::INFINITY.to_bits());
            (-greatest, greatest)
        }
        Elementary::Lreal => {
            let greatest = i128::from(f64::INFINITY.to_bits());
            (-greatest, greatest)
        }
        _ => of.limits(),
    }
}

/// The value at a place.
fn stored(of: Elementary, place: i128) -> u64 {
    let amount = place.unsigned_abs() as u64;
    match of {
        Elementary::Real if place < 0 => amount | 1 << 31,
        Elementary::Lreal if place < 0 => amount | 1 << 63,
        Elementary::Real | Elementary::Lreal => amount,
        _ => place as u64 & of.mask(),
    }
}
