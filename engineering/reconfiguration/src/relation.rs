//! Λ, which outputs an event needs, and Φ from it, section 4.
//!
//! Each row of Λ_e(x) is an "and" over outputs, the rows are joined by "or". An event without rows at x cannot be kept
//! from happening there; so whether an event is controllable depends on the state: *dynamic controllability*.

use std::collections::BTreeMap;
use std::sync::Arc;

use crate::controller::Controller;
use crate::signals::{Bits, Event};

/// Required value of each output; `None` is "don't care", dc.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Row(pub Vec<Option<bool>>);

impl Row {
    /// Whether outputs satisfy it.
    pub fn holds(&self, outputs: &Bits) -> bool {
        let pairs = self.0.iter().zip(&outputs.0);
        pairs.into_iter().all(|(wanted, is)| wanted.is_none_or(|wanted| wanted == *is))
    }

    /// `1 dc 0`, as the paper writes it.
    pub fn text(&self) -> String {
        let words = self.0.iter().map(|entry| match entry {
            None => "dc",
            Some(true) => "1",
            Some(false) => "0",
        });
        words.collect::<Vec<_>>().join(" ")
    }
}

/// Λ over all states.
#[derive(Debug, Clone, Default)]
pub struct Relation {
    tables: Vec<BTreeMap<Event, Arc<[Row]>>>,
}

impl Relation {
    /// Without any row, for a controller of `states` states.
    pub fn new(states: usize) -> Self {
        Self { tables: vec![BTreeMap::new(); states] }
    }

    /// Sets Λ_e(x); no row makes e uncontrollable at x.
    pub fn set(&mut self, state: usize, event: Event, rows: Arc<[Row]>) {
        if rows.is_empty() {
            self.tables[state].remove(&event);
        } else {
            self.tables[state].insert(event, rows);
        }
    }

    /// Λ_e(x).
    pub fn rows(&self, state: usize, event: Event) -> &[Row] {
        self.tables[state].get(&event).map_or(&[], |rows| rows)
    }

    pub(crate) fn shared_rows(&self, state: usize, event: Event) -> Option<&Arc<[Row]>> {
        self.tables[state].get(&event)
    }

    /// The events that are controllable at x, Σ_c(x).
    pub fn controllable(&self, state: usize) -> impl Iterator<Item = Event> + '_ {
        self.tables[state].keys().copied()
    }

    /// Whether `outputs` let the event happen: it is uncontrollable, or one of its rows holds.
    pub fn allows(&self, state: usize, event: Event, outputs: &Bits) -> bool {
        let rows = self.rows(state, event);
        rows.is_empty() || rows.iter().any(|row| row.holds(outputs))
    }
}

/// A value of Φ.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Feedback {
    /// 0.
    Disabled,
    /// 1.
    Enabled,
    /// dc.
    DontCare,
}

impl Feedback {
    /// `0`, `1`, `dc`.
    pub fn text(self) -> &'static str {
        match self {
            Self::Disabled => "0",
            Self::Enabled => "1",
            Self::DontCare => "dc",
        }
    }
}

/// Φ(x, e): 1 where f(x, e) is defined, 0 where each row of Λ_e(x) is violated by Φ'(x, ·), and dc otherwise. The formula of
/// section 4 holds; the prose of its cases 4 and 5 has them the wrong way round.
pub fn feedback(
    controller: &Controller,
    relation: &Relation,
    state: usize,
    event: Event,
) -> Feedback {
    if controller.is_defined(state, event) {
        return Feedback::Enabled;
    }
    let rows = relation.rows(state, event);
    let outputs = &controller.states()[state].outputs;
    if rows.is_empty() || rows.iter().any(|row| row.holds(outputs)) {
        Feedback::DontCare
    } else {
        Feedback::Disabled
    }
}

/// Φ̃(X̄, e) of step 2: 0 where a member has 0, else 1 where one has 1, else dc.
pub fn joint_feedback(members: impl IntoIterator<Item = Feedback>) -> Feedback {
    members.into_iter().min().unwrap_or(Feedback::DontCare)
}
