//! Placement of the stations, understudies and spares of a plant file on its machines.

use std::fmt::Write as _;
use std::path::Path;

use serde_json::json;
use understudy_allocation::{Distribution, Domain, Machine, PlantRole, distribute};
use understudy_cluster::{PlantFile, PlantMachine, load_of, station_load};
use understudy_wire::{Member, StationId};

use super::Arguments;
use crate::answer::{Answer, Status};
use crate::plants;

/// Trials of the search for a placement; a second at most.
const EFFORT: u64 = 1_000_000;

/// Places the roles of a plant.
pub(super) fn place(arguments: &Arguments, path: &Path) -> Result<Answer, Answer> {
    if arguments.programs.len() > 1 || arguments.selects_controllers() {
        let message = "a plant file is allocated alone, on its own machines: the options of `allocate` select controllers of the catalogue";
        return Err(Answer::failed(Status::BadInput, "U0600", message));
    }
    let (plant, reports) = plants::valid(path)?;
    if plant.machines.is_empty() {
        let message =
            format!("{} has no [[machine]] on which to place its stations", path.display());
        return Err(Answer::failed(Status::BadInput, "U1147", message));
    }
    let roles = roles(&plant);
    let machines: Vec<Machine> = plant.machines.iter().map(machine).collect();
    let found = distribute(&machines, &roles, EFFORT);
    let mut answer = Answer::done(text(&plant, &roles, &found), as_json(&plant, &roles, &found));
    for message in unplaced(&roles, &found) {
        answer = answer.and_failure(Status::Failed, "U1147", message);
    }
    for message in conflicts(&plant, &roles, &found) {
        answer = answer.and_failure(Status::Failed, "U1146", message);
    }
    Ok(answer.with_used(reports))
}

fn machine(of: &PlantMachine) -> Machine {
    let domains =
        [(Domain::Rack, &of.rack), (Domain::Feeder, &of.feeder), (Domain::Switch, &of.switch)];
    let domains = domains.into_iter().filter_map(|(kind, name)| Some((kind, name.clone()?)));
    Machine {
        name: of.name.clone(),
        domains: domains.collect(),
        roles: of.stations,
        capacity: u64::from(of.capacity),
    }
}

/// Stations and understudies of each group, and spares; the slots of spares are no roles.
fn roles(plant: &PlantFile) -> Vec<PlantRole> {
    let mut roles = Vec::new();
    for (index, group) in plant.groups.iter().enumerate() {
        let cluster = &group.cluster;
        let schedule = &cluster.agreement().schedule;
        let ranks = (0..schedule.stations()).filter_map(|rank| u8::try_from(rank).ok());
        let stations = ranks.map(StationId).filter(|it| !schedule.spare_slots().contains(*it));
        roles.extend(stations.map(|station| {
            let name = cluster.member_name(Member::Station(station)).unwrap_or_default();
            PlantRole {
                name: format!("{}/{name}", group.name),
                groups: vec![index],
                load: station_load(cluster, station),
            }
        }));
    }
    roles.extend(plant.spares.iter().map(|spare| {
        let fitting = spare.serves.iter().filter(|serves| serves.fits);
        let loads = fitting.map(|serves| load_of(&plant.groups[serves.group].cluster));
        PlantRole {
            name: spare.name.clone(),
            groups: spare.serves.iter().map(|serves| serves.group).collect(),
            load: loads.max().unwrap_or(0),
        }
    }));
    roles
}

fn text(plant: &PlantFile, roles: &[PlantRole], found: &Distribution) -> String {
    let width = roles.iter().map(|role| role.name.chars().count()).max().unwrap_or(0).max(4);
    let mut text = format!("{:width$}  machine\n", "role");
    for (role, at) in roles.iter().zip(&found.machines) {
        let place = at.map_or("none".to_owned(), |at| {
            let PlantMachine { name, rack, feeder, switch, .. } = &plant.machines[at];
            let domains = [("rack", rack), ("feeder", feeder), ("switch", switch)];
            let domains = domains.into_iter().filter_map(|(kind, domain)| {
                domain.as_ref().map(|domain| format!(", {kind} {domain}"))
            });
            format!("{name}{}", domains.collect::<String>())
        });
        let _ = writeln!(text, "{:width$}  {place}", role.name);
    }
    if found.is_apart() {
        text.push_str("no machine, rack, feeder or switch has two roles of one group\n");
    }
    text
}

fn unplaced(roles: &[PlantRole], found: &Distribution) -> Vec<String> {
    let placed = roles.iter().zip(&found.machines);
    let unplaced = placed.filter(|(_, machine)| machine.is_none());
    let message = |(role, _): (&PlantRole, _)| {
        format!(
            "no machine has room for {}, which needs {} operations a second: add a machine, or raise its `stations`",
            role.name, role.load
        )
    };
    unplaced.map(message).collect()
}

/// Each domain that takes two roles of a group, with the reason where that is known.
fn conflicts(plant: &PlantFile, roles: &[PlantRole], found: &Distribution) -> Vec<String> {
    let messages = found.conflicts.iter().map(|conflict| {
        let group = &plant.groups[conflict.group].name;
        let names: Vec<&str> = conflict.roles.iter().map(|&it| roles[it].name.as_str()).collect();
        let kind = conflict.kind.word();
        let domain = &conflict.domain;
        let of_kind = found
            .shortages
            .iter()
            .find(|it| (it.group, it.kind) == (conflict.group, conflict.kind));
        let reason = match of_kind {
            Some(shortage) => format!(
                "the group has {} roles with its spares, and there are {} such domains",
                shortage.roles, shortage.domains
            ),
            None => "no placement was found that keeps them apart".to_owned(),
        };
        format!("group `{group}`: {} share {kind} `{domain}`: {reason}", names.join(" and "))
    });
    messages.collect()
}

fn as_json(plant: &PlantFile, roles: &[PlantRole], found: &Distribution) -> serde_json::Value {
    let name = |group: &usize| plant.groups[*group].name.as_str();
    let placed = roles.iter().zip(&found.machines).map(|(role, at)| {
        let machine = at.map(|at| &plant.machines[at]);
        json!({
            "role": role.name,
            "groups": role.groups.iter().map(name).collect::<Vec<_>>(),
            "load": role.load,
            "machine": machine.map(|it| &it.name),
            "rack": machine.and_then(|it| it.rack.as_ref()),
            "feeder": machine.and_then(|it| it.feeder.as_ref()),
            "switch": machine.and_then(|it| it.switch.as_ref()),
        })
    });
    let conflicts = found.conflicts.iter().map(|conflict| {
        json!({
            "group": name(&conflict.group),
            "kind": conflict.kind,
            "domain": conflict.domain,
            "roles": conflict.roles.iter().map(|&it| roles[it].name.as_str()).collect::<Vec<_>>(),
        })
    });
    json!({
        "placed": placed.collect::<Vec<_>>(),
        "conflicts": conflicts.collect::<Vec<_>>(),
    })
}
