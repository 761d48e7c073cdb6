//! A scan of 1,000 rungs and 4,900 contacts on random inputs: by machine code, by `logic::Scan`, and by the same program as plain C, compiled by
//! `gcc -O2` where there is one, all in one run.
//!
//! `cargo bench -p understudy-native`. Each runs in many short rounds, of which the fastest counts: others may use this machine too.

#![allow(
    clippy::disallowed_methods,
    clippy::print_stdout,
    reason = "a benchmark measures, and prints what it measured"
)]

use std::fmt::Write as _;
use std::process::Command;
use std::time::Instant;

use understudy_logic::{Scan, Scratch};
use understudy_native::sample::{self, Rung};
use understudy_native::{Frame, Machine};

const RUNGS: usize = 1_000;
const SEED: u64 = 2;
/// Images of random inputs, taken in turn.
const IMAGES: usize = 64;
/// So few that a round is over before somebody else gets the processor.
const SCANS: usize = 300;
const ROUNDS: usize = 1_500;

fn main() {
    let rungs = sample::rungs(RUNGS, SEED);
    let circuit = sample::program(&rungs);
    let begin = Instant::now();
    let machine = Machine::new(&circuit).expect("a code generator for this processor");
    println!(
        "{RUNGS} rungs, compiled in {:.3} s, {} KiB of code",
        begin.elapsed().as_secs_f64(),
        machine.code_bytes() / 1024
    );
    let scan = Scan::new(&circuit);
    let peer = Peer::build(&rungs);
    let bits = images(1);
    let lanes = images(u64::MAX);
    let mut best = [f64::INFINITY; 4];
    let mut sums = [0; 3];
    let mut frames = [machine.frame(), machine.frame()];
    let mut state = vec![0; scan.register_count()];
    for _ in 0..ROUNDS {
        best[0] = best[0].min(timed(|| {
            sums[0] += native(&machine, &mut frames[0], &bits);
        }));
        best[1] = best[1].min(timed(|| {
            native(&machine, &mut frames[1], &lanes);
        }));
        best[2] = best[2].min(timed(|| sums[1] += interpreted(&scan, &mut state, &bits)));
    }
    if let Some((nanoseconds, sum)) = peer.as_ref().and_then(Peer::run) {
        best[3] = nanoseconds;
        sums[2] = sum;
    }
    assert_eq!(sums[0], sums[1], "machine code and logic::Scan agree");
    let names = [
        "machine code, 1 run",
        "machine code, 64 runs",
        "logic::Scan, 64 runs",
        "gcc -O2, 1 run",
    ];
    for (name, nanoseconds) in names.iter().zip(best) {
        if nanoseconds.is_finite() {
            println!(
                "{name:<22} {:>8.3} ns a rung {:>8.0} ns a scan",
                nanoseconds / RUNGS as f64,
                nanoseconds
            );
        }
    }
    if peer.is_some() {
        assert_eq!(sums[0], sums[2], "machine code and C agree");
        println!("machine code / gcc = {:.2}", best[0] / best[3]);
    } else {
        println!("no gcc here, so there is nothing to compare with");
    }
    let large = sample::program(&sample::rungs(10_000, SEED));
    let begin = Instant::now();
    let machine = Machine::new(&large).expect("a code generator for this processor");
    println!(
        "10000 rungs, compiled in {:.3} s, {} KiB of code",
        begin.elapsed().as_secs_f64(),
        machine.code_bytes() / 1024
    );
}

/// Nanoseconds a scan.
fn timed(mut work: impl FnMut()) -> f64 {
    let begin = Instant::now();
    work();
    begin.elapsed().as_nanos() as f64 / SCANS as f64
}

/// Random inputs as words of which only the bits of `mask` are used. The C program draws the same.
fn images(mask: u64) -> Vec<Vec<u64>> {
    let mut state = SEED;
    let mut draw = || {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        state
    };
    (0..IMAGES)
        .map(|_| (0..RUNGS).map(|_| draw() >> 20 & mask).collect())
        .collect()
}

/// Ones among the outputs of run 0, over all scans.
fn native(machine: &Machine, frame: &mut Frame, images: &[Vec<u64>]) -> u64 {
    let mut sum = 0;
    for scan in 0..SCANS {
        frame.inputs().copy_from_slice(&images[scan % IMAGES]);
        machine.step(frame);
        sum += frame.outputs()[scan % (RUNGS / 4)] & 1;
    }
    sum
}

fn interpreted(scan: &Scan, state: &mut [u64], images: &[Vec<u64>]) -> u64 {
    let mut scratch = Scratch::default();
    let mut outputs = vec![0; scan.output_count()];
    let mut sum = 0;
    for number in 0..SCANS {
        let inputs = &images[number % IMAGES];
        scan.step_lanes(&mut scratch, state, inputs, &mut outputs);
        sum += outputs[number % (RUNGS / 4)] & 1;
    }
    sum
}

/// The same program as C, as a process that measures itself.
struct Peer(std::path::PathBuf);

impl Peer {
    fn build(rungs: &[Rung]) -> Option<Self> {
        let folder = std::env::temp_dir().join(format!("understudy-peer-{}", std::process::id()));
        std::fs::create_dir_all(&folder).ok()?;
        let (source, program) = (folder.join("peer.c"), folder.join("peer"));
        std::fs::write(&source, c_text(rungs)).ok()?;
        let mut gcc = Command::new("gcc");
        let built = gcc.arg("-O2").arg("-o").arg(&program).arg(&source).status();
        let peer = Self(folder);
        built.ok()?.success().then_some(peer)
    }

    fn run(&self) -> Option<(f64, u64)> {
        let output = Command::new(self.0.join("peer")).output().ok()?;
        let text = String::from_utf8(output.stdout).ok()?;
        let mut words = text.split_whitespace();
        Some((words.next()?.parse().ok()?, words.next()?.parse().ok()?))
    }
}

impl Drop for Peer {
    fn drop(&mut self) {
        // What is left behind lies in the folder for temporary files.
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

/// A byte a signal, and bitwise operators: no branch can be guessed wrong.
fn c_text(rungs: &[Rung]) -> String {
    let mut text = String::from(
        "#include <stdio.h>\n#include <stdint.h>\n#include <string.h>\n#include <time.h>\n",
    );
    let count = rungs.len();
    let _ = writeln!(
        text,
        "static unsigned char u[{count}], x[{count}], y[{count}], images[{IMAGES}][{count}];"
    );
    text.push_str("__attribute__((noinline)) static void scan(void) {\n");
    let signal = |number: usize| {
        if number < count {
            format!("u[{number}]")
        } else {
            format!("x[{}]", number - count)
        }
    };
    for (place, rung) in rungs.iter().enumerate() {
        let [first, second] = rung.start.map(signal);
        let stop = signal(rung.stop);
        let block = rung.block.map(|block| format!(" & {}", signal(block)));
        let _ = writeln!(
            text,
            "  x[{place}] = (({first} & {second}) | x[{place}]) & ~{stop}{};",
            block.unwrap_or_default()
        );
        if place % 4 == 0 {
            let _ = writeln!(text, "  y[{}] = x[{place}];", place / 4);
        }
    }
    let _ = writeln!(
        text,
        "}}
int main(void) {{
  uint64_t state = {SEED};
  for (int i = 0; i < {IMAGES}; i++) for (int k = 0; k < {count}; k++) {{
    state ^= state << 13; state ^= state >> 7; state ^= state << 17;
    images[i][k] = state >> 20 & 1;
  }}
  struct timespec a, b;
  uint64_t sum = 0;
  double best = 1e9;
  for (int round = 0; round < {ROUNDS}; round++) {{
    clock_gettime(CLOCK_MONOTONIC, &a);
    for (int n = 0; n < {SCANS}; n++) {{
      memcpy(u, images[n % {IMAGES}], sizeof u);
      scan();
      sum += y[n % {}] & 1;
    }}
    clock_gettime(CLOCK_MONOTONIC, &b);
    double taken = ((b.tv_sec - a.tv_sec) * 1e9 + (b.tv_nsec - a.tv_nsec)) / {SCANS}.0;
    if (taken < best) best = taken;
  }}
  printf(\"%f %lu\\n\", best, sum);
}}",
        count / 4
    );
    text
}
