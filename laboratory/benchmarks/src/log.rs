//! `understudy-bench log`: what the log costs a station while it is switched off.
//!
//! A place is a span or an event in the code. For each frame that a station receives or sends there is one of each, and
//! one more span for each cycle. The time of a place is measured here, with the subscriber of a member; the number of
//! places and the processor time of a station come from a run of the press cell.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::fs;
use std::hint::black_box;
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use clap::Args;
use serde::Serialize;
use serde_json::Value;
use tracing::{trace, trace_span};
use understudy::{Answer, ClusterRun, Console, RunArguments, Status};
use understudy_bus::LogSettings;
use understudy_scenarios::Scenario;

/// Measure the cost of the log while it is switched off
#[derive(Debug, Args)]
pub(crate) struct Arguments {
    #[command(flatten)]
    run: RunArguments,
}

/// Cycles without `--cycles`.
const CYCLES: u64 = 2000;

/// Share of a station's processor time that is allowed.
const ALLOWED_SHARE: f64 = 0.01;

/// Frames of a round, so few that it is over before another process gets the processor; the fastest of all rounds
/// counts.
const FRAMES: u64 = 1000;
const ROUNDS: usize = 1000;

/// Places of a frame: its span, and the event in it.
const PLACES_OF_A_FRAME: u64 = 2;

/// From one look at the processes to the next.
const LOOK_EVERY: Duration = Duration::from_millis(100);

/// A station of the run.
#[derive(Debug, Serialize)]
struct Row {
    station: String,
    places_per_cycle: f64,
    nanoseconds_per_place: f64,
    processor_us_per_cycle: f64,
    /// The part of the processor time of a cycle that the places of the log take.
    share: f64,
}

pub(crate) fn run(arguments: &Arguments, console: &mut Console) -> Result<Answer, Answer> {
    let log = LogSettings::default().start();
    let rounds = (0..ROUNDS).map(|_| nanoseconds_per_place());
    let nanoseconds = rounds.fold(f64::INFINITY, f64::min);
    let scenario = Scenario {
        title: "the log is switched off".to_owned(),
        cycles: arguments.run.cycles.unwrap_or(CYCLES),
        ..Scenario::default()
    };
    let cell = ClusterRun::press_cell(&arguments.run)?;
    let ended = AtomicBool::new(false);
    let (summary, spent) = std::thread::scope(|scope| {
        let watched = scope.spawn(|| {
            let mut spent = BTreeMap::new();
            while !ended.load(Ordering::Relaxed) {
                look(cell.path(), &mut spent);
                std::thread::sleep(LOOK_EVERY);
            }
            spent
        });
        let judged = cell.judged(&scenario, &arguments.run, console);
        ended.store(true, Ordering::Relaxed);
        let spent = watched.join().unwrap_or_default();
        judged.map(|(summary, _)| (summary, spent))
    })?;
    let cycles = summary.cycles_run.max(1);
    let frames = frames(&cell.path().join("journal.jsonl"));
    let mut rows = Vec::new();
    for (station, spent) in spent {
        let Some(frames) = frames.get(&station) else { continue };
        let places = (frames * PLACES_OF_A_FRAME) as f64 / cycles as f64 + 1.0;
        let spent = spent as f64 / cycles as f64;
        rows.push(Row {
            station,
            places_per_cycle: places,
            nanoseconds_per_place: nanoseconds,
            processor_us_per_cycle: spent / 1000.0,
            share: places * nanoseconds / spent.max(1.0),
        });
    }
    if let Some(log) = log {
        log.finish();
    }
    Ok(answer(rows))
}

fn answer(rows: Vec<Row>) -> Answer {
    let mut text = format!(
        "{:12} {:>15} {:>13} {:>17} {:>8}\n",
        "station", "places a cycle", "time a place", "time a cycle", "share"
    );
    for row in &rows {
        let _ = writeln!(
            text,
            "{:12} {:>15.1} {:>10.2} ns {:>14.0} us {:>6.3} %",
            row.station,
            row.places_per_cycle,
            row.nanoseconds_per_place,
            row.processor_us_per_cycle,
            row.share * 100.0
        );
    }
    let within = !rows.is_empty() && rows.iter().all(|row| row.share <= ALLOWED_SHARE);
    let status = if within { Status::Done } else { Status::Failed };
    Answer::done(text, rows).with_status(status)
}

/// One round of what the loop of a member does for the log.
fn nanoseconds_per_place() -> f64 {
    let begin = Instant::now();
    for number in 0..FRAMES {
        let sender = black_box(number);
        let _frame = trace_span!("frame", kind = "turn", ?sender).entered();
        trace!(bytes = sender, "sent");
    }
    begin.elapsed().as_nanos() as f64 / (FRAMES * PLACES_OF_A_FRAME) as f64
}

/// Processor time in nanoseconds of each station of the run in `folder` that lives, by its name.
fn look(folder: &Path, spent: &mut BTreeMap<String, u64>) {
    let folder = folder.to_string_lossy();
    for process in fs::read_dir("/proc").into_iter().flatten().filter_map(Result::ok) {
        let Ok(line) = fs::read(process.path().join("cmdline")) else { continue };
        let line = String::from_utf8_lossy(&line);
        let words: Vec<&str> = line.split('\0').collect();
        let name = words.iter().position(|word| *word == "--name").map(|at| words.get(at + 1));
        if let (Some(&"node"), true, Some(Some(name))) =
            (words.get(1), line.contains(&*folder), name)
        {
            let tasks = fs::read_dir(process.path().join("task")).into_iter().flatten();
            let times = tasks.filter_map(Result::ok).filter_map(|task| {
                let text = fs::read_to_string(task.path().join("schedstat")).ok()?;
                text.split_whitespace().next()?.parse::<u64>().ok()
            });
            let time = times.sum::<u64>();
            let known = spent.entry((*name).to_owned()).or_default();
            *known = time.max(*known);
        }
    }
}

/// Frames that each member has received and sent, from the last record of its journal.
fn frames(journal: &Path) -> BTreeMap<String, u64> {
    let text = fs::read_to_string(journal).unwrap_or_default();
    let records = text.lines().filter_map(|line| serde_json::from_str::<Value>(line).ok());
    let stopped = records.filter(|record| record["event"]["event"] == "stopped");
    let counts = stopped.filter_map(|record| {
        let count = |key: &str| record["event"][key].as_u64();
        let frames = count("frames_heard")? + count("frames_said")?;
        Some((record["name"].as_str()?.to_owned(), frames))
    });
    counts.collect()
}
