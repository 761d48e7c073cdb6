//! Where a combined state comes to rest: its members, and the command that is safe for all of them.
//!
//! While channels are failed, what their events change goes on unseen. An unseen event that no output can prevent makes the
//! set of possible states grow. One that outputs can prevent is prevented instead where a command allows that (*feedback
//! adjustment*): then the set stays small, and the channel's repair finds the plant where it was left.

use std::collections::BTreeSet;

use rustc_hash::FxHashMap;

use crate::command::{Demand, Objective, Posed, Solver, Unsolved};
use crate::controller::{Controller, Move};
use crate::relation::{Feedback, Relation, feedback, joint_feedback};
use crate::signals::{Bits, Event};

/// Outputs that module 2 commands in place of the ladder's own.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Command {
    /// z.
    pub outputs: Bits,
    /// Events that some member's ladder would let happen and the command prevents.
    pub stopped: BTreeSet<Event>,
    /// Events that some member's ladder would let happen and the command lets happen too.
    pub going: BTreeSet<Event>,
    /// Demands to let an event happen that had to be given up, because with them no outputs are safe.
    pub given_up: Vec<Posed>,
    /// Events that trimming prevents, each with its member.
    pub trimmed: BTreeSet<(u32, Event)>,
}

/// No outputs are safe for all states in which the plant may be.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct NoCommand {
    /// The states.
    pub members: Vec<u32>,
    /// The failed channels, as bits over the channels of the question.
    pub failed: u64,
    /// Demands that already contradict each other, none of which can be spared.
    pub conflict: Vec<Posed>,
    /// What the solver says, where it failed.
    pub solver: Option<String>,
}

/// Everything that is asked about one automaton again and again.
pub(crate) struct Ground<'a> {
    pub(crate) controller: &'a Controller,
    pub(crate) relation: &'a Relation,
    feedback: Vec<FxHashMap<Event, Feedback>>,
    objective: &'a Objective,
    solver: Solver,
}

impl<'a> Ground<'a> {
    pub(crate) fn new(
        controller: &'a Controller,
        relation: &'a Relation,
        objective: &'a Objective,
    ) -> Self {
        let table = |state: usize| {
            let defined = controller.moves(state).iter().flat_map(|step| &step.events);
            let events: BTreeSet<Event> =
                defined.copied().chain(relation.controllable(state)).collect();
            let value = |event| (event, feedback(controller, relation, state, event));
            events.into_iter().map(value).collect()
        };
        Self {
            controller,
            relation,
            feedback: (0..controller.states().len()).map(table).collect(),
            objective,
            solver: Solver::default(),
        }
    }

    pub(crate) fn program_count(&self) -> usize {
        self.solver.program_count()
    }

    /// Φ(x, e).
    pub(crate) fn feedback(&self, state: u32, event: Event) -> Feedback {
        let known = self.feedback[state as usize].get(&event);
        known.copied().unwrap_or(Feedback::DontCare)
    }

    fn is_preventable(&self, state: u32, step: &Move) -> bool {
        step.events.iter().all(|&event| !self.relation.rows(state as usize, event).is_empty())
    }

    /// All that `members` reach by moves that `follow` picks, these included.
    pub(crate) fn closure(
        &self,
        members: impl IntoIterator<Item = u32>,
        follow: impl Fn(u32, &Move) -> bool,
    ) -> BTreeSet<u32> {
        let mut found = BTreeSet::new();
        let mut stack: Vec<u32> = members.into_iter().collect();
        while let Some(state) = stack.pop() {
            if found.insert(state) {
                let moves = self.controller.moves(state as usize).iter();
                let followed = moves.filter(|step| follow(state, step));
                stack.extend(followed.map(|step| step.target as u32));
            }
        }
        found
    }

    /// Unseen events, each with its state, that would lead out of `members`.
    pub(crate) fn blocked(
        &self,
        members: &BTreeSet<u32>,
        unseen: &dyn Fn(&Move) -> bool,
    ) -> BTreeSet<(u32, Event)> {
        let mut blocked = BTreeSet::new();
        for &state in members {
            for step in self.controller.moves(state as usize) {
                if unseen(step) && !members.contains(&(step.target as u32)) {
                    blocked.extend(step.events.iter().map(|&event| (state, event)));
                }
            }
        }
        blocked
    }

    /// The set in which the plant may be from now on, and its command; none where the ladder's own outputs are right.
    pub(crate) fn settle(
        &mut self,
        seed: impl IntoIterator<Item = u32>,
        failed: u64,
        unseen: &dyn Fn(&Move) -> bool,
    ) -> Result<(Vec<u32>, Option<Command>), NoCommand> {
        let members =
            self.closure(seed, |state, step| unseen(step) && !self.is_preventable(state, step));
        let blocked = self.blocked(&members, unseen);
        if members.len() == 1 && blocked.is_empty() {
            return Ok((members.into_iter().collect(), None));
        }
        let listed: Vec<u32> = members.iter().copied().collect();
        match self.command(&listed, &blocked, failed) {
            Err(_) if !blocked.is_empty() => {
                let members = self.closure(listed, |_, step| unseen(step));
                let listed: Vec<u32> = members.into_iter().collect();
                let command = self.command(&listed, &BTreeSet::new(), failed)?;
                Ok((listed, Some(command)))
            }
            Err(none) => Err(none),
            Ok(command) => Ok((listed, Some(command))),
        }
    }

    /// What Φ1 and `blocked` ask of the outputs.
    pub(crate) fn posed(&self, members: &[u32], blocked: &BTreeSet<(u32, Event)>) -> Vec<Posed> {
        let controllable =
            members.iter().flat_map(|&state| self.relation.controllable(state as usize));
        let events: BTreeSet<Event> = controllable.collect();
        let mut posed = Vec::new();
        for event in events {
            let joint = joint_feedback(members.iter().map(|&state| self.feedback(state, event)));
            for &state in members {
                let Some(rows) = self.relation.shared_rows(state as usize, event) else {
                    continue;
                };
                let enable = if blocked.contains(&(state, event)) {
                    false
                } else if self.feedback(state, event) == Feedback::DontCare {
                    continue;
                } else {
                    joint == Feedback::Enabled
                };
                let rows = rows.clone();
                posed.push(Posed { state: state as usize, event, demand: Demand { rows, enable } });
            }
        }
        posed
    }

    /// Only what must not happen.
    pub(crate) fn prevented(
        &self,
        members: &[u32],
        blocked: &BTreeSet<(u32, Event)>,
    ) -> Vec<Posed> {
        let mut posed = self.posed(members, blocked);
        posed.retain(|posed| !posed.demand.enable);
        posed
    }

    /// Outputs that do what is posed.
    pub(crate) fn answer(&mut self, members: &[u32], posed: Vec<Posed>) -> Result<Bits, NoCommand> {
        let weights = self.weights(members);
        let solved = self.solver.solve(&posed, &weights);
        solved.map_err(|unsolved| no_command(members, 0, &posed, unsolved))
    }

    /// A command for `members`; where not all may happen that should, as much of it as fits in the order of the events.
    pub(crate) fn command(
        &mut self,
        members: &[u32],
        blocked: &BTreeSet<(u32, Event)>,
        failed: u64,
    ) -> Result<Command, NoCommand> {
        let posed = self.posed(members, blocked);
        let weights = self.weights(members);
        let mut given_up = Vec::new();
        let outputs = match self.solver.solve(&posed, &weights) {
            Ok(outputs) => outputs,
            Err(Unsolved::Conflict(_)) => {
                let (enables, mut kept): (Vec<Posed>, Vec<Posed>) =
                    posed.into_iter().partition(|posed| posed.demand.enable);
                let mut best = self
                    .solver
                    .solve(&kept, &weights)
                    .map_err(|unsolved| no_command(members, failed, &kept, unsolved))?;
                for one in enables {
                    kept.push(one.clone());
                    match self.solver.solve(&kept, &weights) {
                        Ok(outputs) => best = outputs,
                        Err(_) => {
                            kept.pop();
                            given_up.push(one);
                        }
                    }
                }
                best
            }
            Err(unsolved) => return Err(no_command(members, failed, &posed, unsolved)),
        };
        Ok(self.judged(members, outputs, given_up))
    }

    /// These outputs with what they stop and let happen.
    pub(crate) fn judged(&self, members: &[u32], outputs: Bits, given_up: Vec<Posed>) -> Command {
        let mut stopped = BTreeSet::new();
        let mut going = BTreeSet::new();
        for &state in members {
            for event in self.controller.moves(state as usize).iter().flat_map(|step| &step.events)
            {
                if self.relation.allows(state as usize, *event, &outputs) {
                    going.insert(*event);
                } else {
                    stopped.insert(*event);
                }
            }
        }
        Command { outputs, stopped, going, given_up, trimmed: BTreeSet::new() }
    }

    fn weights(&self, members: &[u32]) -> Vec<f64> {
        let outputs = self.controller.signals.outputs.len();
        match self.objective {
            Objective::Fewest => vec![1.0; outputs],
            Objective::Weights(weights) => weights.clone(),
            Objective::Nearest => (0..outputs)
                .map(|output| {
                    let states = self.controller.states();
                    let votes = members.iter().map(|&state| {
                        if states[state as usize].outputs.0[output] { -1.0 } else { 1.0 }
                    });
                    votes.sum()
                })
                .collect(),
        }
    }
}

fn no_command(members: &[u32], failed: u64, posed: &[Posed], unsolved: Unsolved) -> NoCommand {
    let (conflict, solver) = match unsolved {
        Unsolved::Conflict(places) => {
            (places.into_iter().map(|place| posed[place].clone()).collect(), None)
        }
        Unsolved::Solver(message) => (Vec::new(), Some(message)),
    };
    NoCommand { members: members.to_vec(), failed, conflict, solver }
}
