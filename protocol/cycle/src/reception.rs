//! Admission of frames by their headers.

use std::collections::BTreeSet;

use crate::agreement::Agreement;
use understudy_wire::{ClusterHash, ConfigurationHash, Header, Member};

/// Admission of one member. Remembers the members that it has refused, at most one entry for each.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub(crate) struct Reception {
    own: Member,
    cluster: ClusterHash,
    configuration: ConfigurationHash,
    stations: usize,
    programs: usize,
    refused: BTreeSet<Member>,
}

/// Decision on a frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Admission {
    /// It is accepted.
    Admitted,
    /// Of another cluster, of no member of this one, of this member itself, or of a member that was refused before:
    /// dropped without a report.
    Dropped,
    /// The first of a member with another configuration: dropped and reported.
    Refused {
        /// The configuration that it runs.
        theirs: ConfigurationHash,
    },
}

impl Reception {
    /// Admission of frames at the member `own`.
    pub(crate) fn new(own: Member, agreement: &Agreement) -> Self {
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
    pub(crate) fn admit(&mut self, header: &Header) -> Admission {
        let known = match header.sender {
            Member::Station(station) => station.index() < self.stations,
            Member::RemoteIo(program) | Member::Plant(program) => program.index() < self.programs,
        };
        if header.cluster != self.cluster || header.sender == self.own {
            return Admission::Dropped;
        }
        if header.configuration != self.configuration {
            // A sender that is in no cluster of this size is reported too, once for all of them.
            let member = if known { header.sender } else { self.own };
            let theirs = header.configuration;
            return if self.refused.insert(member) {
                Admission::Refused { theirs }
            } else {
                Admission::Dropped
            };
        }
        if known { Admission::Admitted } else { Admission::Dropped }
    }
}
