//! Moments: variables that hold `TIME()` of a scan, such as the start of a timer.
//!
//! A moment grows with every scan; the time since it does not have to. Where a program asks for nothing but whether this time has
//! reached a bound, the time is counted up to the bound, and the program has finitely many states.

use std::collections::{HashMap, HashSet};

use understudy_typed::{Comparison, Elementary, Operation, Program};

use super::scan::{Scan, Scanned};
use crate::System;
use crate::execute::Unsupported;
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
    most: i64,
}

impl System {
    /// Scans a program again with the times since its moments in place of the moments, as far as they can be counted.
    pub(super) fn scan_with_ages(
        &mut self,
        scan: &Scan<'_>,
        scanned: Scanned,
        numbers: &mut HashMap<u64, u32>,
    ) -> Result<(Scanned, HashMap<u64, Age>), Unsupported> {
        let mut ages = HashMap::new();
        for address in self.moments(scan, &scanned, numbers) {
            let name = format!("{}.age", self.cells[numbers[&address] as usize].name);
            let cell = self.cell(name, Elementary::Time, 0);
            ages.insert(address, Age { cell, most: 0 });
        }
        if ages.is_empty() {
            return Ok((scanned, ages));
        }
        loop {
            let again = Scan { ages: &ages, ..*scan };
            let scanned = self.scan(&again, numbers)?;
            let mut counted = HashMap::new();
            for (&address, age) in &ages {
                if let Some(most) = self.most(scan, &scanned, &ages, address) {
                    counted.insert(address, Age { most, ..*age });
                }
            }
            let all = counted.len() == ages.len();
            ages = counted;
            if all {
                return Ok((scanned, ages));
            }
        }
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
        address: u64,
        stopped: Option<Term>,
    ) -> Term {
        let before = self.age(age, stopped);
        let period = self.terms.constant(Elementary::Time, program.period as u64);
        let most = self.terms.constant(Elementary::Time, age.most as u64);
        let is_full = self.terms.compare(Comparison::GreaterOrEqual, before, most);
        let add = Operation::Add(Elementary::Time);
        let more = self.terms.apply(add, Elementary::Time, &[before, period]);
        let more = self.terms.choose(is_full, most, more);
        match scanned.memory.get(&address) {
            Some(&moment) => self.since(moment, scanned.elapsed, (period, more)),
            None => more,
        }
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

    /// The time from which on nothing changes that the program asks of the time since a moment.
    fn most(
        &mut self,
        scan: &Scan<'_>,
        scanned: &Scanned,
        ages: &HashMap<u64, Age>,
        address: u64,
    ) -> Option<i64> {
        let age = self.age(*ages.get(&address)?, scan.stopped);
        let mut pending = vec![scanned.faulted];
        for (other, &value) in &scanned.memory {
            let own = ages.get(other).map(|&own| self.age(own, scan.stopped));
            let mut found = Vec::new();
            let is_moment = own.is_some_and(|own| {
                self.conditions(value, scanned.elapsed, own, &mut found).is_some()
            });
            match is_moment {
                true => pending.append(&mut found),
                false if *other == address => return None,
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
                Node::Apply(_, operands) => {
                    if operands.iter().any(|operand| carries.contains(operand)) {
                        return None;
                    }
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
        let period = scan.program.period.max(1);
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
                let initial = self.cells[cell as usize].initial as i64;
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
