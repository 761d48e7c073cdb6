//! The machines of a plant, on which `understudy allocate` places stations, understudies, spares and remote I/Os.

use toml::de::DeTable;
use understudy_text::Diagnostic;

use super::{Taken, declared};
use crate::file::tables;
use crate::format::MACHINE;

/// A machine of the plant.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PlantMachine {
    /// Its name.
    pub name: String,
    /// Its rack, where the plant file names racks.
    pub rack: Option<String>,
    /// The feeder of its power, where the plant file names feeders.
    pub feeder: Option<String>,
    /// The switch that it is connected to, where the plant file names switches.
    pub switch: Option<String>,
    /// Stations and spares that it executes, at most.
    pub stations: u32,
    /// Remote I/Os that it executes, at most.
    pub remote_ios: u32,
    /// Operations in a second that it executes.
    pub capacity: u32,
}

/// The keys of failure domains.
const DOMAINS: [&str; 3] = ["rack", "feeder", "switch"];

pub(super) fn machines(root: &DeTable<'_>, diagnostics: &mut Vec<Diagnostic>) -> Vec<PlantMachine> {
    let all = tables(root, &MACHINE, diagnostics).unwrap_or_default();
    // A domain that is not known must not count as one of its own.
    for domain in DOMAINS {
        let Some(named) = all.iter().find_map(|fields| fields.place_of(domain)) else {
            continue;
        };
        for fields in all.iter().filter(|fields| !fields.has(domain)) {
            let message = format!("a machine has no `{domain}`, and another one has");
            let help = format!("add `{domain} = …`, or remove it from all machines");
            let diagnostic = Diagnostic::error("U0235", message, fields.span.clone());
            let diagnostic = diagnostic.with_related(named.clone(), "it is named here");
            diagnostics.push(diagnostic.with_help(help));
        }
    }
    let mut taken = Taken::new();
    let mut machines = Vec::new();
    for fields in all {
        let Some(name) = declared(&fields, "machine", &mut taken, diagnostics) else {
            continue;
        };
        let mut text = |key| fields.text(key, diagnostics).map(|text| text.value);
        let [rack, feeder, switch] = DOMAINS.map(&mut text);
        machines.push(PlantMachine {
            name,
            rack,
            feeder,
            switch,
            stations: fields.count("stations", diagnostics),
            remote_ios: fields.count("remote_ios", diagnostics),
            capacity: fields.count("capacity", diagnostics),
        });
    }
    machines
}
