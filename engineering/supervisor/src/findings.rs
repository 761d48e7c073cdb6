//! What synthesis found, in words: each finding with the shortest sequence of events that shows it.

use understudy_text::Severity;
use understudy_text::spelling;

use crate::alphabet::Label;
use crate::model::Model;
use crate::modular::{ModularSupervisor, Together};
use crate::operations::{Explanation, Supcon, Violation};
use crate::synthesis::unknown_events;

/// One finding about a model, without a place in its file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Finding {
    /// Stable code, such as `U0841`.
    pub code: &'static str,
    /// Error or warning.
    pub severity: Severity,
    /// What was found, with names and events.
    pub message: String,
}

impl Finding {
    fn error(code: &'static str, message: String) -> Self {
        Self { code, severity: Severity::Error, message }
    }

    fn warning(code: &'static str, message: String) -> Self {
        Self { code, severity: Severity::Warning, message }
    }
}

/// What is to be said about a model before synthesis: U0843, a specification names events that no plant has.
pub fn model_findings(model: &Model) -> Vec<Finding> {
    let unknown = unknown_events(&model.plants(), &model.specifications()).into_iter();
    let unknown = unknown.map(|(number, label)| {
        let specification = model.specifications[number].name();
        let event = model.alphabet.name(label);
        let known = model.plants.iter().flat_map(|plant| plant.alphabet().labels());
        let known: Vec<String> = known.map(|label| model.alphabet.name(label)).collect();
        let help = spelling::question(&event, known.iter().map(String::as_str));
        let help = help.map_or_else(String::new, |help| format!("; {help}"));
        let message =
            format!("specification {specification} names event {event}, and no plant has it{help}");
        Finding::error("U0843", message)
    });
    let mut findings: Vec<Finding> = unknown.collect();
    if model.plants.is_empty() {
        findings.push(Finding::error(
            "U0844",
            "the model has no plant: there is nothing to supervise".to_owned(),
        ));
    }
    findings
}

/// What a synthesis found: U0840 for a specification that is not controllable as it stands (the supervisor keeps away from there),
/// U0841 for an empty supervisor, U0842 for events that a meet forbids because the specification does not know them.
pub fn synthesis_findings(model: &Model, result: &Supcon) -> Vec<Finding> {
    let mut findings = Vec::new();
    if !result.not_lifted.is_empty() {
        let message = format!(
            "the specification does not know {}, so the meet forbids it for ever; lift the specification (sync with ALLEVENTS) if that is not meant",
            model.word(&result.not_lifted)
        );
        findings.push(Finding::warning("U0842", message));
    }
    match (&result.explanation, &result.violation) {
        (Some(explanation), _) => findings.push(empty_finding(model, explanation)),
        (None, Some(violation)) => {
            let message =
                format!("{}; the supervisor keeps away from there", violated(model, violation));
            findings.push(Finding::warning("U0840", message));
        }
        (None, None) => {}
    }
    findings
}

/// U0846 if the given specifications are not supervisors: further events must be forbidden.
pub fn specification_findings(result: &Supcon) -> Option<Finding> {
    let (kept, explored) = (result.supervisor.state_count(), result.explored_states);
    let message = format!(
        "the specifications are no supervisors by themselves: of {explored} explored states of their product with the plants, a supervisor keeps to {kept}"
    );
    (!result.is_as_specified()).then(|| Finding::error("U0846", message))
}

/// U0841: there is no supervisor, and why.
pub fn empty_finding(model: &Model, explanation: &Explanation) -> Finding {
    Finding::error("U0841", empty(model, explanation))
}

/// What local-modular synthesis found: as for each local supervisor, and U0845 where they conflict.
pub fn modular_findings(model: &Model, result: &ModularSupervisor) -> Vec<Finding> {
    let mut findings = Vec::new();
    for local in &result.local {
        // A local result counts plants and specifications from 0; the model knows them by other numbers.
        let part = Model {
            plants: local.plants.iter().map(|&plant| model.plants[plant].clone()).collect(),
            specifications: local
                .specification
                .map(|number| model.specifications[number].clone())
                .into_iter()
                .collect(),
            ..model.clone()
        };
        findings.extend(synthesis_findings(&part, &local.result));
    }
    let message = match &result.together {
        Together::Nonconflicting => return findings,
        Together::Conflicting(conflict) => format!(
            "the local supervisors conflict: {} they cannot all come to marked states any more",
            after(model, &conflict.word)
        ),
        Together::ConflictingSomewhere => {
            "the local supervisors conflict somewhere; their product is too large to show where"
                .to_owned()
        }
        Together::Undecided => {
            "whether the local supervisors conflict is not decided: their product is too large"
                .to_owned()
        }
    };
    findings.push(Finding::error("U0845", message));
    findings
}

fn after(model: &Model, word: &[Label]) -> String {
    if word.is_empty() {
        "from the beginning".to_owned()
    } else {
        format!("after \"{}\"", model.word(word))
    }
}

fn violated(model: &Model, violation: &Violation) -> String {
    let specification = model.specifications.get(violation.specification);
    let specification = specification.map_or("", |specification| specification.name());
    format!(
        "{} the plant may do {}, which is uncontrollable, and specification {specification} forbids it",
        after(model, &violation.word),
        model.alphabet.name(violation.event),
    )
}

fn empty(model: &Model, explanation: &Explanation) -> String {
    match explanation {
        Explanation::EmptyPart { name } => format!("there is no supervisor: {name} has no states"),
        Explanation::Violated(violation) => format!(
            "there is no supervisor: by uncontrollable events alone, {}",
            violated(model, violation)
        ),
        Explanation::Blocked { word, states } => {
            let parts = model.plants.iter().chain(&model.specifications);
            let places = parts.zip(states);
            let places: Vec<String> = places
                .map(|(part, &state)| format!("{} in {}", part.name(), part.state_name(state)))
                .collect();
            format!(
                "there is no supervisor: {} no state can be reached in which all are marked ({})",
                after(model, word),
                places.join(", ")
            )
        }
    }
}
