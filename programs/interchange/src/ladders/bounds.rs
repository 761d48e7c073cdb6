//! How large each number can become, so that it takes no more bits than it needs.
//!
//! An interval for each number, followed through the steps of one execution after the other until nothing changes: branches are
//! joined, what a condition says about a number holds in its branch, and an interval that keeps growing jumps to the next
//! constant of the program, at last to the whole type. Invariant of the result: whatever the inputs were, a number is
//! always within its interval; where it would leave its type it wraps around, as compiled code does, and has all of it.

use std::collections::BTreeSet;
use std::ops::{Index, IndexMut};
use std::rc::Rc;

use understudy_ladder::Relation;
use understudy_text::Diagnostic;

use super::program::{Action, Kind, Number, Resolved, Role, Step, Truth, walk};

/// Executions after which growing intervals jump.
const PATIENCE: usize = 4;
/// Executions after which the whole types are taken.
const MAXIMUM_PASSES: usize = 60;
/// Choices times numbers past which the whole types are taken at once.
const MAXIMUM_WORK: usize = 1_000_000;

/// From the least to the greatest value, both possible.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Interval {
    pub(super) low: i128,
    pub(super) high: i128,
}

impl Interval {
    pub(super) fn new(low: i128, high: i128) -> Self {
        Self { low, high }
    }

    pub(super) fn just(value: i64) -> Self {
        Self::new(value.into(), value.into())
    }

    pub(super) fn of(range: (i64, i64)) -> Self {
        Self::new(range.0.into(), range.1.into())
    }

    pub(super) fn hull(self, other: Self) -> Self {
        Self::new(self.low.min(other.low), self.high.max(other.high))
    }

    pub(super) fn within(self, other: Self) -> bool {
        other.low <= self.low && self.high <= other.high
    }

    fn corners(self, other: Self, join: impl Fn(i128, i128) -> i128) -> Self {
        let all = [
            join(self.low, other.low),
            join(self.low, other.high),
            join(self.high, other.low),
            join(self.high, other.high),
        ];
        all.into_iter().map(|value| Self::new(value, value)).reduce(Self::hull).unwrap_or(self)
    }

    pub(super) fn plus(self, other: Self) -> Self {
        Self::new(self.low.saturating_add(other.low), self.high.saturating_add(other.high))
    }

    pub(super) fn negated(self) -> Self {
        Self::new(self.high.saturating_neg(), self.low.saturating_neg())
    }

    pub(super) fn times(self, other: Self) -> Self {
        self.corners(other, i128::saturating_mul)
    }

    pub(super) fn quotient(self, by: i64) -> Self {
        self.corners(Self::just(by), |number, by| number.checked_div(by).unwrap_or(0))
    }

    pub(super) fn remainder(self, by: i64) -> Self {
        let most = i128::from(by.unsigned_abs()) - 1;
        if 0 <= self.low && self.high <= most {
            return self;
        }
        let low = if self.low < 0 { -most } else { 0 };
        let high = if self.high > 0 { most } else { 0 };
        Self::new(low.max(self.low.min(0)), high.min(self.high.max(0)))
    }

    /// Bits that it takes, and whether the last of them is a sign.
    pub(super) fn width(self) -> (usize, bool) {
        let bits = |value: i128| (i128::BITS - value.leading_zeros()) as usize;
        if self.low >= 0 {
            (bits(self.high), false)
        } else {
            (bits(self.high.max(0)).max(bits(!self.low)) + 1, true)
        }
    }

    /// Everything that its bits can say.
    pub(super) fn of_bits(self) -> Self {
        let (width, signed) = self.width();
        let all = 1_i128 << width.min(120);
        if signed { Self::new(-all / 2, all / 2 - 1) } else { Self::new(0, all - 1) }
    }
}

/// The interval of each cell, which for a truth means nothing, and what is suspicious.
pub(super) fn bounds(program: &Resolved) -> (Vec<Interval>, Vec<Diagnostic>) {
    let mut analysis = Analysis::new(program);
    let mut slots = Vec::with_capacity(program.cells.len());
    let mut values = Vec::new();
    for (cell, seen) in program.cells.iter().zip(&analysis.seen) {
        slots.push(values.len());
        if matches!(cell.kind, Kind::Number { .. }) {
            values.push(*seen);
        }
    }
    let slots: Rc<[usize]> = slots.into();
    let mut start = Present { slots, values };
    if analysis.choices.saturating_mul(start.values.len()) > MAXIMUM_WORK {
        return (analysis.whole(), Vec::new());
    }
    for pass in 0.. {
        let mut end = start.clone();
        analysis.steps(&program.steps, &mut end);
        let mut grown = start.clone();
        join(&mut grown, &end);
        if grown.values == start.values {
            break;
        }
        start = match pass {
            ..PATIENCE => grown,
            PATIENCE..MAXIMUM_PASSES => analysis.widened(&start, &grown),
            _ => analysis.whole_of(&start),
        };
    }
    // Once more, for what is said.
    analysis.is_last = true;
    let mut end = start;
    analysis.steps(&program.steps, &mut end);
    let mut seen = analysis.seen;
    // What is always 0 needs no bit, but where the world reads it.
    for (cell, interval) in program.cells.iter().zip(&mut seen) {
        let is_number = matches!(cell.kind, Kind::Number { .. });
        if is_number && cell.is_seen && interval.width().0 == 0 {
            *interval = Interval::new(0, 1);
        }
    }
    (seen, analysis.diagnostics)
}

/// The intervals at one place of the program, of the cells that are numbers.
#[derive(Debug, Clone)]
struct Present {
    /// Where each cell's interval is.
    slots: Rc<[usize]>,
    values: Vec<Interval>,
}

impl Index<usize> for Present {
    type Output = Interval;

    fn index(&self, cell: usize) -> &Interval {
        &self.values[self.slots[cell]]
    }
}

impl IndexMut<usize> for Present {
    fn index_mut(&mut self, cell: usize) -> &mut Interval {
        &mut self.values[self.slots[cell]]
    }
}

struct Analysis<'a> {
    program: &'a Resolved,
    /// Of all values that a cell has ever had.
    seen: Vec<Interval>,
    /// Places where the intervals are copied.
    choices: usize,
    /// Numbers that the program names, in ascending order.
    thresholds: Vec<i128>,
    is_last: bool,
    diagnostics: Vec<Diagnostic>,
}

impl<'a> Analysis<'a> {
    fn new(program: &'a Resolved) -> Self {
        let seen = program.cells.iter().map(|cell| match (cell.kind, cell.role) {
            (Kind::Truth, _) => Interval::just(0),
            // What comes from outside is whatever its bits say.
            (Kind::Number { declared, .. }, Role::Input) => Interval::of(declared).of_bits(),
            (Kind::Number { .. }, _) => Interval::just(cell.initial),
        });
        let mut named = BTreeSet::new();
        let mut choices = 0;
        walk(&program.steps, &mut |step| match &step.action {
            Action::SetTruth(_, truth) => constants_of_truth(truth, &mut named),
            Action::SetNumber(_, number) => constants(number, &mut named),
            Action::If(branches, _) => {
                choices += branches.len();
                branches.iter().for_each(|(truth, _)| constants_of_truth(truth, &mut named));
            }
            Action::Block { .. } | Action::Timer { .. } => {}
        });
        Self {
            program,
            seen: seen.collect(),
            choices,
            thresholds: named.into_iter().collect(),
            is_last: false,
            diagnostics: Vec::new(),
        }
    }

    fn type_of(&self, cell: usize) -> Interval {
        match self.program.cells[cell].kind {
            Kind::Truth => Interval::just(0),
            Kind::Number { wide, .. } => Interval::of(wide),
        }
    }

    fn whole(&self) -> Vec<Interval> {
        (0..self.seen.len()).map(|cell| self.type_of(cell).hull(self.seen[cell])).collect()
    }

    fn numbers(&self) -> impl Iterator<Item = usize> {
        let cells = self.program.cells.iter().enumerate();
        cells.filter(|(_, cell)| matches!(cell.kind, Kind::Number { .. })).map(|(place, _)| place)
    }

    fn whole_of(&self, start: &Present) -> Present {
        let mut whole = start.clone();
        for cell in self.numbers() {
            whole[cell] = self.type_of(cell).hull(start[cell]);
        }
        whole
    }

    /// What grew, grown up to the next number that the program names.
    fn widened(&self, start: &Present, grown: &Present) -> Present {
        let mut widened = grown.clone();
        for cell in self.numbers() {
            let (old, new, all) = (start[cell], grown[cell], self.type_of(cell));
            let next = &mut widened[cell];
            if new.high > old.high {
                let above = self.thresholds.iter().find(|value| **value >= new.high);
                next.high = above.map_or(all.high, |value| (*value).min(all.high)).max(new.high);
            }
            if new.low < old.low {
                let below = self.thresholds.iter().rev().find(|value| **value <= new.low);
                next.low = below.map_or(all.low, |value| (*value).max(all.low)).min(new.low);
            }
        }
        widened
    }

    fn steps(&mut self, steps: &[Step], present: &mut Present) {
        for step in steps {
            match &step.action {
                Action::SetNumber(cell, number) => self.set(*cell, number, step, present),
                Action::If(branches, otherwise) => {
                    let mut rest = present.clone();
                    let mut ends = Vec::with_capacity(branches.len());
                    for (condition, branch) in branches {
                        let mut inner = rest.clone();
                        refine(condition, true, &mut inner);
                        self.steps(branch, &mut inner);
                        ends.push(inner);
                        refine(condition, false, &mut rest);
                    }
                    self.steps(otherwise, &mut rest);
                    for end in &ends {
                        join(&mut rest, end);
                    }
                    *present = rest;
                }
                Action::SetTruth(..) | Action::Block { .. } | Action::Timer { .. } => {}
            }
        }
    }

    fn set(&mut self, cell: usize, number: &Number, step: &Step, present: &mut Present) {
        let found = match number {
            Number::Wrapped(number, _) => evaluate(number, present),
            number => evaluate(number, present),
        };
        let Kind::Number { declared, wide } = self.program.cells[cell].kind else {
            return;
        };
        let (declared, wide) = (Interval::of(declared), Interval::of(wide));
        let fits = found.within(wide);
        if self.is_last && !found.within(declared) {
            let name = &self.program.cells[cell].name;
            let message = if fits {
                format!(
                    "`{name}` is declared from {} to {} and can become {} to {} here",
                    declared.low, declared.high, found.low, found.high
                )
            } else {
                format!("`{name}` can leave its type here, and wraps around as compiled code does")
            };
            let finding = Diagnostic::warning("U1054", message, step.span.clone());
            self.diagnostics.push(
                finding
                    .with_help("a condition around the assignment can keep it within its bounds"),
            );
        }
        let stored = if fits { found } else { wide };
        present[cell] = stored;
        self.seen[cell] = self.seen[cell].hull(stored);
    }
}

fn join(joined: &mut Present, other: &Present) {
    for (interval, other) in joined.values.iter_mut().zip(&other.values) {
        *interval = interval.hull(*other);
    }
}

fn evaluate(number: &Number, present: &Present) -> Interval {
    match number {
        Number::Constant(value) => Interval::just(*value),
        Number::Cell(cell) => present[*cell],
        Number::Sum(parts) => parts.iter().fold(Interval::just(0), |sum, (negative, part)| {
            let part = evaluate(part, present);
            sum.plus(if *negative { part.negated() } else { part })
        }),
        Number::Product(factors) => factors
            .iter()
            .fold(Interval::just(1), |product, factor| product.times(evaluate(factor, present))),
        Number::Quotient(number, by) => evaluate(number, present).quotient(*by),
        Number::Remainder(number, by) => evaluate(number, present).remainder(*by),
        Number::Wrapped(number, range) => {
            let (found, range) = (evaluate(number, present), Interval::of(*range));
            if found.within(range) { found } else { range }
        }
        Number::Choice(condition, then, otherwise) => {
            let side = |number, holds| {
                let mut inner = present.clone();
                refine(condition, holds, &mut inner);
                evaluate(number, &inner)
            };
            side(then, true).hull(side(otherwise, false))
        }
    }
}

/// Narrows what is present by what is known where `truth` is `holds`.
fn refine(truth: &Truth, holds: bool, present: &mut Present) {
    match (truth, holds) {
        (Truth::Not(inner), _) => refine(inner, !holds, present),
        (Truth::All(parts), true) | (Truth::Any(parts), false) => {
            for part in parts {
                refine(part, holds, present);
            }
        }
        // One branch of several: what holds in all of them, for one number and constants.
        (Truth::Any(parts), true) | (Truth::All(parts), false) if !parts.is_empty() => {
            let mut joined: Option<Present> = None;
            for part in parts.iter().take(if parts.len() <= 8 { 8 } else { 0 }) {
                let mut inner = present.clone();
                refine(part, holds, &mut inner);
                match &mut joined {
                    None => joined = Some(inner),
                    Some(joined) => join(joined, &inner),
                }
            }
            if let Some(joined) = joined {
                *present = joined;
            }
        }
        (Truth::Compare(relation, left, right), _) => {
            let relation = if holds { *relation } else { relation.opposite() };
            if let Number::Cell(cell) = **left {
                let bound = evaluate(right, present);
                narrow(&mut present[cell], relation, bound);
            }
            if let Number::Cell(cell) = **right {
                let bound = evaluate(left, present);
                narrow(&mut present[cell], relation.mirrored(), bound);
            }
        }
        _ => {}
    }
}

/// Keeps an interval that is empty as it was: nothing comes there, and anything may be said of it.
fn narrow(interval: &mut Interval, relation: Relation, bound: Interval) {
    let mut next = *interval;
    match relation {
        Relation::Equal => {
            next.low = next.low.max(bound.low);
            next.high = next.high.min(bound.high);
        }
        Relation::NotEqual if bound.low == bound.high => {
            next.low += i128::from(next.low == bound.low);
            next.high -= i128::from(next.high == bound.high);
        }
        Relation::NotEqual => {}
        Relation::Less => next.high = next.high.min(bound.high.saturating_sub(1)),
        Relation::LessOrEqual => next.high = next.high.min(bound.high),
        Relation::Greater => next.low = next.low.max(bound.low.saturating_add(1)),
        Relation::GreaterOrEqual => next.low = next.low.max(bound.low),
    }
    if next.low <= next.high {
        *interval = next;
    }
}

fn constants(number: &Number, named: &mut BTreeSet<i128>) {
    match number {
        Number::Constant(value) => {
            named.extend([i128::from(*value) - 1, i128::from(*value), i128::from(*value) + 1]);
        }
        Number::Cell(_) => {}
        Number::Sum(parts) => parts.iter().for_each(|(_, part)| constants(part, named)),
        Number::Product(parts) => parts.iter().for_each(|part| constants(part, named)),
        Number::Quotient(inner, _) | Number::Remainder(inner, _) | Number::Wrapped(inner, _) => {
            constants(inner, named);
        }
        Number::Choice(condition, then, otherwise) => {
            constants_of_truth(condition, named);
            constants(then, named);
            constants(otherwise, named);
        }
    }
}

fn constants_of_truth(truth: &Truth, named: &mut BTreeSet<i128>) {
    match truth {
        Truth::Not(inner) => constants_of_truth(inner, named),
        Truth::All(parts) | Truth::Any(parts) | Truth::Odd(parts) => {
            parts.iter().for_each(|part| constants_of_truth(part, named));
        }
        Truth::Compare(_, left, right) => {
            constants(left, named);
            constants(right, named);
        }
        Truth::Constant(_) | Truth::Cell(_) | Truth::Counter(..) => {}
    }
}
