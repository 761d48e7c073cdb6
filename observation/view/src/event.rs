//! What happened, in the order in which it was said: everything but the ordinary course of a cycle.

use std::collections::VecDeque;

use schemars::JsonSchema;
use serde::Serialize;

/// How much a person should care.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Level {
    /// The ordinary course of things.
    Info,
    /// Something changed.
    Notice,
    /// Something is worse than it was.
    Warning,
    /// Somebody has to look.
    Alarm,
}

impl Level {
    /// In one word.
    pub fn word(self) -> &'static str {
        match self {
            Self::Info => "info",
            Self::Notice => "notice",
            Self::Warning => "warning",
            Self::Alarm => "alarm",
        }
    }
}

/// One thing that happened.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, JsonSchema)]
pub struct Event {
    /// Counts up from 1 over the whole run.
    pub number: u64,
    /// From the origin of the run.
    pub cycle: i64,
    /// As its record says it.
    pub at_ns: u64,
    /// Who says it.
    pub name: String,
    /// What, in one word, such as `flagged`.
    pub event: &'static str,
    /// How much a person should care.
    pub level: Level,
    /// What happened.
    pub text: String,
    /// Why, where that is known.
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
        Self {
            kept: VecDeque::new(),
            most: most.max(1),
            count: 0,
        }
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

    pub(crate) fn shift(&mut self, by: i64) {
        self.kept
            .iter_mut()
            .for_each(|event| event.cycle = event.cycle.saturating_add(by));
    }

    pub(crate) fn count(&self) -> u64 {
        self.count
    }

    pub(crate) fn iter(&self) -> impl DoubleEndedIterator<Item = &Event> {
        self.kept.iter()
    }
}
