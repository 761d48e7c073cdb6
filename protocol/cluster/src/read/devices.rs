//! Devices behind remote I/Os: their signals, bound to the inputs and outputs of the program.

use std::collections::{BTreeMap, BTreeSet};

use understudy_text::Diagnostic;
use understudy_text::spelling::suggestion;
use understudy_typed::{Elementary, Point, Points, Program as TypedProgram};

use super::Member;
use super::inputs::names_of_valid;
use crate::cluster::RemoteIo;
use crate::device::{Binding, FieldDevice, Side};
use crate::fields::{MAXIMUM_MISFITS, PlaceEntry, Placed, SourceEntry};
use crate::file::FieldSection;
use crate::place::{BitPlace, Place, Registers};
use crate::undriven::{initial_image, remains};

/// The device of a remote I/O; nothing where its section has errors. `read` are the outputs that other programs read.
pub(super) fn device(
    section: &FieldSection,
    sources: &[SourceEntry],
    read: &BTreeSet<String>,
    member: &Member,
    diagnostics: &mut Vec<Diagnostic>,
) -> Option<FieldDevice> {
    let (_, interface) = member.code.as_ref()?;
    let before = diagnostics.len();
    let inputs = side(&section.inputs, &interface.inputs, "input", member, diagnostics);
    let outputs = side(&section.outputs, &interface.outputs, "output", member, diagnostics);
    check_driven(&section.outputs, diagnostics);
    let mut warned = false;
    for (points, entries, side, code) in [
        (&interface.inputs, &section.inputs, "input", "U0251"),
        (&interface.outputs, &section.outputs, "output", "U0252"),
    ] {
        // The points of a program fault are for the operator and need no wire.
        let optional = [TypedProgram::RESET, TypedProgram::FAULT];
        let lacking = points
            .iter()
            .filter(|Point { name, .. }| !entries.contains_key(name))
            .filter(|Point { name, .. }| !optional.contains(&name.as_str()))
            .filter(|Point { name, .. }| !is_sourced(sources, name))
            .filter(|Point { name, .. }| !read.contains(&format!("{}.{name}", member.name)));
        // Where names were misspelt, that was said.
        if diagnostics.len() == before || warned {
            for point in lacking.take(MAXIMUM_MISFITS) {
                let effect = match side {
                    "input" => remains(&[point]),
                    _ => "it moves nothing".to_owned(),
                };
                let message = format!(
                    "the {side} `{}` of `{}` has no place in the device: {effect}",
                    point.name, member.name
                );
                diagnostics.push(Diagnostic::warning(code, message, section.span.clone()));
                warned = true;
            }
        }
    }
    let connection = section.connection.clone()?;
    (!diagnostics[before..].iter().any(super::is_error)).then_some(FieldDevice {
        connection,
        unit: section.unit,
        timeout: section.timeout,
        stale_after: section.stale_after,
        inputs,
        outputs,
    })
}

/// Whether an input has a source that is not the field, or says whether that source is valid.
pub(super) fn is_sourced(sources: &[SourceEntry], input: &str) -> bool {
    let mut names = sources.iter().map(|source| source.name.value.as_str());
    names.any(|name| name == input || names_of_valid(name).any(|valid| valid == input))
}

/// An output needs a place that can be written, and one of its own.
fn check_driven(entries: &BTreeMap<String, PlaceEntry>, diagnostics: &mut Vec<Diagnostic>) {
    // By table, address and bit; a number has all bits of its registers.
    let mut driven: BTreeMap<(bool, u16, u8), (&str, String)> = BTreeMap::new();
    for (name, entry) in entries {
        let Some(place) = &entry.place else {
            continue;
        };
        if !place.is_writable() {
            let message = format!("`{place}` can only be read, and `{name}` is an output");
            diagnostics.push(
                Diagnostic::error("U0222", message, entry.span.clone())
                    .with_help("an output goes to a coil, to a bit of a holding register or to whole holding registers"),
            );
            continue;
        }
        let bits: Vec<(bool, u16, u8)> = match place {
            Place::Bit(BitPlace::Holding(register, bit)) => vec![(true, *register, *bit)],
            Place::Bit(
                BitPlace::Coil(address) | BitPlace::Discrete(address) | BitPlace::Input(address, _),
            ) => vec![(false, *address, 0)],
            Place::Number(registers) => {
                let addresses = (0..registers.count()).map(|at| registers.address + at);
                addresses.flat_map(|address| (0..16).map(move |bit| (true, address, bit))).collect()
            }
        };
        let taken = bits.iter().find_map(|bit| driven.get(bit));
        if let Some((first, other)) = taken {
            let message = if *other == place.to_string() {
                format!("two outputs, `{first}` and `{name}`, go to `{place}`")
            } else {
                format!(
                    "two outputs overlap: `{first}` goes to `{other}`, and `{name}` to `{place}`"
                )
            };
            diagnostics.push(Diagnostic::error("U0222", message, entry.span.clone()));
        } else {
            let owner = (name.as_str(), place.to_string());
            driven.extend(bits.into_iter().map(|bit| (bit, owner.clone())));
        }
    }
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

/// The signals of one side that have a place, in order of declaration.
fn side(
    entries: &BTreeMap<String, PlaceEntry>,
    points: &Points,
    side: &str,
    member: &Member,
    diagnostics: &mut Vec<Diagnostic>,
) -> Side {
    let known: BTreeSet<&str> = points.names().collect();
    for (name, entry) in entries.iter().take(MAXIMUM_MISFITS * 10) {
        if !known.contains(name.as_str()) {
            let message = format!("`{}` has no {side} `{name}`", member.name);
            diagnostics.push(
                Diagnostic::error("U0209", message, entry.name.clone())
                    .with_help(suggestion(name, points.names())),
            );
        }
    }
    let mut bindings = Vec::new();
    for point in points {
        let Some(PlaceEntry { place: Some(place), span, .. }) = entries.get(&point.name) else {
            continue;
        };
        if let Err((message, help)) = fit(point, place, side == "input") {
            diagnostics.push(Diagnostic::error("U0222", message, span.clone()).with_help(help));
        }
        bindings.push(Binding {
            name: point.name.clone(),
            declared: point.declared(),
            bit: point.bit as usize,
            place: *place,
        });
    }
    let mut rest = initial_image(points);
    let placed = bindings.iter().filter_map(|binding| points.find(&binding.name));
    for point in placed {
        point.set(rest.words_mut(), 0);
    }
    Side { rest, bindings }
}

/// Whether values of a signal and of its place convert into each other.
///
/// # Errors
/// Message and help.
fn fit(point: &Point, place: &Place, is_input: bool) -> Result<(), (String, String)> {
    let Point { name, of, .. } = point;
    let misfit =
        |help: String| Err((format!("`{name}` is {of}, and its place is `{place}`"), help));
    let registers = match place {
        Place::Bit(_) if *of == Elementary::Bool => return Ok(()),
        Place::Bit(_) => {
            let table = if is_input { "input" } else { "holding" };
            let word = natural(*of).name().to_ascii_lowercase();
            return misfit(format!(
                "a number needs whole registers: write their first address and their type, such as \"{table}:10 {word}\""
            ));
        }
        Place::Number(registers) => registers,
    };
    let Registers { table, address, .. } = registers;
    if *of == Elementary::Bool {
        return misfit(format!("a BOOL is one bit: write for example \"{table}:{address}.0\""));
    }
    if of.is_time() {
        return misfit("registers have no times: declare a DINT, such as milliseconds, and convert it in the program".into());
    }
    if of.is_real() {
        return Ok(());
    }
    let word = natural(*of).name().to_ascii_lowercase();
    if registers.of.is_real() {
        return misfit(format!(
            "declare `{name} : {}`, or write \"{table}:{address} {word}\" where the device has whole numbers",
            registers.of
        ));
    }
    if registers.is_scaled() {
        return match of.is_bit_string() {
            true => misfit(format!("{of} is a bit string: leave `scale` and `offset` out")),
            false => Ok(()),
        };
    }
    let (source, target) = match is_input {
        true => (registers.of, *of),
        false => (*of, registers.of),
    };
    // Of an output with a subrange, its values alone are written.
    let (least, most) = match is_input {
        true => source.limits(),
        false => point.range.unwrap_or_else(|| source.limits()),
    };
    let (low, high) = target.limits();
    if registers.of == natural(*of) || low <= least && most <= high {
        return Ok(());
    }
    misfit(format!(
        "{target} does not have all values of {source}: write \"{table}:{address} {word}\", or declare `{name} : {}`",
        registers.of
    ))
}

/// The type of registers that suits a signal best; Modbus has no registers of 8 bits.
fn natural(of: Elementary) -> Elementary {
    match of {
        Elementary::Sint | Elementary::Int => Elementary::Int,
        Elementary::Byte | Elementary::Usint | Elementary::Word | Elementary::Uint => {
            Elementary::Uint
        }
        Elementary::Dword | Elementary::Udint => Elementary::Udint,
        Elementary::Lword | Elementary::Ulint => Elementary::Ulint,
        Elementary::Bool | Elementary::Dint => Elementary::Dint,
        other if other.is_time() => Elementary::Lint,
        other => other,
    }
}
