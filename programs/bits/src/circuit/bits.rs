//! Terms as bits: exact, where their numbers are few enough.

use understudy_logic::Expression;
use understudy_typed::{Comparison, Elementary, Operation};

use super::{Held, Meaning, PRODUCT, Pass, Pending, WIDE};
use crate::extent::{Extent, divisor};
use crate::number::{
    Coding, Number, aligned, is_equal, is_less, mux, negated, product, quotient, sum,
};
use crate::term::{Node, Term, Variable};

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
            Node::Variable(_) | Node::Unknown(_) => self.has_bits(term),
            Node::Choose([_, then, otherwise]) => self.is_bits(*then) && self.is_bits(*otherwise),
            // A number that is not followed, but for its bits.
            Node::Apply(operation, operands) => {
                let all = operands.iter().all(|&operand| self.is_bits(operand));
                has_bits(of)
                    || !of.is_real() && all && (self.has_bits(term) || is_by_bits(*operation))
            }
        };
        self.is_bits.insert(term, is);
        is
    }

    /// Whether a number is followed bit by bit where it is stored.
    fn has_bits(&self, term: Term) -> bool {
        let of = self.system.terms.of(term);
        has_bits(of) || !of.is_real() && self.coding(term).width <= WIDE
    }

    pub(super) fn coding(&self, term: Term) -> Coding {
        match self.system.terms.of(term) {
            Elementary::Bool => Coding { unit: 1, width: 1, is_signed: false },
            _ => Coding::from(self.extents.get(term)),
        }
    }

    /// A BOOL.
    pub(super) fn truth(&mut self, term: Term) -> Expression {
        self.number(term).bits[0]
    }

    /// The bits of a term, in its coding; free where they are not followed.
    pub(super) fn number(&mut self, term: Term) -> Number {
        if let Some(known) = self.numbers.get(&term) {
            return known.clone();
        }
        let coding = self.coding(term);
        let extent = self.extents.get(term);
        let number = match extent.low == extent.high {
            true => Number::constant(self.builder.graph(), extent.low, coding),
            false => self.new_number(term, coding),
        };
        self.numbers.insert(term, number.clone());
        number
    }

    fn new_number(&mut self, term: Term, coding: Coding) -> Number {
        let of = self.system.terms.of(term);
        let node = self.system.terms.node(term).clone();
        match node {
            Node::Constant(stored) => {
                Number::constant(self.builder.graph(), of.signed(stored), coding)
            }
            Node::Variable(Variable::Input(number)) if self.has_bits(term) => {
                self.input_number(number, coding)
            }
            Node::Variable(Variable::Cell(cell)) if self.has_bits(term) => {
                self.cell_number(cell, coding)
            }
            Node::Choose([condition, then, otherwise]) => {
                let condition = self.truth(condition);
                let [then, otherwise] = [then, otherwise].map(|side| self.number(side));
                let graph = self.builder.graph();
                // A side that is never taken may have another unit.
                let [then, otherwise] =
                    [then, otherwise].map(|side| match side.has_unit(coding.unit) {
                        true => side.coded(graph, coding).bits,
                        false => vec![graph.constant(false); coding.width],
                    });
                self.of_bits(coding, |graph| mux(graph, condition, &then, &otherwise))
            }
            Node::Apply(Operation::Compare(comparison, _), operands) => {
                let is = self.compare(comparison, operands[0], operands[1]);
                Number { bits: vec![is], unit: 1, is_signed: false }
            }
            Node::Apply(operation, operands) => {
                let all = operands.iter().all(|&operand| self.is_bits(operand));
                let known = match all {
                    true => self.operation(operation, &operands, of, coding),
                    false => None,
                };
                known.unwrap_or_else(|| self.free(term, coding))
            }
            Node::Unknown(_) | Node::Variable(_) => self.free(term, coding),
        }
    }

    fn of_bits(
        &mut self,
        coding: Coding,
        make: impl FnOnce(&mut understudy_logic::Graph) -> Vec<Expression>,
    ) -> Number {
        let bits = make(self.builder.graph());
        Number { bits, unit: coding.unit, is_signed: coding.is_signed }
    }

    /// An input: the bits of its type, and past its limits the limits.
    fn input_number(&mut self, place: u32, coding: Coding) -> Number {
        let input = &self.system.inputs[place as usize];
        let (of, (low, high)) = (input.of, input.limits);
        let name = input.name.clone();
        let bits: Vec<Expression> = (0..of.bits())
            .map(|bit| {
                let name = match of {
                    Elementary::Bool => name.clone(),
                    _ => format!("{name}.{bit}"),
                };
                self.input(&name, Meaning::Bit(place, bit))
            })
            .collect();
        let mut number = Number { bits, unit: 1, is_signed: of.is_signed() };
        let full = of.limits();
        let graph = self.builder.graph();
        let coding_of_all = Coding::from(Extent::new(full.0, full.1));
        if of != Elementary::Bool && low > full.0 {
            let below = number.is_at_most(graph, low - 1);
            let least = Number::constant(graph, low, coding_of_all).bits;
            number.bits = mux(graph, below, &least, &number.bits);
        }
        if of != Elementary::Bool && high < full.1 {
            let within = number.is_at_most(graph, high);
            let most = Number::constant(graph, high, coding_of_all).bits;
            number.bits = mux(graph, within, &number.bits, &most);
        }
        number.coded(graph, coding)
    }

    fn cell_number(&mut self, place: u32, coding: Coding) -> Number {
        let cell = &self.system.cells[place as usize];
        let (of, initial, name) = (cell.of, cell.of.signed(cell.initial), cell.name.clone());
        let initial = initial.div_euclid(coding.unit.max(1));
        let mut registers = Vec::with_capacity(coding.width);
        let mut bits = Vec::with_capacity(coding.width);
        for bit in 0..coding.width {
            let name = match of {
                Elementary::Bool => name.clone(),
                _ => format!("{name}.{bit}"),
            };
            let (register, value) = self.register(&name, initial >> bit & 1 == 1);
            let is_sign = coding.is_signed && bit + 1 == coding.width;
            let weight = coding.unit.max(1) << bit;
            let weight = if is_sign { -weight } else { weight };
            if let Some(held) = self.held.last_mut() {
                *held = Some(Held { cell: place, weight });
            }
            registers.push(register);
            bits.push(value);
        }
        self.cells.insert(place, registers);
        self.pending.push(Pending::Bits(place));
        Number { bits, unit: coding.unit, is_signed: coding.is_signed }
    }

    fn free(&mut self, term: Term, coding: Coding) -> Number {
        let name = self.system.describe(term);
        let bits = (0..coding.width)
            .map(|bit| self.input(&format!("{name}.{bit}"), Meaning::Free(term, bit as u32)));
        Number { bits: bits.collect(), unit: coding.unit, is_signed: coding.is_signed }
    }

    /// How two numbers that have bits stand to each other.
    pub(super) fn compare_bits(
        &mut self,
        comparison: Comparison,
        left: Term,
        right: Term,
    ) -> Expression {
        let constant = |this: &Self, term: Term| {
            let of = this.system.terms.of(term);
            this.system.terms.value(term).map(|stored| of.signed(stored))
        };
        if let Some(number) = constant(self, left)
            && constant(self, right).is_none()
        {
            let right = self.number(right);
            return self.compare_constant(comparison.mirrored(), &right, number);
        }
        let one = self.number(left);
        if let Some(number) = constant(self, right) {
            return self.compare_constant(comparison, &one, number);
        }
        let other = self.number(right);
        let graph = self.builder.graph();
        let (one, other, is_signed) = aligned(graph, &one, &other);
        match comparison {
            Comparison::Equal => is_equal(graph, &one, &other),
            Comparison::NotEqual => {
                let equal = is_equal(graph, &one, &other);
                graph.not(equal)
            }
            Comparison::Less => is_less(graph, &one, &other, is_signed),
            Comparison::Greater => is_less(graph, &other, &one, is_signed),
            Comparison::LessOrEqual => {
                let greater = is_less(graph, &other, &one, is_signed);
                graph.not(greater)
            }
            Comparison::GreaterOrEqual => {
                let less = is_less(graph, &one, &other, is_signed);
                graph.not(less)
            }
        }
    }

    fn compare_constant(
        &mut self,
        comparison: Comparison,
        number: &Number,
        constant: i128,
    ) -> Expression {
        let graph = self.builder.graph();
        let (is, negated) = match comparison {
            Comparison::Equal => (number.is_constant(graph, constant), false),
            Comparison::NotEqual => (number.is_constant(graph, constant), true),
            Comparison::Less => (number.is_at_most(graph, constant - 1), false),
            Comparison::GreaterOrEqual => (number.is_at_most(graph, constant - 1), true),
            Comparison::LessOrEqual => (number.is_at_most(graph, constant), false),
            Comparison::Greater => (number.is_at_most(graph, constant), true),
        };
        if negated { graph.not(is) } else { is }
    }

    /// An operation whose operands have bits, where it is followed. What the type of the result does not hold wraps, so its bits are those of
    /// the type then.
    fn operation(
        &mut self,
        operation: Operation,
        operands: &[Term],
        of: Elementary,
        coding: Coding,
    ) -> Option<Number> {
        use Operation as O;
        let numbers: Vec<Number> = operands.iter().map(|&term| self.number(term)).collect();
        let constant = |this: &Self, place: usize| this.system.terms.value(operands[place]);
        let extents: Vec<Extent> = operands.iter().map(|&term| self.extents.get(term)).collect();
        let full = of.bits() as usize;
        let graph = self.builder.graph();
        // Arithmetic modulo a power of two: in the coding of the result, which is that of the whole type where the number wraps.
        let modular = |graph: &mut understudy_logic::Graph, number: &Number| {
            number.scaled(graph, coding.unit, coding.width)
        };
        let bits = match operation {
            O::Add(_) | O::Subtract(_) => {
                let (one, other) = (modular(graph, &numbers[0]), modular(graph, &numbers[1]));
                sum(graph, &one, &other, matches!(operation, O::Subtract(_)))
            }
            O::Negate(_) => {
                let one = modular(graph, &numbers[0]);
                negated(graph, &one)
            }
            O::Absolute(_) => {
                if !numbers[0].is_signed {
                    return Some(numbers[0].coded(graph, coding));
                }
                let sign = numbers[0].bits[numbers[0].bits.len() - 1];
                let one = modular(graph, &numbers[0]);
                let opposite = negated(graph, &one);
                mux(graph, sign, &opposite, &one)
            }
            O::Multiply(_) => {
                let (one, other) = (&numbers[0], &numbers[1]);
                let unit = one.unit.checked_mul(other.unit)?;
                let widest = one.bits.len().min(other.bits.len());
                let is_small = constant(self, 0).or(constant(self, 1)).is_some();
                if !is_small && widest > PRODUCT {
                    return None;
                }
                let graph = self.builder.graph();
                let (few, many) = match one.bits.len() < other.bits.len() {
                    true => (one, other),
                    false => (other, one),
                };
                let in_units = |number: &Number| Number { unit: 1, ..number.clone() };
                let few = in_units(few).scaled(graph, 1, coding.width);
                let many = in_units(many).scaled(graph, 1, coding.width);
                let bits = product(graph, &many, &few);
                let multiple = Number { bits, unit, is_signed: coding.is_signed };
                return Some(multiple.coded(graph, coding));
            }
            O::Minimum(_) | O::Maximum(_) => {
                let mut best = numbers[0].clone();
                for next in &numbers[1..] {
                    let (one, other, is_signed) = aligned(graph, next, &best);
                    let taken = match operation {
                        O::Minimum(_) => is_less(graph, &one, &other, is_signed),
                        _ => is_less(graph, &other, &one, is_signed),
                    };
                    let unit = divisor(next.unit, best.unit);
                    let bits = mux(graph, taken, &one, &other);
                    best = Number { bits, unit, is_signed };
                }
                return Some(best.coded(graph, coding));
            }
            O::Divide(_) | O::Modulo(_) => {
                let by = extents[1];
                let exact = by.low == by.high && by.low > 0;
                if matches!(operation, O::Divide(_)) && exact && numbers[0].unit % by.low == 0 {
                    let unit = numbers[0].unit / by.low;
                    return Some(Number { unit, ..numbers[0].clone() }.coded(graph, coding));
                }
                let (one, other, is_signed) = aligned(graph, &numbers[0], &numbers[1]);
                if constant(self, 1).is_none() && one.len() > PRODUCT + 1 {
                    return None;
                }
                let unit = divisor(numbers[0].unit, numbers[1].unit);
                let graph = self.builder.graph();
                // One bit more: the least number divided by −1.
                let one = Number { bits: one, unit: 1, is_signed };
                let other = Number { bits: other, unit: 1, is_signed };
                let wide = one.bits.len().max(1) + 1;
                let (one, other) = (one.scaled(graph, 1, wide), other.scaled(graph, 1, wide));
                let (whole, rest) = quotient(graph, &one, &other, is_signed);
                let result = match operation {
                    O::Divide(_) => Number { bits: whole, unit: 1, is_signed },
                    // A remainder by 0 is 0.
                    _ => {
                        let divides = graph.any(other.iter().copied());
                        let bits = rest.into_iter().map(|bit| graph.and(bit, divides)).collect();
                        Number { bits, unit, is_signed }
                    }
                };
                return Some(result.coded(graph, coding));
            }
            O::Convert(_, Elementary::Bool) => vec![graph.any(numbers[0].bits.iter().copied())],
            O::Convert(from, to) if !from.is_real() && !to.is_real() => {
                return Some(numbers[0].coded(graph, coding));
            }
            O::Reinterpret(from, _) if !from.is_real() => {
                return Some(numbers[0].coded(graph, coding));
            }
            _ => {
                let raw: Vec<Vec<Expression>> = operands
                    .iter()
                    .zip(&numbers)
                    .map(|(&term, number)| {
                        let width = self.system.terms.of(term).bits() as usize;
                        number.scaled(self.builder.graph(), 1, width)
                    })
                    .collect();
                let bits = self.by_bits(operation, operands, &raw, full)?;
                let whole = Number { bits, unit: 1, is_signed: of.is_signed() };
                return Some(whole.coded(self.builder.graph(), coding));
            }
        };
        Some(Number { bits, unit: coding.unit, is_signed: coding.is_signed })
    }

    /// An operation on the bits of types.
    fn by_bits(
        &mut self,
        operation: Operation,
        operands: &[Term],
        raw: &[Vec<Expression>],
        width: usize,
    ) -> Option<Vec<Expression>> {
        use Operation as O;
        let constant = |place: usize| self.system.terms.value(operands[place]);
        let graph = self.builder.graph();
        let no = graph.constant(false);
        Some(match operation {
            O::Not(_) => raw[0].iter().map(|&bit| graph.not(bit)).collect(),
            O::And(_) | O::Or(_) | O::Xor(_) => {
                let pairs = raw[0].iter().zip(&raw[1]);
                pairs
                    .map(|(&one, &other)| match operation {
                        O::And(_) => graph.and(one, other),
                        O::Or(_) => graph.or(one, other),
                        _ => graph.xor(one, other),
                    })
                    .collect()
            }
            O::Extract { at, .. } => {
                let bits = raw[0].iter().copied().chain(std::iter::repeat(no));
                bits.skip(usize::from(at & 63)).take(width).collect()
            }
            O::Insert { part, at, .. } => {
                let mut bits = raw[0].clone();
                let at = usize::from(at & 63);
                for (place, &bit) in raw[1].iter().enumerate().take(part.bits() as usize) {
                    if let Some(into) = bits.get_mut(at + place) {
                        *into = bit;
                    }
                }
                bits
            }
            O::ShiftLeft(_) | O::ShiftRight(_) => {
                let by = usize::try_from(constant(1)?).unwrap_or(usize::MAX);
                (0..width)
                    .map(|at| {
                        let from = match operation {
                            O::ShiftLeft(_) => at.checked_sub(by),
                            _ => at.checked_add(by),
                        };
                        from.and_then(|from| raw[0].get(from).copied()).unwrap_or(no)
                    })
                    .collect()
            }
            O::RotateLeft(_) | O::RotateRight(_) => {
                let by = constant(1)? as i64;
                let by = match operation {
                    O::RotateLeft(_) => by,
                    _ => by.wrapping_neg(),
                };
                let by = by.rem_euclid(width as i64) as usize;
                (0..width).map(|at| raw[0][(at + width - by) % width]).collect()
            }
            _ => return None,
        })
    }
}

/// Whether every number of the type is followed bit by bit where it is stored.
fn has_bits(of: Elementary) -> bool {
    !of.is_real() && (of.bits() <= 32 || of.is_bit_string())
}

/// Operations that are followed for numbers of any width.
fn is_by_bits(operation: Operation) -> bool {
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
