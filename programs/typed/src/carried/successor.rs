//! A program in the place of another one while it runs.

use std::collections::HashMap;

use super::{CarriedState, Names, Renamed, Told, Walk, partners};
use crate::form::Program;
use crate::scan::SCANS;
use crate::types::Elementary;

/// A value of a new program that is one of the old program, by the addresses of both.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Origin {
    /// Address in the state of the old program.
    pub before: u64,
    /// Address in the state of the new program.
    pub now: u64,
    /// How it becomes that of the new program.
    pub taken: Taken,
}

/// How a value of an old program becomes one of a new program.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Taken {
    /// It is stored alike in both.
    Same,
    /// Each value of the first type is the equal one of the second type.
    Wider(Elementary, Elementary),
    /// In another way, in which it can be lost, too.
    Otherwise,
}

/// A program in the place of another one, in an online change: it takes over the values of all variables, and not of the retentive ones alone. A program
/// that a fault has stopped stays stopped.
#[derive(Debug, Clone)]
pub struct Successor {
    old: Program,
    new: Program,
    partners: Vec<Option<usize>>,
    renamed: Vec<Renamed>,
}

impl Successor {
    /// `new` in the place of `old`. Variables of `new` that `old` does not have take over those of other names in `old`, by their own, and paths those
    /// that pairs name.
    pub fn new(
        old: &Program,
        new: &Program,
        others: &HashMap<String, String>,
        renamed: Vec<Renamed>,
    ) -> Self {
        let partners = partners(old, new, others);
        Self { old: old.all_retentive(), new: new.all_retentive(), partners, renamed }
    }

    /// The new program, all of whose variables are retentive.
    pub fn program(&self) -> &Program {
        &self.new
    }

    /// The state with which the new program goes on from a state of the old one.
    ///
    /// # Panics
    /// If `state` is shorter than a state of the old program.
    pub fn state(&self, state: &[u64], told: Told<'_>) -> Vec<u64> {
        self.take(state, told, false).state
    }

    /// The same, with what has become of each path.
    ///
    /// # Panics
    /// As [`Self::state`].
    pub fn carried(&self, state: &[u64], told: Told<'_>) -> CarriedState {
        self.take(state, told, true)
    }

    /// Where the values of the new program come from; those of all others are the initial ones, but for the slots of the header, which are kept.
    pub fn origins(&self) -> Vec<Origin> {
        let state = self.old.initial_state();
        let mut walk = Walk::new(&self.old, &self.new, &state, Told::ALL);
        walk.origins = Some(Vec::new());
        walk.variables(&self.names());
        walk.origins.unwrap_or_default()
    }

    fn names(&self) -> Names<'_> {
        Names { partners: &self.partners, renamed: &self.renamed }
    }

    fn take(&self, state: &[u64], told: Told<'_>, is_listed: bool) -> CarriedState {
        let mut changed = self.new.carried_from(&self.old, state, told, (&self.names(), is_listed));
        changed.state[..SCANS].copy_from_slice(&state[..SCANS]);
        changed
    }
}
