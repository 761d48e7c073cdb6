//! `understudy model-check`: every schedule of a few faults over a few cycles.

use std::path::PathBuf;
use std::thread::available_parallelism;

use clap::{Args, ValueEnum};
use serde::Serialize;
use understudy_cluster::Cluster;
use understudy_journal::Members;
use understudy_model_checking::{ALL, Budget, Counterexample, Model, Promise, Start, check};
use understudy_scenarios::{Expectation, Scenario, parts, write};
use understudy_wire::Member;

use crate::answer::{Answer, Status};
use crate::files;
use crate::overrides::OverrideArguments;

/// Try every schedule of a few faults over a few cycles
#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  understudy model-check examples/press-cell/cluster.toml --faults 1 --cycles 2
  understudy model-check examples/press-cell/cluster.toml --restarted all --kinds loss,delay --cycles 12
  understudy model-check examples/press-cell/cluster.toml --behind robot --restarted press-io
  understudy model-check examples/press-cell/cluster.toml --broken robot-io:understudy --kinds crash

The very state machines of stations and remote I/Os run in virtual time, with a slot of the schedule as its grain. What breaks a
property is written as a scenario that `understudy simulate` replays. States grow with the power of the faults: 2 faults in 2 cycles of the
press cell are about a million.

Exit status: 0 when every property holds, 1 when one does not, 2 for bad input.")]
pub(crate) struct Arguments {
    /// The cluster file
    #[arg(value_name = "CLUSTER.toml")]
    cluster: PathBuf,
    /// Faults in one run, at most
    #[arg(long, value_name = "N", default_value_t = 1)]
    faults: u8,
    /// Cycles in which they may begin
    #[arg(long, value_name = "N", default_value_t = 2, value_parser = clap::value_parser!(u64).range(1..=1000))]
    cycles: u64,
    /// Who has just started again where a run begins; `all` for all stations and remote I/Os. Without it a run begins synchronised
    #[arg(long, value_name = "NAME", value_delimiter = ',')]
    restarted: Vec<String>,
    /// Who stood still for the cycle before
    #[arg(long, value_name = "NAME", value_delimiter = ',')]
    behind: Vec<String>,
    /// Links that were broken until the run begins, for longer than the history of a sample: sender and receiver
    #[arg(long, value_name = "FROM:TO", value_delimiter = ',')]
    broken: Vec<String>,
    /// Which faults; all of them where none are named
    #[arg(long, value_name = "KIND", value_enum, value_delimiter = ',')]
    kinds: Vec<Kind>,
    /// Processors to use; all of them by default
    #[arg(long, value_name = "N")]
    jobs: Option<usize>,
    /// Where to write the scenario of the first broken property
    #[arg(long, value_name = "FILE")]
    scenario: Option<PathBuf>,
    #[command(flatten)]
    overrides: OverrideArguments,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Kind {
    /// A link, or all links of a sender, lose the frames of a slot
    Loss,
    /// A link is late with the frames of a slot
    Delay,
    /// The last frame of a sender comes twice
    Duplicate,
    /// A member crashes, and starts again at any later slot
    Crash,
    /// A member stands still, and goes on at any later slot
    Stop,
}

#[derive(Debug, Serialize)]
struct Found {
    states: usize,
    depth: usize,
    properties: Vec<Property>,
}

#[derive(Debug, Serialize)]
struct Property {
    name: &'static str,
    holds: bool,
    /// A run that breaks it, as a scenario file.
    scenario: Option<String>,
}

pub(crate) fn run(arguments: &Arguments) -> Answer {
    let overrides = arguments.overrides.overrides();
    let (cluster, reports) = match files::cluster(&arguments.cluster, overrides) {
        Ok(read) => read,
        Err(answer) => return answer,
    };
    let start = match start(arguments, &cluster) {
        Ok(start) => start,
        Err(answer) => return answer.with_used(reports),
    };
    let model = match Model::new(parts(&cluster), start, budget(arguments), &ALL) {
        Ok(model) => model,
        Err(error) => {
            return Answer::failed(Status::Failed, "U0530", error.to_string()).with_used(reports);
        }
    };
    let processors = available_parallelism().map_or(1, usize::from);
    let verdict = check(model, arguments.jobs.unwrap_or(processors).max(1));
    let properties: Vec<Property> = ALL
        .iter()
        .map(|property| {
            let broken = verdict.counterexamples.iter();
            let broken = broken.filter(|example| example.property == property.name);
            let scenario = broken.map(|example| scenario(&cluster, example)).next();
            Property {
                name: property.name,
                holds: scenario.is_none(),
                scenario,
            }
        })
        .collect();
    let broken = properties.iter().find_map(|it| it.scenario.as_deref());
    if let (Some(text), Some(path)) = (broken, &arguments.scenario)
        && let Err(error) = std::fs::write(path, text)
    {
        let message = format!("{}: {error}", path.display());
        return Answer::failed(Status::Failed, "U0602", message).with_used(reports);
    }
    let holds = broken.is_none();
    let found = Found {
        states: verdict.states,
        depth: verdict.depth,
        properties,
    };
    let mut answer = Answer::done(text(&found), found)
        .with_used(reports)
        .and_next(&[&"lab", &arguments.cluster]);
    if !holds {
        answer.status = Status::Failed;
    }
    answer
}

/// The members that are named, or every name that is none of a station or of a remote I/O.
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
        return Ok(Start {
            restarted,
            behind,
            broken,
        });
    }
    let known: Vec<&str> = cluster
        .members()
        .filter(plays)
        .filter_map(|member| cluster.member_name(member))
        .collect();
    let mut answer = Answer::bad_files(Vec::new());
    for name in unknown {
        let known = understudy_diagnostic::spelling::suggestion(&name, known.iter().copied());
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
    let mut text = format!(
        "{} states, runs of up to {} steps\n",
        found.states, found.depth
    );
    for property in &found.properties {
        let verdict = if property.holds { "holds" } else { "BROKEN" };
        text.push_str(&format!("{verdict:<7} {}\n", property.name));
    }
    for scenario in found
        .properties
        .iter()
        .filter_map(|it| it.scenario.as_ref())
    {
        text.push_str(&format!("\n{scenario}"));
    }
    text
}
