//! Fail-safe values of outputs, and the ramps to them.

use std::time::Duration;

use understudy_executable::{Interface, stored_value};
use understudy_remote_io::{PointPlace, Ramp};
use understudy_text::Diagnostic;
use understudy_text::spelling::suggestion;
use understudy_text::tables::Constant;
use understudy_typed::Point;
use understudy_wire::Image;

use super::Member;
use crate::fields::{MAXIMUM_MISFITS, Placed};

/// y(i) from the names that are set.
pub(super) fn values(
    member: &Member,
    entries: &[(Placed<String>, Constant)],
    diagnostics: &mut Vec<Diagnostic>,
) -> Image {
    let Some((_, interface)) = &member.code else {
        return Image::default();
    };
    let width = interface.outputs.width();
    let mut image = Image::zero(width.min(understudy_wire::MAXIMUM_IMAGE_BITS));
    // No value is driven that the declaration of an output does not have.
    let fits = width <= understudy_wire::MAXIMUM_IMAGE_BITS;
    for output in interface.outputs.iter().filter(|_| fits) {
        output.set(image.words_mut(), output.declared().nearest(0) as u64);
    }
    for (output, name, value) in outputs(member, interface, entries, diagnostics) {
        match stored_value(value, &output.declared()) {
            Ok(stored) => output.set(image.words_mut(), stored),
            Err(expected) => {
                let message = format!("`{}` is {}: {expected}", output.name, output.declared());
                diagnostics.push(Diagnostic::error("U0204", message, name.span.clone()));
            }
        }
    }
    image
}

/// The ramps of the outputs that are named, from units a second.
pub(super) fn ramps(
    member: &Member,
    entries: &[(Placed<String>, Constant)],
    period: Duration,
    diagnostics: &mut Vec<Diagnostic>,
) -> Vec<Ramp> {
    let Some((_, interface)) = &member.code else {
        return Vec::new();
    };
    let named = outputs(member, interface, entries, diagnostics);
    let ramp = |(output, name, value): (&Point, &Placed<String>, &Constant)| {
        let is_number = output.of.is_integer() || output.of.is_real();
        let per_second = match value {
            Constant::Whole(number) => *number as f64,
            Constant::Number(number) => *number,
            _ => f64::NAN,
        };
        let step = per_second * period.as_secs_f64();
        let problem = if !is_number {
            format!("`{}` is {}: only a number has a ramp", output.name, output.of)
        } else if !(step > 0.0 && step.is_finite()) {
            let name = &output.name;
            format!("the ramp of `{name}` is not above 0: write units per second, such as 5.0")
        } else {
            let place = PointPlace { bit: u16::try_from(output.bit).ok()?, of: output.of };
            return Some(Ramp { place, step });
        };
        diagnostics.push(Diagnostic::error("U0204", problem, name.span.clone()));
        None
    };
    named.into_iter().filter_map(ramp).collect()
}

/// The outputs that a table names, with their names and values; reports those that the program does not have.
fn outputs<'a>(
    member: &Member,
    interface: &'a Interface,
    entries: &'a [(Placed<String>, Constant)],
    diagnostics: &mut Vec<Diagnostic>,
) -> Vec<(&'a Point, &'a Placed<String>, &'a Constant)> {
    let outputs = &interface.outputs;
    let mut found = Vec::new();
    let mut misfits = 0;
    for (name, value) in entries {
        if let Some(output) = outputs.find(&name.value) {
            found.push((output, name, value));
            continue;
        }
        misfits += 1;
        if misfits <= MAXIMUM_MISFITS {
            let message = format!("`{}` has no output `{}`", member.name, name.value);
            diagnostics.push(
                Diagnostic::error("U0209", message, name.span.clone())
                    .with_help(suggestion(&name.value, outputs.names())),
            );
        }
    }
    if misfits > MAXIMUM_MISFITS {
        let more = misfits - MAXIMUM_MISFITS;
        let message = format!("`{}` has none of {more} more outputs", member.name);
        let span = member.section.span.clone();
        diagnostics.push(Diagnostic::error("U0209", message, span));
    }
    found
}
