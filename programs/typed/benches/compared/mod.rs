//! The same programs in C, compiled by gcc at `-O2` and measured in the same run.

use std::hint::black_box;
use std::io::Write as _;
use std::process::{Command, Stdio};
use std::time::Duration;

use understudy_typed::{Machine, Program, Scratch};

use crate::programs;

/// Scans of a measurement, few enough that some measurements are not interrupted.
const SCANS: u32 = 10;

/// Measurements, of which the shortest counts.
const RUNS: u32 = 5_000;

const C: &str = r#"
#include <stdint.h>
#include <stdio.h>
#include <time.h>

struct pid { double measurement, setpoint, integral, last, output, error; };
static struct pid loops[100];
static int32_t i, sum, a[1000];
static uint8_t x[1000];

static void pid(struct pid *p) {
    p->error = p->setpoint - p->measurement;
    p->integral = p->integral + 0.01 * p->error;
    if (p->integral > 50.0) p->integral = 50.0;
    if (p->integral < -50.0) p->integral = -50.0;
    double value = 2.0 * p->error + 0.5 * p->integral + 0.1 * (p->error - p->last);
    value = value > 0.0 ? value : 0.0;
    p->output = value < 100.0 ? value : 100.0;
    p->last = p->error;
    p->measurement = 0.99 * p->measurement + 0.01 * p->output;
}

__attribute__((noinline)) static void all_pid(void) { for (int k = 0; k < 100; k++) pid(&loops[k]); }

__attribute__((noinline)) static void integer(void) {
    for (i = 0; i <= 999; i++) {
        a[i] = a[i] * 31 + i;
        if (a[i] > 1000000) sum = sum + a[i];
    }
}

__attribute__((noinline)) static void boolean(void) {
    RUNGS
}

static double seconds(void) {
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return t.tv_sec + t.tv_nsec * 1e-9;
}

static void measure(void (*scan)(void)) {
    double best = 1e9;
    for (int run = 0; run < RUNS; run++) {
        double start = seconds();
        for (int k = 0; k < SCANS; k++) scan();
        double took = seconds() - start;
        if (took < best) best = took;
    }
    printf("%.12f\n", best / SCANS);
}

int main(void) {
    for (int k = 0; k < 100; k++) loops[k].setpoint = 20.0 + k;
    for (int k = 0; k < 1000; k += 3) x[k] = 1;
    measure(all_pid);
    measure(integer);
    measure(boolean);
    printf("%g %d %d\n", loops[99].output, sum, x[1]);
    return 0;
}
"#;

/// Prints the time of an operation of each program, in C and in the machine; nothing where there is no gcc.
pub(crate) fn print() {
    let Some(seconds) = c() else {
        return;
    };
    let programs = [
        ("100 PID loops", programs::pid(100), 100 * programs::PID_OPERATIONS),
        ("1000 integer turns", programs::integer(1_000), 1_000 * programs::INTEGER_OPERATIONS),
        ("1000 Boolean rungs", programs::boolean(1_000), 1_000 * programs::BOOLEAN_OPERATIONS),
    ];
    let mut out = std::io::stdout();
    for ((name, program, operations), c) in programs.into_iter().zip(seconds) {
        let machine = machine(&program);
        let each = |seconds: f64| seconds * 1e9 / operations as f64;
        let (ours, theirs) = (each(machine), each(c));
        let line = format!(
            "{name}: {ours:.2} ns an operation, gcc -O2 {theirs:.2} ns, ratio {:.1}\n",
            ours / theirs
        );
        out.write_all(line.as_bytes()).expect("standard output");
    }
}

/// Seconds of a scan, the best of all measurements.
fn machine(program: &Program) -> f64 {
    let machine = Machine::new(program);
    let mut scratch = Scratch::default();
    let mut state = machine.initial().to_vec();
    let mut best = Duration::MAX;
    for _ in 0..RUNS {
        #[allow(clippy::disallowed_methods, reason = "a measurement")]
        let start = std::time::Instant::now();
        for _ in 0..SCANS {
            machine.step(&mut scratch, black_box(&mut state), &[], &mut []);
        }
        best = best.min(start.elapsed());
    }
    best.as_secs_f64() / f64::from(SCANS)
}

/// Seconds of a scan of each program in C.
fn c() -> Option<Vec<f64>> {
    let rungs: String = (0..1_000)
        .map(|rung| {
            let at = |step: u32| (rung * step + step) % 1_000;
            let (first, second, third) = (at(7), at(31), at(3));
            format!("x[{rung}] = (((x[{first}] | x[{rung}]) & !x[{second}]) ^ x[{third}]);\n")
        })
        .collect();
    let program = std::env::temp_dir().join(format!("understudy-typed-{}", std::process::id()));
    let mut gcc = Command::new("gcc")
        .args(["-O2", "-fwrapv", "-ffp-contract=off", "-x", "c", "-", "-o"])
        .arg(&program)
        .stdin(Stdio::piped())
        .stderr(Stdio::null())
        .spawn()
        .ok()?;
    let source = C
        .replace("RUNGS", &rungs)
        .replace("RUNS", &RUNS.to_string())
        .replace("SCANS", &SCANS.to_string());
    gcc.stdin.take()?.write_all(source.as_bytes()).ok()?;
    let is_compiled = gcc.wait().ok()?.success();
    let output = is_compiled.then(|| Command::new(&program).output());
    std::fs::remove_file(&program).ok();
    let text = String::from_utf8(output?.ok()?.stdout).ok()?;
    text.lines().take(3).map(|line| line.parse().ok()).collect()
}
