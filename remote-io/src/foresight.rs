//! The output that a remote I/O would apply if it received given turns: its own rule, evaluated for a viewer.

use std::sync::Arc;

use understudy_cycle::{Mode, ValueFault};
use understudy_wire::{Frame, Image, Lineage, ProgramId, Source, StationSet};

use crate::event::Missing;
use crate::selection::{Received, Selection};
use crate::trust::Trust;

/// Turns of one cycle.
#[derive(Debug, Clone, Copy)]
pub struct Foreseen<'a> {
    /// Frame of each station's turn, by rank; `None` where it was not received.
    pub turns: &'a [Option<Arc<Frame>>],
    /// Number of controllers, N.
    pub controllers: usize,
    /// Number of failures that are masked.
    pub mode: Mode,
}

impl Foreseen<'_> {
    /// Source of the `width` outputs of `program`, and their values, where its true lineage after the sample of this
    /// cycle is `truth` and the states of `excluded` were found faulty.
    ///
    /// # Errors
    /// Reason why no output is provable; the remote I/O then holds the outputs and later applies the fail-safe ones.
    pub fn source(
        &self,
        program: ProgramId,
        truth: Lineage,
        width: usize,
        excluded: StationSet,
    ) -> Result<(Source, Image), Missing> {
        let received =
            Received { turns: self.turns, controllers: self.controllers, mode: self.mode };
        let mut trust = Trust::excluding(excluded);
        let (selection, _) = received.select(program, truth, width, &mut trust, ValueFault::Hold);
        match selection {
            Selection::Direct(outputs) => Ok((Source::Direct, outputs)),
            Selection::Reconstructed(outputs, _) => Ok((Source::Reconstructed, outputs)),
            Selection::Missing(missing) => Err(missing),
        }
    }
}
