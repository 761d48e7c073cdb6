//! The points by which inputs and outputs are judged: those of the program that took the newest sample of the reference run.

use std::sync::Arc;

use understudy_remote_io::Layout;
use understudy_wire::ProgramHash;

use super::{Referee, Unrecorded};

/// The points that count, and the version of the program that they are of.
#[derive(Debug, Clone)]
pub(super) struct Points {
    pub(super) version: ProgramHash,
    layout: Arc<Layout>,
    /// The remote I/O has started again, and has not sampled since: it may have those of either version.
    pub(super) is_new: bool,
}

impl Points {
    pub(super) fn new(version: ProgramHash, layout: &Arc<Layout>) -> Self {
        Self { version, layout: Arc::clone(layout), is_new: false }
    }
}

impl Referee {
    /// The layout of the newest sample.
    pub fn layout(&self) -> &Layout {
        &self.points.layout
    }

    /// A version of the program has taken a sample. Outputs that stay are held, and go to their fail-safe values, from where they are; new ones have
    /// their fail-safe values until they are proved.
    pub(super) fn lay_out(&mut self, version: ProgramHash) {
        let from = std::mem::replace(&mut self.points.version, version);
        self.points.is_new = false;
        let Some(change) = self.programs.change.clone() else {
            return;
        };
        let Some(passage) = change.passage(self.programs.place, (from, version)) else {
            return;
        };
        self.points = Points::new(version, passage.to());
        self.unrecorded = Unrecorded::new(passage.to().sourced_bits());
        let Some(fallback) = self.fallback_in_force() else {
            self.last_true = None;
            return self.descent.forget();
        };
        let fail_safe = fallback.fail_safe;
        let moved = |outputs: &_| passage.outputs(outputs, &fail_safe);
        self.last_true = self.last_true.as_ref().map(moved);
        self.descent.moves(moved);
        self.descent.begins_anew();
    }
}
