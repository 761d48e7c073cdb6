//! Between which numbers each value of a system lies, and of which number it is a multiple.
//!
//! The extents of cells grow from their initial values until no scan leaves them; a bound that keeps growing goes to the next constant of
//! the programs, then to the end of its type. No extent says how two cells are related, so they hold for every mixture of states that occur, as a warm
//! start makes one. A selection restricts what stands behind its condition: `IF n < 5 THEN n := n + 1` keeps `n` within 5.

mod applied;
mod changes;

use std::collections::BTreeSet;

use understudy_typed::{Comparison, Elementary, Operation};

use self::applied::applied;
use self::changes::Changes;
use crate::System;
use crate::system::Cell;
use crate::term::{Node, Term, Terms, Variable};

/// Times that a bound grows by what a scan adds, before it goes to the next constant.
const EXACT: usize = 3;
/// Times that it grows before it goes to the end of its type.
const CONSTANTS: usize = 24;
/// Scans after which every bound that grows goes to the end of its type.
const HELD: usize = 200;
/// Scans after which nothing is known of any cell.
const ALL: usize = 240;
/// Terms of which conditions are not followed.
const MANY: usize = 60_000;
/// Terms that are looked at again for one side of a selection.
const LOOKS: u32 = 200;

/// Numbers from `low` to `high` that are multiples of `unit`; of a unit of 0 the number is 0.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Extent {
    pub(crate) low: i128,
    pub(crate) high: i128,
    pub(crate) unit: i128,
}

impl Extent {
    pub(crate) fn new(low: i128, high: i128) -> Self {
        let unit = if low == high { low.abs() } else { 1 };
        Self { low, high, unit }
    }

    /// Every value of a type; reals by their bits.
    pub(crate) fn of(of: Elementary) -> Self {
        let (low, high) = if of.is_real() { (0, of.mask().into()) } else { of.limits() };
        Self { low, high, unit: 1 }
    }

    fn is_of(self, of: Elementary) -> bool {
        let (low, high) = of.limits();
        !of.is_real() && low <= self.low && self.high <= high
    }

    /// The same where the type holds it, else every value of the type: past its end a number wraps.
    fn wrapped(self, of: Elementary) -> Self {
        if self.is_of(of) { self } else { Self::of(of) }
    }

    fn joined(self, other: Self) -> Self {
        Self {
            low: self.low.min(other.low),
            high: self.high.max(other.high),
            unit: divisor(self.unit, other.unit),
        }
    }

    /// What of it lies between two numbers; as it is where nothing does, since no run comes there.
    fn within(self, low: i128, high: i128) -> Self {
        let unit = self.unit.max(1);
        let low = low.max(self.low);
        let high = high.min(self.high);
        let low = low.div_euclid(unit) * unit + if low.rem_euclid(unit) == 0 { 0 } else { unit };
        let high = high.div_euclid(unit) * unit;
        match low.cmp(&high) {
            std::cmp::Ordering::Less => Self { low, high, unit: self.unit },
            std::cmp::Ordering::Equal => Self::new(low, high),
            std::cmp::Ordering::Greater => self,
        }
    }

    pub(crate) fn holds(self, number: i128) -> bool {
        (self.low..=self.high).contains(&number) && number % self.unit.max(1) == 0
    }

    /// The number of it that is nearest to `number`, of two the one nearer to 0.
    pub(crate) fn nearest(self, number: i128) -> i128 {
        let number = number.clamp(self.low, self.high);
        number - number % self.unit.max(1)
    }

    pub(crate) fn covers(self, other: Self) -> bool {
        let unit = self.unit.max(1);
        self.low <= other.low && other.high <= self.high && (unit == 1 || other.unit % unit == 0)
    }

    fn is_natural(self) -> bool {
        self.low >= 0
    }
}

/// The greatest common divisor; of 0 and a number that number.
pub(crate) fn divisor(mut one: i128, mut other: i128) -> i128 {
    while other != 0 {
        (one, other) = (other, one % other);
    }
    one.abs()
}

/// The extent of each term of a system.
pub(crate) struct Extents(Vec<Extent>);

impl Extents {
    /// The cells `whole` have all bits below their highest, and a BOOL among them its bit; of a time the bits of its multiples of a period.
    pub(crate) fn new(system: &System, whole: &[u32]) -> Self {
        Self::found(system, whole, Some(Changes::new(&system.terms, system.cells.len())))
    }

    /// Without `changes` every term is evaluated for each scan.
    fn found(system: &System, whole: &[u32], mut changes: Option<Changes>) -> Self {
        let first = |cell: &Cell| {
            if cell.of.is_real() {
                return Extent::of(cell.of);
            }
            let number = cell.of.signed(cell.initial);
            Extent::new(number, number)
        };
        let mut first: Vec<Extent> = system.cells.iter().map(first).collect();
        for &cell in whole {
            let extent = &mut first[cell as usize];
            match system.cells[cell as usize].of {
                Elementary::Bool => *extent = Extent::of(Elementary::Bool),
                of if of.is_time() => {}
                _ => extent.unit = 1,
            }
        }
        let mut search = Search {
            system,
            cells: first.clone(),
            first,
            terms: Vec::new(),
            grown: vec![0; system.cells.len()],
            follows: system.terms.len() <= MANY,
        };
        let ends = search.ends();
        search.evaluate();
        let mut round = 0;
        loop {
            let grown = search.grow(round, &ends);
            if grown.is_empty() {
                break;
            }
            match &mut changes {
                Some(changes) => search.evaluate_changed(changes, &grown),
                None => search.evaluate(),
            }
            round += 1;
        }
        // Bounds that grew too far come back, as far as a scan from them allows.
        for _ in 0..2 {
            let known = search.cells.clone();
            search.shrink();
            search.evaluate();
            if !search.is_closed() {
                search.cells = known;
                search.evaluate();
                break;
            }
        }
        Self(search.terms)
    }

    pub(crate) fn get(&self, term: Term) -> Extent {
        self.0[Terms::index(term)]
    }
}

#[cfg(test)]
mod tests;

struct Search<'s> {
    system: &'s System,
    cells: Vec<Extent>,
    /// Those before the first scan.
    first: Vec<Extent>,
    terms: Vec<Extent>,
    /// How often each cell has left its extent.
    grown: Vec<usize>,
    follows: bool,
}

/// What a condition says of a number.
#[derive(Debug, Clone, Copy)]
struct Fact {
    term: Term,
    low: i128,
    high: i128,
}

impl Search<'_> {
    /// Where bounds that grow are held: at the constants and beside them.
    fn ends(&self) -> BTreeSet<i128> {
        let mut ends = BTreeSet::new();
        for (of, stored) in self.system.terms.all_constants() {
            if !of.is_real() && of != Elementary::Bool {
                let number = of.signed(stored);
                ends.extend([number - 1, number, number + 1]);
            }
        }
        ends
    }

    /// Extents of all terms for those of the cells.
    fn evaluate(&mut self) {
        self.terms.clear();
        let terms = &self.system.terms;
        for place in 0..terms.len() {
            let term = terms.at(place);
            let extent = self.extent(term);
            self.terms.push(extent);
        }
    }

    /// One scan more; the cells that have left their extents.
    fn grow(&mut self, round: usize, ends: &BTreeSet<i128>) -> Vec<usize> {
        let mut grew = Vec::new();
        for (place, cell) in self.system.cells.iter().enumerate() {
            let known = self.cells[place];
            let mut next = known.joined(self.terms[Terms::index(cell.next)]);
            if next == known {
                continue;
            }
            grew.push(place);
            let full = Extent::of(cell.of);
            let times = self.grown[place];
            self.grown[place] += 1;
            if round >= ALL {
                next = full;
            } else if times >= EXACT || round >= HELD {
                let is_held = times < CONSTANTS && round < HELD;
                if next.high > known.high {
                    let end = ends.range(next.high..).next().filter(|_| is_held);
                    next.high = end.copied().unwrap_or(full.high).min(full.high);
                }
                if next.low < known.low {
                    let end = ends.range(..=next.low).next_back().filter(|_| is_held);
                    next.low = end.copied().unwrap_or(full.low).max(full.low);
                }
                // Bounds are multiples too.
                next = next.within(next.low, next.high);
            }
            self.cells[place] = next;
        }
        grew
    }

    /// Whether a scan from the extents of the cells stays within them.
    fn is_closed(&self) -> bool {
        let mut cells = self.system.cells.iter().zip(&self.cells);
        cells.all(|(cell, &known)| known.joined(self.terms[Terms::index(cell.next)]) == known)
    }

    /// The extents that one scan from the known ones leaves.
    fn shrink(&mut self) {
        for (place, cell) in self.system.cells.iter().enumerate() {
            let next = self.terms[Terms::index(cell.next)];
            if !cell.of.is_real() {
                self.cells[place] = self.first[place].joined(next);
            }
        }
    }

    /// The extent of a term whose operands have theirs.
    fn extent(&self, term: Term) -> Extent {
        let terms = &self.system.terms;
        let of = terms.of(term);
        match terms.node(term) {
            Node::Constant(stored) if !of.is_real() => {
                let number = of.signed(*stored);
                Extent::new(number, number)
            }
            Node::Variable(Variable::Input(number)) if !of.is_real() => {
                let (low, high) = self.system.inputs[*number as usize].limits;
                Extent::new(low, high)
            }
            Node::Variable(Variable::Cell(cell)) => self.cells[*cell as usize],
            Node::Apply(operation, operands) => {
                let operands: Vec<Extent> =
                    operands.iter().map(|operand| self.terms[Terms::index(*operand)]).collect();
                applied(*operation, of, &operands)
            }
            Node::Choose([condition, then, otherwise]) if !of.is_real() => {
                let sides = [(true, then), (false, otherwise)]
                    .map(|(is, side)| self.side(*condition, is, *side));
                either(sides).unwrap_or_else(|| Extent::of(of))
            }
            _ => Extent::of(of),
        }
    }

    /// The extent of a term where a condition is so; `None` where it never is.
    fn side(&self, condition: Term, value: bool, term: Term) -> Option<Extent> {
        let known = self.terms[Terms::index(term)];
        if !self.follows {
            return Some(known);
        }
        let mut facts = Vec::new();
        self.facts(condition, value, &mut facts, 0);
        if self.is_contradicted(&facts) {
            return None;
        }
        let mut looks = LOOKS;
        let refined = self.refined(term, &mut facts, &mut looks, 0);
        Some(Extent { unit: known.unit, ..refined })
    }

    fn is_contradicted(&self, facts: &[Fact]) -> bool {
        facts.iter().any(|fact| {
            let known = self.terms[Terms::index(fact.term)];
            let is_number = !self.system.terms.of(fact.term).is_real();
            is_number && (fact.low > known.high || fact.high < known.low || fact.low > fact.high)
        })
    }

    /// What is known where a condition is so.
    fn facts(&self, condition: Term, value: bool, facts: &mut Vec<Fact>, depth: u32) {
        if depth > 24 || facts.len() > 64 {
            return;
        }
        let terms = &self.system.terms;
        let known = i128::from(value);
        facts.push(Fact { term: condition, low: known, high: known });
        let Node::Apply(operation, operands) = terms.node(condition) else {
            return;
        };
        match (operation, &**operands) {
            (Operation::Not(_), &[inner]) => self.facts(inner, !value, facts, depth + 1),
            (Operation::And(Elementary::Bool), &[left, right]) if value => {
                self.facts(left, true, facts, depth + 1);
                self.facts(right, true, facts, depth + 1);
            }
            (Operation::Or(Elementary::Bool), &[left, right]) if !value => {
                self.facts(left, false, facts, depth + 1);
                self.facts(right, false, facts, depth + 1);
            }
            (Operation::Compare(comparison, of), &[left, right]) if !of.is_real() => {
                let comparison = if value { *comparison } else { comparison.opposite() };
                self.compared(comparison, left, right, facts);
                self.compared(comparison.mirrored(), right, left, facts);
            }
            _ => {}
        }
    }

    /// What a comparison says of its left side.
    fn compared(&self, comparison: Comparison, left: Term, right: Term, facts: &mut Vec<Fact>) {
        let (one, other) = (self.terms[Terms::index(left)], self.terms[Terms::index(right)]);
        let (low, high) = match comparison {
            Comparison::Equal => (other.low, other.high),
            Comparison::Less => (one.low, other.high - 1),
            Comparison::LessOrEqual => (one.low, other.high),
            Comparison::Greater => (other.low + 1, one.high),
            Comparison::GreaterOrEqual => (other.low, one.high),
            Comparison::NotEqual if other.low == other.high && other.low == one.low => {
                (one.low + 1, one.high)
            }
            Comparison::NotEqual if other.low == other.high && other.low == one.high => {
                (one.low, one.high - 1)
            }
            Comparison::NotEqual => return,
        };
        self.bounded(left, low, high, facts, 0);
    }

    /// Notes bounds of a number, and of what it is made of.
    fn bounded(&self, term: Term, low: i128, high: i128, facts: &mut Vec<Fact>, depth: u32) {
        facts.push(Fact { term, low, high });
        let terms = &self.system.terms;
        let Node::Apply(operation, operands) = terms.node(term) else {
            return;
        };
        if depth > 8 {
            return;
        }
        let of = |term: Term| self.terms[Terms::index(term)];
        match (*operation, &**operands) {
            (Operation::Convert(_, to) | Operation::Reinterpret(_, to), &[inner])
                if to != Elementary::Bool && of(inner).is_of(to) =>
            {
                self.bounded(inner, low, high, facts, depth + 1);
            }
            (Operation::Add(to), &[left, right]) => {
                let (one, other) = (of(left), of(right));
                let sum = Extent::new(one.low + other.low, one.high + other.high);
                if other.low == other.high && sum.is_of(to) {
                    self.bounded(left, low - other.low, high - other.low, facts, depth + 1);
                }
            }
            (Operation::Subtract(to), &[left, right]) => {
                let (one, other) = (of(left), of(right));
                let difference = Extent::new(one.low - other.high, one.high - other.low);
                if other.low == other.high && difference.is_of(to) {
                    self.bounded(left, low + other.low, high + other.low, facts, depth + 1);
                }
            }
            _ => {}
        }
    }

    fn refined(&self, term: Term, facts: &mut Vec<Fact>, looks: &mut u32, depth: u32) -> Extent {
        let mut known = self.terms[Terms::index(term)];
        let terms = &self.system.terms;
        let of = terms.of(term);
        if of.is_real() || known.low == known.high {
            return known;
        }
        for fact in facts.iter().filter(|fact| fact.term == term) {
            known = known.within(fact.low, fact.high);
        }
        if depth > 16 || *looks == 0 {
            return known;
        }
        *looks -= 1;
        let again = match terms.node(term) {
            Node::Apply(operation, operands) if !matches!(operation, Operation::Compare(..)) => {
                let mut inner = Vec::with_capacity(operands.len());
                for &operand in operands {
                    inner.push(self.refined(operand, facts, looks, depth + 1));
                }
                applied(*operation, of, &inner)
            }
            Node::Choose([condition, then, otherwise]) => {
                // A fact such as `0 to 1`, which two BOOLs that are equal have, decides nothing.
                let of_condition = facts.iter().filter(|fact| fact.term == *condition);
                let is = of_condition
                    .fold((0, 1), |(low, high), fact| (fact.low.max(low), fact.high.min(high)));
                match is {
                    (0, 0) => self.refined(*otherwise, facts, looks, depth + 1),
                    (1, 1) => self.refined(*then, facts, looks, depth + 1),
                    _ => {
                        let count = facts.len();
                        let sides = [(true, then), (false, otherwise)].map(|(is, side)| {
                            self.facts(*condition, is, facts, 0);
                            let refined = (!self.is_contradicted(&facts[count..]))
                                .then(|| self.refined(*side, facts, looks, depth + 1));
                            facts.truncate(count);
                            refined
                        });
                        match either(sides) {
                            Some(extent) => extent,
                            None => return known,
                        }
                    }
                }
            }
            _ => return known,
        };
        let unit = known.unit;
        let met = known.within(again.low, again.high);
        if met.low == met.high { met } else { Extent { unit: unit.max(again.unit), ..met } }
    }
}

/// The extent of a selection from those of its sides, of which one may never be taken.
fn either(sides: [Option<Extent>; 2]) -> Option<Extent> {
    match sides {
        [Some(then), Some(otherwise)] => Some(then.joined(otherwise)),
        [one, other] => one.or(other),
    }
}
