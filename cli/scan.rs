//! `understudy bench scan`: how long a scan takes, by the scan of the stations and by machine code.

use std::fmt::Write as _;
use std::path::PathBuf;
use std::time::{Duration, Instant};

use clap::Args;
use schemars::JsonSchema;
use serde::Serialize;
use understudy_interchange::parse_program;
use understudy_logic::{Circuit, Scan, Scratch};
use understudy_native::{Frame, Machine, sample};

use crate::answer::{Answer, Status};
use crate::files;
use crate::kind::Kind;

/// From one scan to the next where a program has timers; the speed does not depend on it.
const PERIOD: Duration = Duration::from_millis(10);

/// Scans of a round, so few that it is over before somebody else gets the processor; the fastest of all rounds counts.
const SCANS: usize = 100;
const ROUNDS: usize = 300;

/// Rungs of a program, as the parser bounds them.
const RUNGS: std::ops::RangeInclusive<i64> = 1..=100_000;

#[derive(Debug, Args)]
pub(crate) struct Arguments {
    /// A program; without one, rungs of 4.9 contacts drawn at random
    #[arg(value_name = "FILE")]
    program: Option<PathBuf>,
    /// How many random rungs
    #[arg(long, value_name = "N", default_value_t = 1000, value_parser = clap::value_parser!(u32).range(RUNGS))]
    rungs: u32,
    /// What they and the inputs are drawn from
    #[arg(long, default_value_t = 1)]
    seed: u64,
}

/// What `bench scan` answers.
#[derive(Debug, Serialize, JsonSchema)]
pub(crate) struct Found {
    rungs: usize,
    /// Seconds from the circuit to machine code.
    compiled_in: f64,
    code_bytes: usize,
    ways: Vec<Way>,
    /// Whether all did the same.
    equal: bool,
}

/// One way to scan.
#[derive(Debug, Serialize, JsonSchema)]
struct Way {
    name: &'static str,
    /// At once.
    runs: usize,
    nanoseconds_per_scan: f64,
    nanoseconds_per_rung: f64,
}

pub(crate) fn run(arguments: &Arguments) -> Answer {
    let (rungs, circuit) = match program(arguments) {
        Ok(program) => program,
        Err(answer) => return answer,
    };
    let begin = Instant::now();
    let machine = match Machine::new(&circuit) {
        Ok(machine) => machine,
        Err(error) => return Answer::failed(Status::Failed, error.code(), error.to_string()),
    };
    let compiled_in = begin.elapsed().as_secs_f64();
    let scan = Scan::new(&circuit);
    let images = images(circuit.inputs().len(), arguments.seed);
    let mut frame = machine.frame();
    let mut state: Vec<u64> = frame.registers().to_vec();
    let mut scratch = Scratch::default();
    let mut outputs = vec![0; circuit.outputs().len()];
    let mut equal = true;
    let (mut by_code, mut by_scan) = (f64::INFINITY, f64::INFINITY);
    for _ in 0..ROUNDS {
        by_code = by_code.min(timed(|number| {
            code(&machine, &mut frame, image(&images, number))
        }));
        by_scan = by_scan.min(timed(|number| {
            scan.step_lanes(
                &mut scratch,
                &mut state,
                image(&images, number),
                &mut outputs,
            );
        }));
        equal &= frame.outputs() == outputs && *frame.registers() == state[..];
    }
    let way = |name, nanoseconds: f64| Way {
        name,
        runs: 64,
        nanoseconds_per_scan: nanoseconds,
        nanoseconds_per_rung: nanoseconds / rungs.max(1) as f64,
    };
    let found = Found {
        rungs,
        compiled_in,
        code_bytes: machine.code_bytes(),
        ways: vec![
            way("machine code", by_code),
            way("scan of a station", by_scan),
        ],
        equal,
    };
    let status = if equal { Status::Done } else { Status::Failed };
    Answer::done(text(&found), found).with_status(status)
}

/// How many rungs, and what they do.
fn program(arguments: &Arguments) -> Result<(usize, Circuit), Answer> {
    let Some(path) = &arguments.program else {
        let rungs = sample::rungs(arguments.rungs as usize, arguments.seed);
        return Ok((rungs.len(), sample::program(&rungs)));
    };
    let source = files::text_of(Kind::Ladder, path)?;
    let name = path.display().to_string();
    let parsed = parse_program(&name, &source);
    let report = understudy_diagnostic::Report {
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
    // Xorshift has no way on from 0.
    let mut state = seed.max(1);
    let mut draw = || {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        state
    };
    (0..16)
        .map(|_| (0..inputs).map(|_| draw()).collect())
        .collect()
}

fn image(images: &[Vec<u64>], number: usize) -> &[u64] {
    &images[number % images.len()]
}

fn code(machine: &Machine, frame: &mut Frame, inputs: &[u64]) {
    frame.inputs().copy_from_slice(inputs);
    machine.step(frame);
}

/// Nanoseconds of one scan.
fn timed(mut scan: impl FnMut(usize)) -> f64 {
    let begin = Instant::now();
    for number in 0..SCANS {
        scan(number);
    }
    begin.elapsed().as_nanos() as f64 / SCANS as f64
}

fn text(found: &Found) -> String {
    let mut text = format!(
        "{} rungs, compiled in {:.3} s to {} KiB of machine code; 64 runs at once, random inputs\n",
        found.rungs,
        found.compiled_in,
        found.code_bytes.div_ceil(1024)
    );
    for way in &found.ways {
        let _ = writeln!(
            text,
            "  {:<18} {:>9.2} ns a rung {:>11.0} ns a scan",
            way.name, way.nanoseconds_per_rung, way.nanoseconds_per_scan
        );
    }
    text.push_str(if found.equal {
        "both did the same in every run"
    } else {
        "THEY DIFFER: do not use the machine code, and report this program"
    });
    text
}
