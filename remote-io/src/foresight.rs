//! What a remote I/O would drive if these turns were all that it heard: its own rule, asked before it has to answer.

use std::sync::Arc;

use understudy_cycle::Mode;
use understudy_wire::{Frame, Image, Lineage, ProgramId, Source, StationSet};

use crate::event::Missing;
use crate::selection::{Heard, Selection};
use crate::settings::ValueFault;
use crate::trust::Trust;

/// One cycle as it could be heard.
#[derive(Debug, Clone, Copy)]
pub struct Foreseen<'a> {
    /// The frame of each station's turn, by rank; nothing where it is silent.
    pub turns: &'a [Option<Arc<Frame>>],
    /// N.
    pub controllers: usize,
    /// How many failures are masked.
    pub mode: Mode,
}

impl Foreseen<'_> {
    /// Where the `width` outputs of `program` would come from, and what they would be, if its true lineage after this cycle's
    /// sample is `truth` and it has found the states of `excluded` faulty.
    ///
    /// # Errors
    /// Why nothing true would be there; then the outputs are held, and fall safe.
    pub fn source(
        &self,
        program: ProgramId,
        truth: Lineage,
        width: usize,
        excluded: StationSet,
    ) -> Result<(Source, Image), Missing> {
        let heard = Heard {
            turns: self.turns,
            controllers: self.controllers,
            mode: self.mode,
        };
        let mut trust = Trust::excluding(excluded);
        let (selection, _) = heard.select(program, truth, width, &mut trust, ValueFault::Hold);
        match selection {
            Selection::Direct(outputs) => Ok((Source::Direct, outputs)),
            Selection::Reconstructed(outputs, _) => Ok((Source::Reconstructed, outputs)),
            Selection::Missing(missing) => Err(missing),
        }
    }
}
