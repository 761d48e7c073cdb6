//! Whether two networks, and the direct link to the other remote I/O, are apart: interfaces, subnets, cards and switches of their own.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::net::IpAddr;
use std::path::Path;
use std::process::Command;

use nix::ifaddrs::getifaddrs;
use understudy_wire::Via;

use super::{Finding, Health};
use crate::endpoints::Endpoints;

/// An interface of this machine, as far as two networks need it.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
struct Interface {
    name: String,
    /// First address of its subnet; nothing where the system does not tell.
    subnet: Option<IpAddr>,
    mtu: Option<u32>,
    is_down: bool,
    /// The cards below it, and it itself where there are none.
    cards: BTreeSet<String>,
    /// The switch that it is connected to, where LLDP tells.
    switch: Option<String>,
}

/// Whether the paths of a member fail apart, each two of them; nothing for a member on one network.
pub fn examine_networks(endpoints: &Endpoints) -> Vec<Finding> {
    let paths: Vec<(Via, IpAddr)> =
        endpoints.own().paths().map(|(via, address)| (via, address.ip())).collect();
    if paths.len() > 1 && paths.iter().all(|(_, host)| host.is_loopback()) {
        let names: Vec<String> = paths.iter().map(|(via, _)| via.to_string()).collect();
        return vec![Finding::trouble(
            "networks",
            Health::Warning,
            format!("{} are the loopback interface of this machine", names.join(" and ")),
            "for a plant, an address of an interface of its own for each",
        )];
    }
    let switches = switches();
    // What is lacking is said of the ports.
    let there = |(via, host)| Some((via, interface(host, &switches)?));
    examine(&paths.into_iter().filter_map(there).collect::<Vec<(Via, Interface)>>())
}

fn examine(found: &[(Via, Interface)]) -> Vec<Finding> {
    let down = found.iter().filter(|(_, interface)| interface.is_down).map(|(via, interface)| {
        let found = format!("{via} is down at {}", interface.name);
        let remedy =
            if *via == Via::Link { "check the cable" } else { "check the cable and the switch" };
        Finding::trouble("networks", Health::Bad, found, remedy)
    });
    let rest = |place: usize| found.get(place + 1..).into_iter().flatten();
    let pairs =
        found.iter().enumerate().flat_map(|(place, one)| rest(place).map(move |it| (one, it)));
    down.chain(pairs.flat_map(|(first, second)| compare(first, second))).collect()
}

fn compare((one, first): &(Via, Interface), (other, second): &(Via, Interface)) -> Vec<Finding> {
    let mut findings = Vec::new();
    let mut bad = |found: String, remedy: &str| {
        findings.push(Finding::trouble("networks", Health::Bad, found, remedy));
    };
    let is_link = *other == Via::Link;
    let shared = first.cards.intersection(&second.cards).next();
    if first.name == second.name {
        let found =
            format!("{one} and {other} are at {}: one card or cable takes both away", first.name);
        bad(found, "give each an interface of its own");
    } else if let Some(card) = shared {
        let found = format!(
            "{} and {} are on one card, {card}: it takes {one} and {other} away",
            first.name, second.name
        );
        bad(found, "give each a card of its own");
    }
    if let Some(subnet) = first.subnet.filter(|_| first.subnet == second.subnet) {
        let found = format!(
            "{one} and {other} are in the subnet of {subnet}: all frames leave over one interface"
        );
        bad(found, "give each a subnet of its own");
    }
    if let Some(switch) = first.switch.as_ref().filter(|_| first.switch == second.switch) {
        let found =
            format!("{} and {} are connected to one switch, {switch}", first.name, second.name);
        let remedy = match is_link {
            true => "join the two remote I/Os by a cable, without a switch",
            false => "give each network a switch of its own, with a power supply of its own",
        };
        bad(found, remedy);
    }
    if first.mtu != second.mtu
        && let (Some(one), Some(other)) = (first.mtu, second.mtu)
    {
        findings.push(Finding::trouble(
            "networks",
            Health::Warning,
            format!(
                "frames of up to {one} bytes pass {}, and of up to {other} bytes {}",
                first.name, second.name
            ),
            "the same MTU on both",
        ));
    }
    if !findings.is_empty() {
        return findings;
    }
    let of = |interface: &Interface| match &interface.switch {
        Some(switch) => format!("{} at switch {switch}", interface.name),
        None => interface.name.clone(),
    };
    let found = format!("{one} is {}, {other} is {}", of(first), of(second));
    vec![match (&first.switch, &second.switch) {
        (Some(_), Some(_)) => Finding::good("networks", found),
        // A cable has no switch.
        _ if is_link => Finding::good("networks", found),
        _ => Finding::trouble(
            "networks",
            Health::Warning,
            format!("{found}; whether each has a switch of its own is not known"),
            "install `lldpd` and enable LLDP on the switches, or follow the cables",
        ),
    }]
}

/// The interface with an address; nothing where this machine has none.
fn interface(address: IpAddr, switches: &BTreeMap<String, String>) -> Option<Interface> {
    let of = |storage: Option<nix::sys::socket::SockaddrStorage>| -> Option<IpAddr> {
        let storage = storage?;
        let four = storage.as_sockaddr_in().map(|four| IpAddr::V4(four.ip()));
        four.or_else(|| storage.as_sockaddr_in6().map(|six| IpAddr::V6(six.ip())))
    };
    let mut all = getifaddrs().ok()?;
    let found = all.find(|one| of(one.address) == Some(address))?;
    let name = found.interface_name;
    let folder = Path::new("/sys/class/net").join(&name);
    let read = |file: &str| fs::read_to_string(folder.join(file)).ok();
    Some(Interface {
        subnet: of(found.netmask).and_then(|mask| first_of(address, mask)),
        mtu: read("mtu").and_then(|mtu| mtu.trim().parse().ok()),
        is_down: read("operstate").is_some_and(|state| state.trim() == "down"),
        cards: cards(&folder, &name),
        switch: switches.get(&name).cloned(),
        name,
    })
}

/// The first address of the subnet of an address.
fn first_of(address: IpAddr, mask: IpAddr) -> Option<IpAddr> {
    Some(match (address, mask) {
        (IpAddr::V4(address), IpAddr::V4(mask)) => (address & mask).into(),
        (IpAddr::V6(address), IpAddr::V6(mask)) => (address & mask).into(),
        _ => return None,
    })
}

/// The cards below an interface: of a VLAN, a bridge or a bond those that carry it.
fn cards(folder: &Path, name: &str) -> BTreeSet<String> {
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
    let names = entries.map(|entry| entry.file_name().to_string_lossy().into_owned());
    let below = names.filter_map(|entry| entry.strip_prefix("lower_").map(str::to_owned));
    let below: BTreeSet<String> = below.collect();
    if below.is_empty() {
        return BTreeSet::from([name.to_owned()]);
    }
    below.iter().flat_map(|card| cards(&folder.with_file_name(card), card)).collect()
}

/// The switch at each interface, where `lldpd` runs.
fn switches() -> BTreeMap<String, String> {
    let output = Command::new("lldpctl").args(["-f", "keyvalue"]).output();
    let text = output.map(|output| String::from_utf8_lossy(&output.stdout).into_owned());
    switches_of(&text.unwrap_or_default())
}

/// From lines such as `lldp.eth0.chassis.mac=00:11:22:33:44:55`; the name of a switch counts where it has one.
fn switches_of(text: &str) -> BTreeMap<String, String> {
    let mut found = BTreeMap::new();
    for key in [".chassis.mac", ".chassis.name"] {
        for (path, value) in text.lines().filter_map(|line| line.split_once('=')) {
            let interface = path.strip_prefix("lldp.").and_then(|path| path.strip_suffix(key));
            if let Some(interface) = interface {
                found.insert(interface.to_owned(), value.to_owned());
            }
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(name: &str, third: u8, switch: Option<&str>) -> Interface {
        Interface {
            name: name.to_owned(),
            subnet: Some([10, 0, third, 0].into()),
            mtu: Some(1500),
            is_down: false,
            cards: BTreeSet::from([name.to_owned()]),
            switch: switch.map(str::to_owned),
        }
    }

    fn check(first: &Interface, second: &Interface, expected: &[(Health, &str)]) {
        check_all(&[(Via::First, first), (Via::Second, second)], expected);
    }

    fn check_all(paths: &[(Via, &Interface)], expected: &[(Health, &str)]) {
        let of = |(via, interface): &(Via, &Interface)| (*via, (*interface).clone());
        let found = examine(&paths.iter().map(of).collect::<Vec<_>>());
        let found = found.iter().map(|finding| (finding.health, finding.found.as_str()));
        assert_eq!(found.collect::<Vec<_>>(), expected);
    }

    #[test]
    fn what_two_networks_share_is_found() {
        let (first, second) = (at("eth0", 1, Some("north")), at("eth1", 2, Some("south")));
        let good = "network 1 is eth0 at switch north, network 2 is eth1 at switch south";
        check(&first, &second, &[(Health::Good, good)]);
        let unknown = "network 1 is eth0, network 2 is eth1; whether each has a switch of its own is not known";
        check(&at("eth0", 1, None), &at("eth1", 2, None), &[(Health::Warning, unknown)]);
        let one_switch = "eth0 and eth1 are connected to one switch, north";
        check(&first, &at("eth1", 2, Some("north")), &[(Health::Bad, one_switch)]);
        let same = [
            (Health::Bad, "network 1 and network 2 are at eth0: one card or cable takes both away"),
            (
                Health::Bad,
                "network 1 and network 2 are in the subnet of 10.0.1.0: all frames leave over one interface",
            ),
        ];
        check(&at("eth0", 1, None), &at("eth0", 1, None), &same);
        let card = BTreeSet::from(["eth0".to_owned()]);
        let (one, other) = (
            Interface { cards: card.clone(), ..at("eth0.1", 1, None) },
            Interface { cards: card, ..at("eth0.2", 2, None) },
        );
        let one_card =
            "eth0.1 and eth0.2 are on one card, eth0: it takes network 1 and network 2 away";
        check(&one, &other, &[(Health::Bad, one_card)]);
        let down = Interface { is_down: true, mtu: Some(9000), ..second };
        let both = [
            (Health::Bad, "network 2 is down at eth1"),
            (Health::Warning, "frames of up to 1500 bytes pass eth0, and of up to 9000 bytes eth1"),
        ];
        check(&first, &down, &both);
    }

    #[test]
    fn a_direct_link_is_no_part_of_a_network() {
        let (first, second) = (at("eth0", 1, Some("north")), at("eth1", 2, Some("south")));
        let of_both = "network 1 is eth0 at switch north, network 2 is eth1 at switch south";
        let good = [
            (Health::Good, of_both),
            (Health::Good, "network 1 is eth0 at switch north, the direct link is eth2"),
            (Health::Good, "network 2 is eth1 at switch south, the direct link is eth2"),
        ];
        let link = at("eth2", 3, None);
        check_all(&[(Via::First, &first), (Via::Second, &second), (Via::Link, &link)], &good);
        let bad = [
            (
                Health::Bad,
                "network 1 and the direct link are at eth0: one card or cable takes both away",
            ),
            (
                Health::Bad,
                "network 1 and the direct link are in the subnet of 10.0.1.0: all frames leave over one interface",
            ),
        ];
        let link = at("eth0", 1, None);
        check_all(&[(Via::First, &at("eth0", 1, None)), (Via::Link, &link)], &bad);
        let bad = "eth0 and eth2 are connected to one switch, north";
        let link = at("eth2", 3, Some("north"));
        check_all(&[(Via::First, &first), (Via::Link, &link)], &[(Health::Bad, bad)]);
    }

    #[test]
    fn lldp_names_the_switches() {
        let text = "lldp.eth0.via=LLDP\nlldp.eth0.chassis.mac=00:11:22:33:44:55\n\
                    lldp.eth1.chassis.mac=00:11:22:33:44:66\nlldp.eth1.chassis.name=south\n";
        let found = switches_of(text);
        let expected = [("eth0", "00:11:22:33:44:55"), ("eth1", "south")];
        let expected =
            expected.map(|(interface, switch)| (interface.to_owned(), switch.to_owned()));
        assert_eq!(found, BTreeMap::from(expected));
    }
}
