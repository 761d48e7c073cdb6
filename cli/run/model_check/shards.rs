//! Shards of a model check: what each found, and whether they are all of it.

use std::path::PathBuf;

use serde::{Deserialize, Serialize};
use understudy_cluster::Cluster;
use understudy_model_checking::{Shard, ShardError};

use super::{Arguments, Found, Property};
use crate::answer::{Answer, Failure, Status};
use crate::files;

/// The findings in their directory.
pub(super) const FILE: &str = "model-check.json";

/// Version of `model-check.json`.
const FORMAT: u32 = 1;

/// The whole of `model-check.json`. It is written when all runs of the shard have been tried.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Report {
    format: u32,
    /// Version of the program.
    version: String,
    /// Name of the cluster.
    cluster: String,
    /// Hash of all programs, roles and timings.
    configuration: String,
    question: Question,
    shard: Shard,
    /// Different states that were reached.
    states: usize,
    /// Steps of the longest run.
    depth: usize,
    properties: Vec<Judged>,
}

/// What was asked for, apart from the shard.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct Question {
    faults: u8,
    cycles: u64,
    kinds: Vec<String>,
    restarted: Vec<String>,
    wrong_program: Vec<String>,
    behind: Vec<String>,
    broken: Vec<String>,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct Judged {
    name: String,
    /// Run that violates the property, as a scenario file.
    scenario: Option<String>,
}

impl Question {
    fn of(arguments: &Arguments) -> Self {
        let sorted = |names: &[String]| {
            let mut names = names.to_vec();
            names.sort_unstable();
            names.dedup();
            names
        };
        let kinds: Vec<String> =
            arguments.kinds.iter().map(|kind| format!("{kind:?}").to_lowercase()).collect();
        Self {
            faults: arguments.faults,
            cycles: arguments.cycles,
            kinds: sorted(&kinds),
            restarted: sorted(&arguments.restarted),
            wrong_program: sorted(&arguments.wrong_program),
            behind: sorted(&arguments.behind),
            broken: sorted(&arguments.broken),
        }
    }
}

impl Report {
    pub(super) fn new(arguments: &Arguments, cluster: &Cluster, found: &Found) -> Self {
        let judged = |property: &Property| Judged {
            name: property.name.clone(),
            scenario: property.scenario.clone(),
        };
        Self {
            format: FORMAT,
            version: env!("CARGO_PKG_VERSION").to_owned(),
            cluster: cluster.name().to_owned(),
            configuration: cluster.agreement().configuration.to_string(),
            question: Question::of(arguments),
            shard: arguments.shard,
            states: found.states,
            depth: found.depth,
            properties: found.properties.iter().map(judged).collect(),
        }
    }

    pub(super) fn to_json(&self) -> String {
        serde_json::to_string_pretty(self).unwrap_or_default() + "\n"
    }

    fn read(folder: &std::path::Path) -> Result<Self, Failure> {
        let path = folder.join(FILE);
        let text = files::text(&path).map_err(|failed| {
            let first = failed.failures.into_iter().next();
            first.unwrap_or_else(|| unusable(&path, &"it cannot be read"))
        })?;
        let value: serde_json::Value =
            serde_json::from_str(&text).map_err(|error| unusable(&path, &error))?;
        if value["format"] != FORMAT {
            let expected = format!("it has format {}, and {FORMAT} is expected", value["format"]);
            return Err(unusable(&path, &expected));
        }
        serde_json::from_value(value).map_err(|error| unusable(&path, &error))
    }
}

fn unusable(path: &std::path::Path, reason: &dyn std::fmt::Display) -> Failure {
    Failure { code: "U0610".to_owned(), message: format!("{}: {reason}", path.display()) }
}

/// Merges the shards in these directories.
///
/// # Errors
/// U0610 if a directory has no findings, U0611 if the shards are not all of one model check, each once.
pub(super) fn merged(folders: &[PathBuf]) -> Result<Found, Answer> {
    let mut read = Vec::new();
    let mut failures = Vec::new();
    for folder in folders {
        match Report::read(folder) {
            Ok(report) => read.push((folder.display().to_string(), report)),
            Err(failure) => failures.push(failure),
        }
    }
    if failures.is_empty() {
        let errors = Shard::obstacles(&read, |report| report.shard, difference);
        let failure =
            |error: ShardError| Failure { code: "U0611".to_owned(), message: error.to_string() };
        failures.extend(errors.into_iter().map(failure));
    }
    if !failures.is_empty() {
        return Err(failures.into_iter().fold(Answer::done("", ()), |answer, failure| {
            answer.and_failure(Status::BadInput, &failure.code, failure.message)
        }));
    }
    read.sort_by_key(|(_, report)| report.shard);
    let reports = || read.iter().map(|(_, report)| report);
    let names = reports().next().map(|first| first.properties.iter().map(|it| it.name.clone()));
    let properties = names.into_iter().flatten().map(|name| {
        let judged = reports().flat_map(|report| &report.properties);
        let scenario = judged.filter(|it| it.name == name).find_map(|it| it.scenario.clone());
        Property { name, holds: scenario.is_none(), scenario }
    });
    Ok(Found {
        shard: Shard::WHOLE,
        shards: read.len(),
        states: reports().map(|report| report.states).sum(),
        depth: reports().map(|report| report.depth).max().unwrap_or(0),
        properties: properties.collect(),
    })
}

/// What makes two reports shards of different model checks.
fn difference(first: &Report, other: &Report) -> Option<&'static str> {
    let (one, two) = (&first.question, &other.question);
    let same = [
        ("the version", first.version == other.version),
        ("the cluster", first.cluster == other.cluster),
        ("the configuration", first.configuration == other.configuration),
        ("--faults", one.faults == two.faults),
        ("--cycles", one.cycles == two.cycles),
        ("--kinds", one.kinds == two.kinds),
        ("the start of the runs", one == two),
    ];
    same.into_iter().find(|(_, same)| !same).map(|(what, _)| what)
}
