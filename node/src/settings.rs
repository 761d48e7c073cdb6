//! Configuration of a station.

use std::sync::Arc;

use understudy_cycle::Agreement;
use understudy_executable::Executable;
use understudy_wire::{Epoch, ProgramHash, ProgramId, StationId};

/// Compiled program of the cluster.
#[derive(Debug, Clone)]
pub struct Program {
    /// Hash of its canonical text.
    pub hash: ProgramHash,
    /// Its f and h, (1) and (2).
    pub executable: Executable,
}

/// Configuration of one station.
#[derive(Debug, Clone)]
pub struct Settings {
    /// Its rank.
    pub station: StationId,
    /// Configuration shared by all members.
    pub agreement: Arc<Agreement>,
    /// All programs of the cluster, in order; a controller runs its own, an understudy all of them.
    pub programs: Arc<[Program]>,
    /// The generated parity controller, which an understudy evaluates in [`understudy_cycle::Mode::Paper`]. Absent in the other mode, and where a
    /// program has numbers, for which there is no circuit: then the parity word is the sum of the outputs of its replicas (9).
    pub generated: Option<Arc<Executable>>,
    /// Epoch that it founds when it receives no other member: later than any earlier one of the cluster, such as the
    /// wall clock at its start.
    pub epoch: Epoch,
}

impl Settings {
    /// The programs that this station runs.
    pub fn runs(&self) -> impl Iterator<Item = ProgramId> + use<> {
        let own = self.station.0;
        let controllers = self.agreement.schedule.controllers() as u8;
        let range = if own < controllers { own..own + 1 } else { 0..controllers };
        range.map(ProgramId)
    }
}
