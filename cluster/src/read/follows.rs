//! Sensors of other plants that the terminals of a plant follow: `{ pilot_flame = "pilot-burner.flame" }`.

use understudy_diagnostic::Diagnostic;
use understudy_plant::Followed;
use understudy_wire::ProgramId;

use super::Member;
use super::plants::Draft;
use crate::fields::{Placed, suggestion};

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
            let followed = followed(sensor, draft, drafts, members);
            let followed = followed.map_err(|diagnostic| diagnostics.push(diagnostic));
            Some((terminal.clone(), followed.ok()??))
        })
        .collect()
}

/// Nothing where the ladder of the other plant's controller has errors, which are reported there.
fn followed(
    sensor: &Placed<String>,
    draft: &Draft,
    drafts: &[Draft],
    members: &[Member],
) -> Result<Option<Followed>, Diagnostic> {
    let span = || sensor.span.clone();
    let Some((plant, signal)) = sensor.value.split_once('.') else {
        let message = format!("{:?} names no sensor of a plant", sensor.value);
        return Err(Diagnostic::error("U0206", message, span())
            .with_help("the plant, a dot, and its signal: `\"pilot-burner.flame\"`"));
    };
    if plant == draft.name {
        let message = format!("the plant `{plant}` follows itself");
        return Err(Diagnostic::error("U0215", message, span())
            .with_help("what a plant knows of itself is in its ladder"));
    }
    let Some(other) = drafts.iter().find(|other| other.name == plant) else {
        let known = drafts.iter().map(|other| other.name.as_str());
        let known = known.filter(|name| *name != draft.name);
        return Err(
            Diagnostic::error("U0209", format!("there is no plant `{plant}`"), span())
                .with_help(suggestion(plant, known)),
        );
    };
    let Some((_, controller)) = &members[other.program].lowered else {
        return Ok(None);
    };
    let inputs = controller.inputs();
    let Some(place) = inputs.iter().position(|input| input == signal) else {
        let message = format!("the plant `{plant}` has no sensor `{signal}`");
        return Err(Diagnostic::error("U0209", message, span())
            .with_help(suggestion(signal, inputs.iter().map(String::as_str))));
    };
    Ok(Some(Followed {
        from: ProgramId(other.program as u8),
        sensor: place,
    }))
}
