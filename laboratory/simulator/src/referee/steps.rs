//! The steps of the reference run, across change marks, and those of samples that have no record.

use understudy_cycle::Versions;
use understudy_executable::{Executable, Scratch};
use understudy_wire::{Image, Lineage, Moment, ProgramHash, Step};

use super::{RECENT_STATES, Referee, State};

impl Referee {
    /// Finds the samples without a record that lead to a lineage from a state that may be continued from, and goes there; the first of them may
    /// have a change mark.
    pub(super) fn recover(&mut self, lineage: Lineage) -> bool {
        let newest = (self.floor..self.states.len()).rev().take(RECENT_STATES);
        let mut from: Vec<(usize, Option<ProgramHash>, Lineage)> = Vec::new();
        for place in newest {
            let state = &self.states[place];
            from.push((place, None, state.lineage));
            let others = self.versions().all().map(|program| program.hash);
            let others = others.filter(|hash| *hash != state.program);
            from.extend(others.map(|to| (place, Some(to), state.lineage.changed(to))));
        }
        let lineages: Vec<Lineage> = from.iter().map(|(.., lineage)| *lineage).collect();
        let Some((start, samples)) = self.unrecorded.samples_to(lineage, &lineages) else {
            return false;
        };
        let (place, mut change, _) = from[start];
        self.newest = Some(place);
        let stepped = self.states[place].stepped;
        for inputs in samples {
            self.step(stepped, &Step { change: change.take(), inputs });
        }
        self.truth = None;
        true
    }

    pub(super) fn step(&mut self, moment: Moment, step: &Step) {
        self.choice = self.choice.saturating_sub(1);
        let Some(place) = self.newest else {
            return;
        };
        let lineage = self.states[place].lineage;
        let Some((hash, mut bits)) = self.taken_from(place, step) else {
            // A program that is not known here: nothing after it is judged.
            self.gaps += 1;
            return self.misses_records();
        };
        let versions = Versions::new(&self.program, self.change.as_ref(), self.place);
        let earlier = || self.earlier.iter().find(|program| program.hash == hash);
        let Some(program) = versions.of(hash).or_else(earlier) else {
            return;
        };
        let outputs = scan(&program.executable, &mut self.scratch, &mut bits, &step.inputs);
        self.remember(moment, (hash, lineage.after_step(step)), bits);
        self.truth = Some((moment, outputs));
    }

    /// The program that takes a step from the state at a place, and its state before the step; none where a change leads to a program that is not known.
    pub(super) fn taken_from(&self, place: usize, step: &Step) -> Option<(ProgramHash, Image)> {
        let State { program: before, bits, .. } = &self.states[place];
        let hash = step.change.unwrap_or(*before);
        let program = self.program_with(hash)?;
        if hash == *before {
            return Some((hash, bits.clone()));
        }
        let inputs = step.inputs.words();
        let converted = self.versions().convert((*before, hash), bits.words(), inputs)?;
        Some((hash, Image::from_words(program.executable.state_count(), &converted).ok()?))
    }
}

/// x(t+1) in place of x(t), and h(x(t), u(t)).
pub(super) fn scan(
    executable: &Executable,
    scratch: &mut Scratch,
    state: &mut Image,
    inputs: &Image,
) -> Image {
    let mut outputs = Image::zero(executable.output_count());
    executable.step(scratch, state.words_mut(), inputs.words(), outputs.words_mut());
    outputs
}
