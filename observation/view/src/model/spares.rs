//! Spares that report to the members of this cluster.
//!
//! A spare reports to a few remote I/Os. It is received where one of them that reports itself receives it: what a silent member
//! recorded last is the past.

use std::collections::{BTreeMap, BTreeSet};

use understudy_bus::HostEvent;
use understudy_wire::{Member, StationId};

use super::{Model, Standing};
use crate::snapshot::SpareSnapshot;

/// Alarm of a spare that reports to no member any more.
const SPARE_LOST: &str = "spare-lost";

/// What a member says of a spare.
#[derive(Debug, Clone, PartialEq, Eq)]
enum Report {
    /// It receives its reports.
    Received {
        serves: Option<String>,
        /// When that was new, on the clock of that member.
        since_ns: u64,
    },
    /// It does not receive them any more.
    Lost,
}

/// What is known of the spares.
#[derive(Debug, Clone, Default)]
pub(super) struct Spares {
    /// By spare: what each member says of it.
    reports: BTreeMap<String, BTreeMap<Member, Report>>,
    /// When a member has flagged a slot last, on its clock.
    flagged: BTreeMap<(Member, StationId), u64>,
}

impl Model {
    pub(super) fn spare_reported(
        &mut self,
        member: Member,
        (cycle, at_ns): (i64, u64),
        event: &HostEvent,
    ) {
        let (spare, report) = match event {
            HostEvent::SpareReceived { spare, serves } => {
                (spare, Report::Received { serves: serves.clone(), since_ns: at_ns })
            }
            HostEvent::SpareLost { spare } => (spare, Report::Lost),
            // A new process knows of no spare yet.
            HostEvent::Ready { .. } => {
                self.spares.reports.values_mut().for_each(|reports| {
                    reports.remove(&member);
                });
                return;
            }
            _ => return,
        };
        let reports = self.spares.reports.entry(spare.clone()).or_default();
        reports.insert(member, report);
        let is_lost = reports.values().all(|report| *report == Report::Lost);
        let subject = (spare.clone(), SPARE_LOST);
        if is_lost {
            let text = format!("{spare} has not reported for 15 s: it may not wake in this group");
            self.alarms.raise(subject, cycle, text);
        } else {
            self.alarms.over(&subject, cycle);
        }
    }

    /// A remote I/O has flagged a station.
    pub(super) fn slot_flagged(&mut self, member: Member, station: StationId, at_ns: u64) {
        if self.cluster.agreement().schedule.spare_slots().contains(station) {
            self.spares.flagged.insert((member, station), at_ns);
        }
    }

    /// The spares that have reported, as the members know it that report themselves.
    pub(crate) fn spares_in(&self, standing: &Standing) -> Vec<SpareSnapshot> {
        let spares = self.spares.reports.iter();
        spares
            .map(|(name, reports)| {
                let present = reports.iter().filter(|(member, _)| standing.reports(**member));
                let received = present.filter_map(|(member, report)| match report {
                    Report::Received { serves, since_ns } => Some((serves, *member, *since_ns)),
                    Report::Lost => None,
                });
                // Of several members the one that knows of a group has the newer report, or will have it within seconds.
                let received: Vec<_> = received.collect();
                let newest = received.iter().map(|(serves, ..)| *serves).max();
                let told = received.iter().filter(|(serves, ..)| Some(*serves) == newest);
                // Members have clocks of their own: each one compares what it has recorded itself.
                let flagged = told.flat_map(|&(_, member, since_ns)| {
                    let flagged = self.spares.flagged.iter();
                    let later =
                        flagged.filter(move |((by, _), at)| *by == member && **at > since_ns);
                    later.map(|((_, slot), _)| {
                        self.members().name(Member::Station(*slot)).to_owned()
                    })
                });
                let flagged_slots: BTreeSet<String> = flagged.collect();
                SpareSnapshot {
                    name: name.clone(),
                    received: newest.is_some(),
                    serves: newest.cloned().flatten(),
                    flagged_slots: flagged_slots.into_iter().collect(),
                }
            })
            .collect()
    }
}
