//! Terms by their order: comparisons with boundaries, and with each other.

use std::collections::BTreeMap;

use understudy_logic::Expression;
use understudy_typed::{Comparison, Elementary, Operation};

use super::boundaries::{boundary, boundary_text, position};
use super::{Meaning, Pass, Pending};
use crate::term::{Node, Term, Variable};

impl Pass<'_> {
    pub(super) fn compare(
        &mut self,
        comparison: Comparison,
        left: Term,
        right: Term,
    ) -> Expression {
        let of = self.system.terms.of(left);
        if self.is_bits(left) && self.is_bits(right) {
            return self.compare_bits(comparison, left, right);
        }
        // less, equal; neither where one of them is NaN.
        let (less, equal, nan) =
            match (self.system.terms.value(left), self.system.terms.value(right)) {
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
    pub(super) fn against(
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
    pub(super) fn order(
        &mut self,
        left: Term,
        right: Term,
    ) -> (Expression, Expression, Expression) {
        let one = self.nan(left);
        let other = self.nan(right);
        let nan = self.builder.graph().or(one, other);
        let (less, equal) = match () {
            () if left == right => (self.constant(false), self.constant(true)),
            () => match self.orders.get(&(left, right)) {
                Some(&known) => known,
                None => {
                    let name =
                        format!("{} < {}", self.system.describe(left), self.system.describe(right));
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
    pub(super) fn at_most(&mut self, term: Term, boundary: i128) -> Expression {
        if let Some(&known) = self.at_most.get(&(term, boundary)) {
            return known;
        }
        let made = self.new_at_most(term, boundary);
        self.at_most.insert((term, boundary), made);
        made
    }

    pub(super) fn new_at_most(&mut self, term: Term, boundary: i128) -> Expression {
        let of = self.system.terms.of(term);
        if let Some(stored) = self.system.terms.value(term) {
            let is = position(of, stored).is_some_and(|position| position <= boundary);
            return self.constant(is);
        }
        if self.is_bits(term) {
            return self.number(term).is_at_most(self.builder.graph(), boundary);
        }
        if let Some(monotone) = self.monotone(term) {
            return self.result_at_most(&monotone, boundary);
        }
        match self.system.terms.node(term).clone() {
            Node::Choose([condition, then, otherwise]) => {
                let condition = self.truth(condition);
                let then = self.at_most(then, boundary);
                let otherwise = self.at_most(otherwise, boundary);
                self.builder.graph().if_then_else(condition, then, otherwise)
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
            Node::Apply(Operation::Absolute(of), operands) if of.is_real() => {
                let up_to = self.at_most(operands[0], boundary);
                let below = self.at_most(operands[0], 1 - boundary);
                let graph = self.builder.graph();
                let from = graph.not(below);
                graph.and(up_to, from)
            }
            Node::Apply(
                operation @ (Operation::Minimum(of) | Operation::Maximum(of)),
                operands,
            ) if of.is_real() => self.extreme_at_most(operation, &operands, boundary),
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

    /// Whether the least or the greatest of some reals is at most at a boundary. The first is kept where it is NaN; a later NaN is passed over.
    fn extreme_at_most(
        &mut self,
        operation: Operation,
        operands: &[Term],
        boundary: i128,
    ) -> Expression {
        let mut is = self.at_most(operands[0], boundary);
        for &next in &operands[1..] {
            let next_is = self.at_most(next, boundary);
            let next_nan = self.nan(next);
            let graph = self.builder.graph();
            is = match operation {
                Operation::Minimum(_) => graph.or(is, next_is),
                _ => {
                    let passed = graph.or(next_is, next_nan);
                    graph.and(is, passed)
                }
            };
        }
        let nan = self.nan(operands[0]);
        let graph = self.builder.graph();
        let number = graph.not(nan);
        graph.and(is, number)
    }

    /// The positions between which a number lies.
    pub(super) fn limits(&self, term: Term, of: Elementary) -> (i128, i128) {
        if let Node::Variable(Variable::Input(number)) = self.system.terms.node(term) {
            return self.system.inputs[*number as usize].limits;
        }
        if of.is_real() {
            // Infinity is a number here, and it can be computed.
            return (i128::MIN, i128::MAX);
        }
        of.limits()
    }

    pub(super) fn cell_at_most(&mut self, cell: u32, of: Elementary, boundary: i128) -> Expression {
        if let Some(&(_, known)) = self.cell_lines.get(&(cell, boundary)) {
            return known;
        }
        let initial = position(of, self.system.cells[cell as usize].initial);
        let initial = initial.is_some_and(|position| position <= boundary);
        let name = &self.system.cells[cell as usize].name;
        let name = format!("{name} {}", boundary_text(of, boundary));
        let made = self.register(&name, initial);
        self.cell_lines.insert((cell, boundary), made);
        self.pending.push(Pending::Boundary(cell, boundary));
        made.1
    }

    /// Free inputs of a number, with their order kept.
    pub(super) fn line(&mut self, term: Term, boundary: i128) -> Expression {
        if !self.lines.contains_key(&term) {
            let known: Vec<i128> = self.known.get(&term).into_iter().flatten().copied().collect();
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

    pub(super) fn nan(&mut self, term: Term) -> Expression {
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
                let name = format!("{} is NaN", self.system.cells[cell as usize].name);
                let made = self.register(&name, initial);
                self.cell_nans.insert(cell, made);
                self.pending.push(Pending::NotANumber(cell));
                made.1
            }
            Node::Choose([condition, then, otherwise]) => {
                let condition = self.truth(condition);
                let then = self.nan(then);
                let otherwise = self.nan(otherwise);
                self.builder.graph().if_then_else(condition, then, otherwise)
            }
            Node::Apply(Operation::Convert(from, _), operands) => match from.is_real() {
                true => self.nan(operands[0]),
                false => self.constant(false),
            },
            // The least and the greatest keep their first operand where it is NaN.
            Node::Apply(
                Operation::Negate(_)
                | Operation::Absolute(_)
                | Operation::Minimum(_)
                | Operation::Maximum(_),
                operands,
            ) => self.nan(operands[0]),
            Node::Apply(..) | Node::Unknown(_) => {
                // A finite constant makes no NaN of a number.
                if let Some(monotone) = self.monotone(term) {
                    return self.nan(monotone.operand());
                }
                let name = format!("{} is NaN", self.system.describe(term));
                self.input(&name, Meaning::NotANumber(term))
            }
        };
        self.nans.insert(term, nan);
        nan
    }
}
