//! Configuration of a station.

use std::sync::Arc;

use understudy_cycle::{Agreement, OnlineChange, Participant, Program, Versions};
use understudy_wire::{ConfigurationHash, Moment, ProgramId, StationId};

use crate::event::Event;
use crate::generated::Generated;

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
    pub generated: Option<Arc<Generated>>,
    /// First moment of the epoch that it founds when it receives no other member: later than any earlier one of the cluster, such as that of the
    /// wall clock at its start.
    pub founds: Moment,
}

impl Settings {
    /// What can be executed in the place of a program, with the change that a member has loaded.
    pub(crate) fn versions<'a>(
        &'a self,
        member: &'a Participant<Event>,
        program: ProgramId,
    ) -> Versions<'a> {
        let first = &self.programs[program.index()];
        Versions::new(first, member.changing().change(), program)
    }

    /// Takes the programs of one of the configurations of a change for its own.
    pub(crate) fn adopt(&mut self, change: &OnlineChange, own: ConfigurationHash) {
        let mut programs = self.programs.to_vec();
        for (place, program) in (0..).map(ProgramId).zip(&mut programs) {
            if let Some(changed) = change.program_in(own, place) {
                program.clone_from(changed);
            }
        }
        // It was generated from the programs before.
        self.generated = self.generated.take().filter(|_| own == change.before);
        self.programs = programs.into();
    }

    /// The programs that this station runs.
    pub fn runs(&self) -> impl Iterator<Item = ProgramId> + use<> {
        let own = self.station.0;
        let controllers = self.agreement.schedule.controllers() as u8;
        let range = if own < controllers { own..own + 1 } else { 0..controllers };
        range.map(ProgramId)
    }
}
