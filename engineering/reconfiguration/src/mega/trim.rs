//! Trimming, step 7: Φ is revised so that no string leads to where nothing leads back from.
//!
//! A state that only the operator's release leaves is *dangling*. An event that leads from another state to one is
//! prevented where module 2 commands the outputs and other outputs can do it: they keep back everything that was kept
//! back, and let everything else happen that was let. So no state becomes dangling by it, and a second trimming finds
//! nothing more.
//!
//! Failures and repairs of channels cannot be prevented, and where module 2 is transparent the outputs are those of the
//! ladder.

use std::collections::BTreeSet;

use super::{Label, MegaController, MegaState, Question, happenings, is_unseen};
use crate::command::Posed;
use crate::controller::{Controller, Move, reach};
use crate::relation::Relation;
use crate::settle::{Command, Ground};
use crate::signals::{Bits, Event};

/// The transitions that lead from a state that is not dangling to one that is, each with its source.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Trimming {
    /// Events that the revised commands prevent.
    pub prevented: Vec<(usize, Vec<Event>)>,
    /// Events that outputs can prevent, but not without letting another one happen that must not, or stopping another
    /// one.
    pub kept: Vec<(usize, Vec<Event>)>,
    /// Events that the commands prevented before.
    pub stopped: Vec<(usize, Vec<Event>)>,
    /// What no output prevents: failures, repairs, ω, events that are uncontrollable where they happen, and those of
    /// the ladder's own outputs.
    pub unavoidable: Vec<(usize, Label)>,
    /// The revised commands, with their states.
    pub commands: Vec<(usize, Command)>,
    programs: usize,
}

/// How many states can be reached from the initial one.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Reached {
    /// All of them.
    pub states: usize,
    /// Those that only the operator's release leaves.
    pub dangling: usize,
}

impl MegaController {
    /// Looks at every transition from a state that stays to one that does not, and looks for commands that prevent it.
    pub fn trim(
        &self,
        controller: &Controller,
        relation: &Relation,
        question: &Question,
    ) -> Trimming {
        let mut ground = Ground::new(controller, relation, &question.objective);
        let mut trimming = Trimming::default();
        for place in (0..self.states.len()).filter(|&place| !self.dangling[place]) {
            let mut candidates = Vec::new();
            for (label, _) in self.edges[place].iter().filter(|(_, to)| self.dangling[*to]) {
                match label {
                    Label::Seen(events)
                        if !self.lets(controller, relation, question, place, label) =>
                    {
                        trimming.stopped.push((place, events.clone()));
                    }
                    Label::Seen(events)
                        if can_prevent(
                            controller,
                            relation,
                            question,
                            &self.states[place],
                            events,
                        ) =>
                    {
                        candidates.push(events.clone());
                    }
                    _ => trimming.unavoidable.push((place, label.clone())),
                }
            }
            if candidates.is_empty() {
                continue;
            }
            let mut command = self.revised(&mut ground, question, place, &candidates);
            let mut prevented = candidates.clone();
            if command.is_none() {
                prevented.clear();
                for events in &candidates {
                    prevented.push(events.clone());
                    match self.revised(&mut ground, question, place, &prevented) {
                        Some(better) => command = Some(better),
                        None => {
                            prevented.pop();
                        }
                    }
                }
            }
            trimming.commands.extend(command.map(|command| (place, command)));
            for events in candidates {
                let is_prevented = prevented.contains(&events);
                let list = match is_prevented {
                    true => &mut trimming.prevented,
                    false => &mut trimming.kept,
                };
                list.push((place, events));
            }
        }
        trimming.programs = ground.program_count();
        trimming
    }

    /// Puts the revised commands into force.
    pub fn apply(&mut self, trimming: &Trimming) {
        for (place, command) in &trimming.commands {
            self.states[*place].command = Some(command.clone());
        }
        self.programs += trimming.programs;
    }

    /// The states that can be reached from the initial one under the outputs in force.
    pub fn reached(
        &self,
        controller: &Controller,
        relation: &Relation,
        question: &Question,
    ) -> Reached {
        let forward: Vec<Vec<usize>> = self
            .edges
            .iter()
            .enumerate()
            .map(|(source, edges)| {
                let open = edges
                    .iter()
                    .filter(|(label, _)| self.lets(controller, relation, question, source, label));
                open.map(|(_, target)| *target).collect()
            })
            .collect();
        let reached = reach(&forward, self.entries.values().copied().chain([0]));
        let both = reached.iter().zip(&self.dangling).filter(|(reached, _)| **reached);
        Reached {
            states: both.clone().count(),
            dangling: both.filter(|(_, dangling)| **dangling).count(),
        }
    }

    /// A command of this state that prevents `cut` as well, and changes nothing else that leads somewhere.
    fn revised(
        &self,
        ground: &mut Ground<'_>,
        question: &Question,
        place: usize,
        cut: &[Vec<Event>],
    ) -> Option<Command> {
        let (controller, relation) = (ground.controller, ground.relation);
        let state = &self.states[place];
        let old = state.command.as_ref()?;
        let mut trimmed = BTreeSet::new();
        for events in cut {
            for (member, _) in happenings(controller, question, state, events) {
                trimmed.extend(events.iter().map(|&event| (member as u32, event)));
            }
        }
        let mut blocked = state.blocked(ground, question);
        blocked.extend(&trimmed);
        let posed = ground.posed(&state.members, &blocked).into_iter();
        let (mut given_up, kept): (Vec<Posed>, Vec<Posed>) =
            posed.partition(|posed| posed.demand.enable && !posed.demand.is_met(&old.outputs));
        let outputs = ground.answer(&state.members, kept).ok()?;
        given_up.retain(|posed| !posed.demand.is_met(&outputs));
        let lets = |outputs: &Bits, member: usize, step: &Move| {
            step.events.iter().all(|&event| relation.allows(member, event, outputs))
        };
        for &member in &state.members {
            for step in controller.moves(member as usize) {
                let was_let = lets(&old.outputs, member as usize, step);
                let is_let = lets(&outputs, member as usize, step);
                let seen = step.events.iter().copied();
                let seen: Vec<Event> =
                    seen.filter(|&event| !is_unseen(question, state.failed, event)).collect();
                let leads_off = self
                    .follow(place, &Label::Seen(seen.clone()))
                    .is_some_and(|target| self.dangling[target]);
                let is_right = match (cut.contains(&seen), was_let) {
                    (true, _) => !is_let,
                    (false, true) => is_let,
                    (false, false) => !is_let || !leads_off,
                };
                if !is_right {
                    return None;
                }
            }
        }
        let mut command = ground.judged(&state.members, outputs, given_up);
        command.trimmed = trimmed;
        Some(command)
    }
}

/// Whether outputs can keep `events` from happening in every member in which they happen.
fn can_prevent(
    controller: &Controller,
    relation: &Relation,
    question: &Question,
    state: &MegaState,
    events: &[Event],
) -> bool {
    state.command.is_some()
        && !events.is_empty()
        && happenings(controller, question, state, events)
            .all(|(member, _)| events.iter().all(|&event| !relation.rows(member, event).is_empty()))
}
