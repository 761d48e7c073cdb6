//! The samples of a lost replica, to be replayed onto a state that another station transfers.

use std::collections::VecDeque;

use understudy_wire::{Lineage, Moment, Sample, Step};

use super::lineages_of;

/// Maximum number of samples that are kept: a snapshot of a state arrives within them, or another one is asked for.
const MAXIMUM_LOG: usize = 512;

/// Samples in a row, each of which leads from one lineage to the next.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub(super) struct Log {
    /// Before the oldest sample.
    base: Lineage,
    /// After the newest sample.
    head: Lineage,
    /// Oldest first.
    samples: VecDeque<Step>,
    /// Cycle of the newest sample.
    pub(super) moment: Moment,
}

impl Log {
    /// The samples of a history.
    pub(super) fn of(sample: &Sample, moment: Moment) -> Self {
        Self {
            base: sample.base,
            head: sample.after,
            samples: sample.history.iter().cloned().collect(),
            moment,
        }
    }

    /// Appends the samples of a history that are new; one that does not continue this log replaces it.
    pub(super) fn extend(&mut self, sample: &Sample, moment: Moment) {
        let lineages = lineages_of(sample);
        let place_of = |lineage| lineages.iter().position(|known| *known == lineage);
        let known = place_of(self.head).or_else(|| {
            // The newest samples became void.
            let (kept, known) = self.last_common(place_of)?;
            self.samples.truncate(kept);
            Some(known)
        });
        let Some(known) = known else {
            *self = Self::of(sample, moment);
            return;
        };
        self.samples.extend(sample.history[known..].iter().cloned());
        self.head = sample.after;
        self.moment = moment;
        while self.samples.len() > MAXIMUM_LOG {
            if let Some(oldest) = self.samples.pop_front() {
                self.base = self.base.after_step(&oldest);
            }
        }
    }

    /// The number of samples up to the newest lineage that `place_of` knows, and its place there.
    fn last_common(&self, place_of: impl Fn(Lineage) -> Option<usize>) -> Option<(usize, usize)> {
        let mut before = self.base;
        let mut found = None;
        for kept in 0..=self.samples.len() {
            found = place_of(before).map(|known| (kept, known)).or(found);
            if let Some(step) = self.samples.get(kept) {
                before = before.after_step(step);
            }
        }
        found
    }

    /// Leaves out the samples before `lineage`; false where it is none of this log.
    pub(super) fn starts_at(&mut self, lineage: Lineage) -> bool {
        let mut before = self.base;
        for place in 0..=self.samples.len() {
            if before == lineage {
                self.samples.drain(..place);
                self.base = lineage;
                return true;
            }
            if let Some(step) = self.samples.get(place) {
                before = before.after_step(step);
            }
        }
        false
    }

    /// The lineage before the oldest sample.
    pub(super) fn begins(&self) -> Lineage {
        self.base
    }

    /// The oldest sample, once.
    pub(super) fn take(&mut self) -> Option<Step> {
        let oldest = self.samples.pop_front()?;
        self.base = self.base.after_step(&oldest);
        Some(oldest)
    }

    pub(super) fn is_empty(&self) -> bool {
        self.samples.is_empty()
    }
}
