//! The model of a run: everything that views show, folded from its records one by one.

mod asked;
mod programs;
mod protection;
mod turns;

use std::sync::{Arc, OnceLock};

use understudy_bus::HostEvent;
use understudy_cluster::Cluster;
use understudy_journal::{Action, Happening, Members, Record, RunEvent, moment};
use understudy_ladder::Observer;
use understudy_node::Event as StationEvent;
use understudy_wire::{Member, Moment, ProgramId, StationId};

use crate::alarm::Alarms;
use crate::cycles::Cycles;
use crate::describe::{describe, fault_text};
use crate::event::{Event, Events, Level};
use crate::history::History;
use crate::series::Series;
use crate::source::Trouble;
use crate::station::StationTrack;
use crate::timing::Timings;

pub(crate) use programs::ProgramTrack;
pub use turns::SentTurn;
use turns::Turns;

/// How much of a run is remembered.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Bounds {
    /// Cycles of each program, for states, words and causes.
    pub cycles: usize,
    /// Events.
    pub events: usize,
    /// Changes of each signal group, for trends.
    pub changes: usize,
    /// Times of cycles.
    pub timings: usize,
}

impl Default for Bounds {
    /// Some minutes at 10 ms; some tens of megabytes for a cluster of ten programs.
    fn default() -> Self {
        Self {
            cycles: 8192,
            events: 10_000,
            changes: 100_000,
            timings: 600,
        }
    }
}

/// Everything that is known of a run.
#[derive(Debug, Clone)]
pub struct Model {
    pub(crate) cluster: Arc<Cluster>,
    pub(crate) members: Members,
    cycles: Cycles,
    pub(crate) stations: Vec<StationTrack>,
    pub(crate) programs: Vec<ProgramTrack>,
    histories: Vec<History>,
    turns: Turns,
    series: Series,
    events: Events,
    alarms: Alarms,
    timings: Timings,
    observers: Vec<OnceLock<Option<Observer>>>,
    /// The newest cycle of which the stations' states are in the series.
    closed: Option<i64>,
    at_ns: u64,
    records: u64,
    left_out: u64,
    pub(crate) finished: bool,
    pub(crate) interrupted: bool,
    /// From which cycle on, and what it came to.
    scenario_over: Option<(i64, String)>,
}

impl Model {
    /// Of a run of which nothing is known yet.
    pub fn new(cluster: Arc<Cluster>, bounds: Bounds) -> Self {
        let schedule = &cluster.agreement().schedule;
        let programs = cluster.controllers().len();
        let histories = (0..programs as u8)
            .filter_map(|program| History::new(&cluster, ProgramId(program), bounds.cycles));
        Self {
            members: Members::of(&cluster),
            cycles: Cycles::default(),
            stations: vec![StationTrack::default(); schedule.stations()],
            programs: vec![ProgramTrack::default(); programs],
            histories: histories.collect(),
            turns: Turns::new(bounds.cycles),
            series: Series::new(programs, schedule.stations(), bounds.changes),
            events: Events::new(bounds.events),
            alarms: Alarms::default(),
            timings: Timings::new(schedule, bounds.timings),
            observers: vec![OnceLock::new(); programs],
            closed: None,
            at_ns: 0,
            records: 0,
            left_out: 0,
            finished: false,
            interrupted: false,
            scenario_over: None,
            cluster,
        }
    }

    /// Takes the next record.
    pub fn note(&mut self, record: &Record) {
        self.records += 1;
        self.at_ns = record.at_ns;
        self.alarms.now_ns = record.at_ns;
        match (&record.event, record.member) {
            (Happening::Station(event), Some(Member::Station(station))) => {
                self.station(record, station, event);
            }
            (Happening::RemoteIo(event), Some(Member::RemoteIo(program))) => {
                self.remote_io(record, program, event);
            }
            (Happening::Plant(event), Some(Member::Plant(program))) => {
                self.plant(record, program, event);
            }
            (Happening::Host(event), Some(member)) => self.host(record, member, event),
            (Happening::Run(event), _) => self.run(record, event),
            _ => {}
        }
        if let Some(shift) = self.cycles.take_shift() {
            self.shift(shift);
        }
    }

    /// Something stood between the records and this model.
    pub fn trouble(&mut self, trouble: &Trouble) {
        self.left_out += match trouble {
            Trouble::Gone { count } => count.unwrap_or(1),
            _ => 1,
        };
        let event = Event {
            number: 0,
            cycle: self.cycles.of(None),
            at_ns: self.at_ns,
            name: "journal".to_owned(),
            event: "left-out",
            level: Level::Warning,
            text: trouble.to_string(),
            cause: None,
        };
        self.events.push(event);
    }

    /// Nothing more will come: the results of the run are there.
    pub fn end(&mut self) {
        self.finished = true;
    }

    /// `moment` is cycle `cycle` of the run.
    pub fn origin_is(&mut self, moment: Moment, cycle: i64) {
        self.cycles.origin_is(moment, cycle);
        if let Some(shift) = self.cycles.take_shift() {
            self.shift(shift);
        }
    }

    fn shift(&mut self, by: i64) {
        self.stations.iter_mut().for_each(|track| track.shift(by));
        self.programs.iter_mut().for_each(|track| track.shift(by));
        self.histories
            .iter_mut()
            .for_each(|history| history.shift(by));
        self.series.shift(by);
        self.events.shift(by);
        self.alarms.shift(by);
        self.timings.shift(by);
        self.closed = self.closed.map(|closed| closed.saturating_add(by));
        if let Some((cycle, _)) = &mut self.scenario_over {
            *cycle = cycle.saturating_add(by);
        }
    }

    // ── what the members say ────────────────────────────────────────────────────────────────────────────────────────

    fn station(&mut self, record: &Record, station: StationId, event: &StationEvent) {
        if station.index() >= self.stations.len() {
            return;
        }
        let cycle = self.cycles.of(moment(&record.event));
        match event {
            StationEvent::Published { moment, words } => {
                let covers = words.iter().fold(
                    Default::default(),
                    |covers: understudy_wire::ProgramSet, word| covers.or(word.mask),
                );
                self.stations[station.index()].published(covers);
                self.timings.published(*moment, record.at_ns);
                self.turns.published(*moment, station, words);
                self.check_words(*moment);
                return;
            }
            StationEvent::Holds {
                moment,
                program,
                lineage,
                state,
            } => {
                if let Some(history) = self.histories.get_mut(program.index()) {
                    history.holds(*moment, *lineage, state);
                }
                return;
            }
            StationEvent::Joins { .. } => self.stations[station.index()].joins(),
            StationEvent::Adopted { program, from, .. } => {
                self.stations[station.index()].adopted(*program, from.is_some());
            }
            StationEvent::Synchronised { program, .. } => {
                self.stations[station.index()].synchronised(*program)
            }
            StationEvent::Flagged {
                station: silent, ..
            } => {
                if let Some(track) = self.stations.get_mut(silent.index()) {
                    track.flagged_by_station(station, true);
                }
            }
            StationEvent::Cleared {
                station: silent, ..
            } => {
                if let Some(track) = self.stations.get_mut(silent.index()) {
                    track.flagged_by_station(station, false);
                }
            }
            StationEvent::Excluded { program, .. } => {
                self.stations[station.index()].excluded.insert(*program);
                let text = describe(record, &self.members).text;
                self.alarms
                    .raise((record.name.clone(), "excluded"), cycle, text);
            }
            StationEvent::Readmitted { program, .. } => {
                let track = &mut self.stations[station.index()];
                track.excluded.remove(*program);
                if track.excluded.is_empty() {
                    self.alarms.over(&(record.name.clone(), "excluded"), cycle);
                }
            }
            StationEvent::Refused { member, .. } => self.refused(*member),
            StationEvent::BecameCycleMaster { .. }
            | StationEvent::DigestDiffers { .. }
            | StationEvent::Stalled { .. } => {}
        }
        let cause = match event {
            StationEvent::Flagged { station, .. } => self.cause_of_silence(*station),
            StationEvent::Joins { .. } => self.cause_of_silence(station),
            _ => None,
        };
        self.happened(record, cycle, cause);
    }

    fn host(&mut self, record: &Record, member: Member, event: &HostEvent) {
        let cycle = self.cycles.of(None);
        match (event, member) {
            (HostEvent::Ready { .. }, Member::Station(station)) => {
                if let Some(track) = self.stations.get_mut(station.index()) {
                    track.ready();
                }
            }
            (HostEvent::Ready { .. }, Member::RemoteIo(program)) => self.forget_protection(program),
            (HostEvent::FieldLost { reason }, Member::RemoteIo(_)) => {
                let subject = (record.name.clone(), "field-lost");
                let text = format!("its equipment cannot be read or written: {reason}");
                self.alarms.raise(subject, cycle, text);
            }
            (HostEvent::FieldContested, Member::RemoteIo(_)) => {
                let text = describe(record, &self.members).text;
                let subject = (record.name.clone(), "field-contested");
                self.alarms.raise(subject, cycle, text);
            }
            (HostEvent::FieldUncontested, Member::RemoteIo(_)) => {
                self.alarms
                    .over(&(record.name.clone(), "field-contested"), cycle);
            }
            (HostEvent::FieldRegained, Member::RemoteIo(_)) => {
                self.alarms
                    .over(&(record.name.clone(), "field-lost"), cycle);
            }
            (HostEvent::DuplicateFound { member }, _) => {
                let text = describe(record, &self.members).text;
                let subject = (self.members.name(*member).to_owned(), "duplicate");
                self.alarms.raise(subject, cycle, text);
            }
            (HostEvent::DuplicateGone { member }, _) => {
                let subject = (self.members.name(*member).to_owned(), "duplicate");
                self.alarms.over(&subject, cycle);
            }
            (HostEvent::LinkFailed { reason, .. }, _) => {
                let subject = (record.name.clone(), "link-failed");
                self.alarms.raise(subject, cycle, reason.clone());
            }
            (HostEvent::LinkReopened { .. }, _) => {
                self.alarms
                    .over(&(record.name.clone(), "link-failed"), cycle);
            }
            (HostEvent::JournalLost { .. }, Member::RemoteIo(program)) => {
                self.misses_records(program)
            }
            (HostEvent::Exchange(_), _) => return,
            _ => {}
        }
        self.happened(record, cycle, None);
    }

    fn misses_records(&mut self, program: ProgramId) {
        if let Some(history) = self.histories.get_mut(program.index()) {
            history.misses_records();
        }
    }

    fn run(&mut self, record: &Record, event: &RunEvent) {
        // What is done is felt in the next cycle.
        let cycle = match event {
            RunEvent::Origin { moment, .. } => self.cycles.of(Some(*moment)),
            RunEvent::Finished | RunEvent::Acknowledged(_) => self.cycles.of(None),
            _ => self
                .cycles
                .of(None)
                .saturating_add(i64::from(self.cycles.latest().is_some())),
        };
        if let Some(latest) = self.cycles.latest() {
            self.close_up_to(latest);
        }
        match event {
            RunEvent::Started { member } => {
                let name = self.members.name(*member).to_owned();
                if let Member::Station(station) = member
                    && let Some(track) = self.stations.get_mut(station.index())
                {
                    track.started();
                    track.done = Some((format!("{name} is started"), cycle));
                }
                self.alarms.over(&(name, "ended"), cycle);
            }
            RunEvent::Fault { action, member, .. } => {
                if let (Action::Crash | Action::Restart, Member::RemoteIo(program)) =
                    (action, member)
                {
                    self.forget_protection(*program);
                }
                let text = fault_text(*action, *member, &self.members);
                if let Member::Station(station) = member
                    && let Some(track) = self.stations.get_mut(station.index())
                {
                    track.fault(*action, cycle, text);
                }
            }
            RunEvent::Ended { member, how, .. } => {
                if let Member::RemoteIo(program) = member {
                    self.forget_protection(*program);
                }
                let name = self.members.name(*member).to_owned();
                let text = format!("{name} ended unexpectedly: {how}");
                if let Member::Station(station) = member
                    && let Some(track) = self.stations.get_mut(station.index())
                {
                    track.ended(cycle, text.clone());
                }
                self.alarms.raise((name, "ended"), cycle, text);
            }
            RunEvent::Origin { moment, cycle } => {
                let cycle = i64::try_from(*cycle).unwrap_or(i64::MAX / 2);
                self.cycles.origin_is(*moment, cycle);
            }
            RunEvent::ScenarioOver { verdict } => {
                self.scenario_over = Some((cycle, verdict.clone()))
            }
            RunEvent::Interrupted => self.interrupted = true,
            RunEvent::Finished => self.finished = true,
            RunEvent::Acknowledged(seen) => self.alarms.acknowledged(seen, cycle),
            // What it said before it was heard again is not known here.
            RunEvent::Attached {
                member: Member::RemoteIo(program),
            } => self.misses_records(*program),
            RunEvent::Journal { .. }
            | RunEvent::Commanded { .. }
            | RunEvent::Attached { .. }
            | RunEvent::Detached { .. } => {}
        }
        self.happened(record, cycle, None);
    }

    fn refused(&mut self, member: Member) {
        if let Member::Station(station) = member
            && let Some(track) = self.stations.get_mut(station.index())
        {
            track.refused();
        }
    }

    /// A record that is an event.
    fn happened(&mut self, record: &Record, cycle: i64, cause: Option<String>) {
        let description = describe(record, &self.members);
        self.events.push(Event {
            number: 0,
            cycle,
            at_ns: record.at_ns,
            name: record.name.clone(),
            event: description.event,
            level: description.level,
            text: description.text,
            cause,
        });
    }

    /// What was last done to a station, in words.
    fn cause_of_silence(&self, station: StationId) -> Option<String> {
        let (what, cycle) = self.stations.get(station.index())?.done.as_ref()?;
        Some(format!("{what} in cycle {cycle}"))
    }
}
