//! `understudy-bench spares`: groups that share one spare, on processes. In each round a station is killed, and the understudy of its group
//! after it.

mod group;
mod witness;

use std::fmt::Write as _;
use std::fs::File;
use std::io::{BufRead, BufReader, Read as _, Seek as _, SeekFrom};
use std::path::PathBuf;
use std::process::{Child, Stdio};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use clap::Args;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use serde::Serialize;
use understudy::{Answer, Console, Status};

use group::Group;
pub(crate) use group::failed;
use witness::Counts;

use crate::children::understudy_command;

/// Kill a station and then the understudy of its group, with a spare that several groups share
#[derive(Debug, Args)]
pub(crate) struct Arguments {
    /// Rounds
    #[arg(long, default_value_t = 200)]
    rounds: u32,
    /// Groups that share the spare
    #[arg(long, default_value_t = 3, value_parser = clap::value_parser!(u8).range(1..=8))]
    groups: u8,
    /// Cycles for which a station is flagged before the spare wakes
    #[arg(long, default_value_t = 20)]
    spare_after: u32,
    /// Time from the first kill to the second one
    #[arg(long, default_value = "500ms", value_parser = understudy_text::duration::parse_positive)]
    second_after: Duration,
    /// State of one program of each group in KiB; the press cell where absent
    #[arg(long)]
    state: Option<usize>,
    /// Folder for the files of the groups; it is emptied
    #[arg(long, value_name = "DIR", default_value = "spares-bench")]
    folder: PathBuf,
    /// Do not request real-time scheduling and locked memory
    #[arg(long)]
    no_real_time: bool,
    /// Seed of the victims and the phases
    #[arg(long, default_value_t = 1)]
    seed: u64,
}

/// Period of the groups.
const PERIOD: Duration = Duration::from_millis(10);

/// Time after which what is waited for will not come.
const PATIENCE: Duration = Duration::from_secs(60);

/// Time after the second kill in which outputs are counted.
const OBSERVED: Duration = Duration::from_secs(1);

/// Time limit for full protection.
const PROTECTED_WITHIN: Duration = Duration::from_secs(10);

const LOOK: Duration = Duration::from_millis(2);

/// One round.
#[derive(Debug, Clone, Serialize)]
struct Round {
    group: String,
    first: String,
    second: String,
    /// From the kill to the moment at which every program of the group was protected again; nothing where that did not come.
    protected_ms: Option<f64>,
    /// Held and fail-safe deadlines from the kill to that moment.
    before: u64,
    /// Held and fail-safe deadlines after it, until 1 s after the second kill.
    after: u64,
    /// Stalls that members of the group and the spare reported in the round.
    stalls: u64,
}

/// The result.
#[derive(Debug, Serialize)]
struct Found {
    rounds: Vec<Round>,
    spare_after: u32,
    second_after_ms: f64,
    wrong: u64,
    unjudged: u64,
    /// Share of a core that the spare took while all groups were complete, before the first round.
    waiting_cpu: f64,
}

pub(crate) fn run(arguments: &Arguments, console: &mut Console) -> Result<Answer, Answer> {
    let _ = std::fs::remove_dir_all(&arguments.folder);
    let mut random = Pcg64Mcg::seed_from_u64(arguments.seed);
    let mut groups = Vec::new();
    for number in 1..=arguments.groups {
        let folder = arguments.folder.join(format!("line-{number}"));
        let name = format!("line-{number}");
        let real_time = !arguments.no_real_time;
        groups.push(Group::start(&folder, &name, arguments.state, real_time)?);
    }
    let mut spare = Spare::start(arguments, &groups)?;
    for group in &groups {
        group.until(PATIENCE, |counts| counts.is_protected == Some(true))?;
        spare.until(&format!("{}: watches it", group.name), 1)?;
    }
    let waiting_cpu = spare.cpu_share(Duration::from_secs(30));
    let mut rounds = Vec::new();
    for number in 0..arguments.rounds {
        let place = random.random_range(0..groups.len());
        let phase = PERIOD.mul_f64(random.random::<f64>());
        let victim = random.random_range(0..3_usize);
        std::thread::sleep(phase);
        let round = round(&mut groups[place], victim, arguments, &mut spare)?;
        console.note(&format!(
            "{number}: {} {} and {}: protected after {:?} ms, held {} and {}",
            round.group, round.first, round.second, round.protected_ms, round.before, round.after
        ));
        rounds.push(round);
    }
    let all: Vec<Counts> = groups.iter().flat_map(Group::counts).collect();
    let found = Found {
        rounds,
        spare_after: arguments.spare_after,
        second_after_ms: arguments.second_after.as_secs_f64() * 1e3,
        wrong: all.iter().map(|counts| counts.wrong).sum(),
        unjudged: all.iter().map(|counts| counts.gaps).sum(),
        waiting_cpu,
    };
    Ok(answer(&found))
}

fn round(
    group: &mut Group,
    victim: usize,
    arguments: &Arguments,
    spare: &mut Spare,
) -> Result<Round, Answer> {
    let stations = group.stations();
    let first = stations[victim].clone();
    // The understudy is the last one; where it is the first victim, a controller is the second.
    let second = stations[if victim == 2 { 0 } else { 2 }].clone();
    let (begun, stalls) = (group.counts(), group.stalls() + spare.stalls());
    let retired = spare.count("retires");
    let killed = Instant::now();
    let killed_ns = witness::monotonic_ns();
    group.kill(&first)?;
    let is_back = |group: &Group| {
        let counts = group.counts();
        let lost = counts.iter().any(|of| of.unprotected_ns > killed_ns);
        let last = counts.iter().map(|of| of.protected_ns).max().unwrap_or(0);
        (lost && counts.iter().all(|of| of.is_protected == Some(true))).then_some(last)
    };
    let mut protected_ns = None;
    // A second failure before that would not be masked: the round is late.
    while killed.elapsed() < arguments.second_after
        || protected_ns.is_none() && killed.elapsed() < PROTECTED_WITHIN
    {
        protected_ns = protected_ns.or_else(|| is_back(group));
        std::thread::sleep(LOOK);
    }
    let missed = |group: &Group, from: &[Counts]| -> u64 {
        let now = group.counts();
        now.iter().zip(from).map(|(now, from)| now.missed() - from.missed()).sum()
    };
    let before = missed(group, &begun);
    let middle = group.counts();
    group.kill(&second)?;
    std::thread::sleep(OBSERVED);
    let after = missed(group, &middle);
    let stalls = group.stalls() + spare.stalls() - stalls;
    group.start_station(&first)?;
    group.start_station(&second)?;
    spare.until("retires", retired + 1)?;
    group.until(PATIENCE, |counts| counts.is_protected == Some(true))?;
    Ok(Round {
        group: group.name.clone(),
        first,
        second,
        protected_ms: protected_ns.map(|ns| (ns - killed_ns) as f64 / 1e6),
        before,
        after,
        stalls,
    })
}

fn answer(found: &Found) -> Answer {
    let rounds = &found.rounds;
    let mut times: Vec<f64> = rounds.iter().filter_map(|round| round.protected_ms).collect();
    times.sort_by(f64::total_cmp);
    let at = |share: f64| {
        let place = (times.len() as f64 * share).ceil() as usize;
        times.get(place.saturating_sub(1)).copied().unwrap_or(f64::NAN)
    };
    let never = rounds.len() - times.len();
    let limit = found.second_after_ms;
    let late = times.iter().filter(|ms| **ms > limit).count();
    let before: u64 = rounds.iter().map(|round| round.before).sum();
    let in_time = rounds.iter().filter(|round| round.protected_ms.is_some());
    let after: u64 = in_time.clone().map(|round| round.after).sum();
    let unexplained: u64 = in_time.filter(|round| round.stalls == 0).map(|round| round.after).sum();
    let cycles = |ms: f64| ms / PERIOD.as_secs_f64() / 1e3 - f64::from(found.spare_after);
    let mut text = format!(
        "{} rounds: {} wrong, {} gaps in the judgement\n\
         held or fail-safe: {before} from the first kill to full protection, {after} after it ({unexplained} in rounds without a stall)\n",
        rounds.len(),
        found.wrong,
        found.unjudged,
    );
    let _ = writeln!(
        text,
        "kill to full protection: p50 {:.0} ms, p99 {:.0} ms, longest {:.0} ms; cycles after spare_after ({}): {:.0}, {:.0}, {:.0}; {late} after more than {limit:.0} ms, {never} not at all",
        at(0.5),
        at(0.99),
        at(1.0),
        found.spare_after,
        cycles(at(0.5)),
        cycles(at(0.99)),
        cycles(at(1.0)),
    );
    let _ = writeln!(
        text,
        "the spare takes {:.3} % of a core while it waits",
        found.waiting_cpu * 100.0
    );
    let passed =
        found.wrong == 0 && found.unjudged == 0 && unexplained == 0 && late == 0 && never == 0;
    let status = if passed { Status::Done } else { Status::Failed };
    Answer::done(text, found).with_status(status)
}

/// The spare as a process, and what it has reported.
struct Spare {
    process: Child,
    said: Arc<Mutex<Vec<String>>>,
    /// The journal of its station in each group, with its length when it was read last.
    journals: Vec<(PathBuf, u64)>,
    stalls: u64,
}

impl Spare {
    fn start(arguments: &Arguments, groups: &[Group]) -> Result<Self, Answer> {
        let mut plant = String::new();
        let mut slots = Vec::new();
        for Group { name, .. } in groups {
            let _ = writeln!(
                plant,
                "[[group]]\nname = \"{name}\"\ncluster = \"{name}/cluster.toml\"\n"
            );
            slots.push(format!("{name} = \"spare\""));
        }
        let _ = writeln!(
            plant,
            "[[spare]]\nname = \"spare-1\"\ngroups = {{ {} }}\nspare_after = {}\nretire_after = \"500ms\"",
            slots.join(", "),
            arguments.spare_after
        );
        let file = arguments.folder.join("plant.toml");
        std::fs::write(&file, plant).map_err(|error| failed("plant.toml", &error))?;
        let keys = arguments.folder.join("keys");
        std::fs::create_dir_all(&keys).map_err(|error| failed("keys", &error))?;
        for Group { name, folder, .. } in groups {
            let members = std::fs::canonicalize(folder.join("keys/members"));
            let members = members.map_err(|error| failed("keys", &error))?;
            std::os::unix::fs::symlink(members, keys.join(name))
                .map_err(|error| failed("keys", &error))?;
        }
        let mut command = understudy_command()?;
        command.arg("spare").arg(&file).args(["--name", "spare-1", "--keys"]).arg(&keys);
        let journals = arguments.folder.join("journals");
        command.arg("--ends-with-parent").arg("--journals").arg(&journals);
        if arguments.no_real_time {
            command.arg("--no-real-time");
        }
        command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::piped());
        let mut process = command.spawn().map_err(|error| failed("the spare", &error))?;
        let said: Arc<Mutex<Vec<String>>> = Arc::default();
        if let Some(errors) = process.stderr.take() {
            let said = Arc::clone(&said);
            std::thread::spawn(move || {
                for line in BufReader::new(errors).lines().map_while(Result::ok) {
                    said.lock().unwrap_or_else(PoisonError::into_inner).push(line);
                }
            });
        }
        let of = |group: &Group| (journals.join(format!("{}.jsonl", group.name)), 0);
        let journals = groups.iter().map(of).collect();
        Ok(Self { process, said, journals, stalls: 0 })
    }

    /// Stalls that its stations have reported so far.
    fn stalls(&mut self) -> u64 {
        for (path, length) in &mut self.journals {
            let mut told = String::new();
            // There is none before its station has been awake.
            if let Ok(mut journal) = File::open(path)
                && journal.seek(SeekFrom::Start(*length)).is_ok()
                && journal.read_to_string(&mut told).is_ok()
            {
                *length += told.len() as u64;
                self.stalls += told.matches("\"event\":\"stalled\"").count() as u64;
            }
        }
        self.stalls
    }

    /// Lines so far that contain a text.
    fn count(&self, text: &str) -> usize {
        let said = self.said.lock().unwrap_or_else(PoisonError::into_inner);
        said.iter().filter(|line| line.contains(text)).count()
    }

    fn until(&self, text: &str, count: usize) -> Result<(), Answer> {
        let begun = Instant::now();
        while self.count(text) < count {
            if begun.elapsed() > PATIENCE {
                let said = self.said.lock().unwrap_or_else(PoisonError::into_inner).join("; ");
                let message = format!("the spare has not reported `{text}` {count} times: {said}");
                return Err(Answer::failed(Status::Failed, "U0530", message));
            }
            std::thread::sleep(LOOK);
        }
        Ok(())
    }

    /// Share of a core that the process takes in a time.
    fn cpu_share(&self, time: Duration) -> f64 {
        // The first number is the time on a processor in nanoseconds. A thread that ends meanwhile takes its time with it; those of a spare do not.
        let used_ns = || -> u64 {
            let tasks = std::fs::read_dir(format!("/proc/{}/task", self.process.id()));
            let tasks = tasks.into_iter().flatten().filter_map(Result::ok);
            let of = |task: std::fs::DirEntry| -> Option<u64> {
                let text = std::fs::read_to_string(task.path().join("schedstat")).ok()?;
                text.split_whitespace().next()?.parse().ok()
            };
            tasks.filter_map(of).sum()
        };
        let (before, begun) = (used_ns(), Instant::now());
        std::thread::sleep(time);
        used_ns().saturating_sub(before) as f64 / begun.elapsed().as_nanos() as f64
    }
}

impl Drop for Spare {
    fn drop(&mut self) {
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}
