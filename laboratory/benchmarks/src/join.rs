//! `understudy-bench join`: time until a cluster, and a restarted station, are synchronised where frames are lost.

use std::fmt::Write as _;

use clap::Args;
use serde::Serialize;
use understudy::{Answer, ClusterRun, Console, RunArguments, Status};
use understudy_cycle::Schedule;
use understudy_member::link_kind;
use understudy_network::Share;
use understudy_scenarios::{Action, Fault, Presence, Scenario, Summary};
use understudy_wire::{Member, StationId};

/// Start clusters and restart stations while frames are lost, over each link
#[derive(Debug, Args)]
pub(crate) struct Arguments {
    /// Trials over each link
    #[arg(long, default_value_t = 50)]
    trials: u64,
    #[command(flatten)]
    run: RunArguments,
}

/// Share of lost frames without `--loss`.
const LOSS: f64 = 0.1;

/// Cycles within which all stations must be synchronised.
const JOIN_CYCLES: u64 = 100;

/// Cycles in which the station of a trial is killed and restarted.
const KILLED_AT: u64 = 20;
const RESTARTED_AT: u64 = 40;

/// A trial: the cluster starts, then one station, another one in each trial, is killed and restarted.
fn scenario(trial: u64, schedule: &Schedule) -> (StationId, Scenario) {
    let station = StationId((trial % schedule.stations() as u64) as u8);
    let step =
        |at_cycle, action| Fault { at_cycle, phase: 0.0, member: Member::Station(station), action };
    let scenario = Scenario {
        title: format!("trial {trial}: a cluster starts, and a station joins"),
        cycles: RESTARTED_AT + JOIN_CYCLES + KILLED_AT,
        steps: vec![step(KILLED_AT, Action::Crash), step(RESTARTED_AT, Action::Restart)],
        ..Scenario::default()
    };
    (station, scenario)
}

/// Result of a trial; times in cycles, `None` if it never happened.
#[derive(Debug, Serialize)]
struct Joined {
    /// From the first cycle of the cluster to the first one in which all stations were synchronised.
    start: Option<u64>,
    /// From the restart of the station to its first turn.
    join: Option<u64>,
    /// Wrong outputs.
    wrong: u64,
}

impl Joined {
    fn new(station: StationId, summary: &Summary) -> Self {
        let restart = summary.steps.last().map(|step| step.measured);
        let intervals = summary.stations.get(station.index());
        let join = restart.zip(intervals).and_then(|(restart, found)| {
            let mut on = found.intervals.iter().filter(|interval| interval.state == Presence::On);
            let first = on.find(|interval| interval.to > restart)?;
            Some(first.from.saturating_sub(restart))
        });
        // As `epoch:cycle`, where an epoch counts from 0.
        let origin = summary.origin.as_deref();
        let start = origin.and_then(|origin| origin.rsplit_once(':')?.1.parse().ok());
        Self {
            start,
            join: join.filter(|_| summary.steps.len() == 2),
            wrong: summary.violation_count,
        }
    }

    /// Whether everything came in time and nothing was wrong.
    fn is_in_time(&self) -> bool {
        self.wrong == 0
            && self.start.is_some_and(|start| start <= JOIN_CYCLES)
            && self.join.is_some_and(|join| join <= JOIN_CYCLES)
    }
}

/// Results over one link; times in cycles.
#[derive(Debug, Serialize)]
struct Trials {
    link: String,
    trials: u64,
    in_time: u64,
    /// `None` if one never happened.
    longest_start: Option<u64>,
    longest_join: Option<u64>,
    median_start: u64,
    median_join: u64,
    each: Vec<Joined>,
}

pub(crate) fn run(arguments: &Arguments, console: &mut Console) -> Result<Answer, Answer> {
    let links = arguments.run.overrides.each_link();
    let links = links.into_iter().map(|(_, overrides)| {
        let run = RunArguments { overrides, ..arguments.run.clone() };
        trials(arguments.trials, &run, console)
    });
    let links: Result<Vec<Trials>, Answer> = links.collect();
    Ok(answer(&links?))
}

fn trials(trials: u64, arguments: &RunArguments, console: &mut Console) -> Result<Trials, Answer> {
    let mut each = Vec::new();
    let mut link = String::new();
    for trial in 0..trials {
        let loss = Share::new(LOSS).unwrap_or_default();
        let arguments = RunArguments {
            network: arguments.network.losing(loss).seeded(trial * 1000),
            ..arguments.clone()
        };
        let cell = ClusterRun::press_cell(&arguments)?;
        link = link_kind(&cell.cluster).to_string();
        let (station, scenario) = scenario(trial, &cell.cluster.agreement().schedule);
        console.note(&format!("{link}, {}", scenario.title));
        let (summary, _) = cell.judged(&scenario, &arguments, &mut Console::new(true))?;
        each.push(Joined::new(station, &summary));
    }
    let sorted = |time: fn(&Joined) -> Option<u64>| {
        let mut times: Vec<u64> = each.iter().filter_map(time).collect();
        times.sort_unstable();
        times
    };
    let longest = |times: &[u64]| times.last().copied().filter(|_| times.len() == each.len());
    let median = |times: &[u64]| times.get(times.len() / 2).copied().unwrap_or_default();
    let (starts, joins) = (sorted(|joined| joined.start), sorted(|joined| joined.join));
    Ok(Trials {
        link,
        trials,
        in_time: each.iter().filter(|joined| joined.is_in_time()).count() as u64,
        longest_start: longest(&starts),
        longest_join: longest(&joins),
        median_start: median(&starts),
        median_join: median(&joins),
        each,
    })
}

fn answer(links: &[Trials]) -> Answer {
    let mut text = format!(
        "{:6} {:>7} {:>8} {:>26} {:>26}\n",
        "link", "trials", "in time", "start, median and longest", "join, median and longest"
    );
    let or_never =
        |longest: Option<u64>| longest.map_or("never".to_owned(), |longest| longest.to_string());
    for link in links {
        let _ = writeln!(
            text,
            "{:6} {:>7} {:>8} {:>26} {:>26}",
            link.link,
            link.trials,
            link.in_time,
            format!("{}, {}", link.median_start, or_never(link.longest_start)),
            format!("{}, {}", link.median_join, or_never(link.longest_join)),
        );
    }
    let _ = writeln!(text, "in cycles; in time is within {JOIN_CYCLES}");
    let all = links.iter().all(|link| link.in_time == link.trials);
    let status = if all { Status::Done } else { Status::Failed };
    Answer::done(text, links).with_status(status)
}
