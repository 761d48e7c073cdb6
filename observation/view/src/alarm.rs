//! What somebody has to look at, until he says that he has.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::Serialize;
use understudy_journal::Acknowledgement;

/// Alarms that are kept, at most; the oldest that are over and acknowledged go first.
const MOST: usize = 1000;

/// One alarm: a value fault, an exclusion, a dispute, a loss.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, JsonSchema)]
pub struct Alarm {
    /// Names it.
    pub number: u64,
    /// Since when, from the origin of the run.
    pub cycle: i64,
    /// When it was over; nothing while it lasts.
    pub over: Option<i64>,
    /// Of whom.
    pub name: String,
    /// What, in one word, such as `value-fault`.
    pub alarm: &'static str,
    /// What is wrong.
    pub text: String,
    /// The time of the record that raised it.
    pub raised_ns: u64,
    /// Who has seen it.
    pub acknowledged_by: Option<String>,
    /// In which cycle.
    pub acknowledged_in: Option<i64>,
}

impl Alarm {
    /// What the journal keeps when `owner` has seen it.
    pub fn acknowledgement(&self, owner: String, at_unix_s: u64) -> Acknowledgement {
        Acknowledgement {
            name: self.name.clone(),
            alarm: self.alarm.to_owned(),
            raised_ns: self.raised_ns,
            cycle: self.cycle,
            owner,
            at_unix_s,
        }
    }

    /// Whether it still asks for somebody.
    pub fn is_open(&self) -> bool {
        self.over.is_none() || self.acknowledged_by.is_none()
    }
}

/// What an alarm is about, so that its end finds it.
pub(crate) type Subject = (String, &'static str);

#[derive(Debug, Clone, Default)]
pub(crate) struct Alarms {
    alarms: BTreeMap<u64, Alarm>,
    lasting: BTreeMap<Subject, u64>,
    count: u64,
    /// The time of the record that is taken.
    pub(crate) now_ns: u64,
}

impl Alarms {
    /// Raises an alarm that lasts; one that lasts already is not raised again.
    pub(crate) fn raise(&mut self, subject: Subject, cycle: i64, text: String) {
        if self.lasting.contains_key(&subject) {
            return;
        }
        self.count += 1;
        if self.alarms.len() == MOST {
            let done = self.alarms.values().find(|alarm| !alarm.is_open());
            let oldest = done.or_else(|| self.alarms.values().next());
            if let Some(number) = oldest.map(|alarm| alarm.number) {
                self.alarms.remove(&number);
                self.lasting.retain(|_, lasting| *lasting != number);
            }
        }
        let alarm = Alarm {
            number: self.count,
            cycle,
            over: None,
            name: subject.0.clone(),
            alarm: subject.1,
            text,
            raised_ns: self.now_ns,
            acknowledged_by: None,
            acknowledged_in: None,
        };
        self.alarms.insert(self.count, alarm);
        self.lasting.insert(subject, self.count);
    }

    /// What it was about is over.
    pub(crate) fn over(&mut self, subject: &Subject, cycle: i64) {
        if let Some(lasting) = self.lasting.remove(subject)
            && let Some(alarm) = self.alarms.get_mut(&lasting)
        {
            alarm.over = Some(cycle);
        }
    }

    /// All that is wrong with one member is over.
    pub(crate) fn all_over(&mut self, name: &str, alarms: &[&'static str], cycle: i64) {
        for alarm in alarms {
            self.over(&(name.to_owned(), alarm), cycle);
        }
    }

    pub(crate) fn shift(&mut self, by: i64) {
        for alarm in self.alarms.values_mut() {
            alarm.cycle = alarm.cycle.saturating_add(by);
            alarm.over = alarm.over.map(|over| over.saturating_add(by));
            let seen = &mut alarm.acknowledged_in;
            *seen = seen.map(|seen| seen.saturating_add(by));
        }
    }

    /// Somebody has seen one; one that is not kept any more is passed over.
    pub(crate) fn acknowledged(&mut self, seen: &Acknowledgement, cycle: i64) {
        let found = self.alarms.values_mut().find(|alarm| {
            alarm.raised_ns == seen.raised_ns
                && alarm.name == seen.name
                && alarm.alarm == seen.alarm
        });
        if let Some(alarm) = found
            && alarm.acknowledged_by.is_none()
        {
            alarm.acknowledged_by = Some(seen.owner.clone());
            alarm.acknowledged_in = Some(cycle);
        }
    }

    pub(crate) fn iter(&self) -> impl DoubleEndedIterator<Item = &Alarm> {
        self.alarms.values()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_alarm_lasts_until_it_is_over_and_seen() {
        let mut alarms = Alarms::default();
        let subject = || ("press-io".to_owned(), "fail-safe");
        alarms.raise(subject(), 7, "nothing true".to_owned());
        alarms.raise(subject(), 8, "still".to_owned());
        assert_eq!(alarms.iter().count(), 1);
        alarms.over(&subject(), 9);
        assert!(alarms.iter().all(Alarm::is_open));
        let seen = |alarms: &Alarms, by: &str| {
            let alarm = alarms.iter().next().expect("one");
            alarm.acknowledgement(by.to_owned(), 0)
        };
        let other = Acknowledgement {
            raised_ns: 1,
            ..seen(&alarms, "anna")
        };
        alarms.acknowledged(&other, 10);
        assert!(alarms.iter().all(Alarm::is_open), "another one");
        alarms.acknowledged(&seen(&alarms, "anna"), 10);
        alarms.acknowledged(&seen(&alarms, "bert"), 11);
        alarms.shift(100);
        let first = alarms.iter().next().expect("one");
        assert_eq!(first.acknowledged_by.as_deref(), Some("anna"));
        assert_eq!(first.acknowledged_in, Some(110));
        assert!(!alarms.iter().any(Alarm::is_open));
        alarms.raise(subject(), 12, "again".to_owned());
        assert_eq!(alarms.iter().filter(|alarm| alarm.is_open()).count(), 1);
    }

    #[test]
    fn the_number_of_alarms_is_bounded() {
        let mut alarms = Alarms::default();
        for number in 0..5000 {
            alarms.raise((format!("{number}"), "fail-safe"), number, String::new());
        }
        assert_eq!(alarms.iter().count(), MOST);
        assert_eq!(alarms.lasting.len(), MOST);
    }
}
