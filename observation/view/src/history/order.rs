//! Whether the records of a remote I/O follow each other without a gap, as far as their moments tell.
//!
//! It reports every sample and every deadline. A judgment that rests on earlier records is made only where none of them is missing: a loss
//! may be recorded later, or not at all.

use understudy_remote_io::{Event, Missing};
use understudy_wire::Moment;

/// The newest sample and the newest deadline that were read.
#[derive(Debug, Clone, Default)]
pub(super) struct Order {
    sampled: Option<Moment>,
    applied: Option<Moment>,
    /// Records may be missing since the last outputs that were proved here.
    is_cut: bool,
}

impl Order {
    /// Takes the next record.
    pub(super) fn note(&mut self, event: &Event) {
        match event {
            Event::Sampled { moment, .. } => {
                let is_decided = self.sampled.is_none_or(|of| self.applied == Some(of));
                self.is_cut |= !is_decided || self.passes_over(*moment);
                self.sampled = Some(*moment);
            }
            Event::Applied { moment, sampled, missing, .. } => {
                let has_sample = self.sampled == Some(*moment);
                // The deadline of a cycle with a sample has one; without a cycle the deadlines are those of the last one.
                let is_first = self.applied != Some(*moment);
                let is_idle = *missing == Some(Missing::NoCycle);
                let lacks_sample = sampled.is_some() && !has_sample;
                let lacks_deadline = is_idle && is_first && has_sample;
                self.is_cut |= lacks_sample || lacks_deadline || self.passes_over(*moment);
                self.applied = Some(*moment);
            }
            _ => {}
        }
    }

    /// Whether a cycle lies between the last deadline and this one. An epoch begins anywhere.
    fn passes_over(&self, moment: Moment) -> bool {
        self.applied.is_some_and(|last| {
            last.epoch == moment.epoch && moment.cycle.0 > last.cycle.0.saturating_add(1)
        })
    }

    pub(super) fn is_cut(&self) -> bool {
        self.is_cut
    }

    /// Records are missing.
    pub(super) fn cut(&mut self) {
        *self = Self { is_cut: true, ..Self::default() };
    }

    /// The remote I/O starts again, perhaps between a sample and its deadline.
    pub(super) fn starts_again(&mut self) {
        *self = Self { is_cut: self.is_cut, ..Self::default() };
    }

    /// Outputs were found to be those of the reference run: what follows is judged from here.
    pub(super) fn begins(&mut self) {
        self.is_cut = false;
    }
}
