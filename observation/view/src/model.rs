//! The model of a run: everything that views show, folded from its records one by one.

mod asked;
mod changes;
mod counters;
mod cycle;
mod driving;
mod members;
mod networks;
mod pairs;
mod past;
mod points;
mod process_alarms;
mod programs;
mod protection;
mod reports;
mod run_events;
mod silence;
mod spares;
mod standing;
mod turns;

use std::collections::BTreeSet;
use std::sync::Arc;

use understudy_cluster::Cluster;
use understudy_journal::{Cycles, Happening, Members, Present, Record, TimeOfDay, TimesOfDay};
use understudy_wire::{Member, Moment, ProgramId};

use crate::alarm::Alarms;
use crate::describe::{Description, Writes, describe};
use crate::event::{Event, Events, Level};
use crate::history::History;
use crate::process_alarm::ProcessAlarms;
use crate::series::Series;
use crate::source::Trouble;
use crate::timing::Timings;
use crate::version::Versions;

use changes::Changes;
pub use counters::{Counters, MemberCounters, ProgramCounters};
use cycle::{LastMargin, Received};
use networks::Networks;

use programs::ProgramTrack;
use protection::Attribution;
use reports::Reports;
use spares::Spares;
pub(crate) use standing::{ForcedSignal, Standing};
pub use turns::SentTurn;
use turns::Turns;

/// Bounds of the memory of a run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Bounds {
    /// Cycles of each program, for states, parity words and causes.
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
        Self { cycles: 8192, events: 10_000, changes: 100_000, timings: 600 }
    }
}

impl Bounds {
    /// Bounds that hold some cycles that are not complete, too.
    fn holding(self, incomplete: usize) -> Self {
        let least = incomplete.saturating_add(LEAST_CYCLES);
        Self { cycles: self.cycles.max(least), changes: self.changes.max(least), ..self }
    }
}

/// Complete cycles that are remembered at least.
const LEAST_CYCLES: usize = 16;

/// The state of a run, folded from its records.
#[derive(Debug, Clone)]
pub struct Model {
    pub(crate) cluster: Arc<Cluster>,
    pub(crate) present: Present,
    pub(crate) writes: Writes,
    cycles: Cycles,
    changes: Changes,
    received: Received,
    reports: Reports,
    programs: Vec<ProgramTrack>,
    counters: Counters,
    histories: Vec<History>,
    turns: Turns,
    series: Series,
    events: Events,
    alarms: Alarms,
    /// Of each program that is not protected: which stations its remote I/O receives.
    attributions: Vec<Attribution>,
    /// Who refuses whom.
    refusals: BTreeSet<members::Refusal>,
    networks: Networks,
    spares: Spares,
    pub(crate) process_alarms: ProcessAlarms,
    timings: Timings,
    pub(crate) times: TimesOfDay,
    /// The time of day of the record that is taken, where the wall clock of its member is known.
    now: Option<TimeOfDay>,
    /// By program.
    versions: Vec<Versions>,
    /// The newest cycle of which the states of the stations are in the series.
    closed: Option<i64>,
    at_ns: u64,
    records: u64,
    left_out: u64,
    pub(crate) finished: bool,
    pub(crate) interrupted: bool,
    last_margin: LastMargin,
    read_from: Option<i64>,
    /// The records that are in effect follow.
    continues: bool,
}

impl Model {
    /// The model of a run before its first record.
    pub fn new(cluster: Arc<Cluster>, bounds: Bounds) -> Self {
        let schedule = &cluster.agreement().schedule;
        let programs = cluster.controllers().len();
        let incomplete = Reports::most_behind(schedule);
        let bounds = bounds.holding(incomplete);
        let histories = (0..programs as u8)
            .filter_map(|program| History::new(&cluster, ProgramId(program), bounds.cycles));
        let members = Members::of(&cluster);
        Self {
            alarms: Alarms::new(&members, programs),
            networks: Networks::default(),
            writes: Writes::default(),
            cycles: Cycles::default(),
            changes: Changes::new(schedule.stations(), programs),
            received: Received::new(incomplete),
            reports: Reports::new(schedule, programs),
            programs: vec![ProgramTrack::new(bounds.changes); programs],
            counters: Counters::new(schedule.stations(), programs),
            histories: histories.collect(),
            turns: Turns::new(bounds.cycles),
            series: Series::new(cluster.controllers(), schedule.stations(), bounds.changes),
            events: Events::new(bounds.events),
            attributions: vec![Attribution::default(); programs],
            refusals: BTreeSet::new(),
            spares: Spares::default(),
            process_alarms: ProcessAlarms::new(cluster.alarms(), programs),
            timings: Timings::new(schedule, bounds.timings),
            times: TimesOfDay::new(schedule.period()),
            now: None,
            versions: cluster.controllers().iter().map(Versions::of).collect(),
            closed: None,
            at_ns: 0,
            records: 0,
            left_out: 0,
            finished: false,
            interrupted: false,
            last_margin: LastMargin::default(),
            read_from: None,
            continues: false,
            present: Present::of(Arc::clone(&cluster)),
            cluster,
        }
    }

    /// Takes the next record.
    pub fn note(&mut self, record: &Record) {
        if self.is_of_journal(record) {
            return;
        }
        self.records += 1;
        self.writes.note(record, self.present.members());
        self.at_ns = record.at_ns;
        self.times.note(record);
        self.now = self.times.of_record(&record.name, record.at_ns);
        self.alarms.now_ns = record.at_ns;
        self.alarms.now = self.now.or_else(|| self.times.of_host(record.at_ns));
        self.counters.note(record);
        self.take(record);
        if let Some(shift) = self.cycles.take_shift() {
            self.shift(shift);
        }
    }

    fn take(&mut self, record: &Record) {
        self.turned(record);
        match (&record.event, record.member) {
            (Happening::Station(event), Some(Member::Station(station))) => {
                self.station(record, station, event);
            }
            (
                Happening::RemoteIo(event),
                Some(Member::RemoteIo(program) | Member::Twin(program)),
            ) => {
                self.remote_io(record, program, event);
            }
            (Happening::Plant(event), Some(Member::Plant(program))) => {
                self.plant(record, program, event);
            }
            (Happening::Host(event), Some(member)) => self.host(record, member, event),
            (Happening::Run(event), _) => self.run(record, event),
            _ => {}
        }
    }

    /// Takes what a source has found.
    pub fn take_found(&mut self, found: Result<Record, Trouble>) {
        match found {
            Ok(record) => self.note(&record),
            Err(trouble) => self.trouble(&trouble),
        }
    }

    /// Records were lost before this model.
    pub fn trouble(&mut self, trouble: &Trouble) {
        self.left_out += match trouble {
            Trouble::Gone { count } => count.unwrap_or(1),
            _ => 1,
        };
        self.histories.iter_mut().for_each(History::misses_records);
        let changes = self.process_alarms.fold.forget_all();
        let cycle = self.cycles.of(None);
        self.process_alarms_changed("journal", cycle, &changes);
        let event = Event {
            number: 0,
            cycle: self.cycles.of(None),
            at_ns: self.at_ns,
            at: None,
            name: "journal".to_owned(),
            event: "left-out",
            level: Level::Warning,
            text: trouble.to_string(),
            cause: None,
        };
        self.tell(event);
    }

    /// Whether an answer needed more than is known.
    pub(crate) fn wanted_more(&self) -> bool {
        self.histories.iter().any(|history| history.end().is_reached())
    }

    /// The run is over. One without results and without a last record was ended early, by the end of the process that wrote it.
    pub fn end(&mut self, has_results: bool) {
        self.interrupted |= !has_results && !self.finished;
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
        self.changes.shift(by);
        self.received.shift(by);
        self.reports.shift(by);
        self.programs.iter_mut().for_each(|track| track.shift(by));
        self.histories.iter_mut().for_each(|history| history.shift(by));
        self.series.shift(by);
        self.events.shift(by);
        self.alarms.shift(by);
        self.attributions.iter_mut().for_each(|attribution| attribution.shift(by));
        self.process_alarms.shift(by);
        self.timings.shift(by);
        self.times.shift(by);
        self.closed = self.closed.map(|closed| closed.saturating_add(by));
    }

    /// Takes an event: its time of day is that of the record that is taken, or of its cycle.
    fn tell(&mut self, event: Event) {
        let at = self.now.filter(|_| event.at_ns == self.at_ns);
        let at = at.or_else(|| self.times.of_cycle(event.cycle));
        self.events.push(Event { at, ..event });
    }

    /// The wall clocks of the members before the first record that is read.
    pub(crate) fn times_are(&mut self, times: TimesOfDay) {
        self.times = times;
    }

    /// A record as a sentence.
    pub(super) fn described(&self, record: &Record) -> Description {
        describe(record, self.members(), &self.writes, &self.cycles)
    }

    /// A record that is an event.
    fn happened(&mut self, record: &Record, cycle: i64, cause: Option<String>) {
        let description = self.described(record);
        self.tell(Event {
            number: 0,
            at: None,
            cycle,
            at_ns: record.at_ns,
            name: record.name.clone(),
            event: description.event,
            level: description.level,
            text: description.text,
            cause,
        });
    }
}
