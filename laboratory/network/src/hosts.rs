//! Hosts without machines: one network namespace for each, joined by a bridge in a namespace of its own.
//!
//! ```text
//!   host 0            switch             host 1
//!   eth0 10.87.0.2 ── h0 ┐ bridge ┌ h1 ── eth0 10.87.0.3
//!                        └ 10.87.0.1
//! ```
//!
//! With two networks each host has an `eth1` at 10.88.0.0/16 too, on a bridge of its own. Hosts with a direct link have an `eth2` at 10.89.0.0/16, on a
//! bridge of their own, which no cut and no loss between hosts concerns.
//!
//! Invariant: nothing is left behind, however the run ends. The namespaces have no names: this process holds them by file
//! descriptors, the processes in them by being there, and when the last of those is gone the kernel removes the namespace with its
//! interfaces and rules. The machine's own network is never touched.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write;
use std::fs::File;
use std::io;
use std::net::Ipv4Addr;
use std::os::fd::{AsRawFd, OwnedFd};
use std::path::PathBuf;

use nix::errno::Errno;
use nix::sched::{CloneFlags, setns, unshare};
use understudy_wire::Via;

use crate::error::NetworkError;
use crate::impairment::Share;
use crate::tools::{IP, NFT, run};

/// Hosts of one network, at most.
const MAXIMUM_HOSTS: usize = 250;
/// The first two bytes of every address, by path.
const NETWORKS: [[u8; 2]; Via::ALL.len()] = [[10, 87], [10, 88], [10, 89]];
/// The first letter of the switch's ports, by path.
const PORTS: [char; Via::ALL.len()] = ['h', 's', 'l'];
/// A share is written as so many of this.
const PARTS: u64 = 1_000_000;

/// One host.
#[derive(Debug)]
pub struct Host {
    name: String,
    place: u8,
    namespace: OwnedFd,
}

impl Host {
    /// What it was called by whoever asked for it.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Its address on a path.
    pub fn address(&self, via: Via) -> Ipv4Addr {
        let [first, second] = NETWORKS[via.index()];
        Ipv4Addr::new(first, second, 0, self.place + 2)
    }
}

/// Hosts and what joins them.
#[derive(Debug)]
pub struct Hosts {
    own: OwnedFd,
    switch: OwnedFd,
    hosts: Vec<Host>,
    /// Whether there is a second network.
    has_two_networks: bool,
    nft: PathBuf,
    /// What is to fail, and what does since the last [`Self::apply`].
    failures: Failures,
    applied: Option<Failures>,
}

/// What does not pass between hosts.
#[derive(Debug, Clone, Default, PartialEq)]
struct Failures {
    /// From where to where nothing passes.
    cuts: BTreeSet<(usize, usize)>,
    /// Of what passes from one host to another, by chance.
    losses: BTreeMap<(usize, usize), Share>,
    /// Hosts whose cable to a network is pulled, or whose direct link.
    unplugged: BTreeSet<(Via, usize)>,
}

/// The programs that [`Hosts`] needs and this machine does not have, with the packages that have them.
pub fn missing_tools() -> Vec<NetworkError> {
    [IP, NFT].into_iter().filter_map(|tool| tool.find().err()).collect()
}

impl Hosts {
    /// Where the switch itself has an address on a path, for a proxy between the hosts.
    pub fn switch(via: Via) -> Ipv4Addr {
        let [first, second] = NETWORKS[via.index()];
        Ipv4Addr::new(first, second, 0, 1)
    }

    /// Makes one host for each name, on one network or on two; those at the places in `linked` have direct links.
    ///
    /// To be called where the calling thread may change its network namespace: it is the one that it was again afterwards.
    ///
    /// # Errors
    /// [`NetworkError::NotPermitted`], [`NetworkError::NoTool`], or what a tool said. Nothing is left then.
    pub fn build(
        names: &[String],
        has_two_networks: bool,
        linked: &BTreeSet<usize>,
    ) -> Result<Self, NetworkError> {
        let (ip, nft) = (IP.find()?, NFT.find()?);
        if names.len() > MAXIMUM_HOSTS {
            return Err(NetworkError::System {
                what: "so many hosts",
                source: io::ErrorKind::InvalidInput.into(),
            });
        }
        let own = current_namespace()?;
        let switch = new_namespace(&own)?;
        let hosts = names.iter().enumerate().map(|(place, name)| {
            Ok(Host { name: name.clone(), place: place as u8, namespace: new_namespace(&own)? })
        });
        let mut hosts = Self {
            hosts: hosts.collect::<Result<_, NetworkError>>()?,
            own,
            switch,
            nft,
            failures: Failures::default(),
            applied: None,
            has_two_networks,
        };
        let is_on = |place: usize, via: Via| match via {
            Via::First => true,
            Via::Second => has_two_networks,
            Via::Link => linked.contains(&place),
        };
        let process = std::process::id();
        let mut bridge = String::from("link set lo up\n");
        for via in Via::ALL {
            let number = via.index();
            let (switch, letter) = (Self::switch(via), PORTS[number]);
            let on: Vec<usize> = (0..names.len()).filter(|place| is_on(*place, via)).collect();
            if on.is_empty() {
                continue;
            }
            let _ = write!(
                bridge,
                "link add br{number} type bridge\naddr add {switch}/16 dev br{number}\nlink set br{number} up\n"
            );
            for place in on {
                let namespace = hosts.hosts[place].namespace.as_raw_fd();
                let _ = write!(
                    bridge,
                    "link add {letter}{place} type veth peer name eth{number} netns /proc/{process}/fd/{namespace}\n\
                     link set {letter}{place} master br{number}\nlink set {letter}{place} up\n"
                );
            }
        }
        hosts.in_switch(|| run(&ip, &["-batch", "-"], &bridge))??;
        for (place, host) in hosts.hosts.iter().enumerate() {
            let mut lines = String::from("link set lo up\n");
            for via in Via::ALL.into_iter().filter(|via| is_on(place, *via)) {
                let (number, address) = (via.index(), host.address(via));
                let _ = write!(
                    lines,
                    "addr add {address}/16 dev eth{number}\nlink set eth{number} up\n"
                );
            }
            hosts.within(place, || run(&ip, &["-batch", "-"], &lines))??;
        }
        hosts.apply()?;
        Ok(hosts)
    }

    /// The hosts, in the order of their names.
    pub fn hosts(&self) -> &[Host] {
        &self.hosts
    }

    /// Does something on a host: sockets that it opens, threads and processes that it starts belong to that host.
    ///
    /// # Errors
    /// [`NetworkError::System`] where the thread cannot go there or come back.
    ///
    /// # Panics
    /// Where there is no such host.
    pub fn within<T>(&self, host: usize, work: impl FnOnce() -> T) -> Result<T, NetworkError> {
        visit(&self.hosts[host].namespace, &self.own, work)
    }

    /// As [`Self::within`], on the switch between the hosts.
    ///
    /// # Errors
    /// As there.
    pub fn in_switch<T>(&self, work: impl FnOnce() -> T) -> Result<T, NetworkError> {
        visit(&self.switch, &self.own, work)
    }

    /// Lets nothing more through the networks from one host to another, or everything again, when it is applied.
    pub fn cut(&mut self, pair: (usize, usize), cut: bool) {
        set(&mut self.failures.cuts, pair, cut);
    }

    /// Pulls the cable between a host and one network, or its direct link, or plugs it in again, when it is applied.
    pub fn unplug(&mut self, host: usize, via: Via, is_unplugged: bool) {
        set(&mut self.failures.unplugged, (via, host), is_unplugged);
    }

    /// Loses a share of what passes through the networks from one host to another, by chance, when it is applied.
    pub fn lose(&mut self, pairs: &[(usize, usize)], share: Share) {
        self.failures.losses.extend(pairs.iter().map(|pair| (*pair, share)));
        self.failures.losses.retain(|_, share| !share.is_never());
    }

    /// Applies all of that at one time, since `nft` takes a file as a whole or not at all.
    ///
    /// # Errors
    /// What `nft` said; everything passes as before then.
    pub fn apply(&mut self) -> Result<(), NetworkError> {
        if self.applied.as_ref() == Some(&self.failures) {
            return Ok(());
        }
        let networks = if self.has_two_networks { &Via::NETWORKS[..] } else { &[Via::First] };
        let rules = self.failures.rules(networks);
        let done = self.in_switch(|| run(&self.nft, &["-f", "-"], &rules)).flatten();
        match done {
            Ok(()) => self.applied = Some(self.failures.clone()),
            Err(_) => self.failures = self.applied.clone().unwrap_or_default(),
        }
        done
    }
}

fn set<T: Ord>(all: &mut BTreeSet<T>, one: T, is_in: bool) {
    if is_in {
        all.insert(one);
    } else {
        all.remove(&one);
    }
}

impl Failures {
    /// What `nft` reads. Only packets of IP are touched, so that hosts still find each other.
    fn rules(&self, networks: &[Via]) -> String {
        let mut text = String::from(
            "add table bridge links\n\
             add chain bridge links pass { type filter hook forward priority 0; policy accept; }\n\
             flush chain bridge links pass\n",
        );
        let mut rule = |(from, to): &(usize, usize), what: &str| {
            for via in networks {
                let port = PORTS[via.index()];
                let _ = writeln!(
                    text,
                    "add rule bridge links pass iifname \"{port}{from}\" oifname \"{port}{to}\" ether type ip {what}"
                );
            }
        };
        for pair in &self.cuts {
            rule(pair, "drop");
        }
        for (pair, share) in &self.losses {
            let parts = (share.get() * PARTS as f64).round() as u64;
            rule(pair, &format!("numgen random mod {PARTS} < {parts} drop"));
        }
        for (via, host) in &self.unplugged {
            let port = PORTS[via.index()];
            for side in ["iifname", "oifname"] {
                let _ = writeln!(
                    text,
                    "add rule bridge links pass {side} \"{port}{host}\" ether type ip drop"
                );
            }
        }
        text
    }
}

fn current_namespace() -> Result<OwnedFd, NetworkError> {
    let file = File::open("/proc/thread-self/ns/net");
    Ok(file.map_err(NetworkError::system("this thread's own network namespace"))?.into())
}

/// A new one; the thread is back in `own` afterwards.
fn new_namespace(own: &OwnedFd) -> Result<OwnedFd, NetworkError> {
    unshare(CloneFlags::CLONE_NEWNET).map_err(|error| match error {
        Errno::EPERM => NetworkError::NotPermitted { source: error.into() },
        _ => NetworkError::system("a network namespace")(error),
    })?;
    let made = current_namespace();
    come_back(own)?;
    made
}

fn visit<T>(there: &OwnedFd, own: &OwnedFd, work: impl FnOnce() -> T) -> Result<T, NetworkError> {
    setns(there, CloneFlags::CLONE_NEWNET)
        .map_err(NetworkError::system("to enter a network namespace"))?;
    let done = work();
    come_back(own)?;
    Ok(done)
}

fn come_back(own: &OwnedFd) -> Result<(), NetworkError> {
    setns(own, CloneFlags::CLONE_NEWNET)
        .map_err(NetworkError::system("to come back from a network namespace"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rules_name_pairs_and_shares() {
        let share = Share::new(0.1).expect("a share");
        let failures = Failures {
            cuts: BTreeSet::from([(0, 1)]),
            losses: BTreeMap::from([((2, 0), share)]),
            unplugged: BTreeSet::from([(Via::Second, 3)]),
        };
        let text = failures.rules(&[Via::First]);
        let rules: Vec<&str> = text.lines().skip(3).collect();
        assert_eq!(
            rules,
            [
                "add rule bridge links pass iifname \"h0\" oifname \"h1\" ether type ip drop",
                "add rule bridge links pass iifname \"h2\" oifname \"h0\" ether type ip numgen random mod 1000000 < 100000 drop",
                "add rule bridge links pass iifname \"s3\" ether type ip drop",
                "add rule bridge links pass oifname \"s3\" ether type ip drop",
            ]
        );
    }
}
