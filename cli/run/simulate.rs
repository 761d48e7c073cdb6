//! `understudy simulate`: a cluster and a scenario in virtual time.

use std::path::PathBuf;
use std::time::{SystemTime, UNIX_EPOCH};

use clap::Args;
use understudy_journal::{
    JOURNAL_LIMIT_BYTES, Journal, JournalState, Record, RunDirectory, RunEvent, keep_cluster,
};
use understudy_processes::simulated_only;
use understudy_scenarios::{Summary, World, simulate as run_simulation, write_results};

use crate::answer::{Answer, Status};
use crate::files;
use crate::overrides::OverrideArguments;
use crate::run::lab::scenario_or_undisturbed;
use crate::run::outcome::{answer, circumstances, machine};

/// Run a cluster and a scenario in virtual time
#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  understudy simulate examples/press-cell/cluster.toml --scenario scenarios/lossy.toml --seed 7

Equal files and seeds give equal runs. A failed run prints the command that repeats it.")]
pub(crate) struct Arguments {
    /// Cluster file
    #[arg(value_name = "CLUSTER.toml")]
    cluster: PathBuf,
    /// Scenario file; without it the cluster runs undisturbed
    #[arg(long, value_name = "FILE")]
    scenario: Option<PathBuf>,
    /// Seed of all random numbers; default: the scenario's, otherwise taken from the clock and printed
    #[arg(long, value_name = "N")]
    seed: Option<u64>,
    /// Number of cycles, overrides the scenario; later steps and expectations are ignored
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..=understudy_scenarios::MAXIMUM_CYCLES))]
    cycles: Option<u64>,
    #[command(flatten)]
    overrides: OverrideArguments,
    /// Directory for the run; without it the run is not stored
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

pub(crate) fn run(arguments: &Arguments) -> Result<Answer, Answer> {
    let overrides = arguments.overrides.overrides();
    let (cluster, reports) = files::cluster(&arguments.cluster, overrides)?;
    let scenario = scenario_or_undisturbed(arguments.scenario.as_deref(), &cluster)?
        .shortened(arguments.cycles);
    let seed = arguments.seed.or(scenario.seed);
    let seed = seed.unwrap_or_else(seed_of_the_clock);
    let directory = arguments.out.as_deref().map(files::run_directory);
    let directory = directory.transpose()?;
    let mut journal = None;
    if let Some(directory) = &directory {
        keep_cluster(directory.path(), &arguments.cluster, &cluster)
            .map_err(files::unwritable_run)?;
        let path = directory.file("journal.jsonl");
        let created = Journal::create(&path, JOURNAL_LIMIT_BYTES);
        journal = Some(created.map_err(|error| files::unwritable(&path, &error))?);
    }
    let mut last_ns = 0;
    let account = run_simulation(&cluster, &scenario, seed, &mut |record| {
        last_ns = record.at_ns;
        if let Some(journal) = &mut journal {
            journal.write(record);
        }
    });
    let account = match account {
        Ok(account) => account,
        Err(error) => {
            let message = format!("{error}; repeat with: {}", repeat(arguments, seed));
            return Err(Answer::failed(Status::Failed, "U0530", message).with_used(reports));
        }
    };
    let journal = journal.map_or_else(JournalState::default, |mut journal| {
        journal.write(&Record::of_run(last_ns, RunEvent::Finished));
        journal.finish()
    });
    let repeat = repeat(arguments, seed);
    let circumstances = circumstances(&cluster, World::Simulator, Some(seed), machine(), repeat);
    let (summary, account) = Summary::new(account, &scenario, circumstances, journal);
    let written =
        directory.as_ref().map_or(Ok(()), |directory| write_results(directory, &summary, &account));
    let mut answer =
        answer(&summary, directory.as_ref().map(RunDirectory::path)).with_used(reports);
    answer.text = format!("seed {seed}\n{}", answer.text);
    let cluster = &arguments.cluster;
    answer = match &arguments.scenario {
        Some(_) if !simulated_only(&scenario).is_empty() => answer,
        Some(scenario) => answer.and_next(&[&"lab", cluster, &"--scenario", scenario]),
        None => answer.and_next(&[&"lab", cluster]),
    };
    answer = answer.and_next(&[&"campaign", cluster, &"--runs", &"1000", &"--seed", &"1"]);
    Ok(match written {
        Ok(()) => answer,
        Err(error) => answer.and_failure(Status::Failed, "U0602", error),
    })
}

/// Command line that repeats this run, including its seed.
fn repeat(arguments: &Arguments, seed: u64) -> String {
    let line = crate::run::outcome::command_line();
    match arguments.seed {
        Some(_) => line,
        None => format!("{line} --seed {seed}"),
    }
}

pub(crate) fn seed_of_the_clock() -> u64 {
    let since = SystemTime::now().duration_since(UNIX_EPOCH);
    since.map_or(1, |since| u64::from(since.subsec_nanos()) ^ since.as_secs())
}
