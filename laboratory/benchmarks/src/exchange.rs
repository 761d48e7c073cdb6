//! `understudy-bench exchange`: from the first frame of a cycle to its last turn, at the cycle master.
//!
//! Three carriers are measured with one pattern of eight broadcasts among seven processes: plain sockets ([`Carrier::Raw`], the
//! yardstick), and the two links with a machine that does nothing but follow the pattern.
//!
//! ```text
//! station 1   Sync ───────────────── Turn ─┐                                  ┌─ received: the exchange ends
//! remote I/Os      └ Sample Sample Sample ┘└ station 2: Turn └ station 3: Turn └ station 4: Turn
//! ```

pub(crate) mod meter;
mod pattern;
mod process;
mod raw;

use std::fmt::Write as _;
use std::time::Duration;

use clap::Args;
use serde::Serialize;
use understudy::{Answer, Status};
use understudy_bus::LinkKind;

use process::{Carrier, Settings, measure};
pub(crate) use process::{MemberArguments, run_member};

/// Measure the exchange of a cycle, compared with plain sockets
///
/// From the first frame of a cycle to its last turn: 4 stations and 3 remote I/Os as processes.
#[derive(Debug, Args)]
pub(crate) struct Arguments {
    /// Complete cycles of each carrier
    #[arg(long, default_value_t = 1000, value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    cycles: u32,
    /// Do not ask for real-time rights
    #[arg(long)]
    no_real_time: bool,
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

pub(crate) fn run(arguments: &Arguments) -> Result<Answer, Answer> {
    let settings =
        Settings { cycles: arguments.cycles, period: PERIOD, real_time: !arguments.no_real_time };
    let carriers = [
        ("plain sockets", Carrier::Raw, None),
        ("udp", Carrier::Link(LinkKind::Udp), Some(1.2)),
        ("zenoh", Carrier::Link(LinkKind::Zenoh), Some(4.0)),
    ];
    let mut list: Vec<Measured> = Vec::new();
    for (carrier, kind, bar) in carriers {
        let found = measure(kind, settings)?;
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
    let mut text =
        format!("{:14} {:>9} {:>9} {:>6} {:>6}\n", "carrier", "p50", "p99", "ratio", "bar");
    for measured in &list {
        let bar = measured.bar.map_or(String::new(), |bar| format!("{bar:.1}"));
        let _ = writeln!(
            text,
            "{:14} {:>6.0} us {:>6.0} us {:>6.2} {bar:>6}",
            measured.carrier, measured.p50_us, measured.p99_us, measured.ratio
        );
    }
    let within = list.iter().all(|measured| measured.bar.is_none_or(|bar| measured.ratio <= bar));
    let status = if within { Status::Done } else { Status::Failed };
    Ok(Answer::done(text, list).with_status(status))
}
