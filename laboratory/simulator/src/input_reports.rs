//! Whether it is reported that two input modules show different values, as seen from the modules and not from the remote I/Os.
//!
//! An author of which the other remote I/O is received reports after `discrepancy_cycles` samples. Faults between the two delay that, so the bound is
//! longer; where it reports the loss of the other one, there is nothing to compare. What was reported stays so until the two have shown the same value, or
//! the operator has released them.

use understudy_remote_io::{Event, PairSettings, PairedInput, Settings, Wiring};
use understudy_wire::{Image, Member, Part};

/// Samples after `discrepancy_cycles` within which the report must come: those until the loss of the other remote I/O is reported, and those of faults
/// that are over.
const PATIENCE: u32 = 150;

/// Samples by which what was read of the other remote I/O may be older than what its modules show.
const READ_LATE: u32 = 3;

#[derive(Debug, Clone, Hash)]
pub(crate) struct InputReports {
    /// Samples in a row.
    patience: u32,
    /// What is known of each paired input, in the order of the settings.
    inputs: Vec<Watched>,
    partner_is_lost: bool,
    /// The remote I/O that has sampled last.
    author: Option<Member>,
}

#[derive(Debug, Clone, Default, Hash)]
struct Watched {
    /// Samples in a row for which the two modules have shown different values.
    differs_for: u32,
    is_reported: bool,
    /// Samples since the report.
    reported_for: u32,
    /// Samples since the two have shown the same value, or were released.
    unequal_for: u32,
}

impl InputReports {
    /// Of a program whose remote I/Os have modules of their own; `None` for all others.
    pub(crate) fn of(settings: &Settings) -> Option<Self> {
        let PairSettings { wiring: Wiring::Parallel { discrepancy_cycles }, .. } = settings.pair?
        else {
            return None;
        };
        Some(Self {
            patience: discrepancy_cycles.saturating_add(PATIENCE),
            inputs: vec![Watched::default(); settings.paired_inputs.len()],
            partner_is_lost: false,
            author: None,
        })
    }

    /// Something else has failed or has returned, which delays a report.
    pub(crate) fn begin_again(&mut self) {
        self.inputs.iter_mut().for_each(|watched| watched.differs_for = 0);
    }

    /// The operator releases all modules.
    pub(crate) fn release(&mut self) {
        self.inputs.iter_mut().for_each(|watched| watched.unequal_for = 0);
    }

    /// Takes an event of a remote I/O of the program, where its modules and those of the other one show these values. An input, by its first bit, of which it
    /// should have been reported that they differ, or still be.
    pub(crate) fn note(
        &mut self,
        paired: &[PairedInput],
        member: Member,
        event: &Event,
        shown: [&Image; 2],
    ) -> Option<u16> {
        match event {
            Event::InputsDiffer { input, .. } | Event::InputExcluded { input, .. } => {
                self.report(paired, *input, true);
            }
            Event::InputsAgree { input, .. } => {
                let of = paired.iter().zip(&self.inputs).find(|(of, _)| of.place.bit == *input);
                let is_unequal = of.is_some_and(|(of, watched)| {
                    of.place.get(shown[0]) != of.place.get(shown[1])
                        && watched.is_reported
                        && watched.unequal_for > watched.reported_for.saturating_add(READ_LATE)
                });
                self.report(paired, *input, false);
                return is_unequal.then_some(*input);
            }
            Event::PartnerLost { .. } => self.partner_is_lost = true,
            Event::PartnerReceived { .. } => {
                self.partner_is_lost = false;
                self.begin_again();
            }
            Event::PartChanged { part: Part::Author, .. } => {
                self.partner_is_lost = false;
                for watched in &mut self.inputs {
                    *watched = Watched { unequal_for: watched.unequal_for, ..Watched::default() };
                }
            }
            Event::Sampled { .. } => {
                if self.author.replace(member) != Some(member) {
                    self.begin_again();
                }
                return self.sampled(paired, shown);
            }
            _ => {}
        }
        None
    }

    fn report(&mut self, paired: &[PairedInput], input: u16, is_reported: bool) {
        let all = paired.iter().zip(&mut self.inputs);
        for (_, watched) in all.filter(|(of, _)| of.place.bit == input) {
            let unequal_for = watched.unequal_for;
            *watched = Watched { differs_for: 0, is_reported, reported_for: 0, unequal_for };
        }
    }

    fn sampled(&mut self, paired: &[PairedInput], [first, twin]: [&Image; 2]) -> Option<u16> {
        for (input, watched) in paired.iter().zip(&mut self.inputs) {
            let differs = input.place.get(first) != input.place.get(twin);
            watched.unequal_for = if differs { watched.unequal_for.saturating_add(1) } else { 0 };
            watched.reported_for = watched.reported_for.saturating_add(1);
        }
        if self.partner_is_lost {
            self.begin_again();
            return None;
        }
        let patience = self.patience;
        let mut unreported = None;
        for (input, watched) in paired.iter().zip(&mut self.inputs) {
            let differs = watched.unequal_for > 0;
            watched.differs_for = if differs { watched.differs_for + 1 } else { 0 };
            if watched.differs_for > patience && !watched.is_reported {
                watched.differs_for = 0;
                unreported = Some(input.place.bit);
            }
        }
        unreported
    }
}

#[cfg(test)]
mod tests {
    use understudy_remote_io::{PartnerLack, PointPlace};
    use understudy_typed::Elementary;
    use understudy_wire::{Lineage, Moment, ProgramId};

    use super::*;

    const FIRST: Member = Member::RemoteIo(ProgramId(0));
    const TWIN: Member = Member::Twin(ProgramId(0));

    /// An input whose modules differ from the first sample on; the events come before these samples.
    fn check(events: &[(u32, Event)], expected: Option<u32>) {
        check_released(events, None, expected);
    }

    /// The same where the operator releases the modules before a sample.
    fn check_released(events: &[(u32, Event)], released: Option<u32>, expected: Option<u32>) {
        let place = PointPlace { bit: 0, of: Elementary::Bool };
        let paired = PairedInput::exact(&[place]);
        let mut reports = InputReports {
            patience: 10,
            inputs: vec![Watched::default()],
            partner_is_lost: false,
            author: None,
        };
        let [off, mut on] = [Image::zero(1), Image::zero(1)];
        on.set(0, true);
        let mut found = None;
        let sampled = Event::Sampled {
            moment: Moment::default(),
            inputs: off.clone(),
            born: Moment::default(),
            before: Lineage::default(),
            change: None,
        };
        for sample in 1..40 {
            if released == Some(sample) {
                reports.release();
            }
            for (_, event) in events.iter().filter(|(after, _)| *after == sample) {
                let input = reports.note(&paired, FIRST, event, [&off, &on]);
                found = found.or(input.map(|_| sample));
            }
            let input = reports.note(&paired, FIRST, &sampled, [&off, &on]);
            found = found.or(input.map(|_| sample));
        }
        assert_eq!(found, expected, "{events:?}");
    }

    #[test]
    fn a_missing_report_is_found() {
        let moment = Moment::default();
        let differ = Event::InputsDiffer { moment, input: 0 };
        let excluded = Event::InputExcluded { moment, input: 0, at: TWIN };
        let other = Event::InputsDiffer { moment, input: 1 };
        let agree = Event::InputsAgree { moment, input: 0 };
        let lost = Event::PartnerLost { moment, lack: PartnerLack::Silent };
        let back = Event::PartnerReceived { moment };
        let author = Event::PartChanged { moment, part: Part::Author };
        check(&[], Some(11));
        check(&[(5, differ.clone())], None);
        check(&[(11, excluded)], None);
        check(&[(5, other)], Some(11));
        // The two have not agreed, so the report must not end, also where the other one is lost.
        check(&[(5, differ.clone()), (9, agree.clone())], Some(9));
        check(&[(5, differ.clone()), (7, lost.clone()), (9, agree.clone())], Some(9));
        // The operator has released them, and it is reported anew.
        check_released(&[(5, differ.clone()), (9, agree)], Some(9), Some(19));
        // Where the other one is lost there is nothing to compare, and a new author reports anew.
        check(&[(5, lost.clone())], None);
        check(&[(5, lost), (15, back)], Some(25));
        check(&[(5, differ.clone()), (8, author)], Some(18));
        // One that steps aside says nothing of what the new author has reported before.
        let follower = Event::PartChanged { moment, part: Part::Follower };
        check(&[(5, differ), (8, follower)], None);
    }
}
