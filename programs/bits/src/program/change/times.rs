//! Times that a new program takes over: where the old one counts them in another way, what it has is still known as a number.

use understudy_typed::{Elementary, Operation, Program};

use super::{Begun, Side};
use crate::System;
use crate::system::Holds;
use crate::term::{Node, Term, Variable};

impl System {
    /// Where the cell of a term stops, if it does.
    pub(super) fn most_of(&self, term: Term) -> Option<i64> {
        match self.terms.node(term) {
            Node::Variable(Variable::Cell(cell)) => self.most.get(cell).copied(),
            _ => None,
        }
    }

    /// Whether the cell of a term counts a time as far as another one does.
    pub(super) fn reaches(&self, term: Term, most: Option<i64>) -> bool {
        match (self.most_of(term), most) {
            (None, _) => true,
            (Some(_), None) => false,
            (Some(counted), Some(most)) => counted >= most,
        }
    }

    pub(super) fn up_to(&mut self, time: Term, most: Option<i64>) -> Term {
        match most {
            Some(most) => self.stopped_at(time, most),
            None => time,
        }
    }

    /// `TIME()` of the old program, up to where a cell of the new one stops.
    pub(super) fn time(&mut self, old: &Side<'_>, most: Option<i64>) -> Begun {
        let stops = !self.terms.is(self.cells[old.cells.start as usize].next, false);
        let (Some(most), false) = (most, stops) else {
            let now = self.elapsed(old)?;
            return Ok(self.in_scans(old.program, now, most));
        };
        let cell = self.cell("time".to_owned(), Elementary::Time, 0);
        let time = self.cells[cell as usize].term;
        let period = self.terms.constant(Elementary::Time, old.program.period as u64);
        let add = Operation::Add(Elementary::Time);
        let more = self.terms.apply(add, Elementary::Time, &[time, period]);
        self.cells[cell as usize].next = self.stopped_at(more, most);
        Ok(time)
    }

    /// The same as a number, which has no end.
    fn elapsed(&mut self, old: &Side<'_>) -> Begun {
        let scans = self.held(old, |holds| matches!(holds, Holds::Scans))?;
        Ok(self.time_since_start(old.program, scans))
    }

    /// The time since what the old program has at an address, where it does not count that time.
    pub(super) fn time_since(&mut self, old: &Side<'_>, address: u64, most: Option<i64>) -> Begun {
        let is_value =
            |holds: &Holds| matches!(holds, Holds::Value(at, Elementary::Time) if *at == address);
        let is_moment = |holds: &Holds| matches!(holds, Holds::Uncounted(at) if *at == address);
        let now = self.elapsed(old)?;
        let Ok(value) = self.held(old, is_value) else {
            // Nothing in the old program reads or writes it.
            let stored = old.program.initial_state()[(address / 64) as usize];
            return match stored {
                0 => self.time(old, most),
                _ => Err("is kept by the old program in another way"),
            };
        };
        let since = Operation::Subtract(Elementary::Time);
        let age = self.terms.apply(since, Elementary::Time, &[now, value]);
        match self.held(old, is_moment) {
            Ok(_) => Ok(self.in_scans(old.program, age, most)),
            // It may be a time to come.
            Err(_) => Ok(self.up_to(age, most)),
        }
    }

    /// A time of whole scans from 0 on, up to where a cell stops: as a multiple of the period, which takes few bits.
    fn in_scans(&mut self, program: &Program, time: Term, most: Option<i64>) -> Term {
        let of = Elementary::Time;
        let zero = self.terms.constant(of, 0);
        let time = self.terms.apply(Operation::Maximum(of), of, &[time, zero]);
        let time = self.up_to(time, most);
        let period = self.terms.constant(of, program.period.max(1) as u64);
        let scans = self.terms.apply(Operation::Divide(of), of, &[time, period]);
        self.terms.apply(Operation::Multiply(of), of, &[scans, period])
    }
}
