//! `understudy lab`: a cluster and a scenario on processes of this machine.

use std::cell::RefCell;
use std::path::{Path, PathBuf};
use std::time::Duration;

use clap::{Args, ValueEnum};
use understudy_cluster::Cluster;
use understudy_journal::{JOURNAL_LIMIT_BYTES, JournalState, RunDirectory};
use understudy_member::link_kind;
use understudy_network::Share;
use understudy_processes::{
    Afterwards, Deaths, HostKind, LaboratoryError, LaboratorySettings, NetworkSettings,
    run_commanded,
};
use understudy_scenarios::{ResultsError, Scenario, Summary, World, write_results};
use understudy_text::duration::parse_positive;
use understudy_wire::Via;

use crate::answer::{Answer, Status};
use crate::console::Console;
use crate::files;
use crate::inspect::watch::{BesideArguments, Page};
use crate::overrides::{OverrideArguments, parse_size};
use crate::run::outcome::{answer, circumstances, command_line, machine};
use crate::run::wakefulness;
use crate::tools::proxy::ImpairmentArguments;

/// Run a cluster and a scenario on processes of this machine
#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  understudy lab examples/press-cell/cluster.toml --scenario scenarios/kill-each.toml --link zenoh
  understudy lab examples/press-cell/cluster.toml --hosts netns --loss 1%
  understudy lab examples/press-cell/cluster.toml --watch")]
pub(crate) struct Arguments {
    /// Cluster file
    #[arg(value_name = "CLUSTER.toml")]
    cluster: PathBuf,
    /// Scenario file; without it the cluster runs undisturbed
    #[arg(long, value_name = "FILE")]
    scenario: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) run: RunArguments,
    #[command(flatten)]
    beside: BesideArguments,
}

/// Arguments of a run on processes.
#[derive(Debug, Clone, Args)]
#[command(next_help_heading = "Run")]
pub struct RunArguments {
    /// Number of cycles, overrides the scenario; later steps and expectations are ignored
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..=understudy_scenarios::MAXIMUM_CYCLES))]
    pub cycles: Option<u64>,
    /// Restart members that end unexpectedly: after 0.5 s, after up to 8 s if they end repeatedly
    #[arg(long)]
    pub restart: bool,
    /// Answer each question of a remote I/O after this time: accept the newest state, or start cold if there is none
    #[arg(long, value_name = "TIME", value_parser = parse_positive)]
    pub answer_after: Option<Duration>,
    /// Overrides of the cluster file.
    #[command(flatten)]
    pub overrides: OverrideArguments,
    /// Directory for runs; each run gets a subdirectory
    #[arg(long, value_name = "DIR", default_value = "runs")]
    pub out: PathBuf,
    /// Size limit of the journal, such as 200MB; the oldest records are removed first
    #[arg(long, value_name = "SIZE", default_value = "1GB", value_parser = parse_size)]
    pub journal_limit: u64,
    /// The network between the processes.
    #[command(flatten)]
    pub network: NetworkArguments,
}

/// The network between the processes.
#[derive(Debug, Clone, Default, Args)]
#[command(next_help_heading = "Network")]
pub struct NetworkArguments {
    /// Hosts of the processes
    #[arg(long, value_enum, default_value_t)]
    hosts: HostArgument,
    #[command(flatten)]
    impairment: ImpairmentArguments,
    /// Only impaired network of a cluster with two, 1 or 2
    #[arg(long, value_name = "NETWORK", value_parser = parse_network)]
    impaired_network: Option<Via>,
    /// Seed of the random network faults
    #[arg(long, value_name = "SEED", default_value_t)]
    network_seed: u64,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, ValueEnum)]
enum HostArgument {
    /// Loopback interface
    #[default]
    Loopback,
    /// Network namespaces joined by a bridge: one per station, one per remote I/O with its plant; requires root
    Netns,
}

fn parse_network(text: &str) -> Result<Via, String> {
    let number = text.parse::<u8>().ok();
    let network = Via::NETWORKS.into_iter().find(|via| via.network() == number);
    network.ok_or_else(|| format!("{text:?} is not 1 or 2"))
}

impl NetworkArguments {
    /// Whether the processes run in network namespaces, where a device of this host is not reached.
    pub fn has_namespaces(&self) -> bool {
        self.hosts == HostArgument::Netns
    }

    /// The same arguments with a loss of `share`, unless a loss was given.
    pub fn losing(&self, share: Share) -> Self {
        Self { impairment: self.impairment.losing(share), ..self.clone() }
    }

    /// The same arguments with another seed.
    pub fn seeded(&self, seed: u64) -> Self {
        Self { network_seed: seed, ..self.clone() }
    }

    pub(crate) fn settings(&self) -> NetworkSettings {
        NetworkSettings {
            hosts: match self.hosts {
                HostArgument::Loopback => HostKind::Loopback,
                HostArgument::Netns => HostKind::Namespaces,
            },
            impairment: self.impairment.impairment(),
            impaired: self.impaired_network,
            seed: self.network_seed,
        }
    }
}

/// Number of cycles of a run without a scenario.
const UNDISTURBED_CYCLES: u64 = 1000;

pub(crate) fn run(arguments: &Arguments, console: &mut Console) -> Result<Answer, Answer> {
    let overrides = arguments.run.overrides.overrides();
    let (cluster, reports) = files::cluster(&arguments.cluster, overrides)?;
    let scenario = scenario_or_undisturbed(arguments.scenario.as_deref(), &cluster)?
        .shortened(arguments.run.cycles);
    wakefulness::warn(&cluster, console);
    let directory = files::run_directory(&arguments.run.out)?;
    let answer = in_laboratory(
        &cluster,
        &scenario,
        arguments.cluster.clone(),
        &arguments.run,
        &directory,
        arguments.beside.page().as_ref(),
        console,
    )?;
    Ok(answer.with_used(reports))
}

pub(crate) fn scenario_or_undisturbed(
    path: Option<&Path>,
    cluster: &Cluster,
) -> Result<Scenario, Answer> {
    match path {
        Some(path) => files::scenario(path, cluster),
        None => Ok(Scenario {
            title: format!("{} undisturbed", cluster.name()),
            cycles: UNDISTURBED_CYCLES,
            ..Scenario::default()
        }),
    }
}

/// Settings that start the members of a cluster as processes of this program.
pub(crate) fn laboratory_settings(
    cluster: &Cluster,
    cluster_file: PathBuf,
    overrides: &OverrideArguments,
    network: NetworkSettings,
) -> Result<LaboratorySettings, Answer> {
    let program = std::env::current_exe().map_err(|error| {
        let message = format!("cannot find the executable of this program: {error}");
        Answer::failed(Status::Failed, "U0604", message)
    })?;
    Ok(LaboratorySettings {
        program,
        cluster_file,
        arguments: overrides.to_arguments(),
        link: link_kind(cluster),
        network,
        journal_limit_bytes: JOURNAL_LIMIT_BYTES,
        deaths: Deaths::EndTheRun,
        answers_after: None,
    })
}

/// Runs the laboratory, writes the results and returns the answer.
pub(crate) fn in_laboratory(
    cluster: &Cluster,
    scenario: &Scenario,
    cluster_file: PathBuf,
    arguments: &RunArguments,
    directory: &RunDirectory,
    page: Option<&Page>,
    console: &mut Console,
) -> Result<Answer, Answer> {
    let (summary, run) =
        judged(cluster, scenario, cluster_file, arguments, directory, page, console)?;
    let answered = answer(&summary, Some(directory.path()));
    let path = directory.path();
    let mut answer = match first_reconstructed(cluster, &summary) {
        Some((output, cycle)) => answered.and_next(&[&"why", &output, &path, &"--at", &cycle]),
        None => answered.and_next(&[&"watch", &path]),
    };
    if let Err(error) = run.written {
        answer = answer.and_failure(Status::Failed, "U0602", error);
    }
    Ok(match run.failure {
        Some(failure) => answer.and_failure(Status::Failed, failure.code(), &failure),
        None => answer,
    })
}

/// First output of the first controller that the scenario kills, with a cycle in which it was reconstructed.
fn first_reconstructed(cluster: &Cluster, summary: &Summary) -> Option<(String, String)> {
    let controllers = cluster.controllers();
    summary.steps.iter().find_map(|step| {
        let controller = controllers.iter().find(|it| it.name == step.name)?;
        let output = controller.interface.outputs.iter().next()?;
        let output = format!("{}.{}", controller.name, output.name);
        (step.action == "crash").then(|| (output, (step.measured + 1).to_string()))
    })
}

/// Message at the end of a scenario whose cluster keeps running.
fn invitation(verdict: &str, url: &str) -> String {
    format!(
        "end of the scenario: {verdict}\n\
         Kill a station yourself: open {url}, click a station, then Kill. The cluster stays up until Ctrl-C."
    )
}

/// Results of a run other than its summary.
pub struct Judged {
    /// Whether the results could be written.
    pub written: Result<(), ResultsError>,
    /// Failure of the laboratory itself.
    pub failure: Option<LaboratoryError>,
}

/// Runs the laboratory and writes the results.
pub(crate) fn judged(
    cluster: &Cluster,
    scenario: &Scenario,
    cluster_file: PathBuf,
    arguments: &RunArguments,
    directory: &RunDirectory,
    page: Option<&Page>,
    console: &mut Console,
) -> Result<(Summary, Judged), Answer> {
    let network = arguments.network.settings();
    let settings = LaboratorySettings {
        journal_limit_bytes: arguments.journal_limit,
        deaths: if arguments.restart { Deaths::Restarted } else { Deaths::Survived },
        answers_after: arguments.answer_after,
        ..laboratory_settings(cluster, cluster_file, &arguments.overrides, network)?
    };
    let served = page.map(|page| page.beside(directory.path(), console));
    let (served, commands) = match served.transpose() {
        Ok(served) => served.unzip(),
        Err(answer) => {
            directory.take_back();
            return Err(answer);
        }
    };
    let summarised = |account, of_run: Vec<String>, journal| {
        let machine = machine().into_iter().chain(of_run).collect();
        let circumstances =
            circumstances(cluster, World::Laboratory, None, machine, command_line());
        Summary::new(account, scenario, circumstances, journal)
    };
    let console = RefCell::new(console);
    let judge = |account| {
        let (summary, _) = summarised(account, Vec::new(), JournalState::default());
        let verdict = summary.verdict();
        if let Some(served) = &served {
            console.borrow_mut().note(&invitation(&verdict, &served.url()));
        }
        verdict
    };
    let afterwards = page
        .filter(|page| page.stays())
        .map(|page| Afterwards { judge: Box::new(judge), refuse_until_then: !page.may_command() });
    let mut watch = |progress| console.borrow_mut().show(&progress);
    let run =
        run_commanded(cluster, scenario, settings, directory, commands, afterwards, &mut watch);
    let run = run.map_err(|error| {
        directory.take_back();
        Answer::failed(Status::Failed, error.code(), &error)
    })?;
    let (mut summary, account) = summarised(run.account, run.machine, run.journal);
    if run.failure.is_some() {
        summary.passed = false;
        summary.inconclusive = None;
    }
    let judged =
        Judged { written: write_results(directory, &summary, &account), failure: run.failure };
    Ok((summary, judged))
}
