//! Protection of programs, and states that are lost.

use understudy_journal::Record;
use understudy_remote_io::{Event as RemoteIoEvent, Lacking, LackingReason};
use understudy_wire::{Member, ProgramId};

use super::Model;
use crate::protection::{LackingStation, LostState, Protection};
use crate::station::StationState;

const UNPROTECTED: &str = "unprotected";
const STATE_LOST: &str = "state-lost";

impl Model {
    /// Whether a program is protected; nothing while its remote I/O has not reported it.
    pub fn protection(&self, program: ProgramId) -> Option<&Protection> {
        self.programs.get(program.index())?.protection.as_ref()
    }

    /// What is left of the state of a program, where it is lost.
    pub fn lost_state(&self, program: ProgramId) -> Option<&LostState> {
        self.programs.get(program.index())?.lost.as_ref()
    }

    /// The process of a remote I/O begins or ends: what it reported is not known any more.
    pub(super) fn forget_protection(&mut self, program: ProgramId) {
        if let Some(track) = self.programs.get_mut(program.index()) {
            track.protection = None;
            track.lost = None;
            let name = self.members.name(Member::RemoteIo(program)).to_owned();
            self.alarms.over(&(name, STATE_LOST), self.cycles.of(None));
        }
    }

    pub(super) fn protection_changed(
        &mut self,
        record: &Record,
        program: ProgramId,
        cycle: i64,
        event: &RemoteIoEvent,
    ) {
        let subject = |alarm| (record.name.clone(), alarm);
        match event {
            RemoteIoEvent::Protected { .. } => {
                self.programs[program.index()].protection = Some(Protection {
                    protected: true,
                    since: cycle,
                    lacking: Vec::new(),
                });
                self.alarms.over(&subject(UNPROTECTED), cycle);
            }
            RemoteIoEvent::Unprotected { since, lacking, .. } => {
                let since = self.cycles.of_known(*since).unwrap_or(cycle);
                let lacking = lacking.iter().map(|one| self.lacking(program, one));
                let protection = Protection {
                    protected: false,
                    since,
                    lacking: lacking.collect(),
                };
                let text = protection.text();
                self.alarms.raise(subject(UNPROTECTED), cycle, text);
                self.programs[program.index()].protection = Some(protection);
            }
            RemoteIoEvent::StateLost {
                applied,
                newest,
                holder,
                asks,
                ..
            } => {
                let known = |moment| self.cycles.of_known(moment);
                let until = applied.map_or(Some(cycle), known);
                let age = until
                    .zip(known(*newest))
                    .map(|(until, newest)| until - newest);
                let lost = LostState {
                    since: cycle,
                    newest: newest.cycle.0,
                    holder: self.members.name(Member::Station(*holder)).to_owned(),
                    age_cycles: age.and_then(|age| u64::try_from(age).ok()),
                    asks: *asks,
                };
                self.alarms.raise(subject(STATE_LOST), cycle, lost.text());
                self.programs[program.index()].lost = Some(lost);
            }
            // A newer state has become available since.
            RemoteIoEvent::ChoiceRefused {
                newest: Some(newest),
                ..
            } => {
                if let Some(lost) = &mut self.programs[program.index()].lost {
                    let newer = newest.cycle.0.saturating_sub(lost.newest);
                    lost.age_cycles = lost.age_cycles.map(|age| age.saturating_sub(newer));
                    lost.newest = newest.cycle.0;
                }
            }
            RemoteIoEvent::StateRecovered { .. }
            | RemoteIoEvent::AdoptedLineage { .. }
            | RemoteIoEvent::StartedCold { .. } => {
                self.programs[program.index()].lost = None;
                self.alarms.over(&subject(STATE_LOST), cycle);
            }
            _ => {}
        }
    }

    /// Why a station cannot stand in for a program: itself, or a link, as far as others say how it is.
    fn lacking(&self, program: ProgramId, lacking: &Lacking) -> LackingStation {
        let station = lacking.station;
        let name = self.members.name(Member::Station(station));
        let remote_io = self.members.name(Member::RemoteIo(program));
        let mut link = None;
        let (reason, text) = match lacking.reason {
            LackingReason::NotReceived => {
                let state = self.station_state(station);
                let mut others = (0..).map(ProgramId).zip(&self.programs);
                let is_heard = others
                    .any(|(other, track)| other != program && track.hears().contains(station));
                let text = match state {
                    Some(
                        state
                        @ (StationState::Killed | StationState::Stopped | StationState::Ended),
                    ) => format!("{name} is {}", state.word()),
                    _ if is_heard => {
                        link = Some(format!("{name} → {remote_io}"));
                        format!("the link {name} → {remote_io} is broken")
                    }
                    _ => format!(
                        "{name} is not received: it is down, or the link {name} → {remote_io}"
                    ),
                };
                ("not-received", text)
            }
            LackingReason::Joining => ("joining", format!("{name} asks for the state")),
            LackingReason::Behind { stepped } => {
                link = Some(format!("{remote_io} → {name}"));
                let last = self.cycles.of_known(stepped).map_or_else(
                    || "yet".to_owned(),
                    |stepped| format!("since cycle {stepped}"),
                );
                let text = format!(
                    "the state of {name} is too old: no sample received {last} (link {remote_io} → {name})"
                );
                ("behind", text)
            }
            LackingReason::Excluded => (
                "excluded",
                format!("{name} is excluded until the operator releases it"),
            ),
            LackingReason::Failed => (
                "failed",
                format!("{name} has failed, and the paper's mode masks one failure"),
            ),
        };
        LackingStation {
            station: name.to_owned(),
            reason,
            link,
            text,
        }
    }
}
