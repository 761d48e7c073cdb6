//! Networks that were not in order, and links that a member could not open, as the members told it.

use std::collections::{BTreeMap, BTreeSet};

use understudy_bus::HostEvent;
use understudy_wire::{Member, Via};

/// Faults that are listed, at most; all are counted.
const MOST: usize = 100;

/// What was not in order.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum NetworkSubject {
    /// One of two networks, or the direct links.
    Network(Via),
    /// The link of a member, over one of several paths where there are several.
    Link(Member, Option<Via>),
}

/// A fault of a network or of a link.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct NetworkFault {
    pub(crate) subject: NetworkSubject,
    /// The first cycle with it; nothing before the origin.
    pub(crate) from: Option<u64>,
    /// The first cycle without it; nothing where it lasted until the end.
    pub(crate) to: Option<u64>,
    /// Members between which frames were missing or late.
    pub(crate) members: BTreeSet<Member>,
    /// Whether no frames arrived, at least for a time.
    pub(crate) is_lost: bool,
    /// Why the link could not be opened.
    pub(crate) reason: String,
}

#[derive(Debug, Clone, Default)]
pub(super) struct Networks {
    /// By subject: the members that tell of the fault that lasts, and its place in the list where it has one.
    lasting: BTreeMap<NetworkSubject, (BTreeSet<Member>, Option<usize>)>,
    pub(super) faults: Vec<NetworkFault>,
    pub(super) count: u64,
}

impl Networks {
    /// Takes what a member tells; `at` is the next cycle from the origin on.
    pub(super) fn note(&mut self, member: Member, event: &HostEvent, at: Option<u64>) {
        match event {
            HostEvent::NetworkReception { network, lost, impaired } => {
                let subject = NetworkSubject::Network(*network);
                if lost.is_empty() && impaired.is_empty() {
                    self.ends(subject, member, at);
                } else if let Some(fault) = self.lasts(subject, member, at) {
                    fault.members.extend([member].iter().chain(lost).chain(impaired));
                    fault.is_lost |= !lost.is_empty();
                }
            }
            HostEvent::LinkFailed { network, reason, .. } => {
                if let Some(fault) = self.lasts(NetworkSubject::Link(member, *network), member, at)
                {
                    fault.reason.clone_from(reason);
                }
            }
            HostEvent::LinkReopened { network, .. } => {
                self.ends(NetworkSubject::Link(member, *network), member, at);
            }
            HostEvent::Ready { .. } => self.is_new(member, at),
            _ => {}
        }
    }

    /// The process of a member begins or ends: what it told holds no more.
    pub(super) fn is_new(&mut self, member: Member, at: Option<u64>) {
        let subjects: Vec<NetworkSubject> = self.lasting.keys().copied().collect();
        subjects.into_iter().for_each(|subject| self.ends(subject, member, at));
    }

    fn lasts(
        &mut self,
        subject: NetworkSubject,
        member: Member,
        at: Option<u64>,
    ) -> Option<&mut NetworkFault> {
        let (tellers, place) = self.lasting.entry(subject).or_insert_with(|| {
            self.count += 1;
            let place = (self.faults.len() < MOST).then(|| {
                let (to, members) = (None, BTreeSet::new());
                let (is_lost, reason) = (false, String::new());
                self.faults.push(NetworkFault { subject, from: at, to, members, is_lost, reason });
                self.faults.len() - 1
            });
            (BTreeSet::new(), place)
        });
        tellers.insert(member);
        self.faults.get_mut((*place)?)
    }

    fn ends(&mut self, subject: NetworkSubject, member: Member, at: Option<u64>) {
        let Some((tellers, place)) = self.lasting.get_mut(&subject) else {
            return;
        };
        tellers.remove(&member);
        if !tellers.is_empty() {
            return;
        }
        if let Some(fault) = place.and_then(|place| self.faults.get_mut(place)) {
            // One that was over before the origin lasted no cycle.
            fault.to = Some(at.unwrap_or(0));
        }
        self.lasting.remove(&subject);
    }
}

#[cfg(test)]
mod tests {
    use understudy_wire::StationId;

    use super::*;

    const ROBOT: Member = Member::Station(StationId(0));
    const PRESS: Member = Member::Station(StationId(1));

    fn receives(lost: &[Member], impaired: &[Member]) -> HostEvent {
        let (lost, impaired) = (lost.to_vec(), impaired.to_vec());
        HostEvent::NetworkReception { network: Via::Second, lost, impaired }
    }

    fn link(network: Via, failure: Option<&str>) -> HostEvent {
        let (network, silence_ms, peer) = (Some(network), 0, None);
        match failure {
            Some(reason) => {
                HostEvent::LinkFailed { network, silence_ms, peer, reason: reason.to_owned() }
            }
            None => HostEvent::LinkReopened { network, silence_ms, peer },
        }
    }

    #[test]
    fn a_fault_of_a_network_is_one_however_many_members_tell_of_it() {
        let mut networks = Networks::default();
        networks.note(ROBOT, &receives(&[], &[PRESS]), Some(10));
        networks.note(PRESS, &receives(&[ROBOT], &[]), Some(11));
        networks.note(ROBOT, &receives(&[], &[]), Some(20));
        assert_eq!((networks.count, networks.faults[0].to), (1, None), "press tells of it");
        networks.note(PRESS, &receives(&[], &[]), Some(21));
        let fault = networks.faults[0].clone();
        assert_eq!((fault.from, fault.to, fault.is_lost), (Some(10), Some(21), true));
        assert_eq!(fault.members, BTreeSet::from([ROBOT, PRESS]));
        // A process that ends tells of nothing any more.
        networks.note(PRESS, &receives(&[ROBOT], &[]), Some(30));
        networks.is_new(PRESS, Some(35));
        assert_eq!((networks.count, networks.faults[1].to), (2, Some(35)));
    }

    #[test]
    fn a_link_that_is_open_again_ends_no_fault_of_the_other_network() {
        let mut networks = Networks::default();
        networks.note(ROBOT, &link(Via::First, Some("no such device")), None);
        networks.note(ROBOT, &link(Via::Second, Some("down")), Some(3));
        networks.note(ROBOT, &link(Via::Second, None), Some(4));
        let ends: Vec<Option<u64>> = networks.faults.iter().map(|fault| fault.to).collect();
        assert_eq!(ends, [None, Some(4)]);
        networks.note(ROBOT, &link(Via::First, None), Some(5));
        assert_eq!(networks.faults[0].to, Some(5));
    }
}
