//! Alarms on signals, cycle by cycle: whether each is active, and by whom it is shelved.

use std::collections::{BTreeMap, VecDeque};
use std::sync::Arc;

use schemars::JsonSchema;
use serde::Serialize;
use understudy_cluster::{AlarmDeclaration, Priority};
use understudy_journal::{AlarmChange, AlarmFold, TimeOfDay};

use crate::alarm::{Alarm, AlarmState, PROCESS};

/// Changes that are kept of each alarm; before the oldest one its state is unknown.
const MOST_CHANGES: usize = 1000;

/// An alarm of the cluster file in one cycle.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, JsonSchema)]
pub struct ProcessAlarm {
    /// Its name.
    pub name: String,
    /// The controller of its signal.
    pub program: String,
    /// The input or output of the program.
    pub signal: String,
    /// Its priority.
    pub priority: Priority,
    /// What is wrong while it is active.
    pub text: String,
    /// What the operator should do.
    pub action: Option<String>,
    /// Its state.
    pub state: AlarmState,
    /// Whether it is active; nothing while that is unknown.
    pub active: Option<bool>,
    /// The newest time that it was raised, also one that is over.
    pub newest: Option<Alarm>,
    /// Until when and by whom it is shelved.
    pub shelved: Option<Shelved>,
}

/// A shelved alarm.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, JsonSchema)]
pub struct Shelved {
    /// The first cycle in which it is not shelved any more.
    pub until: i64,
    /// Time of day at which this cycle is due; nothing where no wall clock was recorded.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub until_at: Option<TimeOfDay>,
    /// Name of the person who shelved it.
    pub owner: String,
    /// Reason.
    pub reason: String,
}

/// Values by the cycle from which on they hold, oldest first.
#[derive(Debug, Clone)]
struct Changes<T>(VecDeque<(i64, T)>);

impl<T> Default for Changes<T> {
    fn default() -> Self {
        Self(VecDeque::new())
    }
}

impl<T> Changes<T> {
    fn push(&mut self, cycle: i64, value: T) {
        if self.0.len() == MOST_CHANGES {
            self.0.pop_front();
        }
        self.0.push_back((cycle, value));
    }

    /// The value in a cycle.
    fn at(&self, cycle: i64) -> Option<&T> {
        let mut newest = self.0.iter().rev();
        newest.find(|(at, _)| *at <= cycle).map(|(_, value)| value)
    }

    fn shift(&mut self, by: i64, mut within: impl FnMut(&mut T)) {
        for (cycle, value) in &mut self.0 {
            *cycle = cycle.saturating_add(by);
            within(value);
        }
    }
}

/// The alarms on signals of a run.
#[derive(Debug, Clone)]
pub(crate) struct ProcessAlarms {
    pub(crate) declared: Arc<[AlarmDeclaration]>,
    pub(crate) fold: AlarmFold,
    active: Vec<Changes<Option<bool>>>,
    shelved: Vec<Changes<Option<Shelved>>>,
}

impl ProcessAlarms {
    pub(crate) fn new(declared: &Arc<[AlarmDeclaration]>, programs: usize) -> Self {
        Self {
            declared: Arc::clone(declared),
            fold: AlarmFold::new(Arc::clone(declared), programs),
            active: vec![Changes::default(); declared.len()],
            shelved: vec![Changes::default(); declared.len()],
        }
    }

    pub(crate) fn shift(&mut self, by: i64) {
        self.fold.shift(by);
        for changes in &mut self.active {
            changes.shift(by, |_| {});
        }
        for changes in &mut self.shelved {
            changes.shift(by, |shelved| {
                if let Some(shelved) = shelved {
                    shelved.until = shelved.until.saturating_add(by);
                }
            });
        }
    }

    pub(crate) fn changed(&mut self, change: &AlarmChange, cycle: i64) {
        self.active[change.alarm].push(cycle, change.active);
    }

    /// An alarm is shelved, or shelved no more; one that the cluster does not have is ignored.
    pub(crate) fn shelve(&mut self, name: &str, shelved: Option<Shelved>, cycle: i64) {
        let index = self.declared.iter().position(|alarm| alarm.name == name);
        if let Some(index) = index {
            self.shelved[index].push(cycle, shelved);
        }
    }

    /// Until when an alarm is shelved in a cycle.
    fn shelved_at(&self, index: usize, at: i64, cycle: i64) -> Option<&Shelved> {
        let shelved = self.shelved[index].at(at)?.as_ref();
        shelved.filter(|shelved| cycle < shelved.until)
    }

    /// Whether an alarm is shelved now.
    pub(crate) fn is_shelved(&self, index: usize, cycle: i64) -> bool {
        self.shelved_at(index, i64::MAX, cycle).is_some()
    }

    /// All alarms in `cycle`, with everything that was recorded up to the cycle `until`; `alarms` are those up to then, oldest first.
    pub(crate) fn at(
        &self,
        cycle: i64,
        until: i64,
        alarms: &[Alarm],
        program_name: impl Fn(&AlarmDeclaration) -> String,
    ) -> Vec<ProcessAlarm> {
        let of_signals = alarms.iter().filter(|alarm| alarm.alarm == PROCESS);
        let newest: BTreeMap<&str, &Alarm> =
            of_signals.map(|alarm| (alarm.name.as_str(), alarm)).collect();
        let declared = self.declared.iter().enumerate();
        let shown = declared.map(|(index, alarm)| {
            let active = self.active[index].at(until).copied().flatten();
            let shelved = self.shelved_at(index, until, cycle);
            let newest = newest.get(alarm.name.as_str()).copied();
            let state = match active {
                _ if shelved.is_some() => AlarmState::Shelved,
                None => AlarmState::Unknown,
                // The list of alarms is bounded, and may have forgotten it.
                Some(true) if newest.is_none_or(|alarm| alarm.over.is_some()) => {
                    AlarmState::Unacknowledged
                }
                Some(_) => newest.map_or(AlarmState::Normal, Alarm::state),
            };
            ProcessAlarm {
                name: alarm.name.clone(),
                program: program_name(alarm),
                signal: alarm.point.name.clone(),
                priority: alarm.priority,
                text: alarm.text.clone(),
                action: alarm.action.clone(),
                state,
                active,
                newest: newest.cloned(),
                shelved: shelved.cloned(),
            }
        });
        shown.collect()
    }
}
