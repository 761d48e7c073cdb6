//! What a run came to, from its records alone, as they come.
//!
//! One account for both worlds: it numbers the cycles, finds the origin, asks a [`Referee`] for each remote I/O whether what was
//! applied is true, and keeps what the summary, the table and the figure show. Cycles are closed in order, [`LAG_CYCLES`] behind the
//! newest and when every remote I/O has told of a later one. The records of each member come on a way of their own, and a busy machine may
//! read one of them long before another: only [`MAXIMUM_OPEN_CYCLES`], which bound its memory, end the wait for a remote I/O that is gone.

mod absence;
mod alarms;
mod closing;
mod events;
mod networks;
mod outages;
mod presence;
mod service;
mod stalls;
mod traces;

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Duration;

use understudy_bus::{HostEvent, Quantiles};
use understudy_cluster::AlarmDeclaration;
use understudy_cycle::Agreement;
use understudy_journal::{
    AlarmChange, Happening, Members, NamedSignal, Numbering, Present, Record, TimeOfDay,
    TimesOfDay, Turn, moment,
};
use understudy_node::Event as StationEvent;
use understudy_remote_io::Event as RemoteIoEvent;
use understudy_simulator::{Action, Referee, Violation};
use understudy_wire::{
    Force, Member, Moment, OrderRefusal, ProgramId, ProgramSet, Source, StationSet, Time,
};

use crate::figure::Signals;
use crate::scenario::{During, Scenario};

use absence::Absences;
pub(crate) use alarms::AlarmFinding;
use alarms::Alarms;
use networks::Networks;
pub(crate) use networks::{NetworkFault, NetworkSubject};
pub(crate) use outages::{Outage, Start};
pub use presence::{Interval, Presence};
pub use service::{Counts, Service};
pub use stalls::Stall;
pub(crate) use traces::{PlantTrace, TRACED_CYCLES, Trace, Traces};

use outages::Outages;
use presence::Presences;
use service::{Outcome, ServiceTrack};
use stalls::Stalls;

/// How far behind the newest cycle one is closed at the earliest.
const LAG_CYCLES: usize = 64;

/// Cycles that are open at once, at most.
const MAXIMUM_OPEN_CYCLES: usize = 2048;

/// Violations that are listed, at most; all are counted.
const MAXIMUM_VIOLATIONS: usize = 100;

/// Stretches of cycles with the same points that the figure tells apart, at most.
const MAXIMUM_STRETCHES: usize = 64;

/// Unexpected ends of members that are listed, at most; all are counted.
const MAXIMUM_DEATHS: usize = 100;

/// What an account has to know of a cluster.
#[derive(Debug, Clone)]
pub struct Terms {
    /// Who is who.
    pub members: Members,
    /// What all agreed on.
    pub agreement: Arc<Agreement>,
    /// One for each program, with the circuit and the remote I/O's settings.
    pub referees: Vec<Referee>,
    /// Of each program, for the figure.
    pub signals: Vec<Signals>,
    /// Programs whose plant is simulated.
    pub plants: ProgramSet,
    /// Alarms on signals.
    pub alarms: Arc<[AlarmDeclaration]>,
    /// The points that count, across the online changes of the run.
    pub present: Present,
}

/// Who says where the origin is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum OriginRule {
    /// The records: the first cycle in which everybody was synchronised, with every simulated plant there.
    Found,
    /// Whoever runs the scenario.
    Told,
}

/// A step of the scenario as it was done.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct DoneStep {
    pub(crate) action: Action,
    pub(crate) member: Member,
    pub(crate) asked: u64,
    /// The first cycle whose deadline came after it.
    pub(crate) measured: u64,
    /// Why the member refused it; it has no effect then.
    pub(crate) refused: Option<OrderRefusal>,
}

/// A force of a signal, or one that was refused.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct DoneForce {
    pub(crate) program: ProgramId,
    pub(crate) force: Force,
    /// Its signal, by the points of that time; nothing where the program had none there.
    pub(crate) signal: Option<NamedSignal>,
    /// The first cycle with it; nothing before the origin.
    pub(crate) from: Option<u64>,
    /// The first cycle without it; nothing where it lasts.
    pub(crate) to: Option<u64>,
    pub(crate) refused: Option<OrderRefusal>,
}

/// Forces that are listed, at most; all are counted.
const MAXIMUM_FORCES: usize = 100;

/// An unexpected end of a member.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Death {
    pub(crate) member: Member,
    /// The first cycle whose deadline came after it; none before the origin.
    pub(crate) cycle: Option<u64>,
    /// The signal or the exit status.
    pub(crate) how: String,
    /// Its last lines on standard error.
    pub(crate) said: Vec<String>,
}

/// How a range of the expectation fared.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct RangeFinding {
    /// Cycles with another source, but for those that a stall of the host explains.
    pub(crate) missed: u64,
    /// Cycles without a word in time, while the host stood still.
    pub(crate) missed_by_stall: u64,
    /// The first of them, and what was applied.
    pub(crate) first: Option<(u64, Option<Source>)>,
}

/// A cycle that is not closed yet.
#[derive(Debug, Clone, Default)]
struct OpenCycle {
    outcomes: BTreeMap<ProgramId, Outcome>,
    heard: StationSet,
    /// Remote I/Os that drove directly and heard everybody.
    content: ProgramSet,
    /// Understudies that published for all programs.
    covering: StationSet,
}

/// The account of one run.
#[derive(Debug, Clone)]
pub struct Account {
    /// What it knows of the cluster.
    pub terms: Terms,
    /// Cycles that are judged, from the origin on.
    pub cycles: u64,
    numbering: Numbering,
    open: BTreeMap<i64, OpenCycle>,
    closed_up_to: Option<i64>,
    origin: Option<(Moment, i64)>,
    origin_rule: OriginRule,
    /// Simulated plants that have not made a step yet: a process that still starts takes the processor from the cycles.
    starting_plants: ProgramSet,
    presences: Presences,
    absences: Absences,
    pub(crate) outages: Outages,
    pub(crate) services: Vec<ServiceTrack>,
    stalls: Stalls,
    times: TimesOfDay,
    alarms: Alarms,
    networks: Networks,
    pub(crate) traces: Traces,
    pub(crate) steps: Vec<DoneStep>,
    pub(crate) forces: Vec<DoneForce>,
    pub(crate) force_count: u64,
    pub(crate) deaths: Vec<Death>,
    pub(crate) death_count: u64,
    pub(crate) violations: Vec<(u64, ProgramId, Violation)>,
    pub(crate) violation_count: u64,
    pub(crate) during: Vec<(During, RangeFinding)>,
    pub(crate) refused: Vec<(String, String)>,
    /// Records that members could not write, because their journals were too slow.
    pub(crate) unwritten: BTreeMap<Member, u64>,
    /// How long a remote I/O took from its samples to its outputs, and how late it was woken, as it said last.
    pub(crate) timed: BTreeMap<Member, (Quantiles, Quantiles)>,
    /// Whether the run was asked to end early.
    pub interrupted: bool,
    /// Whether everybody was synchronised in the last cycle of the scenario.
    pub(crate) protected: bool,
    pub(crate) records: u64,
}

impl Account {
    /// An account of a run of `scenario` that has not begun.
    pub fn new(terms: Terms, scenario: &Scenario, origin_rule: OriginRule) -> Self {
        let schedule = &terms.agreement.schedule;
        let programs = schedule.controllers();
        let mut presences = Presences::new(schedule.stations(), terms.agreement.flag_after);
        for slot in schedule.spare_slots().iter() {
            presences.step(0, Member::Station(slot), Action::Crash);
        }
        let slots = schedule.spare_slots().iter().map(Member::Station);
        let outages = Outages::new(schedule.stations() + programs, slots);
        Self {
            cycles: scenario.cycles,
            numbering: Numbering::default(),
            open: BTreeMap::new(),
            closed_up_to: None,
            origin: None,
            origin_rule,
            starting_plants: terms.plants,
            presences,
            absences: Absences::default(),
            outages,
            services: vec![ServiceTrack::default(); programs],
            stalls: Stalls::default(),
            times: TimesOfDay::new(terms.agreement.schedule.period()),
            alarms: Alarms::new(&terms.alarms, programs),
            networks: Networks::default(),
            traces: Traces {
                plants: vec![PlantTrace::default(); programs],
                stations: vec![Trace::default(); schedule.stations()],
            },
            steps: Vec::new(),
            forces: Vec::new(),
            force_count: 0,
            deaths: Vec::new(),
            death_count: 0,
            violations: Vec::new(),
            violation_count: 0,
            during: scenario
                .expect
                .during
                .iter()
                .map(|during| (during.clone(), RangeFinding::default()))
                .collect(),
            refused: Vec::new(),
            unwritten: BTreeMap::new(),
            timed: BTreeMap::new(),
            interrupted: false,
            protected: false,
            records: 0,
            terms,
        }
    }

    /// The moment of the origin, once there is one.
    pub fn origin(&self) -> Option<Moment> {
        self.origin.map(|(moment, _)| moment)
    }

    /// Time of day of the origin, where wall clocks were recorded.
    pub fn origin_at(&self) -> Option<TimeOfDay> {
        self.times.of_cycle(self.origin?.1)
    }

    /// The newest cycle that was decided, counted from the origin; none before it.
    pub fn cycle(&self) -> Option<u64> {
        let (_, origin) = self.origin?;
        u64::try_from(self.numbering.latest()? - origin).ok()
    }

    /// Remote I/Os that do not drive directly yet, understudies that do not speak for all programs, and plants that have not begun:
    /// why there is no origin.
    pub fn awaited(&self) -> Vec<Member> {
        let schedule = &self.terms.agreement.schedule;
        let newest = self.open.iter().next_back().map(|(_, cycle)| cycle);
        let before = self.open.iter().rev().nth(1).map(|(_, cycle)| cycle);
        let in_either =
            |test: &dyn Fn(&OpenCycle) -> bool| [newest, before].into_iter().flatten().any(test);
        let remote_ios = (0..schedule.controllers() as u8)
            .map(ProgramId)
            .filter(|&program| !in_either(&|cycle| cycle.content.contains(program)))
            .map(Member::RemoteIo);
        let stations = schedule
            .expected()
            .iter()
            .filter(|&station| {
                let test = |cycle: &OpenCycle| {
                    if schedule.is_understudy(station) {
                        cycle.covering.contains(station)
                    } else {
                        cycle.heard.contains(station)
                    }
                };
                !in_either(&test)
            })
            .map(Member::Station);
        let plants = self.starting_plants.iter().map(Member::Plant);
        stations.chain(remote_ios).chain(plants).collect()
    }

    /// The simulator knows better than the records where the origin is: `moment` is cycle `cycle` from it.
    /// True where that is news.
    pub(crate) fn origin_is(&mut self, moment: Moment, cycle: u64) -> bool {
        let (None, Some(number)) = (self.origin, self.numbering.of(moment)) else {
            return false;
        };
        let cycle = i64::try_from(cycle).unwrap_or(i64::MAX / 2);
        self.origin = Some((moment, number - cycle));
        true
    }

    /// Takes the next record.
    pub fn observe(&mut self, record: &Record) {
        self.records += 1;
        self.turned(record);
        self.times.note(record);
        self.absences.note(record);
        if let (Happening::Host(event), Some(member)) = (&record.event, record.member) {
            self.networks.note(member, event, self.next_cycle());
        }
        match (&record.event, record.member) {
            (Happening::Station(event), Some(Member::Station(station))) => {
                self.station(station, event);
            }
            (
                Happening::RemoteIo(event),
                Some(member @ (Member::RemoteIo(program) | Member::Twin(program))),
            ) => {
                self.remote_io(member, program, Time(record.at_ns), event);
                if let RemoteIoEvent::Applied { moment, .. } = event
                    && let Some(number) = self.numbering.of(*moment)
                {
                    self.times.passed(&record.name, number, record.at_ns);
                }
            }
            (Happening::Plant(event), Some(Member::Plant(program))) => self.plant(program, event),
            (Happening::Host(HostEvent::JournalLost { records }), Some(member)) => {
                self.unwritten(member, *records);
            }
            (Happening::Host(HostEvent::Timed { sample_to_output, wakeups }), Some(member)) => {
                self.timed.insert(member, (*sample_to_output, *wakeups));
            }
            (
                Happening::Host(HostEvent::Ready { .. }),
                Some(Member::RemoteIo(program) | Member::Twin(program)),
            ) => {
                if let Some(referee) = self.terms.referees.get_mut(program.index()) {
                    referee.starts_again();
                }
            }
            (Happening::Run(event), _) => {
                let changes = self.alarms.fold.run(event);
                self.alarms_changed(&changes, None);
                self.run(event);
            }
            _ => {}
        }
        if let Some((late, member)) = stall_of(record) {
            let number = moment(&record.event)
                .and_then(|moment| self.numbering.of(moment))
                .or_else(|| self.numbering.latest());
            if let Some(number) = number {
                let period = self.terms.agreement.schedule.period();
                self.stalls.stalled(number, member, late, period);
            }
        }
    }

    /// Programs may change by a change from a record on, or other points count.
    fn turned(&mut self, record: &Record) {
        let program = match self.terms.present.take(record) {
            Some(Turn::Loaded(change)) => {
                self.terms.referees.iter_mut().for_each(|referee| referee.learn(&change));
                return;
            }
            Some(Turn::Points(program)) => program,
            None => return,
        };
        let version = self.terms.present.controller(program);
        let outputs = version.map(|version| version.interface.outputs.clone());
        let changes = self.alarms.fold.lay_out(program, &self.terms.present);
        self.alarms_changed(&changes, None);
        let number = moment(&record.event).and_then(|moment| self.numbering.of(moment));
        let from = number.and_then(|number| self.since_origin(number)).or(self.next_cycle());
        if let Some(signals) = self.terms.signals.get_mut(program.index()) {
            let stretches = &mut signals.output_points;
            // After the last one nothing has a name.
            let named = outputs.filter(|_| stretches.len() + 1 < MAXIMUM_STRETCHES);
            if stretches.len() < MAXIMUM_STRETCHES {
                stretches.push((from.unwrap_or(0), named.unwrap_or_default()));
            }
        }
    }

    /// Faults of networks and links, at most 100 of them, and how many there were.
    pub(crate) fn network_faults(&self) -> (&[NetworkFault], u64) {
        (&self.networks.faults, self.networks.count)
    }

    /// The next cycle from the origin on.
    fn next_cycle(&self) -> Option<u64> {
        self.numbering.latest().and_then(|newest| self.since_origin(newest + 1))
    }

    /// Something is done to a member, or happens to it: answers with the first cycle whose deadline comes after it.
    fn disturb(&mut self, member: Member, action: Action) -> Option<u64> {
        let number = self.numbering.latest().unwrap_or(0) + 1;
        self.stalls.step(number, member, action);
        let measured = self.since_origin(number);
        self.presences.step(measured.unwrap_or(0), member, action);
        self.outages.step(measured, member, action);
        measured
    }

    /// Alarms changed with a record of a cycle, or of the newest one; not after the last cycle that is judged.
    fn alarms_changed(&mut self, changes: &[AlarmChange], number: Option<i64>) {
        let number = number.or_else(|| self.numbering.latest()).unwrap_or(0);
        let at = self.since_origin(number);
        if at.is_none_or(|at| at < self.cycles) {
            self.alarms.changed(changes, number);
        }
    }

    /// Each alarm of the cluster, how often it was raised, and in which cycle first; nothing in place of a cycle before the origin.
    pub(crate) fn alarm_findings(
        &self,
    ) -> impl Iterator<Item = (&AlarmDeclaration, &AlarmFinding, Option<u64>)> {
        let alarms = self.terms.alarms.iter().zip(&self.alarms.findings);
        alarms.map(|(alarm, finding)| {
            let first = finding.first.and_then(|first| self.since_origin(first));
            (alarm, finding, first)
        })
    }

    fn unwritten(&mut self, member: Member, records: u64) {
        *self.unwritten.entry(member).or_default() += records;
        if let Some(program) = member.sampled_program()
            && let Some(referee) = self.terms.referees.get_mut(program.index())
        {
            referee.misses_records();
            let changes = self.alarms.fold.forget_values_of(member);
            self.alarms_changed(&changes, None);
        }
    }

    fn refuse(&mut self, member: Member, theirs: String, ours: String) {
        let name = self.terms.members.name(member).to_owned();
        let text = format!("it runs configuration {theirs}, the others {ours}");
        if !self.refused.iter().any(|(known, _)| *known == name) {
            self.refused.push((name, text));
        }
    }

    fn violate(&mut self, program: ProgramId, number: Option<i64>, violation: Violation) {
        let at = number.and_then(|number| self.since_origin(number));
        self.violation_count += 1;
        if self.violations.len() < MAXIMUM_VIOLATIONS {
            self.violations.push((at.unwrap_or(0), program, violation));
        }
    }

    fn since_origin(&self, number: i64) -> Option<u64> {
        let (_, origin) = self.origin?;
        u64::try_from(number - origin).ok()
    }

    /// None for a cycle that is closed.
    fn open_cycle(&mut self, number: i64) -> Option<&mut OpenCycle> {
        if self.closed_up_to.is_some_and(|closed| number <= closed) {
            return None;
        }
        Some(self.open.entry(number).or_default())
    }

    fn look_for_origin(&mut self, number: i64, moment: Moment) {
        if self.origin.is_some() || self.origin_rule == OriginRule::Told {
            return;
        }
        let schedule = &self.terms.agreement.schedule;
        let understudies = schedule.expected().without(StationSet::first(schedule.controllers()));
        let everybody = self.open.get(&number).is_some_and(|cycle| {
            cycle.content == ProgramSet::first(schedule.controllers())
                && understudies.without(cycle.covering).is_empty()
        });
        if everybody && self.starting_plants.is_empty() {
            self.origin = Some((moment, number));
        }
    }

    /// Whether nobody has anything more to say of the oldest open cycle, or too many wait for it.
    fn oldest_is_told(&self) -> bool {
        let oldest = self.open.first_key_value().map(|(number, _)| *number);
        self.open.len() > MAXIMUM_OPEN_CYCLES
            || oldest.is_some_and(|oldest| self.numbering.all_are_past(oldest))
    }

    /// Closes the oldest open cycle, and those before it that no record had.
    fn close_oldest(&mut self) {
        let Some((number, cycle)) = self.open.pop_first() else {
            return;
        };
        // A number that no record had is a cycle that nobody decided.
        let first = self.closed_up_to.map_or(number, |closed| closed + 1);
        for missing in first..number {
            self.close(missing, &OpenCycle::default());
        }
        self.close(number, &cycle);
        self.closed_up_to = Some(number);
    }
}

fn stall_of(record: &Record) -> Option<(Duration, Member)> {
    match &record.event {
        Happening::Station(StationEvent::Stalled { late, .. })
        | Happening::RemoteIo(RemoteIoEvent::Stalled { late, .. }) => Some((*late, record.member?)),
        _ => None,
    }
}
