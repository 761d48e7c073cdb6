//! `cargo bench -p understudy-bus --bench exchange`: the exchange of a cycle over each carrier, beside the yardstick.

#![allow(clippy::print_stdout, reason = "a benchmark prints what it measured")]

use std::process::Command;
use std::time::Duration;

use understudy_bus::LinkKind;
use understudy_bus::exchange::{
    Carrier, Exchange, ExchangeMember, ExchangeSettings, measure, run_exchange_member,
};

/// Before the part of a process that this program starts of itself.
const PART: &str = "--part";

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1);
    while let Some(argument) = arguments.next() {
        if argument == PART {
            let part: ExchangeMember = serde_json::from_str(&arguments.next().unwrap_or_default())?;
            run_exchange_member(part, std::io::stdout())?;
            return Ok(());
        }
    }
    let program = std::env::current_exe()?;
    let settings = ExchangeSettings {
        cycles: 3000,
        period: Duration::from_millis(4),
        real_time: true,
        sealed: true,
    };
    let run = |carrier| {
        measure(carrier, settings, |part| {
            let mut command = Command::new(&program);
            let part = serde_json::to_string(part).expect("plain data");
            command.args([PART, &part]);
            command
        })
    };
    println!(
        "{:<10}{:>10}{:>10}{:>10}{:>12}{:>8}",
        "", "p50 µs", "p99 µs", "longest", "incomplete", "ratio"
    );
    let yardstick = run(Carrier::Raw)?;
    print("raw", yardstick, yardstick);
    let wanted: Vec<String> = std::env::args().skip(1).collect();
    let wanted = |name: &str| {
        wanted.iter().all(|one| one.starts_with('-')) || wanted.iter().any(|one| one == name)
    };
    for (name, link) in LinkKind::NAMES.into_iter().filter(|(name, _)| wanted(name)) {
        print(name, run(Carrier::Link(link))?, yardstick);
    }
    Ok(())
}

fn print(name: &str, measured: Exchange, yardstick: Exchange) {
    let microseconds = |nanoseconds: u64| nanoseconds as f64 / 1000.0;
    println!(
        "{name:<10}{:>10.1}{:>10.1}{:>10.1}{:>12}{:>8.2}",
        microseconds(measured.p50_ns),
        microseconds(measured.p99_ns),
        microseconds(measured.longest_ns),
        measured.incomplete_cycles,
        measured.p50_ns as f64 / yardstick.p50_ns as f64,
    );
}
