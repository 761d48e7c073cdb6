//! One datagram for all receivers, where the network has IP multicast.
//!
//! ```text
//!   topic and class of the sender ──► group 0…32 ──► every member that receives anything of that topic and class
//! ```
//!
//! Senders are divided into [`CLASSES`] by their index, so that a controller receives few turns and samples that it does not need: none among 16
//! programs. A system lets one socket be in 20 groups, so there is one for samples and one for the rest.
//!
//! Invariant: a member receives at least the frames that it would receive one by one. What it is not a receiver of is dropped here, and what
//! comes from a stranger is passed on, so that it is refused and counted.

use std::collections::BTreeSet;
use std::io;
use std::net::{IpAddr, Ipv4Addr, SocketAddr, SocketAddrV4, UdpSocket};
use std::os::fd::{AsFd, BorrowedFd};
use std::time::Duration;

use nix::sys::epoll::{Epoll, EpollCreateFlags, EpollEvent, EpollFlags};
use socket2::{Domain, Protocol, Socket, Type};
use understudy_wire::{Member, Topic};

use crate::endpoints::Endpoints;
use crate::error::BusError;
use crate::udp::RECEIVE_BUFFER_BYTES;

/// Classes of the senders of one topic.
const CLASSES: u8 = 16;

/// Groups of one cluster; those from [`FIRST_OF_SAMPLES`] on are of samples.
const GROUPS: u8 = FIRST_OF_SAMPLES + CLASSES;

const FIRST_OF_SAMPLES: u8 = 1 + CLASSES;

/// Patience of [`works_on_loopback`], which needs some ten microseconds.
const PROBE_PATIENCE: Duration = Duration::from_millis(200);

/// The group of what a member sends on a topic, counted from the first; nothing for topics with one receiver.
fn group_of(topic: Topic, sender: Member) -> Option<u8> {
    let index = match sender {
        Member::Station(station) => station.0,
        Member::RemoteIo(program) | Member::Plant(program) | Member::Twin(program) => program.0,
    };
    match topic {
        Topic::Cycle => Some(0),
        Topic::Turn => Some(1 + index % CLASSES),
        Topic::Sample => Some(FIRST_OF_SAMPLES + index % CLASSES),
        Topic::Field | Topic::Actuation | Topic::Pair => None,
    }
}

/// Address of a group.
fn address_of(first: SocketAddrV4, group: u8) -> SocketAddrV4 {
    let address = u32::from(*first.ip()).saturating_add(u32::from(group));
    SocketAddrV4::new(Ipv4Addr::from(address), first.port())
}

/// What one member sends to groups and receives from them.
pub(crate) struct Groups {
    /// For turns and for samples, as far as it receives any.
    sockets: Vec<UdpSocket>,
    /// Readable when one of these or the member's own socket is.
    readiness: Epoll,
    first: SocketAddrV4,
    own: Member,
    /// Addresses whose datagrams are dropped: this member's own, and those of members that send nothing to it.
    dropped: BTreeSet<SocketAddr>,
}

impl Groups {
    /// Joins the groups of a member. `sender` is the socket that it sends with.
    pub(crate) fn join(
        endpoints: &Endpoints,
        first: SocketAddrV4,
        sender: &UdpSocket,
    ) -> Result<Self, BusError> {
        let own = endpoints.own();
        let joined = Self::open(endpoints, first, sender);
        let (sockets, readiness) =
            joined.map_err(|source| BusError::listen(first.into(), source))?;
        let senders: BTreeSet<SocketAddr> = endpoints.senders().map(|peer| peer.address).collect();
        let others = endpoints.others().iter().map(|peer| peer.address);
        Ok(Self {
            sockets,
            readiness,
            first,
            own: own.member,
            dropped: others
                .filter(|address| !senders.contains(address))
                .chain([own.address])
                .collect(),
        })
    }

    fn open(
        endpoints: &Endpoints,
        first: SocketAddrV4,
        sender: &UdpSocket,
    ) -> io::Result<(Vec<UdpSocket>, Epoll)> {
        let IpAddr::V4(interface) = endpoints.own().address.ip() else {
            return Err(io::Error::other("the address of this member is not of IPv4"));
        };
        let topics = [Topic::Cycle, Topic::Turn, Topic::Sample];
        let heard = topics.into_iter().flat_map(|topic| {
            let peers = endpoints.heard(topic);
            peers.filter_map(move |peer| group_of(topic, peer.member))
        });
        let mut turns: BTreeSet<u8> = heard.collect();
        let samples = turns.split_off(&FIRST_OF_SAMPLES);
        let received = [turns, samples].into_iter().filter(|groups| !groups.is_empty());
        let sockets = received.map(|groups| {
            let addresses = groups.into_iter().map(|group| address_of(first, group));
            listen(first.port(), interface, addresses)
        });
        let sockets: Vec<UdpSocket> = sockets.collect::<io::Result<_>>()?;
        socket2::SockRef::from(sender).set_multicast_if_v4(&interface)?;
        let readiness = Epoll::new(EpollCreateFlags::EPOLL_CLOEXEC)?;
        for socket in sockets.iter().chain([sender]) {
            readiness.add(socket, EpollEvent::new(EpollFlags::EPOLLIN, 0))?;
        }
        Ok((sockets, readiness))
    }

    /// Where a frame of a topic is sent to.
    pub(crate) fn address(&self, topic: Topic) -> Option<SocketAddr> {
        let group = group_of(topic, self.own)?;
        Some(address_of(self.first, group).into())
    }

    /// The length of the next datagram for this member.
    pub(crate) fn receive(&self, datagram: &mut [u8]) -> Option<usize> {
        for socket in &self.sockets {
            while let Ok((length, from)) = socket.recv_from(datagram) {
                if !self.dropped.contains(&from) {
                    return Some(length);
                }
            }
        }
        None
    }

    /// Readable when a datagram waits, also one for the member alone.
    pub(crate) fn readiness(&self) -> BorrowedFd<'_> {
        self.readiness.0.as_fd()
    }
}

/// A socket that receives what is sent to these groups, and to no other group that somebody on this machine is in.
fn listen(
    port: u16,
    interface: Ipv4Addr,
    groups: impl Iterator<Item = SocketAddrV4>,
) -> io::Result<UdpSocket> {
    let socket = Socket::new(Domain::IPV4, Type::DGRAM, Some(Protocol::UDP))?;
    // All members on one machine have the port.
    socket.set_reuse_address(true)?;
    socket.set_multicast_all_v4(false)?;
    socket.set_nonblocking(true)?;
    socket.set_recv_buffer_size(RECEIVE_BUFFER_BYTES)?;
    socket.bind(&SocketAddrV4::new(Ipv4Addr::UNSPECIFIED, port).into())?;
    for group in groups {
        socket.join_multicast_v4(group.ip(), &interface)?;
    }
    Ok(socket.into())
}

/// Groups for a cluster on the loopback interface of this machine, with a port that nobody else has; nothing where it has no multicast.
pub fn loopback_groups() -> Option<SocketAddrV4> {
    let free = UdpSocket::bind((Ipv4Addr::UNSPECIFIED, 0)).ok()?;
    let first = SocketAddrV4::new(FIRST_OF_LOOPBACK, free.local_addr().ok()?.port());
    drop(free);
    works_on_loopback(first).ok()?.then_some(first)
}

/// In the range that organisations assign by themselves (RFC 2365).
const FIRST_OF_LOOPBACK: Ipv4Addr = Ipv4Addr::new(239, 255, 68, 0);

fn works_on_loopback(first: SocketAddrV4) -> io::Result<bool> {
    let interface = Ipv4Addr::LOCALHOST;
    let last = address_of(first, GROUPS - 1);
    let groups = (FIRST_OF_SAMPLES..GROUPS).map(|group| address_of(first, group));
    let receiver = listen(first.port(), interface, groups)?;
    receiver.set_nonblocking(false)?;
    receiver.set_read_timeout(Some(PROBE_PATIENCE))?;
    let sender = UdpSocket::bind((interface, 0))?;
    socket2::SockRef::from(&sender).set_multicast_if_v4(&interface)?;
    sender.send_to(b"probe", last)?;
    let mut datagram = [0; 16];
    let (length, from) = receiver.recv_from(&mut datagram)?;
    Ok(&datagram[..length] == b"probe" && from == sender.local_addr()?)
}

#[cfg(test)]
mod tests {
    use understudy_wire::{ProgramId, Roster, StationId};

    use super::*;

    /// Whoever is in the audience of a sender is in the group of its frames, for every size of a cluster; and no member is in more groups than a
    /// system allows.
    #[test]
    fn every_receiver_is_in_the_group() {
        for controllers in 1..=60_usize {
            for understudies in 1..=4 {
                let stations = controllers + understudies;
                let feeds = vec![(
                    Member::RemoteIo(ProgramId(0)),
                    Member::RemoteIo(ProgramId(controllers as u8 - 1)),
                )];
                let roster = Roster::new(controllers, stations, feeds);
                let members: Vec<Member> = (0..stations as u8)
                    .map(|rank| Member::Station(StationId(rank)))
                    .chain(
                        (0..controllers as u8).map(|program| Member::RemoteIo(ProgramId(program))),
                    )
                    .collect();
                for receiver in &members {
                    let heard = members.iter().flat_map(|sender| {
                        let topics = [Topic::Cycle, Topic::Turn, Topic::Sample].into_iter();
                        let heard = topics
                            .filter(|topic| roster.audience(*topic, *sender).contains(*receiver));
                        heard.map(|topic| group_of(topic, *sender).expect("a group"))
                    });
                    let mut turns: BTreeSet<u8> = heard.collect();
                    let samples = turns.split_off(&FIRST_OF_SAMPLES);
                    assert!(turns.len() <= 20 && samples.len() <= 20);
                    assert!(samples.iter().all(|group| *group < GROUPS));
                }
            }
        }
    }
}
