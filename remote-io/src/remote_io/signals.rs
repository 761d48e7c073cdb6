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

use understudy_wire::{Image, Lineage, Moment, ProgramId, Sample, StationSet};

use super::RemoteIo;
use crate::event::Event;
use crate::selection::{Received, Selection};
use crate::settings::{Settings, ValueFault};
use crate::source::{SignalInput, SignalSource};
use crate::trust::Trust;

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
    /// Deadlines since it was proved; `None` before the first value.
    age: Option<u32>,
}

impl Signals {
    pub(super) fn new(settings: &Settings) -> Self {
        let taken = settings.signals.iter().map(|signal| Taken {
            stored: signal.default,
            age: None,
        });
        Self {
            proofs: vec![None; settings.signal_sources.len()],
            taken: taken.collect(),
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

    /// Puts the values into u(i).
    pub(super) fn put(&self, signals: &[SignalInput], image: &mut Image) {
        for (signal, taken) in signals.iter().zip(&self.taken) {
            let is_valid = taken.is_valid(signal);
            let stored = if is_valid {
                taken.stored
            } else {
                signal.default
            };
            signal.place.set(image, stored);
            if let Some(valid) = signal.valid {
                image.set(usize::from(valid), is_valid);
            }
        }
    }
}

impl Taken {
    fn is_valid(&self, signal: &SignalInput) -> bool {
        self.age.is_some_and(|age| age <= signal.stale_after)
    }
}

impl RemoteIo {
    /// At the deadline of a cycle: takes the values that are proved, and lets the others age.
    pub(super) fn take_signals(&mut self) {
        let moment = self.moment();
        let received = self.received();
        let sources = self.settings.signal_sources.iter().enumerate();
        let outputs: Vec<Option<Image>> = sources
            .map(|(place, source)| self.signals.outputs(place, source, moment, received))
            .collect();
        self.age_signals(|program, sources| {
            let place = sources
                .iter()
                .position(|source| source.program == program)?;
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
        for place in 0..self.settings.signals.len() {
            let signal = self.settings.signals[place];
            let taken = &mut self.signals.taken[place];
            let was_valid = taken.is_valid(&signal);
            match outputs(signal.from, &self.settings.signal_sources) {
                Some(outputs) => {
                    *taken = Taken {
                        stored: signal.value_in(outputs),
                        age: Some(0),
                    };
                }
                None => taken.age = taken.age.map(|age| age.saturating_add(1)),
            }
            let valid = taken.is_valid(&signal);
            if valid != was_valid {
                let input = signal.place.bit;
                self.report(Event::SignalValidity {
                    moment,
                    input,
                    valid,
                });
            }
        }
    }
}
