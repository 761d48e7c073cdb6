//! Samples of two remote I/Os of one program.
//!
//! An author that has proved no output yet may sample next to the other one, without effect: its samples count from its first proved output on, or
//! where a later sample of either extends them.

use std::collections::VecDeque;

use understudy_remote_io::Event;
use understudy_wire::{Lineage, Member, Source, Step};

use super::{Referee, Violation};

/// Samples that do not count yet, at most, for ten minutes of 10 ms cycles; the oldest are forgotten.
const PENDING: usize = 65_536;

/// What is kept of two remote I/Os.
#[derive(Debug, Clone, Default, Hash)]
pub(super) struct Pair {
    /// The one whose outputs were proved last, or that has sampled first.
    confirmed: Option<Member>,
    pending: VecDeque<Sampled>,
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
    /// As [`Self::observe`], of one of two remote I/Os of the program.
    ///
    /// # Errors
    /// As [`Self::observe`].
    pub fn observe_from(&mut self, member: Member, event: &Event) -> Result<(), Violation> {
        match event {
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
            Event::Applied { source: Source::Direct | Source::Reconstructed, .. }
                if self.pair.confirmed != Some(member) =>
            {
                self.pair.confirmed = Some(member);
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
