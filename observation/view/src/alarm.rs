//! Alarms: conditions that an operator has to acknowledge, of members and of signals of the programs.

mod concerns;
mod state;
mod texts;

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::Serialize;
use understudy_cluster::{AlarmDeclaration, Priority};
use understudy_journal::{Acknowledgement, Members, TimeOfDay, TimesOfDay};
use understudy_wire::{Member, ProgramId};

use crate::describe::program_name;
use concerns::Concerns;
pub(crate) use concerns::listed;
pub use state::AlarmState;
use texts::Texts;

/// Alarms that are kept, at most; the oldest that are over and acknowledged go first.
const MOST: usize = 1000;

/// The kind of an alarm on a signal.
pub(crate) const PROCESS: &str = "process";

/// One alarm: a value fault, an exclusion, a dispute, a loss, or an alarm of the cluster file on a signal.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, JsonSchema)]
pub struct Alarm {
    /// Number of the alarm.
    pub number: u64,
    /// The cycle in which it was raised, from the origin of the run.
    pub cycle: i64,
    /// The cycle in which it was over; nothing while it lasts.
    pub over: Option<i64>,
    /// The member that is the cause; the name of an alarm on a signal.
    pub name: String,
    /// Kind of alarm, such as `value-fault`; `process` for an alarm on a signal.
    pub alarm: &'static str,
    /// The programs concerned, in the order of the cluster file; none where only the member is.
    pub programs: Vec<String>,
    /// What is wrong: the effect first, then its cause.
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
    /// Time of day of `cycle`; nothing where no wall clock was recorded, as in a simulated run.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub raised_at: Option<TimeOfDay>,
    /// Time of day of `over`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub over_at: Option<TimeOfDay>,
    /// Time of day of `acknowledged_in`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub acknowledged_at: Option<TimeOfDay>,
    /// The effects of a cause that concerns several programs.
    #[serde(skip)]
    concerns: Concerns,
    /// The texts that it had before, where it was told anew.
    #[serde(skip)]
    texts: Texts,
}

/// Time from the record that raises an alarm to its cycle, past which the record tells when it began.
const PAUSE_NS: u64 = 1_000_000_000;

impl Alarm {
    /// Record of the journal for an acknowledgement by `owner`.
    pub fn acknowledgement(&self, owner: String, at_unix_s: u64) -> Acknowledgement {
        Acknowledgement {
            name: self.name.clone(),
            alarm: self.alarm.to_owned(),
            raised_ns: self.newest_ns(),
            cycle: self.cycle,
            owner,
            at_unix_s,
        }
    }

    /// The alarm as it was in a cycle; nothing where it was raised later.
    pub fn at(&self, cycle: i64) -> Option<Self> {
        let acknowledged = self.acknowledged_in.is_some_and(|at| at <= cycle);
        (self.cycle <= cycle).then(|| {
            let mut then = Self {
                over: self.over.filter(|over| *over <= cycle),
                repeated_in: self.repeated_in.filter(|at| *at <= cycle),
                acknowledged_by: self.acknowledged_by.clone().filter(|_| acknowledged),
                acknowledged_in: self.acknowledged_in.filter(|_| acknowledged),
                concerns: self.concerns.at(cycle),
                ..self.clone()
            };
            then.concerns_changed();
            if let Some(text) = self.texts.at(cycle) {
                text.clone_into(&mut then.text);
            }
            then
        })
    }

    /// With its times of day.
    pub(crate) fn timed(self, times: &TimesOfDay) -> Self {
        let of = |cycle: Option<i64>| times.of_cycle(cycle?);
        // Where all members stood still, the cycle of the alarm came long after the record that raised it.
        let raised_at = of(Some(self.cycle)).map(|of| match self.raised_at {
            Some(then) if of.0.saturating_sub(then.0) > PAUSE_NS => then,
            _ => of,
        });
        Self {
            raised_at,
            over_at: of(self.over),
            acknowledged_at: of(self.acknowledged_in),
            ..self
        }
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

    /// The time of the record that raised it or told of its newest effect: what an acknowledgement has seen.
    fn newest_ns(&self) -> u64 {
        self.concerns.newest_ns().unwrap_or(self.raised_ns)
    }

    fn tell(&mut self, cycle: i64, text: String) {
        if self.text != text {
            self.texts.tell((self.cycle, &self.text), cycle, &text);
            self.text = text;
        }
    }

    fn concerns_changed(&mut self) {
        if !self.concerns.is_empty() {
            self.programs = self.concerns.programs();
            self.text = self.concerns.text(effect(self.alarm));
        }
    }
}

/// Alarm of a station without which programs are not protected.
pub(crate) const UNPROTECTED: &str = "unprotected";

/// Alarm of a program whose state is lost.
pub(crate) const STATE_LOST: &str = "state-lost";

/// Alarm of stations whose outputs or states are wrong.
pub(crate) const VALUE_FAULT: &str = "value-fault";

/// The effect on a program, of an alarm whose cause may concern several.
fn effect(alarm: &str) -> &'static str {
    if alarm == UNPROTECTED { "not protected" } else { "value fault" }
}

/// What an alarm is about, so that its end finds it.
pub(crate) type Subject = (String, &'static str);

#[derive(Debug, Clone, Default)]
pub(crate) struct Alarms {
    /// Names of the programs.
    programs: Vec<String>,
    /// The program of each remote I/O and plant.
    of_member: BTreeMap<String, ProgramId>,
    alarms: BTreeMap<u64, Alarm>,
    lasting: BTreeMap<Subject, u64>,
    count: u64,
    /// The time of the record that is taken.
    pub(crate) now_ns: u64,
    /// Its time of day, where its clock is known.
    pub(crate) now: Option<TimeOfDay>,
    /// Alarms of cycles up to this one may have been raised before: the journal was not read from its first record.
    pub(crate) found_until: Option<i64>,
}

impl Alarms {
    /// The alarms of a run before its first record.
    pub(crate) fn new(members: &Members, programs: usize) -> Self {
        let ids = (0..).map(ProgramId).take(programs);
        let of_member = ids.clone().flat_map(|program| {
            let own = [Member::RemoteIo(program), Member::Plant(program), Member::Twin(program)];
            own.map(|member| (members.name(member).to_owned(), program))
        });
        Self {
            of_member: of_member.collect(),
            programs: ids.map(|program| program_name(program, members).to_owned()).collect(),
            ..Self::default()
        }
    }

    /// Raises an alarm that lasts; one that lasts already is not raised again.
    pub(crate) fn raise(&mut self, subject: Subject, cycle: i64, text: String) {
        self.raise_alarm(subject, cycle, text, |_| {});
    }

    /// Raises an alarm that lasts; of one that lasts already the text is replaced.
    pub(crate) fn raise_or_retell(&mut self, subject: Subject, cycle: i64, text: String) {
        let lasting = self.lasting.get(&subject).and_then(|number| self.alarms.get_mut(number));
        match lasting {
            Some(alarm) => alarm.tell(cycle, text),
            None => self.raise(subject, cycle, text),
        }
    }

    /// What it was about is over, and what is told of it is the past.
    pub(crate) fn over_with(&mut self, subject: &Subject, cycle: i64, text: String) {
        let lasting = self.lasting.get(subject).and_then(|number| self.alarms.get_mut(number));
        if let Some(alarm) = lasting {
            alarm.tell(cycle, text);
        }
        self.over(subject, cycle);
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
        let program = self.programs.get(declared.program.index()).cloned().into_iter().collect();
        let mut before = self.alarms.values_mut().rev();
        if let Some(alarm) = before.find(|alarm| alarm.is_of(&subject))
            && alarm.acknowledged_by.is_none()
        {
            alarm.repeated_in = Some(cycle);
        }
        self.raise_alarm(subject, cycle, declared.text.clone(), |alarm| {
            alarm.since_before |= since_before;
            alarm.priority = Some(declared.priority);
            alarm.programs = program;
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
        let program = self.of_member.get(&subject.0);
        let program = program.and_then(|program| self.programs.get(program.index()));
        let mut alarm = Alarm {
            number: self.count,
            cycle,
            over: None,
            name: subject.0.clone(),
            alarm: subject.1,
            programs: program.cloned().into_iter().collect(),
            text,
            raised_ns: self.now_ns,
            acknowledged_by: None,
            acknowledged_in: None,
            since_before: self.found_until.is_some_and(|until| cycle <= until),
            repeated_in: None,
            priority: None,
            action: None,
            raised_at: self.now,
            over_at: None,
            acknowledged_at: None,
            concerns: Concerns::default(),
            texts: Texts::default(),
        };
        complete(&mut alarm);
        self.alarms.insert(self.count, alarm);
        self.lasting.insert(subject, self.count);
    }

    /// A cause has an effect on a program, or is the failure of its member itself. One cause is one alarm: of one that lasts the list grows, and
    /// the longer list asks for an acknowledgement again.
    pub(crate) fn concerns(
        &mut self,
        subject: &Subject,
        program: Option<ProgramId>,
        cycle: i64,
        cause: String,
    ) {
        let lasting = self.lasting.get(subject).copied();
        let lasting = lasting.and_then(|lasting| self.alarms.get_mut(&lasting));
        let mut concerns = Concerns::of(self.programs.len());
        if let Some(alarm) = lasting {
            if alarm.acknowledged_by.is_none() || alarm.concerns.has(program) {
                concerns = std::mem::take(&mut alarm.concerns);
            } else {
                concerns = alarm.concerns.lasting();
                self.over(subject, cycle);
            }
        }
        let name = program.and_then(|program| self.programs.get(program.index()));
        let name = name.cloned().unwrap_or_default();
        concerns.begin(program, name, (cycle, self.now_ns), cause);
        self.raise_alarm(subject.clone(), cycle, String::new(), |_| {});
        self.concerns_are(subject, concerns);
    }

    fn concerns_are(&mut self, subject: &Subject, concerns: Concerns) {
        let lasting = self.lasting.get(subject);
        if let Some(alarm) = lasting.and_then(|lasting| self.alarms.get_mut(lasting)) {
            alarm.concerns = concerns;
            alarm.concerns_changed();
        }
    }

    /// The causes of this kind that have an effect on a program.
    pub(crate) fn causes_for(&self, alarm: &'static str, program: ProgramId) -> Vec<Subject> {
        let of_program = |number| {
            let alarm = self.alarms.get(number);
            alarm.is_some_and(|alarm| alarm.concerns.has(Some(program)))
        };
        let lasting = self.lasting.iter();
        let lasting = lasting.filter(|(subject, number)| subject.1 == alarm && of_program(number));
        lasting.map(|(subject, _)| subject.clone()).collect()
    }

    /// A cause has no effect on a program any more, or its member has not failed any more. The alarm is over with its last effect.
    pub(crate) fn concerns_no_more(
        &mut self,
        subject: &Subject,
        program: Option<ProgramId>,
        cycle: i64,
    ) {
        let lasting = self.lasting.get(subject).copied();
        let Some(alarm) = lasting.and_then(|lasting| self.alarms.get_mut(&lasting)) else {
            return;
        };
        alarm.concerns.end(program, cycle);
        alarm.concerns_changed();
        if !alarm.concerns.lasts() {
            self.over(subject, cycle);
        }
    }

    /// No cause of this kind has an effect on a program any more.
    pub(crate) fn none_concerns(&mut self, alarm: &'static str, program: ProgramId, cycle: i64) {
        for subject in self.causes_for(alarm, program) {
            self.concerns_no_more(&subject, Some(program), cycle);
        }
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
            alarm.concerns.end_all(cycle);
        }
    }

    /// Whether what it is about is not over yet.
    pub(crate) fn lasts(&self, subject: &Subject) -> bool {
        self.lasting.contains_key(subject)
    }

    /// These alarms of one member are over.
    pub(crate) fn all_over(&mut self, name: &str, alarms: &[&'static str], cycle: i64) {
        for alarm in alarms {
            self.over(&(name.to_owned(), alarm), cycle);
        }
    }

    /// Lasting alarms that one member raised are those of another one from now on, which ends them. Each keeps the name of the member that raised it.
    pub(crate) fn pass_on(&mut self, [from, to]: [&str; 2], alarms: &[&'static str]) {
        for &alarm in alarms {
            if let Some(number) = self.lasting.remove(&(from.to_owned(), alarm)) {
                self.lasting.insert((to.to_owned(), alarm), number);
            }
        }
    }

    pub(crate) fn shift(&mut self, by: i64) {
        for alarm in self.alarms.values_mut() {
            alarm.cycle = alarm.cycle.saturating_add(by);
            alarm.over = alarm.over.map(|over| over.saturating_add(by));
            alarm.concerns.shift(by);
            alarm.texts.shift(by);
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
        let of_name = |alarm: &Alarm| alarm.name == seen.name && alarm.alarm == seen.alarm;
        // Of causes with several effects: the newest alarm that was there, if all of its effects were.
        let seen_then = |alarm: &Alarm| of_name(alarm) && alarm.raised_ns <= seen.raised_ns;
        let of_effects = self.alarms.values().rfind(|alarm| seen_then(alarm));
        let of_effects = of_effects.filter(|alarm| alarm.newest_ns() <= seen.raised_ns);
        let of_effects = of_effects.filter(|alarm| !alarm.concerns.is_empty());
        let of_effects = of_effects.map(|alarm| alarm.number);
        let found = self.alarms.values_mut().filter(|alarm| of_name(alarm));
        let is_meant = |alarm: &Alarm| match of_effects {
            Some(number) => alarm.number == number,
            None => alarm.concerns.is_empty() && is_meant(alarm),
        };
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
mod tests;
