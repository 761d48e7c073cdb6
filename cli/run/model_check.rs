//! `understudy model-check`: all schedules of few faults over few cycles.

mod shards;

use std::path::{Path, PathBuf};
use std::thread::available_parallelism;

use clap::{Args, Subcommand, ValueEnum};
use serde::Serialize;
use understudy_cluster::Cluster;
use understudy_journal::Members;
use understudy_model_checking::{Budget, Counterexample, Model, Promise, Shard, Start, check};
use understudy_scenarios::{Expectation, Scenario, parts, write};
use understudy_wire::Member;

use crate::answer::{Answer, Status};
use crate::files;
use crate::overrides::OverrideArguments;

/// Check all schedules of few faults over few cycles
#[derive(Debug, Args)]
#[command(
    args_conflicts_with_subcommands = true,
    subcommand_negates_reqs = true,
    after_help = "\
Example:
  understudy model-check examples/press-cell/cluster.toml --faults 1 --cycles 2
  understudy model-check examples/press-cell/cluster.toml --restarted all --kinds loss,delay --cycles 12
  understudy model-check examples/press-cell/cluster.toml --wrong-program robot,robot-io --cycles 12
  understudy model-check examples/press-cell/cluster.toml --behind robot --restarted press-io
  understudy model-check examples/press-cell/cluster.toml --broken robot-io:understudy --kinds crash
  understudy model-check examples/press-cell/cluster.toml --kinds crash --shard 1/2 --out part-1
  understudy model-check examples/press-cell/cluster.toml --kinds crash --shard 2/2 --out part-2
  understudy model-check merge part-1 part-2

The state machines of stations and remote I/Os run in virtual time; faults begin and end at the slots of the schedule. A run that violates a
property is written as a scenario, which `understudy simulate` replays. The number of states grows exponentially with the number of
faults: 2 faults in 2 cycles of the press cell take about a million states.

A shard has the runs whose first fault is one of every N; no shard needs another one. `merge` refuses shards of different questions and shards that
are missing or given twice.

Exit status: 0 if every property holds, 1 if one is violated, 2 for invalid input."
)]
pub(crate) struct Arguments {
    #[command(subcommand)]
    merge: Option<Merge>,
    /// Cluster file
    #[arg(value_name = "CLUSTER.toml", required = true)]
    cluster: Option<PathBuf>,
    /// Maximum number of faults per run
    #[arg(long, value_name = "N", default_value_t = 1)]
    faults: u8,
    /// Number of cycles in which faults may begin
    #[arg(long, value_name = "N", default_value_t = 2, value_parser = clap::value_parser!(u64).range(1..=1000))]
    cycles: u64,
    /// Members that have just restarted when a run begins; `all`: all stations and remote I/Os. Default: all synchronised
    #[arg(long, value_name = "NAME", value_delimiter = ',')]
    restarted: Vec<String>,
    /// Members that have just restarted with a wrong program, one and the same: wrong outputs alone count then
    #[arg(long, value_name = "NAME", value_delimiter = ',')]
    wrong_program: Vec<String>,
    /// Members that were suspended in the previous cycle
    #[arg(long, value_name = "NAME", value_delimiter = ',')]
    behind: Vec<String>,
    /// Links, sender and receiver, that were interrupted before the run for longer than the history of a sample
    #[arg(long, value_name = "FROM:TO", value_delimiter = ',')]
    broken: Vec<String>,
    /// Kinds of faults; default: all
    #[arg(long, value_name = "KIND", value_enum, value_delimiter = ',')]
    kinds: Vec<Kind>,
    /// Number of processors; default: all
    #[arg(long, value_name = "N")]
    jobs: Option<usize>,
    /// Check only part K of N, by the first fault of a run; `merge` combines the parts
    #[arg(long, value_name = "K/N", default_value = "1/1")]
    shard: Shard,
    /// Directory for the findings, for `merge`
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Write the scenario of the first violated property to this file
    #[arg(long, value_name = "FILE")]
    scenario: Option<PathBuf>,
    #[command(flatten)]
    overrides: OverrideArguments,
}

#[derive(Debug, Subcommand)]
enum Merge {
    /// Combine the shards of a model check
    #[command(after_help = "\
Example:
  understudy model-check examples/press-cell/cluster.toml --kinds crash --shard 1/2 --out part-1
  understudy model-check examples/press-cell/cluster.toml --kinds crash --shard 2/2 --out part-2
  understudy model-check merge part-1 part-2")]
    Merge {
        /// Directories of the shards
        #[arg(value_name = "DIR", required = true)]
        shards: Vec<PathBuf>,
        /// Write the scenario of the first violated property to this file
        #[arg(long, value_name = "FILE")]
        scenario: Option<PathBuf>,
    },
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Kind {
    /// A link, or all links of a sender, loses the frames of a slot
    Loss,
    /// A link delays the frames of a slot
    Delay,
    /// The last frame of a sender is received twice
    Duplicate,
    /// A member crashes and restarts in any later slot
    Crash,
    /// A member is suspended and resumes in any later slot
    Stop,
}

#[derive(Debug, Serialize)]
struct Found {
    /// Part that was checked.
    shard: Shard,
    /// Number of the shards that were merged; 1 for a check of its own.
    shards: usize,
    /// Different states that were reached, those that several shards reach in each of them.
    states: usize,
    depth: usize,
    properties: Vec<Property>,
}

#[derive(Debug, Serialize)]
struct Property {
    name: String,
    holds: bool,
    /// Run that violates the property, as a scenario file.
    scenario: Option<String>,
}

pub(crate) fn run(arguments: &Arguments) -> Result<Answer, Answer> {
    match (&arguments.merge, &arguments.cluster) {
        (Some(Merge::Merge { shards, scenario }), _) => {
            answered(shards::merged(shards)?, scenario.as_deref())
        }
        (None, Some(cluster)) => checked(arguments, cluster),
        // The parser requires one of the two.
        (None, None) => Ok(Answer::done("", ())),
    }
}

fn checked(arguments: &Arguments, path: &Path) -> Result<Answer, Answer> {
    let (cluster, reports) = files::cluster(path, arguments.overrides.overrides())?;
    let start = start(arguments, &cluster)?;
    let checked = start.properties();
    let model = Model::new(parts(&cluster), start, budget(arguments))
        .map_err(|error| Answer::failed(Status::Failed, "U0530", error))?
        .of_shard(arguments.shard);
    let processors = available_parallelism().map_or(1, usize::from);
    let verdict = check(model, arguments.jobs.unwrap_or(processors).max(1));
    let properties: Vec<Property> = checked
        .iter()
        .map(|property| {
            let broken = verdict.counterexamples.iter();
            let broken = broken.filter(|example| example.property == property.name);
            let scenario = broken.map(|example| scenario(&cluster, example)).next();
            Property { name: property.name.to_owned(), holds: scenario.is_none(), scenario }
        })
        .collect();
    let found = Found {
        shard: arguments.shard,
        shards: 1,
        states: verdict.states,
        depth: verdict.depth,
        properties,
    };
    if let Some(folder) = &arguments.out {
        files::make_folder(folder)?;
        let report = shards::Report::new(arguments, &cluster, &found);
        files::replace(&folder.join(shards::FILE), &report.to_json())?;
    }
    let answer = answered(found, arguments.scenario.as_deref())?;
    Ok(answer.with_used(reports).and_next(&[&"lab", &path]))
}

/// Prints the findings, and writes the scenario of the first violated property.
fn answered(found: Found, file: Option<&Path>) -> Result<Answer, Answer> {
    let broken = found.properties.iter().find_map(|it| it.scenario.as_deref());
    if let (Some(text), Some(path)) = (broken, file) {
        files::write(path, text)?;
    }
    let status = if broken.is_some() { Status::Failed } else { Status::Done };
    Ok(Answer::done(text(&found), found).with_status(status))
}

/// The named members, or all names that belong to neither a station nor a remote I/O.
fn start(arguments: &Arguments, cluster: &Cluster) -> Result<Start, Answer> {
    let plays = |member: &Member| !matches!(member, Member::Plant(_));
    let mut unknown = Vec::new();
    let mut find = |names: &[String]| {
        let mut found = Vec::new();
        for name in names {
            match cluster.member(name).filter(plays) {
                Some(member) => found.push(member),
                None if name == "all" => found.extend(cluster.members().filter(plays)),
                None => unknown.push(name.clone()),
            }
        }
        found.sort_unstable();
        found.dedup();
        found
    };
    let (restarted, behind) = (find(&arguments.restarted), find(&arguments.behind));
    let misled = find(&arguments.wrong_program);
    let mut broken = Vec::new();
    for link in &arguments.broken {
        let (from, to) = link.split_once(':').unwrap_or((link, ""));
        let (senders, receivers) = (find(&[from.to_owned()]), find(&[to.to_owned()]));
        for &from in &senders {
            let others = receivers.iter().filter(|&&to| to != from);
            broken.extend(others.map(|&to| (from, to)));
        }
    }
    if unknown.is_empty() {
        return Ok(Start { restarted, misled, behind, broken, ..Start::default() });
    }
    let known: Vec<&str> =
        cluster.members().filter(plays).filter_map(|member| cluster.member_name(member)).collect();
    let mut answer = Answer::bad_files(Vec::new());
    for name in unknown {
        let known = understudy_text::spelling::suggestion(&name, known.iter().copied());
        let message = format!("the cluster has no station or remote I/O `{name}`; {known}");
        answer = answer.and_failure(Status::BadInput, "U0605", message);
    }
    Err(answer)
}

fn budget(arguments: &Arguments) -> Budget {
    let of = |kind: Kind| {
        let asked = arguments.kinds.is_empty() || arguments.kinds.contains(&kind);
        if asked { arguments.faults } else { 0 }
    };
    Budget {
        losses: of(Kind::Loss),
        delays: of(Kind::Delay),
        duplicates: of(Kind::Duplicate),
        crashes: of(Kind::Crash),
        stops: of(Kind::Stop),
        cuts: 0,
        links: 0,
        total: arguments.faults,
        cycles: arguments.cycles,
    }
}

fn scenario(cluster: &Cluster, example: &Counterexample) -> String {
    let held = (example.promise == Promise::NothingHeld).then_some(0);
    let scenario = Scenario {
        title: format!("not: {}", example.property),
        cycles: example.cycles,
        seed: Some(0),
        steps: example.faults.clone(),
        network: Some(Model::network(cluster.agreement().schedule.period())),
        expect: Expectation {
            held,
            fail_safe: held,
            protected: example.promise == Promise::Protected,
            ..Expectation::default()
        },
        ..Scenario::default()
    };
    write(&scenario, &Members::of(cluster), &[])
}

fn text(found: &Found) -> String {
    let part = match (found.shards, found.shard) {
        (1, Shard::WHOLE) => String::new(),
        (1, shard) => format!(" in shard {shard} alone"),
        (shards, _) => format!(" in {shards} shards"),
    };
    let mut text = format!("{} states{part}, runs of up to {} steps\n", found.states, found.depth);
    for property in &found.properties {
        let verdict = if property.holds { "holds" } else { "BROKEN" };
        text.push_str(&format!("{verdict:<7} {}\n", property.name));
    }
    if found.shards == 1 && found.shard != Shard::WHOLE {
        text.push_str("the other shards are not checked: `understudy model-check merge` combines all of them\n");
    }
    for scenario in found.properties.iter().filter_map(|it| it.scenario.as_ref()) {
        text.push_str(&format!("\n{scenario}"));
    }
    text
}
