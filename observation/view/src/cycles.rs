//! Which cycle of the run a record belongs to.

use understudy_journal::Numbering;
use understudy_wire::{Moment, ProgramId};

/// One count of cycles over all epochs, as the report has it: from the origin of the run. Until the origin is known it begins
/// anywhere; then everything that was counted so far moves by the answer of [`Self::take_shift`].
#[derive(Debug, Clone, Default)]
pub(crate) struct Cycles {
    numbering: Numbering,
    origin: Option<i64>,
    /// An origin that was told before its epoch was seen.
    awaited: Option<(Moment, i64)>,
    shift: i64,
}

impl Cycles {
    /// A deadline that a remote I/O has passed.
    pub(crate) fn deadline(&mut self, program: ProgramId, moment: Moment, idle: bool) -> i64 {
        let number = self.numbering.deadline(program, moment, idle);
        if let Some((moment, cycle)) = self.awaited {
            self.origin_is(moment, cycle);
        }
        self.counted(number)
    }

    /// The cycle of a moment; the newest one where its epoch has not been seen.
    pub(crate) fn of(&self, moment: Option<Moment>) -> i64 {
        let number = moment
            .and_then(|moment| self.numbering.of(moment))
            .or_else(|| self.numbering.latest());
        self.counted(number.unwrap_or(0))
    }

    /// The cycle of a moment, where its epoch has been seen.
    pub(crate) fn of_known(&self, moment: Moment) -> Option<i64> {
        Some(self.counted(self.numbering.of(moment)?))
    }

    /// The newest one that a deadline has passed of.
    pub(crate) fn latest(&self) -> Option<i64> {
        Some(self.counted(self.numbering.latest()?))
    }

    /// `moment` is cycle `cycle` of the run.
    pub(crate) fn origin_is(&mut self, moment: Moment, cycle: i64) {
        match self.numbering.of(moment) {
            Some(number) => {
                let origin = number.saturating_sub(cycle);
                let by = self.origin.unwrap_or(0).saturating_sub(origin);
                self.shift = self.shift.saturating_add(by);
                self.origin = Some(origin);
                self.awaited = None;
            }
            None => self.awaited = Some((moment, cycle)),
        }
    }

    /// What is to be added to every cycle that was told before.
    pub(crate) fn take_shift(&mut self) -> Option<i64> {
        Some(std::mem::take(&mut self.shift)).filter(|shift| *shift != 0)
    }

    /// From the first record on again, with the origin that is known now.
    pub(crate) fn again(&self) -> Self {
        Self {
            origin: self.origin,
            ..Self::default()
        }
    }

    pub(crate) fn has_origin(&self) -> bool {
        self.origin.is_some()
    }

    fn counted(&self, number: i64) -> i64 {
        number.saturating_sub(self.origin.unwrap_or(0))
    }
}
