//! Who is where; who is to hear whom is said by [`Topic::between`].

use std::net::SocketAddr;

use serde::{Deserialize, Serialize};
use understudy_wire::{ClusterHash, Party, ProgramId, Topic};

use crate::error::BusError;

/// One party and where it listens.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Peer {
    /// Who.
    pub party: Party,
    /// Its name in the cluster file.
    pub name: String,
    /// Where it listens, and where the others send to.
    pub address: SocketAddr,
}

/// What one party knows of all.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Endpoints {
    cluster: ClusterHash,
    own: Peer,
    others: Vec<Peer>,
    neighbours: Vec<(ProgramId, ProgramId)>,
}

impl Endpoints {
    /// `parties` are all of the cluster, `own` among them; a pair (i, j) in `neighbours` says that plant j hears
    /// plant i.
    ///
    /// # Errors
    /// [`BusError::NoAddress`] where `own` is not among the parties; [`BusError::SharedAddress`] where two have one address.
    pub fn new(
        cluster: ClusterHash,
        own: Party,
        parties: Vec<Peer>,
        neighbours: Vec<(ProgramId, ProgramId)>,
    ) -> Result<Self, BusError> {
        for (place, first) in parties.iter().enumerate() {
            let same = |second: &&Peer| second.address == first.address;
            if let Some(second) = parties[place + 1..].iter().find(same) {
                return Err(BusError::SharedAddress {
                    first: first.name.clone(),
                    second: second.name.clone(),
                    address: first.address,
                });
            }
        }
        let (mut own_peers, others): (Vec<Peer>, Vec<Peer>) =
            parties.into_iter().partition(|peer| peer.party == own);
        let own = own_peers.pop().ok_or(BusError::NoAddress { party: own })?;
        Ok(Self {
            cluster,
            own,
            others,
            neighbours,
        })
    }

    /// Whose frames travel.
    pub fn cluster(&self) -> ClusterHash {
        self.cluster
    }

    /// This party.
    pub fn own(&self) -> &Peer {
        &self.own
    }

    /// All others.
    pub fn others(&self) -> &[Peer] {
        &self.others
    }

    /// On which topic `listener` hears `speaker`, if at all.
    pub(crate) fn topic(&self, speaker: Party, listener: Party) -> Option<Topic> {
        Topic::between(speaker, listener, &self.neighbours)
    }

    /// Whether this party and `other` have something to say to each other, in either direction.
    pub fn talks_with(&self, other: Party) -> bool {
        let own = self.own.party;
        self.topic(own, other).or(self.topic(other, own)).is_some()
    }

    /// Those who hear this party on `topic`.
    pub(crate) fn audience(&self, topic: Topic) -> impl Iterator<Item = &Peer> {
        self.others
            .iter()
            .filter(move |peer| self.topic(self.own.party, peer.party) == Some(topic))
    }

    /// Those whom this party hears, each with its topic.
    pub(crate) fn heard(&self) -> impl Iterator<Item = (&Peer, Topic)> {
        self.others.iter().filter_map(|peer| {
            let topic = self.topic(peer.party, self.own.party)?;
            Some((peer, topic))
        })
    }

    /// Those whom this party calls: of two who have something to say to each other, the later in the order of parties
    /// (stations by rank, then remote I/Os, then plants) calls the earlier, and never both, because two sessions between
    /// one pair can end as two halves that never meet.
    pub(crate) fn called(&self) -> impl Iterator<Item = &Peer> {
        let own = self.own.party;
        self.others
            .iter()
            .filter(move |peer| self.talks_with(peer.party) && peer.party < own)
    }
}

#[cfg(test)]
mod tests {
    use understudy_wire::StationId;

    use super::*;

    /// Two controllers, an understudy, two remote I/Os and two plants, plant 1 feeding plant 2.
    fn cell() -> Vec<Peer> {
        let parties = (0..3)
            .map(|rank| Party::Station(StationId(rank)))
            .chain((0..2).map(|program| Party::RemoteIo(ProgramId(program))))
            .chain((0..2).map(|program| Party::Plant(ProgramId(program))));
        parties
            .enumerate()
            .map(|(place, party)| Peer {
                party,
                name: format!("{place}"),
                address: ([127, 0, 0, 1], 7000 + place as u16).into(),
            })
            .collect()
    }

    fn endpoints(own: Party) -> Endpoints {
        let feeds = vec![(ProgramId(0), ProgramId(1))];
        Endpoints::new(ClusterHash(1), own, cell(), feeds).expect("own is among the parties")
    }

    fn check(own: Party, topic: Topic, expected: &[&str]) {
        let endpoints = endpoints(own);
        let names: Vec<&str> = endpoints
            .audience(topic)
            .map(|peer| peer.name.as_str())
            .collect();
        assert_eq!(names, expected, "{own:?} on {topic:?}");
    }

    #[test]
    fn everybody_concerned_is_told_and_nobody_else() {
        check(
            Party::Station(StationId(1)),
            Topic::Cycle,
            &["0", "2", "3", "4"],
        );
        check(Party::Station(StationId(1)), Topic::Field, &[]);
        check(
            Party::RemoteIo(ProgramId(0)),
            Topic::Cycle,
            &["0", "1", "2"],
        );
        check(Party::RemoteIo(ProgramId(0)), Topic::Actuation, &["5"]);
        check(Party::Plant(ProgramId(0)), Topic::Field, &["3", "6"]);
        check(Party::Plant(ProgramId(1)), Topic::Field, &["4"]);
    }

    #[test]
    fn what_one_says_the_other_hears_and_one_of_each_pair_calls() {
        for first in cell() {
            for second in cell() {
                let (mine, theirs) = (endpoints(first.party), endpoints(second.party));
                let said = mine.topic(first.party, second.party);
                let heard = theirs
                    .heard()
                    .find(|(peer, _)| **peer == first)
                    .map(|(_, topic)| topic);
                assert_eq!(said, heard);
                let talks = said.or(mine.topic(second.party, first.party)).is_some();
                let calls = mine.called().filter(|peer| **peer == second).count()
                    + theirs.called().filter(|peer| **peer == first).count();
                assert_eq!(calls, usize::from(talks));
            }
        }
    }

    #[test]
    fn a_stranger_and_a_shared_address_are_refused() {
        let stranger = Party::Station(StationId(9));
        let refused = Endpoints::new(ClusterHash(1), stranger, cell(), Vec::new());
        assert!(matches!(refused, Err(BusError::NoAddress { .. })));
        let mut parties = cell();
        parties[1].address = parties[4].address;
        let refused = Endpoints::new(ClusterHash(1), parties[0].party, parties, Vec::new());
        assert!(
            matches!(refused, Err(BusError::SharedAddress { first, second, .. }) if first == "1" && second == "4")
        );
    }
}
