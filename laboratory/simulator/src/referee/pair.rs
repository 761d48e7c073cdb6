//! Samples of two remote I/Os of one program.
//!
//! An author that has proved no output yet may sample next to the other one, without effect: its samples count from its first proved output on, or
//! where a later sample of either extends them.
//!
//! The records of the two come on ways of their own: a process that is suspended after it has applied outputs may write the record long after its
//! successor has written others. Such a record is judged by the reference run of its own cycle, and says nothing about who applies outputs now.

use std::collections::VecDeque;

use understudy_remote_io::Event;
use understudy_wire::{Image, Lineage, Member, Moment, Source, Step, Time};

use super::steps::scan;
use super::{Referee, State, Violation};

/// Samples that do not count yet, at most, for ten minutes of 10 ms cycles; the oldest are forgotten.
const PENDING: usize = 65_536;

/// What is kept of two remote I/Os.
#[derive(Debug, Clone, Default)]
pub(super) struct Pair {
    /// The one whose outputs were proved last, or that has sampled first.
    confirmed: Option<Member>,
    pending: VecDeque<Sampled>,
    /// Cycle and time of its newest proved outputs.
    proved: Option<(Moment, Time)>,
}

/// Only what records in order depend on: where all members are simulated, none is late.
impl std::hash::Hash for Pair {
    fn hash<H: std::hash::Hasher>(&self, hasher: &mut H) {
        (self.confirmed, &self.pending).hash(hasher);
    }
}

#[derive(Debug, Clone, Hash)]
struct Sampled {
    member: Member,
    before: Lineage,
    after: Lineage,
    event: SampledEvent,
}

/// A sample as it was reported.
#[derive(Debug, Clone)]
struct SampledEvent(Event);

impl std::hash::Hash for SampledEvent {
    fn hash<H: std::hash::Hasher>(&self, hasher: &mut H) {
        if let Event::Sampled { moment, inputs, born, before, change } = &self.0 {
            (moment, inputs, born, before, change).hash(hasher);
        }
    }
}

impl Referee {
    /// As [`Self::observe`], of one of two remote I/Os of the program, of which the events of each come in order; `at` is when it happened, on the
    /// clock of its host.
    ///
    /// # Errors
    /// As [`Self::observe`].
    pub fn observe_from(
        &mut self,
        member: Member,
        at: Time,
        event: &Event,
    ) -> Result<(), Violation> {
        self.fallbacks.speaks(member);
        match event {
            Event::Applied { moment, sampled, outputs, source, .. }
                if self.is_late(member, *moment, at) =>
            {
                self.judge_late(*moment, sampled.as_ref(), (outputs, *source))
            }
            Event::Sampled { inputs, before, change, .. } => {
                if *self.pair.confirmed.get_or_insert(member) != member {
                    if self.pair.pending.len() == PENDING {
                        self.pair.pending.pop_front();
                    }
                    let event = SampledEvent(event.clone());
                    let step = Step { change: *change, inputs: inputs.clone() };
                    let (before, after) = (*before, before.after_step(&step));
                    self.pair.pending.push_back(Sampled { member, before, after, event });
                    return Ok(());
                }
                self.observe_pending(*before).and(self.observe(event))
            }
            Event::Applied { moment, source: Source::Direct | Source::Reconstructed, .. } => {
                self.pair.proved = Some((*moment, at));
                if self.pair.confirmed.replace(member) == Some(member) {
                    return self.observe(event);
                }
                let newest = self.pair.pending.iter().rposition(|it| it.member == member);
                let newest = newest.and_then(|place| self.pair.pending.remove(place));
                let observed = newest.map_or(Ok(()), |newest| {
                    let before = self.observe_pending(newest.before);
                    before.and(self.observe(&newest.event.0))
                });
                observed.and(self.observe(event))
            }
            _ => self.observe(event),
        }
    }

    /// Whether a sample of this remote I/O counts at once.
    pub fn counts(&self, member: Member) -> bool {
        self.pair.confirmed.is_none_or(|confirmed| confirmed == member)
    }

    /// Whether outputs were applied before those that the other one has proved, and are recorded after them.
    fn is_late(&self, member: Member, moment: Moment, at: Time) -> bool {
        let newer = self.pair.proved.is_some_and(|(of, then)| moment < of && at < then);
        newer && self.pair.confirmed.is_some_and(|confirmed| confirmed != member)
    }

    /// Judges outputs that were applied before the newest ones; those that need more of the past than is remembered are not judged.
    fn judge_late(
        &mut self,
        moment: Moment,
        sampled: Option<&Image>,
        (driven, source): (&Image, Source),
    ) -> Result<(), Violation> {
        let is_proved = matches!(source, Source::Direct | Source::Reconstructed);
        let truth = sampled.filter(|_| is_proved).and_then(|inputs| self.truth_of(moment, inputs));
        let Some(truth) = truth else {
            self.gaps += 1;
            return Ok(());
        };
        if truth == *driven {
            return Ok(());
        }
        let (driven, truth) = (driven.clone(), Some(truth));
        Err(Violation::Wrong { moment, source_: source, driven, truth })
    }

    /// h(x(t), u(t)) of an earlier sample without a change mark, where the states before and after it are remembered.
    fn truth_of(&mut self, moment: Moment, inputs: &Image) -> Option<Image> {
        // A sample without a record leads to a state of the cycle before it, so only one that begins in an earlier cycle is that of this one.
        let mut of_cycle = self.states.iter().rev().filter(|state| state.stepped == moment);
        let before = of_cycle.find_map(|after| {
            let leads = |state: &&State| {
                let is_earlier = state.program == after.program && state.stepped != moment;
                is_earlier && state.lineage.after(inputs) == after.lineage
            };
            self.states.iter().rev().find(leads)
        })?;
        let program = before.program;
        let mut bits = before.bits.clone();
        let executable = &self.programs.of(program)?.executable;
        Some(scan(executable, &mut self.scratch, &mut bits, inputs))
    }

    /// Takes the samples that lead to a lineage, where they did not count yet.
    fn observe_pending(&mut self, lineage: Lineage) -> Result<(), Violation> {
        let mut chain = Vec::new();
        let mut wanted = lineage;
        // A void sample that is taken again has the lineage of the first one.
        while self.place_of(wanted).is_none_or(|place| place < self.floor) {
            let found = self.pair.pending.iter().rposition(|it| it.after == wanted);
            let Some(sampled) = found.and_then(|place| self.pair.pending.remove(place)) else {
                break;
            };
            wanted = sampled.before;
            chain.push(sampled.event.0);
        }
        let mut outcome = Ok(());
        for event in chain.iter().rev() {
            outcome = outcome.and(self.observe(event));
        }
        outcome
    }
}
