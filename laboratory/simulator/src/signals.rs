//! Whether the signals that a program sampled are true.
//!
//! Invariant checked, *No guess* for signals: a sampled value is the declared default, or the output that the reference run of
//! the other program had in one of the last cycles, as many as the declaration allows.

use std::collections::VecDeque;

use understudy_remote_io::{Layout, Settings};
use understudy_wire::{Image, Moment, ProgramId, ProgramSet};

use crate::referee::Violation;

/// Cycles whose outputs are remembered for each program.
const REMEMBERED: usize = 64;

/// The true outputs of every program that another one reads, in its last cycles.
#[derive(Debug, Clone)]
pub(crate) struct SignalReferee {
    read: ProgramSet,
    truths: Vec<VecDeque<(Moment, Image)>>,
}

impl SignalReferee {
    pub(crate) fn new(readers: &[Settings]) -> Self {
        let signals = readers.iter().flat_map(|reader| &reader.layout.signals);
        Self {
            read: signals.map(|signal| signal.from).collect(),
            truths: vec![VecDeque::new(); readers.len()],
        }
    }

    /// Remembers h(x(t), u(t)) of a program; nothing is known where the referee of the program knows nothing.
    pub(crate) fn note(&mut self, program: ProgramId, truth: Option<(Moment, &Image)>) {
        if !self.read.contains(program) {
            return;
        }
        let truths = &mut self.truths[program.index()];
        match truth {
            None => truths.clear(),
            Some((moment, outputs)) => {
                if truths.len() == REMEMBERED {
                    truths.pop_front();
                }
                truths.push_back((moment, outputs.clone()));
            }
        }
    }

    /// The first sampled signal that is not true.
    pub(crate) fn judge(
        &self,
        layout: &Layout,
        moment: Moment,
        inputs: &Image,
    ) -> Option<Violation> {
        let mut signals = layout.signals.iter();
        let wrong = signals.find(|signal| {
            let value = signal.place.get(inputs);
            let truths = &self.truths[signal.from.index()];
            let allowed = u64::from(signal.stale_after) + 1;
            let fits = |(of, outputs): &(Moment, Image)| {
                let is_recent = of.epoch != moment.epoch || of.plus(allowed) >= moment;
                is_recent && *of < moment && signal.value_in(outputs) == value
            };
            let is_known = truths.len() > usize::try_from(allowed).unwrap_or(usize::MAX);
            is_known && value != signal.default && !truths.iter().any(fits)
        })?;
        Some(Violation::WrongSignal {
            moment,
            input: wrong.place.bit,
            value: wrong.place.get(inputs),
        })
    }
}
