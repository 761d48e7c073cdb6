//! `understudy demo`: the experiment of section V.B on processes.

use std::num::NonZeroU64;
use std::time::Duration;

use clap::Args;
use understudy_cluster::Cluster;
use understudy_journal::Members;
use understudy_scenarios::{TABLE_TWO, read};

use crate::answer::{Answer, Status};
use crate::console::Console;
use crate::inspect::watch::{BesideArguments, Page};
use crate::run::cluster_run::ClusterRun;
use crate::run::lab::RunArguments;
use crate::run::wakefulness;

/// Maximum duration of a demonstration, from its origin.
const LONGEST: Duration = Duration::from_secs(25);
/// Number of times that a demonstration is repeated at a longer period.
const LONGER_PERIODS: u32 = 2;
/// Number of cycles of Table II.
const TABLE_TWO_CYCLES: u32 = 1000;

/// Run the press cell of the paper and kill each station once
#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  understudy demo
  understudy demo --period 10ms
  understudy demo --link zenoh
  understudy demo --watch

Without --period the command measures the wake-up latency of this host for one second and selects the shortest of 10, 20, 50 and 100 ms
that the host keeps. The scenario is that of Table II: station 1 is killed at cycle 200 and restarted at 327, station 2 at 400 and 527,
station 3 at 600 and 727. At a period of 50 or 100 ms the numbers of cycles are halved or quartered: a demonstration takes at most 25 s.
If the host becomes too slow meanwhile, the demonstration is repeated at twice the period, at most twice.
With --watch the cluster keeps running after the scenario and accepts commands from the page until Ctrl-C.

Exit status: 0 if every plant stayed functional and no wrong output was applied; 3 if the host was too slow for a verdict.")]
pub(crate) struct Arguments {
    #[command(flatten)]
    run: RunArguments,
    #[command(flatten)]
    beside: BesideArguments,
}

pub(crate) fn run(arguments: &Arguments, console: &mut Console) -> Result<Answer, Answer> {
    let mut run = wakefulness::with_period(&arguments.run, console);
    let is_fixed = arguments.run.overrides.has_period() || arguments.beside.page().is_some();
    let mut answer = demonstrate(&run, arguments, console)?;
    // The load of a host changes: a period that it kept in the measurement may be too short later.
    for _ in 0..LONGER_PERIODS {
        if is_fixed || answer.status != Status::Inconclusive {
            break;
        }
        run = wakefulness::with_longer_period(&run, console);
        answer = demonstrate(&run, arguments, console)?;
    }
    Ok(answer.and_next(&[&"init", &"cell"]))
}

fn demonstrate(
    run: &RunArguments,
    arguments: &Arguments,
    console: &mut Console,
) -> Result<Answer, Answer> {
    let cell = ClusterRun::press_cell(run)?;
    let members = Members::of(&cell.cluster);
    let found = read("table-two.toml", TABLE_TWO, Some(&members));
    let Some(scenario) = found.scenario else {
        return Err(Answer::bad_files(vec![found.report]));
    };
    let page = arguments.beside.page().map(Page::staying);
    let scenario = match run.cycles {
        Some(_) => scenario,
        None => scenario.compressed(divisor(&cell.cluster)),
    };
    cell.run(&scenario, run, page.as_ref(), console)
}

/// Divisor of the cycles that limits the experiment to [`LONGEST`] at long periods.
fn divisor(cluster: &Cluster) -> NonZeroU64 {
    let period = cluster.agreement().schedule.period();
    let divisor = (period * TABLE_TWO_CYCLES).as_nanos().div_ceil(LONGEST.as_nanos());
    u64::try_from(divisor).ok().and_then(NonZeroU64::new).unwrap_or(NonZeroU64::MIN)
}
