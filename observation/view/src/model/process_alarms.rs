//! Alarms on signals, from the records.

use understudy_journal::{AlarmChange, AlarmTransition, Record, Shelving};

use super::Model;
use crate::alarm::PROCESS;
use crate::describe::alarm_event;
use crate::event::{Event, Level};
use crate::process_alarm::Shelved;

impl Model {
    /// Evaluates the alarms on signals with a record of a cycle.
    pub(super) fn fold_process_alarms(&mut self, record: &Record, cycle: i64) {
        if self.cycles.is_fixed() {
            // Their states follow from values, which are not known of before.
            return;
        }
        let changes = self.process_alarms.fold.take(record, cycle);
        self.process_alarms_changed(&record.name, cycle, &changes);
    }

    pub(super) fn process_alarms_changed(
        &mut self,
        name: &str,
        cycle: i64,
        changes: &[AlarmChange],
    ) {
        for change in changes {
            self.process_alarms.changed(change, cycle);
            let declared = self.process_alarms.declared.get(change.alarm).cloned();
            let (Some(declared), Some(transition)) = (declared, change.transition) else {
                continue;
            };
            match transition {
                AlarmTransition::Raised { since_before } => {
                    self.alarms.raise_process(&declared, cycle, since_before);
                }
                AlarmTransition::Over => {
                    self.alarms.over(&(declared.name.clone(), PROCESS), cycle);
                }
            }
            let (event, level, text) = alarm_event(&declared, transition);
            let is_shelved = self.process_alarms.is_shelved(change.alarm, cycle);
            self.tell(Event {
                number: 0,
                at: None,
                cycle,
                at_ns: self.at_ns,
                name: name.to_owned(),
                event,
                level: if is_shelved { Level::Notice } else { level },
                text,
                cause: None,
            });
        }
    }

    pub(super) fn shelved(&mut self, shelving: &Shelving, cycle: i64) {
        let period_ns = self.cluster.agreement().schedule.period().as_nanos();
        let cycles = (u128::from(shelving.seconds) * 1_000_000_000).div_ceil(period_ns.max(1));
        let shelved = Shelved {
            until: cycle.saturating_add(i64::try_from(cycles).unwrap_or(i64::MAX)),
            until_at: None,
            owner: shelving.owner.clone(),
            reason: shelving.reason.clone(),
        };
        self.process_alarms.shelve(&shelving.name, Some(shelved), cycle);
    }
}
