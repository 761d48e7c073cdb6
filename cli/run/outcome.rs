//! Circumstances, results and verdict of `demo`, `lab` and `simulate`.

use std::fmt::Write as _;
use std::path::Path;

use serde::Serialize;
use understudy_bus::Quantiles;
use understudy_cluster::Cluster;
use understudy_cycle::Mode;
use understudy_member::link_kind;
use understudy_scenarios::{Circumstances, RemoteIoSummary, Summary, Table, World};
use understudy_text::shell;

use crate::answer::{Answer, Status};
use crate::console;

pub(crate) fn circumstances(
    cluster: &Cluster,
    world: World,
    seed: Option<u64>,
    machine: Vec<String>,
    repeat: String,
) -> Circumstances {
    let agreement = cluster.agreement();
    Circumstances {
        world,
        seed,
        cluster: cluster.name().to_owned(),
        configuration: agreement.configuration.to_string(),
        mode: match agreement.mode {
            Mode::Full => "full",
            Mode::Paper => "paper",
        }
        .to_owned(),
        period_us: u64::try_from(agreement.schedule.period().as_micros()).unwrap_or(u64::MAX),
        link: match world {
            World::Laboratory => link_kind(cluster).to_string(),
            World::Simulator => "simulated".to_owned(),
        },
        version: env!("CARGO_PKG_VERSION").to_owned(),
        machine,
        repeat,
    }
}

/// Description of this machine.
pub(crate) fn machine() -> Vec<String> {
    let read = |path| std::fs::read_to_string(path).unwrap_or_default().trim().to_owned();
    let kernel = read("/proc/sys/kernel/osrelease");
    let processors = std::thread::available_parallelism().map_or(1, usize::from);
    vec![format!("{} {kernel}, {processors} processors", std::env::consts::OS)]
}

/// Command line that repeats this command.
pub(crate) fn command_line() -> String {
    let mut arguments: Vec<String> = std::env::args().collect();
    if let Some(program) = arguments.first_mut() {
        let name = Path::new(program).file_name();
        *program = name.unwrap_or_default().to_string_lossy().into_owned();
    }
    shell::line(arguments.iter().map(String::as_str))
}

#[derive(Serialize)]
struct Result<'a> {
    /// Directory of the results.
    directory: Option<String>,
    summary: &'a Summary,
}

/// Table II, the verdict on each plant, and the expectations that were not met.
pub(crate) fn answer(summary: &Summary, directory: Option<&Path>) -> Answer {
    let status = match (summary.passed, &summary.inconclusive) {
        (true, _) => Status::Done,
        (false, Some(_)) => Status::Inconclusive,
        (false, None) => Status::Failed,
    };
    let result = Result { directory: directory.map(|path| path.display().to_string()), summary };
    Answer::done(text(summary, directory), result).with_status(status)
}

fn text(summary: &Summary, directory: Option<&Path>) -> String {
    let mut text = format!("{}\n\n", summary.title);
    // Without cycles the tables are empty.
    if summary.cycles_run > 0 {
        push_cycles(&mut text, summary);
    }
    for expectation in summary.expectations.iter().filter(|expectation| !expectation.met) {
        let _ = writeln!(text, "NOT MET: {}; found {}", expectation.expected, expectation.found);
    }
    for alarm in &summary.alarms {
        let _ = writeln!(text, "alarm {alarm}");
    }
    for fault in &summary.network_faults {
        let _ = writeln!(text, "network fault {fault}");
    }
    if summary.network_fault_count > summary.network_faults.len() as u64 {
        let _ = writeln!(text, "network faults: {} in all", summary.network_fault_count);
    }
    for death in &summary.deaths {
        let _ = writeln!(text, "ENDED UNEXPECTEDLY: {death}");
        for line in &death.said {
            let _ = writeln!(text, "  {line}");
        }
    }
    if summary.death_count > summary.deaths.len() as u64 {
        let _ = writeln!(text, "ENDED UNEXPECTEDLY: {} in all", summary.death_count);
    }
    for outage in summary.outages.iter().take(5) {
        let _ = writeln!(text, "{outage}");
    }
    if summary.outage_count > 5 {
        let _ = writeln!(text, "failures of the whole plant: {} in all", summary.outage_count);
    }
    for violation in summary.violations.iter().take(5) {
        let _ = writeln!(text, "VIOLATION at {}: {}", violation.name, violation.what);
    }
    for refused in &summary.refused {
        let _ = writeln!(text, "REFUSED: {}: {}", refused.name, refused.why);
    }
    if let Some(reason) = &summary.journal.stopped_by {
        let lost = summary.journal.lost;
        let _ = writeln!(text, "the journal stopped ({reason}): {lost} records lost");
    }
    let _ = writeln!(text, "{}", summary.verdict());
    if !summary.passed && summary.circumstances.seed.is_some() {
        let _ = writeln!(text, "repeat with: {}", summary.circumstances.repeat);
    }
    if summary.was_late() {
        let lighter = match summary.circumstances.link.as_str() {
            "udp" => "",
            _ => ", or --link udp,",
        };
        let _ = writeln!(
            text,
            "no wrong output was applied; on a busy machine cycles are late: use a longer --period, such as 50ms{lighter}"
        );
    }
    if let Some(directory) = directory {
        let _ = writeln!(text, "report: {}", directory.join("report.html").display());
    }
    text
}

/// Table II with a line for each plant and each remote I/O.
fn push_cycles(text: &mut String, summary: &Summary) {
    let table = Table::new(summary);
    let _ = match console::terminal_columns() {
        Some(columns) => writeln!(text, "{table:columns$}"),
        None => writeln!(text, "{table}"),
    };
    let names = summary.remote_ios.iter().map(|remote_io| &remote_io.name);
    let names = names.chain(summary.plants.iter().map(|plant| &plant.name));
    let width = names.map(|name| name.chars().count()).max().unwrap_or(0);
    for plant in &summary.plants {
        let verdict = if plant.functional { "functional throughout" } else { "NOT FUNCTIONAL" };
        let plant_faults = match plant.plant_faults {
            0 => String::new(),
            plant_faults => format!(", {plant_faults} plant faults"),
        };
        let _ = writeln!(
            text,
            "{:width$}  {verdict}, {} parts finished{plant_faults}",
            plant.name, plant.finished
        );
    }
    for remote_io in &summary.remote_ios {
        let counts = &remote_io.counts;
        let numbers = [
            (counts.direct, "direct"),
            (counts.reconstructed, "reconstructed"),
            (counts.held, "held"),
            (counts.held_by_stall, "held in host stalls"),
            (counts.fail_safe, "fail-safe"),
            (counts.fail_safe_by_stall, "fail-safe in host stalls"),
            (counts.missed, "missed"),
        ];
        let shown = numbers.iter().filter(|(number, word)| *number > 0 || *word == "held");
        let shown: Vec<String> = shown.map(|(number, word)| format!("{number} {word}")).collect();
        let _ = writeln!(
            text,
            "{:width$}  {}, {} wrong",
            remote_io.name,
            shown.join(", "),
            counts.wrong
        );
    }
    push_times(text, &summary.remote_ios);
    text.push('\n');
}

/// How long the slowest remote I/O took from its samples to its outputs, and how late this machine woke it.
fn push_times(text: &mut String, remote_ios: &[RemoteIoSummary]) {
    let timed = remote_ios.iter().filter_map(|remote_io| {
        Some((remote_io.sample_to_output?, remote_io.wakeups?, remote_io.name.as_str()))
    });
    let Some((taken, late, name)) = timed.max_by_key(|(taken, ..)| taken.p999_ns) else {
        return;
    };
    let times = |of: Quantiles| {
        let [half, most, longest] =
            [of.p50_ns, of.p999_ns, of.maximum_ns].map(|ns| ns as f64 / 1e6);
        format!("half within {half:.2} ms, 99.9 % within {most:.2} ms, the longest {longest:.2} ms")
    };
    let _ = writeln!(text, "sample to output of {name}: {}", times(taken));
    let _ = writeln!(text, "late wake-ups of {name} by this machine: {}", times(late));
}
