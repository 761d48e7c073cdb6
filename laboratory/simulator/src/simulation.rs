//! The run itself: virtual time goes from one event to the next.
//!
//! Three kinds of events: a frame arrives, a member wakes, a fault is due. At equal times frames come first, then wake-ups by
//! member, then faults, so that a run is a function of its parts, faults and seed.

mod disturbance;
mod identity;
mod judging;
mod knowable;
mod pairs;
mod spares;

use std::sync::Arc;
use std::time::Duration;

use serde::Serialize;
use understudy_cycle::{Input, Machine, Output, RemoteIoInput};
use understudy_node::Station;
use understudy_remote_io::RemoteIo;
use understudy_wire::{
    Audience, Configurations, Field, Frame, Header, Image, Member, ProgramId, ProgramSet,
    StationId, StationSet, Time,
};

use crate::disk::Disks;
use crate::fault::Fault;
use crate::field::Plants;
use crate::input_reports::InputReports;
use crate::links::{Links, Metered};
use crate::modules::Modules;
use crate::network::{Disturbance, Network};
use crate::pace::{Pace, founds};
use crate::parts::Parts;
use crate::queue::Delivery;
use crate::referee::{Referee, Violation};
use crate::signals::SignalReferee;
use crate::slot::{NEVER, Slot};
use crate::spares::SpareBeside;
use crate::tally::Tally;
use crate::wakeups::Wakeups;
use judging::Misled;
use knowable::Knowable;
use pairs::twin_of;

/// Something for the journal.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[serde(untagged)]
pub enum Record<'a> {
    /// Of a controller or an understudy.
    Station(&'a understudy_node::Event),
    /// Of a remote I/O.
    RemoteIo(&'a understudy_remote_io::Event),
    /// A plant moved by what its actuators got, of both remote I/Os of its program together; what it shows then.
    Plant(&'a Image, &'a Field),
    /// A fault was done.
    Fault(&'a Fault),
    /// Something that must never happen.
    Violation(&'a Violation),
}

/// Takes the records of a run: when in virtual time, in which cycle of the scenario (none before its cycle 0), who.
pub type Observe<'a> = dyn FnMut(Time, Option<u64>, Member, Record<'_>) + 'a;

/// The cluster did not come to a cycle in which everybody was synchronised.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error(
    "after {cycles} cycles not everybody was synchronised; remote I/Os that were not driving directly: {waiting:?}"
)]
pub struct NotReady {
    /// How long it was waited for.
    pub cycles: u64,
    /// Programs whose remote I/O was not there yet.
    pub waiting: Vec<u8>,
}

/// A cluster in virtual time. A copy goes on exactly as the original does.
#[derive(Clone)]
pub struct Simulation {
    parts: Arc<Parts>,
    links: Links,
    now: Time,
    stations: Vec<Slot<Station>>,
    remote_ios: Vec<Slot<RemoteIo>>,
    /// The second remote I/O of each program that has one.
    twins: Vec<Option<Slot<RemoteIo>>>,
    /// For each program, which remote I/O drove its outputs last, and when.
    driven_by: Vec<Option<(Member, Time)>>,
    wakeups: Wakeups,
    plants: Plants,
    /// For each program, the modules between its remote I/Os and its plant.
    modules: Vec<Modules>,
    /// Whether it is reported that these show different values.
    input_reports: Vec<Option<InputReports>>,
    disks: Disks,
    referees: Vec<Referee>,
    signals: SignalReferee,
    tallies: Vec<Tally>,
    /// For each remote I/O, whether its last deadline was direct and everybody published.
    ready: ProgramSet,
    /// For each remote I/O, the stations of which frames arrived since its last deadline, in the cycle before that, and in the one before.
    arrived: Vec<[StationSet; 3]>,
    /// For each remote I/O, the stations that had the state of its program at its last deadline, and at the one before.
    holders: Vec<[StationSet; 2]>,
    /// What the members can know of the stations that could have a state whose outputs were applied.
    knowable: Knowable,
    /// What is known of each remote I/O that has a wrong program.
    misled: Misled,
    /// Stations that have sent nothing since they were restarted: no member can know that they run.
    unannounced: StationSet,
    violations: Vec<Violation>,
    faults: Vec<Fault>,
    /// Spares that wake by their rule, one for each slot.
    spares: Vec<SpareBeside>,
    pace: Pace,
    founded: u64,
}

impl Simulation {
    /// All members start at time 0; the slots of spares are empty until a restart.
    ///
    /// # Panics
    /// If the parts have no station or not one remote I/O and plant place a program.
    pub fn new(parts: Parts, network: Network, seed: u64) -> Self {
        let programs = &parts.stations[0].programs;
        assert_eq!(parts.remote_ios.len(), programs.len());
        assert_eq!(parts.plants.len(), programs.len());
        let now = Time::default();
        let referees = parts
            .remote_ios
            .iter()
            .map(|settings| {
                let program = programs[settings.program.index()].executable.clone();
                Referee::new(settings, program).with_change(parts.change.as_ref())
            })
            .collect();
        let disks = Disks::new(parts.stations.len(), parts.remote_ios.len());
        let stations = parts.stations.iter().enumerate().map(|(rank, settings)| {
            let mut settings = settings.clone();
            settings.founds = founds(parts.stations[0].founds, 1 + rank as u64);
            let slots = settings.agreement.schedule.spare_slots();
            let mut slot = Slot::new(disks.station(now, settings, parts.change.as_ref()));
            if slots.contains(StationId(rank as u8)) {
                slot.crash();
            }
            slot
        });
        let stations: Vec<_> = stations.collect();
        let remote_ios = parts.remote_ios.iter();
        let remote_ios: Vec<_> = remote_ios
            .map(|settings| {
                Slot::new(disks.remote_io(now, settings.clone(), parts.change.as_ref()))
            })
            .collect();
        let due = stations.iter().map(Slot::due);
        let twins = parts.remote_ios.iter();
        let twins = twins.map(|settings| {
            Some(Slot::new(disks.remote_io(now, twin_of(settings)?, parts.change.as_ref())))
        });
        let twins: Vec<_> = twins.collect();
        let due = due.chain(remote_ios.iter().map(Slot::due));
        let due = due.chain(twins.iter().map(|twin| twin.as_ref().map_or(NEVER, Slot::due)));
        let due = due.collect();
        let mut simulation = Self {
            links: Links::new(
                (parts.stations.len(), parts.remote_ios.len()),
                (parts.roster(), parts.has_two_networks, parts.direct_links),
                network,
                seed,
            ),
            now,
            wakeups: Wakeups::new(stations.len(), remote_ios.len(), due),
            stations,
            driven_by: vec![None; remote_ios.len()],
            remote_ios,
            twins,
            plants: Plants::new(&parts),
            modules: parts.remote_ios.iter().map(Modules::of).collect(),
            input_reports: parts.remote_ios.iter().map(InputReports::of).collect(),
            disks,
            referees,
            signals: SignalReferee::new(&parts.remote_ios),
            tallies: vec![Tally::default(); parts.remote_ios.len()],
            ready: ProgramSet::EMPTY,
            arrived: vec![[StationSet::EMPTY; 3]; parts.remote_ios.len()],
            holders: vec![[StationSet::EMPTY; 2]; parts.remote_ios.len()],
            knowable: Knowable::new(parts.stations.len(), parts.remote_ios.len()),
            misled: Misled::default(),
            unannounced: StationSet::EMPTY,
            violations: Vec::new(),
            faults: Vec::new(),
            spares: Vec::new(),
            pace: Pace::new(parts.stations[0].agreement.schedule.period()),
            founded: parts.stations.len() as u64,
            parts: Arc::new(parts),
        };
        for program in 0..simulation.remote_ios.len() {
            simulation.show_field(ProgramId(program as u8));
        }
        simulation
    }

    /// Adds a fault; one whose cycle is over is done at once.
    pub fn schedule(&mut self, fault: Fault) {
        self.links.expect(fault.action);
        let key = |fault: &Fault| fault.at_cycle as f64 + fault.phase;
        let place = self.faults.partition_point(|other| key(other) > key(&fault));
        self.faults.insert(place, fault);
    }

    /// Faults of `member` that were scheduled and are not done yet will not be done.
    pub fn forget(&mut self, member: Member) {
        self.faults.retain(|fault| fault.member != member);
    }

    /// From here on all chance comes from `seed`. A run on a quiet network has drawn nothing until its first fault.
    pub fn reseed(&mut self, seed: u64) {
        self.links.reseed(seed);
    }

    /// An order of an operator reaches the remote I/O of a program now; without effect while that is down.
    pub fn order(
        &mut self,
        program: ProgramId,
        order: RemoteIoInput<'_>,
        observe: &mut Observe<'_>,
    ) {
        self.give(Member::RemoteIo(program), Input::RemoteIo(order), observe);
    }

    /// The network is another one while `disturbance` lasts; a later one takes its place.
    pub fn disturb(&mut self, disturbance: Disturbance) {
        self.links.alter(disturbance);
    }

    /// Whether at its last deadline each remote I/O drove directly and heard everybody.
    pub fn synchronised(&self) -> bool {
        self.ready == ProgramSet::first(self.remote_ios.len())
    }

    /// Runs until everybody is synchronised, and from there `cycles` cycles more.
    ///
    /// # Errors
    /// [`NotReady`] where that state is not reached in `patience` cycles.
    pub fn run(
        &mut self,
        cycles: u64,
        patience: u64,
        observe: &mut Observe<'_>,
    ) -> Result<(), NotReady> {
        self.wait_until_ready(patience, observe)?;
        for tally in &mut self.tallies {
            *tally = Tally::default();
        }
        self.pace.set_origin();
        while self.pace.cycle().is_none_or(|cycle| cycle < cycles) {
            self.advance(observe);
        }
        Ok(())
    }

    /// Goes on after [`Self::run`] until `cycle` has begun, or until `over` says so after an event; true where it said so.
    pub fn go_on(
        &mut self,
        cycle: u64,
        observe: &mut Observe<'_>,
        over: &mut dyn FnMut() -> bool,
    ) -> bool {
        while self.pace.cycle().is_none_or(|now| now < cycle) {
            self.advance(observe);
            if over() {
                return true;
            }
        }
        false
    }

    fn wait_until_ready(
        &mut self,
        patience: u64,
        observe: &mut Observe<'_>,
    ) -> Result<(), NotReady> {
        let all = ProgramSet::first(self.remote_ios.len());
        let give_up = self.now + self.period() * u32::try_from(patience).unwrap_or(u32::MAX);
        while !self.synchronised() {
            if self.now >= give_up {
                let waiting = all.without(self.ready);
                return Err(NotReady {
                    cycles: patience,
                    waiting: waiting.iter().map(|program| program.0).collect(),
                });
            }
            self.advance(observe);
        }
        Ok(())
    }

    /// Goes on after [`Self::run`] until the next thing to happen is not before this place in this cycle.
    pub fn go_to(&mut self, cycle: u64, phase: f64, observe: &mut Observe<'_>) {
        let end = cycle as f64 + phase;
        while self.cycle_of(self.next_at()).is_none_or(|next| next < end) {
            self.advance(observe);
        }
    }

    fn next_at(&self) -> Time {
        let next = self.wakeups.next().0.min(self.pace.overdue_at());
        let others = [self.links.next_at(), self.next_fault_at()];
        let next = others.into_iter().flatten().fold(next, Time::min);
        self.now.max(next)
    }

    fn cycle_of(&self, at: Time) -> Option<f64> {
        let within = at.since(self.pace.started()).as_nanos() as f64;
        Some(self.pace.cycle()? as f64 + within / self.period().as_nanos() as f64)
    }

    /// Virtual time since the start.
    pub fn now(&self) -> Time {
        self.now
    }

    /// Cycles of the scenario so far, with the part of this one that is over; none before its cycle 0.
    pub fn cycle_time(&self) -> Option<f64> {
        self.cycle_of(self.now)
    }

    /// What each remote I/O did since everybody was synchronised, by program.
    pub fn tallies(&self) -> &[Tally] {
        &self.tallies
    }

    /// Everything that must never happen and did.
    pub fn violations(&self) -> &[Violation] {
        &self.violations
    }

    /// Frames that were changed on their way or forged, and that their receivers refused for it.
    pub fn refused_frames(&self) -> u64 {
        self.links.refused()
    }

    /// Frames that a member has sent so far.
    pub fn sent_frames(&self, member: Member) -> u64 {
        self.links.sent(member)
    }

    /// Counts what is sent from here on, for [`Self::metered`].
    pub fn meter(&mut self) {
        self.links.meter();
    }

    /// What was sent since it is counted.
    pub fn metered(&self) -> Metered {
        self.links.metered()
    }

    /// What the plant of a program shows now.
    pub fn field(&self, program: ProgramId) -> Option<&Field> {
        self.plants.field(program)
    }

    fn period(&self) -> Duration {
        self.parts.stations[0].agreement.schedule.period()
    }

    // ── one event ───────────────────────────────────────────────────────────────────────────────────────────────────

    fn advance(&mut self, observe: &mut Observe<'_>) {
        let arrival = self.links.next_at().unwrap_or(NEVER);
        let (wakeup, sleeper) = self.wakeups.next();
        let fault = self.next_fault_at().unwrap_or(NEVER);
        let next = arrival.min(wakeup).min(fault).min(self.pace.overdue_at());
        self.now = self.now.max(next);
        if arrival == next {
            if let Some(delivery) = self.links.pop() {
                self.deliver(&delivery, observe);
            }
        } else if wakeup == next {
            self.note_wakeup(sleeper);
            self.give(sleeper, Input::Wakeup, observe);
        } else if fault == next {
            if let Some(fault) = self.faults.pop() {
                self.apply(&fault, observe);
            }
        } else {
            self.pace.count_overdue();
        }
    }

    fn next_fault_at(&self) -> Option<Time> {
        let fault = self.faults.last()?;
        let cycle = self.pace.cycle()?;
        (fault.at_cycle <= cycle)
            .then(|| self.now.max(self.pace.started() + self.period().mul_f64(fault.phase)))
    }

    fn deliver(&mut self, delivery: &Delivery, observe: &mut Observe<'_>) {
        for station in delivery.to.stations.iter() {
            let changed = self.links.take_in(station, &delivery.frame);
            let frame = changed.as_ref().unwrap_or(&delivery.frame);
            self.note_reached(station, frame);
            self.give(Member::Station(station), Input::Frame(frame), observe);
        }
        let remote_ios = Audience { stations: StationSet::EMPTY, ..delivery.to };
        for member in remote_ios.members() {
            self.note_arrival(member, &delivery.frame);
            self.give(member, Input::Frame(&delivery.frame), observe);
        }
    }

    fn give(&mut self, member: Member, input: Input<'_>, observe: &mut Observe<'_>) {
        match member {
            Member::Station(station) => {
                let slot = &mut self.stations[station.index()];
                if slot.give(self.now, input) {
                    self.wakeups.set(member, slot.due());
                    self.drain_station(station, observe);
                }
            }
            Member::RemoteIo(program) | Member::Twin(program) => {
                let now = self.now;
                let Some(slot) = self.remote_io_slot(member) else {
                    return;
                };
                if slot.give(now, input) {
                    let due = slot.due();
                    self.wakeups.set(member, due);
                    self.drain_remote_io(member, program, observe);
                }
            }
            Member::Plant(_) => {}
        }
    }

    fn drain_station(&mut self, station: StationId, observe: &mut Observe<'_>) {
        let member = Member::Station(station);
        while let Some(output) = self.poll_station(station) {
            match output {
                Output::Send(frame) => self.send(frame),
                Output::Report(event) => {
                    if let understudy_node::Event::Configured(configurations) = event {
                        self.disks.configure(member, configurations);
                    }
                    observe(self.now, self.pace.cycle(), member, Record::Station(&event));
                }
                Output::Retain(record) => self.disks.write(member, *record),
                Output::Drive { .. }
                | Output::Follow(_)
                | Output::Connect(_)
                | Output::EndWith(_)
                | Output::LayOut(_)
                | Output::Answer(_)
                | Output::Obeyed(_) => {}
            }
        }
    }

    fn poll_station(&mut self, station: StationId) -> Option<Output<understudy_node::Event>> {
        self.stations[station.index()].machine()?.poll_output()
    }

    fn drain_remote_io(&mut self, member: Member, program: ProgramId, observe: &mut Observe<'_>) {
        while let Some(output) = self.poll_remote_io(member) {
            match output {
                Output::Send(frame) => self.send(frame),
                Output::Drive { outputs, .. } => {
                    self.note_driver(member, program, observe);
                    let now = self.now;
                    let outputs = self.modules[program.index()].drive(now, member, &outputs);
                    self.drive_plant(program, &outputs, observe);
                }
                Output::Follow(outputs) => self.follow(member, program, &outputs, observe),
                Output::Connect(true) => self.show_field(program),
                Output::Connect(false) | Output::EndWith(_) => {}
                // Its modules are wired for all points.
                Output::LayOut(version) => {
                    let now = self.now;
                    let told = Input::RemoteIo(RemoteIoInput::Points(version));
                    if let Some(slot) = self.remote_io_slot(member) {
                        slot.give(now, told);
                    }
                }
                Output::Report(event) => {
                    if let understudy_remote_io::Event::Configured(configurations) = event {
                        self.disks.configure(member, configurations);
                    }
                    self.judge(member, program, &event, observe);
                    self.show_spares(program, &event);
                    observe(self.now, self.pace.cycle(), member, Record::RemoteIo(&event));
                }
                Output::Retain(record) => self.disks.write(member, *record),
                // The event says the same.
                Output::Answer(_) | Output::Obeyed(_) => {}
            }
        }
    }

    fn send(&mut self, frame: Arc<Frame>) {
        if let Member::Station(station) = frame.header.sender {
            self.unannounced.remove(station);
            self.knowable.sent(station, frame.header.moment);
        }
        let Header { configuration: own, prepared, .. } = frame.header;
        if self.parts.are_right(Configurations { own, prepared }) {
            self.pace.saw(self.now, frame.header.moment);
        }
        self.links.send(self.now, self.pace.cycle(), frame);
    }
}
