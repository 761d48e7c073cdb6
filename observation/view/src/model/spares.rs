//! Spares that report to the members of this cluster.
//!
//! A spare reports to a few remote I/Os. It is received where one of them that reports itself receives it: what a silent member
//! recorded last is the past.

use std::collections::BTreeMap;

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
        /// The cycle in which that was new.
        since: i64,
    },
    /// It does not receive them any more.
    Lost,
}

/// What is known of the spares.
#[derive(Debug, Clone, Default)]
pub(super) struct Spares {
    /// By spare: what each member says of it.
    reports: BTreeMap<String, BTreeMap<Member, Report>>,
    /// The cycle in which a slot was flagged last.
    flagged: BTreeMap<StationId, i64>,
}

impl Model {
    pub(super) fn spare_reported(&mut self, member: Member, cycle: i64, event: &HostEvent) {
        let (spare, report) = match event {
            HostEvent::SpareReceived { spare, serves } => {
                (spare, Report::Received { serves: serves.clone(), since: cycle })
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
    pub(super) fn slot_flagged(&mut self, station: StationId, cycle: i64) {
        if self.cluster.agreement().schedule.spare_slots().contains(station) {
            self.spares.flagged.insert(station, cycle);
        }
    }

    /// The spares that have reported, as the members know it that report themselves.
    pub(crate) fn spares_in(&self, standing: &Standing) -> Vec<SpareSnapshot> {
        let spares = self.spares.reports.iter();
        spares
            .map(|(name, reports)| {
                let present = reports.iter().filter(|(member, _)| standing.reports(**member));
                let received = present.filter_map(|(_, report)| match report {
                    Report::Received { serves, since } => Some((serves.clone(), *since)),
                    Report::Lost => None,
                });
                // Of several members the one that knows of a group has the newer report, or will have it within seconds.
                let received = received.max_by(|one, other| one.0.cmp(&other.0));
                SpareSnapshot {
                    name: name.clone(),
                    received: received.is_some(),
                    flagged_slots: received.as_ref().map_or_else(Vec::new, |(_, since)| {
                        let flagged = self.spares.flagged.iter().filter(|(_, at)| *at > since);
                        flagged
                            .map(|(slot, _)| self.members.name(Member::Station(*slot)).to_owned())
                            .collect()
                    }),
                    serves: received.and_then(|(serves, _)| serves),
                }
            })
            .collect()
    }
}
