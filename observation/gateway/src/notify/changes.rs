//! What has happened to the alarms since they were looked at last.

use std::collections::{BTreeMap, BTreeSet};

use serde::Serialize;
use understudy_text::words;
use understudy_view::{Alarm, AlarmState, ProcessAlarm};

words! {
    /// What has happened to an alarm.
    pub enum Change by word {
        /// It was raised, or lasts when the gateway begins.
        Raised = "raised",
        /// An operator has acknowledged it.
        Acknowledged = "acknowledged",
        /// What it is about is over.
        Returned = "returned",
    }
}

/// A change of an alarm, as the command gets it.
#[derive(Debug, Clone, Serialize)]
pub struct Notification {
    /// What has happened.
    pub event: Change,
    /// Name of the cluster.
    pub cluster: String,
    /// The alarm.
    pub alarm: Alarm,
    /// Notifications before this one that were not delivered.
    pub undelivered: u64,
}

/// What is known of an alarm that was looked at.
#[derive(Debug, Clone, Copy, Default)]
struct Known {
    acknowledged: bool,
    over: bool,
}

/// The alarms as they were looked at last.
#[derive(Debug)]
pub(super) struct Changes {
    cluster: String,
    known: BTreeMap<u64, Known>,
    /// Number of the newest alarm that was looked at: those up to it that are over and acknowledged are not told.
    newest: u64,
}

impl Changes {
    pub(super) fn new(cluster: &str) -> Self {
        Self { cluster: cluster.to_owned(), known: BTreeMap::new(), newest: u64::MAX }
    }

    /// The changes since the last call, in the order of the alarms. A shelved alarm has no changes until its shelving ends.
    pub(super) fn since(
        &mut self,
        alarms: &[Alarm],
        process: &[ProcessAlarm],
    ) -> Vec<Notification> {
        let shelved = process.iter().filter(|alarm| alarm.state == AlarmState::Shelved);
        let shelved: BTreeSet<&str> = shelved.map(|alarm| alarm.name.as_str()).collect();
        let is_shelved =
            |alarm: &Alarm| alarm.alarm == "process" && shelved.contains(alarm.name.as_str());
        let mut changes = Vec::new();
        for alarm in alarms.iter().filter(|alarm| !is_shelved(alarm)) {
            let now =
                Known { acknowledged: alarm.acknowledged_by.is_some(), over: alarm.over.is_some() };
            let before = self.known.insert(alarm.number, now);
            if before.is_none() && alarm.number <= self.newest && !alarm.is_open() {
                continue;
            }
            let was = before.unwrap_or_default();
            // The list of programs of one cause has grown: the cause lasts.
            let goes_on = || {
                let mut later = alarms.iter().filter(|later| later.number > alarm.number);
                later.any(|later| {
                    (&later.name, later.alarm) == (&alarm.name, alarm.alarm)
                        && Some(later.cycle) == alarm.over
                })
            };
            let found = [
                (Change::Raised, before.is_none()),
                (Change::Acknowledged, now.acknowledged && !was.acknowledged),
                (Change::Returned, now.over && !was.over && !goes_on()),
            ];
            let found = found.into_iter().filter(|(_, is_new)| *is_new);
            changes.extend(found.map(|(event, _)| Notification {
                event,
                cluster: self.cluster.clone(),
                alarm: alarm.clone(),
                undelivered: 0,
            }));
        }
        self.newest = alarms.last().map_or(0, |alarm| alarm.number);
        let kept: BTreeSet<u64> = alarms.iter().map(|alarm| alarm.number).collect();
        self.known.retain(|number, _| kept.contains(number));
        changes
    }
}

#[cfg(test)]
mod tests;
