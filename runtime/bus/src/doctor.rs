//! What a machine lacks that a member is to run on, each with its remedy, and with the command that repairs it where one does.
//!
//! Nothing is changed, and no frame is sent: peers are found by listening for as long as they surely speak.

mod machine;
mod networks;
mod repair;

use std::collections::{BTreeMap, BTreeSet};
use std::net::{SocketAddr, TcpListener, UdpSocket};
use std::time::Duration;

use nix::poll::{PollFd, PollFlags, ppoll};
use nix::sys::time::TimeSpec;
use serde::Serialize;
use understudy_wire::{ConfigurationHash, Member, Via};

use crate::clock::Clock;
use crate::endpoints::Endpoints;
use crate::error::BusError;
use crate::guard::{Guard, Opened};
use crate::link::LinkKind;

pub use machine::examine_machine;
pub use networks::examine_networks;
pub use repair::{Repair, may_repair};

/// How something stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Health {
    /// As it should be.
    Good,
    /// It works, and could be better.
    Warning,
    /// The member would not start, or not do its part.
    Bad,
}

/// One thing that was looked at.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Finding {
    /// What: `clock`, `scheduler`, `memory`, `descriptors`, `processors`, `cores`, `sockets`, `ports`, `networks`, `keys`, `configuration` or `peer`.
    pub check: &'static str,
    /// How it stands.
    pub health: Health,
    /// What was found, with the numbers and names concerned.
    pub found: String,
    /// What to do about it, where something is to be done.
    pub remedy: Option<String>,
    /// The command that does it, where one can.
    pub repair: Option<Repair>,
}

impl Finding {
    /// As it should be.
    pub fn good(check: &'static str, found: impl Into<String>) -> Self {
        Self { check, health: Health::Good, found: found.into(), remedy: None, repair: None }
    }

    /// Not as it should be.
    pub fn trouble(
        check: &'static str,
        health: Health,
        found: impl Into<String>,
        remedy: impl Into<String>,
    ) -> Self {
        Self { check, health, found: found.into(), remedy: Some(remedy.into()), repair: None }
    }

    /// The same, with a command that repairs it.
    fn repaired_by(self, repair: Option<Repair>) -> Self {
        Self { repair, ..self }
    }
}

/// Whether a member can listen where it should: for its frames over `link`, and by TCP for its operators.
pub fn examine_ports(endpoints: &Endpoints, link: LinkKind) -> Vec<Finding> {
    let paths = endpoints.own().paths();
    paths.flat_map(|(via, address)| examine_ports_at(address, via, link)).collect()
}

/// Operators call on the networks only.
fn examine_ports_at(operators: SocketAddr, via: Via, link: LinkKind) -> Vec<Finding> {
    let frames = match link.frames_address(operators) {
        Ok(frames) => frames,
        Err(error) => {
            return vec![Finding::trouble(
                "ports",
                Health::Bad,
                error.to_string(),
                "another port in the cluster file, or `link = \"udp\"`",
            )];
        }
    };
    let bound = match link {
        LinkKind::Udp => ("UDP", frames, UdpSocket::bind(frames).map(drop)),
        LinkKind::Zenoh => ("TCP", frames, TcpListener::bind(frames).map(drop)),
    };
    let calls = || ("TCP", operators, TcpListener::bind(operators).map(drop));
    let bound = [bound].into_iter().chain(via.network().map(|_| calls()));
    let finding = |(protocol, address, bound): (&str, SocketAddr, std::io::Result<()>)| match bound
    {
        Ok(()) => Finding::good("ports", format!("{address} is free ({protocol})")),
        Err(source) => match BusError::listen(address, source) {
            BusError::PortInUse { .. } => Finding::trouble(
                "ports",
                Health::Warning,
                format!("{address} is in use ({protocol})"),
                format!(
                    "none where this member runs already; otherwise `ss -lpn 'sport = :{}'` names who has it",
                    address.port()
                ),
            ),
            error => Finding::trouble(
                "ports",
                Health::Bad,
                error.to_string(),
                "`ip address` lists the addresses of this machine; the cluster file has to name one of them for this member",
            ),
        },
    };
    bound.map(finding).collect()
}

/// What a firewall has to let through to the member with this address.
fn ports_of(link: LinkKind, address: SocketAddr) -> String {
    match link.frames_address(address) {
        Ok(frames) if link == LinkKind::Zenoh => {
            format!("TCP ports {} and {}", address.port(), frames.port())
        }
        _ => format!("UDP and TCP port {}", address.port()),
    }
}

/// Listens in the place of a member that does not run, for so long, and says of each peer whether it was heard.
///
/// # Errors
/// As [`LinkKind::open`] has; [`BusError::PortInUse`] where the member runs.
pub fn examine_peers(
    endpoints: &Endpoints,
    link: LinkKind,
    guard: &mut Guard,
    configuration: ConfigurationHash,
    patience: Duration,
) -> Result<Vec<Finding>, BusError> {
    let mut opened = link.open(endpoints)?;
    let clock = Clock::start();
    let end = clock.now() + patience;
    let mut heard: BTreeMap<Member, ConfigurationHash> = BTreeMap::new();
    let mut heard_over: BTreeSet<(Member, Via)> = BTreeSet::new();
    let mut refused: BTreeMap<Option<Member>, String> = BTreeMap::new();
    let paths = endpoints.paths();
    let senders = paths.iter().flat_map(|(via, on)| on.senders().map(|peer| (peer.member, *via)));
    let expected: BTreeSet<(Member, Via)> = senders.collect();
    let mut bytes = Vec::new();
    while clock.now() < end && !heard_over.is_superset(&expected) {
        while let Some(via) = opened.receive(&mut bytes) {
            match guard.open(via, &mut bytes) {
                Ok(Opened::Frame(frame)) if frame.header.cluster == endpoints.cluster() => {
                    heard.insert(frame.header.sender, frame.header.configuration);
                    heard_over.insert((frame.header.sender, via));
                }
                Ok(Opened::SecondCopy(sender)) => {
                    heard_over.insert((sender, via));
                }
                Ok(_) => {}
                Err(reason) => {
                    refused.insert(reason.sender, reason.reason);
                }
            }
        }
        let mut descriptors = [PollFd::new(opened.readiness(), PollFlags::POLLIN)];
        let left = TimeSpec::from_duration(end.since(clock.now()));
        ppoll(&mut descriptors, Some(left), None).map(drop).or_else(|error| match error {
            nix::errno::Errno::EINTR => Ok(()),
            error => Err(BusError::system("to wait for frames")(error)),
        })?;
    }
    Ok(endpoints
        .senders()
        .map(|peer| {
            let name = format!("{} ({})", peer.name, peer.address);
            match (heard.get(&peer.member), refused.get(&Some(peer.member))) {
                (Some(theirs), _) if *theirs == configuration => {
                    let over = |heard: bool| {
                        let paths = expected.iter().filter(|(member, _)| *member == peer.member);
                        let found = paths.filter(|path| heard_over.contains(path) == heard);
                        found.map(|(_, via)| via.to_string()).collect::<Vec<String>>()
                    };
                    match over(false) {
                        unheard if unheard.is_empty() => {
                            Finding::good("peer", format!("{name} is heard"))
                        }
                        unheard => {
                            let unheard = unheard.join(" and ");
                            Finding::trouble(
                                "networks",
                                Health::Bad,
                                format!("{name} is heard over {} and not over {unheard}", over(true).join(" and ")),
                                format!("check the cable, the switch and the addresses of {unheard} on both machines"),
                            )
                        }
                    }
                }
                (Some(theirs), _) => Finding::trouble(
                    "configuration",
                    Health::Bad,
                    format!("{name} runs configuration {theirs}, and this is {configuration}"),
                    "copy one cluster file and its ladders to every machine; `understudy doctor` shows the hash of each",
                ),
                (None, Some(reason)) => Finding::trouble(
                    "peer",
                    Health::Bad,
                    format!("{name} is heard and not believed: {reason}"),
                    "issue its keys again and copy the changed folders to every machine",
                ),
                (None, None) => Finding::trouble(
                    "peer",
                    Health::Warning,
                    format!("{name} was not heard for {} ms", patience.as_millis()),
                    format!("start it; where it runs, check the network (`ping {}`) and the firewall ({})", peer.address.ip(), ports_of(link, peer.address)),
                ),
            }
        })
        .chain(refused.get(&None).map(|reason| {
            Finding::trouble(
                "peer",
                Health::Warning,
                format!("something else arrives at {}: {reason}", endpoints.own().address),
                "find who sends it; a member without keys, or another program",
            )
        }))
        .collect())
}
