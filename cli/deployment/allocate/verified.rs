//! Proofs about programs before their allocation.

use std::collections::BTreeMap;
use std::path::PathBuf;

use understudy_allocation::{Group as Wanted, Member, Resources, Verification};
use understudy_diagnostic::{Report, has_errors};
use understudy_ladder::from_circuit;
use understudy_logic::Circuit;
use understudy_logic::bdd::Diagrams;
use understudy_parity::generate;
use understudy_verification::program::{Answer as Proof, Bounds, Lamp, OutputFinding, Subject};
use understudy_verification::property::{Properties, not_of_one_scan, read};
use understudy_verification::prove_parity_while;

use super::programs::{Group, Programs};
use crate::answer::{Answer, Status};
use crate::files;
use crate::programs::verify::patience::Patience;

/// Properties by program, with their file.
pub(super) type Asked = BTreeMap<String, Vec<(Report, Properties)>>;

/// Reads property files.
pub(super) fn asked(files: &[(String, PathBuf)], programs: &Programs) -> Result<Asked, Answer> {
    let names: Vec<String> = programs
        .groups
        .iter()
        .flat_map(|group| group.members.iter().map(|member| group.name(&member.name)))
        .collect();
    let mut asked = Asked::new();
    for (name, path) in files {
        if !names.contains(name) {
            let message = format!(
                "there is no program `{name}`; there are {}",
                names.join(", ")
            );
            return Err(Answer::failed(Status::BadInput, "U1134", message));
        }
        let text = files::text(path)?;
        let found = read(&text);
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
        let subject = Subject::new(&member.ladder, group.period)
            .map_err(|error| Answer::failed(Status::BadInput, "U0436", error.to_string()))?;
        let name = group.name(&member.name);
        patience.turn_to(format!("`{name}`"));
        let properties = asked.get(&name).map_or(&[][..], Vec::as_slice);
        let remote_io = match &group.cluster {
            Some(cluster) => group.name(&cluster.remote_ios()[place].name),
            None => format!("{name}-io"),
        };
        Ok(Member {
            program: Resources::of(&member.ladder),
            verification: verification(&subject, properties, patience)?,
            name,
            remote_io,
        })
    });
    members.collect()
}

fn verification(
    subject: &Subject,
    asked: &[(Report, Properties)],
    patience: &Patience<'_>,
) -> Result<Verification, Answer> {
    let go_on = |work| patience.goes_on(work);
    let bounds = Bounds {
        go_on: &go_on,
        ..Bounds::default()
    };
    let circuit = subject.circuit();
    let mut wrong = Vec::new();
    let mut undecided = Undecided::default();
    let switches = subject.switches(bounds);
    for (signal, finding) in &switches {
        let name = signal.name(circuit);
        let lamp = |lamp: &Lamp| if *lamp == Lamp::On { "on" } else { "off" };
        match finding {
            OutputFinding::Free => {}
            OutputFinding::Never(which) => wrong.push(format!("{name} is never {}", lamp(which))),
            OutputFinding::Stuck(which, _) => {
                wrong.push(format!(
                    "{name} can reach a state after which it is never {} again",
                    lamp(which)
                ));
            }
            OutputFinding::Undecided(why) => undecided.add(name.to_owned(), why),
        }
    }
    let mut proved = format!(
        "every one of its {} outputs can always be switched on and off again",
        switches.len()
    );
    let mut count = 0;
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
            report.diagnostics = vec![not_of_one_scan(span)];
            return Err(Answer::bad_files(vec![report]));
        }
        let answers = subject.check(&formulas?, fair, bounds, &mut |_, _| {});
        count += answers.len();
        for (property, proof) in properties.properties.iter().zip(&answers) {
            match proof {
                Proof::Holds(_) => {}
                Proof::Fails(_) => wrong.push(format!("`{}` does not hold", property.text)),
                Proof::Undecided(why) => {
                    undecided.add(format!("`{}`", property.text), &why.to_string());
                }
            }
        }
    }
    if count > 0 {
        proved.push_str(&format!("; {count} properties hold"));
    }
    wrong.extend(undecided.told());
    if patience.is_over() {
        wrong.push("increase --budget".to_owned());
    }
    Ok(if wrong.is_empty() {
        Verification::Passed(format!("verified: {proved}"))
    } else {
        Verification::NotPassed(wrong.join("; "))
    })
}

/// Undecided properties, grouped by reason.
#[derive(Default)]
struct Undecided(Vec<(String, Vec<String>)>);

/// Maximum number of names per reason.
const TOLD: usize = 3;

impl Undecided {
    fn add(&mut self, name: String, why: &str) {
        match self.0.iter_mut().find(|(known, _)| known == why) {
            Some((_, names)) => names.push(name),
            None => self.0.push((why.to_owned(), vec![name])),
        }
    }

    fn told(self) -> impl Iterator<Item = String> {
        self.0.into_iter().map(|(why, names)| {
            let more = match names.len().saturating_sub(TOLD) {
                0 => String::new(),
                more => format!(" and {more} more"),
            };
            let told = names.iter().take(TOLD).map(String::as_str);
            let told = told.collect::<Vec<_>>().join(", ");
            format!("undecided: {told}{more}: {why}")
        })
    }
}

/// The group with its understudy, proved to be the sum of its members.
pub(super) fn group(
    group: &Group,
    members: Vec<Member>,
    understudies: u8,
    patience: &Patience<'_>,
) -> Result<Wanted, Answer> {
    let circuits: Vec<Circuit> = group
        .members
        .iter()
        .map(|member| member.circuit.clone())
        .collect();
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
        None => (1..=understudies)
            .map(|number| group.name(&format!("understudy-{number}")))
            .collect(),
    };
    Ok(Wanted {
        members,
        understudies,
        understudy: Resources::of(&from_circuit(parity.circuit())),
        parity: proof,
        period: group.period,
    })
}
