//! What has just happened where a run begins.
//!
//! Each start is a schedule of faults too, so that a counterexample is one from its first cycle on: those who restart do so in the first slot of
//! the run, all at one time; those who are behind stood still for the cycle before it.

use understudy_simulator::{Action, Fault};
use understudy_wire::Party;

use crate::step::Place;

/// Of a cluster that was in step. The default is that nothing has happened.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Start {
    /// Who starts again as the run begins, and knows nothing.
    pub restarted: Vec<Party>,
    /// Who stood still for a cycle.
    pub behind: Vec<Party>,
}

/// The first place after the cycle in which the cluster came into step.
const IN_STEP: Place = Place { cycle: 1, slot: 0 };

impl Start {
    /// Where the run begins.
    pub(crate) fn first(&self) -> Place {
        Place {
            cycle: IN_STEP.cycle + u64::from(!self.behind.is_empty()),
            slot: 0,
        }
    }

    /// All to whom something has happened, in the order of the schedule.
    pub(crate) fn parties(&self) -> impl Iterator<Item = Party> + '_ {
        self.behind.iter().chain(&self.restarted).copied()
    }

    /// What has happened, in the order in which it has to be scheduled.
    pub(crate) fn faults(&self) -> Vec<Fault> {
        let fault = |place: Place, party, action| Fault {
            at_cycle: place.cycle,
            phase: place.phase(),
            party,
            action,
        };
        let first = self.first();
        let stops = self.behind.iter();
        let stops = stops.map(|&party| fault(IN_STEP, party, Action::Stop));
        let goes_on = self.behind.iter();
        let goes_on = goes_on.map(|&party| fault(first, party, Action::Continue));
        let restarts = self.restarted.iter().flat_map(|&party| {
            [Action::Crash, Action::Restart].map(|action| fault(first, party, action))
        });
        stops.chain(goes_on).chain(restarts).collect()
    }
}
