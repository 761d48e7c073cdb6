//! Steps to rungs.
//!
//! Invariant: after each step on the outermost list, every bit of a cell is in its signal (or is known to be constant), so
//! a step is expressions over signals as they are before it, and becomes rungs that write what it assigns. A choice is
//! executed in both ways on paper and joined bit by bit; so the scan of the rungs is the execution of the text.

mod rungs;

use std::collections::{BTreeSet, HashMap, HashSet};
use std::ops::Range;

use understudy_ladder::{Name, Program, Relation};
use understudy_logic::{Expression, Graph, Operation, Variable};
use understudy_text::Diagnostic;

use self::rungs::Rungs;
use super::bounds::Interval;
use super::number::{Bits, choose};
use super::program::{Action, Cell, Kind, Number, Resolved, Role, Step, Truth, walk};

/// The widest number that is calculated with, in bits.
const MAXIMUM_WIDTH: usize = 63;
/// Operations of all steps together.
const MAXIMUM_OPERATIONS: usize = 1_000_000;

/// What a contact of a rung reads.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub(super) enum Leaf {
    /// A signal, or a pin of a block.
    Signal(String),
    /// A comparison of a counter.
    Counter(String, Relation, u16),
}

/// The program as a ladder; `intervals` are those of the cells.
pub(super) fn lower(
    name: &Name,
    resolved: &Resolved,
    intervals: &[Interval],
) -> (Program, Option<Diagnostic>) {
    let mut lowering = Lowering {
        cells: &resolved.cells,
        intervals,
        written: resolved.written(),
        blocks: resolved.blocks(),
        graph: Graph::new(),
        leaves: Vec::new(),
        places: HashMap::new(),
        known: HashMap::new(),
        overlays: vec![HashMap::new()],
        rungs: Rungs::new(resolved, intervals),
        place: 0..0,
        operations: 0,
        trouble: None,
    };
    for step in &resolved.steps {
        lowering.outermost(step);
        if lowering.rungs.is_full() {
            lowering.trouble = Some("the text makes more rungs than a ladder can have".into());
        }
        if lowering.trouble.is_some() {
            break;
        }
    }
    let trouble = lowering.trouble.take();
    let error = trouble.map(|message| Diagnostic::error("U1048", message, lowering.place.clone()));
    (lowering.rungs.finish(name), error)
}

/// The signals of a cell, the low bit first.
pub(super) fn signals(cell: &Cell, interval: Interval) -> Vec<String> {
    match cell.kind {
        Kind::Truth => vec![cell.name.clone()],
        Kind::Number { .. } => {
            let (width, _) = interval.width();
            (0..width).map(|place| format!("{}.{place}", cell.name)).collect()
        }
    }
}

/// What a cell holds at a place of the text.
#[derive(Debug, Clone)]
enum Value {
    Truth(Expression),
    Number(Bits),
}

impl Value {
    fn bits(&self) -> &[Expression] {
        match self {
            Self::Truth(truth) => std::slice::from_ref(truth),
            Self::Number(number) => &number.bits,
        }
    }
}

struct Lowering<'a> {
    cells: &'a [Cell],
    intervals: &'a [Interval],
    /// Whether a step writes the cell; what nothing writes keeps its initial value.
    written: Vec<bool>,
    /// Those that are called.
    blocks: HashSet<&'a str>,
    /// Of the present step.
    graph: Graph,
    /// What its variables stand for.
    leaves: Vec<Leaf>,
    places: HashMap<Leaf, u32>,
    /// Cells that have been given a constant in this execution.
    known: HashMap<usize, i64>,
    /// What has been assigned since the step began, in the choices around.
    overlays: Vec<HashMap<usize, Value>>,
    rungs: Rungs<'a>,
    /// Of the present step in the text.
    place: Range<usize>,
    /// Made by the steps before.
    operations: usize,
    /// Why lowering was given up.
    trouble: Option<String>,
}

impl Lowering<'_> {
    fn outermost(&mut self, step: &Step) {
        if let Action::If(branches, otherwise) = &step.action
            && let Some(taken) = self.decided(branches, otherwise)
        {
            for step in taken {
                self.outermost(step);
            }
            return;
        }
        if let Action::Block { name, kind, wire, feeds } = &step.action {
            self.place = step.span.clone();
            let wire = self.truth(wire);
            let fed: Vec<(&'static str, Expression)> =
                feeds.iter().map(|(pin, truth)| (*pin, self.truth(truth))).collect();
            self.rungs.comment(&step.comments);
            self.rungs.block(&self.graph, &self.leaves, name, *kind, wire, &fed);
        } else {
            self.step(step);
            walk(std::slice::from_ref(step), &mut |step| {
                self.rungs.comment(&step.comments);
            });
            self.flush();
        }
        self.operations += self.graph.operations().len();
        self.graph = Graph::new();
        self.leaves.clear();
        self.places.clear();
    }

    /// The branch that is always taken, where constants decide.
    fn decided<'s>(
        &mut self,
        branches: &'s [(Truth, Vec<Step>)],
        otherwise: &'s [Step],
    ) -> Option<&'s [Step]> {
        for (condition, branch) in branches {
            let condition = self.truth(condition);
            match self.graph.operation(condition) {
                Operation::Constant(true) => return Some(branch),
                Operation::Constant(false) => {}
                _ => return None,
            }
        }
        Some(otherwise)
    }

    /// Writes what the step has assigned.
    fn flush(&mut self) {
        let written = std::mem::take(&mut self.overlays[0]);
        let cells: BTreeSet<usize> = written.keys().copied().collect();
        let mut targets = Vec::new();
        for cell in cells {
            let value = &written[&cell];
            let bits = value.bits();
            let names = signals(&self.cells[cell], self.intervals[cell]);
            targets.extend(names.into_iter().zip(bits.iter().copied()));
            let constant = match value {
                Value::Truth(truth) => match self.graph.operation(*truth) {
                    Operation::Constant(value) => Some(i64::from(value)),
                    _ => None,
                },
                Value::Number(number) => number.known(&self.graph),
            };
            match constant {
                Some(constant) => self.known.insert(cell, constant),
                None => self.known.remove(&cell),
            };
        }
        self.rungs.assign(&mut self.graph, &self.leaves, targets);
    }

    /// Whether lowering is given up, which is where the networks have become too large.
    fn is_lost(&mut self) -> bool {
        if self.operations + self.graph.operations().len() > MAXIMUM_OPERATIONS {
            let message = "the networks of the text become too large";
            self.trouble.get_or_insert_with(|| message.into());
        }
        self.trouble.is_some()
    }

    fn step(&mut self, step: &Step) {
        if self.is_lost() {
            return;
        }
        self.place = step.span.clone();
        match &step.action {
            Action::SetTruth(cell, truth) => {
                let value = self.truth(truth);
                self.set(*cell, Value::Truth(value));
            }
            Action::SetNumber(cell, number) => {
                let Some(number) = self.number(number) else {
                    return;
                };
                let stored = number.stored(&mut self.graph, self.intervals[*cell]);
                self.set(*cell, Value::Number(stored));
            }
            Action::If(branches, otherwise) => self.choice(branches, otherwise),
            // Blocks stand where every execution passes, as resolving and the placing of timers have seen to.
            Action::Block { .. } | Action::Timer { .. } => {}
        }
    }

    fn set(&mut self, cell: usize, value: Value) {
        if let Some(overlay) = self.overlays.last_mut() {
            overlay.insert(cell, value);
        }
    }

    fn choice(&mut self, branches: &[(Truth, Vec<Step>)], otherwise: &[Step]) {
        let conditions: Vec<Expression> =
            branches.iter().map(|(condition, _)| self.truth(condition)).collect();
        let mut results = Vec::new();
        for steps in branches.iter().map(|(_, branch)| branch.as_slice()).chain([otherwise]) {
            self.overlays.push(HashMap::new());
            for step in steps {
                self.step(step);
            }
            results.push(self.overlays.pop().unwrap_or_default());
        }
        let written: BTreeSet<usize> =
            results.iter().flat_map(|result| result.keys().copied()).collect();
        for cell in written {
            let base = if self.cells[cell].role == Role::Passing {
                Value::Truth(self.graph.constant(false))
            } else {
                self.present(cell)
            };
            let of = |result: &HashMap<usize, Value>| {
                result.get(&cell).cloned().unwrap_or_else(|| base.clone())
            };
            let mut joined = results.last().map_or_else(|| base.clone(), of);
            for (condition, result) in conditions.iter().zip(&results).rev() {
                joined = self.joined(*condition, of(result), joined);
            }
            self.set(cell, joined);
        }
    }

    fn joined(&mut self, condition: Expression, then: Value, otherwise: Value) -> Value {
        match (then, otherwise) {
            (Value::Truth(then), Value::Truth(otherwise)) => {
                Value::Truth(choose(&mut self.graph, condition, then, otherwise))
            }
            (Value::Number(then), Value::Number(otherwise)) => {
                // Both are stored in the same place, so they are as wide.
                Value::Number(otherwise.chosen(&mut self.graph, condition, &then))
            }
            (then, _) => then,
        }
    }

    fn variable(&mut self, leaf: Leaf) -> Expression {
        let next = u32::try_from(self.leaves.len()).unwrap_or(u32::MAX);
        let place = *self.places.entry(leaf.clone()).or_insert(next);
        if place == next {
            self.leaves.push(leaf);
        }
        self.graph.variable(Variable::Input(place))
    }

    /// What the cell holds here.
    fn present(&mut self, cell: usize) -> Value {
        if let Some(value) = self.overlays.iter().rev().find_map(|overlay| overlay.get(&cell)) {
            return value.clone();
        }
        let content = &self.cells[cell];
        let fixed = !self.written[cell] && content.role != Role::Input;
        let known = self.known.get(&cell).copied().or(fixed.then_some(content.initial));
        let interval = self.intervals[cell];
        match (content.kind, known) {
            (Kind::Truth, Some(value)) => Value::Truth(self.graph.constant(value == 1)),
            (Kind::Truth, None) => {
                let name = content.name.clone();
                Value::Truth(self.variable(Leaf::Signal(name)))
            }
            (Kind::Number { .. }, Some(value)) => Value::Number(
                Bits::constant(&mut self.graph, value).stored(&mut self.graph, interval),
            ),
            (Kind::Number { .. }, None) => {
                let names = signals(content, interval);
                let bits = names.into_iter().map(|name| self.variable(Leaf::Signal(name)));
                Value::Number(Bits { bits: bits.collect(), interval })
            }
        }
    }

    fn truth(&mut self, truth: &Truth) -> Expression {
        match truth {
            Truth::Constant(value) => self.graph.constant(*value),
            Truth::Cell(cell) => match self.present(*cell) {
                Value::Truth(truth) => truth,
                Value::Number(_) => self.graph.constant(false),
            },
            Truth::Not(inner) => {
                let inner = self.truth(inner);
                self.graph.not(inner)
            }
            Truth::All(parts) => {
                let one = self.graph.constant(true);
                parts.iter().fold(one, |all, part| {
                    let part = self.truth(part);
                    self.graph.and(all, part)
                })
            }
            Truth::Any(parts) => {
                let zero = self.graph.constant(false);
                parts.iter().fold(zero, |any, part| {
                    let part = self.truth(part);
                    self.graph.or(any, part)
                })
            }
            Truth::Odd(parts) => {
                let zero = self.graph.constant(false);
                parts.iter().fold(zero, |odd, part| {
                    let part = self.truth(part);
                    self.graph.xor(odd, part)
                })
            }
            Truth::Compare(relation, left, right) => {
                match (self.number(left), self.number(right)) {
                    (Some(left), Some(right)) => left.compare(&mut self.graph, *relation, &right),
                    _ => self.graph.constant(false),
                }
            }
            Truth::Counter(counter, relation, value) if !self.blocks.contains(counter.as_str()) => {
                self.graph.constant(relation.holds(0, *value))
            }
            Truth::Counter(counter, relation, value) => {
                self.variable(Leaf::Counter(counter.clone(), *relation, *value))
            }
        }
    }

    /// `None` where lowering is given up.
    fn number(&mut self, number: &Number) -> Option<Bits> {
        if self.is_lost() {
            return None;
        }
        let found = match number {
            Number::Constant(value) => Bits::constant(&mut self.graph, *value),
            Number::Cell(cell) => match self.present(*cell) {
                Value::Number(number) => number,
                Value::Truth(_) => Bits::constant(&mut self.graph, 0),
            },
            Number::Sum(parts) => {
                // Constants are added up first, so that a long sum of them is short.
                let constant = Number::Sum(parts.iter().filter(is_constant).cloned().collect());
                let mut sum = Bits::constant(&mut self.graph, constant.constant().unwrap_or(0));
                for (negative, part) in parts.iter().filter(|part| !is_constant(part)) {
                    let part = self.number(part)?;
                    sum = if *negative {
                        sum.minus(&mut self.graph, &part)
                    } else {
                        sum.plus(&mut self.graph, &part)
                    };
                    self.fits(sum.interval)?;
                }
                sum
            }
            Number::Product(factors) => {
                let mut product = Bits::constant(&mut self.graph, 1);
                for factor in factors {
                    let factor = self.number(factor)?;
                    // Looked at before it is made: a product is as large as it is wide, squared.
                    self.fits(product.interval.times(factor.interval))?;
                    product = product.times(&mut self.graph, &factor);
                }
                product
            }
            Number::Quotient(inner, by) => self.number(inner)?.divided(&mut self.graph, *by).0,
            Number::Remainder(inner, by) => self.number(inner)?.divided(&mut self.graph, *by).1,
            Number::Wrapped(inner, range) => {
                let (inner, range) = (self.number(inner)?, Interval::of(*range));
                match inner.interval.within(range) {
                    true => inner,
                    false => inner.stored(&mut self.graph, range),
                }
            }
            Number::Choice(condition, then, otherwise) => {
                let condition = self.truth(condition);
                let then = self.number(then)?;
                let otherwise = self.number(otherwise)?;
                otherwise.chosen(&mut self.graph, condition, &then)
            }
        };
        self.fits(found.interval)?;
        Some(found)
    }

    fn fits(&mut self, interval: Interval) -> Option<()> {
        if interval.width().0 <= MAXIMUM_WIDTH {
            return Some(());
        }
        let message = format!("a number here needs more than {MAXIMUM_WIDTH} bits");
        self.trouble.get_or_insert(message);
        None
    }
}

fn is_constant(part: &&(bool, Number)) -> bool {
    matches!(part.1, Number::Constant(_))
}
