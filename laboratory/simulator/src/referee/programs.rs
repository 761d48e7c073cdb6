//! The programs that a remote I/O may run: that with which it began, those of its online change, and those of the changes before that one.

use std::sync::Arc;

use understudy_cycle::{OnlineChange, Program, Versions};
use understudy_wire::{Image, ProgramHash, ProgramId, Step};

/// Programs of changes that are over, which are known at most.
pub(super) const EARLIER_PROGRAMS: usize = 64;

#[derive(Debug, Clone)]
pub(super) struct Programs {
    pub(super) first: Program,
    pub(super) change: Option<Arc<OnlineChange>>,
    /// Those of changes before that one, the newest last: one of them runs on where the change is of other programs.
    earlier: Vec<Program>,
    /// The place of the program in the cluster.
    pub(super) place: ProgramId,
}

impl Programs {
    pub(super) fn new(place: ProgramId, first: Program) -> Self {
        Self { first, change: None, earlier: Vec::new(), place }
    }

    pub(super) fn learn(&mut self, change: &Arc<OnlineChange>) {
        let last = self.change.replace(Arc::clone(change));
        let of_program = last.as_ref().and_then(|last| last.of(self.place));
        for program in of_program.into_iter().flat_map(|last| [&last.before, &last.after]) {
            self.earlier.retain(|known| known.hash != program.hash);
            self.earlier.push(program.clone());
        }
        let more = self.earlier.len().saturating_sub(EARLIER_PROGRAMS);
        self.earlier.drain(..more);
    }

    /// The first one, and those of the change.
    pub(super) fn versions(&self) -> Versions<'_> {
        Versions::new(&self.first, self.change.as_ref(), self.place)
    }

    /// All that are known; one of an earlier change may come twice.
    pub(super) fn all(&self) -> impl Iterator<Item = &Program> {
        self.versions().all().chain(&self.earlier)
    }

    /// The program with this hash.
    pub(super) fn of(&self, hash: ProgramHash) -> Option<&Program> {
        self.all().find(|program| program.hash == hash)
    }

    /// The program that takes a step from this state of a program, and its state before the step; none where a change leads to a program that is not known.
    pub(super) fn taken(
        &self,
        (before, bits): (ProgramHash, &Image),
        step: &Step,
    ) -> Option<(&Program, Image)> {
        let program = self.of(step.change.unwrap_or(before))?;
        if program.hash == before {
            return Some((program, bits.clone()));
        }
        let hashes = (before, program.hash);
        let converted = self.versions().convert(hashes, bits.words(), step.inputs.words())?;
        Some((program, Image::from_words(program.executable.state_count(), &converted).ok()?))
    }
}
