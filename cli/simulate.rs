//! `understudy simulate`: the same in virtual time, from a seed.

use std::path::PathBuf;
use std::time::{SystemTime, UNIX_EPOCH};

use clap::Args;
use understudy_journal::{
    JOURNAL_LIMIT_BYTES, Journal, JournalState, Record, RunDirectory, RunEvent, keep_cluster,
};
use understudy_scenarios::{Summary, World, simulate as run_simulation, write_results};

use crate::answer::{Answer, Status};
use crate::files;
use crate::lab::scenario_or_undisturbed;
use crate::overrides::OverrideArguments;
use crate::run::{answer, circumstances, machine};

/// Run a cluster and a scenario in virtual time, from a seed
#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  understudy simulate examples/press-cell/cluster.toml --scenario scenarios/lossy.toml --seed 7

Equal files and seeds give equal runs. A run that fails prints the command that repeats it.")]
pub(crate) struct Arguments {
    /// The cluster file
    #[arg(value_name = "CLUSTER.toml")]
    cluster: PathBuf,
    /// The scenario file; without one the cluster runs undisturbed
    #[arg(long, value_name = "FILE")]
    scenario: Option<PathBuf>,
    /// What all chance in the run comes from; by default the scenario's, or else taken from the clock, and printed
    #[arg(long, value_name = "N")]
    seed: Option<u64>,
    /// Cycles in place of the scenario's; steps and expectations past them are left out
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..=understudy_scenarios::MAXIMUM_CYCLES))]
    cycles: Option<u64>,
    #[command(flatten)]
    overrides: OverrideArguments,
    /// Where to keep the run; without it only the answer remains
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

pub(crate) fn run(arguments: &Arguments) -> Answer {
    let overrides = arguments.overrides.overrides();
    let (cluster, reports) = match files::cluster(&arguments.cluster, overrides) {
        Ok(read) => read,
        Err(answer) => return answer,
    };
    let scenario = match scenario_or_undisturbed(arguments.scenario.as_deref(), &cluster) {
        Ok(scenario) => scenario.shortened(arguments.cycles),
        Err(answer) => return answer,
    };
    let seed = arguments.seed.or(scenario.seed);
    let seed = seed.unwrap_or_else(seed_of_the_clock);
    let directory = match &arguments.out {
        None => None,
        Some(out) => match RunDirectory::create(out, SystemTime::now()) {
            Ok(directory) => Some(directory),
            Err(error) => return Answer::failed(Status::Failed, "U0602", error.to_string()),
        },
    };
    if let Some(directory) = &directory
        && let Err(error) = keep_cluster(directory.path(), &arguments.cluster, &cluster)
    {
        return Answer::failed(Status::Failed, "U0602", error.to_string());
    }
    let mut journal = match &directory {
        None => None,
        Some(directory) => {
            match Journal::create(&directory.file("journal.jsonl"), JOURNAL_LIMIT_BYTES) {
                Ok(journal) => Some(journal),
                Err(error) => return Answer::failed(Status::Failed, "U0602", error.to_string()),
            }
        }
    };
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
            let message = format!("{error}; repeat it with: {}", repeat(arguments, seed));
            return Answer::failed(Status::Failed, "U0530", message).with_used(reports);
        }
    };
    let journal = journal.map_or_else(JournalState::default, |mut journal| {
        journal.write(&Record::of_run(last_ns, RunEvent::Finished));
        journal.finish()
    });
    let repeat = repeat(arguments, seed);
    let circumstances = circumstances(&cluster, World::Simulator, Some(seed), machine(), repeat);
    let (summary, account) = Summary::new(account, &scenario, circumstances, journal);
    let written = directory.as_ref().map_or(Ok(()), |directory| {
        write_results(directory, &summary, &account)
    });
    let mut answer =
        answer(&summary, directory.as_ref().map(RunDirectory::path)).with_used(reports);
    answer.text = format!("seed {seed}\n{}", answer.text);
    let cluster = &arguments.cluster;
    answer = match &arguments.scenario {
        Some(scenario) => answer.and_next(&[&"lab", cluster, &"--scenario", scenario]),
        None => answer.and_next(&[&"lab", cluster]),
    };
    answer = answer.and_next(&[&"campaign", cluster, &"--runs", &"1000", &"--seed", &"1"]);
    match written {
        Ok(()) => answer,
        Err(error) => answer.and_failure(Status::Failed, "U0602", error.to_string()),
    }
}

/// The command that repeats this run, whether or not it named its seed.
fn repeat(arguments: &Arguments, seed: u64) -> String {
    let line = crate::run::command_line();
    match arguments.seed {
        Some(_) => line,
        None => format!("{line} --seed {seed}"),
    }
}

pub(crate) fn seed_of_the_clock() -> u64 {
    let since = SystemTime::now().duration_since(UNIX_EPOCH);
    since.map_or(1, |since| u64::from(since.subsec_nanos()) ^ since.as_secs())
}
