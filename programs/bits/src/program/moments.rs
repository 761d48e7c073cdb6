//! Moments: variables that hold `TIME()` of a scan, such as the start of a timer.
//!
//! A moment grows with every scan; the time since it does not have to. Where a program asks for nothing but whether this time has
//! reached a bound, the time is counted up to the bound, and the program has finitely many states. The same holds for `TIME()` itself, and for a
//! TIME to which a program adds at most a period in a scan.

use std::collections::{HashMap, HashSet};

use understudy_typed::{Comparison, Elementary, Operation, Program};

use super::scan::{Scan, Scanned};
use crate::System;
use crate::execute::Unsupported;
use crate::execute::timers::Timers;
use crate::system::Holds;
use crate::term::{Node, Term, Terms, Variable};

/// Selections inside each other that are looked through.
const DEPTH: u32 = 64;
/// Terms that are looked at for the greatest value of one.
const LOOKS: u32 = 2_000;

/// The time since a moment.
#[derive(Debug, Clone, Copy)]
pub(super) struct Age {
    /// Its cell.
    pub(super) cell: u32,
    /// Where it stops: past it no answer changes.
    pub(super) most: i64,
}

impl System {
    /// Scans a program again with the times since its moments in place of the moments, as far as they can be counted.
    pub(super) fn scan_with_ages(
        &mut self,
        scan: &Scan<'_>,
        scanned: Scanned,
        numbers: &mut HashMap<u64, u32>,
        timers: &mut Timers,
    ) -> Result<(Scanned, HashMap<u64, Age>), Unsupported> {
        let mut ages = HashMap::new();
        for address in self.moments(scan, &scanned, numbers) {
            let name = format!("{}.age", self.cells[numbers[&address] as usize].name);
            let cell = self.cell(name, Elementary::Time, 0);
            self.cells[cell as usize].holds = Holds::Age(address);
            ages.insert(address, Age { cell, most: 0 });
        }
        if ages.is_empty() {
            return Ok((scanned, ages));
        }
        loop {
            let again = Scan { ages: &ages, ..*scan };
            let scanned = self.scan(&again, numbers, timers)?;
            let mut counted = HashMap::new();
            for (&address, age) in &ages {
                let carrier = Carrier::Age(address, self.age(*age, scan.stopped));
                if let Some(most) = self.most(scan, &scanned, &ages, carrier) {
                    counted.insert(address, Age { most, ..*age });
                }
            }
            let all = counted.len() == ages.len();
            ages = counted;
            if all {
                for (&address, age) in &mut ages {
                    let least = self.least.get(&(scan.prefix.to_owned(), address));
                    age.most = age.most.max(least.copied().unwrap_or(0));
                }
                return Ok((scanned, ages));
            }
        }
    }

    /// Scans a program again with a `TIME()` that is counted up to the last bound that it is compared with, where there is one. The scan is one of a
    /// program that no fault stops.
    pub(super) fn scan_with_clock(
        &mut self,
        scan: &Scan<'_>,
        scanned: Scanned,
        ages: &HashMap<u64, Age>,
        numbers: &mut HashMap<u64, u32>,
        timers: &mut Timers,
    ) -> Result<(Scanned, Option<Age>), Unsupported> {
        let elapsed = scanned.elapsed;
        let is_compared = |term: Term| match self.terms.node(term) {
            Node::Apply(Operation::Compare(..), operands) => operands.contains(&elapsed),
            _ => false,
        };
        let mut terms = (0..self.terms.len()).map(|place| self.terms.at(place));
        if scan.stopped.is_some() || !terms.any(is_compared) {
            return Ok((scanned, None));
        }
        let cell = self.cell(format!("{}TIME()", scan.prefix), Elementary::Time, 0);
        self.cells[cell as usize].holds = Holds::Clock;
        let clock = self.cells[cell as usize].term;
        let again = self.scan(&Scan { ages, clock: Some(clock), ..*scan }, numbers, timers)?;
        match self.most(scan, &again, ages, Carrier::Clock(clock)) {
            Some(most) => Ok((again, Some(Age { cell, most }))),
            None => Ok((scanned, None)),
        }
    }

    /// TIMEs that a scan adds to, with the value at which each stops: past it no answer changes. The scan is one of a program that no fault stops.
    pub(super) fn sums(
        &mut self,
        scan: &Scan<'_>,
        scanned: &Scanned,
        ages: &HashMap<u64, Age>,
        numbers: &HashMap<u64, u32>,
    ) -> HashMap<u64, i64> {
        let outputs = scan.program.outputs.iter();
        let outputs: HashSet<u64> = outputs.map(|point| 64 * u64::from(point.slot)).collect();
        let mut sums = HashMap::new();
        for (&address, &number) in numbers {
            let cell = &self.cells[number as usize];
            let (of, sum) = (cell.of, cell.term);
            if scan.stopped.is_none()
                && of == Elementary::Time
                && cell.initial as i64 >= 0
                && !outputs.contains(&address)
                && !ages.contains_key(&address)
                && let Some(&next) = scanned.memory.get(&address)
                && self.added(next, sum, scan.program.period, &mut Vec::new()) == Some(true)
                && let Some(most) = self.most(scan, scanned, ages, Carrier::Sum(address, sum))
            {
                let least = self.least.get(&(scan.prefix.to_owned(), address));
                sums.insert(address, most.max(least.copied().unwrap_or(0)));
            }
        }
        sums
    }

    /// A sum that stops at a value.
    pub(super) fn stopped_at(&mut self, sum: Term, most: i64) -> Term {
        let most = self.terms.constant(Elementary::Time, most as u64);
        let is_past = self.terms.compare(Comparison::GreaterOrEqual, sum, most);
        self.terms.choose(is_past, most, sum)
    }

    /// Whether something is added to a sum for its next value, and what that depends on; nothing where it is not itself, a constant or one of them
    /// with something added to it.
    fn added(&self, next: Term, own: Term, period: i64, found: &mut Vec<Term>) -> Option<bool> {
        if next == own {
            return Some(false);
        }
        match self.terms.node(next) {
            Node::Constant(stored) => (*stored as i64 >= 0).then_some(false),
            &Node::Choose([condition, then, otherwise]) => {
                found.push(condition);
                let then = self.added(then, own, period, found)?;
                Some(self.added(otherwise, own, period, found)? || then)
            }
            // Times are added as whole numbers.
            Node::Apply(Operation::Reinterpret(..), operands) => {
                self.added(operands[0], own, period, found)
            }
            Node::Apply(Operation::Add(Elementary::Time | Elementary::Lint), operands) => {
                let sides = [(operands[0], operands[1]), (operands[1], operands[0])];
                let mut sides = sides.into_iter().filter(|side| self.is_step(side.1, period));
                self.added(sides.next()?.0, own, period, found).map(|_| true)
            }
            _ => None,
        }
    }

    /// Whether a term is a constant from 0 to a period: what is added in each scan takes as long as `TIME()` until it wraps.
    fn is_step(&self, term: Term, period: i64) -> bool {
        matches!(self.terms.node(term), Node::Constant(stored) if (0..=period).contains(&(*stored as i64)))
    }

    /// The time since a moment at the beginning of a scan: 0 where the program restarts.
    pub(super) fn age(&mut self, age: Age, stopped: Option<Term>) -> Term {
        let cell = self.cells[age.cell as usize].term;
        match stopped {
            Some(stopped) => {
                let zero = self.terms.constant(Elementary::Time, 0);
                self.terms.choose(stopped, zero, cell)
            }
            None => cell,
        }
    }

    /// The time since a moment at the beginning of the next scan.
    pub(super) fn next_age(
        &mut self,
        program: &Program,
        scanned: &Scanned,
        age: Age,
        address: Option<u64>,
        stopped: Option<Term>,
    ) -> Term {
        let before = self.age(age, stopped);
        let period = self.terms.constant(Elementary::Time, program.period as u64);
        let most = self.terms.constant(Elementary::Time, age.most as u64);
        let is_full = self.terms.compare(Comparison::GreaterOrEqual, before, most);
        let add = Operation::Add(Elementary::Time);
        let more = self.terms.apply(add, Elementary::Time, &[before, period]);
        let more = self.terms.choose(is_full, most, more);
        match address.and_then(|address| scanned.memory.get(&address)) {
            Some(&moment) => self.since(moment, scanned.elapsed, (period, more)),
            None => more,
        }
    }

    /// A moment after a scan that follows the time since it: that of the scan, or what it was.
    pub(super) fn moment(&mut self, next: Term, scanned: &Scanned, both: (Term, Term)) -> Term {
        self.since(next, scanned.elapsed, both)
    }

    /// A moment as the time since it: `now` where it is the scan's own, else what it was.
    fn since(&mut self, moment: Term, elapsed: Term, (now, kept): (Term, Term)) -> Term {
        match *self.terms.node(moment) {
            Node::Choose([condition, then, otherwise]) => {
                let then = self.since(then, elapsed, (now, kept));
                let otherwise = self.since(otherwise, elapsed, (now, kept));
                self.terms.choose(condition, then, otherwise)
            }
            _ if moment == elapsed => now,
            _ => kept,
        }
    }

    /// Addresses of TIMEs that hold `TIME()` of a scan, this one's or what they held, and that begin as 0.
    fn moments(&self, scan: &Scan<'_>, scanned: &Scanned, numbers: &HashMap<u64, u32>) -> Vec<u64> {
        let outputs = scan.program.outputs.iter();
        let outputs: Vec<u64> = outputs.map(|point| 64 * u64::from(point.slot)).collect();
        let mut found: Vec<u64> = Vec::new();
        for (&address, &moment) in &scanned.memory {
            let Some(&number) = numbers.get(&address) else {
                continue;
            };
            let cell = &self.cells[number as usize];
            let is_right = cell.of == Elementary::Time
                && cell.initial == 0
                && self.terms.value(moment).is_none()
                && !outputs.contains(&address)
                && self.is_moment(moment, scanned.elapsed, cell.term, DEPTH);
            if is_right {
                found.push(address);
            }
        }
        found.sort_unstable();
        found
    }

    fn is_moment(&self, term: Term, elapsed: Term, before: Term, depth: u32) -> bool {
        match *self.terms.node(term) {
            _ if term == elapsed || term == before => true,
            // Where a program restarts, it is the first scan.
            Node::Constant(0) => true,
            Node::Choose([_, then, otherwise]) => {
                depth > 0
                    && self.is_moment(then, elapsed, before, depth - 1)
                    && self.is_moment(otherwise, elapsed, before, depth - 1)
            }
            _ => false,
        }
    }

    /// The time from which on nothing changes that the program asks of a time that grows.
    fn most(
        &mut self,
        scan: &Scan<'_>,
        scanned: &Scanned,
        ages: &HashMap<u64, Age>,
        carrier: Carrier,
    ) -> Option<i64> {
        let period = scan.program.period.max(1);
        let (age, own_address, is_sum) = match carrier {
            Carrier::Age(address, age) => (age, Some(address), false),
            Carrier::Clock(clock) => (clock, None, false),
            Carrier::Sum(address, sum) => (sum, Some(address), true),
        };
        let mut pending = vec![scanned.faulted];
        for (other, &value) in &scanned.memory {
            if is_sum && own_address == Some(*other) {
                self.added(value, age, period, &mut pending)?;
                continue;
            }
            let own = ages.get(other).map(|&own| self.age(own, scan.stopped));
            let mut found = Vec::new();
            let is_moment = own.is_some_and(|own| {
                self.conditions(value, scanned.elapsed, own, &mut found).is_some()
            });
            match is_moment {
                true => pending.append(&mut found),
                false if own_address == Some(*other) => return None,
                false => pending.push(value),
            }
        }
        let roots = pending.clone();
        let mut is_reached = vec![false; self.terms.len()];
        let mut first = self.terms.len();
        while let Some(term) = pending.pop() {
            let place = Terms::index(term);
            if std::mem::replace(&mut is_reached[place], true) || term == age {
                continue;
            }
            first = first.min(place);
            match self.terms.node(term) {
                Node::Apply(_, operands) => pending.extend(operands.iter()),
                Node::Choose(parts) => pending.extend(parts),
                Node::Constant(_) | Node::Variable(_) | Node::Unknown(_) => {}
            }
        }
        // Operands stand first, so what carries the time further is known before it is used.
        let mut carries = HashSet::from([age]);
        let mut most = 0_i64;
        for (place, &is_reached) in is_reached.iter().enumerate().skip(first) {
            let term = self.terms.at(place);
            if !is_reached || term == age {
                continue;
            }
            match self.terms.node(term) {
                Node::Apply(Operation::Compare(comparison, _), operands) => {
                    let is = [0, 1].map(|side| carries.contains(&operands[side]));
                    let (comparison, other) = match is {
                        [false, false] => continue,
                        [true, false] => (*comparison, operands[1]),
                        [false, true] => (comparison.mirrored(), operands[0]),
                        [true, true] => return None,
                    };
                    let bound = self.bound(other, scanned, &mut Open::default())?;
                    most = most.max(needed(comparison, bound)?);
                }
                Node::Apply(operation, operands) => {
                    if !operands.iter().any(|operand| carries.contains(operand)) {
                        continue;
                    }
                    let grows = match operation {
                        Operation::Add(Elementary::Time | Elementary::Lint) => {
                            operands.iter().any(|&term| self.is_step(term, period))
                        }
                        Operation::Reinterpret(_, to) => {
                            matches!(to, Elementary::Time | Elementary::Lint)
                        }
                        _ => false,
                    };
                    if !is_sum || !grows {
                        return None;
                    }
                    carries.insert(term);
                }
                &Node::Choose([condition, then, otherwise]) => {
                    for (value, side) in [(true, then), (false, otherwise)] {
                        if !carries.contains(&side) {
                            continue;
                        }
                        match self.implied(condition, value, side, scanned, DEPTH) {
                            Some(bound) => most = most.max(bound),
                            None => {
                                carries.insert(term);
                            }
                        }
                    }
                }
                Node::Constant(_) | Node::Variable(_) | Node::Unknown(_) => {}
            }
        }
        if roots.iter().any(|root| carries.contains(root)) {
            // A use that no comparison bounds.
            return None;
        }
        most.max(period).checked_add(period - 1).map(|most| most / period * period)
    }

    /// What the value of a moment depends on; nothing where it is neither this scan's nor what it was.
    fn conditions(
        &self,
        moment: Term,
        elapsed: Term,
        own: Term,
        found: &mut Vec<Term>,
    ) -> Option<()> {
        if moment == elapsed {
            return Some(());
        }
        match self.terms.node(moment) {
            &Node::Choose([condition, then, otherwise]) => {
                found.push(condition);
                self.conditions(then, elapsed, own, found)?;
                self.conditions(otherwise, elapsed, own, found)
            }
            Node::Apply(Operation::Subtract(Elementary::Time), operands) => {
                (operands[0] == elapsed && operands[1] == own).then_some(())
            }
            _ => None,
        }
    }

    /// The greatest value of a TIME that is one of some constants, in this scan or in those before it.
    fn bound(&self, term: Term, scanned: &Scanned, open: &mut Open) -> Option<i64> {
        open.looks = open.looks.checked_sub(1)?;
        match *self.terms.node(term) {
            Node::Constant(stored) => Some(stored as i64),
            Node::Choose([_, then, otherwise]) => {
                let then = self.bound(then, scanned, open)?;
                Some(then.max(self.bound(otherwise, scanned, open)?))
            }
            Node::Variable(Variable::Cell(cell)) => {
                let initial = self.greatest_at_first(cell)?;
                match scanned.written.get(&cell) {
                    Some(_) if open.cells.contains(&cell) => Some(initial),
                    Some(&written) => {
                        open.cells.push(cell);
                        let written = self.bound(written, scanned, open);
                        open.cells.pop();
                        Some(initial.max(written?))
                    }
                    None => Some(initial),
                }
            }
            _ => None,
        }
    }

    /// The greatest number that a cell begins with.
    fn greatest_at_first(&self, cell: u32) -> Option<i64> {
        let cell = &self.cells[cell as usize];
        match cell.holds {
            Holds::Value(address, of) => self.begins.greatest(address, of, cell.initial),
            _ => Some(cell.initial as i64),
        }
    }

    /// An upper bound of the time since a moment where a condition is so.
    fn implied(
        &self,
        condition: Term,
        value: bool,
        age: Term,
        scanned: &Scanned,
        depth: u32,
    ) -> Option<i64> {
        let Node::Apply(operation, operands) = self.terms.node(condition) else {
            return None;
        };
        let depth = depth.checked_sub(1)?;
        match (*operation, &**operands) {
            (Operation::Not(_), &[inner]) => self.implied(inner, !value, age, scanned, depth),
            (Operation::And(Elementary::Bool), &[left, right]) if value => {
                let left = self.implied(left, value, age, scanned, depth);
                left.or_else(|| self.implied(right, value, age, scanned, depth))
            }
            (Operation::Or(Elementary::Bool), &[left, right]) if !value => {
                let left = self.implied(left, value, age, scanned, depth);
                left.or_else(|| self.implied(right, value, age, scanned, depth))
            }
            (Operation::Compare(comparison, Elementary::Time), &[left, right]) => {
                let comparison = if value { comparison } else { comparison.opposite() };
                let (comparison, other) = match (left == age, right == age) {
                    (true, false) => (comparison, right),
                    (false, true) => (comparison.mirrored(), left),
                    _ => return None,
                };
                let below = matches!(
                    comparison,
                    Comparison::Less | Comparison::LessOrEqual | Comparison::Equal
                );
                let bound = self.bound(other, scanned, &mut Open::default())?;
                below.then(|| needed(comparison, bound)).flatten()
            }
            _ => None,
        }
    }
}

/// What carries a time that grows.
#[derive(Debug, Clone, Copy)]
enum Carrier {
    /// The time since the moment at an address.
    Age(u64, Term),
    /// `TIME()`.
    Clock(Term),
    /// The TIME at an address, to which the program adds.
    Sum(u64, Term),
}

/// Cells whose greatest value is being sought, and how many terms may still be looked at.
struct Open {
    cells: Vec<u32>,
    looks: u32,
}

impl Default for Open {
    fn default() -> Self {
        Self { cells: Vec::new(), looks: LOOKS }
    }
}

/// Up to where a time has to be counted for a comparison with a bound.
fn needed(comparison: Comparison, bound: i64) -> Option<i64> {
    match comparison {
        Comparison::GreaterOrEqual | Comparison::Less => Some(bound),
        _ => bound.checked_add(1),
    }
}
