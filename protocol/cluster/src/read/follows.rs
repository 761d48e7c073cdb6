//! Sensors of other plants that the terminals of a plant follow: `{ pilot_flame = "pilot-burner.flame" }`.

use understudy_plant::Followed;
use understudy_text::Diagnostic;
use understudy_text::spelling::suggestion;
use understudy_wire::ProgramId;

use super::Member;
use super::plants::{Draft, of_other_type};
use crate::fields::Placed;

/// Each terminal with what it follows; those that nothing has are reported and left out.
pub(crate) fn resolve(
    draft: &Draft,
    drafts: &[Draft],
    members: &[Member],
    diagnostics: &mut Vec<Diagnostic>,
) -> Vec<(String, Followed)> {
    let entries = draft.section.follows.iter();
    entries
        .filter_map(|(terminal, (_, sensor))| {
            let followed = followed(terminal, sensor, draft, drafts, members, diagnostics)?;
            Some((terminal.clone(), followed))
        })
        .collect()
}

fn followed(
    terminal: &str,
    sensor: &Placed<String>,
    draft: &Draft,
    drafts: &[Draft],
    members: &[Member],
    diagnostics: &mut Vec<Diagnostic>,
) -> Option<Followed> {
    let mut report = |code, message: String, help: &str| {
        let span = sensor.span.clone();
        diagnostics.push(Diagnostic::error(code, message, span).with_help(help));
    };
    let Some((plant, signal)) = sensor.value.split_once('.') else {
        let message = format!("{:?} names no sensor of a plant", sensor.value);
        let help = "the plant, a dot, and its signal: `\"pilot-burner.flame\"`";
        report("U0206", message, help);
        return None;
    };
    if plant == draft.name {
        let message = format!("the plant `{plant}` follows itself");
        report("U0215", message, "what a plant knows of itself is in its ladder");
        return None;
    }
    let Some(other) = drafts.iter().find(|other| other.name == plant) else {
        let known = drafts.iter().map(|other| other.name.as_str());
        let known = known.filter(|name| *name != draft.name);
        let message = format!("there is no plant `{plant}`");
        report("U0209", message, &suggestion(plant, known));
        return None;
    };
    // Where the other plant's controller has no circuit, that was reported there.
    let (_, controller) = members[other.program].code.as_ref()?;
    let inputs = &controller.inputs;
    let Some(point) = inputs.find(signal) else {
        let message = format!("the plant `{plant}` has no sensor `{signal}`");
        report("U0209", message, &suggestion(signal, inputs.names()));
        return None;
    };
    let actuators = draft.kind.iter().flat_map(|kind| kind.terminals().actuators);
    let own = actuators.into_iter().find(|own| own.name == terminal);
    // A terminal that the plant does not have is reported with the others.
    if let Some(own) = own.filter(|own| !own.declared.takes(&point.declared())) {
        let receiver = format!("`{terminal}` of the plant `{}`", draft.name);
        let sender = format!("the sensor `{signal}` of the plant `{plant}`");
        let receiver = (receiver, own.declared);
        let span = sensor.span.clone();
        diagnostics.push(of_other_type((sender, point.declared()), receiver, span));
    }
    Some(Followed {
        from: ProgramId(other.program as u8),
        sensor: point.bit as usize,
        bits: point.of.bits() as usize,
    })
}
