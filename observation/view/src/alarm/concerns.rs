//! What the cause of an alarm has an effect on: one cause is one alarm, however many programs it concerns.
//!
//! ```text
//!   understudy is killed ──► all 24 programs: not protected, because understudy is killed
//! ```
//!
//! Invariant: the text of an alarm names the cause of every program that it concerns, and is independent of the order in which they came.

use std::collections::BTreeMap;

use understudy_wire::ProgramId;

/// Names that a text lists, at most.
const MOST_NAMES: usize = 8;

/// Programs from which on "all" of them says more than their names.
const ALL_FROM: usize = 4;

/// An effect of the cause.
#[derive(Debug, Clone, PartialEq, Eq)]
struct Concern {
    /// The program; empty for the member that is the cause.
    name: String,
    /// Why, in words.
    cause: String,
    since: i64,
    over: Option<i64>,
    /// The time of the record that told of it.
    at_ns: u64,
}

/// The effects of one cause, by program; without a program: the failure of the member itself.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(crate) struct Concerns {
    concerns: BTreeMap<Option<ProgramId>, Concern>,
    /// Number of programs of the cluster.
    programs: usize,
}

impl Concerns {
    pub(super) fn of(programs: usize) -> Self {
        Self { programs, ..Self::default() }
    }

    pub(super) fn is_empty(&self) -> bool {
        self.concerns.is_empty()
    }

    /// Whether a program is concerned now.
    pub(super) fn has(&self, program: Option<ProgramId>) -> bool {
        self.concerns.get(&program).is_some_and(|concern| concern.over.is_none())
    }

    /// Whether any effect lasts.
    pub(super) fn lasts(&self) -> bool {
        self.concerns.values().any(|concern| concern.over.is_none())
    }

    /// The time of the record of the newest effect.
    pub(super) fn newest_ns(&self) -> Option<u64> {
        self.concerns.values().map(|concern| concern.at_ns).max()
    }

    /// The cause has an effect on a program. Of one that it has an effect on already, the words are replaced.
    pub(super) fn begin(
        &mut self,
        program: Option<ProgramId>,
        name: String,
        (cycle, at_ns): (i64, u64),
        cause: String,
    ) {
        let began = Concern { name, cause, since: cycle, over: None, at_ns };
        let known = self.concerns.entry(program).or_insert_with(|| began.clone());
        if known.over.take().is_some() {
            known.at_ns = at_ns;
        }
        known.cause = began.cause;
    }

    /// The cause has no effect on a program any more.
    pub(super) fn end(&mut self, program: Option<ProgramId>, cycle: i64) {
        if let Some(concern) = self.concerns.get_mut(&program) {
            concern.over.get_or_insert(cycle);
        }
    }

    /// Every effect is over.
    pub(super) fn end_all(&mut self, cycle: i64) {
        for concern in self.concerns.values_mut() {
            concern.over.get_or_insert(cycle);
        }
    }

    /// Those that last.
    pub(super) fn lasting(&self) -> Self {
        let mut lasting = self.clone();
        lasting.concerns.retain(|_, concern| concern.over.is_none());
        lasting
    }

    /// As they were in a cycle.
    pub(super) fn at(&self, cycle: i64) -> Self {
        let mut then = self.clone();
        then.concerns.retain(|_, concern| concern.since <= cycle);
        for concern in then.concerns.values_mut() {
            concern.over = concern.over.filter(|over| *over <= cycle);
        }
        then
    }

    pub(super) fn shift(&mut self, by: i64) {
        for concern in self.concerns.values_mut() {
            concern.since = concern.since.saturating_add(by);
            concern.over = concern.over.map(|over| over.saturating_add(by));
        }
    }

    /// Those that last, or all where none does.
    fn shown(&self) -> impl Iterator<Item = (&Option<ProgramId>, &Concern)> {
        let lasts = self.lasts();
        self.concerns.iter().filter(move |(_, concern)| !lasts || concern.over.is_none())
    }

    /// The programs concerned, in the order of the cluster.
    pub(super) fn programs(&self) -> Vec<String> {
        let programs = self.shown().filter(|(program, _)| program.is_some());
        programs.map(|(_, concern)| concern.name.clone()).collect()
    }

    /// The effect on the programs first, then its cause.
    pub(super) fn text(&self, effect: &str) -> String {
        let mut causes: Vec<(&str, Vec<&str>)> = Vec::new();
        let mut of_member = None;
        for (program, concern) in self.shown() {
            let cause = concern.cause.as_str();
            if program.is_none() {
                of_member = Some(cause.to_owned());
            } else if let Some((_, names)) = causes.iter_mut().find(|(known, _)| *known == cause) {
                names.push(&concern.name);
            } else {
                causes.push((cause, vec![&concern.name]));
            }
        }
        let texts = causes.iter().map(|(cause, names)| {
            let names = self.listed(names);
            format!("{names}: {effect}, because {cause}")
        });
        texts.chain(of_member).collect::<Vec<_>>().join("; ")
    }

    fn listed(&self, names: &[&str]) -> String {
        if names.len() == self.programs && names.len() >= ALL_FROM {
            return format!("all {} programs", names.len());
        }
        listed(names)
    }
}

/// Some names, and how many more there are.
pub(crate) fn listed(names: &[&str]) -> String {
    let more = names.len().saturating_sub(MOST_NAMES);
    let listed = names[..names.len() - more].join(", ");
    if more == 0 { listed } else { format!("{listed} and {more} more") }
}
