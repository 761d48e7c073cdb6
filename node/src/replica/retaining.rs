//! States that are kept over a power failure.
//!
//! ```text
//!   every step ──► a record: the step, or the state after `every` steps and where a step leads on from another state
//!   start      ──► the newest state and the steps since are replayed: the retained state
//!                  it is in the history ──────────── the replica goes on from it, as from one that it held
//!                  the history starts warm from it ─ the initial state with its retentive values
//! ```

use std::collections::VecDeque;

use understudy_cycle::{Program, Versions};
use understudy_executable::Scratch;
use understudy_wire::{
    Carried, ClusterHash, Digest, Image, Kept, Lineage, ProgramId, Retained, RetainedRun,
    RetainedState, RetainedStep, Sample,
};

use super::{Held, Replica, State};

/// What a replica keeps on disk, and what it has found there.
#[derive(Debug, Clone, Default, PartialEq, Eq, Hash)]
pub(super) struct Retaining {
    keeps: Option<Keeps>,
    /// The state that was found at the start; none any more once a state is held.
    found: Option<Held>,
    /// The program whose values `found` has, where they were taken over from another one.
    carried: Option<Carried>,
    /// The states before it, oldest first: its last samples may be void.
    before: VecDeque<State>,
    /// Records that are not taken yet.
    records: Vec<Retained>,
}

#[derive(Debug, Clone, PartialEq, Eq, Hash)]
struct Keeps {
    cluster: ClusterHash,
    /// Steps after which a state is kept again.
    every: u32,
    /// The state that the records lead to.
    at: Option<Lineage>,
    /// Steps since the last state.
    steps: u32,
    /// Number of the next state.
    number: u64,
}

impl Retaining {
    /// Keeps a step that led to `held`.
    pub(super) fn stepped(&mut self, id: ProgramId, held: &Held, inputs: &Image) {
        self.found = None;
        self.before.clear();
        let Some(keeps) = &mut self.keeps else {
            return;
        };
        let State { bits, program, lineage, stepped, digest } = &held.state;
        let leads_on = keeps.at.is_some_and(|at| at.after(inputs) == *lineage);
        keeps.at = Some(*lineage);
        keeps.steps += 1;
        self.records.push(if leads_on && keeps.steps < keeps.every {
            Retained::Step(RetainedStep {
                program: id,
                stepped: *stepped,
                inputs: inputs.clone(),
                after: *lineage,
            })
        } else {
            keeps.steps = 0;
            let number = keeps.number;
            keeps.number += 1;
            Retained::State(RetainedState {
                cluster: keeps.cluster,
                program: id,
                hash: *program,
                number,
                born: held.born,
                lineage: *lineage,
                stepped: *stepped,
                digest: *digest,
                state: bits.clone(),
            })
        });
    }
}

impl Replica {
    /// From now on it keeps its state: whole after every `every` steps, and each step in between.
    pub(crate) fn retain(&mut self, cluster: ClusterHash, every: u32) {
        self.retaining.keeps = Some(Keeps { cluster, every, at: None, steps: 0, number: 0 });
    }

    /// Takes what was kept before the power failed, in the order of its numbers; of another program it takes the number alone.
    pub(crate) fn find_retained(
        &mut self,
        versions: Versions<'_>,
        scratch: &mut Scratch,
        run: &RetainedRun,
    ) {
        let kept = &run.state;
        let Some(keeps) = &mut self.retaining.keeps else {
            return;
        };
        keeps.number = keeps.number.max(kept.number.saturating_add(1));
        let Some(program) = versions.of(kept.hash) else {
            return;
        };
        let inputs = program.executable.input_count();
        if kept.state.width() != program.executable.state_count()
            || run.steps.iter().any(|step| step.inputs.width() != inputs)
        {
            return;
        }
        let mut state = State {
            bits: kept.state.clone(),
            program: kept.hash,
            lineage: kept.lineage,
            stepped: kept.stepped,
            digest: kept.digest,
        };
        let mut outputs = Image::zero(program.executable.output_count());
        let mut before = VecDeque::new();
        for (steps_left, step) in (1..=run.steps.len()).rev().zip(&run.steps) {
            if steps_left <= self.history {
                before.push_back(state.clone());
            }
            state.digest = Digest::of(&state.bits);
            program.executable.step(
                scratch,
                state.bits.words_mut(),
                step.inputs.words(),
                outputs.words_mut(),
            );
            state.lineage = step.after;
            state.stepped = step.stepped;
        }
        self.retaining.found = Some(Held { born: kept.born, state });
        self.retaining.carried = run.carried;
        self.retaining.before = before;
    }

    /// The retained state that it reports, while it holds none.
    pub(crate) fn retained(&self) -> Option<Kept> {
        let found = self.retaining.found.as_ref().filter(|_| self.held.is_none())?;
        let (of, is_whole) = match self.retaining.carried {
            Some(carried) => (carried.from, carried.is_whole),
            None => (found.state.program, true),
        };
        Some(Kept { holding: found.holding(self.id), of, is_whole })
    }

    /// Forgets the retained state.
    pub(super) fn forget_retained(&mut self) {
        self.retaining.found = None;
        self.retaining.carried = None;
        self.retaining.before.clear();
    }

    /// Records for the disk, since they were taken last.
    pub(crate) fn take_records(&mut self) -> Vec<Retained> {
        std::mem::take(&mut self.retaining.records)
    }

    /// Goes on from the retained state, or from one before it, where that is in the history: its place there.
    pub(super) fn take_up_retained(&mut self, lineages: &[Lineage]) -> Option<usize> {
        // Values of another program are not a state of this one: it only starts from them.
        let may_continue = self.held.is_none() && self.retaining.carried.is_none();
        self.retaining.found.as_ref().filter(|_| may_continue)?;
        // From here on it is a state that the replica held.
        let found = self.retaining.found.take();
        let past = std::mem::replace(&mut self.past, std::mem::take(&mut self.retaining.before));
        self.held = found;
        let place = self.find(lineages);
        if place.is_none() {
            self.retaining.found = self.held.take();
            self.retaining.before = std::mem::replace(&mut self.past, past);
        }
        place
    }

    /// The state that the history starts from, with its place, where this replica has it: the initial state, or that with the retentive values of
    /// the retained one.
    pub(super) fn start_in(
        &self,
        versions: Versions<'_>,
        sample: &Sample,
        lineages: &[Lineage],
    ) -> Option<(usize, State)> {
        let place_of = |start| lineages.iter().position(|&lineage| lineage == start);
        let start = |program: &Program, lineage, words: &[u64]| {
            let place = place_of(lineage)?;
            let bits = Image::from_words(program.executable.state_count(), words)
                .expect("a state of this program is packed");
            let (stepped, digest) = (sample.born, Digest::default());
            Some((place, State { bits, program: program.hash, lineage, stepped, digest }))
        };
        versions.all().find_map(|program| {
            let genesis = Lineage::genesis(program.hash, sample.born);
            if let Some(cold) = start(program, genesis, program.executable.initial()) {
                return Some(cold);
            }
            let found = self.retaining.found.as_ref();
            let found = found.filter(|found| found.state.program == program.hash)?;
            let warm = Lineage::warm(program.hash, sample.born, found.state.lineage);
            start(program, warm, &program.executable.restarted(found.state.bits.words()))
        })
    }
}
