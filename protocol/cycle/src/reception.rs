//! Admission of frames by their headers.

use std::collections::BTreeMap;
use std::time::Duration;

use crate::agreement::Agreement;
use understudy_wire::{ClusterHash, ConfigurationHash, Header, Member, Time};

/// A refusal has ended when no frame of the other configuration was received for this time, and for some periods.
const REFUSED_FOR: Duration = Duration::from_secs(1);
const REFUSED_FOR_PERIODS: u32 = 4;

/// Admission of one member. Remembers the members that it refuses, at most one entry for each.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub(crate) struct Reception {
    own: Member,
    cluster: ClusterHash,
    configuration: ConfigurationHash,
    stations: usize,
    programs: usize,
    refused_for: Duration,
    refused: BTreeMap<Member, Other>,
}

/// A refused member.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
struct Other {
    configuration: ConfigurationHash,
    /// When its last frame was received.
    received: Time,
}

/// Decision on a frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Admission {
    /// It is accepted.
    Admitted,
    /// It is accepted, the first one after frames that were refused.
    AdmittedAgain,
    /// Of another cluster, of no member of this one, of this member itself, or of a member that is refused already:
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
            refused_for: REFUSED_FOR.max(agreement.schedule.period() * REFUSED_FOR_PERIODS),
            refused: BTreeMap::new(),
        }
    }

    /// Decides on the header of a frame that arrives at `now`.
    pub(crate) fn admit(&mut self, now: Time, header: &Header) -> Admission {
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
            let other = Other { configuration: theirs, received: now };
            return match self.refused.insert(member, other) {
                Some(before) if before.configuration == theirs => Admission::Dropped,
                _ => Admission::Refused { theirs },
            };
        }
        match known {
            true if self.refused.remove(&header.sender).is_some() => Admission::AdmittedAgain,
            true => Admission::Admitted,
            false => Admission::Dropped,
        }
    }

    /// A member that is no longer refused at `now`, since nothing more was received of it; one call for each.
    pub(crate) fn ended(&mut self, now: Time) -> Option<Member> {
        let is_over = |other: &Other| now.since(other.received) >= self.refused_for;
        let (member, _) = self.refused.iter().find(|(_, other)| is_over(other))?;
        let member = *member;
        self.refused.remove(&member);
        Some(member)
    }

    /// The number of members with another configuration that are received.
    pub(crate) fn refused(&self) -> usize {
        self.refused.len()
    }

    /// The configuration that most of the refused stations have, with their number.
    pub(crate) fn most_common(&self) -> Option<(ConfigurationHash, usize)> {
        let mut stations: BTreeMap<ConfigurationHash, usize> = BTreeMap::new();
        for (member, other) in &self.refused {
            if matches!(member, Member::Station(_)) {
                *stations.entry(other.configuration).or_default() += 1;
            }
        }
        stations.into_iter().max_by_key(|(_, count)| *count)
    }
}
