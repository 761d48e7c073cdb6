//! Devices behind remote I/Os: their signals, bound to the inputs and outputs of the program.

use std::collections::BTreeMap;
use std::ops::Range;

use understudy_text::Diagnostic;
use understudy_text::spelling::suggestion;

use super::Member;
use crate::cluster::RemoteIo;
use crate::device::{FieldDevice, Point};
use crate::fields::{MAXIMUM_MISFITS, Placed};
use crate::file::FieldSection;

/// The device of a remote I/O; nothing where its section has errors.
pub(super) fn device(
    section: &FieldSection,
    member: &Member,
    diagnostics: &mut Vec<Diagnostic>,
) -> Option<FieldDevice> {
    let (_, interface) = member.code.as_ref()?;
    let before = diagnostics.len();
    let inputs: Vec<&str> = interface.inputs.names().collect();
    let outputs: Vec<&str> = interface.outputs.names().collect();
    let sensors = places(&section.inputs, &inputs, "input", member, diagnostics);
    let actuators = places(&section.outputs, &outputs, "output", member, diagnostics);
    let mut driven: BTreeMap<Point, &str> = BTreeMap::new();
    for (name, place) in &section.outputs {
        let Ok(point) = place.1.value.parse::<Point>() else {
            continue;
        };
        if !point.is_writable() {
            let message = format!("`{point}` can only be read, and `{name}` is an output");
            diagnostics.push(
                Diagnostic::error("U0222", message, place.1.span.clone())
                    .with_help("an output goes to a coil or to a bit of a holding register"),
            );
        } else if let Some(first) = driven.insert(point, name) {
            let message = format!("two outputs, `{first}` and `{name}`, go to `{point}`");
            diagnostics.push(Diagnostic::error("U0222", message, place.1.span.clone()));
        }
    }
    let mut warned = false;
    for (names, places, side, code, effect) in [
        (&inputs, &sensors, "input", "U0251", "it stays 0"),
        (&outputs, &actuators, "output", "U0252", "it moves nothing"),
    ] {
        let lacking: Vec<&str> = names
            .iter()
            .zip(places)
            .filter(|(_, place)| place.is_none())
            .map(|(name, _)| *name)
            .collect();
        // Where names were misspelt, that was said.
        if diagnostics.len() == before || warned {
            for name in lacking.into_iter().take(MAXIMUM_MISFITS) {
                let message = format!(
                    "the {side} `{name}` of `{}` has no place in the device: {effect}",
                    member.name
                );
                diagnostics.push(Diagnostic::warning(code, message, section.span.clone()));
                warned = true;
            }
        }
    }
    let is_error = |found: &Diagnostic| found.severity == understudy_text::Severity::Error;
    let address = section.address.as_ref()?.value;
    (!diagnostics[before..].iter().any(is_error)).then_some(FieldDevice {
        address,
        unit: section.unit,
        timeout: section.timeout,
        stale_after: section.stale_after,
        inputs: sensors,
        outputs: actuators,
    })
}

/// A plant is either equipment or simulated: two of them would both make u(i).
pub(super) fn check_simulated(
    simulated: &[Placed<String>],
    members: &[Member],
    remote_ios: &[RemoteIo],
    diagnostics: &mut Vec<Diagnostic>,
) {
    for controller in simulated {
        let both = members.iter().zip(remote_ios).any(|(member, remote_io)| {
            member.name == controller.value && remote_io.field.is_some()
        });
        if both {
            let message = format!(
                "`{}` has a simulated plant, and its remote I/O has a device",
                controller.value
            );
            diagnostics.push(
                Diagnostic::error("U0221", message, controller.span.clone())
                    .with_help("leave either `[[plant]]` or `[remote_io.field]` out"),
            );
        }
    }
}

/// The places of `names`, in their order.
fn places(
    entries: &BTreeMap<String, (Range<usize>, Placed<String>)>,
    names: &[&str],
    side: &str,
    member: &Member,
    diagnostics: &mut Vec<Diagnostic>,
) -> Vec<Option<Point>> {
    let mut found = vec![None; names.len()];
    for (name, (span, place)) in entries.iter().take(MAXIMUM_MISFITS * 10) {
        let point = place.value.parse::<Point>();
        if let Err(error) = &point {
            diagnostics.push(
                Diagnostic::error("U0222", error.to_string(), place.span.clone())
                    .with_help(format!("write {}", Point::EXAMPLES)),
            );
        }
        match names.iter().position(|known| known == name) {
            Some(index) => found[index] = point.ok(),
            None => {
                let message = format!("`{}` has no {side} `{name}`", member.name);
                diagnostics.push(
                    Diagnostic::error("U0209", message, span.clone())
                        .with_help(suggestion(name, names.iter().copied())),
                );
            }
        }
    }
    found
}
