//! The cycle of the run that a record belongs to.

use understudy_wire::{Moment, ProgramId};

use crate::numbering::Numbering;

/// One count of cycles over all epochs, as the report has it: from the origin of the run. Until the origin is known it begins
/// anywhere; then everything that was counted so far moves by the answer of [`Self::take_shift`].
#[derive(Debug, Clone, Default)]
pub struct Cycles {
    numbering: Numbering,
    origin: Option<i64>,
    /// An origin whose epoch is not known yet.
    awaited: Option<(Moment, i64)>,
    shift: i64,
    /// The cycle of a record from before, while it is taken, and its moment.
    fixed: Option<(i64, Option<Moment>)>,
}

impl Cycles {
    /// A count that begins in the middle of a run: `moment` is cycle `cycle`.
    pub fn at(moment: Moment, cycle: i64) -> Self {
        Self::continuing(Numbering::at(moment, cycle), 0)
    }

    /// A count that goes on with the numbers of another, whose cycle 0 has the number `origin`.
    pub fn continuing(numbering: Numbering, origin: i64) -> Self {
        Self { numbering, origin: Some(origin), ..Self::default() }
    }

    /// The numbers that the cycles are counted with.
    pub fn numbering(&self) -> &Numbering {
        &self.numbering
    }

    /// The number of cycle 0, where it is known.
    pub fn origin(&self) -> Option<i64> {
        self.origin
    }

    /// A record from before is taken, of this cycle and moment. Nothing ends that.
    pub fn fix(&mut self, record: Option<(i64, Option<Moment>)>) {
        self.fixed = record;
    }

    /// Whether a record from before is taken.
    pub fn is_fixed(&self) -> bool {
        self.fixed.is_some()
    }

    /// A deadline that a remote I/O has passed.
    pub fn deadline(&mut self, program: ProgramId, moment: Moment, idle: bool) -> i64 {
        let number = self.numbering.deadline(program, moment, idle);
        if let Some((moment, cycle)) = self.awaited {
            self.origin_is(moment, cycle);
        }
        self.counted(number)
    }

    /// The cycle of a moment; the newest one where its epoch has not been seen, and where the member that reports it was in no cycle yet.
    pub fn of(&self, moment: Option<Moment>) -> i64 {
        if let Some((fixed, _)) = self.fixed {
            return fixed;
        }
        let moment = moment.filter(|moment| *moment != Moment::default());
        let number =
            moment.and_then(|moment| self.numbering.of(moment)).or_else(|| self.numbering.latest());
        self.counted(number.unwrap_or(0))
    }

    /// The cycle of a moment, where its epoch has been seen.
    pub fn of_known(&self, moment: Moment) -> Option<i64> {
        if let Some((cycle, Some(fixed))) = self.fixed
            && fixed.epoch == moment.epoch
        {
            // An epoch that has gone on since may be counted otherwise by now.
            let later = i128::from(moment.cycle.0) - i128::from(fixed.cycle.0);
            return Some(cycle.saturating_add(i64::try_from(later).ok()?));
        }
        Some(self.counted(self.numbering.of(moment)?))
    }

    /// The newest one that a deadline has passed of.
    pub fn latest(&self) -> Option<i64> {
        let newest = || Some(self.counted(self.numbering.latest()?));
        self.fixed.map(|(cycle, _)| cycle).or_else(newest)
    }

    /// `moment` is cycle `cycle` of the run.
    pub fn origin_is(&mut self, moment: Moment, cycle: i64) {
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

    /// A record of the journal says that `moment` is cycle `cycle` of the run. It follows the first deadline, and where no remote I/O has reported
    /// one the count begins with it.
    pub fn origin_is_recorded(&mut self, moment: Moment, cycle: i64) {
        if self.numbering.latest().is_none() {
            *self = Self::at(moment, cycle);
        } else {
            self.origin_is(moment, cycle);
        }
    }

    /// Offset to be added to every earlier cycle.
    pub fn take_shift(&mut self) -> Option<i64> {
        Some(std::mem::take(&mut self.shift)).filter(|shift| *shift != 0)
    }

    /// From the first record on again, with the origin that is known now.
    #[must_use]
    pub fn again(&self) -> Self {
        Self { origin: self.origin, ..Self::default() }
    }

    /// Whether the origin is known.
    pub fn has_origin(&self) -> bool {
        self.origin.is_some()
    }

    fn counted(&self, number: i64) -> i64 {
        number.saturating_sub(self.origin.unwrap_or(0))
    }
}
