//! Warm starts: a scan may begin with the initial values of all that is not retentive.
//!
//! ```text
//! x(i)                                    a cell of a retentive variable, and what counts scans since the cold start
//! power.returns ? initial(i) : x(i)       every other cell
//! power.returns ? TIME() : x(i)           the time since a moment that is not retentive: the moment is 0 again, and TIME() goes on
//! ```
//!
//! Every read of a cell is replaced so, in what the program writes and in what is observed. A circuit of the result has all runs of a program that is
//! restarted warm in any scans, and no others.

use std::collections::{BTreeMap, HashMap};

use understudy_typed::{Elementary, Program};

use super::moments::Age;
use crate::System;
use crate::system::Holds;
use crate::term::{Term, Variable};

/// The input that is TRUE in the first scan of a warm start.
pub const POWER_RETURNS: &str = "power.returns";

impl Holds {
    /// Whether a warm start keeps it.
    pub(crate) fn is_retentive(&self, program: &Program) -> bool {
        let retains = |address: u64| program.retains((address / 64) as u32);
        match self {
            Self::Value(address, _) | Self::Age(address) => retains(*address),
            Self::Count(counted) => retains(counted.start()),
            Self::Clock | Self::Scans | Self::Phase => program.is_retentive(),
            Self::Other | Self::Uncounted(_) | Self::Unused => false,
        }
    }
}

/// What a restart needs of a program.
pub(super) struct Restart<'a> {
    pub(super) prefix: &'a str,
    pub(super) program: &'a Program,
    /// The cells of the program.
    pub(super) cells: Vec<u32>,
    /// The times since moments.
    pub(super) ages: Vec<Age>,
    /// The time since the cold start, up to the greatest of the times since moments that are not retentive; where there is one.
    pub(super) time: Option<Age>,
}

impl System {
    /// A name that nothing of a program has.
    fn restart_name(&self, prefix: &str, program: &Program) -> String {
        let mut name = POWER_RETURNS.to_owned();
        while program.part(&name).is_some() || program.inputs.find(&name).is_some() {
            name.push('_');
        }
        format!("{prefix}{name}")
    }

    /// The time since the cold start that the times since moments need, where one of them is not retentive.
    pub(super) fn restart_time(
        &mut self,
        prefix: &str,
        program: &Program,
        ages: &HashMap<u64, Age>,
    ) -> Option<Age> {
        let lost = ages.iter().filter(|(address, _)| !program.retains((**address / 64) as u32));
        let most = lost.map(|(_, age)| age.most).max()?;
        let cell = self.cell(format!("{prefix}time"), Elementary::Time, 0);
        Some(Age { cell, most })
    }

    /// Lets a program be restarted in every scan: replaces what it reads of its cells, in their next values and in `roots`. The input that restarts it.
    pub(super) fn let_restart(&mut self, restart: &Restart<'_>, roots: &mut [&mut Term]) -> Term {
        let Restart { prefix, program, cells, ages, time } = restart;
        let name = self.restart_name(prefix, program);
        self.restarting.push(self.inputs.len() as u32);
        let restarts = self.input(name, Elementary::Bool, None);
        let most: HashMap<u32, i64> = ages.iter().map(|age| (age.cell, age.most)).collect();
        let time = time.map(|time| (time.cell, self.cells[time.cell as usize].term));
        let mut replaced: BTreeMap<Term, Term> = BTreeMap::new();
        for &number in cells {
            let cell = &self.cells[number as usize];
            let is_time = time.is_some_and(|(time, _)| time == number);
            if is_time || cell.holds.is_retentive(program) {
                continue;
            }
            let (term, of, initial) = (cell.term, cell.of, cell.initial);
            let begins = match (most.get(&number), time) {
                (Some(&most), Some((_, time))) => self.stopped_at(time, most),
                _ => self.terms.constant(of, initial),
            };
            let read = self.terms.choose(restarts, begins, term);
            replaced.insert(term, read);
        }
        let mut terms: Vec<Term> =
            cells.iter().map(|&cell| self.cells[cell as usize].next).collect();
        terms.extend(roots.iter().map(|root| **root));
        let variable = |variable: Variable, term: Term| match variable {
            Variable::Cell(_) => replaced.get(&term).copied().unwrap_or(term),
            Variable::Input(_) => term,
        };
        let terms = self.terms.replaced(&terms, variable);
        let (next, others) = terms.split_at(cells.len());
        for (&cell, &next) in cells.iter().zip(next) {
            self.cells[cell as usize].next = next;
        }
        for (root, &other) in roots.iter_mut().zip(others) {
            **root = other;
        }
        restarts
    }
}
