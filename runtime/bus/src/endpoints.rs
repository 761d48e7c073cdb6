//! Who is where; [`Roster`] says who receives what.

use std::collections::BTreeMap;
use std::io;
use std::net::{SocketAddr, SocketAddrV4, TcpStream};
use std::time::Duration;

use serde::{Deserialize, Serialize};
use understudy_wire::{ClusterHash, Member, Roster, Topic, Via};

use crate::error::BusError;

/// One member and where it listens.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Peer {
    /// Who.
    pub member: Member,
    /// Its name in the cluster file.
    pub name: String,
    /// Where it listens, and where the others send to.
    pub address: SocketAddr,
    /// The same on the second network, in a cluster with two.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub second: Option<SocketAddr>,
    /// The same on the direct link to the other remote I/O of its program, where there is one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub link: Option<SocketAddr>,
}

impl Peer {
    /// A member on the first network alone.
    pub fn new(member: Member, name: String, address: SocketAddr) -> Self {
        Self { member, name, address, second: None, link: None }
    }

    /// Where to call it: of two addresses the first that takes a call, which is asked only where there are two.
    pub fn call_address(&self) -> SocketAddr {
        let asked = self.second.and_then(|_| self.reachable().ok());
        asked.unwrap_or(self.address)
    }

    /// The first of its addresses that takes a call.
    ///
    /// # Errors
    /// What the system says of the last one.
    pub fn reachable(&self) -> io::Result<SocketAddr> {
        let mut failure = io::ErrorKind::NotFound.into();
        for address in self.addresses() {
            match TcpStream::connect_timeout(&address, REACH) {
                Ok(_) => return Ok(address),
                Err(error) => failure = error,
            }
        }
        Err(failure)
    }

    /// Where it takes calls: on each network.
    pub fn addresses(&self) -> impl Iterator<Item = SocketAddr> + use<> {
        [self.address].into_iter().chain(self.second)
    }

    /// Where it listens for frames over a path.
    pub fn at(&self, via: Via) -> Option<SocketAddr> {
        match via {
            Via::First => Some(self.address),
            Via::Second => self.second,
            Via::Link => self.link,
        }
    }

    /// Where it listens for frames, over each path.
    pub fn paths(&self) -> impl Iterator<Item = (Via, SocketAddr)> + use<> {
        let addresses = Via::ALL.map(|via| self.at(via).map(|address| (via, address)));
        addresses.into_iter().flatten()
    }
}

/// How long a member is given to take a call at one of its addresses.
const REACH: Duration = Duration::from_millis(1500);

/// What one member knows of all.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Endpoints {
    cluster: ClusterHash,
    own: Peer,
    others: Vec<Peer>,
    roster: Roster,
    multicast: Option<SocketAddrV4>,
    /// Whether the member is on other paths too.
    is_one_of_several: bool,
}

/// The first group of the second network: the same at the next port.
fn next_port(first: SocketAddrV4) -> Option<SocketAddrV4> {
    Some(SocketAddrV4::new(*first.ip(), first.port().checked_add(1)?))
}

impl Endpoints {
    /// `members` are all of the cluster, `own` among them.
    ///
    /// # Errors
    /// [`BusError::NoAddress`] where `own` is not among the members; [`BusError::SharedAddress`] where two have one address.
    pub fn new(
        cluster: ClusterHash,
        own: Member,
        members: Vec<Peer>,
        roster: Roster,
    ) -> Result<Self, BusError> {
        let mut taken: BTreeMap<SocketAddr, &str> = BTreeMap::new();
        for peer in &members {
            for (_, address) in peer.paths() {
                if let Some(first) = taken.insert(address, &peer.name) {
                    return Err(BusError::SharedAddress {
                        first: first.to_owned(),
                        second: peer.name.clone(),
                        address,
                    });
                }
            }
        }
        let (mut own_peers, others): (Vec<Peer>, Vec<Peer>) =
            members.into_iter().partition(|peer| peer.member == own);
        let own = own_peers.pop().ok_or(BusError::NoAddress { member: own })?;
        let is_one_of_several = own.paths().count() > 1;
        Ok(Self { cluster, own, others, roster, multicast: None, is_one_of_several })
    }

    /// The same with the address of the first multicast group, where the network between the members has multicast.
    #[must_use]
    pub fn with_multicast(self, first: Option<SocketAddrV4>) -> Self {
        Self { multicast: first, ..self }
    }

    /// The members on a path, and where, where this member is on it; a member that is not receives nothing there. On the direct link are the two remote
    /// I/Os of a program.
    pub fn over(&self, via: Via) -> Option<Self> {
        if via == Via::First {
            return Some(self.clone());
        }
        let there = |peer: &Peer| {
            let address = peer.at(via)?;
            Some(Peer { address, second: None, link: None, ..peer.clone() })
        };
        let partner = self.own.member.partner();
        let is_joined = |peer: &&Peer| via != Via::Link || Some(peer.member) == partner;
        Some(Self {
            own: there(&self.own)?,
            others: self.others.iter().filter(is_joined).filter_map(there).collect(),
            multicast: self.multicast.and_then(next_port).filter(|_| via != Via::Link),
            cluster: self.cluster,
            roster: self.roster.clone(),
            is_one_of_several: true,
        })
    }

    /// Each path that this member is on, with the members on it.
    pub(crate) fn paths(&self) -> Vec<(Via, Self)> {
        Via::ALL.into_iter().filter_map(|via| Some((via, self.over(via)?))).collect()
    }

    /// Whether this is one of several paths, so that the others carry frames where this one does not.
    pub(crate) fn is_one_of_several(&self) -> bool {
        self.is_one_of_several
    }

    /// The first multicast group.
    pub(crate) fn multicast(&self) -> Option<SocketAddrV4> {
        self.multicast
    }

    /// Whose frames travel.
    pub fn cluster(&self) -> ClusterHash {
        self.cluster
    }

    /// This member.
    pub fn own(&self) -> &Peer {
        &self.own
    }

    /// All others.
    pub fn others(&self) -> &[Peer] {
        &self.others
    }

    /// Who receives what.
    pub fn roster(&self) -> &Roster {
        &self.roster
    }

    /// Whether this member and `other` have something to say to each other, in either direction.
    pub fn talks_with(&self, other: Member) -> bool {
        let own = self.own.member;
        self.roster.is_received(own, other) || self.roster.is_received(other, own)
    }

    /// Those who hear this member on `topic`.
    pub(crate) fn audience(&self, topic: Topic) -> impl Iterator<Item = &Peer> {
        let audience = self.roster.audience(topic, self.own.member);
        let others = self.others.iter();
        others.filter(move |peer| audience.contains(peer.member))
    }

    /// Those whom this member hears on `topic`.
    pub(crate) fn heard(&self, topic: Topic) -> impl Iterator<Item = &Peer> {
        let own = self.own.member;
        let others = self.others.iter();
        others.filter(move |peer| {
            let audience = self.roster.audience(topic, peer.member);
            audience.contains(own)
        })
    }

    /// Those whom this member hears on any topic.
    pub(crate) fn senders(&self) -> impl Iterator<Item = &Peer> {
        let own = self.own.member;
        let others = self.others.iter();
        others.filter(move |peer| self.roster.is_received(peer.member, own))
    }

    /// Those whom this member calls: of two who have something to say to each other, the later in the order of members
    /// (stations by rank, then remote I/Os, then plants) calls the earlier, and never both, because two sessions between
    /// one pair can end as two halves that never meet.
    pub(crate) fn called(&self) -> impl Iterator<Item = &Peer> {
        let own = self.own.member;
        self.others.iter().filter(move |peer| self.talks_with(peer.member) && peer.member < own)
    }
}

#[cfg(test)]
mod tests {
    use understudy_wire::{ProgramId, StationId};

    use super::*;

    /// Two controllers, an understudy, two remote I/Os and two plants, plant 1 feeding plant 2.
    fn cell() -> Vec<Peer> {
        let members = (0..3)
            .map(|rank| Member::Station(StationId(rank)))
            .chain((0..2).map(|program| Member::RemoteIo(ProgramId(program))))
            .chain((0..2).map(|program| Member::Plant(ProgramId(program))));
        members
            .enumerate()
            .map(|(place, member)| {
                let address = ([127, 0, 0, 1], 7000 + place as u16).into();
                Peer::new(member, format!("{place}"), address)
            })
            .collect()
    }

    fn endpoints(own: Member) -> Endpoints {
        let feeds = vec![(Member::Plant(ProgramId(0)), Member::Plant(ProgramId(1)))];
        let roster = Roster::new(2, 3, feeds);
        Endpoints::new(ClusterHash(1), own, cell(), roster).expect("own is among the members")
    }

    fn check(own: Member, topic: Topic, expected: &[&str]) {
        let endpoints = endpoints(own);
        let names: Vec<&str> = endpoints.audience(topic).map(|peer| peer.name.as_str()).collect();
        assert_eq!(names, expected, "{own:?} on {topic:?}");
    }

    #[test]
    fn everybody_concerned_is_told_and_nobody_else() {
        check(Member::Station(StationId(1)), Topic::Cycle, &["0", "2", "3", "4"]);
        check(Member::Station(StationId(1)), Topic::Field, &[]);
        check(Member::Station(StationId(1)), Topic::Turn, &["0", "2", "3", "4"]);
        check(Member::RemoteIo(ProgramId(0)), Topic::Sample, &["0", "1", "2"]);
        check(Member::RemoteIo(ProgramId(0)), Topic::Actuation, &["5"]);
        check(Member::Plant(ProgramId(0)), Topic::Field, &["3", "6"]);
        check(Member::Plant(ProgramId(1)), Topic::Field, &["4"]);
    }

    #[test]
    fn what_one_says_the_other_hears_and_one_of_each_pair_calls() {
        for first in cell() {
            for second in cell() {
                let (mine, theirs) = (endpoints(first.member), endpoints(second.member));
                let said = |topic| mine.audience(topic).any(|peer| *peer == second);
                let heard = |topic| theirs.heard(topic).any(|peer| *peer == first);
                for topic in Topic::ALL {
                    assert_eq!(said(topic), heard(topic));
                }
                let talks = mine.talks_with(second.member);
                assert_eq!(talks, theirs.talks_with(first.member));
                let calls = mine.called().filter(|peer| **peer == second).count()
                    + theirs.called().filter(|peer| **peer == first).count();
                assert_eq!(calls, usize::from(talks));
            }
        }
    }

    #[test]
    fn a_stranger_and_a_shared_address_are_refused() {
        let stranger = Member::Station(StationId(9));
        let refused =
            Endpoints::new(ClusterHash(1), stranger, cell(), Roster::new(2, 3, Vec::new()));
        assert!(matches!(refused, Err(BusError::NoAddress { .. })));
        let mut members = cell();
        members[1].address = members[4].address;
        let refused = Endpoints::new(
            ClusterHash(1),
            members[0].member,
            members,
            Roster::new(2, 3, Vec::new()),
        );
        assert!(
            matches!(refused, Err(BusError::SharedAddress { first, second, .. }) if first == "1" && second == "4")
        );
    }
}
