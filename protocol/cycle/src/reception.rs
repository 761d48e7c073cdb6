//! Admission of frames by their headers.

use std::collections::BTreeMap;
use std::time::Duration;

use crate::agreement::Agreement;
use understudy_wire::{ClusterHash, ConfigurationHash, Configurations, Header, Member, Time};

/// A refusal has ended when no frame of the other configuration was received for this time, and for some periods.
const REFUSED_FOR: Duration = Duration::from_secs(1);
const REFUSED_FOR_PERIODS: u32 = 4;

/// Admission of one member. Remembers the members that it refuses, at most one entry for each.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub(crate) struct Reception {
    own: Member,
    cluster: ClusterHash,
    stations: usize,
    programs: usize,
    refused_for: Duration,
    refused: BTreeMap<Member, Other>,
    /// When frames of members were admitted last that run the other configuration of an online change.
    others: BTreeMap<Member, Time>,
}

/// A refused member.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
struct Other {
    /// The sender that was named when the refusal began.
    member: Member,
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
            stations: agreement.schedule.stations(),
            programs: agreement.schedule.controllers(),
            refused_for: REFUSED_FOR.max(agreement.schedule.period() * REFUSED_FOR_PERIODS),
            refused: BTreeMap::new(),
            others: BTreeMap::new(),
        }
    }

    /// Decides on the header of a frame that arrives at `now` at a member with these configurations.
    pub(crate) fn admit(
        &mut self,
        now: Time,
        header: &Header,
        configurations: Configurations,
    ) -> Admission {
        let known = match header.sender {
            Member::Station(station) => station.index() < self.stations,
            Member::RemoteIo(program) | Member::Plant(program) | Member::Twin(program) => {
                program.index() < self.programs
            }
        };
        if header.cluster != self.cluster || header.sender == self.own {
            return Admission::Dropped;
        }
        if !configurations.admit(header) {
            // A sender that is in no cluster of this size is reported too, once for all of them.
            let key = if known { header.sender } else { self.own };
            let theirs = header.configuration;
            if let Some(other) = self.refused.get_mut(&key)
                && other.configuration == theirs
            {
                other.received = now;
                return Admission::Dropped;
            }
            let other = Other { member: header.sender, configuration: theirs, received: now };
            self.refused.insert(key, other);
            return Admission::Refused { theirs };
        }
        if configurations.prepared.is_some() && known {
            if header.configuration == configurations.own {
                self.others.remove(&header.sender);
            } else {
                self.others.insert(header.sender, now);
            }
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
        let (key, other) = self.refused.iter().find(|(_, other)| is_over(other))?;
        let (key, member) = (*key, other.member);
        self.refused.remove(&key);
        Some(member)
    }

    /// Whether a member is received at `now` that runs the other configuration of an online change.
    pub(crate) fn receives_other(&self, now: Time) -> bool {
        self.others.values().any(|received| now.since(*received) < self.refused_for)
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

#[cfg(test)]
mod tests {
    use understudy_wire::{Moment, ProgramId, StationId};

    use super::*;
    use crate::agreement::Mode;
    use crate::schedule::Schedule;

    const PERIOD: Duration = Duration::from_millis(10);

    fn header(sender: Member, configuration: u64) -> Header {
        Header {
            cluster: ClusterHash(1),
            configuration: ConfigurationHash(configuration),
            prepared: None,
            moment: Moment::default(),
            sender,
            alone: false,
        }
    }

    /// The end of a refusal names the member of its beginning, also one that a cluster of this size does not have.
    #[test]
    fn a_refusal_ends_for_the_member_that_it_began_with() {
        let agreement = Agreement {
            cluster: ClusterHash(1),
            configuration: ConfigurationHash(2),
            schedule: Schedule::new(PERIOD, 2, 1, 1).expect("within the bounds"),
            mode: Mode::Full,
            history: 4,
            flag_after: 3,
            shadow_cycles: 1,
            listen_cycles: 2,
        };
        let own = Member::Station(StationId(0));
        for sender in [
            Member::Station(StationId(1)),
            Member::Station(StationId(40)),
            Member::RemoteIo(ProgramId(0)),
            Member::RemoteIo(ProgramId(40)),
        ] {
            let mut reception = Reception::new(own, &agreement);
            let ours = Configurations { own: ConfigurationHash(2), prepared: None };
            let first = reception.admit(Time(0), &header(sender, 3), ours);
            assert_eq!(first, Admission::Refused { theirs: ConfigurationHash(3) }, "{sender:?}");
            let last = Time(0) + PERIOD * 50;
            assert_eq!(reception.admit(last, &header(sender, 3), ours), Admission::Dropped);
            assert_eq!(reception.ended(last + (REFUSED_FOR - PERIOD)), None, "{sender:?}");
            assert_eq!(reception.ended(last + REFUSED_FOR), Some(sender));
            assert_eq!((reception.ended(last + REFUSED_FOR), reception.refused()), (None, 0));
        }
    }
}
