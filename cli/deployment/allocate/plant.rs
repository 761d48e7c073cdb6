//! Placement of the stations, understudies, spares and remote I/Os of a plant file on its machines.

use std::fmt::Write as _;
use std::path::Path;

use serde_json::json;
use understudy_allocation::{Conflict, Distribution, Domain, Machine, PlantRole, distribute};
use understudy_cluster::{PlantFile, PlantGroup, PlantMachine, load_of, station_load};
use understudy_wire::{Member, ProgramId, StationId};

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
    let (roles, kept_apart) = roles(&plant);
    let machines: Vec<Machine> = plant.machines.iter().map(machine).collect();
    let found = distribute(&machines, &roles, EFFORT);
    let placed = Placed { plant: &plant, kept_apart: &kept_apart, roles: &roles, found: &found };
    let mut answer = Answer::done(placed.text(), placed.as_json());
    for message in placed.unplaced() {
        answer = answer.and_failure(Status::Failed, "U1147", message);
    }
    for message in placed.conflicts() {
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
        remote_ios: of.remote_ios,
        capacity: u64::from(of.capacity),
    }
}

/// Roles that no domain should take two of.
struct KeptApart {
    /// Index of their group.
    group: usize,
    /// Whose they are, as a message begins with it.
    whose: String,
    /// Nothing where they are the stations of a group.
    program: Option<ProgramId>,
}

/// Stations and understudies of each group, and spares; the slots of spares are no roles. Remote I/Os where a machine takes them: those of a program are
/// kept apart, and apart from the stations that compute it.
fn roles(plant: &PlantFile) -> (Vec<PlantRole>, Vec<KeptApart>) {
    let mut roles = Vec::new();
    let groups = plant.groups.iter().enumerate();
    let of_group = |(index, group): (usize, &PlantGroup)| KeptApart {
        group: index,
        whose: format!("group `{}`", group.name),
        program: None,
    };
    let mut kept_apart: Vec<KeptApart> = groups.map(of_group).collect();
    for (index, group) in plant.groups.iter().enumerate() {
        let cluster = &group.cluster;
        let schedule = &cluster.agreement().schedule;
        let named =
            |member| format!("{}/{}", group.name, cluster.member_name(member).unwrap_or_default());
        let ranks = (0..schedule.stations()).filter_map(|rank| u8::try_from(rank).ok());
        let stations = ranks.map(StationId).filter(|it| !schedule.spare_slots().contains(*it));
        let first = roles.len();
        roles.extend(stations.map(|station| PlantRole {
            name: named(Member::Station(station)),
            groups: vec![index],
            load: station_load(cluster, station),
            is_remote_io: false,
        }));
        let of_stations = first..roles.len();
        if !takes_remote_ios(plant) {
            continue;
        }
        for program in (0..cluster.remote_ios().len()).filter_map(|it| u8::try_from(it).ok()) {
            let program = ProgramId(program);
            let mut groups = Vec::new();
            let mut members = vec![Member::RemoteIo(program)];
            if cluster.twins().contains(program) {
                members.push(Member::Twin(program));
                let controller = cluster.controllers()[program.index()].name.as_str();
                for whose in ["the remote I/Os of", "the remote I/Os and the stations of"] {
                    groups.push(kept_apart.len());
                    let whose = format!("{whose} `{}/{controller}`", group.name);
                    kept_apart.push(KeptApart { group: index, whose, program: Some(program) });
                }
                // Its controller, and the understudies.
                let computes = |place: &usize| {
                    *place == program.index() || *place >= cluster.controllers().len()
                };
                let computing = (0..of_stations.len()).filter(computes);
                computing.for_each(|it| roles[of_stations.start + it].groups.push(groups[1]));
            }
            roles.extend(members.into_iter().map(|member| PlantRole {
                name: named(member),
                groups: groups.clone(),
                load: 0,
                is_remote_io: true,
            }));
        }
    }
    roles.extend(plant.spares.iter().map(|spare| {
        let fitting = spare.serves.iter().filter(|serves| serves.fits);
        let loads = fitting.map(|serves| load_of(&plant.groups[serves.group].cluster));
        PlantRole {
            name: spare.name.clone(),
            groups: spare.serves.iter().map(|serves| serves.group).collect(),
            load: loads.max().unwrap_or(0),
            is_remote_io: false,
        }
    }));
    (roles, kept_apart)
}

/// Whether a machine of the plant takes remote I/Os.
fn takes_remote_ios(plant: &PlantFile) -> bool {
    plant.machines.iter().any(|machine| machine.remote_ios > 0)
}

/// Roles and their machines.
struct Placed<'a> {
    plant: &'a PlantFile,
    kept_apart: &'a [KeptApart],
    roles: &'a [PlantRole],
    found: &'a Distribution,
}

impl Placed<'_> {
    fn text(&self) -> String {
        let Self { plant, roles, found, .. } = self;
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
        let has_twins = plant.groups.iter().any(|group| !group.cluster.twins().is_empty());
        if found.is_apart() {
            text.push_str("no machine, rack, feeder or switch has two roles of one group\n");
            if has_twins && takes_remote_ios(plant) {
                text.push_str("none has a twin and its remote I/O, or one of them and a station that computes their program\n");
            }
        }
        if has_twins && !takes_remote_ios(plant) {
            text.push_str(
                "remote I/Os and their twins are not placed: no [[machine]] has `remote_ios`\n",
            );
        }
        text
    }

    fn unplaced(&self) -> Vec<String> {
        let placed = self.roles.iter().zip(&self.found.machines);
        let unplaced = placed.filter(|(_, machine)| machine.is_none());
        let message = |(role, _): (&PlantRole, _)| {
            if role.is_remote_io {
                return format!(
                    "no machine has room for {}: add a machine at the plant, or raise its `remote_ios`",
                    role.name
                );
            }
            format!(
                "no machine has room for {}, which needs {} operations a second: add a machine, or raise its `stations`",
                role.name, role.load
            )
        };
        unplaced.map(message).collect()
    }

    /// Conflicts; those of a remote I/O and its twin once.
    fn of_each(&self) -> impl Iterator<Item = &Conflict> {
        let is_told = |conflict: &&Conflict| {
            !self.found.conflicts.iter().any(|other| {
                let (group, other_group) =
                    (&self.kept_apart[conflict.group], &self.kept_apart[other.group]);
                group.program.is_some()
                    && (group.group, group.program) == (other_group.group, other_group.program)
                    && other.group < conflict.group
                    && (other.kind, &other.domain, &other.roles)
                        == (conflict.kind, &conflict.domain, &conflict.roles)
            })
        };
        self.found.conflicts.iter().filter(is_told)
    }

    /// Each domain that takes two roles of a group, with the reason where that is known.
    fn conflicts(&self) -> Vec<String> {
        let messages = self.of_each().map(|conflict| {
            let apart = &self.kept_apart[conflict.group];
            let names: Vec<&str> =
                conflict.roles.iter().map(|&it| self.roles[it].name.as_str()).collect();
            let kind = conflict.kind.word();
            let domain = &conflict.domain;
            let shortages = &self.found.shortages;
            let of_kind =
                shortages.iter().find(|it| (it.group, it.kind) == (conflict.group, conflict.kind));
            let reason = match of_kind {
                Some(shortage) if apart.program.is_none() => format!(
                    "the group has {} roles with its spares, and there are {} such domains",
                    shortage.roles, shortage.domains
                ),
                Some(shortage) => format!(
                    "{} members must be apart, and there are {} such domains",
                    shortage.roles, shortage.domains
                ),
                None => "no placement was found that keeps them apart".to_owned(),
            };
            format!("{}: {} share {kind} `{domain}`: {reason}", apart.whose, names.join(" and "))
        });
        messages.collect()
    }

    fn as_json(&self) -> serde_json::Value {
        let Self { plant, kept_apart, roles, found } = self;
        let name = |group: usize| plant.groups[group].name.as_str();
        let of_group = |role: &PlantRole| -> Vec<&str> {
            // Their groups are those of programs.
            let groups = role.groups.iter().map(|it| name(kept_apart[*it].group));
            let mut groups: Vec<&str> = groups.collect();
            groups.dedup();
            groups
        };
        let placed = roles.iter().zip(&found.machines).map(|(role, at)| {
            let machine = at.map(|at| &plant.machines[at]);
            json!({
                "role": role.name,
                "groups": of_group(role),
                "load": role.load,
                "machine": machine.map(|it| &it.name),
                "rack": machine.and_then(|it| it.rack.as_ref()),
                "feeder": machine.and_then(|it| it.feeder.as_ref()),
                "switch": machine.and_then(|it| it.switch.as_ref()),
            })
        });
        let conflicts = self.of_each().map(|conflict| {
            let KeptApart { group, program, .. } = &kept_apart[conflict.group];
            let cluster = &plant.groups[*group].cluster;
            json!({
                "group": name(*group),
                "program": program.map(|it| cluster.controllers()[it.index()].name.as_str()),
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
}
