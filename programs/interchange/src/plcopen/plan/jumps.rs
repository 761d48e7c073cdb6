//! What a jump may do: skip what comes before a label further down, and nothing that is used there.

use std::collections::HashMap;

use understudy_text::Diagnostic;

use super::{Action, Plan};
use crate::plcopen::document::Graph;
use crate::plcopen::power::Power;

/// Jumps of a body, each of which what it may skip asks.
const MAXIMUM_JUMPS: usize = 64;

/// Says what is wrong with the jumps and labels of a plan.
pub(super) fn check(graph: &Graph, plan: &Plan, diagnostics: &mut Vec<Diagnostic>) {
    let jumps = plan.steps.iter();
    let mut jumps = jumps.filter(|step| matches!(step.action, Action::Jump { .. }));
    if let Some(step) = jumps.nth(MAXIMUM_JUMPS) {
        let message = format!("a body has more than {MAXIMUM_JUMPS} jumps");
        diagnostics.push(Diagnostic::error("U1016", message, step.span.clone()));
        return;
    }
    let mut labels: HashMap<String, usize> = HashMap::new();
    for (place, step) in plan.steps.iter().enumerate() {
        if let Action::Label(name) = &step.action
            && let Some(first) = labels.insert(name.to_uppercase(), place)
        {
            let message = format!("two labels are called `{name}`");
            let error = Diagnostic::error("U1016", message, step.span.clone());
            diagnostics.push(error.with_related(plan.steps[first].span.clone(), "the first"));
        }
    }
    // From the first step that a jump skips up to its label, by the label's place: the longest.
    let mut skipped: HashMap<usize, usize> = HashMap::new();
    for (place, step) in plan.steps.iter().enumerate() {
        let Action::Jump { label: Some(label), .. } = &step.action else {
            continue;
        };
        let target = labels.get(&label.to_uppercase()).copied();
        match target {
            Some(target) if target > place => {
                let first = skipped.entry(target).or_insert(place);
                *first = (*first).min(place);
            }
            Some(target) => {
                let message =
                    format!("a jump goes back to `{label}`: only jumps further down are taken");
                let error = Diagnostic::error("U1016", message, step.span.clone());
                let label = plan.steps[target].span.clone();
                diagnostics.push(
                    error.with_related(label, "the label").with_help(
                        "a scan passes each rung once; what repeats is spread over scans",
                    ),
                );
            }
            None => {
                let message = format!("a jump goes to `{label}`, and no label is called so");
                diagnostics.push(Diagnostic::error("U1016", message, step.span.clone()));
            }
        }
    }
    if !skipped.is_empty() {
        crossing(graph, plan, &skipped, diagnostics);
    }
}

/// Power that is made where a jump may skip it, and used behind the label of the jump.
fn crossing(
    graph: &Graph,
    plan: &Plan,
    skipped: &HashMap<usize, usize>,
    diagnostics: &mut Vec<Diagnostic>,
) {
    // Behind each step: where the earliest jump over a label up to there begins, and that label.
    let mut made: HashMap<usize, usize> = HashMap::new();
    let mut passed: Vec<(usize, usize)> = Vec::new();
    for (place, step) in plan.steps.iter().enumerate() {
        if let Some(&first) = skipped.get(&place) {
            passed.push((first, place));
        }
        let mut objects = Vec::new();
        for power in step.action.powers() {
            power.visit(&mut |part| match part {
                Power::Kept(object) => objects.push(*object),
                Power::Read(read) if read.edge.is_some() => objects.push(read.object),
                _ => {}
            });
        }
        if let Action::Keep { object, .. } = &step.action {
            objects.push(*object);
        }
        for object in objects {
            let first = *made.entry(object).or_insert(place);
            let is_lost = |(jump, label): &(usize, usize)| *jump < first && first < *label;
            if passed.iter().any(is_lost) {
                let message = "its power is used behind a label to which a jump may skip it";
                let span = graph
                    .objects
                    .get(object)
                    .map_or(step.span.clone(), |object| object.span.clone());
                let error = Diagnostic::error("U1016", message, span);
                diagnostics.push(error.with_related(step.span.clone(), "used here"));
            }
        }
    }
}
