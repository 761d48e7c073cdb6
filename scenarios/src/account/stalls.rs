//! Cycles in which the host itself stood still, with the evidence.
//!
//! A held output is no failure of the cluster where the machine under it did not run. Evidence is a member
//! that was woken later than it had asked for; what a scenario does to a member itself (stop, crash) is none.

use std::collections::{BTreeMap, BTreeSet};
use std::time::Duration;

use schemars::JsonSchema;
use serde::Serialize;
use understudy_simulator::Action;
use understudy_wire::Member;

use understudy_journal::Process;

/// One wake-up that came too late.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, JsonSchema)]
pub struct Stall {
    /// The cycle, counted from the origin.
    pub cycle: u64,
    /// Who was woken too late.
    pub name: String,
    /// By how many microseconds.
    pub late_us: u64,
}

/// Stalls that are listed, at most; all are counted.
const MAXIMUM_LISTED: usize = 200;

/// Cycles before and after a stall that it may explain.
const REACH_CYCLES: i64 = 1;

/// Cycles after a step of the scenario for which a late wake-up of that member is the step's own doing.
const OWN_DOING_CYCLES: i64 = 5;

#[derive(Debug, Clone, Default)]
pub(crate) struct Stalls {
    /// Numbers of cycles that are explained, the newest few thousand.
    explained: BTreeSet<i64>,
    /// Members that the scenario has stopped, crashed or slowed down, and when it let them go on.
    disturbed: BTreeMap<Member, Option<i64>>,
    pub(crate) listed: Vec<(i64, Member, Duration)>,
    pub(crate) count: u64,
}

impl Stalls {
    pub(crate) fn step(&mut self, number: i64, member: Member, action: Action) {
        let is_undisturbed = match action {
            Action::Slow { by } => by.is_zero(),
            _ => match Process::after(action) {
                Some(process) => process.is_running(),
                None => return,
            },
        };
        let until = is_undisturbed.then_some(number + OWN_DOING_CYCLES);
        self.disturbed.insert(member, until);
    }

    /// `member` was woken too late in the cycle with this number.
    pub(crate) fn stalled(
        &mut self,
        number: i64,
        member: Member,
        late: Duration,
        period: Duration,
    ) {
        match self.disturbed.get(&member) {
            Some(None) => return,
            Some(Some(until)) if number <= *until => return,
            _ => {}
        }
        self.count += 1;
        if self.listed.len() < MAXIMUM_LISTED {
            self.listed.push((number, member, late));
        }
        let cycles = late.as_nanos() / period.as_nanos().max(1);
        let reach = REACH_CYCLES + i64::try_from(cycles).unwrap_or(1000).min(1000);
        for cycle in number - reach..=number + reach {
            self.explained.insert(cycle);
        }
        while self.explained.len() > 4096 {
            self.explained.pop_first();
        }
    }

    pub(crate) fn explains(&self, number: i64) -> bool {
        self.explained.contains(&number)
    }
}
