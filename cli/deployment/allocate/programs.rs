//! Reads ladder programs and clusters from the command line.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

use understudy_cluster::{Cluster, Code, Overrides, SourceText};
use understudy_interchange::{Rungs, Source, USUAL_PERIOD, Wanted, read_ladder};
use understudy_ladder::{Program, from_circuit};
use understudy_logic::Circuit;
use understudy_parity::{ParityController, generate};
use understudy_text::{Report, duration};
use understudy_typed::Program as Typed;

use crate::answer::{Answer, Status};
use crate::files;

/// Programs of the command line.
pub(crate) struct Programs {
    /// One group for all ladder programs, one for each cluster.
    pub(crate) groups: Vec<Group>,
    /// Files with their findings.
    pub(crate) reports: Vec<Report>,
}

/// Programs with a common understudy.
pub(crate) struct Group {
    pub(crate) cluster: Option<Box<Cluster>>,
    pub(crate) members: Vec<Member>,
    /// Generated parity controller; none for a single ladder program.
    pub(crate) parity: Option<ParityController>,
    pub(crate) period: Duration,
    /// Prefix of its names, if there are several groups.
    prefix: String,
}

/// A program with its circuit.
pub(crate) struct Member {
    pub(crate) name: String,
    /// What is counted: of a program that is not drawn as a ladder, the rungs of its statements or of its circuit.
    pub(crate) ladder: Program,
    pub(crate) circuit: Circuit,
    /// The program.
    pub(crate) typed: Arc<Typed>,
}

impl Group {
    /// Name, unique among all groups.
    pub(crate) fn name(&self, name: &str) -> String {
        format!("{}{name}", self.prefix)
    }
}

impl Programs {
    /// Reads all files and reports all errors.
    pub(crate) fn read(paths: &[PathBuf], period: Option<Duration>) -> Result<Self, Answer> {
        let is_cluster = |path: &Path| path.extension().is_some_and(|ending| ending == "toml");
        let period = period.or_else(|| {
            let ladders = paths.iter().filter(|path| !is_cluster(path));
            let stated = ladders.filter_map(|path| files::ladder_at(path, None).ok()?.2);
            stated.reduce(duration::common)
        });
        let period = period.unwrap_or(USUAL_PERIOD);
        let mut reports = Vec::new();
        let mut wrong = Answer::done("", serde_json::Value::Null);
        let mut ladders = Vec::new();
        let mut clusters = Vec::new();
        for path in paths {
            let read = if is_cluster(path) {
                files::cluster(path, Overrides::default()).map(|(cluster, found)| {
                    reports.extend(found);
                    clusters.push(cluster);
                })
            } else {
                ladder(path, period).map(|(member, found)| {
                    reports.extend(found);
                    ladders.push(member);
                })
            };
            if let Err(answer) = read {
                wrong.status = answer.status;
                wrong.failures.extend(answer.failures);
                wrong.reports.extend(answer.reports);
            }
        }
        if wrong.status != Status::Done {
            return Err(wrong);
        }
        let several = clusters.len() + usize::from(!ladders.is_empty()) > 1;
        let prefix = |name: &str| {
            if several { format!("{name}/") } else { String::new() }
        };
        let mut groups = Vec::new();
        if !ladders.is_empty() {
            groups.push(of_ladders(ladders, period, prefix("ladders"))?);
        }
        for cluster in clusters {
            let prefix = prefix(cluster.name());
            groups.push(of_cluster(cluster, prefix)?);
        }
        Ok(Self { groups, reports })
    }

    /// Networks of all groups together.
    pub(crate) fn networks(&self) -> usize {
        let has_two = |group: &Group| {
            group.cluster.as_ref().is_some_and(|cluster| cluster.has_two_networks())
        };
        self.groups.iter().map(|group| 1 + usize::from(has_two(group))).sum()
    }

    /// Title of all programs.
    pub(crate) fn title(&self) -> String {
        let names = self.groups.iter().map(|group| match &group.cluster {
            Some(cluster) => cluster.name().to_owned(),
            None => {
                let names = group.members.iter().map(|member| member.name.as_str());
                names.collect::<Vec<_>>().join(", ")
            }
        });
        names.collect::<Vec<_>>().join(", ")
    }
}

fn ladder(path: &Path, period: Duration) -> Result<(Member, Vec<Report>), Answer> {
    let (ladder, reports, _) = files::ladder_at(path, Some(period))?;
    let wanted = Wanted { program: None, period: Some(period) };
    let failed = |code, message: String| Answer::failed(Status::BadInput, code, message);
    let (source, file, _) = files::program(path, wanted)?;
    let Source::Program(typed) = source else {
        return Err(Answer::bad_files(reports));
    };
    let text = SourceText::of(&file.report.name, &file.report.text, period);
    let code = Code::of(Arc::clone(&typed), file.rungs.and_then(Rungs::written), Arc::new(text))
        .map_err(|error| failed(error.code_or("U0436"), error.to_string()))?;
    let circuit = code.exact_circuit();
    let circuit =
        circuit.map_err(|inexact| failed(inexact.code_or("U0438"), inexact.to_string()))?;
    let circuit = circuit.into_owned();
    Ok((Member { name: ladder.name.to_string(), ladder, circuit, typed }, reports))
}

fn of_ladders(members: Vec<Member>, period: Duration, prefix: String) -> Result<Group, Answer> {
    let circuits: Vec<&Circuit> = members.iter().map(|member| &member.circuit).collect();
    let parity = generate(&circuits)
        .map_err(|error| Answer::failed(Status::BadInput, error.code(), super::message(&error)))?;
    Ok(Group {
        cluster: None,
        parity: (members.len() > 1).then_some(parity),
        members,
        period,
        prefix,
    })
}

fn of_cluster(cluster: Cluster, prefix: String) -> Result<Group, Answer> {
    let (circuits, parity) = files::understudy_of(&cluster)
        .map_err(|(code, reason)| Answer::failed(Status::BadInput, code, reason))?;
    let period = cluster.agreement().schedule.period();
    let members = cluster.controllers().iter().zip(circuits).map(|(controller, circuit)| {
        let text = &controller.code.source().text;
        let ladder = read_ladder(&controller.file, text, Some(period)).program;
        let ladder = ladder.unwrap_or_else(|| from_circuit(&circuit));
        Member {
            name: controller.name.clone(),
            ladder: Program { name: controller.name.as_str().into(), ..ladder },
            circuit,
            typed: Arc::clone(controller.code.typed()),
        }
    });
    Ok(Group {
        members: members.collect(),
        parity: Some(parity),
        period,
        cluster: Some(Box::new(cluster)),
        prefix,
    })
}
