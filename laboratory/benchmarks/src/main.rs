//! The `understudy-bench` command: benchmarks of speed and endurance on this machine.

#![allow(clippy::disallowed_methods, reason = "a benchmark measures the time of this machine")]

mod changes;
mod children;
mod exchange;
mod failover;
mod join;
mod kills;
mod log;
mod memory;
mod scan;
mod simulate;
mod spares;
mod timing;
mod twins;

use std::process::ExitCode;

use clap::{Parser, Subcommand};
use understudy::{
    Answer, Console, MemberArguments, ProxyArguments, misused, run_plant, run_proxy, run_remote_io,
    run_station,
};

/// Measure speed and endurance on this machine
#[derive(Debug, Parser)]
#[command(
    name = "understudy-bench",
    version,
    after_help = "\
Example:
  understudy-bench exchange --cycles 2000
  understudy-bench kills --count 100
  understudy-bench kills examples/heated-tank/cluster.toml --period 10ms
  understudy-bench failover --figure failover.svg
  understudy-bench scan examples/press-cell/robot.ladder
  understudy-bench join --trials 50 --loss 10%
  understudy-bench log --cycles 2000
  understudy-bench timing --controllers 4,16 --period 10ms --seconds 10
  understudy-bench spares --rounds 200
  understudy-bench twins --count 500
  understudy-bench changes --count 1000

Exit status: 0 if the targets are met, 1 if not, 2 for invalid input."
)]
struct CommandLine {
    /// Print one JSON document on standard output (docs/reference/json.md)
    #[arg(long, global = true)]
    json: bool,
    #[command(subcommand)]
    benchmark: Benchmark,
}

#[derive(Debug, Subcommand)]
enum Benchmark {
    Exchange(exchange::Arguments),
    Simulate(simulate::Arguments),
    Kills(Box<kills::Arguments>),
    Join(Box<join::Arguments>),
    Failover(Box<failover::Arguments>),
    Log(Box<log::Arguments>),
    Memory(memory::Arguments),
    Scan(scan::Arguments),
    Timing(timing::Arguments),
    Spares(Box<spares::Arguments>),
    Twins(Box<twins::Arguments>),
    Changes(Box<changes::Arguments>),
    #[command(hide = true)]
    Member(exchange::MemberArguments),
    #[command(hide = true)]
    Timed(timing::TimedArguments),
    #[command(hide = true)]
    Node(MemberArguments),
    #[command(hide = true)]
    RemoteIo(MemberArguments),
    #[command(hide = true)]
    Plant(MemberArguments),
    #[command(hide = true)]
    Proxy(Box<ProxyArguments>),
}

impl Benchmark {
    fn run(&self, console: &mut Console) -> (&'static str, Answer) {
        match self {
            Self::Exchange(arguments) => ("exchange", exchange::run(arguments).into()),
            Self::Simulate(arguments) => ("simulate", simulate::run(arguments).into()),
            Self::Kills(arguments) => ("kills", kills::run(arguments, console).into()),
            Self::Join(arguments) => ("join", join::run(arguments, console).into()),
            Self::Failover(arguments) => ("failover", failover::run(arguments, console).into()),
            Self::Log(arguments) => ("log", log::run(arguments, console).into()),
            Self::Memory(arguments) => ("memory", memory::run(arguments).into()),
            Self::Scan(arguments) => ("scan", scan::run(arguments).into()),
            Self::Timing(arguments) => ("timing", timing::run(arguments, console).into()),
            Self::Timed(arguments) => ("timed", timing::run_timed(arguments)),
            Self::Spares(arguments) => ("spares", spares::run(arguments, console).into()),
            Self::Changes(arguments) => ("changes", changes::run(arguments, console).into()),
            Self::Twins(arguments) => ("twins", twins::run(arguments, console).into()),
            Self::Member(arguments) => ("member", exchange::run_member(arguments)),
            Self::Node(arguments) => ("node", run_station(arguments).into()),
            Self::RemoteIo(arguments) => ("remote-io", run_remote_io(arguments).into()),
            Self::Plant(arguments) => ("plant", run_plant(arguments).into()),
            Self::Proxy(arguments) => ("proxy", run_proxy(arguments, console)),
        }
    }
}

fn main() -> ExitCode {
    if children::is_understudy() {
        return understudy::main();
    }
    let call = match CommandLine::try_parse() {
        Ok(call) => call,
        Err(error) => return misused(&error),
    };
    let mut console = Console::new(call.json);
    let (name, answer) = call.benchmark.run(&mut console);
    console.finish(name, answer)
}
