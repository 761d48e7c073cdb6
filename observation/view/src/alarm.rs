//! Alarms: conditions that an operator has to acknowledge, of members and of signals of the programs.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::Serialize;
use understudy_cluster::{AlarmDeclaration, Priority};
use understudy_journal::Acknowledgement;

/// Alarms that are kept, at most; the oldest that are over and acknowledged go first.
const MOST: usize = 1000;

/// The kind of an alarm on a signal.
pub(crate) const PROCESS: &str = "process";

/// State of an alarm, in the sense of ISA-18.2.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum AlarmState {
    /// Not active, and acknowledged.
    Normal,
    /// Active and not acknowledged.
    Unacknowledged,
    /// Active and acknowledged.
    Acknowledged,
    /// Over and not acknowledged.
    Returned,
    /// Shelved by an operator until a cycle.
    Shelved,
    /// The value of its signal is unknown, or it was not long enough known.
    Unknown,
}

impl AlarmState {
    /// All states.
    pub const ALL: [Self; 6] = [
        Self::Normal,
        Self::Unacknowledged,
        Self::Acknowledged,
        Self::Returned,
        Self::Shelved,
        Self::Unknown,
    ];

    /// The state as JSON and the page write it.
    pub fn word(self) -> &'static str {
        match self {
            Self::Normal => "normal",
            Self::Unacknowledged => "unacknowledged",
            Self::Acknowledged => "acknowledged",
            Self::Returned => "returned",
            Self::Shelved => "shelved",
            Self::Unknown => "unknown",
        }
    }
}

/// One alarm: a value fault, an exclusion, a dispute, a loss, or an alarm of the cluster file on a signal.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, JsonSchema)]
pub struct Alarm {
    /// Number of the alarm.
    pub number: u64,
    /// The cycle in which it was raised, from the origin of the run.
    pub cycle: i64,
    /// The cycle in which it was over; nothing while it lasts.
    pub over: Option<i64>,
    /// The member; the name of an alarm on a signal.
    pub name: String,
    /// Kind of alarm, such as `value-fault`; `process` for an alarm on a signal.
    pub alarm: &'static str,
    /// What is wrong.
    pub text: String,
    /// The time of the record that raised it.
    pub raised_ns: u64,
    /// Name of the person who acknowledged it.
    pub acknowledged_by: Option<String>,
    /// The cycle of the acknowledgement.
    pub acknowledged_in: Option<i64>,
    /// Whether it may have been raised before `cycle`, the first one in which it is known.
    pub since_before: bool,
    /// The cycle in which an alarm on a signal was raised again before it was acknowledged: the newer one counts.
    pub repeated_in: Option<i64>,
    /// Priority of an alarm on a signal, and of an alarm that requires an immediate response.
    pub priority: Option<Priority>,
    /// What the operator should do.
    pub action: Option<String>,
}

impl Alarm {
    /// Record of the journal for an acknowledgement by `owner`.
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

    /// The alarm as it was in a cycle; nothing where it was raised later.
    pub fn at(&self, cycle: i64) -> Option<Self> {
        let acknowledged = self.acknowledged_in.is_some_and(|at| at <= cycle);
        (self.cycle <= cycle).then(|| Self {
            over: self.over.filter(|over| *over <= cycle),
            repeated_in: self.repeated_in.filter(|at| *at <= cycle),
            acknowledged_by: self.acknowledged_by.clone().filter(|_| acknowledged),
            acknowledged_in: self.acknowledged_in.filter(|_| acknowledged),
            ..self.clone()
        })
    }

    /// Whether it lasts or is not acknowledged.
    pub fn is_open(&self) -> bool {
        self.repeated_in.is_none() && self.state() != AlarmState::Normal
    }

    /// Its state by its end and its acknowledgement.
    pub fn state(&self) -> AlarmState {
        match (self.over, &self.acknowledged_by) {
            (None, None) => AlarmState::Unacknowledged,
            (None, Some(_)) => AlarmState::Acknowledged,
            (Some(_), None) => AlarmState::Returned,
            (Some(_), Some(_)) => AlarmState::Normal,
        }
    }

    fn is_of(&self, subject: &Subject) -> bool {
        (&self.name, self.alarm) == (&subject.0, subject.1)
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
    /// Alarms of cycles up to this one may have been raised before: the journal was not read from its first record.
    pub(crate) found_until: Option<i64>,
}

impl Alarms {
    /// Raises an alarm that lasts; one that lasts already is not raised again.
    pub(crate) fn raise(&mut self, subject: Subject, cycle: i64, text: String) {
        self.raise_alarm(subject, cycle, text, |_| {});
    }

    /// Raises an alarm that lasts and requires an immediate response.
    pub(crate) fn raise_critical(&mut self, subject: Subject, cycle: i64, text: String) {
        self.raise_alarm(subject, cycle, text, |alarm| alarm.priority = Some(Priority::Critical));
    }

    /// Raises an alarm of high priority about something that has happened and is over: it stays open until it is acknowledged. The same record may be
    /// read again.
    pub(crate) fn occurred(&mut self, subject: Subject, cycle: i64, text: String) {
        let mut known = self.alarms.values();
        if known.any(|alarm| alarm.is_of(&subject) && alarm.text == text) {
            return;
        }
        self.raise_alarm(subject.clone(), cycle, text, |alarm| {
            alarm.priority = Some(Priority::High)
        });
        self.over(&subject, cycle);
    }

    /// Raises an alarm on a signal; `since_before` where it may have been active before.
    pub(crate) fn raise_process(
        &mut self,
        declared: &AlarmDeclaration,
        cycle: i64,
        since_before: bool,
    ) {
        let subject = (declared.name.clone(), PROCESS);
        let mut before = self.alarms.values_mut().rev();
        if let Some(alarm) = before.find(|alarm| alarm.is_of(&subject))
            && alarm.acknowledged_by.is_none()
        {
            alarm.repeated_in = Some(cycle);
        }
        self.raise_alarm(subject, cycle, declared.text.clone(), |alarm| {
            alarm.since_before |= since_before;
            alarm.priority = Some(declared.priority);
            alarm.action.clone_from(&declared.action);
        });
    }

    fn raise_alarm(
        &mut self,
        subject: Subject,
        cycle: i64,
        text: String,
        complete: impl FnOnce(&mut Alarm),
    ) {
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
        let mut alarm = Alarm {
            number: self.count,
            cycle,
            over: None,
            name: subject.0.clone(),
            alarm: subject.1,
            text,
            raised_ns: self.now_ns,
            acknowledged_by: None,
            acknowledged_in: None,
            since_before: self.found_until.is_some_and(|until| cycle <= until),
            repeated_in: None,
            priority: None,
            action: None,
        };
        complete(&mut alarm);
        self.alarms.insert(self.count, alarm);
        self.lasting.insert(subject, self.count);
    }

    /// Puts an alarm in the place of one that lasts: what it is about has changed. The newer one counts; it is acknowledged if the one before it was
    /// and `asks_again` is false.
    pub(crate) fn replace(&mut self, subject: Subject, cycle: i64, text: String, asks_again: bool) {
        let lasting = self.lasting.get(&subject).copied();
        let before = lasting.and_then(|lasting| self.alarms.get_mut(&lasting)).map(|before| {
            if before.acknowledged_by.is_none() {
                before.repeated_in = Some(cycle);
            }
            before.clone()
        });
        self.over(&subject, cycle);
        self.raise_alarm(subject, cycle, text, |alarm| {
            if let Some(before) = before.filter(|_| !asks_again) {
                alarm.raised_ns = before.raised_ns;
                alarm.acknowledged_by = before.acknowledged_by;
                alarm.acknowledged_in = before.acknowledged_in;
            }
        });
    }

    /// What it was about is over.
    pub(crate) fn over(&mut self, subject: &Subject, cycle: i64) {
        if let Some(lasting) = self.lasting.remove(subject)
            && let Some(alarm) = self.alarms.get_mut(&lasting)
        {
            alarm.over = Some(cycle);
        }
    }

    /// These alarms of one member are over.
    pub(crate) fn all_over(&mut self, name: &str, alarms: &[&'static str], cycle: i64) {
        for alarm in alarms {
            self.over(&(name.to_owned(), alarm), cycle);
        }
    }

    pub(crate) fn shift(&mut self, by: i64) {
        for alarm in self.alarms.values_mut() {
            alarm.cycle = alarm.cycle.saturating_add(by);
            alarm.over = alarm.over.map(|over| over.saturating_add(by));
            for at in [&mut alarm.acknowledged_in, &mut alarm.repeated_in] {
                *at = at.map(|at| at.saturating_add(by));
            }
        }
    }

    /// An alarm was acknowledged; one that is not kept any more is ignored.
    pub(crate) fn acknowledged(&mut self, seen: &Acknowledgement, cycle: i64) {
        // An alarm on a signal is acknowledged with those of the same name before it. A reader that began later knows a later time.
        let is_meant = |alarm: &Alarm| {
            alarm.raised_ns == seen.raised_ns
                || alarm.alarm == PROCESS
                    && (alarm.since_before || alarm.raised_ns < seen.raised_ns)
        };
        let of_name = |alarm: &&mut Alarm| alarm.name == seen.name && alarm.alarm == seen.alarm;
        let found = self.alarms.values_mut().filter(of_name);
        for alarm in found.filter(|alarm| is_meant(alarm) && alarm.acknowledged_by.is_none()) {
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
        alarms.raise(subject(), 7, "no provable output".to_owned());
        alarms.raise(subject(), 8, "still".to_owned());
        assert_eq!(alarms.iter().count(), 1);
        alarms.over(&subject(), 9);
        assert!(alarms.iter().all(Alarm::is_open));
        let seen = |alarms: &Alarms, by: &str| {
            let alarm = alarms.iter().next().expect("one");
            alarm.acknowledgement(by.to_owned(), 0)
        };
        let other = Acknowledgement { raised_ns: 1, ..seen(&alarms, "anna") };
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
    fn an_alarm_that_is_replaced_asks_again_where_something_is_added() {
        for (is_acknowledged, asks_again) in
            [(false, false), (false, true), (true, false), (true, true)]
        {
            let mut alarms = Alarms::default();
            let subject = || ("press-io".to_owned(), "forced");
            alarms.replace(subject(), 3, "one".to_owned(), true);
            if is_acknowledged {
                let seen = alarms.iter().next().expect("one").acknowledgement("anna".to_owned(), 0);
                alarms.acknowledged(&seen, 4);
            }
            alarms.replace(subject(), 5, "other".to_owned(), asks_again);
            let open: Vec<&Alarm> = alarms.iter().filter(|alarm| alarm.is_open()).collect();
            let [open] = open[..] else { panic!("{open:?}") };
            assert_eq!((open.text.as_str(), open.over), ("other", None));
            let acknowledged = is_acknowledged && !asks_again;
            assert_eq!(open.acknowledged_by.is_some(), acknowledged);
        }
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
