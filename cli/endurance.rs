//! `understudy bench kills` and `bench join`: the press cell under many troubles, on real processes.

use std::fmt::Write as _;

use serde::Serialize;
use understudy_campaigns::{JOIN_CYCLES, Joined, Target, Trouble, TroubleRow, join_trial};
use understudy_member::link_kind;
use understudy_network::Share;

use crate::answer::{Answer, Status};
use crate::console::Console;
use crate::run::demo::PressCell;
use crate::run::lab::RunArguments;

/// What is lost in `bench join` where nobody says otherwise.
const LOSS: f64 = 0.1;

#[derive(Serialize)]
struct Row {
    link: String,
    directory: String,
    #[serde(flatten)]
    row: TroubleRow,
}

pub(crate) fn troubles(
    count: u64,
    stops: &[f64],
    seed: u64,
    arguments: &RunArguments,
    console: &mut Console,
) -> Answer {
    let troubles: Vec<Trouble> = if stops.is_empty() {
        vec![Trouble::Kill]
    } else {
        stops.iter().copied().map(Trouble::Stop).collect()
    };
    let mut rows = Vec::new();
    for trouble in troubles {
        for target in Target::ALL {
            match row(trouble, target, count, seed, arguments, console) {
                Ok(row) => rows.push(row),
                Err(answer) => return answer,
            }
        }
    }
    let mut text = format!(
        "{:24} {:13} {:>6} {:>6} {:>6} {:>9} {:>8} {:>8}\n",
        "trouble", "of", "count", "wrong", "held", "fail-safe", "missed", "by stall"
    );
    for Row { row, .. } in &rows {
        let _ = writeln!(
            text,
            "{:24} {:13} {:>6} {:>6} {:>6} {:>9} {:>8} {:>8}{}",
            row.trouble,
            row.target,
            row.count,
            row.wrong,
            row.held,
            row.fail_safe,
            row.missed,
            row.by_stall,
            if row.passed { "" } else { "  FAILED" }
        );
    }
    text.push_str(
        "cycles over all remote I/Os; while a remote I/O is gone nobody drives its own plant\n",
    );
    let passed = rows.iter().all(|row| row.row.passed);
    let status = if passed { Status::Done } else { Status::Failed };
    Answer::done(text, rows).with_status(status)
}

fn row(
    trouble: Trouble,
    target: Target,
    count: u64,
    seed: u64,
    arguments: &RunArguments,
    console: &mut Console,
) -> Result<Row, Answer> {
    let cell = PressCell::write(arguments)?;
    let schedule = &cell.cluster.agreement().schedule;
    let scenario = trouble
        .scenario(target, schedule, count, seed)
        .shortened(arguments.cycles);
    console.note(&scenario.title);
    let (summary, judged) = cell.judged(&scenario, arguments, console)?;
    if let Some(failure) = judged.failure {
        return Err(Answer::failed(
            Status::Failed,
            failure.code(),
            failure.to_string(),
        ));
    }
    Ok(Row {
        link: summary.circumstances.link.clone(),
        directory: cell.path().display().to_string(),
        row: TroubleRow::new(trouble, target, count, &summary),
    })
}

#[derive(Serialize)]
struct Trials {
    link: String,
    trials: u64,
    in_time: u64,
    /// In cycles, the longest; nothing where one never came.
    longest_start: Option<u64>,
    longest_join: Option<u64>,
    median_start: u64,
    median_join: u64,
    each: Vec<Joined>,
}

pub(crate) fn join(trials: u64, arguments: &RunArguments, console: &mut Console) -> Answer {
    let mut links = Vec::new();
    for (_, overrides) in arguments.overrides.each_link() {
        let mut each = Vec::new();
        let mut link = String::new();
        for trial in 0..trials {
            let loss = Share::new(LOSS).unwrap_or_default();
            let arguments = RunArguments {
                overrides: overrides.clone(),
                network: arguments.network.losing(loss).seeded(trial * 1000),
                ..arguments.clone()
            };
            let cell = match PressCell::write(&arguments) {
                Ok(cell) => cell,
                Err(answer) => return answer,
            };
            link = link_kind(&cell.cluster).to_string();
            let (station, scenario) = join_trial(trial, &cell.cluster.agreement().schedule);
            console.note(&format!("{link}, {}", scenario.title));
            match cell.judged(&scenario, &arguments, &mut Console::new(true)) {
                Ok((summary, _)) => each.push(Joined::new(station, &summary)),
                Err(answer) => return answer,
            }
        }
        links.push(summed_up(link, trials, each));
    }
    let mut text = format!(
        "{:6} {:>7} {:>8} {:>26} {:>26}\n",
        "link", "trials", "in time", "start, median and longest", "join, median and longest"
    );
    let never = |longest: Option<String>| longest.unwrap_or_else(|| "never".into());
    for link in &links {
        let start = never(link.longest_start.map(|start| start.to_string()));
        let join = never(link.longest_join.map(|join| join.to_string()));
        let _ = writeln!(
            text,
            "{:6} {:>7} {:>8} {:>26} {:>26}",
            link.link,
            link.trials,
            link.in_time,
            format!("{}, {start}", link.median_start),
            format!("{}, {join}", link.median_join),
        );
    }
    let _ = writeln!(text, "in cycles; in time is within {JOIN_CYCLES}");
    let all = links.iter().all(|link| link.in_time == link.trials);
    let status = if all { Status::Done } else { Status::Failed };
    Answer::done(text, links).with_status(status)
}

fn summed_up(link: String, trials: u64, each: Vec<Joined>) -> Trials {
    let mut starts: Vec<u64> = each.iter().filter_map(|joined| joined.start).collect();
    let mut joins: Vec<u64> = each.iter().filter_map(|joined| joined.join).collect();
    starts.sort_unstable();
    joins.sort_unstable();
    let all = |came: usize| came == each.len();
    Trials {
        link,
        trials,
        in_time: each.iter().filter(|joined| joined.is_in_time()).count() as u64,
        longest_start: starts.last().copied().filter(|_| all(starts.len())),
        longest_join: joins.last().copied().filter(|_| all(joins.len())),
        median_start: starts.get(starts.len() / 2).copied().unwrap_or_default(),
        median_join: joins.get(joins.len() / 2).copied().unwrap_or_default(),
        each,
    }
}
