//! What a station is told when it starts.

use std::sync::Arc;

use understudy_cycle::Agreement;
use understudy_executable::Executable;
use understudy_wire::{Epoch, ProgramHash, ProgramId, StationId};

/// One of the cluster's programs, compiled.
#[derive(Debug, Clone)]
pub struct Program {
    /// Of its canonical text.
    pub hash: ProgramHash,
    /// Its f and h.
    pub executable: Executable,
}

/// A station's own settings.
#[derive(Debug, Clone)]
pub struct Settings {
    /// Its rank.
    pub station: StationId,
    /// What all agreed on.
    pub agreement: Arc<Agreement>,
    /// All programs of the cluster, in order; a controller runs its own, an understudy all of them.
    pub programs: Arc<[Program]>,
    /// The generated parity controller, which an understudy evaluates in [`understudy_cycle::Mode::Paper`]. It publishes no parity
    /// word in that mode where this is absent.
    pub generated: Option<Arc<Executable>>,
    /// The epoch that it starts when nobody is there: later than any that the cluster has had (the wall clock at start serves).
    pub epoch: Epoch,
}

impl Settings {
    /// The programs that this station runs.
    pub fn runs(&self) -> impl Iterator<Item = ProgramId> + use<> {
        let own = self.station.0;
        let controllers = self.agreement.schedule.controllers() as u8;
        let range = if own < controllers {
            own..own + 1
        } else {
            0..controllers
        };
        range.map(ProgramId)
    }
}
