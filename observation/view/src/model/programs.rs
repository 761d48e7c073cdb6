//! What remote I/Os and plants report.

use understudy_journal::{Record, Tally, moment};
use understudy_plant::Event as PlantEvent;
use understudy_remote_io::{Event as RemoteIoEvent, Missing};
use understudy_wire::{
    Image, Member, Moment, ProgramHash, ProgramId, ProgramSet, Source, StationId, StationSet, Time,
};

use super::Model;
use super::standing::{Change, ProgramChange, StationChange};
use crate::alarm::VALUE_FAULT;
use crate::describe::{
    CHANGE_TAKEN_BACK, PROGRAM_FAULT, force_text, missing_text, program_fault_text, program_name,
    source_text,
};
use crate::event::{Event, Level};
use crate::online_change::ChangeReport;
use crate::stop::{self, Stop};
use crate::version::Version;

/// The alarm of forced signals.
pub(super) const FORCED: &str = "forced";

/// The alarm of a program that was started from its initial state because its state is lost.
const STARTED_COLD: &str = "started-cold";
const STARTED_WARM: &str = "started-warm";

/// The alarm of fail-safe outputs.
pub(super) const FAIL_SAFE: &str = "fail-safe";

/// Cycles that are closed at once, at most.
const MOST_CLOSED: i64 = 64;

/// The deadlines of one program at its remote I/O.
#[derive(Debug, Clone)]
pub(super) struct ProgramTrack {
    /// u(i) as last sampled.
    pub(super) inputs: Option<Image>,
    source: Option<Source>,
    pub(super) tally: Tally,
    /// Whether its outputs were provable in any cycle.
    pub(super) served: bool,
    stop: Stop,
    /// The program to which its remote I/O has taken a change back by itself.
    taken_back: Option<ProgramHash>,
}

impl ProgramTrack {
    pub(super) fn new(most: usize) -> Self {
        Self {
            inputs: None,
            source: None,
            tally: Tally::new(most),
            served: false,
            stop: Stop::default(),
            taken_back: None,
        }
    }

    pub(super) fn shift(&mut self, by: i64) {
        self.tally.shift(by);
    }
}

/// The alarm of a remote I/O that has not loaded the points of the program that runs.
pub(super) const POINTS_UNKNOWN: &str = "points-unknown";

/// Alarms about a state that its remote I/O does not continue from, such as questions to the operator: they end with the program's state known.
const QUESTIONS: [&str; 3] = ["disputed", "configuration-disputed", POINTS_UNKNOWN];

impl Model {
    pub(super) fn remote_io(&mut self, record: &Record, program: ProgramId, event: &RemoteIoEvent) {
        let place = program.index();
        if place >= self.programs.len() || !stop::fits(self.present.controller(program), event) {
            self.left_out += 1;
            return;
        }
        let member = record.member.unwrap_or(Member::RemoteIo(program));
        if self.is_of_follower(member, program, event) {
            return;
        }
        let cycle = match event {
            RemoteIoEvent::Applied { moment, missing, .. } => {
                let idle = *missing == Some(Missing::NoCycle);
                let cycle = self.cycles.deadline(program, *moment, idle);
                // Its epoch may be the awaited one of the origin: earlier cycles move, and this cycle is counted from the origin already.
                if let Some(shift) = self.cycles.take_shift() {
                    self.shift(shift);
                }
                cycle
            }
            RemoteIoEvent::Sampled { moment, .. } => {
                self.timings.sampled(*moment, record.at_ns);
                // The deadline of the cycle before has passed.
                self.cycles
                    .of_known(*moment)
                    .unwrap_or_else(|| self.cycles.of(None).saturating_add(1))
            }
            _ => self.cycles.of(moment(&record.event)),
        };
        if self.cycles.is_fixed() {
            self.histories[place].learn_running(event);
        } else if let Some(violation) =
            self.histories[place].note(cycle, member, Time(record.at_ns), event)
        {
            self.violated(record, cycle, &violation.to_string());
        }
        self.fold_process_alarms(record, cycle);
        match event {
            RemoteIoEvent::Sampled { moment, .. } => {
                self.check_words(*moment);
                return;
            }
            RemoteIoEvent::Applied { moment, .. } => {
                self.applied(record, program, cycle, *moment, event);
                return;
            }
            RemoteIoEvent::Points { .. } => return,
            _ => {}
        }
        self.pair_changed(record, member, program, cycle, event);
        self.protection_changed(record, program, cycle, event);
        self.changed(record, program, cycle, event);
        let cause = match event {
            RemoteIoEvent::Flagged { station, .. } => self.cause_of_silence(*station),
            RemoteIoEvent::Unprotected { lacking, .. } => {
                lacking.iter().find_map(|lacking| self.cause_of_silence(lacking.station))
            }
            _ => None,
        };
        self.happened(record, cycle, cause);
    }

    /// What changes the standing of a program, with the alarms that it raises and ends.
    fn changed(&mut self, record: &Record, program: ProgramId, cycle: i64, event: &RemoteIoEvent) {
        let subject = |alarm| (record.name.clone(), alarm);
        let own = |change| Some(Change::Program(program, change));
        let mut alarm = None;
        let change = match event {
            RemoteIoEvent::StartedCold { awaits_release, lost, .. } => {
                self.alarms.all_over(&record.name, &QUESTIONS, cycle);
                if lost.is_some() {
                    let text = self.described(record).text;
                    self.alarms.occurred(subject(STARTED_COLD), cycle, text);
                }
                own(ProgramChange::Started { awaits_release: *awaits_release })
            }
            RemoteIoEvent::StartedWarm { awaits_release, lost, inputs, .. } => {
                self.alarms.all_over(&record.name, &QUESTIONS, cycle);
                if *lost != Some(0) || inputs.is_some() {
                    let text = self.described(record).text;
                    self.alarms.occurred(subject(STARTED_WARM), cycle, text);
                }
                own(ProgramChange::Started { awaits_release: *awaits_release })
            }
            RemoteIoEvent::Released { .. } => {
                self.alarms.all_over(&record.name, &["disputed", PROGRAM_FAULT], cycle);
                self.alarms.none_concerns(VALUE_FAULT, program, cycle);
                self.programs[program.index()].stop.released();
                own(ProgramChange::Released)
            }
            RemoteIoEvent::ValueFault { accused, located, .. } => {
                self.accused(record, program, *accused, cycle);
                let excluded = own(ProgramChange::Excluded(*accused));
                excluded.filter(|_| *located)
            }
            RemoteIoEvent::RecalledExclusion { stations, .. } => {
                self.accused(record, program, *stations, cycle);
                own(ProgramChange::Excluded(*stations))
            }
            RemoteIoEvent::Disputed { .. } => {
                alarm = Some("disputed");
                None
            }
            RemoteIoEvent::ConfigurationDisputed { .. } => {
                alarm = Some("configuration-disputed");
                None
            }
            RemoteIoEvent::ChangeTakenBack { to, .. } => {
                self.programs[program.index()].taken_back = Some(*to);
                alarm = Some(CHANGE_TAKEN_BACK);
                None
            }
            // The engineer has switched again.
            RemoteIoEvent::ProgramChanged { to, .. }
                if self.programs[program.index()].taken_back.is_some_and(|back| back != *to) =>
            {
                self.programs[program.index()].taken_back = None;
                self.alarms.all_over(&record.name, &[CHANGE_TAKEN_BACK], cycle);
                None
            }
            RemoteIoEvent::PointsUnknown { .. } => {
                alarm = Some(POINTS_UNKNOWN);
                None
            }
            // The engineer has moved the change on.
            RemoteIoEvent::Configured(configurations) => {
                self.alarms.all_over(&record.name, &[CHANGE_TAKEN_BACK], cycle);
                let by = record.member.unwrap_or(Member::RemoteIo(program));
                Some(Change::Online(ChangeReport::Configured(by, *configurations)))
            }
            RemoteIoEvent::AdoptedLineage { .. } | RemoteIoEvent::StateRecovered { .. } => {
                self.alarms.all_over(&record.name, &QUESTIONS, cycle);
                None
            }
            RemoteIoEvent::Flagged { station, .. } => {
                let by = record.member.unwrap_or(Member::RemoteIo(program));
                self.slot_flagged(by, *station, record.at_ns);
                let flagged = StationChange::Flagged(program);
                Some(Change::Station(*station, flagged))
            }
            RemoteIoEvent::Cleared { station, .. } => {
                let cleared = StationChange::Cleared(program);
                Some(Change::Station(*station, cleared))
            }
            RemoteIoEvent::Refused { member, theirs, ours } => {
                self.refused(*member, cycle);
                self.refusal_begins(record, *member, (*theirs, *ours), cycle);
                None
            }
            RemoteIoEvent::RefusalEnded { member } => {
                self.refusal_ends(&record.name, *member, cycle);
                None
            }
            RemoteIoEvent::Forced { force, .. } => {
                let points = self.points_version(program, None).unwrap_or_default();
                own(ProgramChange::Forced(force.clone(), points))
            }
            RemoteIoEvent::Unforced { signal, .. } => own(ProgramChange::Unforced(*signal)),
            RemoteIoEvent::SignalValidity { input, valid, .. } => {
                own(ProgramChange::Validity(*input, *valid))
            }
            _ => None,
        };
        if let Some(change) = change {
            let by = record.member.unwrap_or(Member::RemoteIo(program));
            self.changes.reported(by, cycle, change);
        }
        self.alarm_of_forces(record, program, cycle, event);
        if let Some(alarm) = alarm {
            let text = self.described(record).text;
            self.alarms.raise(subject(alarm), cycle, text);
        }
    }

    /// The same stations may be accused by the remote I/Os of several programs.
    fn accused(&mut self, record: &Record, program: ProgramId, accused: StationSet, cycle: i64) {
        let names = accused.iter().map(|station| self.members().name(Member::Station(station)));
        let subject = (names.collect::<Vec<_>>().join(" and "), VALUE_FAULT);
        let text = self.described(record).text;
        self.alarms.concerns(&subject, Some(program), cycle, text);
    }

    /// One alarm names all forces of a remote I/O. A further force asks for an acknowledgement again; the end of one does not.
    fn alarm_of_forces(
        &mut self,
        record: &Record,
        program: ProgramId,
        cycle: i64,
        event: &RemoteIoEvent,
    ) {
        let subject = (record.name.clone(), FORCED);
        let standing = self.changes.now().program(program);
        let forced = standing.map_or(&[][..], |own| &own.forced);
        if forced.is_empty() {
            return self.alarms.over(&subject, cycle);
        }
        let asks_again = match event {
            RemoteIoEvent::Forced { .. } => true,
            RemoteIoEvent::Unforced { .. } => false,
            _ => return,
        };
        let texts =
            forced.iter().map(|forced| force_text(record.member, &forced.force, self.members()));
        let text = texts.collect::<Vec<_>>().join("; ");
        self.alarms.replace(subject, cycle, text, asks_again);
    }

    fn applied(
        &mut self,
        record: &Record,
        program: ProgramId,
        cycle: i64,
        moment: Moment,
        event: &RemoteIoEvent,
    ) {
        let RemoteIoEvent::Applied { sampled, source, missing, heard, .. } = event else {
            return;
        };
        let Some(driven) = event.driven() else {
            return;
        };
        self.times.passed(&record.name, cycle, record.at_ns);
        self.timings.decided(moment, cycle);
        self.series.applied(program, cycle, sampled.as_ref(), driven, *source);
        self.received_at(cycle, *heard);
        let track = &mut self.programs[program.index()];
        track.tally.push(cycle, *source, record.at_ns);
        if let Some(inputs) = sampled {
            track.inputs = Some(inputs.clone());
        }
        self.histories[program.index()].sampled_last(track.inputs.as_ref());
        self.stopped(record, program, cycle, *missing);
        let track = &mut self.programs[program.index()];
        let before = track.source.replace(*source);
        let was_served = track.served;
        track.served |= missing.is_none();
        if before != Some(*source) && (was_served || missing.is_none()) {
            // A source that was there before the first record was read has changed when the journal says.
            let counted = track.tally.deadlines().filter(|_| before.is_none());
            let (cycle, at_ns) =
                counted.map_or((cycle, record.at_ns), |counted| (counted.since, counted.since_ns));
            self.alarms.now_ns = at_ns;
            self.source_changed(record, program, cycle, event);
        }
        self.reported(record, Member::RemoteIo(program), cycle, ProgramSet::only(program));
        self.close();
    }

    /// A program fault is an event where it occurs, and an alarm until the operator releases the outputs.
    fn stopped(
        &mut self,
        record: &Record,
        program: ProgramId,
        cycle: i64,
        missing: Option<Missing>,
    ) {
        let history = &self.histories[program.index()];
        let newest = history.steps().back();
        let newest = newest.and_then(|step| step.sampled.as_ref());
        let track = &mut self.programs[program.index()];
        let Some(change) = track.stop.decided(missing, newest) else {
            return;
        };
        // A second fault, after a reset, is a second alarm.
        let subject = (record.name.clone(), PROGRAM_FAULT);
        self.alarms.over(&subject, cycle);
        if let stop::Change::Stopped(fault) = change {
            let version = self.running_version(program);
            let text = program_fault_text(version.map(Version::controller), fault.as_ref());
            let is_first = self.programs[program.index()].source.is_none();
            if self.read_from.is_some() && is_first {
                // It is not known when it occurred.
                self.alarms.raise(subject, cycle, text);
            } else {
                self.alarmed(record, cycle, PROGRAM_FAULT, text);
            }
        }
    }

    fn source_changed(
        &mut self,
        record: &Record,
        program: ProgramId,
        cycle: i64,
        event: &RemoteIoEvent,
    ) {
        let RemoteIoEvent::Applied { source, word_of, missing, heard, .. } = event else {
            return;
        };
        let source = *source;
        let from = source_text(source, *word_of, *missing, self.members());
        let text = format!("its outputs are {from}");
        let level = match source {
            Source::Direct | Source::Reconstructed => Level::Notice,
            Source::Held => Level::Warning,
            Source::FailSafe => Level::Alarm,
        };
        let cause = self.cause_of_source(program, source, *missing, *heard);
        let subject = (record.name.clone(), FAIL_SAFE);
        if source == Source::FailSafe {
            let why = cause.clone().unwrap_or_else(|| match missing {
                Some(missing) => missing_text(*missing).to_owned(),
                None => "no output was provable".to_owned(),
            });
            let of = program_name(program, self.members());
            let text = format!("{of}: fail-safe outputs, because {why}");
            self.alarms.raise_critical(subject, cycle, text);
        } else {
            self.alarms.over(&subject, cycle);
        }
        self.tell(Event {
            number: 0,
            at: None,
            cycle,
            at_ns: self.alarms.now_ns,
            name: record.name.clone(),
            event: "source",
            level,
            text,
            cause,
        });
    }

    /// The stations that are not received and would prove the outputs, with the newest thing that was done to one of them.
    fn cause_of_source(
        &self,
        program: ProgramId,
        source: Source,
        missing: Option<Missing>,
        heard: StationSet,
    ) -> Option<String> {
        let own = program.controller();
        if source == Source::Direct || heard.contains(own) {
            return None;
        }
        let schedule = &self.cluster.agreement().schedule;
        let could_prove = |station: &StationId| {
            // Of a word that was received, another member may be missing.
            let any = matches!(missing, Some(Missing::TwoErasures | Missing::SecondFailure));
            let others = source != Source::Reconstructed;
            *station == own || others && (any || schedule.is_understudy(*station))
        };
        let away: Vec<StationId> = self
            .station_ids()
            .filter(|station| !heard.contains(*station) && could_prove(station))
            .collect();
        let names = away.iter().map(|station| self.members().name(Member::Station(*station)));
        let names: Vec<&str> = names.collect();
        let verb = if names.len() == 1 { "is" } else { "are" };
        let newest = away.iter().filter_map(|station| self.silenced(*station));
        let newest = newest.max_by_key(|(_, cycle)| *cycle);
        let why = newest.map_or_else(String::new, |(why, _)| format!(": {why}"));
        Some(format!("{} {verb} not received{why}", names.join(" and ")))
    }

    /// Something that must never happen.
    fn violated(&mut self, record: &Record, cycle: i64, what: &str) {
        self.alarmed(record, cycle, "wrong", what.to_owned());
    }

    pub(super) fn plant(&mut self, record: &Record, program: ProgramId, event: &PlantEvent) {
        match event {
            PlantEvent::Stepped { moment, field, .. } => {
                let Some(history) = self.histories.get_mut(program.index()) else {
                    return;
                };
                history.saw(&field.sensors);
                let known = self.changes.now().program(program);
                let before = known.and_then(|known| known.plant);
                let now = (field.finished, field.plant_faults);
                if before == Some(now) {
                    return;
                }
                let cycle = self.cycles.of(Some(*moment));
                let change = ProgramChange::Plant {
                    finished: field.finished,
                    plant_faults: field.plant_faults,
                };
                self.changes.push(cycle, Change::Program(program, change));
                if field.plant_faults > before.map_or(0, |(_, plant_faults)| plant_faults) {
                    self.plant_fault(record, cycle, field.plant_faults);
                }
            }
            PlantEvent::Refused { member, theirs, ours } => {
                let cycle = self.cycles.of(None);
                self.refused(*member, cycle);
                self.refusal_begins(record, *member, (*theirs, *ours), cycle);
                self.happened(record, cycle, None);
            }
            PlantEvent::RefusalEnded { member } => {
                let cycle = self.cycles.of(None);
                self.refusal_ends(&record.name, *member, cycle);
                self.happened(record, cycle, None);
            }
        }
    }

    fn plant_fault(&mut self, record: &Record, cycle: i64, plant_faults: u64) {
        let text = format!("a plant fault occurred: {plant_faults} so far");
        self.alarmed(record, cycle, "plant_fault", text);
    }

    /// An event that is an alarm too.
    pub(super) fn alarmed(
        &mut self,
        record: &Record,
        cycle: i64,
        event: &'static str,
        text: String,
    ) {
        let subject = (record.name.clone(), event);
        self.alarms.raise(subject, cycle, text.clone());
        self.tell(Event {
            number: 0,
            at: None,
            cycle,
            at_ns: record.at_ns,
            name: record.name.clone(),
            event,
            level: Level::Alarm,
            text,
            cause: None,
        });
    }

    /// The states of the stations in every cycle of which all living remote I/Os have reported.
    fn close(&mut self) {
        let Some(newest) = self.newest() else {
            return;
        };
        // The newest cycle itself is still the present.
        let last = newest.saturating_sub(1);
        let first = self.closed.map_or(last, |closed| closed.saturating_add(1));
        for cycle in first.max(last.saturating_sub(MOST_CLOSED))..=last {
            let standing = self.changes.at(cycle);
            let states: Vec<_> = self
                .station_ids()
                .map(|station| self.station_state_in(&standing, station, Some(cycle)))
                .collect();
            for (rank, state) in states.into_iter().enumerate() {
                self.series.station_was(rank, cycle, state);
            }
            self.attribute_again(cycle);
            self.closed = Some(cycle);
        }
    }
}
