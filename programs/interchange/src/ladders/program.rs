//! A program with every name resolved and every instance in its place: cells, and steps over them.
//!
//! A step is an assignment, a choice, or a function block of the ladder. Calls of other blocks and of functions, loops and
//! CASE are gone, so that a walk over the steps in their order is one execution.

use std::collections::HashSet;
use std::ops::Range;
use std::time::Duration;

use understudy_ladder::{Address, BlockKind, Relation};

/// What a cell is in the program.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Role {
    Input,
    Output,
    Memory,
    /// An output of a block of the ladder, which its block alone writes.
    Pin,
    /// A bit that means something only where this execution has written it.
    Passing,
    /// A bit that represents the output of a timer, which the calls of the timer alone write.
    Held,
}

/// What a cell holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    Truth,
    Number {
        /// What its declaration allows.
        declared: (i64, i64),
        /// What its type holds; past it an assignment wraps around.
        wide: (i64, i64),
    },
}

/// A variable of one instance.
#[derive(Debug, Clone)]
pub(super) struct Cell {
    /// Legal in a ladder, and unique.
    pub(super) name: String,
    pub(super) kind: Kind,
    pub(super) role: Role,
    /// 0 or 1 for a truth.
    pub(super) initial: i64,
    /// The world reads it, so it takes at least one bit.
    pub(super) is_seen: bool,
    /// Its declaration gives the initial value.
    pub(super) is_given: bool,
    pub(super) address: Option<Address>,
    pub(super) description: Option<String>,
}

/// A Boolean expression.
#[derive(Debug, Clone)]
pub(super) enum Truth {
    Constant(bool),
    Cell(usize),
    Not(Box<Truth>),
    All(Vec<Truth>),
    Any(Vec<Truth>),
    /// An odd number of them.
    Odd(Vec<Truth>),
    Compare(Relation, Box<Number>, Box<Number>),
    /// The value of a counter of the ladder, by its block's name.
    Counter(String, Relation, u16),
}

/// A whole number.
#[derive(Debug, Clone)]
pub(super) enum Number {
    Constant(i64),
    Cell(usize),
    /// Each with whether it is subtracted.
    Sum(Vec<(bool, Number)>),
    Product(Vec<Number>),
    /// By a number other than 0, towards 0.
    Quotient(Box<Number>, i64),
    /// With the sign of what is divided.
    Remainder(Box<Number>, i64),
    Choice(Box<Truth>, Box<Number>, Box<Number>),
    /// As a type of that range holds it: past it the number wraps around.
    Wrapped(Box<Number>, (i64, i64)),
}

impl Number {
    /// Its value where no cell decides it, and 64 bits hold it.
    pub(super) fn constant(&self) -> Option<i64> {
        match self {
            Self::Constant(value) => Some(*value),
            Self::Sum(parts) => parts.iter().try_fold(0_i64, |sum, (negative, part)| {
                let value = part.constant()?;
                if *negative { sum.checked_sub(value) } else { sum.checked_add(value) }
            }),
            Self::Product(factors) => factors
                .iter()
                .try_fold(1_i64, |product, factor| product.checked_mul(factor.constant()?)),
            Self::Quotient(number, by) => number.constant()?.checked_div(*by),
            Self::Remainder(number, by) => number.constant()?.checked_rem(*by),
            Self::Cell(_) | Self::Choice(..) | Self::Wrapped(..) => None,
        }
    }
}

/// What a step does.
#[derive(Debug, Clone)]
pub(super) enum Action {
    SetTruth(usize, Truth),
    SetNumber(usize, Number),
    If(Vec<(Truth, Vec<Step>)>, Vec<Step>),
    /// Only where every execution passes.
    Block {
        name: String,
        kind: BlockKind,
        wire: Truth,
        feeds: Vec<(&'static str, Truth)>,
    },
    /// A call of one of [`Resolved::timers`], anywhere; [`super::timers`] puts blocks and assignments in its place.
    Timer {
        timer: usize,
        wire: Truth,
        /// Its time, where the call gives one.
        preset: Option<Duration>,
    },
}

/// A timer that is called under a condition, or more than once in an execution.
#[derive(Debug, Clone)]
pub(super) struct Timer {
    /// Unique among cells and blocks.
    pub(super) name: String,
    /// TON, TOF or TP.
    pub(super) word: &'static str,
    /// The cell of what its clock is fed with: IN at its last call.
    pub(super) started: usize,
    /// The cell of its output.
    pub(super) output: usize,
}

/// One step with its place in the text.
#[derive(Debug, Clone)]
pub(super) struct Step {
    pub(super) action: Action,
    pub(super) span: Range<usize>,
    pub(super) comments: Vec<String>,
}

/// A whole resolved program.
#[derive(Debug, Clone, Default)]
pub(super) struct Resolved {
    pub(super) cells: Vec<Cell>,
    pub(super) steps: Vec<Step>,
    pub(super) timers: Vec<Timer>,
    /// Of cells and blocks.
    pub(super) names: HashSet<String>,
}

impl Resolved {
    /// For each cell, whether some step writes it.
    pub(super) fn written(&self) -> Vec<bool> {
        let blocks = self.blocks();
        let pins = self.cells.iter().map(|cell| {
            let block = cell.name.rsplit_once('.').map(|(block, _)| block);
            cell.role == Role::Pin && block.is_some_and(|block| blocks.contains(block))
        });
        let mut written: Vec<bool> = pins.collect();
        walk(&self.steps, &mut |step| {
            if let Action::SetTruth(cell, _) | Action::SetNumber(cell, _) = step.action {
                written[cell] = true;
            }
        });
        written
    }

    /// The blocks that are called.
    pub(super) fn blocks(&self) -> HashSet<&str> {
        let mut blocks = HashSet::new();
        walk(&self.steps, &mut |step| {
            if let Action::Block { name, .. } = &step.action {
                blocks.insert(name.as_str());
            }
        });
        blocks
    }
}

/// Calls `see` with every step, choices before what they choose among.
pub(super) fn walk<'a>(steps: &'a [Step], see: &mut impl FnMut(&'a Step)) {
    for step in steps {
        see(step);
        if let Action::If(branches, otherwise) = &step.action {
            for (_, branch) in branches {
                walk(branch, see);
            }
            walk(otherwise, see);
        }
    }
}
