//! Protection of programs, and lost states.

use understudy_journal::Record;
use understudy_remote_io::{Event as RemoteIoEvent, Lacking, LackingReason};
use understudy_wire::{Member, ProgramId};

use super::Model;
use super::standing::{Change, ProgramChange};
use crate::protection::{LackingStation, LostState, Protection};
use crate::station::StationState;

const UNPROTECTED: &str = "unprotected";
const STATE_LOST: &str = "state-lost";

impl Model {
    /// The process of a remote I/O begins or ends: the alarms about its reports and its commands are over. A new one says so if its field or
    /// its link fails.
    pub(super) fn remote_io_is_new(&mut self, program: ProgramId) {
        let name = self.members.name(Member::RemoteIo(program)).to_owned();
        let over = [STATE_LOST, "forced", "field-lost", "field-contested", "link-failed"];
        self.alarms.all_over(&name, &over, self.cycles.of(None));
        if let Some(history) = self.histories.get_mut(program.index()) {
            history.starts_again();
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
                let protection = Protection { protected: true, since: cycle, lacking: Vec::new() };
                self.alarms.over(&subject(UNPROTECTED), cycle);
                self.protection_is(program, cycle, protection);
            }
            RemoteIoEvent::Unprotected { since, lacking, .. } => {
                let since = self.cycles.of_known(*since).unwrap_or(cycle);
                let lacking = lacking.iter().map(|one| self.lacking(program, one));
                let protection = Protection { protected: false, since, lacking: lacking.collect() };
                let text = protection.text();
                self.alarms.raise(subject(UNPROTECTED), cycle, text);
                self.protection_is(program, cycle, protection);
            }
            RemoteIoEvent::StateLost { applied, newest, holder, asks, .. } => {
                let known = |moment| self.cycles.of_known(moment);
                let until = applied.map_or(Some(cycle), known);
                let age = until.zip(known(*newest)).map(|(until, newest)| until - newest);
                let lost = LostState {
                    since: cycle,
                    newest: newest.cycle.0,
                    holder: self.members.name(Member::Station(*holder)).to_owned(),
                    age_cycles: age.and_then(|age| u64::try_from(age).ok()),
                    asks: *asks,
                };
                self.alarms.raise(subject(STATE_LOST), cycle, lost.text());
                self.lost_is(program, cycle, Some(lost));
            }
            // A newer state has become available since.
            RemoteIoEvent::ChoiceRefused { newest: Some(newest), .. } => {
                let standing = self.changes.now().program(program);
                if let Some(mut lost) = standing.and_then(|own| own.lost.clone()) {
                    let newer = newest.cycle.0.saturating_sub(lost.newest);
                    lost.age_cycles = lost.age_cycles.map(|age| age.saturating_sub(newer));
                    lost.newest = newest.cycle.0;
                    self.lost_is(program, cycle, Some(lost));
                }
            }
            RemoteIoEvent::StateRecovered { .. }
            | RemoteIoEvent::AdoptedLineage { .. }
            | RemoteIoEvent::StartedCold { .. } => {
                let standing = self.changes.now().program(program);
                if standing.is_some_and(|own| own.lost.is_some()) {
                    self.lost_is(program, cycle, None);
                }
                self.alarms.over(&subject(STATE_LOST), cycle);
            }
            _ => {}
        }
    }

    fn protection_is(&mut self, program: ProgramId, cycle: i64, protection: Protection) {
        let change = ProgramChange::Protection(Box::new(protection));
        let change = Change::Program(program, change);
        self.changes.reported(Member::RemoteIo(program), cycle, change);
    }

    fn lost_is(&mut self, program: ProgramId, cycle: i64, lost: Option<LostState>) {
        let change = Change::Program(program, ProgramChange::Lost(lost.map(Box::new)));
        self.changes.reported(Member::RemoteIo(program), cycle, change);
    }

    /// Why a station cannot prove the outputs of a program: the station itself, or a link, as far as others report it.
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
                        state @ (StationState::Killed
                        | StationState::Suspended
                        | StationState::Ended),
                    ) => format!("{name} is {}", state.text()),
                    _ if is_heard => {
                        link = Some(format!("{name} → {remote_io}"));
                        format!("the link {name} → {remote_io} is broken")
                    }
                    _ => format!(
                        "{name} is not received: it or the link {name} → {remote_io} has failed"
                    ),
                };
                ("not-received", text)
            }
            LackingReason::Joining => ("joining", format!("{name} requests the state")),
            LackingReason::Behind { stepped } => {
                link = Some(format!("{remote_io} → {name}"));
                let last = self
                    .cycles
                    .of_known(stepped)
                    .map_or_else(|| "yet".to_owned(), |stepped| format!("since cycle {stepped}"));
                let text = format!(
                    "the state of {name} is too old: no sample received {last} (link {remote_io} → {name})"
                );
                ("behind", text)
            }
            LackingReason::Excluded => {
                ("excluded", format!("{name} is excluded until the operator releases it"))
            }
            LackingReason::Failed => {
                ("failed", format!("{name} has failed, and mode `paper` masks one failure only"))
            }
        };
        LackingStation { station: name.to_owned(), reason, link, text }
    }
}
