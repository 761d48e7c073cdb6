//! `understudy-bench memory`: whether a long run needs more memory than a short one.

use std::fmt::Write as _;
use std::fs;

use clap::Args;
use serde::Serialize;
use understudy::{Answer, Status};
use understudy_scenarios::{Action, Fault, Network, parts};
use understudy_simulator::{Record, Simulation};
use understudy_wire::{Member, StationId};

use crate::simulate::{PATIENCE_CYCLES, not_ready, simulated_press_cell};

/// Growth that the system's own counting explains: less than a byte for each cycle of a long run.
const ALLOWED_KIB: u64 = 256;

/// From one failure to the next, and from a failure to the repair, in cycles.
const FAILURE_EVERY: u64 = 100;
const REPAIR_AFTER: u64 = 40;

/// Points at which the memory is read.
const POINTS: u64 = 10;

/// Measure the memory of a long simulated run with loss and failures
#[derive(Debug, Args)]
pub(crate) struct Arguments {
    /// Cycles to run
    #[arg(long, value_name = "N", default_value_t = 1_000_000, value_parser = clap::value_parser!(u64).range(1000..=1_000_000_000))]
    cycles: u64,
}

#[derive(Serialize)]
struct Found {
    /// Cycles and resident memory of this process after them, in KiB.
    points: Vec<(u64, u64)>,
    /// From the middle to the end; in the first half pages are touched for the first time.
    growth_kib: u64,
    allowed_kib: u64,
    violations: u64,
}

/// The press cell over a lossy network, with a station killed and restarted again and again.
pub(crate) fn run(arguments: &Arguments) -> Result<Answer, Answer> {
    let cluster = simulated_press_cell()?;
    let stations = cluster.agreement().schedule.stations() as u64;
    let network = Network { loss: 0.01, ..Network::default() };
    let mut simulation = Simulation::new(parts(&cluster), network, 1);
    // The simulation keeps every violation that it finds; here they are counted as they come.
    let mut violations = 0;
    let mut observe = |_: _, _: Option<u64>, _: Member, record: Record<'_>| {
        violations += u64::from(matches!(record, Record::Violation(_)));
    };
    simulation.run(0, PATIENCE_CYCLES, &mut observe).map_err(not_ready)?;
    let mut points = Vec::new();
    let mut next = arguments.cycles / POINTS;
    for failure in 0..arguments.cycles / FAILURE_EVERY {
        let at_cycle = failure * FAILURE_EVERY + 1;
        let member = Member::Station(StationId((failure % stations) as u8));
        for (at_cycle, action) in
            [(at_cycle, Action::Crash), (at_cycle + REPAIR_AFTER, Action::Restart)]
        {
            simulation.schedule(Fault { at_cycle, phase: 0.3, member, action });
        }
        let end = (failure + 1) * FAILURE_EVERY;
        simulation.go_on(end, &mut observe, &mut || false);
        if end >= next {
            points.push((end, resident_kib()?));
            next += arguments.cycles / POINTS;
        }
    }
    let middle = points.get(points.len() / 2).map_or(0, |(_, kib)| *kib);
    let growth_kib = points.last().map_or(0, |(_, kib)| kib.saturating_sub(middle));
    let mut text = String::new();
    for (cycles, kib) in &points {
        let _ = writeln!(text, "{cycles:>12} cycles {kib:>9} KiB");
    }
    let _ = writeln!(
        text,
        "{growth_kib} KiB more at the end than in the middle, {ALLOWED_KIB} allowed; {violations} violations"
    );
    let status =
        if growth_kib <= ALLOWED_KIB && violations == 0 { Status::Done } else { Status::Failed };
    let found = Found { points, growth_kib, allowed_kib: ALLOWED_KIB, violations };
    Ok(Answer::done(text, found).with_status(status))
}

/// Resident memory of this process.
fn resident_kib() -> Result<u64, Answer> {
    let read = || {
        let status = fs::read_to_string("/proc/self/status").ok()?;
        let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:"))?;
        line.split_whitespace().next()?.parse().ok()
    };
    read().ok_or_else(|| {
        let message =
            "the system does not say how much memory this process has (/proc/self/status)";
        Answer::failed(Status::Failed, "U0612", message)
    })
}
