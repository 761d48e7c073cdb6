//! Signals of other programs: y(j)(t) becomes part of u(i)(t+1).
//!
//! ```text
//!   remote I/O j ── sample of cycle t: the true lineage ──┐
//!   stations ────── turns of cycle t: words ──────────────┴─► deadline of t: the selection of remote I/O j ──► sample of t+1
//! ```
//!
//! Invariant *No guess* holds here as well: a value is taken only where it is proved by the rule that remote I/O j
//! itself follows, and only while remote I/O j drives what it can prove. Replicas never read each other: they read the
//! sample.

use smallvec::SmallVec;
use understudy_cycle::{Layout, PointPlace, ValueFault};
use understudy_wire::{Image, Lineage, Moment, ProgramId, Sample, StationSet};

use super::RemoteIo;
use crate::event::Event;
use crate::selection::{Received, Selection};
use crate::trust::Trust;
use understudy_cycle::{SignalInput, SignalSource};

/// Values of signals, and what proves the next ones.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub(super) struct Signals {
    /// The newest sample of each source of the settings.
    proofs: Vec<Option<Proof>>,
    /// One for each signal of the settings.
    taken: Vec<Taken>,
}

/// What a sample of another program says about the outputs of its cycle.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
struct Proof {
    moment: Moment,
    /// The true lineage after the sample.
    truth: Lineage,
    excluded: StationSet,
    drives: bool,
}

/// Value of a signal.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
struct Taken {
    /// Newest proved value.
    stored: u64,
    /// Cycle of that value; `None` before the first one.
    of: Option<Moment>,
    /// Deadlines since it was proved: cycles may also be late, or not be started at all.
    age: u32,
    /// Whether the last sample had it.
    is_valid: bool,
}

impl Signals {
    pub(super) fn of(layout: &Layout) -> Self {
        let taken = layout.signals.iter().map(|signal| Taken {
            stored: signal.default,
            of: None,
            age: 0,
            is_valid: false,
        });
        Self { proofs: vec![None; layout.signal_sources.len()], taken: taken.collect() }
    }

    /// The signals are others from now on: one of `old` that stays where `moved` tells, and is the same output, keeps its value.
    pub(super) fn lay_out(
        &mut self,
        old: &Layout,
        new: &Layout,
        moved: &dyn Fn(PointPlace) -> Option<PointPlace>,
    ) {
        let before = std::mem::replace(self, Self::of(new));
        for (proof, source) in self.proofs.iter_mut().zip(&new.signal_sources) {
            let place = old.signal_sources.iter().position(|it| it.program == source.program);
            *proof = place.and_then(|place| before.proofs[place]);
        }
        for (taken, signal) in self.taken.iter_mut().zip(&new.signals) {
            let is_it = |it: &SignalInput| {
                (it.from, it.output) == (signal.from, signal.output)
                    && moved(it.place) == Some(signal.place)
            };
            if let Some(place) = old.signals.iter().position(is_it) {
                *taken = before.taken[place];
            }
        }
    }

    /// Puts the values of the newest sample into an u(i).
    pub(super) fn put_newest(&self, signals: &[SignalInput], image: &mut Image) {
        for (signal, taken) in signals.iter().zip(&self.taken) {
            let stored = if taken.is_valid { taken.stored } else { signal.default };
            signal.place.set(image, stored);
        }
    }

    /// Keeps the newest sample of a source.
    pub(super) fn note(
        &mut self,
        sources: &[SignalSource],
        program: ProgramId,
        moment: Moment,
        sample: &Sample,
    ) {
        let Some(place) = sources.iter().position(|source| source.program == program) else {
            return;
        };
        let proof = &mut self.proofs[place];
        if proof.is_none_or(|known| known.moment < moment) {
            *proof = Some(Proof {
                moment,
                truth: sample.after,
                excluded: sample.excluded,
                drives: sample.drives,
            });
        }
    }

    /// The outputs of a source in the cycle `moment`, where they are proved.
    fn outputs(
        &self,
        place: usize,
        source: &SignalSource,
        moment: Moment,
        received: Received<'_>,
    ) -> Option<Image> {
        let proof = self.proofs[place].filter(|proof| proof.moment == moment && proof.drives)?;
        let (selection, _) = received.select(
            source.program,
            proof.truth,
            source.outputs,
            &mut Trust::excluding(proof.excluded),
            ValueFault::Hold,
        );
        let (Selection::Direct(outputs) | Selection::Reconstructed(outputs, _)) = selection else {
            return None;
        };
        let is_stopped = source.stopped.is_some_and(|stopped| outputs.get(stopped));
        (!is_stopped).then_some(outputs)
    }

    /// Puts the values into u(i) of the cycle `moment`. Answers with the inputs whose validity changes.
    pub(super) fn put(
        &mut self,
        signals: &[SignalInput],
        moment: Moment,
        image: &mut Image,
    ) -> SmallVec<[(u16, bool); 1]> {
        let mut changed = SmallVec::new();
        for (signal, taken) in signals.iter().zip(&mut self.taken) {
            let is_valid = taken.is_recent(signal, moment);
            if is_valid != std::mem::replace(&mut taken.is_valid, is_valid) {
                changed.push((signal.place.bit, is_valid));
            }
            let stored = if is_valid { taken.stored } else { signal.default };
            signal.place.set(image, stored);
            if let Some(valid) = signal.valid {
                image.set(usize::from(valid), is_valid);
            }
        }
        changed
    }
}

impl Taken {
    /// Whether the value is of the cycle before `moment`, or of one that is not too old. Cycles count, and deadlines: after a
    /// partition the numbers of cycles jump, and without a cycle only deadlines pass.
    fn is_recent(&self, signal: &SignalInput, moment: Moment) -> bool {
        let allowed = u64::from(signal.stale_after) + 1;
        let is_near = |of: Moment| of.epoch == moment.epoch && of.plus(allowed) >= moment;
        self.age <= signal.stale_after && self.of.is_some_and(is_near)
    }
}

impl RemoteIo {
    /// At the deadline of a cycle: takes the values that are proved, and lets the others age.
    pub(super) fn take_signals(&mut self) {
        let moment = self.moment();
        let received = self.received();
        let sources = self.layout.signal_sources.iter().enumerate();
        let outputs: Vec<Option<Image>> = sources
            .map(|(place, source)| self.inputs.signals.outputs(place, source, moment, received))
            .collect();
        self.age_signals(|program, sources| {
            let place = sources.iter().position(|source| source.program == program)?;
            outputs[place].as_ref()
        });
    }

    /// At a deadline without a cycle: all values age.
    pub(super) fn miss_signals(&mut self) {
        self.age_signals(|_, _| None);
    }

    fn age_signals<'a>(
        &mut self,
        outputs: impl Fn(ProgramId, &[SignalSource]) -> Option<&'a Image>,
    ) {
        let moment = self.moment();
        let signals = self.layout.signals.iter().zip(&mut self.inputs.signals.taken);
        for (signal, taken) in signals {
            match outputs(signal.from, &self.layout.signal_sources) {
                Some(outputs) => {
                    taken.stored = signal.value_in(outputs);
                    taken.of = Some(moment);
                    taken.age = 0;
                }
                None => taken.age = taken.age.saturating_add(1),
            }
        }
    }

    /// Reports inputs whose validity changes with the sample of this cycle.
    pub(super) fn report_validity(&mut self, changed: &[(u16, bool)]) {
        let moment = self.moment();
        for &(input, valid) in changed {
            self.report(Event::SignalValidity { moment, input, valid });
        }
    }
}
