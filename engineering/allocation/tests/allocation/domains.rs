//! Placement by failure domain, against every placement of small plants.

use std::collections::BTreeMap;

use proptest::prelude::*;
use understudy_allocation::{Domain, Machine, PlantRole, distribute};

const EFFORT: u64 = 100_000;

fn machine(name: &str, rack: &str, feeder: &str) -> Machine {
    let domains = [(Domain::Rack, rack), (Domain::Feeder, feeder)];
    let domains = domains.into_iter().filter(|(_, name)| !name.is_empty());
    Machine {
        name: name.to_owned(),
        domains: domains.map(|(kind, name)| (kind, name.to_owned())).collect(),
        roles: 1,
        remote_ios: 0,
        capacity: 100,
    }
}

fn role(name: &str, groups: &[usize]) -> PlantRole {
    PlantRole { name: name.to_owned(), groups: groups.to_vec(), load: 10, is_remote_io: false }
}

/// Whether a placement keeps the roles of each group apart, by the definition.
fn is_apart(machines: &[Machine], roles: &[PlantRole], at: &[usize]) -> bool {
    let pairs = (0..roles.len()).flat_map(|left| (0..left).map(move |right| (left, right)));
    let shares = |(left, right): (usize, usize)| {
        let together = roles[left].groups.iter().any(|group| roles[right].groups.contains(group));
        let (left, right) = (&machines[at[left]], &machines[at[right]]);
        let same = |kind| left.domain(kind).is_some() && left.domain(kind) == right.domain(kind);
        together && Domain::ALL.into_iter().any(same)
    };
    let mut sums: BTreeMap<usize, (u32, u32, u64)> = BTreeMap::new();
    for (role, machine) in at.iter().enumerate() {
        let sum = sums.entry(*machine).or_default();
        let remote_ios = u32::from(roles[role].is_remote_io);
        *sum = (sum.0 + 1 - remote_ios, sum.1 + remote_ios, sum.2 + roles[role].load);
    }
    let holds = |(machine, (stations, remote_ios, load)): (&usize, &(u32, u32, u64))| {
        let machine = &machines[*machine];
        *stations <= machine.roles && *remote_ios <= machine.remote_ios && *load <= machine.capacity
    };
    !pairs.into_iter().any(shares) && sums.iter().all(holds)
}

/// Whether any placement keeps them apart.
fn exists(machines: &[Machine], roles: &[PlantRole], at: &mut Vec<usize>) -> bool {
    if at.len() == roles.len() {
        return is_apart(machines, roles, at);
    }
    (0..machines.len()).any(|machine| {
        at.push(machine);
        let found = exists(machines, roles, at);
        at.pop();
        found
    })
}

fn machines() -> impl Strategy<Value = Vec<Machine>> {
    let one = (0..4_u8, 0..4_u8, 1..3_u32, 0..2_u32, 1..3_u64);
    let one = one.prop_map(|(rack, feeder, roles, remote_ios, tens)| {
        let one = machine("", &format!("rack-{rack}"), &format!("feeder-{feeder}"));
        Machine { roles, remote_ios, capacity: 10 * tens, ..one }
    });
    prop::collection::vec(one, 3..6).prop_map(|mut machines| {
        for (number, machine) in machines.iter_mut().enumerate() {
            machine.name = format!("m{number}");
        }
        machines
    })
}

fn roles() -> impl Strategy<Value = Vec<PlantRole>> {
    let groups = prop::sample::select(vec![vec![0], vec![1], vec![0, 1]]);
    let one = (groups, prop::bool::weighted(0.3))
        .prop_map(|(groups, is_remote_io)| PlantRole { is_remote_io, ..role("any", &groups) });
    prop::collection::vec(one, 2..6)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(600))]

    /// Against every placement.
    #[test]
    fn no_domain_takes_two_roles_of_one_group_where_that_is_possible(machines in machines(), roles in roles()) {
        let found = distribute(&machines, &roles, EFFORT);
        prop_assert_eq!(found.is_apart(), exists(&machines, &roles, &mut Vec::new()));
        if found.is_apart() {
            let at: Vec<usize> = found.machines.iter().flatten().copied().collect();
            prop_assert!(is_apart(&machines, &roles, &at));
        }
    }
}

#[test]
fn what_cannot_be_kept_apart_is_named_with_its_group_and_its_domain() {
    let machines =
        [machine("m1", "rack-1", ""), machine("m2", "rack-1", ""), machine("m3", "rack-2", "")];
    let roles = [role("robot", &[0]), role("press", &[0]), role("understudy", &[0])];
    let found = distribute(&machines, &roles, EFFORT);
    assert!(found.machines.iter().all(Option::is_some));
    let [shortage] = &found.shortages[..] else { panic!("{found:?}") };
    let number = (shortage.group, shortage.kind, shortage.roles, shortage.domains);
    assert_eq!(number, (0, Domain::Rack, 3, 2));
    let [conflict] = &found.conflicts[..] else { panic!("{found:?}") };
    assert_eq!((conflict.group, conflict.kind, &*conflict.domain), (0, Domain::Rack, "rack-1"));
    assert_eq!(conflict.roles.len(), 2);
    let few = distribute(&machines[..2], &roles, EFFORT);
    assert_eq!(few.machines.iter().filter(|it| it.is_none()).count(), 1, "{few:?}");
}

/// 25 groups of 12 with an understudy each on machines in 14 racks, and two spares in racks of their own: a spare of all groups keeps every station out
/// of its rack.
#[test]
fn a_plant_of_many_groups_is_placed_within_the_effort() {
    let rack = |number: usize| if number < 350 { number % 14 } else { number };
    let machines: Vec<Machine> = (0..352)
        .map(|number| machine(&format!("m{number}"), &format!("rack-{}", rack(number)), ""))
        .collect();
    let mut roles: Vec<PlantRole> = (0..25)
        .flat_map(|group| (0..13).map(move |number| role(&format!("{group}/{number}"), &[group])))
        .collect();
    let all: Vec<usize> = (0..25).collect();
    roles.extend([role("spare-1", &all), role("spare-2", &all)]);
    let found = distribute(&machines, &roles, EFFORT);
    assert!(found.is_apart(), "{:?}", found.conflicts.first());
}
