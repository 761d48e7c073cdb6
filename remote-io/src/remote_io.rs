//! The remote I/O of one program, the arbiter of its history.
//!
//! ```text
//!   cycle starts ──► samples u(i), sends it ──► receives turns ──► deadline: selects, drives y(i) ──► rest
//!                                                                  (or holds, then falls safe)
//! ```
//!
//! It is three machines. [`Inputs`] makes u(i) of a sample, from a list of overlays. [`Arbiter`] knows the history and says who may authorise outputs.
//! [`Actuation`] drives at every deadline, also when no cycle was started: what is proved, or what was, and then the fail-safe values. What the arbiter
//! knows of the history is one of three states ([`Knowledge`]), and proven outputs are applied on the proof alone or on the operator's release:
//!
//! ```text
//!   Listening ── a living station holds a state ──────────────► Running from its lineage
//!           ├─── stations have retained one ──────────────────► Running from its retentive values (warm start)
//!           ├─── no living station holds one ─────────────────► Running from the initial state (cold start)
//!           ├─── no living station holds one, and other members have another configuration ── the operator decides ──► Running
//!           └─── different ones of one cycle, or a stale one ── the operator decides ──► Running
//!
//!   Running ──── living stations, none of them on this history, for `listen_cycles` ──► the state is lost:
//!                a station returns with it, or the operator decides
//! ```
//!
//! Invariant *Never back*: the history continues from a state before the floor only if the operator chooses it.

mod actuation;
mod arbiter;
mod changing;
mod deadline;
mod forcing;
mod identity;
mod inputs;
mod knowledge;
mod pairing;
mod points;
mod protection;
mod recovery;
mod sampling;
mod signals;
#[cfg(test)]
mod states;
mod warm;
mod writing;

use std::sync::Arc;
use std::time::Duration;

use understudy_cycle::{
    Arrival, Input, Layout, Machine, Output, Outvoted, Participant, RemoteIoInput,
};
use understudy_wire::{
    Body, Configurations, Frame, Header, Holding, Join, Kept, Member, Moment, OrderRefusal,
    ProgramHash, ProgramId, Recalled, StateChoice, StationId, StationSet, Time,
};

use crate::event::{Event, Missing};
use crate::holders::Holders;
use crate::selection::Selection;
use crate::settings::Settings;

use actuation::{Actuation, Execution};
use arbiter::{Arbiter, Question};
use changing::Replacing;
use inputs::Inputs;
use knowledge::Knowledge;
use pairing::Pairing;
use protection::Protection;
use warm::Noting;

/// One remote I/O. See [`Machine`] for how it is driven.
#[derive(Debug, Clone)]
pub struct RemoteIo {
    settings: Settings,
    /// Points of the program that takes the newest sample.
    layout: Arc<Layout>,
    /// The version of the program whose points these are.
    laid_out: ProgramHash,
    /// The version of a state of a station whose points are not known here; said once.
    unknown_points: Option<ProgramHash>,
    member: Participant<Event>,
    inputs: Inputs,
    arbiter: Arbiter,
    actuation: Actuation,
    /// When the last sample was taken; only said with the outputs.
    sampled_at: Time,
    protection: Protection,
    /// When the host woke it last too late to keep its times.
    resumed: Option<Time>,
    noting: Noting,
    pairing: Option<Pairing>,
    /// The turns of this cycle, by rank.
    turns: Vec<Option<Arc<Frame>>>,
    deadline: Deadline,
    /// Words and states that differed at the last deadline, with those who can be wrong.
    differed: Vec<(Option<ProgramId>, StationSet)>,
    replacing: Replacing,
}

/// Where the next deadline is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
enum Deadline {
    /// In the current cycle.
    Ahead,
    /// In a later cycle, or in one that no station starts.
    Passed {
        /// Deadlines that passed without a cycle since the last one that was started.
        idle: u32,
    },
}

impl RemoteIo {
    /// A remote I/O that has just started: it listens first, and drives the fail-safe values until it knows better.
    pub fn new(now: Time, settings: Settings) -> Self {
        let agreement = &settings.agreement;
        let stations = agreement.schedule.stations();
        let own = match settings.pair {
            Some(pair) if pair.is_twin => Member::Twin(settings.program),
            _ => Member::RemoteIo(settings.program),
        };
        let mut member = Participant::new(own, agreement);
        member.clock.start(now);
        let holders = Holders::new(settings.program, agreement);
        let pairing = Pairing::new(now, &settings, holders.stations());
        let mut remote_io = Self {
            member,
            arbiter: Arbiter::new(now, holders),
            inputs: Inputs::new(&settings),
            actuation: Actuation::default(),
            pairing,
            sampled_at: now,
            protection: Protection::default(),
            resumed: None,
            noting: Noting::default(),
            turns: vec![None; stations],
            deadline: Deadline::Passed { idle: 0 },
            differed: Vec::new(),
            replacing: Replacing::default(),
            layout: Arc::clone(&settings.layout),
            laid_out: settings.hash,
            unknown_points: None,
            settings,
        };
        remote_io.member.wake_at(remote_io.next_wakeup());
        remote_io
    }

    /// Whether the operator has to choose the state that the program continues from.
    pub fn asks_operator(&self) -> bool {
        self.arbiter.question.is_some()
    }

    fn moment(&self) -> Moment {
        self.member.moment()
    }

    fn report(&mut self, event: Event) {
        self.member.report(event);
    }

    /// Says what became of an order.
    fn obeyed(&mut self, outcome: Result<(), OrderRefusal>) {
        self.member.put(Output::Obeyed(outcome));
    }

    fn receive(&mut self, now: Time, frame: &Arc<Frame>) {
        if self.receive_partner(now, frame) {
            return;
        }
        let station = match (frame.header.sender, &frame.body) {
            (Member::Station(station), _) => station,
            // Samples of other programs start no cycle here: they only prove signals.
            (Member::RemoteIo(program) | Member::Twin(program), Body::Sample(sample)) => {
                if self.member.admits(now, &frame.header) {
                    let sources = &self.layout.signal_sources;
                    let moment = frame.header.moment;
                    self.inputs.signals.note(sources, program, moment, sample);
                }
                return;
            }
            _ => return,
        };
        match self.member.arrival(now, frame) {
            Arrival::Stale => {
                if self.member.admits(now, &frame.header) {
                    self.arbiter
                        .holders
                        .hear(station, own_holding(&frame.body, self.settings.program));
                }
                return;
            }
            Arrival::Present => {}
            Arrival::Begins(anchor) => self.begin_cycle(now, frame.header.moment, anchor),
        }
        self.arbiter.holders.hear(station, None);
        self.note_prepared(station, &frame.header);
        match &frame.body {
            Body::Turn(turn) if self.member.attendance.receive_turn(station) => {
                self.note((station, &frame.header), &turn.holdings, None, &turn.recalled);
                self.learn_program(&frame.header, &turn.holdings);
                self.arbiter.holders.hear_of(turn.heard);
                if turn.relayed.iter().any(|one| one.program == self.settings.program) {
                    self.note_relayed();
                }
                self.note_sample_of(station, &turn.holdings, turn.lacks);
                self.turns[station.index()] = Some(Arc::clone(frame));
            }
            Body::Join(join) => {
                let Join { holdings, retained, recalled, .. } = join;
                self.note((station, &frame.header), holdings, Some(retained), recalled);
                self.note_sample_of(station, holdings, join.lacks);
            }
            _ => {}
        }
    }

    fn take(&mut self, now: Time, input: RemoteIoInput<'_>) {
        match input {
            RemoteIoInput::Field(sensors) => {
                self.take_sensors(sensors);
                self.note_stale(false);
            }
            RemoteIoInput::Points(version) => self.is_read_by(version),
            RemoteIoInput::FieldLost => self.inputs.sensors = None,
            RemoteIoInput::FieldStale => self.note_stale(true),
            RemoteIoInput::Choose(choice) => self.choose(choice),
            RemoteIoInput::Release => self.release(),
            RemoteIoInput::Force(force) => self.force(now, force),
            RemoteIoInput::Unforce(unforce) => self.unforce(unforce),
            RemoteIoInput::Write(write) => self.write(now, write),
        }
    }

    /// The operator releases the outputs, and all stations that were excluded.
    fn release(&mut self) {
        let moment = self.moment();
        if self.arbiter.question == Some(Question::Disputed) {
            self.report(Event::Released { moment });
            return self.choose(StateChoice::Newest { cycle: None });
        }
        let waits_for_choice = self.arbiter.question.is_some();
        let has_effect =
            self.actuation.execution == Execution::Stopped || self.arbiter.awaits_release();
        if waits_for_choice && !has_effect {
            return self.refuse_choice(OrderRefusal::WaitsForChoice);
        }
        self.inputs.diagnosing.release();
        self.release_inputs();
        if self.actuation.release() {
            self.report(Event::Released { moment });
        }
        self.become_released();
        self.obeyed(Ok(()));
    }

    /// Takes what a station tells of its states; a turn does not tell which ones it has kept over a power failure.
    fn note(
        &mut self,
        (station, header): (StationId, &Header),
        holdings: &[Holding],
        retained: Option<&[Kept]>,
        recalled: &[Recalled],
    ) {
        let program = self.settings.program;
        let own = Holding::of(holdings, program);
        let own = own.map(|holding| Holding {
            version: self.version_in(header, holding.version),
            ..*holding
        });
        let own = own.as_ref();
        if let Some(retained) = retained {
            let retained = retained.iter().find(|kept| kept.holding.program == program);
            self.arbiter.holders.note_retained(station, retained);
        }
        let recalled = recalled.iter().find(|recalled| recalled.program == program);
        let recalled =
            recalled.map(|recalled| (recalled, self.version_in(header, recalled.version)));
        let recalled = recalled.filter(|(it, version)| self.has_width(&it.inputs, *version));
        self.arbiter.holders.note(station, own, recalled, header.alone);
        if let (Some(run), Some(holding)) = (self.arbiter.knowledge.run_mut(), own)
            && let Some(place) = run.history.place(holding.lineage)
        {
            run.history.confirm(place);
        }
    }

    fn begin_cycle(&mut self, now: Time, moment: Moment, anchor: Time) {
        if self.member.clock.moment().is_some() {
            match self.deadline {
                Deadline::Ahead if self.slept_through(now, anchor) => {
                    self.miss_signals();
                    self.actuation.missed = self.actuation.missed.saturating_add(1);
                }
                Deadline::Ahead => self.decide(now),
                Deadline::Passed { .. } => self.note_lateness(now),
            }
            let skipped = moment != self.moment().plus(1);
            self.close_cycle();
            self.close_pair_cycle(skipped);
        }
        self.member.clock.begin(now, moment, anchor);
        self.deadline = Deadline::Ahead;
        self.turns.fill(None);
        self.find_history(now, moment);
        // A station has started this cycle, whether its turn is received or not.
        self.count_votes(now, self.own_stations().max(1));
        self.sample(now);
        self.begin_pair_cycle(now);
    }

    /// Whether the current cycle took no time, and is one of those that this remote I/O finds in its buffers after it was suspended: its deadline is
    /// over, the device kept its last values, and it is not driven or recorded now as if it had been driven then.
    fn slept_through(&self, now: Time, next: Time) -> bool {
        let schedule = &self.settings.agreement.schedule;
        let took_time = schedule.took_time(next.since(self.member.clock.anchor()));
        !took_time && self.resumed.is_some_and(|resumed| now.since(resumed) < schedule.period())
    }

    /// Notes that the host has woken this remote I/O too late to keep its times.
    fn note_sleep(&mut self, now: Time) {
        if now.since(self.member.wakeup()) > self.settings.agreement.schedule.stall() {
            self.resumed = Some(now);
        }
    }

    fn close_cycle(&mut self) {
        self.member.close_cycle();
        self.arbiter.holders.close_cycle();
        self.inputs.writing.close_cycle();
        if let Some(run) = self.arbiter.knowledge.run_mut() {
            run.sampled = false;
        }
    }

    fn next_wakeup(&self) -> Time {
        let decides_at = self.decides_at();
        let copy = self.member.copies_at();
        copy.map_or(decides_at, |copy| copy.min(decides_at))
    }

    fn wake(&mut self, now: Time) {
        self.member.send_copies(now);
        if self.decides_at() > now {
            return;
        }
        let Deadline::Passed { idle } = self.deadline else {
            return self.decide(now);
        };
        self.miss_signals();
        self.note_lateness(now);
        // Those of the last cycle are not received in this one.
        self.apply(Selection::Missing(Missing::NoCycle), None, StationSet::EMPTY);
        self.note_idle();
        // One that was stopped for long does not make up for every deadline that it slept through.
        let passed = self.periods_late(now);
        self.deadline = Deadline::Passed { idle: idle.saturating_add(1).saturating_add(passed) };
        self.count_votes(now, self.own_stations());
        self.end_pair_deadline(now);
    }

    /// Counts the stations with its configuration.
    fn count_votes(&mut self, now: Time, stations: usize) {
        let is_new = matches!(self.arbiter.knowledge, Knowledge::Listening { .. });
        self.member.count_votes(now, stations, is_new);
    }
}

/// The state of a program that the sender of a frame says it holds.
fn own_holding(body: &Body, program: ProgramId) -> Option<&Holding> {
    match body {
        Body::Turn(turn) => Holding::of(&turn.holdings, program),
        Body::Join(join) => Holding::of(&join.holdings, program),
        _ => None,
    }
}

impl Machine for RemoteIo {
    type Event = Event;

    fn handle_input(&mut self, now: Time, input: Input<'_>) {
        self.note_sleep(now);
        self.tend_pair(now);
        self.member.note_time(now);
        self.end_forces(now);
        match input {
            Input::Wakeup => self.wake(now),
            Input::Frame(frame) => self.receive(now, frame),
            Input::RemoteIo(input) => self.take(now, input),
            Input::Change(order) => self.take_change(now, order),
        }
        self.member.wake_at(self.next_wakeup());
    }

    fn poll_output(&mut self) -> Option<Output<Event>> {
        self.member.poll_output()
    }

    fn wakeup(&self) -> Time {
        self.member.wakeup()
    }

    fn configurations(&self) -> Option<Configurations> {
        Some(self.configurations())
    }

    fn outvoted(&self) -> Option<Outvoted> {
        self.member.outvoted()
    }

    fn turn_window(&self) -> Time {
        self.member.turn_window()
    }

    /// The turns of a cycle count at its deadline; between cycles a frame may start the next one.
    fn patience(&self) -> Duration {
        match self.deadline {
            Deadline::Ahead => self.settings.agreement.schedule.period() / PATIENCE_SHARE,
            Deadline::Passed { .. } => Duration::ZERO,
        }
    }
}

/// Share of a period in which the turns that arrive are taken together.
const PATIENCE_SHARE: u32 = 32;
