//! Proofs of a production line of k stations in a row: five state bits and two properties each.
//!
//! `cargo bench -p understudy-verification` prints a table; with a folder as its argument it also writes the models for NuSMV there, so that
//! both can be compared: `NuSMV -dynamic line_12.smv`. Times are processor times.

#![allow(
    clippy::disallowed_methods,
    clippy::print_stdout,
    reason = "a benchmark measures, and prints what it measured"
)]

use std::fmt::Write as _;
use std::time::Duration;

use understudy_ladder::parse;
use understudy_verification::program::{Answer, Bounds, Subject};
use understudy_verification::property::{Asked, read};
use understudy_verification::smv;

/// Stations, and the seconds that NuSMV 2.6 took with dynamic ordering.
const LINES: [(usize, f64); 3] = [(12, 0.25), (20, 1.9), (40, 14.0)];

/// A part goes from station to station; each works on it for five scans, and keeps it until the next one is free.
fn line(stations: usize) -> String {
    let mut text = String::from("program line\ninput part\ninput stop\n");
    for station in 0..stations {
        let _ = writeln!(text, "output busy{station}\nmemory done{station}");
    }
    for station in 0..stations {
        let from = match station {
            0 => "part".to_owned(),
            _ => format!("done{}", station - 1),
        };
        let taken = match station + 1 {
            next if next < stations => format!("/busy{next}"),
            _ => "/stop".to_owned(),
        };
        let _ = write!(
            text,
            "rung\n    [ {from} /done{station} | busy{station} ] /done{station} /stop ( busy{station} )\n\
             rung\n    busy{station} {{TON work{station} 50ms}}\n\
             rung\n    [ work{station}.Q | done{station} ] {taken} ( done{station} )\n"
        );
    }
    text
}

/// Processor time of this thread in seconds: other programs on the machine do not count.
fn processor() -> f64 {
    let text = std::fs::read_to_string("/proc/thread-self/schedstat").unwrap_or_default();
    let nanoseconds = text.split(' ').next().and_then(|first| first.parse::<f64>().ok());
    nanoseconds.unwrap_or(0.0) / 1e9
}

/// Exclusion, response and reachability.
fn properties(stations: usize) -> String {
    let mut text = String::new();
    for station in 0..stations {
        let _ = writeln!(text, "AG !(busy{station} & stop)");
        let second = match station % 2 {
            0 => format!("AG (busy{station} -> EF done{station})"),
            _ => format!("AG EF busy{station}"),
        };
        let _ = writeln!(text, "{second}");
    }
    text
}

/// The painting system of Ngalamou and Myers; its specification took NuSMV 2.6 0.01 s.
fn painting() {
    let ladder = include_str!("../../../examples/painting-system/painting-system.ladder");
    let properties = include_str!("../../../examples/painting-system/painting-system.properties");
    let program = parse(ladder).program;
    let begin = processor();
    let subject = Subject::new(&program, Duration::from_millis(10), &Asked::default())
        .expect("a right program");
    let found = read(properties, Duration::from_millis(10));
    let formulas = found.properties.iter();
    let formulas: Vec<_> =
        formulas.map(|property| subject.resolve(property).expect("known signals")).collect();
    let answers = subject.check(&formulas[..1], Vec::new(), Bounds::default(), &mut |_, _| {});
    let proved = matches!(answers[0], Answer::Holds(_));
    println!(
        "painting system, {} state bits, specification proved: {proved}, {:.4} s   NuSMV 2.6 0.01 s",
        subject.circuit().registers().len(),
        processor() - begin
    );
}

fn main() {
    let folder = std::env::args().skip(1).find(|argument| !argument.starts_with("--"));
    painting();
    println!("stations  state bits  properties  proved       time   NuSMV 2.6");
    for (stations, peer_seconds) in LINES {
        let program = parse(&line(stations)).program;
        let subject = Subject::new(&program, Duration::from_millis(10), &Asked::default())
            .expect("a right program");
        let found = read(&properties(stations), Duration::from_millis(10));
        let formulas = found.properties.iter();
        let formulas: Vec<_> =
            formulas.map(|property| subject.resolve(property).expect("known signals")).collect();
        let begin = processor();
        let answers = subject.check(&formulas, Vec::new(), Bounds::default(), &mut |_, _| {});
        let taken = processor() - begin;
        let proved = answers.iter().filter(|answer| matches!(answer, Answer::Holds(_)));
        println!(
            "{stations:>8}  {:>10}  {:>10}  {:>6}  {:>7.3} s  {peer_seconds:>7.2} s",
            subject.circuit().registers().len(),
            formulas.len(),
            proved.count(),
            taken,
        );
        if let Some(folder) = &folder {
            let text = smv::of_circuit(subject.circuit(), &formulas, &[]);
            let path = format!("{folder}/line_{stations}.smv");
            if let Err(error) = std::fs::write(&path, text) {
                println!("{path} cannot be written: {error}");
            }
        }
    }
}
