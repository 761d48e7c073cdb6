//! `understudy bench`: how fast, beside a yardstick of the same run.

use std::fmt::Write as _;
use std::io;
use std::process::Command;
use std::time::{Duration, Instant};

use clap::{Args, Subcommand};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use serde::Serialize;
use serde_json::json;
use understudy_bus::LinkKind;
use understudy_bus::exchange::{
    Carrier, Exchange, ExchangeMember, ExchangeSettings, measure, run_exchange_member,
};
use understudy_cluster::{Cluster, press_cell};
use understudy_scenarios::{Action, Expectation, Fault, Network, Scenario, parts};
use understudy_simulator::Simulation;
use understudy_wire::{Member, StationId};

use crate::answer::{Answer, Status};
use crate::console::Console;
use crate::endurance;
use crate::failover;
use crate::memory;
use crate::run::demo::PressCell;
use crate::run::lab::RunArguments;
use crate::scan;

/// Measure speed on this machine
#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  understudy bench exchange --cycles 2000
  understudy bench kills --count 100
  understudy bench failover --figure failover.svg
  understudy bench scan examples/press-cell/robot.ladder
  understudy bench join --trials 50 --loss 10%")]
pub(crate) struct Arguments {
    #[command(subcommand)]
    what: What,
}

#[derive(Debug, Subcommand)]
enum What {
    /// From the first frame of a cycle to the last turn heard: 4 stations and 3 remote I/Os, beside plain sockets
    Exchange {
        /// Complete cycles of each carrier
        #[arg(long, default_value_t = 1000)]
        cycles: u64,
        /// Do not ask for real-time rights
        #[arg(long)]
        no_real_time: bool,
    },
    /// Cycles of the press cell that the simulator runs in a second
    Simulate {
        /// Cycles to run
        #[arg(long, default_value_t = 200_000)]
        cycles: u64,
    },
    /// Every role of the press cell killed or stopped at random phases, and what came of it
    Kills {
        /// Kills of each role: controllers, understudies, remote I/Os
        #[arg(long, alias = "kills", default_value_t = 100)]
        count: u64,
        /// Stop for so many cycles (SIGSTOP) in place of kill, such as 0.5,5,500
        #[arg(long, value_name = "CYCLES", value_delimiter = ',')]
        stop: Vec<f64>,
        /// What the phases come from
        #[arg(long, default_value_t = 1)]
        seed: u64,
        #[command(flatten)]
        run: Box<RunArguments>,
    },
    /// Clusters that start, and stations that join, where a tenth of all frames is lost, over each link
    Join {
        /// Trials over each link
        #[arg(long, default_value_t = 50)]
        trials: u64,
        #[command(flatten)]
        run: Box<RunArguments>,
    },
    /// The cluster beside hot-standby and active-active pairs: lost cycles, false take-overs, double masters, boxes, bytes
    Failover(Box<failover::Arguments>),
    /// Memory of a long simulated run with loss and failures
    Memory(memory::Arguments),
    /// A scan of a program
    Scan(scan::Arguments),
    /// One process of the exchange
    #[command(hide = true)]
    Member {
        /// Its part as JSON
        part: String,
    },
}

/// Period of the measured cycles.
const PERIOD: Duration = Duration::from_millis(10);

#[derive(Serialize)]
struct Measured {
    carrier: &'static str,
    p50_us: f64,
    p99_us: f64,
    /// p50 by that of plain sockets.
    ratio: f64,
    /// The ratio that is allowed.
    bar: Option<f64>,
    incomplete_cycles: u64,
}

pub(crate) fn run(arguments: Arguments, console: &mut Console) -> Answer {
    match arguments.what {
        What::Exchange {
            cycles,
            no_real_time,
        } => exchange(cycles, !no_real_time),
        What::Simulate { cycles } => simulated(cycles),
        What::Kills {
            count,
            stop,
            seed,
            run,
        } => endurance::troubles(count, &stop, seed, &run, console),
        What::Join { trials, run } => endurance::join(trials, &run, console),
        What::Failover(arguments) => failover::run(&arguments, console),
        What::Memory(arguments) => memory::run(&arguments),
        What::Scan(arguments) => scan::run(&arguments),
        What::Member { part } => member(&part),
    }
}

fn member(part: &str) -> Answer {
    let part = match serde_json::from_str(part) {
        Ok(part) => part,
        Err(error) => return Answer::failed(Status::BadInput, "U0607", error.to_string()),
    };
    match run_exchange_member(part, io::stdout()) {
        Ok(()) => Answer::done("", json!(null)),
        Err(error) => Answer::failed(Status::Failed, error.code(), error.to_string()),
    }
}

/// Cycles a second that the simulator has to reach.
const SIMULATED_BAR: f64 = 200_000.0;

/// The cluster of section V, without a folder.
pub(crate) fn simulated_press_cell() -> Result<Cluster, Answer> {
    let files = press_cell();
    let loaded = understudy_cluster::read(files[0].name, files[0].text, &mut |name| {
        let file = files.iter().find(|file| file.name == name);
        let text = file.map(|file| file.text.to_owned());
        text.ok_or_else(|| "no such file".to_owned())
    });
    loaded
        .cluster
        .ok_or_else(|| Answer::bad_files(loaded.reports))
}

fn simulated(cycles: u64) -> Answer {
    let cluster = match simulated_press_cell() {
        Ok(cluster) => cluster,
        Err(answer) => return answer,
    };
    let mut simulation = Simulation::new(parts(&cluster), Network::default(), 1);
    let start = Instant::now();
    if let Err(error) = simulation.run(cycles, PATIENCE_CYCLES, &mut |_, _, _, _| {}) {
        return Answer::failed(Status::Failed, "U0530", error.to_string());
    }
    let speed = cycles as f64 / start.elapsed().as_secs_f64();
    let violations = simulation.violations().len();
    let ratio = speed / SIMULATED_BAR;
    let text =
        format!("{speed:.0} cycles a second, {ratio:.2} of the bar, {violations} violations");
    let result = json!({ "cycles_per_second": speed, "ratio": ratio, "violations": violations });
    let status = if ratio >= 1.0 && violations == 0 {
        Status::Done
    } else {
        Status::Failed
    };
    Answer::done(text, result).with_status(status)
}

/// Cycles that the simulated cluster gets to come into step.
const PATIENCE_CYCLES: u64 = 1000;

/// Cycles from one kill to the next, and from a kill to the restart.
const KILL_EVERY: u64 = 60;
const RESTART_AFTER: u64 = 20;

/// The stations alone, killed one after the other, as the comparison with other arrangements needs it.
pub(crate) fn kills(
    count: u64,
    seed: u64,
    arguments: &RunArguments,
    console: &mut Console,
) -> Answer {
    let cell = match PressCell::write(arguments) {
        Ok(cell) => cell,
        Err(answer) => return answer,
    };
    let stations = cell.cluster.agreement().schedule.stations() as u64;
    let mut random = Pcg64Mcg::seed_from_u64(seed);
    let steps = (0..count).flat_map(|kill| {
        let member = Member::Station(StationId((kill % stations) as u8));
        let at_cycle = KILL_EVERY * kill + KILL_EVERY / 2;
        let crash = Fault {
            at_cycle,
            phase: random.random(),
            member,
            action: Action::Crash,
        };
        let restart = Fault {
            at_cycle: at_cycle + RESTART_AFTER,
            phase: random.random(),
            member,
            action: Action::Restart,
        };
        [crash, restart]
    });
    let scenario = Scenario {
        title: format!("{count} kills at random phases, from seed {seed}"),
        cycles: KILL_EVERY * (count + 1),
        steps: steps.collect(),
        expect: Expectation {
            held: Some(0),
            fail_safe: Some(0),
            ..Expectation::default()
        },
        ..Scenario::default()
    };
    cell.run(&scenario, arguments, None, console)
}

fn exchange(cycles: u64, real_time: bool) -> Answer {
    let settings = ExchangeSettings {
        cycles,
        period: PERIOD,
        real_time,
        sealed: true,
    };
    let carriers = [
        ("plain sockets", Carrier::Raw, None),
        ("udp", Carrier::Link(LinkKind::Udp), Some(1.5)),
        ("zenoh", Carrier::Link(LinkKind::Zenoh), Some(4.0)),
    ];
    let program = match std::env::current_exe() {
        Ok(program) => program,
        Err(error) => return Answer::failed(Status::Failed, "U0604", error.to_string()),
    };
    let mut list: Vec<Measured> = Vec::new();
    for (carrier, kind, bar) in carriers {
        let process = |part: &ExchangeMember| {
            let mut command = Command::new(&program);
            command.args(["bench", "member"]);
            command.arg(serde_json::to_string(part).unwrap_or_default());
            command
        };
        let found: Exchange = match measure(kind, settings, process) {
            Ok(found) => found,
            Err(error) => return Answer::failed(Status::Failed, error.code(), error.to_string()),
        };
        let p50_us = found.p50_ns as f64 / 1000.0;
        let yardstick = list.first().map_or(p50_us, |raw| raw.p50_us);
        list.push(Measured {
            carrier,
            p50_us,
            p99_us: found.p99_ns as f64 / 1000.0,
            ratio: p50_us / yardstick,
            bar,
            incomplete_cycles: found.incomplete_cycles,
        });
    }
    let within = list
        .iter()
        .all(|measured| measured.bar.is_none_or(|bar| measured.ratio <= bar));
    let mut text = format!(
        "{:14} {:>9} {:>9} {:>6} {:>6}\n",
        "carrier", "p50", "p99", "ratio", "bar"
    );
    for measured in &list {
        let bar = measured
            .bar
            .map_or(String::new(), |bar| format!("{bar:.1}"));
        let _ = writeln!(
            text,
            "{:14} {:>6.0} us {:>6.0} us {:>6.2} {bar:>6}",
            measured.carrier, measured.p50_us, measured.p99_us, measured.ratio
        );
    }
    let status = if within { Status::Done } else { Status::Failed };
    Answer::done(text, list).with_status(status)
}
