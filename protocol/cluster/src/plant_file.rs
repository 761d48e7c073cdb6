//! The plant file: the groups of a plant and the spares that serve them.
//!
//! [`read_plant_file`] takes the text of a `plant.toml` and a function that reads the cluster files that it names. It
//! answers with a [`PlantFile`] and with everything that is wrong in it. The form is that of a cluster file, with the
//! same codes; these are its own:
//!
//! | code | what is wrong |
//! |---|---|
//! | U0231 | a cluster file that cannot be read, or that has errors |
//! | U0232 | a station that is not the slot of a spare |
//! | U0233 | a spare whose capacity fits none of its groups |
//! | U0234 | two spares in one slot |
//! | U0235 | a machine without a failure domain that other machines have |
//! | U0236 | a spare that serves no group |
//! | U0257 | warning: a group that no spare serves, that its spare cannot serve, or that it serves from the same failure domain |

mod machines;

use std::collections::BTreeMap;
use std::ops::Range;
use std::time::Duration;

use toml::de::DeTable;
use understudy_text::spelling::suggestion;
use understudy_text::tables::{parse, unknown_key};
use understudy_text::{Diagnostic, Report, has_errors};
use understudy_typed::Cost;
use understudy_wire::{Member, StationId};

use crate::cluster::Cluster;
use crate::fields::{CODES, Fields, Placed};
use crate::file::tables;
use crate::format::{GROUP, PLANT_FILE_REQUIRED, PLANT_FILE_SECTIONS, SPARE};

pub use machines::PlantMachine;

/// The groups of a plant and their spares.
#[derive(Debug, Clone)]
pub struct PlantFile {
    /// Its groups, in the order of the file.
    pub groups: Vec<PlantGroup>,
    /// Its spares, in the order of their ranks.
    pub spares: Vec<PlantSpare>,
    /// Its machines, in the order of the file; none where it names none.
    pub machines: Vec<PlantMachine>,
}

/// A group of the plant.
#[derive(Debug, Clone)]
pub struct PlantGroup {
    /// Its name.
    pub name: String,
    /// Its cluster file, as the plant file names it.
    pub file: String,
    /// Its cluster.
    pub cluster: Cluster,
    /// Its failure domain.
    pub failure_domain: Option<String>,
}

/// A machine that serves groups.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PlantSpare {
    /// Its name.
    pub name: String,
    /// The groups that it serves, in the order of the groups.
    pub serves: Vec<Serves>,
    /// Operations in a second.
    pub capacity: u32,
    /// Cycles for which a station must be flagged.
    pub spare_after: u32,
    /// Time for which a group must be complete before the spare retires.
    pub retire_after: Duration,
}

/// A slot that a spare takes.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Serves {
    /// Index of the group.
    pub group: usize,
    /// The station of the slot.
    pub station: StationId,
    /// Its name.
    pub name: String,
    /// Whether the group needs no more than the capacity of the spare.
    pub fits: bool,
}

/// A plant file, read.
#[derive(Debug)]
pub struct LoadedPlant {
    /// Nothing where the report has errors.
    pub plant: Option<PlantFile>,
    /// What was found.
    pub report: Report,
}

/// Operations in a second that a station needs which executes all programs of a group, at most.
pub fn load_of(cluster: &Cluster) -> u64 {
    load_of_programs(cluster, 0..cluster.controllers().len())
}

/// Operations in a second that a station of a group needs at most: a controller executes its own program, an understudy all of them.
pub fn station_load(cluster: &Cluster, station: StationId) -> u64 {
    let rank = station.index();
    let is_controller = rank < cluster.controllers().len();
    if is_controller { load_of_programs(cluster, rank..rank + 1) } else { load_of(cluster) }
}

fn load_of_programs(cluster: &Cluster, programs: Range<usize>) -> u64 {
    let controllers = cluster.controllers()[programs].iter();
    let operations = controllers.map(|it| Cost::new(it.code.typed()).worst_case());
    let cycle = operations.fold(0, u64::saturating_add);
    let period = cluster.agreement().schedule.period().as_nanos().max(1);
    let load = u128::from(cycle) * 1_000_000_000 / period;
    u64::try_from(load).unwrap_or(u64::MAX)
}

/// Whether a text in TOML has the sections of a plant file.
pub fn looks_like_a_plant_file(text: &str) -> bool {
    let (table, _) = DeTable::parse_recoverable(text);
    PLANT_FILE_SECTIONS.iter().any(|section| table.get_ref().contains_key(section.name))
}

/// Reads a plant file; `open` reads the cluster file of a name, or says why it cannot be used.
pub fn read_plant_file(
    name: &str,
    text: &str,
    open: &mut dyn FnMut(&str) -> Result<Cluster, String>,
) -> LoadedPlant {
    let mut diagnostics = Vec::new();
    let plant = build(text, open, &mut diagnostics);
    diagnostics.sort_by_key(|diagnostic| (diagnostic.span.start, diagnostic.span.end));
    let plant = plant.filter(|_| !has_errors(&diagnostics));
    LoadedPlant {
        plant,
        report: Report { name: name.to_owned(), text: text.to_owned(), diagnostics },
    }
}

/// A name that is given once, with its place.
type Taken = BTreeMap<String, Range<usize>>;

fn build(
    text: &str,
    open: &mut dyn FnMut(&str) -> Result<Cluster, String>,
    diagnostics: &mut Vec<Diagnostic>,
) -> Option<PlantFile> {
    let root = parse(text, &CODES, diagnostics)?;
    let root = root.get_ref();
    let known = PLANT_FILE_SECTIONS.map(|section| section.name);
    for key in root.keys() {
        if !known.contains(&key.get_ref().as_ref()) {
            diagnostics.push(unknown_key(&CODES, "a plant file", key, &known));
        }
    }
    for section in PLANT_FILE_REQUIRED {
        if !root.contains_key(section.name) {
            let message = format!("there is no [[{}]]", section.name);
            diagnostics.push(Diagnostic::error("U0203", message, 0..0).with_help(section.meaning));
        }
    }
    let mut taken = Taken::new();
    let mut groups: Vec<(String, Option<PlantGroup>)> = Vec::new();
    let mut places = Vec::new();
    for fields in tables(root, &GROUP, diagnostics).unwrap_or_default() {
        let Some(name) = declared(&fields, "group", &mut taken, diagnostics) else {
            continue;
        };
        let group = group(name.clone(), &fields, open, diagnostics);
        let cluster = |of: &PlantGroup| of.cluster.agreement().cluster;
        let first = groups.iter().position(|(_, other)| {
            other.as_ref().zip(group.as_ref()).is_some_and(|(it, own)| cluster(it) == cluster(own))
        });
        if let Some(first) = first {
            let message = format!("groups `{}` and `{name}` are one cluster", groups[first].0);
            let place: &Range<usize> = &places[first];
            let diagnostic = Diagnostic::error("U0208", message, fields.span.clone());
            diagnostics.push(diagnostic.with_related(place.clone(), "the first is here"));
        }
        places.push(fields.span.clone());
        groups.push((name, group));
    }
    let (mut taken, mut slots) = (Taken::new(), BTreeMap::new());
    let mut spares = Vec::new();
    for fields in tables(root, &SPARE, diagnostics).unwrap_or_default() {
        if let Some(name) = declared(&fields, "spare", &mut taken, diagnostics) {
            spares.push(spare(name, &fields, &groups, &mut slots, diagnostics));
        }
    }
    for (index, ((name, _), place)) in groups.iter().zip(&places).enumerate() {
        let is_named = |spare: &PlantSpare| spare.serves.iter().any(|it| it.group == index);
        if !has_errors(diagnostics) && !spares.iter().any(is_named) {
            let message = format!("no spare serves group `{name}`");
            let help = "name it in `groups` of a spare, or leave it out";
            diagnostics.push(Diagnostic::warning("U0257", message, place.clone()).with_help(help));
        }
    }
    let groups: Option<Vec<PlantGroup>> = groups.into_iter().map(|(_, group)| group).collect();
    let machines = machines::machines(root, diagnostics);
    Some(PlantFile { groups: groups?, spares, machines })
}

/// The name of a section, where it has one that is given once.
fn declared(
    fields: &Fields<'_, '_>,
    kind: &str,
    taken: &mut Taken,
    diagnostics: &mut Vec<Diagnostic>,
) -> Option<String> {
    let name = fields.name("name", diagnostics)?;
    if let Some(first) = taken.get(&name.value) {
        let message = format!("two {kind}s are named `{}`", name.value);
        let diagnostic = Diagnostic::error("U0208", message, name.span);
        diagnostics.push(diagnostic.with_related(first.clone(), "the first is here"));
        return None;
    }
    taken.insert(name.value.clone(), name.span);
    Some(name.value)
}

fn group(
    name: String,
    fields: &Fields<'_, '_>,
    open: &mut dyn FnMut(&str) -> Result<Cluster, String>,
    diagnostics: &mut Vec<Diagnostic>,
) -> Option<PlantGroup> {
    let failure_domain = fields.text("failure_domain", diagnostics).map(|domain| domain.value);
    let Placed { value: file, span } = fields.text("cluster", diagnostics)?;
    match open(&file) {
        Ok(cluster) => Some(PlantGroup { name, file, cluster, failure_domain }),
        Err(reason) => {
            let message = format!("group `{name}`: {reason}");
            let help = "`understudy check` on the cluster file reports its errors";
            diagnostics.push(Diagnostic::error("U0231", message, span).with_help(help));
            None
        }
    }
}

fn spare(
    name: String,
    fields: &Fields<'_, '_>,
    groups: &[(String, Option<PlantGroup>)],
    slots: &mut BTreeMap<(usize, StationId), Range<usize>>,
    diagnostics: &mut Vec<Diagnostic>,
) -> PlantSpare {
    let capacity = fields.count("capacity", diagnostics);
    let domain = fields.text("failure_domain", diagnostics).map(|domain| domain.value);
    let mut serves = Vec::new();
    let mut too_large = Vec::new();
    let errors = diagnostics.len();
    let named = fields.names("groups", diagnostics);
    if named.is_empty() && diagnostics.len() == errors {
        let message = format!("spare `{name}` serves no group");
        let help = "name its groups, each with the slot that it takes there, or leave it out";
        let diagnostic = Diagnostic::error("U0236", message, fields.span.clone());
        diagnostics.push(diagnostic.with_help(help));
    }
    for (group, (place, slot)) in named {
        let Some(index) = groups.iter().position(|(known, _)| *known == group) else {
            let help = suggestion(&group, groups.iter().map(|(known, _)| known.as_str()));
            let message = format!("there is no group `{group}`");
            diagnostics.push(Diagnostic::error("U0209", message, place).with_help(help));
            continue;
        };
        // What is wrong with its cluster file was said.
        let Some(found) = &groups[index].1 else {
            continue;
        };
        let Some(station) = slot_of(found, &slot, diagnostics) else {
            continue;
        };
        if let Some(first) = slots.insert((index, station), slot.span.clone()) {
            let message = format!("two spares have the slot `{}` of group `{group}`", slot.value);
            diagnostics.push(
                Diagnostic::error("U0234", message, slot.span)
                    .with_related(first, "the first is here")
                    .with_help("give the group one more `[[understudy]]` with `spare = true`"),
            );
            continue;
        }
        if domain.is_some() && domain == found.failure_domain {
            let message = format!("group `{group}` is in the failure domain of its spare");
            let help = "one failure of the domain takes a station and its spare; use a spare of another one";
            diagnostics.push(Diagnostic::warning("U0257", message, place.clone()).with_help(help));
        }
        let load = load_of(&found.cluster);
        let fits = load <= u64::from(capacity);
        if !fits {
            too_large.push((group, load, place));
        }
        serves.push(Serves { group: index, station, name: slot.value, fits });
    }
    let nothing_fits = !serves.iter().any(|served| served.fits);
    for (group, load, place) in too_large {
        let message = format!(
            "group `{group}` needs {load} operations a second, and the capacity of spare `{name}` is {capacity}"
        );
        let help = "the group stays without this spare; use a faster machine, or fewer programs in the group";
        let (make, code): (fn(_, String, _) -> Diagnostic, _) = match nothing_fits {
            true => (Diagnostic::error, "U0233"),
            false => (Diagnostic::warning, "U0257"),
        };
        diagnostics.push(make(code, message, place).with_help(help));
    }
    serves.sort_by_key(|served| served.group);
    PlantSpare {
        name,
        serves,
        capacity,
        spare_after: fields.count("spare_after", diagnostics),
        retire_after: fields.time("retire_after", diagnostics),
    }
}

/// The slot of a group by its name.
fn slot_of(
    group: &PlantGroup,
    slot: &Placed<String>,
    diagnostics: &mut Vec<Diagnostic>,
) -> Option<StationId> {
    let cluster = &group.cluster;
    let members = cluster.members();
    let known: Vec<&str> = members
        .filter(|member| cluster.is_spare_slot(*member))
        .filter_map(|member| cluster.member_name(member))
        .collect();
    match cluster.member(&slot.value) {
        Some(Member::Station(station)) if known.contains(&slot.value.as_str()) => Some(station),
        _ => {
            let message =
                format!("group `{}` has no slot of a spare named `{}`", group.name, slot.value);
            let help = if known.is_empty() {
                "add an `[[understudy]]` with `spare = true` to its cluster file".to_owned()
            } else {
                format!("its slots are {}", known.join(", "))
            };
            let diagnostic = Diagnostic::error("U0232", message, slot.span.clone());
            diagnostics.push(diagnostic.with_help(help));
            None
        }
    }
}
