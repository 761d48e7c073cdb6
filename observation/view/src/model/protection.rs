//! Protection of programs, and lost states.

use std::ops::RangeInclusive;

use understudy_journal::Record;
use understudy_remote_io::{Event as RemoteIoEvent, Lacking, LackingReason};
use understudy_wire::{Member, ProgramId, StationId, StationSet};

use super::Model;
use super::standing::{Change, ProgramChange, Standing};
use crate::protection::{LackingStation, LostState, Protection};
use crate::station::StationState;

const UNPROTECTED: &str = "unprotected";
const STATE_LOST: &str = "state-lost";

/// Reasons that a later cycle can refute.
const NOT_RECEIVED: &str = "not-received";
const JOINING: &str = "joining";

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
                // A single frame of its last cycle may still have come.
                let until = self.cycles.latest().map_or(cycle, |latest| latest.max(cycle));
                let cycles = since.saturating_add(1)..=until;
                let lacking = lacking.iter().map(|one| self.lacking(program, one, cycles.clone()));
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

    /// Protection of a program in a cycle: what its remote I/O reported, without causes that the deadlines and turns of this cycle refute, and with the
    /// stations that it does not receive any more. It reports the causes once, when the protection is lost.
    pub(crate) fn protection_in(
        &self,
        standing: &Standing,
        program: ProgramId,
        cycle: i64,
    ) -> Option<Protection> {
        let reported = standing.program(program)?.protection.clone()?;
        let cycles = cycle.saturating_sub(1)..=cycle;
        let heard = self.heard_in(program, cycles.clone());
        let Some(heard) = heard.filter(|_| !reported.protected) else {
            return Some(reported);
        };
        let schedule = &self.cluster.agreement().schedule;
        let proves = |id: StationId| id.0 == program.0 || schedule.is_understudy(id);
        let lacking = self.station_ids().filter_map(|id| {
            let name = self.members.name(Member::Station(id));
            let known = reported.lacking.iter().find(|one| one.station == name);
            if !proves(id) {
                return known.cloned();
            }
            let is_received = heard.contains(id);
            let covers = || self.covers(id, cycle).contains(program);
            match known.map(|known| known.reason) {
                None | Some(NOT_RECEIVED) if !is_received => {
                    let state = self.station_state_in(standing, id, Some(cycle));
                    Some(self.not_received(program, id, state, cycles.clone()))
                }
                Some(NOT_RECEIVED | JOINING) if is_received && covers() => None,
                Some(NOT_RECEIVED) => Some(self.joining(id)),
                _ => known.cloned(),
            }
        });
        Some(Protection { lacking: lacking.collect(), ..reported })
    }

    /// The stations that the remote I/O of a program received in any of these cycles; nothing where none of its deadlines is known.
    fn heard_in(&self, program: ProgramId, cycles: RangeInclusive<i64>) -> Option<StationSet> {
        let deadlines = cycles.filter_map(|cycle| self.deadline(program, cycle)?.driven.as_ref());
        deadlines.map(|driven| driven.heard).reduce(StationSet::or)
    }

    fn joining(&self, station: StationId) -> LackingStation {
        let station = self.members.name(Member::Station(station)).to_owned();
        let text = format!("{station} requests the state");
        LackingStation { station, reason: JOINING, link: None, text }
    }

    /// A station that a remote I/O did not receive in these cycles. A link is the cause only where another remote I/O received the station.
    fn not_received(
        &self,
        program: ProgramId,
        station: StationId,
        state: StationState,
        cycles: RangeInclusive<i64>,
    ) -> LackingStation {
        let name = self.members.name(Member::Station(station));
        let remote_io = self.members.name(Member::RemoteIo(program));
        let others = self.program_ids().filter(|other| *other != program);
        let others = others.filter_map(|other| self.heard_in(other, cycles.clone()));
        let is_received = others.map(|heard| heard.contains(station)).reduce(|any, one| any | one);
        let link = format!("{name} → {remote_io}");
        let (text, link) = match (state, is_received) {
            (StationState::Joining | StationState::ShadowMode, _) => return self.joining(station),
            (StationState::Killed | StationState::Suspended | StationState::Ended, _) => {
                (format!("{name} is {}", state.text()), None)
            }
            (_, Some(true)) => (format!("the link {link} is broken"), Some(link)),
            (_, Some(false)) => (format!("{name} is not received by any remote I/O"), None),
            (_, None) => {
                (format!("{name} is not received: it or the link {link} has failed"), None)
            }
        };
        LackingStation { station: name.to_owned(), reason: NOT_RECEIVED, link, text }
    }

    /// Why a station cannot prove the outputs of a program: the station itself, or a link, as far as others reported it in these cycles.
    fn lacking(
        &self,
        program: ProgramId,
        lacking: &Lacking,
        cycles: RangeInclusive<i64>,
    ) -> LackingStation {
        let station = lacking.station;
        let name = self.members.name(Member::Station(station));
        let remote_io = self.members.name(Member::RemoteIo(program));
        let mut link = None;
        let (reason, text) = match lacking.reason {
            LackingReason::NotReceived => {
                let state = self.station_state(station).unwrap_or(StationState::NotReceived);
                return self.not_received(program, station, state, cycles);
            }
            LackingReason::Joining => return self.joining(station),
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
