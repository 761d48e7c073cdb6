//! What has just happened where a run begins.
//!
//! Each start is a schedule of faults too, so that a counterexample is one from its first cycle on: those who restart do so in the first slot of
//! the run, all at one time; those who are behind stood still for the cycle before it.

use understudy_simulator::{Action, ChangeStep, Fault};
use understudy_wire::{MAXIMUM_HISTORY, Member};

use crate::properties::{ALL, Promise, Property};
use crate::step::Place;

/// Of a cluster that was synchronised. The default is that nothing has happened.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Start {
    /// Who starts again as the run begins, and knows nothing.
    pub restarted: Vec<Member>,
    /// Who crashes as the run begins, and may start again at any later slot.
    pub down: Vec<Member>,
    /// Who starts again as the run begins with a wrong program, one and the same configuration for all of them.
    pub misled: Vec<Member>,
    /// Who stood still for a cycle.
    pub behind: Vec<Member>,
    /// What an engineer does in an online change: the members that have loaded it, and the steps as the run begins.
    pub change: Changed,
    /// Links, from a sender to a receiver, that were broken for longer than the history of a sample.
    pub broken: Vec<(Member, Member)>,
    /// Cycles that pass before the run begins, in which nothing happens.
    pub quiet_cycles: u64,
}

/// An online change at the beginning of a run.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Changed {
    /// Members that have loaded it.
    pub prepared: Vec<Member>,
    /// Steps in the first slot of the run.
    pub steps: Vec<(Member, ChangeStep)>,
}

/// Cycles after which every member has received that the others have loaded a change.
const CHANGE_CYCLES: u64 = 2;

/// Cycles for which a link was broken: a sample carries no longer history.
const BROKEN_CYCLES: u64 = MAXIMUM_HISTORY as u64 + 2;

/// The first place after the cycle in which the cluster came into step.
const SYNCHRONISED: Place = Place { cycle: 1, slot: 0 };

impl Start {
    /// The properties that hold from here on. Members with a wrong program are refused by the others, so that nothing but wrong outputs counts.
    pub fn properties(&self) -> Vec<Property> {
        let holds = |property: &Property| {
            self.misled.is_empty() || property.promise == Promise::NothingWrong
        };
        ALL.into_iter().filter(holds).collect()
    }

    /// Where the run begins.
    pub(crate) fn first(&self) -> Place {
        Place {
            cycle: match (self.behind.is_empty(), self.broken.is_empty()) {
                (true, true) if !self.change.prepared.is_empty() => {
                    SYNCHRONISED.cycle + CHANGE_CYCLES
                }
                (true, true) => SYNCHRONISED.cycle + self.quiet_cycles,
                (false, true) => SYNCHRONISED.cycle + 1,
                (_, false) => SYNCHRONISED.cycle + BROKEN_CYCLES,
            },
            slot: 0,
        }
    }

    /// All to whom something has happened, in the order of the schedule.
    pub(crate) fn members(&self) -> impl Iterator<Item = Member> + '_ {
        let changing = self.change.steps.iter().map(|(member, _)| member);
        let restarted = self.behind.iter().chain(&self.restarted);
        restarted.chain(&self.down).chain(&self.misled).chain(changing).copied()
    }

    /// What has happened, in the order in which it has to be scheduled.
    pub(crate) fn faults(&self) -> Vec<Fault> {
        let fault = |place: Place, member, action| Fault {
            at_cycle: place.cycle,
            phase: place.phase(),
            member,
            action,
        };
        let first = self.first();
        let stops = self.behind.iter();
        let stops = stops.map(|&member| fault(SYNCHRONISED, member, Action::Stop));
        let goes_on = self.behind.iter();
        let goes_on = goes_on.map(|&member| fault(first, member, Action::Continue));
        let restarts = self.restarted.iter().flat_map(|&member| {
            [Action::Crash, Action::Restart].map(|action| fault(first, member, action))
        });
        let down = self.down.iter().map(|&member| fault(first, member, Action::Crash));
        let misled = self.misled.iter().flat_map(|&member| {
            [Action::Crash, Action::RestartWrongProgram].map(|action| fault(first, member, action))
        });
        let change = |step| Action::Change { step };
        let prepared = self.change.prepared.iter();
        let prepared =
            prepared.map(|&member| fault(SYNCHRONISED, member, change(ChangeStep::Prepare)));
        let steps = self.change.steps.iter();
        let steps = steps.map(|&(member, step)| fault(first, member, change(step)));
        let broken = self.broken.iter().flat_map(|&(from, to)| {
            [fault(SYNCHRONISED, from, Action::Cut { to }), fault(first, from, Action::Heal { to })]
        });
        let others = stops.chain(goes_on).chain(restarts).chain(down).chain(misled).chain(broken);
        others.chain(prepared).chain(steps).collect()
    }
}
