//! `understudy-bench failover`: the cluster compared with hot-standby and active-active pairs.

use std::path::PathBuf;

use clap::Args;
use understudy::{Answer, ClusterRun, Console, RunArguments, Status, write_file};
use understudy_baselines::{Comparison, ComparisonPlan, RealRun, compare, figure};
use understudy_bus::LinkKind;

use crate::kills::{Target, Trouble};
use crate::simulate::simulated_press_cell;

/// Compare the cluster with hot-standby and active-active pairs
///
/// Lost cycles, false take-overs, double masters, controllers, bytes.
#[derive(Debug, Args)]
pub(crate) struct Arguments {
    /// Failures of a box that drives, for each contender in the simulator
    #[arg(long, value_name = "N", default_value_t = 1000, value_parser = clap::value_parser!(u64).range(1..=1_000_000))]
    failures: u64,
    /// Simulated cycles at each share of lost frames
    #[arg(long, value_name = "N", default_value_t = 10_000, value_parser = clap::value_parser!(u64).range(1..=10_000_000))]
    loss_cycles: u64,
    /// How often everybody sends each cyclic frame, by default as the press cell does
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=4))]
    copies: Option<u32>,
    /// Stations killed on real processes, over each link or that of --link; 0 for none
    #[arg(long, value_name = "N", default_value_t = 30, value_parser = clap::value_parser!(u64).range(..=100_000))]
    kills: u64,
    /// What all chance comes from
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// Where to draw the lost cycles over the lost frames, as SVG
    #[arg(long, value_name = "FILE")]
    figure: Option<PathBuf>,
    #[command(flatten)]
    run: RunArguments,
}

pub(crate) fn run(arguments: &Arguments, console: &mut Console) -> Result<Answer, Answer> {
    let cluster = simulated_press_cell()?;
    let plan = ComparisonPlan {
        failures: arguments.failures,
        cycles: arguments.loss_cycles,
        copies: arguments.copies.unwrap_or(cluster.agreement().schedule.copies()),
        seed: arguments.seed,
    };
    console.note("comparing in the simulator");
    let mut comparison =
        compare(&cluster, &plan).map_err(|error| Answer::failed(Status::Failed, "U0530", error))?;
    if arguments.kills > 0 {
        for (link, overrides) in arguments.run.overrides.each_link() {
            console.note(&format!("killing real processes, over {link}"));
            let run = RunArguments { overrides, ..arguments.run.clone() };
            comparison.real.push(real(arguments, link, &run, console));
        }
    }
    let mut text = comparison.to_string();
    if let Some(path) = &arguments.figure {
        let svg =
            figure(&comparison).map_err(|error| Answer::failed(Status::Failed, "U0602", error))?;
        write_file(path, &svg)?;
        text.push_str(&format!("\nfigure: {}\n", path.display()));
    }
    let status = if is_right(&comparison) { Status::Done } else { Status::Failed };
    Ok(Answer::done(text, comparison).with_status(status))
}

/// Nothing wrong anywhere, and each real run came to its end.
fn is_right(comparison: &Comparison) -> bool {
    let simulated = comparison.contenders.iter().filter_map(|one| one.wrong);
    let real = comparison.real.iter().map(|run| run.wrong);
    let ended = comparison.real.iter().all(|run| run.failure.is_none());
    ended && simulated.chain(real).all(|wrong| wrong == 0)
}

fn real(
    arguments: &Arguments,
    link: LinkKind,
    run: &RunArguments,
    console: &mut Console,
) -> RealRun {
    let mut real = RealRun {
        link: link.to_string(),
        kills: arguments.kills,
        lost: 0,
        lost_by_stall: 0,
        wrong: 0,
        failure: None,
    };
    let ran = ClusterRun::press_cell(run).and_then(|cell| {
        let schedule = &cell.cluster.agreement().schedule;
        let scenario =
            Trouble::Kill.scenario(Target::Stations, schedule, arguments.kills, arguments.seed);
        cell.judged(&scenario, run, console)
    });
    let (summary, judged) = match ran {
        Ok(ran) => ran,
        Err(answer) => {
            let failure = answer.first_failure().unwrap_or("the run did not start");
            real.failure = Some(failure.to_owned());
            return real;
        }
    };
    let (run, asked) = (summary.cycles_run, summary.cycles_asked);
    real.failure = if let Some(failure) = judged.failure {
        Some(failure.to_string())
    } else if let Err(error) = judged.written {
        Some(error.to_string())
    } else if run < asked {
        Some(format!("it ended after {run} of {asked} cycles"))
    } else if summary.death_count > 0 {
        let deaths = summary.death_count;
        Some(format!("{deaths} members ended unexpectedly"))
    } else {
        None
    };
    real.wrong = summary.violation_count;
    for remote_io in &summary.remote_ios {
        let counts = &remote_io.counts;
        real.lost += counts.held + counts.fail_safe;
        real.lost_by_stall += counts.held_by_stall + counts.fail_safe_by_stall;
    }
    real
}
