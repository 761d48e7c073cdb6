//! The steps of the reference run, across change marks, and those of samples that have no record.

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
            let others = self.programs.versions().all().map(|program| program.hash);
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
        let State { lineage, program: before, bits, .. } = &self.states[place];
        let lineage = *lineage;
        let Some((program, mut bits)) = self.programs.taken((*before, bits), step) else {
            // A program that is not known here: nothing after it is judged.
            self.gaps += 1;
            return self.misses_records();
        };
        let hash = program.hash;
        let outputs = scan(&program.executable, &mut self.scratch, &mut bits, &step.inputs);
        self.lay_out(hash);
        self.remember(moment, (hash, lineage.after_step(step)), bits);
        self.truth = Some((moment, outputs));
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
