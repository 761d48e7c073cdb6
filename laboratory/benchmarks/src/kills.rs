//! `understudy-bench kills`: every role of a cluster killed or suspended at random phases of the cycle, on processes.

use std::fmt::Write as _;
use std::path::PathBuf;

use clap::Args;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use serde::Serialize;
use understudy::{Answer, ClusterRun, Console, RunArguments, Status};
use understudy_cycle::Schedule;
use understudy_scenarios::{Action, Expectation, Fault, Scenario, Summary};
use understudy_wire::{Member, ProgramId, StationId};

/// Kill or suspend every role of a cluster at random phases
#[derive(Debug, Args)]
pub(crate) struct Arguments {
    /// Cluster file; the press cell where absent
    #[arg(value_name = "CLUSTER.toml")]
    cluster: Option<PathBuf>,
    /// Kills of each role: controllers, understudies, remote I/Os
    #[arg(long, alias = "kills", default_value_t = 100)]
    count: u64,
    /// Suspend for this number of cycles (SIGSTOP) in place of kill, such as 0.5,5,500
    #[arg(long, value_name = "CYCLES", value_delimiter = ',')]
    stop: Vec<f64>,
    /// Seed of the phases
    #[arg(long, default_value_t = 1)]
    seed: u64,
    #[command(flatten)]
    run: RunArguments,
}

/// Cycles from the end of one trouble to the next: enough for a station to be synchronised again.
const RECOVERY_CYCLES: f64 = 40.0;
/// Cycles from a kill to the restart.
const DOWN_CYCLES: f64 = 20.0;

/// Trouble of a member.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Trouble {
    /// It is killed, and started again 20 cycles later.
    Kill,
    /// It is suspended (SIGSTOP) for this number of cycles.
    Stop(f64),
}

/// The members that it happens to, one after the other.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Target {
    /// The controllers.
    Controllers,
    /// The understudies.
    Understudies,
    /// The remote I/Os.
    RemoteIos,
    /// The controllers and the understudies.
    Stations,
}

impl Target {
    /// Each role.
    const ROLES: [Self; 3] = [Self::Controllers, Self::Understudies, Self::RemoteIos];

    fn members(self, schedule: &Schedule) -> Vec<Member> {
        let controllers = schedule.controllers() as u8;
        let stations =
            |ranks: std::ops::Range<u8>| ranks.map(|rank| Member::Station(StationId(rank)));
        match self {
            Self::Controllers => stations(0..controllers).collect(),
            Self::Understudies => stations(controllers..schedule.stations() as u8).collect(),
            Self::Stations => stations(0..schedule.stations() as u8).collect(),
            Self::RemoteIos => {
                (0..controllers).map(|program| Member::RemoteIo(ProgramId(program))).collect()
            }
        }
    }

    fn words(self) -> &'static str {
        match self {
            Self::Controllers => "controllers",
            Self::Understudies => "understudies",
            Self::RemoteIos => "remote I/Os",
            Self::Stations => "stations",
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
    /// While a remote I/O is down its plant is not driven, so only for stations is it expected that nothing is held.
    pub(crate) fn scenario(
        self,
        target: Target,
        schedule: &Schedule,
        count: u64,
        seed: u64,
    ) -> Scenario {
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
                steps.push(Fault { at_cycle: at as u64, phase: at.fract(), member, action });
            }
        }
        let stations = target != Target::RemoteIos;
        Scenario {
            title: format!("{count} {} {}, from seed {seed}", target.words(), self.words()),
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

/// Result of the troubles of one kind, for one role.
#[derive(Debug, Serialize)]
struct Row {
    link: String,
    directory: String,
    trouble: String,
    target: &'static str,
    count: u64,
    /// Wrong outputs.
    wrong: u64,
    /// Cycles, over all remote I/Os, with the last true output.
    held: u64,
    /// Cycles with the fail-safe output.
    fail_safe: u64,
    /// Cycles in which the remote I/O was down.
    missed: u64,
    /// Held and fail-safe cycles during host stalls.
    by_stall: u64,
    /// Whether the run was complete and met what was expected.
    passed: bool,
    /// What was expected and not found, with what was found.
    not_met: Vec<String>,
}

impl Row {
    fn new(
        trouble: Trouble,
        target: Target,
        count: u64,
        cell: &ClusterRun,
        summary: &Summary,
    ) -> Self {
        let total = summary.total();
        let not_met = summary.expectations.iter().filter(|it| !it.met);
        Self {
            link: summary.circumstances.link.clone(),
            directory: cell.path().display().to_string(),
            trouble: trouble.words(),
            target: target.words(),
            count,
            wrong: summary.violation_count,
            held: total.held,
            fail_safe: total.fail_safe,
            missed: total.missed,
            by_stall: total.held_by_stall + total.fail_safe_by_stall,
            passed: summary.passed,
            not_met: not_met.map(|it| format!("{}: {}", it.expected, it.found)).collect(),
        }
    }
}

pub(crate) fn run(arguments: &Arguments, console: &mut Console) -> Result<Answer, Answer> {
    let troubles: Vec<Trouble> = if arguments.stop.is_empty() {
        vec![Trouble::Kill]
    } else {
        arguments.stop.iter().copied().map(Trouble::Stop).collect()
    };
    let mut rows = Vec::new();
    for trouble in troubles {
        for target in Target::ROLES {
            rows.push(row(trouble, target, arguments, console)?);
        }
    }
    Ok(answer(&rows))
}

fn row(
    trouble: Trouble,
    target: Target,
    arguments: &Arguments,
    console: &mut Console,
) -> Result<Row, Answer> {
    let cell = match &arguments.cluster {
        Some(file) => ClusterRun::of_file(file.clone(), &arguments.run)?,
        None => ClusterRun::press_cell(&arguments.run)?,
    };
    let schedule = &cell.cluster.agreement().schedule;
    let scenario = trouble
        .scenario(target, schedule, arguments.count, arguments.seed)
        .shortened(arguments.run.cycles);
    console.note(&scenario.title);
    let (summary, judged) = cell.judged(&scenario, &arguments.run, console)?;
    match judged.failure {
        Some(failure) => Err(Answer::failed(Status::Failed, failure.code(), &failure)),
        None => Ok(Row::new(trouble, target, arguments.count, &cell, &summary)),
    }
}

fn answer(rows: &[Row]) -> Answer {
    let mut text = format!(
        "{:24} {:13} {:>6} {:>6} {:>6} {:>9} {:>8} {:>8}\n",
        "trouble", "of", "count", "wrong", "held", "fail-safe", "missed", "by stall"
    );
    for row in rows {
        let _ = writeln!(
            text,
            "{:24} {:13} {:>6} {:>6} {:>6} {:>9} {:>8} {:>8}{}",
            row.trouble,
            row.target,
            row.count,
            row.wrong,
            row.held,
            row.fail_safe,
            row.missed,
            row.by_stall,
            if row.passed { "" } else { "  FAILED" }
        );
        for reason in &row.not_met {
            let _ = writeln!(text, "    not met: {reason}");
        }
    }
    text.push_str(
        "cycles over all remote I/Os; a remote I/O that is down does not drive its plant\n",
    );
    let passed = rows.iter().all(|row| row.passed);
    let status = if passed { Status::Done } else { Status::Failed };
    Answer::done(text, rows).with_status(status)
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;

    #[test]
    fn troubles_come_one_at_a_time_and_to_everybody_in_turn() {
        let schedule = Schedule::new(Duration::from_millis(10), 2, 1, 1).expect("within bounds");
        for trouble in [Trouble::Kill, Trouble::Stop(0.5), Trouble::Stop(500.0)] {
            for target in Target::ROLES {
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
