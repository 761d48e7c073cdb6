//! A system of terms as a circuit, whose runs contain those of the system.
//!
//! ```text
//! BOOL, bit strings, integers of up to 32 bits    their bits; sums and comparisons bit by bit
//! reals, times, integers of 64 bits               regions between the constants that they are compared with
//! ```
//!
//! A stored number of regions has one register for each boundary; the registers step together, so the regions of a value that is only
//! stored and copied are exact. A number that is computed has free inputs, with the order of its boundaries kept: `t > 90` implies
//! `t > 80`. What holds in the circuit for all runs holds in the system.

use std::collections::{BTreeMap, BTreeSet, HashMap, HashSet};

use understudy_logic::{Circuit, CircuitBuilder, Expression, RegisterId};
use understudy_typed::{Comparison, Elementary, Operation};

use super::System;
use super::execute::{Unsupported, range};
use super::term::{Node, Term, Variable};

/// Boundaries of one number.
const BOUNDARIES: usize = 1_000;
/// Widest operands of a product or a quotient of two variables.
const PRODUCT: usize = 16;

/// What an input of the circuit stands for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Meaning {
    /// A bit of an input of the system.
    Bit(u32, u32),
    /// Whether a number is at most the boundary: TRUE at its lowest true boundary, and of no meaning behind it.
    Boundary(Term, i128),
    /// Whether a computed real is NaN.
    NotANumber(Term),
    /// Whether one number is less than another.
    Less(Term, Term),
    /// Whether two numbers are equal; of no meaning where one is less.
    Equal(Term, Term),
    /// A bit of a number that is not followed.
    Free(Term, u32),
}

/// The circuit of a system.
pub(super) struct Abstraction {
    pub(super) circuit: Circuit,
    /// One for each input of the circuit.
    pub(super) meanings: Vec<Meaning>,
    /// Boundaries of each number that has free inputs, in order.
    pub(super) boundaries: HashMap<Term, BTreeSet<i128>>,
}

/// A number as a position on a line: one is at most a boundary where its position is. Reals: below or at a constant are
/// two boundaries. `None` for NaN.
pub(super) fn position(of: Elementary, stored: u64) -> Option<i128> {
    match real(of, stored) {
        None => Some(of.signed(stored)),
        Some(value) if value.is_nan() => None,
        Some(value) => Some(2 * i128::from(rank(value)) + 1),
    }
}

/// The boundary of `< stored`, or of `<= stored`.
fn boundary(of: Elementary, stored: u64, is_included: bool) -> Option<i128> {
    match real(of, stored) {
        None => Some(of.signed(stored) - i128::from(!is_included)),
        Some(value) if value.is_nan() => None,
        Some(value) => Some(2 * i128::from(rank(value)) + i128::from(is_included)),
    }
}

fn real(of: Elementary, stored: u64) -> Option<f64> {
    match of {
        Elementary::Real => Some(f64::from(f32::from_bits(stored as u32))),
        Elementary::Lreal => Some(f64::from_bits(stored)),
        _ => None,
    }
}

/// Reals in their order as integers; both zeros are 0.
fn rank(value: f64) -> i64 {
    let bits = value.to_bits() as i64;
    if bits < 0 {
        i64::MIN.wrapping_sub(bits)
    } else {
        bits
    }
}

/// A number of type `of` above one boundary and at most at the next.
pub(super) fn between(of: Elementary, above: Option<i128>, at_most: Option<i128>) -> Option<u64> {
    if !of.is_real() {
        let (least, greatest) = range(of);
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
        let bits = if rank < 0 {
            i64::MIN.wrapping_sub(rank)
        } else {
            rank
        };
        f64::from_bits(bits as u64)
    };
    let greatest = match of {
        Elementary::Real => f64::from(f32::MAX),
        _ => f64::MAX,
    };
    let (least, greatest) = (rank(-greatest), rank(greatest));
    // The position 2 r + 1 lies above `above` and is at most `at_most`.
    let low = above.map_or(least.into(), |above| {
        above.div_euclid(2) + above.rem_euclid(2)
    });
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
fn readable(low: f64, high: f64) -> f64 {
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

impl Abstraction {
    /// # Errors
    /// Where a number has too many boundaries.
    pub(super) fn new(system: &System) -> Result<Self, Unsupported> {
        // The first pass finds the boundaries of each number, the second one has them in order.
        let mut boundaries: HashMap<Term, BTreeSet<i128>> = HashMap::new();
        loop {
            let mut pass = Pass::new(system, boundaries);
            pass.build();
            let found = pass.found;
            if let Some((&term, _)) = found.iter().find(|(_, all)| all.len() > BOUNDARIES) {
                return Err(Unsupported {
                    routine: system.name.clone(),
                    line: 0,
                    what: format!(
                        "`{}` is compared with more than {BOUNDARIES} constants",
                        system.describe(term)
                    ),
                });
            }
            if found == pass.known {
                let circuit = pass.builder.finish().map_err(|error| Unsupported {
                    routine: system.name.clone(),
                    line: 0,
                    what: error.to_string(),
                })?;
                return Ok(Self {
                    circuit,
                    meanings: pass.meanings,
                    boundaries: found,
                });
            }
            boundaries = found;
        }
    }
}

/// A register whose next value is still to be made.
#[derive(Debug, Clone, Copy)]
enum Pending {
    Bits(u32),
    Boundary(u32, i128),
    NotANumber(u32),
}

struct Pass<'s> {
    system: &'s System,
    builder: CircuitBuilder,
    meanings: Vec<Meaning>,
    known: HashMap<Term, BTreeSet<i128>>,
    found: HashMap<Term, BTreeSet<i128>>,
    is_bits: HashMap<Term, bool>,
    bits: HashMap<Term, Vec<Expression>>,
    lines: HashMap<Term, BTreeMap<i128, Expression>>,
    at_most: HashMap<(Term, i128), Expression>,
    nans: HashMap<Term, Expression>,
    orders: HashMap<(Term, Term), (Expression, Expression)>,
    cells: HashMap<u32, (Vec<RegisterId>, Vec<Expression>)>,
    cell_lines: HashMap<(u32, i128), (RegisterId, Expression)>,
    cell_nans: HashMap<u32, (RegisterId, Expression)>,
    pending: Vec<Pending>,
    names: HashSet<String>,
}

/// Whether a number of the type is followed bit by bit where it is stored.
fn has_bits(of: Elementary) -> bool {
    !of.is_real() && (of.bits() <= 32 || of.is_bit_string())
}

impl<'s> Pass<'s> {
    fn new(system: &'s System, known: HashMap<Term, BTreeSet<i128>>) -> Self {
        let name = system.name.clone();
        Self {
            system,
            builder: CircuitBuilder::new(name),
            meanings: Vec::new(),
            found: HashMap::new(),
            known,
            is_bits: HashMap::new(),
            bits: HashMap::new(),
            lines: HashMap::new(),
            at_most: HashMap::new(),
            nans: HashMap::new(),
            orders: HashMap::new(),
            cells: HashMap::new(),
            cell_lines: HashMap::new(),
            cell_nans: HashMap::new(),
            pending: Vec::new(),
            names: HashSet::new(),
        }
    }

    fn build(&mut self) {
        // Inputs that people name come first, under their own names.
        for number in 0..self.system.inputs.len() as u32 {
            let input = &self.system.inputs[number as usize];
            if input.of == Elementary::Bool {
                let term = input.term;
                self.bits(term);
            }
        }
        // Operands first, so that no long chain of terms is walked at once.
        let roots = self.system.observed.iter().map(|(_, term)| *term).collect();
        let cells = &self.system.cells;
        let reached = self
            .system
            .terms
            .reached(roots, |cell| cells[cell as usize].next);
        for term in reached {
            if self.is_bits(term) {
                self.bits(term);
            }
        }
        for (name, term) in self.system.observed.clone() {
            let value = self.bits(term)[0];
            self.builder.output(name, value);
        }
        while let Some(pending) = self.pending.pop() {
            match pending {
                Pending::Bits(cell) => {
                    let next = self.system.cells[cell as usize].next;
                    let next = self.bits(next);
                    let registers = self.cells[&cell].0.clone();
                    for (register, next) in registers.into_iter().zip(next) {
                        self.builder.set_next(register, next);
                    }
                }
                Pending::Boundary(cell, boundary) => {
                    let next = self.system.cells[cell as usize].next;
                    let next = self.at_most(next, boundary);
                    let register = self.cell_lines[&(cell, boundary)].0;
                    self.builder.set_next(register, next);
                }
                Pending::NotANumber(cell) => {
                    let next = self.system.cells[cell as usize].next;
                    let next = self.nan(next);
                    let register = self.cell_nans[&cell].0;
                    self.builder.set_next(register, next);
                }
            }
        }
    }

    fn input(&mut self, name: &str, meaning: Meaning) -> Expression {
        let mut unique = name.to_owned();
        let mut number = 1;
        while !self.names.insert(unique.clone()) {
            number += 1;
            unique = format!("{name} #{number}");
        }
        self.meanings.push(meaning);
        self.builder.input(unique)
    }

    fn constant(&mut self, value: bool) -> Expression {
        self.builder.graph().constant(value)
    }

    /// Whether the bits of a term are followed.
    fn is_bits(&mut self, term: Term) -> bool {
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
    fn bits(&mut self, term: Term) -> Vec<Expression> {
        if let Some(known) = self.bits.get(&term) {
            return known.clone();
        }
        let of = self.system.terms.of(term);
        let bits = self.new_bits(term, of);
        self.bits.insert(term, bits.clone());
        bits
    }

    fn new_bits(&mut self, term: Term, of: Elementary) -> Vec<Expression> {
        let width = of.bits();
        let node = self.system.terms.node(term).clone();
        match node {
            Node::Constant(stored) => (0..width)
                .map(|bit| self.constant(stored >> bit & 1 == 1))
                .collect(),
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

    fn free(&mut self, term: Term, width: u32) -> Vec<Expression> {
        let name = self.system.describe(term);
        (0..width)
            .map(|bit| self.input(&format!("{name}.{bit}"), Meaning::Free(term, bit)))
            .collect()
    }

    fn mux(
        &mut self,
        condition: Expression,
        then: &[Expression],
        otherwise: &[Expression],
    ) -> Vec<Expression> {
        let pairs = then.iter().zip(otherwise);
        pairs
            .map(|(&then, &otherwise)| {
                self.builder
                    .graph()
                    .if_then_else(condition, then, otherwise)
            })
            .collect()
    }

    /// An operation whose operands have bits, where it is followed.
    fn operation(
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
            O::Not(_) => terms[0]
                .iter()
                .map(|&bit| self.builder.graph().not(bit))
                .collect(),
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
                        from.and_then(|from| terms[0].get(from).copied())
                            .unwrap_or(no)
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
                (0..width)
                    .map(|at| terms[0][(at + width - by) % width])
                    .collect()
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
    fn sum(&mut self, left: &[Expression], right: &[Expression], minus: bool) -> Vec<Expression> {
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
    fn quotient(
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

    /// Whether one number is less than the other, both of bits.
    fn less(&mut self, of: Elementary, left: &[Expression], right: &[Expression]) -> Expression {
        let last = left.len() - 1;
        let is_signed = of.is_signed();
        let graph = self.builder.graph();
        let mut less = graph.constant(false);
        for (place, (&one, &other)) in left.iter().zip(right).enumerate() {
            // The sign weighs the other way.
            let (one, other) = match is_signed && place == last {
                true => (other, one),
                false => (one, other),
            };
            let differ = graph.xor(one, other);
            less = graph.if_then_else(differ, other, less);
        }
        less
    }

    fn compare(&mut self, comparison: Comparison, left: Term, right: Term) -> Expression {
        let of = self.system.terms.of(left);
        if self.is_bits(left) && self.is_bits(right) {
            let (one, other) = (self.bits(left), self.bits(right));
            return match comparison {
                Comparison::Equal | Comparison::NotEqual => {
                    let graph = self.builder.graph();
                    let pairs = one.iter().zip(&other);
                    let differ: Vec<Expression> =
                        pairs.map(|(&one, &other)| graph.xor(one, other)).collect();
                    let differ = graph.any(differ);
                    match comparison {
                        Comparison::Equal => graph.not(differ),
                        _ => differ,
                    }
                }
                Comparison::Less => self.less(of, &one, &other),
                Comparison::Greater => self.less(of, &other, &one),
                Comparison::LessOrEqual => {
                    let greater = self.less(of, &other, &one);
                    self.builder.graph().not(greater)
                }
                Comparison::GreaterOrEqual => {
                    let less = self.less(of, &one, &other);
                    self.builder.graph().not(less)
                }
            };
        }
        // less, equal; neither where one of them is NaN.
        let (less, equal, nan) = match (
            self.system.terms.value(left),
            self.system.terms.value(right),
        ) {
            (_, Some(constant)) => self.against(left, of, constant, false),
            (Some(constant), None) => self.against(right, of, constant, true),
            (None, None) => self.order(left, right),
        };
        let graph = self.builder.graph();
        let either = graph.or(less, equal);
        match comparison {
            Comparison::Equal => equal,
            Comparison::NotEqual => graph.not(equal),
            Comparison::Less => less,
            Comparison::LessOrEqual => either,
            Comparison::Greater | Comparison::GreaterOrEqual => {
                let out = match comparison {
                    Comparison::Greater => graph.or(either, nan),
                    _ => graph.or(less, nan),
                };
                graph.not(out)
            }
        }
    }

    /// How a number stands to a constant, or the constant to the number: less, equal, not comparable.
    fn against(
        &mut self,
        term: Term,
        of: Elementary,
        constant: u64,
        swapped: bool,
    ) -> (Expression, Expression, Expression) {
        let below = boundary(of, constant, false);
        let up_to = boundary(of, constant, true);
        let (Some(below), Some(up_to)) = (below, up_to) else {
            let no = self.constant(false);
            return (no, no, self.constant(true));
        };
        let less = self.at_most(term, below);
        let up_to = self.at_most(term, up_to);
        let nan = self.nan(term);
        let graph = self.builder.graph();
        let not_less = graph.not(less);
        let equal = graph.and(up_to, not_less);
        if !swapped {
            return (less, equal, nan);
        }
        let out = graph.or(up_to, nan);
        (graph.not(out), equal, nan)
    }

    /// How two numbers stand to each other.
    fn order(&mut self, left: Term, right: Term) -> (Expression, Expression, Expression) {
        let one = self.nan(left);
        let other = self.nan(right);
        let nan = self.builder.graph().or(one, other);
        let (less, equal) = match () {
            () if left == right => (self.constant(false), self.constant(true)),
            () => match self.orders.get(&(left, right)) {
                Some(&known) => known,
                None => {
                    let name = format!(
                        "{} < {}",
                        self.system.describe(left),
                        self.system.describe(right)
                    );
                    let less = self.input(&name, Meaning::Less(left, right));
                    let equal = self.input(&format!("{name}, or ="), Meaning::Equal(left, right));
                    let graph = self.builder.graph();
                    let not_less = graph.not(less);
                    let equal = graph.and(equal, not_less);
                    self.orders.insert((left, right), (less, equal));
                    let either = graph.or(less, equal);
                    let greater = graph.not(either);
                    self.orders.insert((right, left), (greater, equal));
                    (less, equal)
                }
            },
        };
        let graph = self.builder.graph();
        let number = graph.not(nan);
        (graph.and(less, number), graph.and(equal, number), nan)
    }

    /// Whether a number is at most at a boundary; NaN is not.
    fn at_most(&mut self, term: Term, boundary: i128) -> Expression {
        if let Some(&known) = self.at_most.get(&(term, boundary)) {
            return known;
        }
        let made = self.new_at_most(term, boundary);
        self.at_most.insert((term, boundary), made);
        made
    }

    fn new_at_most(&mut self, term: Term, boundary: i128) -> Expression {
        let of = self.system.terms.of(term);
        if let Some(stored) = self.system.terms.value(term) {
            let is = position(of, stored).is_some_and(|position| position <= boundary);
            return self.constant(is);
        }
        if self.is_bits(term) {
            let (least, greatest) = range(of);
            if boundary < least || boundary >= greatest {
                return self.constant(boundary >= greatest);
            }
            let bits = self.bits(term);
            let limit: Vec<Expression> = (0..of.bits())
                .map(|bit| self.constant(boundary as u64 >> bit & 1 == 1))
                .collect();
            let greater = self.less(of, &limit, &bits);
            return self.builder.graph().not(greater);
        }
        match self.system.terms.node(term).clone() {
            Node::Choose([condition, then, otherwise]) => {
                let condition = self.bits(condition)[0];
                let then = self.at_most(then, boundary);
                let otherwise = self.at_most(otherwise, boundary);
                self.builder
                    .graph()
                    .if_then_else(condition, then, otherwise)
            }
            Node::Variable(Variable::Cell(cell)) => self.cell_at_most(cell, of, boundary),
            // The position of -x is 2 - that of x.
            Node::Apply(Operation::Negate(of), operands) if of.is_real() => {
                let is = self.at_most(operands[0], 1 - boundary);
                let nan = self.nan(operands[0]);
                let graph = self.builder.graph();
                let out = graph.or(is, nan);
                graph.not(out)
            }
            _ => {
                let (least, greatest) = self.limits(term, of);
                if boundary < least || boundary >= greatest {
                    let is = boundary >= greatest;
                    let is = self.constant(is);
                    let nan = self.nan(term);
                    let number = self.builder.graph().not(nan);
                    return self.builder.graph().and(is, number);
                }
                self.found.entry(term).or_default().insert(boundary);
                let is = self.line(term, boundary);
                let nan = self.nan(term);
                let number = self.builder.graph().not(nan);
                self.builder.graph().and(is, number)
            }
        }
    }

    /// The positions between which a number lies.
    fn limits(&self, term: Term, of: Elementary) -> (i128, i128) {
        if let Node::Variable(Variable::Input(number)) = self.system.terms.node(term) {
            return self.system.inputs[*number as usize].limits;
        }
        if of.is_real() {
            // Infinity is a number here, and it can be computed.
            return (i128::MIN, i128::MAX);
        }
        range(of)
    }

    fn cell_at_most(&mut self, cell: u32, of: Elementary, boundary: i128) -> Expression {
        if let Some(&(_, known)) = self.cell_lines.get(&(cell, boundary)) {
            return known;
        }
        let initial = position(of, self.system.cells[cell as usize].initial);
        let initial = initial.is_some_and(|position| position <= boundary);
        let name = format!("cell {cell} up to {boundary}");
        let made = self.builder.register(name, initial);
        self.cell_lines.insert((cell, boundary), made);
        self.pending.push(Pending::Boundary(cell, boundary));
        made.1
    }

    /// Free inputs of a number, with their order kept.
    fn line(&mut self, term: Term, boundary: i128) -> Expression {
        if !self.lines.contains_key(&term) {
            let known: Vec<i128> = self
                .known
                .get(&term)
                .into_iter()
                .flatten()
                .copied()
                .collect();
            let name = self.system.describe(term);
            let of = self.system.terms.of(term);
            let mut line = BTreeMap::new();
            let mut so_far = self.constant(false);
            for boundary in known {
                let name = format!("{name} {}", boundary_text(of, boundary));
                let here = self.input(&name, Meaning::Boundary(term, boundary));
                so_far = self.builder.graph().or(so_far, here);
                line.insert(boundary, so_far);
            }
            self.lines.insert(term, line);
        }
        // In a pass that does not know the boundary yet the answer is not used.
        match self.lines.get(&term).and_then(|line| line.get(&boundary)) {
            Some(&known) => known,
            None => self.constant(false),
        }
    }

    fn nan(&mut self, term: Term) -> Expression {
        let of = self.system.terms.of(term);
        if !of.is_real() {
            return self.constant(false);
        }
        if let Some(&known) = self.nans.get(&term) {
            return known;
        }
        let nan = match self.system.terms.node(term).clone() {
            Node::Constant(stored) => {
                let is = position(of, stored).is_none();
                self.constant(is)
            }
            // A value of the field is a number.
            Node::Variable(Variable::Input(_)) => self.constant(false),
            Node::Variable(Variable::Cell(cell)) => {
                let initial = position(of, self.system.cells[cell as usize].initial).is_none();
                let made = self
                    .builder
                    .register(format!("cell {cell} is NaN"), initial);
                self.cell_nans.insert(cell, made);
                self.pending.push(Pending::NotANumber(cell));
                made.1
            }
            Node::Choose([condition, then, otherwise]) => {
                let condition = self.bits(condition)[0];
                let then = self.nan(then);
                let otherwise = self.nan(otherwise);
                self.builder
                    .graph()
                    .if_then_else(condition, then, otherwise)
            }
            Node::Apply(Operation::Convert(from, _), _) if !from.is_real() => self.constant(false),
            Node::Apply(Operation::Negate(_) | Operation::Absolute(_), operands) => {
                self.nan(operands[0])
            }
            Node::Apply(..) | Node::Unknown(_) => {
                let name = format!("{} is NaN", self.system.describe(term));
                self.input(&name, Meaning::NotANumber(term))
            }
        };
        self.nans.insert(term, nan);
        nan
    }
}

/// A boundary as people write it.
pub(super) fn boundary_text(of: Elementary, boundary: i128) -> String {
    if !of.is_real() {
        return format!("<= {}", of.text(boundary as u64 & of.mask()));
    }
    let is_included = boundary.rem_euclid(2) == 1;
    let rank = i64::try_from(boundary.div_euclid(2)).unwrap_or(0);
    let bits = if rank < 0 {
        i64::MIN.wrapping_sub(rank)
    } else {
        rank
    };
    let value = f64::from_bits(bits as u64);
    let stored = match of {
        Elementary::Real => u64::from((value as f32).to_bits()),
        _ => value.to_bits(),
    };
    let sign = if is_included { "<=" } else { "<" };
    format!("{sign} {}", of.text(stored))
}

/// Operations that [`Pass::operation`] follows for numbers of any width.
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
