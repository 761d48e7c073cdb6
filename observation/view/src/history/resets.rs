//! Which input resets a stopped program, of each version that it may have.

use understudy_cycle::{Layout, OnlineChange};
use understudy_wire::{ProgramHash, ProgramId};

/// Versions that are known, at most.
const MOST_VERSIONS: usize = 64;

/// The input of each version that resets it, as a bit of u(i); nothing of one that never stops.
#[derive(Debug, Clone)]
pub(super) struct Resets {
    /// The newest last.
    of_versions: Vec<(ProgramHash, Option<usize>)>,
}

impl Resets {
    pub(super) fn new(version: ProgramHash, layout: &Layout) -> Self {
        Self { of_versions: vec![(version, in_layout(layout))] }
    }

    /// The reset of a version; nothing of one that never stops, or is not known.
    pub(super) fn of(&self, version: ProgramHash) -> Option<usize> {
        self.known(version).flatten()
    }

    fn known(&self, version: ProgramHash) -> Option<Option<usize>> {
        self.of_versions.iter().rev().find(|(of, _)| *of == version).map(|(_, reset)| *reset)
    }

    /// The program may change by this from now on.
    pub(super) fn learn(&mut self, change: &OnlineChange, program: ProgramId) {
        let Some(changed) = change.of(program) else {
            return;
        };
        let versions = [changed.before.hash, changed.after.hash];
        // Both have the points of the one that is known where the change replaces none.
        let known = versions.iter().find_map(|version| self.known(*version)).flatten();
        for version in versions {
            let reset = change.layout(program, version).map_or(known, |layout| in_layout(layout));
            self.of_versions.retain(|(of, _)| *of != version);
            self.of_versions.push((version, reset));
        }
        let more = self.of_versions.len().saturating_sub(MOST_VERSIONS);
        self.of_versions.drain(..more);
    }
}

fn in_layout(layout: &Layout) -> Option<usize> {
    layout.stop.map(|stop| stop.reset)
}
