//! Events in the order of their records: everything but the records of every cycle.

use std::collections::VecDeque;

use schemars::JsonSchema;
use serde::Serialize;
use understudy_journal::TimeOfDay;

/// Severity of an event.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Level {
    /// Normal operation.
    Info,
    /// A change.
    Notice,
    /// A degradation.
    Warning,
    /// Requires action by the operator.
    Alarm,
}

impl Level {
    /// The level in one word.
    pub fn word(self) -> &'static str {
        match self {
            Self::Info => "info",
            Self::Notice => "notice",
            Self::Warning => "warning",
            Self::Alarm => "alarm",
        }
    }
}

/// One event.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, JsonSchema)]
pub struct Event {
    /// Number of the event in the run, from 1.
    pub number: u64,
    /// From the origin of the run.
    pub cycle: i64,
    /// Time of its record.
    pub at_ns: u64,
    /// Time of day of its record; nothing where no wall clock was recorded, as in a simulated run.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub at: Option<TimeOfDay>,
    /// The member that reports it.
    pub name: String,
    /// Kind of event, such as `flagged`.
    pub event: &'static str,
    /// Its severity.
    pub level: Level,
    /// The event in words.
    pub text: String,
    /// Its cause, where it is known.
    pub cause: Option<String>,
}

/// The newest events.
#[derive(Debug, Clone)]
pub(crate) struct Events {
    kept: VecDeque<Event>,
    most: usize,
    count: u64,
}

impl Events {
    pub(crate) fn new(most: usize) -> Self {
        Self { kept: VecDeque::new(), most: most.max(1), count: 0 }
    }

    /// Takes an event, and numbers it.
    pub(crate) fn push(&mut self, mut event: Event) {
        self.count += 1;
        event.number = self.count;
        if self.kept.len() == self.most {
            self.kept.pop_front();
        }
        self.kept.push_back(event);
    }

    /// Forgets all.
    pub(crate) fn clear(&mut self) {
        *self = Self::new(self.most);
    }

    pub(crate) fn shift(&mut self, by: i64) {
        self.kept.iter_mut().for_each(|event| event.cycle = event.cycle.saturating_add(by));
    }

    pub(crate) fn count(&self) -> u64 {
        self.count
    }

    pub(crate) fn iter(&self) -> impl DoubleEndedIterator<Item = &Event> {
        self.kept.iter()
    }
}
