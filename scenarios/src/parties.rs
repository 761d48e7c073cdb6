//! The parties of a cluster by name.

use understudy_wire::{Party, ProgramId, StationId};

/// Every party of a cluster with its name: stations by rank, then remote I/Os, then plants.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Parties(Vec<(Party, String)>);

impl Parties {
    /// From all parties; names are unique, which the reader of cluster files has checked.
    pub fn new(parties: impl IntoIterator<Item = (Party, String)>) -> Self {
        let mut parties: Vec<_> = parties.into_iter().collect();
        parties.sort();
        Self(parties)
    }

    /// In order.
    pub fn iter(&self) -> impl ExactSizeIterator<Item = (Party, &str)> {
        self.0.iter().map(|(party, name)| (*party, name.as_str()))
    }

    /// Its name; for a party that is none of this cluster, its rank.
    pub fn name(&self, party: Party) -> &str {
        self.0
            .iter()
            .find(|(known, _)| *known == party)
            .map_or("(unknown)", |(_, name)| name)
    }

    /// The party of a name.
    pub fn find(&self, name: &str) -> Option<Party> {
        self.iter()
            .find(|(_, known)| *known == name)
            .map(|(party, _)| party)
    }

    /// Stations in rank order.
    pub fn stations(&self) -> impl Iterator<Item = (StationId, &str)> {
        self.iter().filter_map(|(party, name)| match party {
            Party::Station(station) => Some((station, name)),
            _ => None,
        })
    }

    /// Remote I/Os in the order of programs.
    pub fn remote_ios(&self) -> impl Iterator<Item = (ProgramId, &str)> {
        self.iter().filter_map(|(party, name)| match party {
            Party::RemoteIo(program) => Some((program, name)),
            _ => None,
        })
    }

    /// Plants in the order of programs.
    pub fn plants(&self) -> impl Iterator<Item = (ProgramId, &str)> {
        self.iter().filter_map(|(party, name)| match party {
            Party::Plant(program) => Some((program, name)),
            _ => None,
        })
    }
}
