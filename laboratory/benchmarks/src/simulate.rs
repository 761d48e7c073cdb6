//! `understudy-bench simulate`: speed of the simulator.

use std::time::Instant;

use clap::Args;
use serde_json::json;
use understudy::{Answer, Status};
use understudy_cluster::{Cluster, Overrides, press_cell, read_with_files};
use understudy_scenarios::{Network, parts};
use understudy_simulator::{NotReady, Simulation};

/// Measure the cycles of the press cell that the simulator runs in one second
#[derive(Debug, Args)]
pub(crate) struct Arguments {
    /// Cycles to run
    #[arg(long, default_value_t = 200_000)]
    cycles: u64,
}

/// Cycles in one second that the simulator must reach.
const BAR: f64 = 200_000.0;

/// Maximum number of cycles until the simulated cluster is synchronised.
pub(crate) const PATIENCE_CYCLES: u64 = 1000;

/// The cluster of section V, without a folder.
pub(crate) fn simulated_press_cell() -> Result<Cluster, Answer> {
    let files = press_cell();
    let loaded = read_with_files(files[0].text, files, Overrides::default());
    loaded.cluster.ok_or_else(|| Answer::bad_files(loaded.reports))
}

/// The answer if the simulated cluster is not synchronised in time.
pub(crate) fn not_ready(error: NotReady) -> Answer {
    Answer::failed(Status::Failed, "U0530", error)
}

pub(crate) fn run(arguments: &Arguments) -> Result<Answer, Answer> {
    let cluster = simulated_press_cell()?;
    let mut simulation = Simulation::new(parts(&cluster), Network::default(), 1);
    let start = Instant::now();
    simulation.run(arguments.cycles, PATIENCE_CYCLES, &mut |_, _, _, _| {}).map_err(not_ready)?;
    let speed = arguments.cycles as f64 / start.elapsed().as_secs_f64();
    let violations = simulation.violations().len();
    let ratio = speed / BAR;
    let text =
        format!("{speed:.0} cycles a second, {ratio:.2} of the bar, {violations} violations");
    let result = json!({ "cycles_per_second": speed, "ratio": ratio, "violations": violations });
    let status = if ratio >= 1.0 && violations == 0 { Status::Done } else { Status::Failed };
    Ok(Answer::done(text, result).with_status(status))
}
