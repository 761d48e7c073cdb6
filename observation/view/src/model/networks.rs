//! The networks of a cluster and the direct links of its remote I/Os, as its members receive them.
//!
//! A network is one alarm, however many members report it. Its text says what is left, then who is affected. A member that cannot open its links is
//! one alarm, which lasts until all of its links are open.

use std::collections::{BTreeMap, BTreeSet};

use understudy_wire::{Member, Via};

use super::Model;
use crate::alarm::{Alarm, listed};
use crate::snapshot::NetworkSnapshot;

/// Alarm of a member that cannot open a link.
const LINK_FAILED: &str = "link-failed";

/// Alarm of a network or of the direct links.
const NETWORK_FAULT: &str = "network-fault";

/// By path, the peers of which each member receives nothing over it, and of which it receives less than over another one.
#[derive(Debug, Clone, Default)]
pub(super) struct Networks {
    faults: [BTreeMap<Member, Faults>; Via::ALL.len()],
    /// By member: its links that cannot be opened, each with the path that it is over, and the text.
    links: BTreeMap<Member, BTreeMap<Option<Via>, String>>,
}

#[derive(Debug, Clone, Default)]
struct Faults {
    lost: Vec<Member>,
    impaired: Vec<Member>,
}

impl Model {
    /// A member has told what it receives over a path.
    pub(super) fn network_received(
        &mut self,
        receiver: Member,
        via: Via,
        (lost, impaired): (&[Member], &[Member]),
        cycle: i64,
    ) {
        let faults = &mut self.networks.faults[via.index()];
        if lost.is_empty() && impaired.is_empty() {
            faults.remove(&receiver);
        } else {
            let told = Faults { lost: lost.to_vec(), impaired: impaired.to_vec() };
            faults.insert(receiver, told);
        }
        self.network_changed(via, cycle);
    }

    /// The process of a member begins or ends: what it told of the networks holds no more.
    pub(super) fn network_forgets(&mut self, receiver: Member, cycle: i64) {
        for via in Via::ALL {
            if self.networks.faults[via.index()].remove(&receiver).is_some() {
                self.network_changed(via, cycle);
            }
        }
    }

    /// A member cannot open a link.
    pub(super) fn link_failed(
        &mut self,
        member: Member,
        via: Option<Via>,
        text: String,
        cycle: i64,
    ) {
        self.networks.links.entry(member).or_default().insert(via, text);
        self.links_changed(member, cycle);
    }

    /// A link of a member is open: another one may still have failed.
    pub(super) fn link_reopened(&mut self, member: Member, via: Option<Via>, cycle: i64) {
        if let Some(links) = self.networks.links.get_mut(&member) {
            links.remove(&via);
            self.links_changed(member, cycle);
        }
    }

    /// The process of a member begins or ends: its links are those of the process.
    pub(super) fn links_forgotten(&mut self, member: Member, cycle: i64) {
        if let Some(links) = self.networks.links.get_mut(&member) {
            links.clear();
            self.links_changed(member, cycle);
        }
    }

    fn links_changed(&mut self, member: Member, cycle: i64) {
        let subject = (self.members().name(member).to_owned(), LINK_FAILED);
        let links = self.networks.links.get(&member).into_iter().flatten();
        let texts: Vec<&str> = links.map(|(_, text)| text.as_str()).collect();
        if texts.is_empty() {
            self.networks.links.remove(&member);
            let text = "could not open a link; now all of its links are open".to_owned();
            self.alarms.over_with(&subject, cycle, text);
        } else {
            self.alarms.raise_or_retell(subject, cycle, texts.join("; "));
        }
    }

    /// The networks and the direct links as they were in a cycle; none in a cluster with one network alone.
    pub(crate) fn networks_at(&self, cycle: i64) -> Vec<NetworkSnapshot> {
        let paths: BTreeSet<Via> =
            self.cluster.members().flat_map(|member| self.cluster.paths(member)).collect();
        if paths.len() < 2 {
            return Vec::new();
        }
        let faults = self.alarms.iter().filter(|alarm| alarm.alarm == NETWORK_FAULT);
        let faults: Vec<Alarm> = faults.filter_map(|alarm| alarm.at(cycle)).collect();
        let networks = paths.into_iter().map(|via| {
            let name = via.name();
            let lasts = |alarm: &&Alarm| alarm.name == name && alarm.over.is_none();
            let fault = faults.iter().find(lasts);
            NetworkSnapshot {
                network: via.into(),
                name: name.to_owned(),
                in_order: fault.is_none(),
                text: fault.map_or_else(String::new, |alarm| alarm.text.clone()),
            }
        });
        networks.collect()
    }

    /// The text of the other network may change with this one.
    fn network_changed(&mut self, via: Via, cycle: i64) {
        for via in [via].into_iter().chain(via.other()) {
            let subject = (via.name().to_owned(), NETWORK_FAULT);
            match self.network_text(via) {
                None => {
                    let text = format!("{via} was not in order; now it is");
                    self.alarms.over_with(&subject, cycle, text);
                }
                Some(text) => self.alarms.raise_or_retell(subject, cycle, text),
            }
        }
    }

    /// What is wrong with a network; nothing where it is in order.
    fn network_text(&self, via: Via) -> Option<String> {
        let faults = &self.networks.faults[via.index()];
        let pairs = |of: fn(&Faults) -> &Vec<Member>| {
            let pairs = faults.iter();
            pairs.flat_map(move |(&to, faults)| of(faults).iter().map(move |&from| (from, to)))
        };
        let lost: Vec<(Member, Member)> = pairs(|faults| &faults.lost).collect();
        let impaired = pairs(|faults| &faults.impaired).collect::<Vec<_>>();
        let what = if lost.is_empty() {
            "frames are lost or late"
        } else if impaired.is_empty() {
            "no frames arrive"
        } else {
            "no frames arrive, or some are lost or late"
        };
        let all: Vec<(Member, Member)> = lost.into_iter().chain(impaired).collect();
        let (from, to) = *all.first()?;
        let of_all = |member: Member| all.iter().all(|&(from, to)| from == member || to == member);
        let name = |member| self.members().name(member);
        let whom = if all.len() == 1 {
            format!("from {} to {}", name(from), name(to))
        } else if let Some(member) = [from, to].into_iter().find(|&member| of_all(member)) {
            format!("at {}", name(member))
        } else {
            let affected: BTreeSet<Member> =
                all.iter().flat_map(|&(from, to)| [from, to]).collect();
            let names: Vec<&str> = affected.into_iter().map(name).collect();
            match names.len() == self.members().iter().len() {
                true => "between any members".to_owned(),
                false => format!("between {}", listed(&names)),
            }
        };
        let over = format!("over {via} {what} {whom}");
        let other = via.other().filter(|_| self.cluster.has_two_networks());
        Some(match other {
            Some(other) if self.networks.faults[other.index()].is_empty() => {
                format!("all depends on {other}: {over}")
            }
            Some(_) => format!("neither network is in order: {over}"),
            None => over,
        })
    }
}
