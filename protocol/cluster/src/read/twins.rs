//! The second remote I/O of a program.

use std::ops::Range;
use std::time::Duration;

use understudy_text::{Diagnostic, duration};

use super::names::Names;
use crate::cluster::{PlantPlace, RemoteIo, Twin};
use crate::device::Connection;
use crate::file::{FieldSection, TwinSection};

/// Reads a twin; nothing where it has no name, which is reported.
pub(crate) fn read(
    section: TwinSection,
    field: Option<&FieldSection>,
    period: Duration,
    names: &mut Names,
    diagnostics: &mut Vec<Diagnostic>,
) -> Option<Twin> {
    names.listen(&section.addresses, diagnostics);
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
        diagnostics.push(Diagnostic::error("U0229", message, section.span).with_help(format!(
            "use `take_over_after = {needed}`, or a shorter time-out of the device"
        )));
    }
    let name = section.name?;
    names.declare(&name.value, name.span, diagnostics);
    Some(Twin {
        name: name.value,
        take_over_after: after,
        addresses: section.addresses.map(|address| address.value),
    })
}

/// Cycles of a switchover after `take_over_after`: the one in which the other remote I/O begins, and one until it may.
const TAKE_OVER: u32 = 2;

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
        let needed = twin.take_over_after + TAKE_OVER + 1;
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
