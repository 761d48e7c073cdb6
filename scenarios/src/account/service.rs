//! What each remote I/O applied and how its plant fared.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use understudy_wire::{Field, Source};

use super::presence::{Interval, extend};
use understudy_journal::is_provable;

/// A deadline of a remote I/O.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Outcome {
    pub(crate) source: Source,
    pub(crate) wrong: bool,
}

/// How a plant was served.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Service {
    /// By true outputs: direct or reconstructed.
    Functional,
    /// By the last true outputs, within the cycles that are configured for it.
    Held,
    /// By the fail-safe outputs.
    FailSafe,
    /// By an output that was wrong.
    Wrong,
    /// By nobody: its remote I/O was not there.
    Missed,
}

/// Deadlines of a remote I/O by what was applied.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
pub struct Counts {
    /// From the controller itself.
    pub direct: u64,
    /// By the sum of the others, equation (12).
    pub reconstructed: u64,
    /// The last true output, in cycles that no stall of the host explains.
    pub held: u64,
    /// The last true output, in cycles in which the host itself stood still.
    pub held_by_stall: u64,
    /// The configured values, in cycles that no stall of the host explains.
    pub fail_safe: u64,
    /// The configured values, in cycles in which the host itself stood still.
    pub fail_safe_by_stall: u64,
    /// Cycles in which the remote I/O was not there.
    pub missed: u64,
    /// Outputs of any source that were not what they had to be.
    pub wrong: u64,
}

/// One program's plant side.
#[derive(Debug, Clone, Default)]
pub(crate) struct ServiceTrack {
    pub(crate) counts: Counts,
    pub(crate) intervals: Vec<Interval<Service>>,
    finished: Growing,
    plant_faults: Growing,
}

/// A count that a restart of its plant sets back to 0.
#[derive(Debug, Clone, Copy, Default)]
struct Growing {
    last: u64,
    total: u64,
}

impl Growing {
    fn follow(&mut self, count: u64, counts: bool) {
        if counts {
            self.total += count.checked_sub(self.last).unwrap_or(count);
        }
        self.last = count;
    }
}

impl ServiceTrack {
    /// What the plant has counted; it counts from the origin on.
    pub(crate) fn field(&mut self, field: &Field, after_origin: bool) {
        self.finished.follow(field.finished, after_origin);
        self.plant_faults.follow(field.plant_faults, after_origin);
    }

    pub(crate) fn finished(&self) -> u64 {
        self.finished.total
    }

    pub(crate) fn plant_faults(&self) -> u64 {
        self.plant_faults.total
    }

    /// Cycle `at` is over; cycles come in order.
    pub(crate) fn close_cycle(&mut self, at: u64, outcome: Option<Outcome>, stalled: bool) {
        // A deadline that was skipped while the host stood still: the last outputs stayed in force.
        let skipped = outcome.is_none() && stalled;
        let counts = &mut self.counts;
        let counter = match (outcome.map(|outcome| outcome.source), stalled) {
            (Some(Source::Direct), _) => &mut counts.direct,
            (Some(Source::Reconstructed), _) => &mut counts.reconstructed,
            (Some(Source::Held), false) => &mut counts.held,
            (Some(Source::Held), true) => &mut counts.held_by_stall,
            (Some(Source::FailSafe), false) => &mut counts.fail_safe,
            (Some(Source::FailSafe), true) => &mut counts.fail_safe_by_stall,
            (None, true) => &mut counts.held_by_stall,
            (None, false) => &mut counts.missed,
        };
        *counter += 1;
        let service = match outcome {
            None if skipped => Service::Held,
            None => Service::Missed,
            Some(Outcome { wrong: true, .. }) => {
                counts.wrong += 1;
                Service::Wrong
            }
            Some(outcome) if is_provable(outcome.source) => Service::Functional,
            Some(outcome) if outcome.source == Source::Held => Service::Held,
            Some(_) => Service::FailSafe,
        };
        extend(&mut self.intervals, at, service);
    }

    /// Nothing but true and held outputs, and nothing happened to the plant that must not.
    pub(crate) fn functional(&self) -> bool {
        let counts = &self.counts;
        counts.wrong == 0
            && counts.fail_safe + counts.fail_safe_by_stall == 0
            && counts.missed == 0
            && self.plant_faults() == 0
    }
}
