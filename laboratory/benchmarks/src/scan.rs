//! `understudy-bench scan`: duration of the scan of a program.

use std::path::PathBuf;
use std::time::{Duration, Instant};

use clap::Args;
use rand::{RngExt as _, SeedableRng as _};
use rand_pcg::Pcg64;
use serde::Serialize;
use understudy::{Answer, Status, ladder};
use understudy_logic::{Scan, Scratch};

/// From one scan to the next where a program has timers; the speed does not depend on it.
const PERIOD: Duration = Duration::from_millis(10);

/// Scans of a round, so few that it is over before another process gets the processor; the fastest of all rounds counts.
const SCANS: usize = 100;
const ROUNDS: usize = 300;

/// Measure the scan of a program
#[derive(Debug, Args)]
pub(crate) struct Arguments {
    /// A program
    #[arg(value_name = "FILE")]
    program: PathBuf,
    /// What the inputs are drawn from
    #[arg(long, default_value_t = 1)]
    seed: u64,
}

#[derive(Debug, Serialize)]
struct Found {
    rungs: usize,
    /// Runs of the program that one scan steps at once.
    runs: usize,
    nanoseconds_per_scan: f64,
    nanoseconds_per_rung: f64,
}

pub(crate) fn run(arguments: &Arguments) -> Result<Answer, Answer> {
    let (program, _) = ladder(&arguments.program)?;
    let rungs = program.rungs.len();
    let circuit = program
        .lower(PERIOD)
        .map_err(|error| Answer::failed(Status::BadInput, error.code_or("U0436"), error))?;
    let scan = Scan::new(&circuit);
    let images = images(circuit.inputs().len(), arguments.seed);
    let registers = circuit.registers().iter();
    let mut state: Vec<u64> =
        registers.map(|register| u64::from(register.initial).wrapping_neg()).collect();
    let mut scratch = Scratch::default();
    let mut outputs = vec![0; circuit.outputs().len()];
    let rounds = (0..ROUNDS).map(|_| {
        timed(|number| {
            let inputs = &images[number % images.len()];
            scan.step_lanes(&mut scratch, &mut state, inputs, &mut outputs);
        })
    });
    let nanoseconds = rounds.fold(f64::INFINITY, f64::min);
    let found = Found {
        rungs,
        runs: 64,
        nanoseconds_per_scan: nanoseconds,
        nanoseconds_per_rung: nanoseconds / rungs.max(1) as f64,
    };
    let text = format!(
        "{rungs} rungs, 64 runs at once, random inputs: {:.0} ns a scan, {:.2} ns a rung",
        found.nanoseconds_per_scan, found.nanoseconds_per_rung
    );
    Ok(Answer::done(text, found))
}

/// Images of random inputs, taken in turn.
fn images(inputs: usize, seed: u64) -> Vec<Vec<u64>> {
    let mut draw = Pcg64::seed_from_u64(seed);
    (0..16).map(|_| (0..inputs).map(|_| draw.random()).collect()).collect()
}

/// Nanoseconds of one scan.
fn timed(mut scan: impl FnMut(usize)) -> f64 {
    let begin = Instant::now();
    for number in 0..SCANS {
        scan(number);
    }
    begin.elapsed().as_nanos() as f64 / SCANS as f64
}
