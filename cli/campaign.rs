//! `understudy campaign`: runs with faults by chance, over all kinds of faults, and each failure made small.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

use clap::{Args, Subcommand, ValueEnum};
use serde::Serialize;
use understudy_bus::interruption;
use understudy_campaigns::{
    Findings, InjectionPlan, Kind, MAXIMUM_RUN_CYCLES, MINIMUM_RUN_CYCLES, Property, Shard, inject,
    merge, picture,
};

use crate::answer::{Answer, Status};
use crate::console::Console;
use crate::files;
use crate::overrides::OverrideArguments;
use crate::simulate::seed_of_the_clock;

/// Inject faults by chance in many simulated runs, and make every failure a small scenario
#[derive(Debug, Args)]
#[command(
    args_conflicts_with_subcommands = true,
    subcommand_negates_reqs = true,
    after_help = "\
Example:
  understudy campaign examples/press-cell/cluster.toml --runs 2000 --seed 1 --out campaign
  understudy campaign examples/press-cell/cluster.toml --runs 1000000 --seed 1 --shard 3/8 --out shard-3
  understudy campaign merge shard-* --out campaign

The same seed and runs give the same findings on any number of processors and shards. DIR gets campaign.json, campaign.html and
a scenario for each failure, which `understudy simulate` repeats. Exit status 1 when a run failed, or not all were made; Ctrl-C
keeps what was found so far."
)]
pub(crate) struct Arguments {
    #[command(subcommand)]
    merge: Option<Merge>,
    /// The cluster file
    #[arg(value_name = "CLUSTER.toml", required = true)]
    cluster: Option<PathBuf>,
    /// Runs of the whole campaign
    #[arg(long, value_name = "N", default_value_t = 1000, value_parser = clap::value_parser!(u64).range(1..=1_000_000_000_000))]
    runs: u64,
    /// What all chance comes from; by default taken from the clock, and printed
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(..=i64::MAX as u64))]
    seed: Option<u64>,
    /// Cycles of each run
    #[arg(long, value_name = "N", default_value_t = 200, value_parser = clap::value_parser!(u64).range(MINIMUM_RUN_CYCLES..=MAXIMUM_RUN_CYCLES))]
    cycles: u64,
    /// What is hunted for
    #[arg(long, value_enum, default_value_t = PropertyArgument::Wrong)]
    property: PropertyArgument,
    /// Kinds of faults, by default all; flipped bits only where there is an understudy
    #[arg(long, value_name = "KIND,...", value_delimiter = ',', value_parser = parse_kinds)]
    faults: Vec<Vec<Kind>>,
    /// No run is begun after this time, such as 10min; the findings say how many were made
    #[arg(long, value_name = "TIME", value_parser = parse_budget)]
    budget: Option<Duration>,
    /// Processors to use, by default all
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    jobs: Option<u16>,
    /// Run only the K-th of N parts of this seed; `merge` makes one of them
    #[arg(long, value_name = "K/N", default_value = "1/1", requires = "seed")]
    shard: Shard,
    #[command(flatten)]
    overrides: OverrideArguments,
    /// Where to keep the findings; without it only the answer remains
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

#[derive(Debug, Subcommand)]
enum Merge {
    /// Make one of the shards of a campaign
    #[command(after_help = "Example:\n  understudy campaign merge shard-* --out campaign")]
    Merge {
        /// Where the shards are kept
        #[arg(value_name = "DIR", required = true)]
        shards: Vec<PathBuf>,
        /// Where to keep the findings; without it only the answer remains
        #[arg(long, value_name = "DIR")]
        out: Option<PathBuf>,
    },
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum PropertyArgument {
    /// An output that is neither true, nor held in its time, nor fail-safe
    Wrong,
    /// A cycle with held outputs
    Held,
    /// A cycle with fail-safe outputs
    FailSafe,
    /// Somebody who is not synchronised again 100 cycles after the last fault
    Unprotected,
}

#[derive(Debug, Serialize)]
struct Found<'a> {
    /// Where the findings are kept.
    directory: Option<String>,
    /// The scenario of each failure, in the order of the findings.
    scenarios: Vec<String>,
    findings: &'a Findings,
}

pub(crate) fn run(arguments: &Arguments, console: &mut Console) -> Answer {
    let answer = match (&arguments.merge, &arguments.cluster) {
        (Some(Merge::Merge { shards, out }), _) => merged(shards, out.as_deref()),
        (None, Some(cluster)) => campaign(arguments, cluster, console),
        // The parser asks for one of both.
        (None, None) => Ok(Answer::done("", ())),
    };
    answer.unwrap_or_else(|failed| failed)
}

fn campaign(arguments: &Arguments, path: &Path, console: &mut Console) -> Result<Answer, Answer> {
    let (cluster, reports) = files::cluster(path, arguments.overrides.overrides())?;
    let mut kinds: Vec<Kind> = arguments.faults.iter().flatten().copied().collect();
    if kinds.is_empty() {
        kinds = Kind::masked_by(cluster.understudies().len());
    }
    kinds.sort_unstable();
    kinds.dedup();
    let plan = InjectionPlan {
        runs: arguments.runs,
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
    };
    let processors = std::thread::available_parallelism().map_or(1, usize::from);
    let threads = arguments.jobs.map_or(processors, usize::from);
    let bar = console.bar(
        plan.shard.share(plan.runs),
        "run {pos} of {len}, {eta} left",
    );
    let interrupted = interruption()
        .map_err(|error| Answer::failed(Status::Failed, error.code(), error.to_string()))?;
    let start = Instant::now();
    let in_time = || {
        bar.inc(1);
        let in_budget = arguments
            .budget
            .is_none_or(|budget| start.elapsed() < budget);
        in_budget && !interrupted.load(Ordering::Relaxed)
    };
    let findings = inject(&cluster, &plan, threads, &in_time)
        .map_err(|error| Answer::failed(Status::Failed, "U0530", error.to_string()))?;
    let took = start.elapsed();
    bar.finish_and_clear();
    let mut answer = kept(&findings, arguments.out.as_deref())?
        .with_used(reports)
        .and_next(&[&"model-check", &path, &"--faults", &"1", &"--cycles", &"2"]);
    if interrupted.load(Ordering::Relaxed) {
        answer.text.push_str(&format!(
            "interrupted: these are partial findings, of {} of {} runs\n",
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

fn merged(shards: &[PathBuf], out: Option<&Path>) -> Result<Answer, Answer> {
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
        return Err(failures
            .into_iter()
            .fold(Answer::done("", ()), |answer, failure| {
                answer.and_failure(Status::BadInput, &failure.code, failure.message)
            }));
    };
    kept(&findings, out)
}

/// Writes the findings where they are to be kept, and answers with them.
fn kept(findings: &Findings, out: Option<&Path>) -> Result<Answer, Answer> {
    let mut scenarios = Vec::new();
    let mut text = findings.to_string();
    if let Some(out) = out {
        fs::create_dir_all(out).map_err(|error| {
            let message = format!("{} cannot be written: {error}", out.display());
            Answer::failed(Status::Failed, "U0602", message)
        })?;
        let page = picture(findings)
            .map_err(|error| Answer::failed(Status::Failed, "U0602", error.to_string()))?;
        files::write(&out.join("campaign.json"), &findings.to_json())?;
        files::write(&out.join("campaign.html"), &page)?;
        for failure in &findings.failures {
            let path = out.join(failure.file_name());
            files::write(&path, &failure.scenario)?;
            scenarios.push(path.display().to_string());
        }
        text.push_str(&format!("kept in {}\n", out.display()));
    } else if let Some(failure) = findings.failures.first() {
        text.push_str(&format!("\nThe first of them:\n\n{}", failure.scenario));
    }
    let status = if findings.is_good() {
        Status::Done
    } else {
        Status::Failed
    };
    let found = Found {
        directory: out.map(|out| out.display().to_string()),
        scenarios,
        findings,
    };
    Ok(Answer::done(text, found).with_status(status))
}

fn parse_kinds(text: &str) -> Result<Vec<Kind>, String> {
    if text == "all" {
        return Ok(Kind::ALL.to_vec());
    }
    let kind = Kind::ALL.into_iter().find(|kind| kind.word() == text);
    kind.map(|kind| vec![kind]).ok_or_else(|| {
        let known: Vec<&str> = Kind::ALL.into_iter().map(Kind::word).collect();
        format!(
            "there is no fault {text:?}; known are all, {}",
            known.join(", ")
        )
    })
}

/// `90s`, `10min`, `2h`.
fn parse_budget(text: &str) -> Result<Duration, String> {
    let expected = || format!("{text:?} is no time with its unit, such as 90s, 10min or 2h");
    let unit = text
        .find(|letter: char| letter.is_ascii_alphabetic())
        .ok_or_else(expected)?;
    let (number, unit) = text.split_at(unit);
    let seconds = match unit {
        "ms" => 1e-3,
        "s" => 1.0,
        "min" => 60.0,
        "h" => 3600.0,
        _ => return Err(expected()),
    };
    let number: f64 = number.trim().parse().map_err(|_| expected())?;
    let time = number * seconds;
    if (0.0..1e7).contains(&time) {
        Ok(Duration::from_secs_f64(time))
    } else {
        Err(expected())
    }
}
