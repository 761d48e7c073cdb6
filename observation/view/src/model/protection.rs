//! Protection of programs, and lost states.

use std::ops::RangeInclusive;

use understudy_journal::Record;
use understudy_remote_io::{Event as RemoteIoEvent, Lacking, LackingReason};
use understudy_wire::{Member, OrderRefusal, ProgramId, ProgramSet, StationId, StationSet};

use super::Model;
use super::pairs::{INPUT_MODULES, PARTNER_LOST};
use super::programs::POINTS_UNKNOWN;
use super::silence::{NOT_RECEIVED, Silence};
use super::standing::{Change, ProgramChange, Standing};
use crate::alarm::{STATE_LOST, Subject, UNPROTECTED};
use crate::protection::{LackingStation, LostState, Protection, asked_because, old_inputs_text};
use crate::station::StationState;

/// The stations that a remote I/O receives, those of them that publish for its program, and whether it receives no station at all.
type Evidence = (StationSet, StationSet, Option<Silence>);

/// What is known of the stations that prove the outputs of a program which is not protected.
#[derive(Debug, Clone, Default)]
pub(super) struct Attribution {
    evidence: Option<Evidence>,
    /// The first cycle of those in a row with it.
    since: i64,
    /// Whether its causes follow from it.
    is_done: bool,
}

impl Attribution {
    /// Takes the evidence of a cycle; whether it has been the same for long enough and was not used.
    fn is_due(&mut self, evidence: Evidence, cycle: i64, flag_after: i64) -> bool {
        if self.evidence != Some(evidence) {
            *self = Self { evidence: Some(evidence), since: cycle, is_done: false };
        }
        let is_due = !self.is_done && cycle.saturating_sub(self.since) >= flag_after;
        self.is_done |= is_due;
        is_due
    }

    pub(super) fn shift(&mut self, by: i64) {
        self.since = self.since.saturating_add(by);
    }
}

/// Whether a state is older than the newest output of which it is known that it was applied. One that is as new is lost because a newer output may
/// have been applied, so its age is not known.
const fn is_old(age: &u64) -> bool {
    *age > 0
}

/// Reasons that a later cycle can refute.
const JOINING: &str = "joining";

impl Model {
    /// The process of a remote I/O begins or ends: the alarms about its reports and its commands are over. A new one says so if its field
    /// fails.
    pub(super) fn remote_io_is_new(&mut self, member: Member, program: ProgramId) {
        let name = self.members().name(member).to_owned();
        let over = [
            STATE_LOST,
            PARTNER_LOST,
            INPUT_MODULES,
            POINTS_UNKNOWN,
            "forced",
            "field-lost",
            "field-contested",
        ];
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
                self.alarms.none_concerns(UNPROTECTED, program, cycle);
                self.protection_is(program, cycle, protection);
            }
            RemoteIoEvent::Unprotected { since, lacking, .. } => {
                let since = self.cycles.of_known(*since).unwrap_or(cycle);
                // A single frame of its last cycle may still have come.
                let until = self.cycles.latest().map_or(cycle, |latest| latest.max(cycle));
                let cycles = since.saturating_add(1)..=until;
                let lacking = lacking.iter().map(|one| self.lacking(program, one, cycles.clone()));
                let protection = Protection { protected: false, since, lacking: lacking.collect() };
                let causes = self.causes(program, &protection.lacking, &cycles);
                self.attributed(program, cycle, causes);
                self.protection_is(program, cycle, protection);
            }
            RemoteIoEvent::StateLost { applied, newest, holder, asks, reason, inputs, .. } => {
                let known = |moment| self.cycles.of_known(moment);
                let until = applied.map_or(Some(cycle), known);
                let age = until.zip(newest.and_then(known)).map(|(until, newest)| until - newest);
                let lost = LostState {
                    since: cycle,
                    newest: newest.map(|newest| newest.cycle.0),
                    holder: holder
                        .map(|holder| self.members().name(Member::Station(holder)).to_owned()),
                    age_cycles: age.and_then(|age| u64::try_from(age).ok()).filter(is_old),
                    asks: *asks,
                    reason: asked_because(*reason),
                    inputs: inputs.map(old_inputs_text),
                };
                self.alarms.raise_or_retell(subject(STATE_LOST), cycle, lost.text());
                self.lost_is(program, cycle, Some(lost));
            }
            // A newer state has become available since.
            RemoteIoEvent::ChoiceRefused {
                refusal: OrderRefusal::OtherState { newest }, ..
            } => {
                let standing = self.changes.now().program(program);
                if let Some(mut lost) = standing.and_then(|own| own.lost.clone()) {
                    let newer = lost.newest.map(|known| newest.cycle.0.saturating_sub(known));
                    let age = lost.age_cycles.zip(newer);
                    lost.age_cycles =
                        age.map(|(age, newer)| age.saturating_sub(newer)).filter(is_old);
                    lost.newest = Some(newest.cycle.0);
                    self.lost_is(program, cycle, Some(lost));
                }
            }
            RemoteIoEvent::StateRecovered { .. }
            | RemoteIoEvent::AdoptedLineage { .. }
            | RemoteIoEvent::StartedCold { .. }
            | RemoteIoEvent::StartedWarm { .. } => {
                self.alarms.over(&subject(STATE_LOST), cycle);
                let standing = self.changes.now().program(program);
                let is_lost = standing.is_some_and(|own| own.lost.is_some());
                // Of two remote I/Os, the other one may ask too.
                let answers = matches!(event, RemoteIoEvent::StateRecovered { from: None, .. });
                let other = record.member.and_then(Member::partner);
                let other = other.map(|other| self.members().name(other).to_owned());
                let still_asks =
                    answers && other.is_some_and(|other| self.alarms.lasts(&(other, STATE_LOST)));
                if is_lost && !still_asks {
                    self.lost_is(program, cycle, None);
                }
            }
            _ => {}
        }
    }

    /// Each cause has its alarm.
    fn attributed(&mut self, program: ProgramId, cycle: i64, causes: Vec<(Subject, String)>) {
        for subject in self.alarms.causes_for(UNPROTECTED, program) {
            if causes.iter().all(|(cause, _)| *cause != subject) {
                self.alarms.concerns_no_more(&subject, Some(program), cycle);
            }
        }
        for (subject, text) in causes {
            self.alarms.concerns(&subject, Some(program), cycle, text);
        }
    }

    /// The causes in a closed cycle. A remote I/O reports them once, when protection is lost: one that returns or fails meanwhile is found from the
    /// turns that the remote I/O receives, once they have been the same for as long as a loss of protection takes to be reported.
    pub(super) fn attribute_again(&mut self, cycle: i64) {
        let lacks = |standing: &Standing, program| {
            let known = standing.program(program).and_then(|own| own.protection.as_ref());
            known.is_some_and(|protection| !protection.protected)
        };
        let now = self.changes.now();
        let lacking: ProgramSet = self.program_ids().filter(|id| lacks(now, *id)).collect();
        let mut attributions = std::mem::take(&mut self.attributions);
        if lacking.is_empty() {
            attributions.fill(Attribution::default());
            self.attributions = attributions;
            return;
        }
        let standing = self.changes.at(cycle);
        let mut due = Vec::new();
        for (program, attribution) in self.program_ids().zip(&mut attributions) {
            if !lacking.contains(program) || !lacks(&standing, program) {
                *attribution = Attribution::default();
            } else if self.evidence(program, cycle).is_some_and(|evidence| {
                let flag_after = i64::from(self.cluster.agreement().flag_after);
                attribution.is_due(evidence, cycle, flag_after)
            }) {
                due.extend(
                    self.protection_in(&standing, program, cycle).map(|found| (program, found)),
                );
            }
        }
        drop(standing);
        self.attributions = attributions;
        for (program, found) in due.into_iter().filter(|(_, found)| !found.lacking.is_empty()) {
            let cycles = cycle.saturating_sub(1)..=cycle;
            let causes = self.causes(program, &found.lacking, &cycles);
            self.attributed(program, cycle, causes);
        }
    }

    /// What a remote I/O receives about a cycle.
    fn evidence(&self, program: ProgramId, cycle: i64) -> Option<Evidence> {
        let cycles = cycle.saturating_sub(1)..=cycle;
        let heard = self.heard_in(program, cycles.clone())?;
        let heard: StationSet = self.provers(program).filter(|id| heard.contains(*id)).collect();
        let covers = |id: &StationId| self.covers(*id, cycle).contains(program);
        let publish = heard.iter().filter(covers).collect();
        Some((heard, publish, self.silence(program, &cycles)))
    }

    /// The stations that prove the outputs of a program: its controller and the understudies.
    fn provers(&self, program: ProgramId) -> impl Iterator<Item = StationId> + '_ {
        let schedule = &self.cluster.agreement().schedule;
        self.station_ids().filter(move |id| id.0 == program.0 || schedule.is_understudy(*id))
    }

    fn protection_is(&mut self, program: ProgramId, cycle: i64, protection: Protection) {
        let change = ProgramChange::Protection(Box::new(protection));
        let change = Change::Program(program, change);
        let by = self.changes.now().driver(program);
        self.changes.reported(by, cycle, change);
    }

    fn lost_is(&mut self, program: ProgramId, cycle: i64, lost: Option<LostState>) {
        let change = Change::Program(program, ProgramChange::Lost(lost.map(Box::new)));
        let by = self.changes.now().driver(program);
        self.changes.reported(by, cycle, change);
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
        let proves: StationSet = self.provers(program).collect();
        let slots = self.cluster.agreement().schedule.spare_slots();
        let lacking = self.station_ids().filter_map(|id| {
            let name = self.members().name(Member::Station(id));
            let known = reported.lacking.iter().find(|one| one.station == name);
            if !proves.contains(id) {
                return known.cloned();
            }
            let is_received = heard.contains(id);
            let covers = || self.covers(id, cycle).contains(program);
            match known.map(|known| known.reason) {
                None | Some(NOT_RECEIVED) if !is_received && slots.contains(id) => None,
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
    pub(super) fn heard_in(
        &self,
        program: ProgramId,
        cycles: RangeInclusive<i64>,
    ) -> Option<StationSet> {
        let deadlines = cycles.filter_map(|cycle| self.deadline(program, cycle)?.driven.as_ref());
        deadlines.map(|driven| driven.heard).reduce(StationSet::or)
    }

    fn joining(&self, station: StationId) -> LackingStation {
        let station = self.members().name(Member::Station(station)).to_owned();
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
        let name = self.members().name(Member::Station(station));
        let remote_io = self.driver_name(program, *cycles.end());
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
        let name = self.members().name(Member::Station(station));
        let remote_io = self.driver_name(program, *cycles.end());
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
