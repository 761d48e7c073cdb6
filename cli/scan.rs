//! `understudy bench scan`: how long a scan of a program takes.

use std::path::PathBuf;
use std::time::{Duration, Instant};

use clap::Args;
use rand::{RngExt as _, SeedableRng as _};
use rand_pcg::Pcg64;
use schemars::JsonSchema;
use serde::Serialize;
use understudy_interchange::parse_program;
use understudy_logic::{Circuit, Scan, Scratch};

use crate::answer::{Answer, Status};
use crate::files;
use crate::kind::Kind;

/// From one scan to the next where a program has timers; the speed does not depend on it.
const PERIOD: Duration = Duration::from_millis(10);

/// Scans of a round, so few that it is over before another process gets the processor; the fastest of all rounds counts.
const SCANS: usize = 100;
const ROUNDS: usize = 300;

#[derive(Debug, Args)]
pub(crate) struct Arguments {
    /// A program
    #[arg(value_name = "FILE")]
    program: PathBuf,
    /// What the inputs are drawn from
    #[arg(long, default_value_t = 1)]
    seed: u64,
}

/// What `bench scan` answers.
#[derive(Debug, Serialize, JsonSchema)]
pub(crate) struct Found {
    rungs: usize,
    /// Runs of the program that one scan steps at once.
    runs: usize,
    nanoseconds_per_scan: f64,
    nanoseconds_per_rung: f64,
}

pub(crate) fn run(arguments: &Arguments) -> Answer {
    let (rungs, circuit) = match program(arguments) {
        Ok(program) => program,
        Err(answer) => return answer,
    };
    let scan = Scan::new(&circuit);
    let images = images(circuit.inputs().len(), arguments.seed);
    let registers = circuit.registers().iter();
    let mut state: Vec<u64> = registers
        .map(|register| u64::from(register.initial).wrapping_neg())
        .collect();
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
    Answer::done(text, found)
}

/// How many rungs, and what they do.
fn program(arguments: &Arguments) -> Result<(usize, Circuit), Answer> {
    let path = &arguments.program;
    let source = files::text_of(Kind::Ladder, path)?;
    let name = path.display().to_string();
    let parsed = parse_program(&name, &source);
    let report = understudy_text::Report {
        name,
        text: source,
        diagnostics: parsed.diagnostics,
    };
    if report.has_errors() {
        return Err(Answer::bad_files(vec![report]));
    }
    let circuit = parsed.program.lower(PERIOD);
    let circuit =
        circuit.map_err(|error| Answer::failed(Status::BadInput, "U0436", error.to_string()))?;
    Ok((parsed.program.rungs.len(), circuit))
}

/// Images of random inputs, taken in turn.
fn images(inputs: usize, seed: u64) -> Vec<Vec<u64>> {
    let mut draw = Pcg64::seed_from_u64(seed);
    (0..16)
        .map(|_| (0..inputs).map(|_| draw.random()).collect())
        .collect()
}

/// Nanoseconds of one scan.
fn timed(mut scan: impl FnMut(usize)) -> f64 {
    let begin = Instant::now();
    for number in 0..SCANS {
        scan(number);
    }
    begin.elapsed().as_nanos() as f64 / SCANS as f64
}
