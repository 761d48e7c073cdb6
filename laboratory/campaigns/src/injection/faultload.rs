//! What one run of a campaign does to the cluster: injections, each a group of steps that only make sense together, and a
//! disturbed network.

use std::ops::Range;

use understudy_scenarios::{Expectation, Scenario};
use understudy_simulator::{Action, Disturbance, Fault};

use super::kind::{Kind, Role};

/// One fault and, where it has one, its end.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Injection {
    /// What it is.
    pub(super) kind: Kind,
    /// Whom it strikes.
    pub(super) role: Role,
    /// In the order of their times; never empty. What the first one begins, the others end.
    pub(super) steps: Vec<Fault>,
}

impl Injection {
    /// From its first step to its last.
    pub(super) fn cycles(&self) -> Range<u64> {
        let first = self.steps.first().map_or(0, |step| step.at_cycle);
        let last = self.steps.last().map_or(0, |step| step.at_cycle);
        first..last + 1
    }

    /// The cycles in which it decides whether processes run: to the end of the run where it leaves one crashed or stopped.
    fn decides_in(&self) -> Range<u64> {
        let leaves = |place: usize, step: &Fault| {
            let later = &self.steps[place + 1..];
            matches!(step.action, Action::Crash | Action::Stop)
                && !later.iter().any(|other| other.member == step.member)
        };
        let cycles = self.cycles();
        let lasts = self.steps.iter().enumerate().any(|(place, step)| leaves(place, step));
        cycles.start..if lasts { u64::MAX } else { cycles.end }
    }

    /// Whether two injections would both decide whether the process of one member runs, or both give members a wrong program: two pairs may be
    /// most of a cluster, and then no member can tell which program is the right one.
    pub(super) fn collides_with(&self, other: &Self) -> bool {
        if (self.kind, other.kind) == (Kind::WrongProgram, Kind::WrongProgram) {
            return true;
        }
        let decides = |step: &&Fault| matches!(step.action, Action::Crash | Action::Stop);
        let mut decided = self.steps.iter().filter(decides);
        let by_other = |member| other.steps.iter().filter(decides).any(|it| it.member == member);
        let (own, others) = (self.decides_in(), other.decides_in());
        let meet = own.start < others.end && others.start < own.end;
        meet && decided.any(|step| by_other(step.member))
    }
}

/// The faults of one run.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct Faultload {
    /// In the order in which they were drawn.
    pub(super) injections: Vec<Injection>,
    /// The network is another one for a while.
    pub(super) network: Option<Disturbance>,
}

impl Faultload {
    /// All steps in the order of their times.
    pub(super) fn steps(&self) -> Vec<Fault> {
        let steps = self.injections.iter().flat_map(|injection| &injection.steps);
        let mut steps: Vec<Fault> = steps.copied().collect();
        steps.sort_by(|left, right| {
            let (left, right) = ((left.at_cycle, left.phase), (right.at_cycle, right.phase));
            left.0.cmp(&right.0).then(left.1.total_cmp(&right.1))
        });
        steps
    }

    /// Kinds of the faults, ascending.
    pub(super) fn kinds(&self) -> Vec<Kind> {
        let injected = self.injections.iter().map(|injection| injection.kind);
        let disturbed =
            self.network.iter().flat_map(|disturbance| Kind::of_network(&disturbance.network));
        let mut kinds: Vec<Kind> = injected.chain(disturbed).collect();
        kinds.sort_unstable();
        kinds.dedup();
        kinds
    }

    /// The same as a scenario for people, with the seed that its run has.
    pub(super) fn scenario(
        &self,
        title: String,
        cycles: u64,
        seed: u64,
        expect: Expectation,
    ) -> Scenario {
        Scenario {
            title,
            cycles,
            seed: Some(seed),
            spare_after: None,
            steps: self.steps(),
            network: self.network.as_ref().map(|disturbance| disturbance.network),
            network_cycles: self
                .network
                .as_ref()
                .and_then(|disturbance| disturbance.cycles.clone()),
            expect,
        }
    }

    /// The size that minimising makes smaller: fewer faults first, then fewer cycles, then simpler numbers.
    pub(super) fn size(&self) -> (usize, u64) {
        let faults = self.injections.len() + usize::from(self.network.is_some());
        let ranges = self.injections.iter().map(Injection::cycles);
        let ranges = ranges.chain(self.network.iter().filter_map(|network| network.cycles.clone()));
        (faults, ranges.map(|range| range.end - range.start).sum())
    }
}
