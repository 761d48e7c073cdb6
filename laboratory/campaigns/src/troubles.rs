//! Many troubles of one kind, one at a time, at random phases of the cycle: what a cluster has to bear without being seen to.

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use schemars::JsonSchema;
use serde::Serialize;
use understudy_cycle::Schedule;
use understudy_simulator::{Action, Fault};
use understudy_wire::{Member, ProgramId, StationId};

use understudy_scenarios::{Expectation, Scenario, Summary};

/// Cycles from the end of one trouble to the next: enough for a station to come back into step.
const RECOVERY_CYCLES: f64 = 40.0;
/// Cycles from a kill to the restart.
const DOWN_CYCLES: f64 = 20.0;

/// What happens to a member.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Trouble {
    /// It is killed, and started again 20 cycles later.
    Kill,
    /// It stands still (SIGSTOP) for so many cycles.
    Stop(f64),
}

/// To whom it happens, one after the other.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Target {
    /// The controllers.
    Controllers,
    /// The understudies.
    Understudies,
    /// The remote I/Os.
    RemoteIos,
}

impl Target {
    /// All roles.
    pub const ALL: [Self; 3] = [Self::Controllers, Self::Understudies, Self::RemoteIos];

    fn members(self, schedule: &Schedule) -> Vec<Member> {
        let controllers = schedule.controllers() as u8;
        let stations =
            |ranks: std::ops::Range<u8>| ranks.map(|rank| Member::Station(StationId(rank)));
        match self {
            Self::Controllers => stations(0..controllers).collect(),
            Self::Understudies => stations(controllers..schedule.stations() as u8).collect(),
            Self::RemoteIos => (0..controllers)
                .map(|program| Member::RemoteIo(ProgramId(program)))
                .collect(),
        }
    }

    fn words(self) -> &'static str {
        match self {
            Self::Controllers => "controllers",
            Self::Understudies => "understudies",
            Self::RemoteIos => "remote I/Os",
        }
    }
}

impl Trouble {
    fn words(self) -> String {
        match self {
            Self::Kill => "killed".to_owned(),
            Self::Stop(cycles) => format!("stopped for {cycles} cycles"),
        }
    }

    /// A scenario of `count` troubles of this kind.
    ///
    /// While a remote I/O is gone nobody drives its plant, so only for stations is it expected that nothing is held.
    pub fn scenario(self, target: Target, schedule: &Schedule, count: u64, seed: u64) -> Scenario {
        let members = target.members(schedule);
        let mut random = Pcg64Mcg::seed_from_u64(seed);
        let (lasts, begins, ends) = match self {
            Self::Kill => (DOWN_CYCLES, Action::Crash, Action::Restart),
            Self::Stop(cycles) => (cycles.max(0.0), Action::Stop, Action::Continue),
        };
        let every = (lasts + RECOVERY_CYCLES).ceil();
        let mut steps = Vec::new();
        for number in 0..count {
            let Some(&member) = members.get(number as usize % members.len().max(1)) else {
                break;
            };
            let begin = every * number as f64 + RECOVERY_CYCLES / 2.0 + random.random::<f64>();
            for (at, action) in [(begin, begins), (begin + lasts, ends)] {
                steps.push(Fault {
                    at_cycle: at as u64,
                    phase: at.fract(),
                    member,
                    action,
                });
            }
        }
        let stations = target != Target::RemoteIos;
        Scenario {
            title: format!(
                "{count} {} {}, from seed {seed}",
                target.words(),
                self.words()
            ),
            cycles: (every * count as f64 + RECOVERY_CYCLES) as u64,
            steps,
            expect: Expectation {
                held: stations.then_some(0),
                fail_safe: stations.then_some(0),
                ..Expectation::default()
            },
            ..Scenario::default()
        }
    }
}

/// What came of the troubles of one kind.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct TroubleRow {
    /// What happened.
    pub trouble: String,
    /// To whom.
    pub target: String,
    /// How often.
    pub count: u64,
    /// What must never be driven and was.
    pub wrong: u64,
    /// Cycles, over all remote I/Os, with the last true output.
    pub held: u64,
    /// Cycles with the fail-safe output.
    pub fail_safe: u64,
    /// Cycles in which the remote I/O was not there.
    pub missed: u64,
    /// Held and fail-safe cycles while the host itself stood still.
    pub by_stall: u64,
    /// Whether the run was whole and met what was expected.
    pub passed: bool,
}

impl TroubleRow {
    /// Of a run of [`Trouble::scenario`].
    pub fn new(trouble: Trouble, target: Target, count: u64, summary: &Summary) -> Self {
        let total = summary.total();
        Self {
            trouble: trouble.words(),
            target: target.words().to_owned(),
            count,
            wrong: summary.violation_count,
            held: total.held,
            fail_safe: total.fail_safe,
            missed: total.missed,
            by_stall: total.held_by_stall + total.fail_safe_by_stall,
            passed: summary.passed,
        }
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;

    #[test]
    fn troubles_come_one_at_a_time_and_to_everybody_in_turn() {
        let schedule = Schedule::new(Duration::from_millis(10), 2, 1, 1).expect("within bounds");
        for trouble in [Trouble::Kill, Trouble::Stop(0.5), Trouble::Stop(500.0)] {
            for target in Target::ALL {
                let scenario = trouble.scenario(target, &schedule, 6, 1);
                assert_eq!(scenario.steps.len(), 12);
                let time = |step: &Fault| step.at_cycle as f64 + step.phase;
                for two in scenario.steps.windows(2) {
                    assert!(time(&two[0]) < time(&two[1]), "{two:?}");
                }
                for pair in scenario.steps.chunks(2) {
                    assert_eq!(pair[0].member, pair[1].member);
                }
                let last = scenario.steps.last().expect("there are some");
                assert!(time(last) + RECOVERY_CYCLES / 2.0 < scenario.cycles as f64);
                let members: std::collections::BTreeSet<Member> =
                    scenario.steps.iter().map(|step| step.member).collect();
                assert_eq!(members.len(), target.members(&schedule).len());
            }
        }
    }
}
