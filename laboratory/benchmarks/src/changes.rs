//! `understudy-bench changes`: online changes of a program on processes, while any one member or the changing tool is killed at a random phase. Each change
//! renames the variable that counts, and every other one is taken back.

mod plant;

use std::fmt::Write as _;
use std::path::PathBuf;
use std::time::{Duration, Instant};

use clap::Args;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use serde::Serialize;
use understudy::{Answer, Console, Status};
use understudy_wire::{Member, ProgramId, StationId};

use plant::{Plant, Totals};

/// Change a program again and again, and kill a member or the changing tool at a random phase of each change
#[derive(Debug, Args)]
pub(crate) struct Arguments {
    /// Changes in all
    #[arg(long, default_value_t = 1000)]
    count: u32,
    /// Folder for the files of the cell; it is emptied
    #[arg(long, value_name = "DIR", default_value = "changes-bench")]
    folder: PathBuf,
    /// Seed of the failures and their phases
    #[arg(long, default_value_t = 1)]
    seed: u64,
}

/// Time limit for a step of a change, with all its repetitions.
const PATIENCE: Duration = Duration::from_secs(60);

/// Longest time from the start of a step to the failure.
const PHASES: Duration = Duration::from_millis(600);

/// Longest time from a kill to the restart.
const DOWN: Duration = Duration::from_millis(800);

/// What is killed in each change of a row.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Target {
    Tool,
    Stations,
    RemoteIos,
    /// Any of these, while a tenth of all frames is lost.
    AnyWithLoss,
}

/// What is killed in one change.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Victim {
    Tool,
    Member(Member),
}

impl Target {
    const ALL: [Self; 4] = [Self::Tool, Self::Stations, Self::RemoteIos, Self::AnyWithLoss];

    fn words(self) -> &'static str {
        match self {
            Self::Tool => "the tool",
            Self::Stations => "one station",
            Self::RemoteIos => "one remote I/O",
            Self::AnyWithLoss => "any, 10 % loss",
        }
    }

    fn victim(self, random: &mut Pcg64Mcg) -> Victim {
        let station = |random: &mut Pcg64Mcg| {
            Victim::Member(Member::Station(StationId(random.random_range(0..3))))
        };
        let remote_io = |random: &mut Pcg64Mcg| {
            Victim::Member(Member::RemoteIo(ProgramId(random.random_range(0..2))))
        };
        match self {
            Self::Tool => Victim::Tool,
            Self::Stations => station(random),
            Self::RemoteIos => remote_io(random),
            Self::AnyWithLoss => match random.random_range(0..6) {
                0 => Victim::Tool,
                1 | 2 => remote_io(random),
                _ => station(random),
            },
        }
    }

    /// Changes of this kind, of `count` in all.
    fn share(self, count: u32) -> u32 {
        let quarter = count / 4;
        if self == Self::Stations { count - 3 * quarter } else { quarter }
    }
}

/// Result of the changes of one kind.
#[derive(Debug, Serialize)]
struct Row {
    killed: &'static str,
    count: u32,
    directory: String,
    accepted: u32,
    cancelled: u32,
    /// Changes that were neither accepted nor cancelled in time.
    open: u32,
    /// Runs of the tool, without those that were killed.
    steps: u32,
    /// Those of them that were given again.
    repeated: u32,
    #[serde(flatten)]
    totals: Totals,
}

pub(crate) fn run(arguments: &Arguments, console: &mut Console) -> Result<Answer, Answer> {
    let mut random = Pcg64Mcg::seed_from_u64(arguments.seed);
    let mut rows = Vec::new();
    let _ = std::fs::remove_dir_all(&arguments.folder);
    for (number, of) in Target::ALL.into_iter().enumerate() {
        let count = of.share(arguments.count);
        if count > 0 {
            let folder = arguments.folder.join(number.to_string());
            let loses = of == Target::AnyWithLoss;
            let plant = Plant::start(&folder, count, loses)?;
            console.note(&format!("{count} changes, {} killed", of.words()));
            rows.push(row(of, count, plant, &mut random, console)?);
        }
    }
    Ok(answer(&rows))
}

fn row(
    of: Target,
    count: u32,
    mut plant: Plant,
    random: &mut Pcg64Mcg,
    console: &mut Console,
) -> Result<Row, Answer> {
    let mut row = Row {
        killed: of.words(),
        count,
        directory: plant.directory(),
        accepted: 0,
        cancelled: 0,
        open: 0,
        steps: 0,
        repeated: 0,
        totals: Totals::default(),
    };
    for number in 0..count {
        plant.wait_until_protected()?;
        let end = if random.random_range(0..2) == 0 { "accept" } else { "cancel" };
        let victim = of.victim(random);
        let failing = random.random_range(0..3_usize);
        let mut is_open = false;
        for (place, step) in ["prepare", "switch", end].into_iter().enumerate() {
            let victim = (place == failing).then_some(victim);
            let phases = [PHASES, DOWN].map(|longest| longest.mul_f64(random.random::<f64>()));
            let done = given(&mut plant, step, victim, phases, &mut row)?;
            is_open |= !done;
        }
        match end {
            _ if is_open => {
                row.open += 1;
                console.note(&format!("{number}: {victim:?}, {end}: {}", plant.last_words()));
                // The next one begins from a change that is over.
                if !given(&mut plant, "cancel", None, [Duration::ZERO; 2], &mut row)? {
                    break;
                }
            }
            "accept" => {
                row.accepted += 1;
                plant.accepted();
            }
            _ => row.cancelled += 1,
        }
    }
    row.totals = plant.end()?;
    Ok(row)
}

/// Gives a step until it is done, and kills meanwhile; whether it was done in time.
fn given(
    plant: &mut Plant,
    step: &str,
    victim: Option<Victim>,
    [phase, down]: [Duration; 2],
    row: &mut Row,
) -> Result<bool, Answer> {
    let begun = Instant::now();
    let mut tool = plant.change(step)?;
    match victim {
        None => {}
        Some(Victim::Tool) => {
            std::thread::sleep(phase);
            tool.kill();
            tool = plant.change(step)?;
        }
        Some(Victim::Member(member)) => {
            std::thread::sleep(phase);
            plant.kill(member)?;
            std::thread::sleep(down);
            plant.restart(member)?;
        }
    }
    row.steps += 1;
    while !plant.is_done(tool)? {
        if begun.elapsed() > PATIENCE {
            return Ok(false);
        }
        std::thread::sleep(Duration::from_millis(100));
        tool = plant.change(step)?;
        row.steps += 1;
        row.repeated += 1;
    }
    Ok(true)
}

fn answer(rows: &[Row]) -> Answer {
    let mut text = format!(
        "{:15} {:>7} {:>9} {:>10} {:>5} {:>6} {:>9} {:>6} {:>5} {:>10} {:>7} {:>9}\n",
        "killed",
        "changes",
        "accepted",
        "cancelled",
        "open",
        "steps",
        "repeated",
        "wrong",
        "held",
        "fail-safe",
        "missed",
        "by stall"
    );
    for row in rows {
        let totals = &row.totals;
        let _ = writeln!(
            text,
            "{:15} {:>7} {:>9} {:>10} {:>5} {:>6} {:>9} {:>6} {:>5} {:>10} {:>7} {:>9}",
            row.killed,
            row.count,
            row.accepted,
            row.cancelled,
            row.open,
            row.steps,
            row.repeated,
            totals.wrong,
            totals.held,
            totals.fail_safe,
            totals.missed,
            totals.by_stall
        );
    }
    text.push_str(
        "held, fail-safe and missed are deadlines of all remote I/Os; one that is killed drives nothing until it is started again\n",
    );
    let is_right = |row: &Row| {
        let ended = row.accepted + row.cancelled == row.count;
        let masked = matches!(row.killed, "the tool" | "one station");
        let lost = row.totals.held + row.totals.fail_safe;
        ended && row.totals.wrong == 0 && (!masked || lost == 0)
    };
    let status = if rows.iter().all(is_right) { Status::Done } else { Status::Failed };
    Answer::done(text, rows).with_status(status)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_change_has_a_kind_and_every_member_its_turn() {
        for count in [0, 1, 7, 30, 1000] {
            let shares = Target::ALL.iter().map(|of| of.share(count));
            assert_eq!(shares.sum::<u32>(), count);
        }
        let mut random = Pcg64Mcg::seed_from_u64(1);
        let victims: Vec<Victim> =
            (0..200).map(|_| Target::AnyWithLoss.victim(&mut random)).collect();
        let members = (0..3)
            .map(|rank| Member::Station(StationId(rank)))
            .chain((0..2).map(|program| Member::RemoteIo(ProgramId(program))));
        let all = members.map(Victim::Member).chain([Victim::Tool]);
        for victim in all {
            assert!(victims.contains(&victim), "{victim:?}");
        }
    }
}
