//! `understudy campaign`: random fault injection in simulation; failing runs are shrunk to minimal ones.

mod store;

use std::path::{Path, PathBuf};
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

use clap::{Args, Subcommand, ValueEnum};
use serde::Serialize;
use understudy_bus::interruption;
use understudy_campaigns::{
    Findings, InjectionPlan, Kind, MAXIMUM_RUN_CYCLES, MINIMUM_RUN_CYCLES, Property, Shard, Store,
    inject, merge, picture,
};

use crate::answer::{Answer, Status};
use crate::console::Console;
use crate::files;
use crate::overrides::OverrideArguments;
use crate::run::simulate::seed_of_the_clock;

/// Number of runs of a campaign without a store.
const USUAL_RUNS: u64 = 1000;

/// Inject random faults in simulation and shrink failing runs
#[derive(Debug, Args)]
#[command(
    args_conflicts_with_subcommands = true,
    subcommand_negates_reqs = true,
    after_help = "\
Example:
  understudy campaign examples/press-cell/cluster.toml --runs 2000 --seed 1 --out campaign
  understudy campaign examples/press-cell/cluster.toml --runs 20 --seed 1 --shard 1/2 --out shard-1
  understudy campaign examples/press-cell/cluster.toml --runs 20 --seed 1 --shard 2/2 --out shard-2
  understudy campaign merge shard-* --out campaign
  understudy campaign examples/press-cell/cluster.toml --forever store --seeds 2 --runs 20 --out campaign

Equal seeds and numbers of runs give equal findings on any number of processors and shards. DIR receives campaign.json, campaign.html and
a scenario for each failure, which `understudy simulate` replays. Ctrl-C ends the campaign with partial findings.

With `--forever` a process runs seeds that are not yet in STORE, a folder that any number of processes and machines share, and keeps the findings of
each: the smallest and the fastest failure for each set of kinds of faults. A process that is killed loses the seed that it was running.

Exit status: 4 if a run failed, 1 if none failed and the campaign is incomplete."
)]
pub(crate) struct Arguments {
    #[command(subcommand)]
    merge: Option<Merge>,
    /// Cluster file
    #[arg(value_name = "CLUSTER.toml", required = true)]
    cluster: Option<PathBuf>,
    /// Number of runs of the whole campaign; default: 1000. With --forever, of each seed; default: runs for about a minute on one processor
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..=1_000_000_000_000))]
    runs: Option<u64>,
    /// Seed of all random numbers; the default is taken from the clock and printed
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(..=i64::MAX as u64))]
    seed: Option<u64>,
    /// Number of cycles of each run
    #[arg(long, value_name = "N", default_value_t = 200, value_parser = clap::value_parser!(u64).range(MINIMUM_RUN_CYCLES..=MAXIMUM_RUN_CYCLES))]
    cycles: u64,
    /// Property that fails a run
    #[arg(long, value_enum, default_value_t = PropertyArgument::Wrong)]
    property: PropertyArgument,
    /// Kinds of faults; default: all, flipped bits only in a cluster with an understudy
    #[arg(long, value_name = "KIND,...", value_delimiter = ',', value_parser = parse_kinds)]
    faults: Vec<Vec<Kind>>,
    /// Time limit for starting runs, such as 10min; the findings state the number of runs completed
    #[arg(long, value_name = "TIME", value_parser = understudy_text::duration::parse)]
    budget: Option<Duration>,
    /// Number of processors; default: all
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    jobs: Option<u16>,
    /// Run only part K of N of this seed; `merge` combines the parts
    #[arg(long, value_name = "K/N", default_value = "1/1", requires = "seed")]
    shard: Shard,
    /// Run seeds that have no findings in this folder, without end; any number of processes share it
    #[arg(long, id = "STORE", conflicts_with_all = ["seed", "shard"])]
    forever: Option<PathBuf>,
    /// Seeds 0 to N-1 only: the campaign ends when all of them are in the store
    #[arg(long, value_name = "N", requires = "STORE", value_parser = clap::value_parser!(u64).range(1..))]
    seeds: Option<u64>,
    /// The spares of the cluster wake when a station has been flagged for N cycles, and retire when the cluster has been complete for as many;
    /// without it they do not wake
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=100_000))]
    spare_after: Option<u32>,
    #[command(flatten)]
    overrides: OverrideArguments,
    /// Directory for the findings; without it they are only printed
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

#[derive(Debug, Subcommand)]
enum Merge {
    /// Combine the shards of a campaign, or stores of one campaign
    #[command(after_help = "\
Example:
  understudy campaign examples/press-cell/cluster.toml --runs 20 --seed 1 --shard 1/2 --out shard-1
  understudy campaign examples/press-cell/cluster.toml --runs 20 --seed 1 --shard 2/2 --out shard-2
  understudy campaign merge shard-* --out campaign")]
    Merge {
        /// Directories of the shards, or stores
        #[arg(value_name = "DIR", required = true)]
        shards: Vec<PathBuf>,
        /// Directory for the findings; without it they are only printed
        #[arg(long, value_name = "DIR")]
        out: Option<PathBuf>,
    },
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum PropertyArgument {
    /// An applied output is wrong: not proved, not held within its time, not fail-safe
    Wrong,
    /// Outputs are held in a cycle
    Held,
    /// Outputs are fail-safe in a cycle
    FailSafe,
    /// A member is not synchronised 100 cycles after the last fault
    Unprotected,
}

#[derive(Debug, Serialize)]
struct Found<'a> {
    /// Directory of the findings.
    directory: Option<String>,
    /// Scenario file of each failure, in the order of the findings.
    scenarios: Vec<String>,
    findings: &'a Findings,
}

pub(crate) fn run(arguments: &Arguments, console: &mut Console) -> Result<Answer, Answer> {
    match (&arguments.merge, &arguments.cluster) {
        (Some(Merge::Merge { shards, out }), _) => merged(shards, out.as_deref()),
        (None, Some(cluster)) => campaign(arguments, cluster, console),
        // The parser requires one of the two.
        (None, None) => Ok(Answer::done("", ())),
    }
}

fn campaign(arguments: &Arguments, path: &Path, console: &mut Console) -> Result<Answer, Answer> {
    let (cluster, reports) = files::cluster(path, arguments.overrides.overrides())?;
    if arguments.spare_after.is_some() && cluster.agreement().schedule.spare_slots().is_empty() {
        let message = format!(
            "--spare-after is for a cluster with a slot (`spare = true`), and {} has none",
            path.display()
        );
        return Err(Answer::failed(Status::BadInput, "U0600", message));
    }
    let mut kinds: Vec<Kind> = arguments.faults.iter().flatten().copied().collect();
    if kinds.is_empty() {
        kinds = Kind::masked_by(cluster.lasting_understudies());
    }
    kinds.sort_unstable();
    kinds.dedup();
    let plan = InjectionPlan {
        runs: arguments.runs.unwrap_or_else(|| match arguments.forever {
            Some(_) => Store::usual_runs(&cluster, arguments.cycles),
            None => USUAL_RUNS,
        }),
        seed: arguments.seed.unwrap_or_else(seed_of_the_clock),
        cycles: arguments.cycles,
        property: match arguments.property {
            PropertyArgument::Wrong => Property::Wrong,
            PropertyArgument::Held => Property::Held,
            PropertyArgument::FailSafe => Property::FailSafe,
            PropertyArgument::Unprotected => Property::Unprotected,
        },
        kinds,
        shard: arguments.shard,
        spare_after: arguments.spare_after,
    };
    if let Some(folder) = &arguments.forever {
        let answer = store::run(arguments, &cluster, folder, &plan, console)?;
        return Ok(answer.with_used(reports));
    }
    let threads = threads(arguments);
    let bar = console.bar(plan.shard.share(plan.runs), "run {pos} of {len}, {eta} left");
    let interrupted = interruption()?;
    let start = Instant::now();
    let in_time = || {
        bar.inc(1);
        let in_budget = arguments.budget.is_none_or(|budget| start.elapsed() < budget);
        in_budget && !interrupted.load(Ordering::Relaxed)
    };
    let findings = inject(&cluster, &plan, threads, &in_time)
        .map_err(|error| Answer::failed(Status::Failed, "U0530", error))?;
    let took = start.elapsed();
    bar.finish_and_clear();
    let mut answer = kept(&findings, arguments.out.as_deref())?.with_used(reports).and_next(&[
        &"model-check",
        &path,
        &"--faults",
        &"1",
        &"--cycles",
        &"2",
    ]);
    if interrupted.load(Ordering::Relaxed) {
        answer.text.push_str(&format!(
            "interrupted: partial findings of {} of {} runs\n",
            findings.runs_made, findings.runs_asked
        ));
    }
    let seconds = took.as_secs_f64();
    let cycles = findings.runs_made * plan.cycles;
    answer.text.push_str(&format!(
        "{seconds:.1} s on {threads} processors, {:.0} cycles a second\n",
        cycles as f64 / seconds
    ));
    Ok(answer)
}

/// Number of threads that make runs.
fn threads(arguments: &Arguments) -> usize {
    let processors = std::thread::available_parallelism().map_or(1, usize::from);
    arguments.jobs.map_or(processors, usize::from)
}

fn merged(shards: &[PathBuf], out: Option<&Path>) -> Result<Answer, Answer> {
    if shards.iter().any(|folder| Store::is_in(folder)) {
        return kept(&store::merged(shards)?, out);
    }
    let mut read = Vec::new();
    let mut failures = Vec::new();
    for folder in shards {
        let path = folder.join("campaign.json");
        let text = match files::text(&path) {
            Ok(text) => text,
            Err(failed) => {
                failures.extend(failed.failures);
                continue;
            }
        };
        match Findings::parse(&text) {
            Ok(findings) => read.push((folder.display().to_string(), findings)),
            Err(error) => failures.push(crate::answer::Failure {
                code: "U0610".to_owned(),
                message: format!("{}: {error}", path.display()),
            }),
        }
    }
    let findings = if failures.is_empty() {
        merge(read).map_err(|errors| {
            let messages = errors.iter().map(ToString::to_string);
            messages.fold(Answer::done("", ()), |answer, message| {
                answer.and_failure(Status::BadInput, "U0611", message)
            })
        })?
    } else {
        return Err(failures.into_iter().fold(Answer::done("", ()), |answer, failure| {
            answer.and_failure(Status::BadInput, &failure.code, failure.message)
        }));
    };
    kept(&findings, out)
}

/// Writes the findings to their directory and prints them.
fn kept(findings: &Findings, out: Option<&Path>) -> Result<Answer, Answer> {
    let mut scenarios = Vec::new();
    let mut text = findings.to_string();
    if let Some(out) = out {
        files::make_folder(out)?;
        let page =
            picture(findings).map_err(|error| Answer::failed(Status::Failed, "U0602", error))?;
        files::write(&out.join("campaign.json"), &findings.to_json())?;
        files::write(&out.join("campaign.html"), &page)?;
        for failure in &findings.failures {
            let path = out.join(failure.file_name());
            files::write(&path, &failure.scenario)?;
            scenarios.push(path.display().to_string());
        }
        text.push_str(&format!("kept in {}\n", out.display()));
    } else if let Some(failure) = findings.failures.first() {
        text.push_str(&format!("\nFirst failure:\n\n{}", failure.scenario));
    }
    let status = match findings.is_good() {
        true => Status::Done,
        false if findings.runs_failed > 0 => Status::Found,
        false => Status::Failed,
    };
    let found = Found { directory: out.map(|out| out.display().to_string()), scenarios, findings };
    Ok(Answer::done(text, found).with_status(status))
}

fn parse_kinds(text: &str) -> Result<Vec<Kind>, String> {
    if text == "all" {
        return Ok(Kind::ALL.to_vec());
    }
    let kind = Kind::ALL.into_iter().find(|kind| kind.word() == text);
    kind.map(|kind| vec![kind]).ok_or_else(|| {
        let known: Vec<&str> = Kind::ALL.into_iter().map(Kind::word).collect();
        format!("unknown fault {text:?}; known: all, {}", known.join(", "))
    })
}
