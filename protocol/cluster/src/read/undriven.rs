//! Programs whose inputs nothing drives: no plant, no device, no operator and no other program.

use understudy_text::Diagnostic;
use understudy_typed::{Point, Program as TypedProgram};

use super::Member;
use super::inputs::names_of_valid;
use crate::cluster::RemoteIo;
use crate::fields::Placed;
use crate::undriven::remains;

/// Names that the warning lists at most.
const MOST_NAMES: usize = 8;

/// Warns of each program without a plant and a device that has an input without a source. `simulated` names the controllers with a plant. A
/// plant or a device that leaves an input without a source has a warning of its own (U0251).
pub(super) fn check(
    members: &[Member],
    remote_ios: &[RemoteIo],
    simulated: &[Placed<String>],
    diagnostics: &mut Vec<Diagnostic>,
) {
    for (member, remote_io) in members.iter().zip(remote_ios) {
        let is_simulated = simulated.iter().any(|name| name.value == member.name);
        let Some((_, interface)) = &member.code else {
            continue;
        };
        if is_simulated || remote_io.field.is_some() {
            continue;
        }
        let inputs = interface.inputs.iter();
        let inputs: Vec<&Point> =
            inputs.filter(|point| !is_driven(remote_io, &point.name)).collect();
        let Some(first) = inputs.first() else {
            continue;
        };
        let listed = inputs.iter().take(MOST_NAMES);
        let mut list: Vec<String> = listed.map(|point| format!("`{}`", point.name)).collect();
        if let more @ 1.. = inputs.len().saturating_sub(MOST_NAMES) {
            list.push(format!("{more} more"));
        }
        let noun = if inputs.len() == 1 { "input" } else { "inputs" };
        let message = format!(
            "nothing drives the {noun} {} of `{}`: no plant, no device, no operator and no other program; {}",
            list.join(", "),
            member.name,
            remains(&inputs[..inputs.len().min(MOST_NAMES)])
        );
        let help = format!(
            "declare a [[plant]], a device in [remote_io.field] or a source in [remote_io.inputs]; a scenario sets an input with action = \"set\", station = \"{}\", input = \"{}\" and a value",
            remote_io.name, first.name
        );
        let span = member.section.span.clone();
        diagnostics.push(Diagnostic::warning("U0256", message, span).with_help(help));
    }
}

fn is_driven(remote_io: &RemoteIo, input: &str) -> bool {
    let mut sources = remote_io.inputs.iter().map(|source| source.name.as_str());
    let diagnosis = remote_io.diagnosis.as_ref();
    // The restart after a program fault is the operator's, and needs no declaration.
    input == TypedProgram::RESET
        || sources.any(|name| name == input || names_of_valid(name).any(|valid| valid == input))
        || diagnosis.is_some_and(|diagnosis| diagnosis.drives(input))
}
