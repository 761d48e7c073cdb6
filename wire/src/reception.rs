//! Whose frames are taken in at all.

use std::collections::BTreeSet;

use crate::agreement::Agreement;
use crate::frame::Header;
use crate::identifier::{ClusterHash, ConfigurationHash, Party};

/// Decides on headers alone. Remembers whom it has refused, at most once for each party of the cluster.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct Reception {
    own: Party,
    cluster: ClusterHash,
    configuration: ConfigurationHash,
    stations: usize,
    programs: usize,
    refused: BTreeSet<Party>,
}

/// What becomes of a frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Admission {
    /// It counts.
    Admitted,
    /// Of another cluster, of nobody in this one, or one's own: dropped without a word.
    Foreign,
    /// Of a party with another configuration: dropped.
    Refused {
        /// The configuration that it runs.
        theirs: ConfigurationHash,
        /// Whether it is the first that is refused from this party.
        first: bool,
    },
}

impl Reception {
    /// For one party.
    pub fn new(own: Party, agreement: &Agreement) -> Self {
        Self {
            own,
            cluster: agreement.cluster,
            configuration: agreement.configuration,
            stations: agreement.schedule.stations(),
            programs: agreement.schedule.controllers(),
            refused: BTreeSet::new(),
        }
    }

    /// Decides on one header.
    pub fn admit(&mut self, header: &Header) -> Admission {
        let known = match header.sender {
            Party::Station(station) => station.index() < self.stations,
            Party::RemoteIo(program) | Party::Plant(program) => program.index() < self.programs,
        };
        if header.cluster != self.cluster || header.sender == self.own {
            return Admission::Foreign;
        }
        if header.configuration != self.configuration {
            // A party that is in no cluster of this size is still worth a word, once for all of them.
            let party = if known { header.sender } else { self.own };
            return Admission::Refused {
                theirs: header.configuration,
                first: self.refused.insert(party),
            };
        }
        if known {
            Admission::Admitted
        } else {
            Admission::Foreign
        }
    }
}
