//! Where the members of a laboratory run, and what lies between them.
//!
//! | hosts | links | a cut is made by |
//! |---|---|---|
//! | this machine's loopback interface | direct | the receiver, which drops the frames |
//! | one network namespace for each station, and for each remote I/O with its plant | the bridge between them | `nft` |
//! | either | through the proxy, where the links are impaired | the receiver |
//!
//! Frames pass through the proxy, a process of its own ([`LinkProxy`]), only where the links lose, delay or change what they carry: a laboratory
//! that is suspended must not stop its plants. With the proxy each member is told of addresses at which it
//! stands for the member's peers, one for each pair and direction, and knows nothing of it.

use std::collections::{BTreeMap, BTreeSet};
use std::io;
use std::net::{IpAddr, Ipv4Addr, SocketAddr, SocketAddrV4};
use std::path::{Path, PathBuf};

use understudy_bus::{Endpoints, LinkKind, Peer};
use understudy_cluster::{Addresses, Cluster};
use understudy_journal::RunDirectory;
use understudy_network::{Hosts, Impairment, NetworkError, ProxyPlan, Route, Share, Transport};
use understudy_scenarios::Scenario;
use understudy_simulator::Network;
use understudy_wire::{Member, Via};

use crate::LaboratorySettings;
use crate::error::LaboratoryError;
use crate::proxy::LinkProxy;

/// The port of the first member of a host.
const FIRST_PORT: u16 = 7450;

/// Hosts that the members run on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum HostKind {
    /// All on this machine, on its loopback interface.
    #[default]
    Loopback,
    /// One network namespace for each station, and one for each remote I/O with its plant.
    Namespaces,
}

/// What lies between the members.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct NetworkSettings {
    /// Where they run.
    pub hosts: HostKind,
    /// What every link does in every direction; in place of the scenario's where it does anything.
    pub impairment: Impairment,
    /// Of two networks the one that does so; both where absent.
    pub impaired: Option<Via>,
    /// What the fates of datagrams come from.
    pub seed: u64,
}

/// Where everybody is.
#[derive(Debug)]
pub(super) struct Site {
    members: Vec<Member>,
    endpoints: BTreeMap<Member, PathBuf>,
    hosts: Option<Hosts>,
    host_of: BTreeMap<Member, usize>,
    proxy: Option<LinkProxy>,
    /// From whom to whom, and the place of the route in the proxy.
    routes: BTreeMap<(Member, Member, Via), usize>,
    /// The address of each route that a member is given for another member's.
    stand_ins: Vec<SocketAddr>,
    impairment: Impairment,
    /// Of two networks the one that is impaired; both where absent.
    impaired: Option<Via>,
    /// The number of paths that each member is on.
    paths: BTreeMap<Member, usize>,
    /// The first multicast group of the frames.
    multicast: Option<SocketAddrV4>,
}

impl Site {
    /// Makes what is needed, and writes down where everybody is.
    pub(super) fn prepare(
        cluster: &Cluster,
        scenario: &Scenario,
        laboratory: &LaboratorySettings,
        directory: &RunDirectory,
    ) -> Result<Self, LaboratoryError> {
        let (link, settings) = (laboratory.link, laboratory.network);
        if settings.impaired.is_some() && !cluster.has_two_networks() {
            return Err(LaboratoryError::OneNetwork);
        }
        let system = |what| move |source| LaboratoryError::System { what, source };
        let members: Vec<Member> = cluster.members().collect();
        let (impairment, impaired) = match (settings.impairment.is_none(), scenario.network) {
            (true, Some(network)) => (impairment_of(network), network.over),
            _ => (settings.impairment, settings.impaired),
        };
        let host_of = hosts_of(&members);
        let mut hosts = match settings.hosts {
            HostKind::Loopback => None,
            HostKind::Namespaces => {
                let names = host_names(cluster, &host_of);
                let linked = host_of
                    .iter()
                    .filter(|(member, _)| cluster.paths(**member).any(|via| via == Via::Link));
                let linked: BTreeSet<usize> = linked.map(|(_, host)| *host).collect();
                Some(Hosts::build(&names, cluster.has_two_networks(), &linked)?)
            }
        };
        let addresses = match &hosts {
            None => loopback_addresses(cluster)
                .map_err(system("free ports of the loopback interface"))?,
            Some(hosts) => namespace_addresses(cluster, &host_of, hosts),
        };
        let peers: Vec<Peer> = members
            .iter()
            .zip(addresses)
            .filter_map(|(&member, Addresses { first, second, link })| {
                let name = cluster.member_name(member)?.to_owned();
                Some(Peer { member, name, address: first?, second, link })
            })
            .collect();
        let list = directory.file("endpoints.json");
        write_list(&list, &peers).map_err(system("to write endpoints.json"))?;
        let mut site = Self {
            endpoints: members.iter().map(|&member| (member, list.clone())).collect(),
            paths: members.iter().map(|&it| (it, cluster.paths(it).count())).collect(),
            members,
            hosts: None,
            host_of,
            proxy: None,
            routes: BTreeMap::new(),
            stand_ins: Vec::new(),
            impairment,
            impaired,
            multicast: None,
        };
        let only_loss = impairment == Impairment { loss: impairment.loss, ..Impairment::default() };
        match &mut hosts {
            Some(hosts) if only_loss && impaired.is_none() => {
                let pairs = site.pairs_of_hosts();
                hosts.lose(&pairs, impairment.loss);
                hosts.apply()?;
            }
            None if impairment.is_none() => {
                let wanted = link == LinkKind::Udp;
                site.multicast = wanted.then(understudy_bus::loopback_groups).flatten();
            }
            _ => {
                site.route(cluster, laboratory, &peers, hosts.as_ref())?;
                site.write_views(&peers, directory)
                    .map_err(system("to write the endpoints of each member"))?;
            }
        }
        site.hosts = hosts;
        Ok(site)
    }

    /// Starts something where the member runs.
    pub(super) fn at<T>(
        &self,
        member: Member,
        work: impl FnOnce() -> T,
    ) -> Result<T, NetworkError> {
        match (&self.hosts, self.host_of.get(&member)) {
            (Some(hosts), Some(&host)) => hosts.within(host, work),
            _ => Ok(work()),
        }
    }

    /// The file in which the member finds the others.
    pub(super) fn endpoints(&self, member: Member) -> Option<&Path> {
        self.endpoints.get(&member).map(PathBuf::as_path)
    }

    /// The first multicast group of the frames. Between hosts of the laboratory and through its proxy each receiver has a datagram of its own.
    pub(super) fn multicast(&self) -> Option<SocketAddrV4> {
        self.multicast
    }

    /// Lets no frame of one member through the networks to another any more, or each again. False where nothing between them can do that, so that the
    /// receiver has to drop them.
    pub(super) fn cut(&mut self, from: Member, to: Member, cut: bool) -> bool {
        let places = (self.host_of.get(&from), self.host_of.get(&to));
        match (&mut self.hosts, &self.proxy, places) {
            (Some(hosts), None, (Some(&from), Some(&to))) if from != to => {
                hosts.cut((from, to), cut);
                true
            }
            _ => false,
        }
    }

    /// The number of paths that a member is on.
    pub(super) fn paths(&self, member: Member) -> usize {
        self.paths.get(&member).copied().unwrap_or(1)
    }

    /// Pulls the cable between a member's host and a network, or its direct link, or plugs it in again. False where the member has to do it by itself.
    pub(super) fn unplug(&mut self, member: Member, via: Via, is_unplugged: bool) -> bool {
        match (&mut self.hosts, &self.proxy, self.host_of.get(&member)) {
            (Some(hosts), None, Some(&host)) => {
                hosts.unplug(host, via, is_unplugged);
                true
            }
            _ => false,
        }
    }

    /// Applies what was cut and unplugged between hosts, at one time.
    pub(super) fn apply(&mut self) -> io::Result<()> {
        match &mut self.hosts {
            Some(hosts) => hosts.apply().map_err(io::Error::other),
            None => Ok(()),
        }
    }

    /// Ends the proxy; what a reader of the results should know.
    pub(super) fn end(mut self) -> Vec<String> {
        let mut notes = Vec::new();
        if let Some(hosts) = &self.hosts {
            let count = hosts.hosts().len();
            notes.push(format!("{count} hosts, each a network namespace of its own"));
            if self.proxy.is_none() && !self.impairment.loss.is_never() {
                notes.push(format!("nft loses {} on every link", self.impairment.loss));
            }
        }
        if let Some(counters) = self.proxy.as_mut().and_then(LinkProxy::end) {
            notes.push(format!(
                "the links pass through the proxy: {} came, {} passed, {} were lost on purpose",
                counters.came, counters.passed, counters.lost
            ));
        }
        notes
    }

    /// One route for each pair and direction that has something to say.
    fn route(
        &mut self,
        cluster: &Cluster,
        laboratory: &LaboratorySettings,
        peers: &[Peer],
        hosts: Option<&Hosts>,
    ) -> Result<(), LaboratoryError> {
        let link = laboratory.link;
        let host = |via| hosts.map_or(Ipv4Addr::LOCALHOST, |_| Hosts::switch(via));
        let mut routes: Vec<Route> = Vec::new();
        let mut networks: Vec<Via> = Vec::new();
        let impairment = |via| {
            let is_impaired = self.impaired.map_or(via != Via::Link, |impaired| impaired == via);
            if is_impaired { self.impairment } else { Impairment::default() }
        };
        for first in peers {
            let own = Endpoints::new(
                cluster.agreement().cluster,
                first.member,
                peers.to_vec(),
                cluster.roster(),
            );
            let own = own.map_err(LaboratoryError::Endpoints)?;
            for second in peers {
                // A session goes both ways, and is opened by the later of the two.
                let opens = link == LinkKind::Udp || second.member < first.member;
                if !opens || !own.talks_with(second.member) {
                    continue;
                }
                for (via, address) in second.paths() {
                    if via == Via::Link && first.member.partner() != Some(second.member) {
                        continue;
                    }
                    self.routes.insert((first.member, second.member, via), routes.len());
                    networks.push(via);
                    routes.push(Route {
                        listen: SocketAddr::new(IpAddr::V4(host(via)), 0),
                        to: link.frames_address(address).map_err(LaboratoryError::Endpoints)?,
                        transport: match link {
                            LinkKind::Zenoh => Transport::Tcp,
                            LinkKind::Udp => Transport::Udp,
                        },
                        forth: impairment(via),
                        back: impairment(via),
                    });
                }
            }
        }
        let free = understudy_bus::free_addresses(routes.len()).map_err(|source| {
            LaboratoryError::System { what: "free ports for the proxy", source }
        })?;
        for ((route, via), free) in routes.iter_mut().zip(networks).zip(free) {
            let stands_for = SocketAddr::new(IpAddr::V4(host(via)), free.port());
            let frames = link.frames_address(stands_for);
            route.listen = frames.map_err(LaboratoryError::Endpoints)?;
            self.stand_ins.push(stands_for);
        }
        let seed = laboratory.network.seed;
        let plan = ProxyPlan { routes, seed };
        let start = || LinkProxy::start(&laboratory.program, &plan);
        let proxy = match hosts {
            Some(hosts) => hosts.in_switch(start)?,
            None => start(),
        };
        let proxy = proxy
            .map_err(|source| LaboratoryError::System { what: "the proxy of the links", source })?;
        self.proxy = Some(proxy);
        Ok(())
    }

    /// What each member is told of the others.
    fn write_views(&mut self, peers: &[Peer], directory: &RunDirectory) -> io::Result<()> {
        let folder = directory.file("endpoints");
        std::fs::create_dir_all(&folder)?;
        for own in peers {
            let view: Vec<Peer> = peers
                .iter()
                .map(|peer| {
                    let stands_for = |via| {
                        let route = self.routes.get(&(own.member, peer.member, via))?;
                        self.stand_ins.get(*route).copied()
                    };
                    Peer {
                        address: stands_for(Via::First).unwrap_or(peer.address),
                        second: stands_for(Via::Second).or(peer.second),
                        link: stands_for(Via::Link).or(peer.link),
                        ..peer.clone()
                    }
                })
                .collect();
            let path = folder.join(format!("{}.json", own.name));
            write_list(&path, &view)?;
            self.endpoints.insert(own.member, path);
        }
        Ok(())
    }

    fn pairs_of_hosts(&self) -> Vec<(usize, usize)> {
        let count = self.members.iter().filter_map(|member| self.host_of.get(member));
        let count = count.max().map_or(0, |last| last + 1);
        let pairs = (0..count).flat_map(|from| (0..count).map(move |to| (from, to)));
        pairs.filter(|(from, to)| from != to).collect()
    }
}

/// The same as the simulator's network, but that jitter keeps the order.
fn impairment_of(network: Network) -> Impairment {
    let share = |share: f64| Share::new(share.clamp(0.0, 1.0)).unwrap_or_default();
    Impairment {
        loss: share(network.loss),
        delay: network.latency + network.jitter / 2,
        jitter: network.jitter / 2,
        duplicate: share(network.duplicate),
        corrupt: share(network.corruption),
        ..Impairment::default()
    }
}

/// A station has a host of its own; a plant stands beside its remote I/O.
fn hosts_of(members: &[Member]) -> BTreeMap<Member, usize> {
    let mut host_of = BTreeMap::new();
    for &member in members {
        let beside = match member {
            Member::Plant(program) => host_of.get(&Member::RemoteIo(program)).copied(),
            Member::Station(_) | Member::RemoteIo(_) | Member::Twin(_) => None,
        };
        let next = host_of.values().max().map_or(0, |last: &usize| last + 1);
        host_of.insert(member, beside.unwrap_or(next));
    }
    host_of
}

fn host_names(cluster: &Cluster, host_of: &BTreeMap<Member, usize>) -> Vec<String> {
    let count = host_of.values().max().map_or(0, |last| last + 1);
    let first = |host| host_of.iter().find(|(_, found)| **found == host);
    (0..count)
        .filter_map(first)
        .filter_map(|(&member, _)| cluster.member_name(member))
        .map(str::to_owned)
        .collect()
}

/// From the cluster file, or free ones of the loopback interface, for each path.
fn loopback_addresses(cluster: &Cluster) -> io::Result<Vec<Addresses>> {
    let paths = |member| cluster.paths(member).map(move |via| (member, via));
    let lacking = cluster.members().flat_map(paths);
    let lacking = lacking.filter(|(member, via)| cluster.addresses(*member).at(*via).is_none());
    let mut free = understudy_bus::free_addresses(lacking.count())?.into_iter();
    let mut of = |member| {
        let known = cluster.addresses(member);
        on_paths(cluster, member, |via| known.at(via).or_else(|| free.next()))
    };
    Ok(cluster.members().map(&mut of).collect())
}

fn namespace_addresses(
    cluster: &Cluster,
    host_of: &BTreeMap<Member, usize>,
    hosts: &Hosts,
) -> Vec<Addresses> {
    let mut used: BTreeMap<usize, u16> = BTreeMap::new();
    let mut of = |member| {
        let host = *host_of.get(&member)?;
        let port = used.entry(host).or_insert(FIRST_PORT);
        *port += 1;
        let host = hosts.hosts().get(host)?;
        Some(on_paths(cluster, member, |via| Some((host.address(via), *port - 1).into())))
    };
    cluster.members().filter_map(&mut of).collect()
}

/// Addresses on the paths of a member alone.
fn on_paths(
    cluster: &Cluster,
    member: Member,
    mut address: impl FnMut(Via) -> Option<SocketAddr>,
) -> Addresses {
    let mut addresses = Addresses::default();
    for via in cluster.paths(member) {
        let place = match via {
            Via::First => &mut addresses.first,
            Via::Second => &mut addresses.second,
            Via::Link => &mut addresses.link,
        };
        *place = address(via);
    }
    addresses
}

fn write_list(path: &Path, peers: &[Peer]) -> io::Result<()> {
    let text = serde_json::to_string_pretty(peers)?;
    std::fs::write(path, text + "\n")
}

#[cfg(test)]
mod tests {
    use understudy_wire::StationId;

    use understudy_wire::ProgramId;

    use super::*;

    #[test]
    fn a_plant_stands_beside_its_remote_io() {
        let members = [
            Member::Station(StationId(0)),
            Member::Station(StationId(1)),
            Member::RemoteIo(ProgramId(0)),
            Member::RemoteIo(ProgramId(1)),
            Member::Plant(ProgramId(1)),
        ];
        let host_of = hosts_of(&members);
        let places: Vec<usize> = members.iter().map(|member| host_of[member]).collect();
        assert_eq!(places, [0, 1, 2, 3, 3]);
    }
}
