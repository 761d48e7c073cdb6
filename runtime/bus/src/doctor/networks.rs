//! Whether two networks are two: interfaces, subnets, cards and switches of their own.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::net::IpAddr;
use std::path::Path;
use std::process::Command;

use nix::ifaddrs::getifaddrs;

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

/// Whether the two networks of a member fail apart; nothing in a cluster with one network.
pub fn examine_networks(endpoints: &Endpoints) -> Vec<Finding> {
    let own = endpoints.own();
    let Some(second) = own.second else {
        return Vec::new();
    };
    if own.address.ip().is_loopback() && second.ip().is_loopback() {
        return vec![Finding::trouble(
            "networks",
            Health::Warning,
            "both networks are the loopback interface of this machine",
            "for a plant, an address of an interface of its own for each network",
        )];
    }
    let switches = switches();
    let found = [own.address.ip(), second.ip()].map(|address| interface(address, &switches));
    match found {
        [Some(first), Some(second)] => compare(&first, &second),
        // What is lacking is said of the ports.
        _ => Vec::new(),
    }
}

fn compare(first: &Interface, second: &Interface) -> Vec<Finding> {
    let mut findings = Vec::new();
    let mut bad = |found: String, remedy: &str| {
        findings.push(Finding::trouble("networks", Health::Bad, found, remedy));
    };
    for (number, interface) in [(1, first), (2, second)] {
        if interface.is_down {
            let found = format!("network {number} is down at {}", interface.name);
            bad(found, "check the cable and the switch");
        }
    }
    let shared = first.cards.intersection(&second.cards).next();
    if first.name == second.name {
        let found =
            format!("both networks are at {}: one card or cable takes both away", first.name);
        bad(found, "give each network an interface of its own");
    } else if let Some(card) = shared {
        let found = format!(
            "{} and {} are on one card, {card}: it takes both networks away",
            first.name, second.name
        );
        bad(found, "give each network a card of its own");
    }
    if let Some(subnet) = first.subnet.filter(|_| first.subnet == second.subnet) {
        let found = format!(
            "both networks are in the subnet of {subnet}: all frames leave over one interface"
        );
        bad(found, "give each network a subnet of its own");
    }
    if let Some(switch) = first.switch.as_ref().filter(|_| first.switch == second.switch) {
        let found =
            format!("{} and {} are connected to one switch, {switch}", first.name, second.name);
        bad(found, "give each network a switch of its own, with a power supply of its own");
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
            "the same MTU on both networks",
        ));
    }
    if !findings.is_empty() {
        return findings;
    }
    let of = |interface: &Interface| match &interface.switch {
        Some(switch) => format!("{} at switch {switch}", interface.name),
        None => interface.name.clone(),
    };
    let found = format!("network 1 is {}, network 2 is {}", of(first), of(second));
    vec![match (&first.switch, &second.switch) {
        (Some(_), Some(_)) => Finding::good("networks", found),
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
        let found = compare(first, second);
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
            (Health::Bad, "both networks are at eth0: one card or cable takes both away"),
            (
                Health::Bad,
                "both networks are in the subnet of 10.0.1.0: all frames leave over one interface",
            ),
        ];
        check(&at("eth0", 1, None), &at("eth0", 1, None), &same);
        let card = BTreeSet::from(["eth0".to_owned()]);
        let (one, other) = (
            Interface { cards: card.clone(), ..at("eth0.1", 1, None) },
            Interface { cards: card, ..at("eth0.2", 2, None) },
        );
        let one_card = "eth0.1 and eth0.2 are on one card, eth0: it takes both networks away";
        check(&one, &other, &[(Health::Bad, one_card)]);
        let down = Interface { is_down: true, mtu: Some(9000), ..second };
        let both = [
            (Health::Bad, "network 2 is down at eth1"),
            (Health::Warning, "frames of up to 1500 bytes pass eth0, and of up to 9000 bytes eth1"),
        ];
        check(&first, &down, &both);
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
