//! Proofs about programs before their allocation.

use std::collections::BTreeMap;
use std::fmt::Display;
use std::path::PathBuf;
use std::time::Duration;

use understudy_allocation::{Group as Wanted, Member, Resources, Verification};
use understudy_bits::Inexact;
use understudy_ladder::from_circuit;
use understudy_logic::Circuit;
use understudy_logic::bdd::Diagrams;
use understudy_parity::generate;
use understudy_text::{Diagnostic, Report, has_errors};
use understudy_verification::numbers::Model;
use understudy_verification::program::{Bounds, Conclusion, Subject};
use understudy_verification::property::{self, Properties, Property, not_of_one_scan, read};
use understudy_verification::prove_parity_while;

use super::programs::{self, Group, Programs};
use crate::answer::{Answer, Status};
use crate::files;
use crate::patience::Patience;

/// Properties by program, with their file.
pub(super) type Asked = BTreeMap<String, Vec<(Report, Properties)>>;

/// Reads property files.
pub(super) fn asked(files: &[(String, PathBuf)], programs: &Programs) -> Result<Asked, Answer> {
    let groups = programs.groups.iter();
    let periods: BTreeMap<String, Duration> = groups
        .flat_map(|group| group.members.iter().map(|it| (group.name(&it.name), group.period)))
        .collect();
    let mut asked = Asked::new();
    for (name, path) in files {
        let Some(&period) = periods.get(name) else {
            let names: Vec<&str> = periods.keys().map(String::as_str).collect();
            let message = format!("there is no program `{name}`; there are {}", names.join(", "));
            return Err(Answer::failed(Status::BadInput, "U1134", message));
        };
        let text = files::text(path)?;
        let found = read(&text, period);
        let report = Report {
            name: path.display().to_string(),
            text,
            diagnostics: found.diagnostics.clone(),
        };
        if has_errors(&report.diagnostics) {
            return Err(Answer::bad_files(vec![report]));
        }
        asked.entry(name.clone()).or_default().push((report, found));
    }
    Ok(asked)
}

/// Programs of a group with the results of their proofs.
pub(super) fn members(
    group: &Group,
    asked: &Asked,
    patience: &Patience<'_>,
) -> Result<Vec<Member>, Answer> {
    let members = group.members.iter().enumerate().map(|(place, member)| {
        let name = group.name(&member.name);
        let properties = asked.get(&name).map_or(&[][..], Vec::as_slice);
        let subject = subject(member, properties)?;
        patience.turn_to(format!("`{name}`"));
        let remote_io = match &group.cluster {
            Some(cluster) => group.name(&cluster.remote_ios()[place].name),
            None => format!("{name}-io"),
        };
        let twin = group.cluster.as_ref().and_then(|cluster| {
            let twin = cluster.remote_ios()[place].twin.as_ref()?;
            let (name, has_terminals) = (group.name(&twin.name), twin.is_parallel());
            Some(understudy_allocation::Twin { name, has_terminals })
        });
        Ok(Member {
            program: Resources::of(&member.ladder),
            verification: verification(&subject, properties, patience)?,
            name,
            remote_io,
            twin,
        })
    });
    members.collect()
}

/// A program ready for its properties.
fn subject(
    member: &programs::Member,
    properties: &[(Report, Properties)],
) -> Result<Subject, Answer> {
    let failed = |code, error: &dyn Display| Answer::failed(Status::BadInput, code, error);
    let inexact = |error: Inexact| failed(error.code_or("U0436"), &error);
    let asked = property::Asked::of(properties.iter().map(|(_, found)| found));
    let right = |wrong: &dyn Fn(&Property) -> Vec<Diagnostic>| {
        for (report, found) in properties {
            let wrong: Vec<Diagnostic> = found.assumed.iter().flat_map(wrong).collect();
            if !wrong.is_empty() {
                return Err(Answer::bad_files(vec![Report {
                    diagnostics: wrong,
                    ..report.clone()
                }]));
            }
        }
        Ok(())
    };
    let typed = &member.typed;
    let model = Model::of_program(typed, &asked).map_err(inexact)?;
    right(&|assumed| model.wrong_assumption(assumed))?;
    model.exact().map_err(|found| inexact(found.told_by(typed)))
}

fn verification(
    subject: &Subject,
    asked: &[(Report, Properties)],
    patience: &Patience<'_>,
) -> Result<Verification, Answer> {
    let go_on = |work| patience.goes_on(work);
    let bounds = Bounds { go_on: &go_on, ..Bounds::default() };
    let mut conclusion = Conclusion::new(subject.circuit(), &subject.switches(bounds));
    for (report, properties) in asked {
        let resolve = |property| {
            subject.resolve(property).map_err(|diagnostics| {
                let mut report = report.clone();
                report.diagnostics = diagnostics;
                Answer::bad_files(vec![report])
            })
        };
        let formulas: Result<Vec<_>, _> = properties.properties.iter().map(resolve).collect();
        let fair: Result<Vec<_>, _> = properties.fair.iter().map(resolve).collect();
        let fair = fair?;
        if let Some(place) = fair.iter().position(|formula| !formula.is_of_one_scan()) {
            let start = report.text.find(&properties.fair[place].text).unwrap_or(0);
            let mut report = report.clone();
            let span = start..start + properties.fair[place].text.len();
            report.diagnostics = vec![not_of_one_scan("a fairness condition", span)];
            return Err(Answer::bad_files(vec![report]));
        }
        let answers = subject.check(&formulas?, fair, bounds, &mut |_, _| {});
        for (property, answer) in properties.properties.iter().zip(&answers) {
            conclusion.add(&property.text, answer);
        }
    }
    Ok(match conclusion.verdict() {
        Ok(proved) => Verification::Passed(format!("verified: {proved}")),
        Err(mut reasons) => {
            if patience.is_over() {
                reasons.push("increase --budget".to_owned());
            }
            Verification::NotPassed(reasons.join("; "))
        }
    })
}

/// The group with its understudy, proved to be the sum of its members.
pub(super) fn group(
    group: &Group,
    members: Vec<Member>,
    understudies: u8,
    patience: &Patience<'_>,
) -> Result<Wanted, Answer> {
    let circuits: Vec<Circuit> =
        group.members.iter().map(|member| member.circuit.clone()).collect();
    let parity = match &group.parity {
        Some(parity) => parity.clone(),
        None => generate(&circuits).map_err(|error| {
            Answer::failed(Status::BadInput, error.code(), super::message(&error))
        })?,
    };
    patience.turn_to("the understudy".to_owned());
    let go_on = |work| patience.goes_on(work);
    let nodes = Diagrams::DEFAULT_LIMIT;
    let proof = match prove_parity_while(&circuits, parity.circuit(), nodes, &go_on) {
        Ok(proof) => Verification::Passed(format!(
            "verified: it equals the sum of its members, {} registers and {} outputs compared",
            proof.registers, proof.outputs
        )),
        Err(refutation) => Verification::NotPassed(refutation.to_string()),
    };
    let understudies = match &group.cluster {
        Some(cluster) => {
            let names = cluster.understudies().iter();
            names.map(|found| group.name(&found.name)).collect()
        }
        None if understudies == 1 => vec![group.name("understudy")],
        None => {
            (1..=understudies).map(|number| group.name(&format!("understudy-{number}"))).collect()
        }
    };
    Ok(Wanted {
        members,
        understudies,
        understudy: Resources::of(&from_circuit(parity.circuit())),
        parity: proof,
        period: group.period,
    })
}
