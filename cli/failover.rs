//! `understudy bench failover`: the cluster beside hot-standby and active-active pairs.

use std::path::PathBuf;

use clap::Args;
use serde::Deserialize;
use understudy_baselines::{Comparison, ComparisonPlan, RealRun, compare, figure};
use understudy_bus::LinkKind;
use understudy_scenarios::Counts;

use crate::answer::{Answer, Status};
use crate::bench;
use crate::console::Console;
use crate::files;
use crate::run::lab::RunArguments;

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

pub(crate) fn run(arguments: &Arguments, console: &mut Console) -> Answer {
    compared(arguments, console).unwrap_or_else(|failed| failed)
}

fn compared(arguments: &Arguments, console: &mut Console) -> Result<Answer, Answer> {
    let cluster = bench::simulated_press_cell()?;
    let plan = ComparisonPlan {
        failures: arguments.failures,
        cycles: arguments.loss_cycles,
        copies: arguments
            .copies
            .unwrap_or(cluster.agreement().schedule.copies()),
        seed: arguments.seed,
    };
    console.note("comparing in the simulator");
    let mut comparison = compare(&cluster, &plan)
        .map_err(|error| Answer::failed(Status::Failed, "U0530", error.to_string()))?;
    if arguments.kills > 0 {
        for (link, overrides) in arguments.run.overrides.each_link() {
            console.note(&format!("killing real processes, over {link}"));
            let run = RunArguments {
                overrides,
                ..arguments.run.clone()
            };
            comparison.real.push(real(arguments, link, &run, console));
        }
    }
    let mut text = comparison.to_string();
    if let Some(path) = &arguments.figure {
        let svg = figure(&comparison)
            .map_err(|error| Answer::failed(Status::Failed, "U0602", error.to_string()))?;
        files::write(path, &svg)?;
        text.push_str(&format!("\nfigure: {}\n", path.display()));
    }
    let status = if is_right(&comparison) {
        Status::Done
    } else {
        Status::Failed
    };
    Ok(Answer::done(text, comparison).with_status(status))
}

/// Nothing wrong anywhere, and each real run came to its end.
fn is_right(comparison: &Comparison) -> bool {
    let simulated = comparison.contenders.iter().filter_map(|one| one.wrong);
    let real = comparison.real.iter().map(|run| run.wrong);
    let ended = comparison.real.iter().all(|run| run.failure.is_none());
    ended && simulated.chain(real).all(|wrong| wrong == 0)
}

/// What is needed of the answer of a run on real processes.
#[derive(Deserialize)]
struct Killed {
    summary: KilledSummary,
}

#[derive(Deserialize)]
struct KilledSummary {
    violation_count: u64,
    cycles_asked: u64,
    cycles_run: u64,
    death_count: u64,
    remote_ios: Vec<KilledRemoteIo>,
}

#[derive(Deserialize)]
struct KilledRemoteIo {
    counts: Counts,
}

fn real(
    arguments: &Arguments,
    link: LinkKind,
    run: &RunArguments,
    console: &mut Console,
) -> RealRun {
    let answer = bench::kills(arguments.kills, arguments.seed, run, console);
    let mut real = RealRun {
        link: link.to_string(),
        kills: arguments.kills,
        lost: 0,
        lost_by_stall: 0,
        wrong: 0,
        failure: answer
            .failures
            .first()
            .map(|failure| failure.message.clone()),
    };
    let Ok(Killed { summary }) = serde_json::from_value(answer.result) else {
        real.failure.get_or_insert("it could not be run".to_owned());
        return real;
    };
    if summary.cycles_run < summary.cycles_asked {
        let (run, asked) = (summary.cycles_run, summary.cycles_asked);
        let early = format!("it ended after {run} of {asked} cycles");
        real.failure.get_or_insert(early);
    }
    if summary.death_count > 0 {
        let more = format!("{} members ended unexpectedly", summary.death_count);
        real.failure.get_or_insert(more);
    }
    real.wrong = summary.violation_count;
    for remote_io in &summary.remote_ios {
        let counts = &remote_io.counts;
        real.lost += counts.held + counts.fail_safe;
        real.lost_by_stall += counts.held_by_stall + counts.fail_safe_by_stall;
    }
    real
}
