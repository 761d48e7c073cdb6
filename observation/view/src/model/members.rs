//! What stations report, and the processes that carry members.

use std::collections::BTreeSet;

use understudy_bus::HostEvent;
use understudy_journal::{Process, Record, moment};
use understudy_node::Event as StationEvent;
use understudy_wire::{ConfigurationHash, Member, ProgramId, ProgramSet, StationId, StationSet};

use super::Model;
use super::standing::{Change, ProgramChange, StationChange};
use crate::describe::odd_configuration_text;
use crate::online_change::ChangeReport;

/// A member that drops the frames of another one, since their configurations differ.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Refusal {
    by: String,
    other: Member,
    /// The one of the two that has another configuration than the cluster file.
    odd: Member,
}

/// Alarm of a member that has another configuration than the cluster file.
const REFUSED: &str = "refused";

impl Model {
    pub(super) fn station(&mut self, record: &Record, station: StationId, event: &StationEvent) {
        if station.index() >= self.cluster.agreement().schedule.stations() {
            return;
        }
        let cycle = self.cycles.of(moment(&record.event));
        match event {
            StationEvent::Published { moment, words } => {
                self.published(station, cycle);
                if let Some(cycle) = self.cycles.of_known(*moment) {
                    let programs = words.iter().map(|word| word.mask);
                    let programs = programs.fold(ProgramSet::EMPTY, ProgramSet::or);
                    self.reported(record, Member::Station(station), cycle, programs);
                }
                self.timings.published(*moment, record.at_ns);
                self.turns.published(*moment, station, words);
                self.check_words(*moment);
                return;
            }
            StationEvent::Holds { moment, program, of, lineage, state } => {
                if let Some(history) = self.histories.get_mut(program.index()) {
                    history.holds(*moment, (*of, *lineage), state);
                }
                return;
            }
            StationEvent::Refused { member, theirs, ours } => {
                self.refused(*member, cycle);
                self.refusal_begins(record, *member, (*theirs, *ours), cycle);
            }
            StationEvent::RefusalEnded { member } => {
                self.refusal_ends(&record.name, *member, cycle);
            }
            StationEvent::NotPrepared { .. } => {
                let text = self.described(record).text;
                self.alarms.raise((record.name.clone(), "not-prepared"), cycle, text);
            }
            StationEvent::Adopted { .. } | StationEvent::Synchronised { .. } => {
                self.alarms.over(&(record.name.clone(), "not-prepared"), cycle);
            }
            _ => {}
        }
        let own = |change| Some(Change::Station(station, change));
        let change = match event {
            StationEvent::Joins { .. } => own(StationChange::Joins),
            StationEvent::Adopted { program, from: Some(_), .. } => {
                own(StationChange::Adopted(*program))
            }
            StationEvent::BecameCycleMaster { .. } => Some(Change::BecameCycleMaster(station)),
            StationEvent::Configured(configurations) => {
                let own = Member::Station(station);
                Some(Change::Online(ChangeReport::Configured(own, *configurations)))
            }
            StationEvent::Excluded { program, .. } => {
                let excluded = ProgramChange::Excluded(StationSet::only(station));
                Some(Change::Program(*program, excluded))
            }
            StationEvent::Readmitted { program, .. } => {
                let readmitted = ProgramChange::Readmitted(station);
                Some(Change::Program(*program, readmitted))
            }
            _ => None,
        };
        self.is_alive(Member::Station(station), cycle);
        if let Some(change) = change {
            self.changes.reported(Member::Station(station), cycle, change);
        }
        self.exclusion_alarm(record, station, cycle, event);
        let cause = match event {
            StationEvent::Flagged { station, .. } => self.cause_of_silence(*station),
            StationEvent::Joins { .. } => self.done_to(station),
            _ => None,
        };
        self.happened(record, cycle, cause);
    }

    /// Two members refuse each other: the alarm of the one whose configuration is not that of the cluster file, however many refuse it.
    pub(super) fn refusal_begins(
        &mut self,
        record: &Record,
        other: Member,
        (theirs, ours): (ConfigurationHash, ConfigurationHash),
        cycle: i64,
    ) {
        let right = self.cluster.agreement().configuration;
        let (odd, theirs) = match record.member {
            Some(by) if ours != right => (by, ours),
            _ => (other, theirs),
        };
        let refusal = Refusal { by: record.name.clone(), other, odd };
        self.refusals.insert(refusal);
        let name = self.members().name(odd).to_owned();
        let text = odd_configuration_text(&name, &theirs, &right);
        self.alarms.raise((name, REFUSED), cycle, text);
    }

    /// The member `by` refuses another one no longer.
    pub(super) fn refusal_ends(&mut self, by: &str, other: Member, cycle: i64) {
        let is_it = |refusal: &Refusal| refusal.by == by && refusal.other == other;
        self.refusals_end(&is_it, cycle);
    }

    /// The process of a member has begun or ended: it refuses no member.
    pub(super) fn refuses_none(&mut self, member: Member, cycle: i64) {
        let name = self.members().name(member).to_owned();
        self.refusals_end(&|refusal| refusal.by == name, cycle);
    }

    fn refusals_end(&mut self, ends: &dyn Fn(&Refusal) -> bool, cycle: i64) {
        let (over, lasting) = self.refusals.iter().cloned().partition(ends);
        self.refusals = lasting;
        let over: BTreeSet<Refusal> = over;
        for Refusal { odd, .. } in over {
            if !self.refusals.iter().any(|refusal| refusal.odd == odd) {
                self.alarms.over(&(self.members().name(odd).to_owned(), REFUSED), cycle);
            }
        }
    }

    fn exclusion_alarm(
        &mut self,
        record: &Record,
        station: StationId,
        cycle: i64,
        event: &StationEvent,
    ) {
        let subject = (record.name.clone(), "excluded");
        match event {
            StationEvent::Excluded { .. } => {
                let text = self.described(record).text;
                self.alarms.raise(subject, cycle, text);
            }
            StationEvent::Readmitted { .. }
                if self.changes.now().excluded_from(station).is_empty() =>
            {
                self.alarms.over(&subject, cycle);
            }
            _ => {}
        }
    }

    /// A turn. It is a change only for a station that has not taken one, or was joining or in shadow mode until this one.
    fn published(&mut self, station: StationId, cycle: i64) {
        let member = Member::Station(station);
        self.is_alive(member, cycle);
        let own = self.changes.now().station(station);
        if own.is_some_and(|own| own.joining || !own.shadow.is_empty() || !own.took_turns) {
            let change = Change::Station(station, StationChange::Published);
            self.changes.reported(member, cycle, change);
        }
    }

    /// A member that reports something has a process, if nothing else is known.
    fn is_alive(&mut self, member: Member, cycle: i64) {
        if self.changes.now().process(member).is_none() {
            self.changes.push(cycle, Change::Alive(member));
        }
    }

    /// A remote I/O received these stations at a deadline.
    pub(super) fn received_at(&mut self, cycle: i64, heard: StationSet) {
        self.received.note(cycle, heard);
        for station in heard.iter() {
            let own = self.changes.now().station(station);
            if own.is_some_and(|own| !own.took_turns || own.joining || own.refused) {
                let change = Change::Station(station, StationChange::Received);
                self.changes.push(cycle, change);
            }
        }
    }

    pub(super) fn refused(&mut self, member: Member, cycle: i64) {
        if let Member::Station(station) = member {
            let change = Change::Station(station, StationChange::Refused);
            self.changes.push(cycle, change);
        }
    }

    pub(super) fn host(&mut self, record: &Record, member: Member, event: &HostEvent) {
        let cycle = self.cycles.of(None);
        match event {
            HostEvent::Ready { .. } => self.ready(member, cycle),
            HostEvent::JournalLost { .. } => {
                if let Some(program) = member.sampled_program() {
                    self.misses_records(program);
                }
            }
            _ => {}
        }
        self.fold_process_alarms(record, cycle);
        self.host_alarm(record, member, cycle, event);
        self.spare_reported(member, (cycle, record.at_ns), event);
        // Counted, and no event: one comes every few seconds.
        if !matches!(event, HostEvent::Timed { .. }) {
            self.happened(record, cycle, None);
        }
    }

    /// A process begins, unless it is known to have ended: its records may be read afterwards.
    fn ready(&mut self, member: Member, cycle: i64) {
        self.refuses_none(member, cycle);
        self.network_forgets(member, cycle);
        // A new process says so where it cannot open a link.
        self.links_forgotten(member, cycle);
        if !self.changes.now().is_down(member) {
            let change = Change::Process(member, Process::Running);
            self.changes.process(member, cycle, change);
            if let Some(program) = member.sampled_program() {
                self.remote_io_is_new(member, program);
            }
        }
    }

    fn host_alarm(&mut self, record: &Record, member: Member, cycle: i64, event: &HostEvent) {
        let own = |alarm| (record.name.clone(), alarm);
        let is_remote_io = member.sampled_program().is_some();
        match event {
            HostEvent::FieldLost { .. } | HostEvent::FieldContested if is_remote_io => {
                let described = self.described(record);
                self.alarms.raise(own(described.event), cycle, described.text);
            }
            HostEvent::FieldRegained if is_remote_io => {
                self.alarms.over(&own("field-lost"), cycle);
            }
            HostEvent::FieldUncontested if is_remote_io => {
                self.alarms.over(&own("field-contested"), cycle);
            }
            HostEvent::DuplicateFound { member } => {
                let text = self.described(record).text;
                let subject = (self.members().name(*member).to_owned(), "duplicate");
                self.alarms.raise(subject, cycle, text);
            }
            HostEvent::DuplicateGone { member } => {
                let subject = (self.members().name(*member).to_owned(), "duplicate");
                self.alarms.over(&subject, cycle);
            }
            HostEvent::LinkFailed { network, .. } => {
                let text = self.described(record).text;
                self.link_failed(member, *network, text, cycle);
            }
            HostEvent::RetainFailed { reason } => {
                self.alarms.raise(own("retain-failed"), cycle, reason.clone());
            }
            HostEvent::RetainedRefused { file, reason } => {
                self.alarms.occurred(own("retained-refused"), cycle, format!("{file}: {reason}"));
            }
            HostEvent::RetainedDropped { .. } => {
                let text = self.described(record).text;
                self.alarms.occurred(own("retained-dropped"), cycle, text);
            }
            HostEvent::Ready { .. } | HostEvent::RetainRegained => {
                self.alarms.over(&own("retain-failed"), cycle)
            }
            HostEvent::NetworkReception { network, lost, impaired } => {
                self.network_received(member, *network, (lost, impaired), cycle);
            }
            HostEvent::LinkReopened { network, .. } => {
                self.link_reopened(member, *network, cycle);
            }
            _ => {}
        }
    }

    pub(super) fn misses_records(&mut self, program: ProgramId) {
        if let Some(history) = self.histories.get_mut(program.index()) {
            history.misses_records();
        }
    }

    /// Why a station may be silent, in words, with the cycle; nothing where it was not done to it.
    pub(super) fn silenced(&self, station: StationId) -> Option<(String, i64)> {
        let own = self.changes.now().station(station)?;
        let (what, cycle) = own.silenced.as_ref()?;
        Some((format!("{what} in cycle {cycle}"), *cycle))
    }

    pub(super) fn cause_of_silence(&self, station: StationId) -> Option<String> {
        self.silenced(station).map(|(why, _)| why)
    }

    /// The last action on a station, in words.
    fn done_to(&self, station: StationId) -> Option<String> {
        let own = self.changes.now().station(station)?;
        let (what, cycle) = own.done.as_ref()?;
        Some(format!("{what} in cycle {cycle}"))
    }
}
