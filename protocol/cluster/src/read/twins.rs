//! The second remote I/O of a program.

use std::net::SocketAddr;
use std::ops::Range;
use std::time::Duration;

use understudy_remote_io::{PairedInput, PointPlace, SWITCHOVER, SharedOutputs, Wiring};
use understudy_text::spelling::suggestion;
use understudy_text::tables::{Constant, key_text};
use understudy_text::{Diagnostic, duration};
use understudy_typed::{Elementary, Points, is_within};

use super::Member;
use super::names::Names;
use crate::address::Addresses;
use crate::cluster::{PlantPlace, RemoteIo, Twin};
use crate::device::{Connection, FieldDevice, SerialLine};
use crate::fields::{ConnectionText, MAXIMUM_MISFITS, Placed};
use crate::file::{FieldSection, TwinSection};

/// Periods after which a device is not written any more with outputs that were driven.
const OUTPUTS_LAST: u32 = 2;

/// Reads a twin of a remote I/O; nothing where it has no name, which is reported.
pub(super) fn read(
    section: TwinSection,
    (remote_io, member): (&RemoteIo, &Member),
    field: Option<&FieldSection>,
    period: Duration,
    names: &mut Names,
    diagnostics: &mut Vec<Diagnostic>,
) -> Option<Twin> {
    names.listen(&section.addresses, diagnostics);
    check_host(&section, remote_io, diagnostics);
    check_keys(&section, diagnostics);
    let mut shared_outputs = SharedOutputs::default();
    let (paired_inputs, device) = if section.is_parallel {
        shared_outputs = read_shares(&section, remote_io, member, period, diagnostics);
        check_outputs(&section, remote_io, member, diagnostics);
        let device = own_device(&section, remote_io, field, diagnostics);
        (paired_inputs(&section, member, diagnostics), device)
    } else {
        check_device(&section, field, period, diagnostics);
        (Vec::new(), None)
    };
    let name = section.name?;
    names.declare(&name.value, name.span, diagnostics);
    Some(Twin {
        name: name.value,
        take_over_after: section.take_over_after,
        wiring: match section.is_parallel {
            true => Wiring::Parallel { discrepancy_cycles: section.discrepancy_cycles },
            false => Wiring::Exclusive,
        },
        paired_inputs,
        shared_outputs,
        field: device,
        direct_link: section.direct_link,
        addresses: section.addresses.map(|address| address.value),
    })
}

/// Reports a direct link that does not join the two remote I/Os of a program. `first` are the addresses of the first one.
pub(super) fn check_link(
    first: &Addresses<Placed<SocketAddr>>,
    twin: Option<&TwinSection>,
    diagnostics: &mut Vec<Diagnostic>,
) {
    let mut refuse = |message: String, place: &Placed<SocketAddr>, help: &str| {
        let found = Diagnostic::error("U0263", message, place.span.clone());
        diagnostics.push(found.with_help(help));
    };
    let own = twin.map(|twin| twin.addresses.as_ref());
    let own_link = own.and_then(|own| own.link);
    let given = first.link.as_ref().or(own_link);
    match (twin, given) {
        (None, Some(link)) => {
            let message = "a `link_address` of a remote I/O without a twin".to_owned();
            refuse(message, link, "add `twin`, or remove `link_address`");
        }
        (Some(twin), Some(link)) if !twin.direct_link => {
            let message = "a `link_address` without `direct_link = true`".to_owned();
            let help =
                "add `direct_link = true` to the twin, and a `link_address` to both remote I/Os";
            refuse(message, link, help);
        }
        (Some(twin), _) if twin.direct_link => {
            let addresses = [first.as_ref(), twin.addresses.as_ref()];
            for Addresses { first, link, .. } in addresses {
                let help =
                    "both remote I/Os have an `address` and a `link_address`, or neither has one";
                match (first, link) {
                    (Some(first), None) => {
                        let at = first.value;
                        let message = format!(
                            "the remote I/O at {at} has a direct link and no `link_address`"
                        );
                        refuse(message, first, help);
                    }
                    (None, Some(link)) => {
                        let at = link.value;
                        let message =
                            format!("the remote I/O at {at} has a `link_address` and no `address`");
                        refuse(message, link, help);
                    }
                    _ => {}
                }
            }
        }
        _ => {}
    }
}

/// Warns of two remote I/Os of a program on one machine.
fn check_host(section: &TwinSection, first: &RemoteIo, diagnostics: &mut Vec<Diagnostic>) {
    let (own, first) = (section.addresses.as_ref(), first.addresses);
    let pairs = [(own.first, first.first), (own.second, first.second), (own.link, first.link)];
    for (own, first) in pairs {
        let (Some(own), Some(first)) = (own, first) else {
            continue;
        };
        let host = own.value.ip().to_canonical();
        if host == first.ip().to_canonical() && !host.is_loopback() {
            let message = format!("the twin and its remote I/O are both at {host}");
            let help = "run the twin on another machine, with another power supply: what stops one machine stops both";
            let found = Diagnostic::warning("U0262", message, own.span.clone());
            diagnostics.push(found.with_help(help));
            return;
        }
    }
}

/// Reports keys of the other wiring.
fn check_keys(section: &TwinSection, diagnostics: &mut Vec<Diagnostic>) {
    for key in &section.special {
        let is_exclusive = key.value == "owner_timeout";
        if is_exclusive == section.is_parallel {
            let (wiring, other) =
                if is_exclusive { ("exclusive", "parallel") } else { ("parallel", "exclusive") };
            let message = format!("`{}` of a twin with wiring \"{other}\"", key.value);
            let help = format!("only wiring \"{wiring}\" has it: remove one of the two");
            diagnostics.push(Diagnostic::error("U0259", message, key.span.clone()).with_help(help));
        }
    }
}

/// Whether one device can be given from one remote I/O to the other.
fn check_device(
    section: &TwinSection,
    field: Option<&FieldSection>,
    period: Duration,
    diagnostics: &mut Vec<Diagnostic>,
) {
    if matches!(field.and_then(|field| field.connection.as_ref()), Some(Connection::Rtu(_))) {
        let message =
            "a twin of a remote I/O whose device is on a serial line: the line has one master";
        let help = "connect the device by Modbus TCP, or remove `twin`";
        diagnostics.push(Diagnostic::error("U0229", message, section.span.clone()).with_help(help));
    }
    let (after, owner_timeout) = (section.take_over_after, section.owner_timeout);
    if period * after < owner_timeout {
        let needed = owner_timeout.as_nanos().div_ceil(period.as_nanos().max(1));
        let message = format!(
            "the twin takes over after {after} cycles of {}, and the device lets no other one write for {}",
            duration::text(period),
            duration::text(owner_timeout),
        );
        let found = Diagnostic::error("U0229", message, section.span.clone());
        diagnostics.push(found.with_help(format!(
            "use `take_over_after = {needed}`, or a shorter time-out of the device"
        )));
    }
}

/// The device of the twin: another one than that of the first remote I/O, with the same places.
fn own_device(
    section: &TwinSection,
    remote_io: &RemoteIo,
    field: Option<&FieldSection>,
    diagnostics: &mut Vec<Diagnostic>,
) -> Option<FieldDevice> {
    let has_modbus = section.special.iter().any(|key| key.value == "modbus");
    let mut refuse = |message: &str, help: &str| {
        let found = Diagnostic::error("U0259", message, section.span.clone());
        diagnostics.push(found.with_help(help));
        None
    };
    let first = match (field.map(|field| field.connection.as_ref()), has_modbus) {
        (None, false) => return None,
        (None, true) => {
            let message = "the twin has a device, and its remote I/O has none";
            return refuse(message, "add `[remote_io.field]`, whose places are those of both");
        }
        (Some(_), false) => {
            let message = "a twin with wiring \"parallel\" and without modules of its own";
            return refuse(message, "add `modbus = …`: where the device of the twin is");
        }
        (Some(first), true) => first?,
    };
    let connection = match (section.connection.as_ref()?, first) {
        (ConnectionText::Tcp(address), _) => Connection::Tcp(*address),
        (ConnectionText::Rtu(path), Connection::Rtu(line)) => {
            Connection::Rtu(SerialLine { path: path.clone(), ..line.clone() })
        }
        (ConnectionText::Rtu(_), Connection::Tcp(_)) => {
            let message = "the device of the twin is on a serial line, and the first one is not";
            return refuse(message, "connect both by Modbus TCP, or both by serial lines");
        }
    };
    if connection == *first {
        let message = format!("the twin and its remote I/O have one device, {connection}");
        let help = "name another device, or use wiring \"exclusive\"";
        return refuse(&message, help);
    }
    remote_io.field.clone().map(|device| FieldDevice { connection, ..device })
}

/// Reports outputs that two modules cannot drive together.
fn check_outputs(
    section: &TwinSection,
    remote_io: &RemoteIo,
    member: &Member,
    diagnostics: &mut Vec<Diagnostic>,
) {
    let Some((_, interface)) = &member.code else {
        return;
    };
    let is_number = |of: Elementary| of != Elementary::Bool && !of.is_bit_string();
    let is_shared = |name: &str| section.share.contains_key(name);
    let numbers = interface.outputs.iter().filter(|output| is_number(output.of));
    let numbers = numbers.filter(|output| !is_shared(&output.name));
    // A name that no output has is reported already, and may be meant for one of these.
    let are_known = section.share.keys().all(|name| interface.outputs.find(name).is_some());
    for output in numbers.filter(|_| are_known).take(MAXIMUM_MISFITS) {
        let message = format!(
            "`{}` is {}, and two modules through diodes drive outputs of bits only",
            output.name, output.of
        );
        let found = Diagnostic::error("U0260", message, section.span.clone());
        let help = match SharedOutputs::can_share(output.of) && output.values.is_none() {
            true => {
                let key = key_text(&output.name);
                let share = match section.share.is_empty() {
                    true => format!("`share = {{ {key} = \"half\" }}`"),
                    false => format!("`{key} = \"half\"` to `share`"),
                };
                format!(
                    "add {share} where the currents of the two modules add up, or use wiring \"exclusive\""
                )
            }
            false => "use wiring \"exclusive\" for a program with this output".to_owned(),
        };
        diagnostics.push(found.with_help(help));
    }
    let safe = &remote_io.fallback.fail_safe;
    let is_set = |first: u32, bits: u32| {
        (first..first + bits).map(|bit| bit as usize).any(|bit| bit < safe.width() && safe.get(bit))
    };
    let set = interface.outputs.iter().filter(|output| is_set(output.bit, output.of.bits()));
    for output in set.take(MAXIMUM_MISFITS) {
        let message = format!(
            "`{}` has a fail-safe value other than 0, which lasts only while one of the two remote I/Os drives: modules that are not driven are released",
            output.name
        );
        diagnostics.push(Diagnostic::warning("U0261", message, section.span.clone()));
    }
}

/// What may be meant by a name that no output has: the parts of an array or of a structure are outputs of their own.
fn output_help(name: &str, outputs: &Points) -> String {
    let parts = outputs.names().filter(|output| is_within(output, name)).take(MAXIMUM_MISFITS);
    let parts: Vec<String> = parts.map(|part| format!("{} = \"half\"", key_text(part))).collect();
    match parts.is_empty() {
        true => suggestion(name, outputs.names()),
        false => format!("each part is an output of its own: `{}`", parts.join(", ")),
    }
}

/// Numbers that the modules of both drive together.
fn read_shares(
    section: &TwinSection,
    remote_io: &RemoteIo,
    member: &Member,
    period: Duration,
    diagnostics: &mut Vec<Diagnostic>,
) -> SharedOutputs {
    let Some((_, interface)) = &member.code else {
        return SharedOutputs::default();
    };
    let device = remote_io.field.as_ref();
    let mut places: Vec<PointPlace> = Vec::new();
    for (name, (span, how)) in &section.share {
        let mut refuse = |code, message: String, span: &Range<usize>, help: String| {
            diagnostics.push(Diagnostic::error(code, message, span.clone()).with_help(help));
        };
        let Some(output) = interface.outputs.iter().find(|output| output.name == *name) else {
            let message = format!("`{}` has no output `{name}`", member.name);
            refuse("U0209", message, span, output_help(name, &interface.outputs));
            continue;
        };
        let binding = device.and_then(|device| {
            device.outputs.bindings.iter().find(|binding| binding.name == *name)
        });
        let is_value = |range: (i128, i128)| range.0 <= 0 && 0 <= range.1;
        if !SharedOutputs::can_share(output.of) || output.values.is_some() {
            let declared = output.declared();
            let message = format!("`{name}` is {declared}: only a number has a share");
            refuse("U0204", message, span, "remove it from `share`".to_owned());
        } else if how.value != "half" {
            let message = format!("`{}` is no share", how.value);
            refuse("U0207", message, &how.span, "write \"half\"".to_owned());
        } else if !output.range.is_none_or(is_value) {
            let message = format!(
                "`{name}` is {}, which does not contain 0: one module drives 0 where the other one drives the whole",
                output.declared()
            );
            refuse("U0260", message, span, "use wiring \"exclusive\"".to_owned());
        } else if binding.is_some_and(|binding| binding.place.rounds(output.of)) {
            let message = format!(
                "`{name}` is rounded to whole numbers in its registers, so two halves can be more than the whole"
            );
            let help = "let the program compute a whole number, and write it without a `scale`";
            refuse("U0260", message, span, help.to_owned());
        } else if binding.is_some_and(|binding| binding.place.has_offset()) {
            let message = format!(
                "`{name}` has an `offset`, so two halves of it are not the current of the whole"
            );
            let help = "let the module begin at 0 mA, and the program compute what it drives";
            refuse("U0260", message, span, help.to_owned());
        } else {
            places.push(PointPlace::of(output));
        }
    }
    places.sort_by_key(|place| place.bit);
    // A device is written for as long as one exchange takes, and for some periods before.
    let delay = device.map_or(0, |device| {
        let exchange = device.timeout.as_nanos().div_ceil(period.as_nanos().max(1));
        OUTPUTS_LAST.saturating_add(u32::try_from(exchange).unwrap_or(u32::MAX))
    });
    SharedOutputs { places, delay }
}

/// All inputs of the program, with their tolerances.
fn paired_inputs(
    section: &TwinSection,
    member: &Member,
    diagnostics: &mut Vec<Diagnostic>,
) -> Vec<PairedInput> {
    let Some((_, interface)) = &member.code else {
        return Vec::new();
    };
    let inputs = &interface.inputs;
    let places: Vec<PointPlace> = inputs.iter().map(PointPlace::of).collect();
    let mut paired = PairedInput::exact(&places);
    for (name, value) in section.tolerance.iter().take(MAXIMUM_MISFITS) {
        let Some(at) = inputs.iter().position(|input| input.name == name.value) else {
            let message = format!("`{}` has no input `{}`", member.name, name.value);
            let found = Diagnostic::error("U0209", message, name.span.clone());
            diagnostics.push(found.with_help(suggestion(&name.value, inputs.names())));
            continue;
        };
        let of = places[at].of;
        let tolerance = match value {
            Constant::Whole(number) => *number as f64,
            Constant::Number(number) => *number,
            _ => f64::NAN,
        };
        if !(of.is_integer() || of.is_real()) {
            let message = format!("`{}` is {of}: only a number has a tolerance", name.value);
            diagnostics.push(Diagnostic::error("U0204", message, name.span.clone()));
        } else if !(tolerance >= 0.0 && tolerance.is_finite()) {
            let message = format!(
                "the tolerance of `{}` is not 0 or more: write units of the input, such as 0.5",
                name.value
            );
            diagnostics.push(Diagnostic::error("U0204", message, name.span.clone()));
        } else {
            paired[at].tolerance = tolerance;
        }
    }
    paired
}

/// Warns of simulated plants that fall safe while a twin takes over.
pub(crate) fn check_watchdogs(
    remote_ios: &[RemoteIo],
    plants: &[Option<PlantPlace>],
    cluster: &Range<usize>,
    diagnostics: &mut Vec<Diagnostic>,
) {
    for (remote_io, plant) in remote_ios.iter().zip(plants) {
        let (Some(twin), Some(plant)) = (&remote_io.twin, plant) else {
            continue;
        };
        let needed = twin.take_over_after + SWITCHOVER + 1;
        if plant.watchdog_cycles < needed {
            let message = format!(
                "the watchdog of `{}` runs out after {} cycles, before `{}` has taken over",
                plant.name, plant.watchdog_cycles, twin.name
            );
            diagnostics.push(
                Diagnostic::warning("U0258", message, cluster.clone())
                    .with_help(format!("add `watchdog_cycles = {needed}` to its [[plant]]")),
            );
        }
    }
}
