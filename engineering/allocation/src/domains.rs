//! Placement of stations, understudies, spares and remote I/Os on the machines of a plant, by failure domain.
//!
//! ```text
//!   roles of line-1:  robot      press      understudy   spare-1 ─┐
//!   machines:         ipc-1      ipc-2      ipc-3        ipc-4    ├─ a spare is a role of each of its groups
//!   racks:            rack-1     rack-2     rack-3       rack-4  ─┘
//! ```
//!
//! Invariant: in a placement without conflicts no machine, rack, feeder or switch has two roles of one group, so its failure takes one of them
//! at most, which the understudy masks. A domain that no machine names does not count. A remote I/O and its twin are a group too.

use std::collections::{BTreeMap, BTreeSet};

use serde::Serialize;

/// What fails at once.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Domain {
    /// The machine itself.
    Machine,
    /// Its rack.
    Rack,
    /// The feeder of its power.
    Feeder,
    /// The switch that it is connected to.
    Switch,
}

impl Domain {
    /// Every kind, the smallest first.
    pub const ALL: [Self; 4] = [Self::Machine, Self::Rack, Self::Feeder, Self::Switch];

    /// The kind in a sentence.
    pub fn word(self) -> &'static str {
        match self {
            Self::Machine => "machine",
            Self::Rack => "rack",
            Self::Feeder => "feeder",
            Self::Switch => "switch",
        }
    }
}

/// A machine of the plant.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Machine {
    /// Its name.
    pub name: String,
    /// Its rack, feeder and switch, where the plant names them.
    pub domains: BTreeMap<Domain, String>,
    /// Stations and spares that it executes, at most.
    pub roles: u32,
    /// Remote I/Os that it executes, at most.
    pub remote_ios: u32,
    /// Operations in a second that it executes.
    pub capacity: u64,
}

impl Machine {
    /// Its domain of a kind.
    pub fn domain(&self, kind: Domain) -> Option<&str> {
        match kind {
            Domain::Machine => Some(&self.name),
            _ => self.domains.get(&kind).map(String::as_str),
        }
    }
}

/// What is placed on one machine: a station or an understudy of a group, a spare, or a remote I/O.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PlantRole {
    /// Its name.
    pub name: String,
    /// The groups that lose it with its machine, ascending: several for a spare. No domain should take two roles of one group.
    pub groups: Vec<usize>,
    /// Operations in a second that it needs.
    pub load: u64,
    /// Whether it is a remote I/O, which is at the plant.
    pub is_remote_io: bool,
}

/// Roles of one group in one domain.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Conflict {
    /// The group.
    pub group: usize,
    /// Kind of the domain.
    pub kind: Domain,
    /// The domain.
    pub domain: String,
    /// Indices of the roles; two at least.
    pub roles: Vec<usize>,
}

/// A placement.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Distribution {
    /// By role: its machine; nothing where no machine has room for it.
    pub machines: Vec<Option<usize>>,
    /// Domains with two or more roles of one group; none in a placement that keeps them apart.
    pub conflicts: Vec<Conflict>,
    /// Domains of which there are fewer than a group has roles: with these machines no placement keeps its roles apart.
    pub shortages: Vec<Shortage>,
}

/// A kind of domain of which there are fewer than a group has roles.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Shortage {
    /// The group.
    pub group: usize,
    /// Kind of the domain.
    pub kind: Domain,
    /// Roles of the group, with its spares.
    pub roles: usize,
    /// Domains of this kind.
    pub domains: usize,
}

impl Distribution {
    /// Whether every role has a machine, and no domain has two roles of one group.
    pub fn is_apart(&self) -> bool {
        self.conflicts.is_empty() && self.machines.iter().all(Option::is_some)
    }
}

/// Places roles on machines. `effort` bounds the number of trials; where none of them keeps all roles apart, the answer has few conflicts and names
/// them all.
pub fn distribute(machines: &[Machine], roles: &[PlantRole], effort: u64) -> Distribution {
    let plant = Plant::new(machines, roles);
    let shortages = plant.shortages();
    let mut order: Vec<usize> = (0..roles.len()).collect();
    // A spare is apart from the roles of all of its groups, so it is placed first.
    order.sort_by_key(|&role| (std::cmp::Reverse(roles[role].groups.len()), role));
    let mut search = Search { plant: &plant, used: Used::new(&plant), effort, order: &order };
    let exact = if shortages.is_empty() && search.place(0) { Some(search.used.at) } else { None };
    let at = exact.unwrap_or_else(|| plant.with_few_conflicts(&order));
    Distribution { conflicts: plant.conflicts(&at), machines: at, shortages }
}

/// Machines and roles, with the domains by number.
struct Plant<'a> {
    machines: &'a [Machine],
    roles: &'a [PlantRole],
    /// By machine: its domains by number, one for each kind that the plant has.
    domains: Vec<Vec<(Domain, usize)>>,
    names: Vec<String>,
    /// By domain: its machines.
    sizes: Vec<u32>,
    groups: usize,
}

impl<'a> Plant<'a> {
    fn new(machines: &'a [Machine], roles: &'a [PlantRole]) -> Self {
        let mut numbers: BTreeMap<(Domain, &str), usize> = BTreeMap::new();
        let mut names = Vec::new();
        let domains = machines.iter().map(|machine| {
            let kinds = Domain::ALL.into_iter();
            let named = kinds.filter_map(|kind| Some((kind, machine.domain(kind)?)));
            named
                .map(|(kind, domain)| {
                    let number = *numbers.entry((kind, domain)).or_insert_with(|| {
                        names.push(domain.to_owned());
                        names.len() - 1
                    });
                    (kind, number)
                })
                .collect()
        });
        let domains: Vec<Vec<(Domain, usize)>> = domains.collect();
        let mut sizes = vec![0; names.len()];
        domains.iter().flatten().for_each(|(_, domain)| sizes[*domain] += 1);
        let groups = roles.iter().flat_map(|role| role.groups.iter().max()).max();
        Self { machines, roles, domains, names, sizes, groups: groups.map_or(0, |last| last + 1) }
    }

    fn shortages(&self) -> Vec<Shortage> {
        let mut shortages = Vec::new();
        for group in 0..self.groups {
            let roles = self.roles.iter().filter(|role| role.groups.contains(&group)).count();
            for kind in Domain::ALL {
                let of_kind = self.domains.iter().flatten().filter(|(of, _)| *of == kind);
                let domains: BTreeSet<usize> = of_kind.map(|(_, number)| *number).collect();
                if kind == Domain::Machine || !domains.is_empty() {
                    let domains = domains.len();
                    if domains < roles {
                        shortages.push(Shortage { group, kind, roles, domains });
                    }
                }
            }
        }
        shortages
    }

    /// Each role on the machine with room on which it has the fewest conflicts with those before it.
    fn with_few_conflicts(&self, order: &[usize]) -> Vec<Option<usize>> {
        let mut used = Used::new(self);
        for &role in order {
            let with_room = (0..self.machines.len()).filter(|&it| used.has_room(self, role, it));
            let fewest = with_room.min_by_key(|&machine| {
                (used.conflicts(self, role, machine), used.preference(self, role, machine))
            });
            if let Some(machine) = fewest {
                used.put(self, role, machine);
            }
        }
        used.at
    }

    fn conflicts(&self, at: &[Option<usize>]) -> Vec<Conflict> {
        let mut found: BTreeMap<(usize, Domain, usize), Vec<usize>> = BTreeMap::new();
        for (role, machine) in at.iter().enumerate() {
            for &(kind, domain) in machine.iter().flat_map(|&machine| &self.domains[machine]) {
                for &group in &self.roles[role].groups {
                    found.entry((group, kind, domain)).or_default().push(role);
                }
            }
        }
        let found = found.into_iter().filter(|(_, roles)| roles.len() > 1);
        let conflict = |((group, kind, domain), roles): ((usize, Domain, usize), Vec<usize>)| {
            Conflict { group, kind, domain: self.names[domain].clone(), roles }
        };
        found.map(conflict).collect()
    }
}

/// What is placed so far.
struct Used {
    at: Vec<Option<usize>>,
    /// By machine: what it still takes.
    room: Vec<Room>,
    /// By group and domain: its roles there.
    taken: Vec<Vec<u32>>,
    /// By domain: all roles there.
    crowd: Vec<u32>,
}

/// What a machine takes: stations and spares, remote I/Os, and operations in a second.
#[derive(Debug, Clone, Copy)]
struct Room {
    stations: u32,
    remote_ios: u32,
    capacity: u64,
}

impl Room {
    fn of(&mut self, role: &PlantRole) -> &mut u32 {
        if role.is_remote_io { &mut self.remote_ios } else { &mut self.stations }
    }
}

impl Used {
    fn new(plant: &Plant<'_>) -> Self {
        let room = plant.machines.iter().map(|machine| Room {
            stations: machine.roles,
            remote_ios: machine.remote_ios,
            capacity: machine.capacity,
        });
        Self {
            at: vec![None; plant.roles.len()],
            room: room.collect(),
            taken: vec![vec![0; plant.names.len()]; plant.groups],
            crowd: vec![0; plant.names.len()],
        }
    }

    fn has_room(&self, plant: &Plant<'_>, role: usize, machine: usize) -> bool {
        let (mut room, role) = (self.room[machine], &plant.roles[role]);
        *room.of(role) > 0 && room.capacity >= role.load
    }

    /// Domains of the machine that have a role of a group of this role.
    fn conflicts(&self, plant: &Plant<'_>, role: usize, machine: usize) -> usize {
        let groups = plant.roles[role].groups.iter();
        let domains = &plant.domains[machine];
        let of_group = |group: &usize| {
            domains.iter().filter(|(_, domain)| self.taken[*group][*domain] > 0).count()
        };
        groups.map(of_group).sum()
    }

    /// Among machines that are as good, the one that leaves most to others comes first. A spare keeps the stations of all its groups out of its
    /// domains, so it takes small ones; a station takes those with the fewest roles.
    fn preference(&self, plant: &Plant<'_>, role: usize, machine: usize) -> (u32, usize) {
        let of = if plant.roles[role].groups.len() > 1 { &plant.sizes } else { &self.crowd };
        (plant.domains[machine].iter().map(|(_, domain)| of[*domain]).sum(), machine)
    }

    fn put(&mut self, plant: &Plant<'_>, role: usize, machine: usize) {
        self.at[role] = Some(machine);
        *self.room[machine].of(&plant.roles[role]) -= 1;
        self.room[machine].capacity -= plant.roles[role].load;
        for (_, domain) in &plant.domains[machine] {
            self.crowd[*domain] += 1;
            for group in &plant.roles[role].groups {
                self.taken[*group][*domain] += 1;
            }
        }
    }

    fn take_back(&mut self, plant: &Plant<'_>, role: usize, machine: usize) {
        self.at[role] = None;
        *self.room[machine].of(&plant.roles[role]) += 1;
        self.room[machine].capacity += plant.roles[role].load;
        for (_, domain) in &plant.domains[machine] {
            self.crowd[*domain] -= 1;
            for group in &plant.roles[role].groups {
                self.taken[*group][*domain] -= 1;
            }
        }
    }
}

/// A search for a placement without conflicts.
struct Search<'a> {
    plant: &'a Plant<'a>,
    used: Used,
    /// Trials that are left.
    effort: u64,
    order: &'a [usize],
}

impl Search<'_> {
    /// Places the roles from a place of the order on; whether all of them are placed.
    fn place(&mut self, next: usize) -> bool {
        let Some(&role) = self.order.get(next) else {
            return true;
        };
        let plant = self.plant;
        let fits = |machine: &usize| {
            self.used.has_room(plant, role, *machine)
                && self.used.conflicts(plant, role, *machine) == 0
        };
        let mut machines: Vec<usize> = (0..plant.machines.len()).filter(fits).collect();
        machines.sort_by_key(|&machine| self.used.preference(plant, role, machine));
        for machine in machines {
            if self.effort == 0 {
                return false;
            }
            self.effort -= 1;
            self.used.put(plant, role, machine);
            if self.place(next + 1) {
                return true;
            }
            self.used.take_back(plant, role, machine);
        }
        false
    }
}
