//! `understudy-bench timing`: exchange, and sample to output, of whole clusters on processes of this machine, with its own wake-ups.
//!
//! The *exchange* is measured at the understudy, which receives every turn: from the first frame of a cycle to the last turn, its own included.
//! *Sample to output* is measured at each remote I/O, from the sample to the outputs that are proved for it; it has the deadline in it, at
//! 0.65 of a period.

mod observed;
mod process;

use std::fmt::Write as _;
use std::time::{Duration, Instant};

use clap::{Args, ValueEnum};
use serde::Serialize;
use understudy::{Answer, Console};
use understudy_bus::{Quantiles, Wakefulness};
use understudy_cycle::Turns;
use understudy_text::duration::parse_positive;

use process::{Case, Together, measure};
pub(crate) use process::{TimedArguments, run_timed};

/// All clusters together take at most so long: one that could take longer is not begun.
const BUDGET: Duration = Duration::from_secs(285);
/// For so long the wake-ups of the machine are measured.
const SLEEPING: Duration = Duration::from_secs(2);

/// Measure the exchange and the time from sample to output of whole clusters
///
/// One understudy, and a process for each member; over UDP on this machine.
#[derive(Debug, Args)]
pub(crate) struct Arguments {
    /// Numbers of controllers
    #[arg(long, value_name = "N", value_delimiter = ',', default_values_t = [16, 32, 64], value_parser = clap::value_parser!(u8).range(1..=64))]
    controllers: Vec<u8>,
    /// Periods
    #[arg(long, value_name = "TIME", value_delimiter = ',', default_values = ["1ms", "2ms", "5ms"], value_parser = parse_positive)]
    period: Vec<Duration>,
    /// Schedules
    #[arg(long, value_enum, value_delimiter = ',', default_values_t = [Schedule::Token, Schedule::Parallel])]
    schedule: Vec<Schedule>,
    /// Seconds that each cluster is measured for
    #[arg(long, default_value_t = 5, value_parser = clap::value_parser!(u64).range(1..=3600))]
    seconds: u64,
    /// Number of times that each cyclic frame is sent; on one machine none is lost, and the sender does the work of the network
    #[arg(long, default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=4))]
    copies: u32,
    /// Do not ask for real-time rights
    #[arg(long)]
    no_real_time: bool,
    /// Members wait actively, as with `spin = true`: each on a core that it claims, for as many members as there are cores to claim
    #[arg(long)]
    spin: bool,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Schedule {
    Token,
    Parallel,
}

#[derive(Serialize)]
struct Found {
    machine: Machine,
    clusters: Vec<Row>,
}

/// What the figures are to be read with.
#[derive(Serialize)]
struct Machine {
    processors: usize,
    real_time: bool,
    wakeups: Quantiles,
}

#[derive(Serialize)]
struct Row {
    period_us: f64,
    controllers: usize,
    schedule: Turns,
    copies: u32,
    /// Members that reported, of all.
    members: usize,
    of_members: usize,
    exchange: Quantiles,
    incomplete_cycles: u64,
    sample_to_output: Quantiles,
    /// Deadlines without a proved output, of all deadlines of the remote I/Os.
    missed: u64,
    deadlines: u64,
    /// Of the members, while they ran.
    wakeups: Quantiles,
    /// Processors that the members used together.
    processors: f64,
}

impl Row {
    fn new(case: Case, together: &Together) -> Self {
        let measured = &together.measured;
        Self {
            period_us: case.period.as_secs_f64() * 1e6,
            controllers: case.controllers,
            schedule: case.schedule,
            copies: case.copies,
            members: together.members,
            of_members: together.of_members,
            exchange: measured.exchange.quantiles(),
            incomplete_cycles: measured.incomplete_cycles,
            sample_to_output: measured.sample_to_output.quantiles(),
            missed: measured.missed,
            deadlines: measured.deadlines,
            wakeups: measured.wakeups.quantiles(),
            processors: together.processors,
        }
    }

    fn line(&self) -> String {
        let schedule = match self.schedule {
            Turns::Token => "token",
            Turns::Parallel => "parallel",
        };
        let missed = format!("{}/{}", self.missed, self.deadlines);
        let mut line = format!(
            "{:>6.1} {:>4} {schedule:9} {} {} {missed:>15} {} {:>6.2}",
            self.period_us / 1000.0,
            self.controllers,
            times(&self.exchange),
            times(&self.sample_to_output),
            times(&self.wakeups),
            self.processors,
        );
        if self.members < self.of_members {
            let _ = write!(line, "  {} of {} members reported", self.members, self.of_members);
        }
        line
    }
}

/// p50, p99.9 and the longest, in microseconds.
fn times(quantiles: &Quantiles) -> String {
    if quantiles.count == 0 {
        return format!("{:>7} {:>7} {:>7}", "-", "-", "-");
    }
    let [p50, p999, maximum] = [quantiles.p50_ns, quantiles.p999_ns, quantiles.maximum_ns]
        .map(|ns| format!("{:>7.0}", ns as f64 / 1000.0));
    format!("{p50} {p999} {maximum}")
}

const HEADING: &str = "\
                      |      exchange, us      |  sample to output, us  |     missed    |      wake-ups, us      |   CPUs
period    N schedule       p50   p99.9     max      p50   p99.9     max    of deadlines     p50   p99.9     max   in use";

pub(crate) fn run(arguments: &Arguments, console: &mut Console) -> Result<Answer, Answer> {
    let began = Instant::now();
    let slept = Wakefulness::measure(SLEEPING, !arguments.no_real_time);
    let machine = Machine {
        processors: std::thread::available_parallelism().map_or(1, usize::from),
        real_time: slept.real_time,
        wakeups: slept.late.quantiles(),
    };
    let mut text = format!(
        "{} processors, real time {}; {slept}\n{HEADING}\n",
        machine.processors,
        if machine.real_time { "granted" } else { "not granted" },
    );
    let mut clusters = Vec::new();
    let cases = arguments.period.iter().flat_map(|period| {
        let controllers = arguments.controllers.iter();
        controllers.flat_map(move |controllers| {
            let schedules = arguments.schedule.iter();
            schedules.map(move |schedule| Case {
                controllers: usize::from(*controllers),
                period: *period,
                schedule: match schedule {
                    Schedule::Token => Turns::Token,
                    Schedule::Parallel => Turns::Parallel,
                },
                copies: arguments.copies,
                measured_for: Duration::from_secs(arguments.seconds),
                real_time: !arguments.no_real_time,
                spin: arguments.spin,
            })
        })
    });
    for case in cases {
        if !clusters.is_empty() && began.elapsed() + case.longest() > BUDGET {
            let _ = writeln!(text, "no time was left for the others");
            break;
        }
        let row = Row::new(case, &measure(case)?);
        console.note(&row.line());
        let _ = writeln!(text, "{}", row.line());
        clusters.push(row);
    }
    Ok(Answer::done(text, Found { machine, clusters }))
}
