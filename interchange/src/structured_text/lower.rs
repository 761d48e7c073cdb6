//! Steps to rungs.
//!
//! Invariant: after each step on the outermost list, every bit of a cell stands in its signal (or is known to be constant), so
//! a step is expressions over signals as they are before it, and becomes rungs that write what it assigns. A choice is
//! executed in both ways on paper and joined bit by bit; so the scan of the rungs is the execution of the text.

mod rungs;

use std::collections::{BTreeSet, HashMap};

use understudy_diagnostic::Diagnostic;
use understudy_ladder::{Name, Program, Relation};
use understudy_logic::{Expression, Graph, Operation, Variable};

use self::rungs::Rungs;
use super::bounds::Interval;
use super::number::{Bits, choose};
use super::program::{Action, Cell, Kind, Number, Resolved, Role, Step, Truth};

/// The widest number that is calculated with, in bits.
const MAXIMUM_WIDTH: usize = 63;
/// Operations of the rungs of one step.
const MAXIMUM_OPERATIONS: usize = 400_000;

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
) -> (Program, Vec<Diagnostic>) {
    let mut lowering = Lowering {
        cells: &resolved.cells,
        intervals,
        assigned: resolved.assigned(),
        graph: Graph::new(),
        leaves: Vec::new(),
        places: HashMap::new(),
        known: HashMap::new(),
        overlays: vec![HashMap::new()],
        rungs: Rungs::new(&resolved.cells, intervals),
        diagnostics: Vec::new(),
    };
    for step in &resolved.steps {
        lowering.outermost(step);
        if lowering.rungs.is_full() || !lowering.diagnostics.is_empty() {
            break;
        }
    }
    if lowering.rungs.is_full() {
        let message = "the text makes more rungs than a ladder can have";
        lowering
            .diagnostics
            .push(Diagnostic::error("U1048", message, 0..0));
    }
    let program = lowering.rungs.finish(name);
    (program, lowering.diagnostics)
}

/// The signals of a cell, the low bit first.
pub(super) fn signals(cell: &Cell, interval: Interval) -> Vec<String> {
    match cell.kind {
        Kind::Truth => vec![cell.name.clone()],
        Kind::Number { .. } => {
            let (width, _) = interval.width();
            (0..width)
                .map(|place| format!("{}.{place}", cell.name))
                .collect()
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
    assigned: Vec<bool>,
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
    diagnostics: Vec<Diagnostic>,
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
        if let Action::Block {
            name,
            kind,
            wire,
            feeds,
        } = &step.action
        {
            let wire = self.truth(wire);
            let fed: Vec<(&'static str, Expression)> = feeds
                .iter()
                .map(|(pin, truth)| (*pin, self.truth(truth)))
                .collect();
            self.rungs.comment(&step.comments);
            self.rungs
                .block(&self.graph, &self.leaves, name, *kind, wire, &fed);
        } else {
            self.step(step);
            self.rungs.comment(&step.comments);
            self.flush();
        }
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

    fn step(&mut self, step: &Step) {
        if self.graph.operations().len() > MAXIMUM_OPERATIONS {
            if self.diagnostics.is_empty() {
                let message = "one statement makes a network that is too large";
                self.diagnostics
                    .push(Diagnostic::error("U1048", message, step.span.clone()));
            }
            return;
        }
        match &step.action {
            Action::SetTruth(cell, truth) => {
                let value = self.truth(truth);
                self.set(*cell, Value::Truth(value));
            }
            Action::SetNumber(cell, number) => {
                let Some(number) = self.number(number) else {
                    let message =
                        format!("a number in this statement needs more than {MAXIMUM_WIDTH} bits");
                    self.diagnostics
                        .push(Diagnostic::error("U1048", message, step.span.clone()));
                    return;
                };
                let stored = number.stored(&mut self.graph, self.intervals[*cell]);
                self.set(*cell, Value::Number(stored));
            }
            Action::If(branches, otherwise) => self.choice(branches, otherwise),
            // Blocks are called where every execution passes, as resolving has seen to.
            Action::Block { .. } => {}
        }
    }

    fn set(&mut self, cell: usize, value: Value) {
        if let Some(overlay) = self.overlays.last_mut() {
            overlay.insert(cell, value);
        }
    }

    fn choice(&mut self, branches: &[(Truth, Vec<Step>)], otherwise: &[Step]) {
        let conditions: Vec<Expression> = branches
            .iter()
            .map(|(condition, _)| self.truth(condition))
            .collect();
        let mut results = Vec::new();
        for steps in branches
            .iter()
            .map(|(_, branch)| branch.as_slice())
            .chain([otherwise])
        {
            self.overlays.push(HashMap::new());
            for step in steps {
                self.step(step);
            }
            results.push(self.overlays.pop().unwrap_or_default());
        }
        let written: BTreeSet<usize> = results
            .iter()
            .flat_map(|result| result.keys().copied())
            .collect();
        for cell in written {
            let base = self.present(cell);
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
        if let Some(value) = self
            .overlays
            .iter()
            .rev()
            .find_map(|overlay| overlay.get(&cell))
        {
            return value.clone();
        }
        let content = &self.cells[cell];
        let fixed = !self.assigned[cell] && !matches!(content.role, Role::Input | Role::Pin);
        let known = self
            .known
            .get(&cell)
            .copied()
            .or(fixed.then_some(content.initial));
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
                let bits = names
                    .into_iter()
                    .map(|name| self.variable(Leaf::Signal(name)));
                Value::Number(Bits {
                    bits: bits.collect(),
                    interval,
                })
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
                    _ => {
                        let message = format!(
                            "a number of a comparison needs more than {MAXIMUM_WIDTH} bits"
                        );
                        self.diagnostics
                            .push(Diagnostic::error("U1048", message, 0..0));
                        self.graph.constant(false)
                    }
                }
            }
            Truth::Counter(counter, relation, value) => {
                self.variable(Leaf::Counter(counter.clone(), *relation, *value))
            }
        }
    }

    /// `None` where it is too wide.
    fn number(&mut self, number: &Number) -> Option<Bits> {
        let found = match number {
            Number::Constant(value) => Bits::constant(&mut self.graph, *value),
            Number::Cell(cell) => match self.present(*cell) {
                Value::Number(number) => number,
                Value::Truth(_) => Bits::constant(&mut self.graph, 0),
            },
            Number::Sum(parts) => {
                let mut sum = Bits::constant(&mut self.graph, 0);
                for (negative, part) in parts {
                    let part = self.number(part)?;
                    sum = if *negative {
                        sum.minus(&mut self.graph, &part)
                    } else {
                        sum.plus(&mut self.graph, &part)
                    };
                    fits(&sum)?;
                }
                sum
            }
            Number::Product(factors) => {
                let mut product = Bits::constant(&mut self.graph, 1);
                for factor in factors {
                    let factor = self.number(factor)?;
                    // Looked at before it is made: a product is as large as it is wide, squared.
                    let (width, _) = product.interval.times(factor.interval).width();
                    if width > MAXIMUM_WIDTH {
                        return None;
                    }
                    product = product.times(&mut self.graph, &factor);
                }
                product
            }
            Number::Quotient(inner, by) => self.number(inner)?.divided(&mut self.graph, *by).0,
            Number::Remainder(inner, by) => self.number(inner)?.divided(&mut self.graph, *by).1,
            Number::Choice(condition, then, otherwise) => {
                let condition = self.truth(condition);
                let then = self.number(then)?;
                let otherwise = self.number(otherwise)?;
                otherwise.chosen(&mut self.graph, condition, &then)
            }
        };
        fits(&found)?;
        Some(found)
    }
}

fn fits(number: &Bits) -> Option<()> {
    (number.interval.width().0 <= MAXIMUM_WIDTH).then_some(())
}
