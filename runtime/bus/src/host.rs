//! The loop that runs one member on real time: drain what it says, sleep until something arrives or its time has come.
//!
//! Invariants: the loop never waits for anything but [`ppoll`], which it asks again and again within the turn window where the member has a core of
//! its own; and between two looks at the member's own
//! times it takes [`INPUTS_IN_A_ROW`] datagrams at most, so that no flood keeps a member from its turn.

mod reports;

use std::time::Duration;

use nix::errno::Errno;
use nix::poll::{PollFd, PollFlags, ppoll};
use nix::sys::time::TimeSpec;
use serde::{Deserialize, Serialize};
use tracing::span::EnteredSpan;
use tracing::{Span, debug, trace, trace_span};
use understudy_cycle::{Input, Machine, Output, RemoteIoInput};
use understudy_wire::{Body, Frame, Moment, Time, Via, encode};

use crate::clock::Clock;
use crate::error::BusError;
use crate::field::silence::Silence;
use crate::field::{FieldDriver, Look};
use crate::guard::{Guard, Opened, Refused};
use crate::host_event::HostEvent;
use crate::journal::{EventSink, Noted};
use crate::link::{Link, LinkCounters};
use crate::network_reception::{Arrival, NetworkReception};
use crate::orders::{Obeyed, Order, Orders};
use crate::retained::Retainer;
use crate::timing::Timing;
use crate::trouble::{Duplicates, Refusals};
use crate::unreceived::Unreceived;
use crate::watchdog::Watchdog;
use reports::Unsendable;

/// Datagrams taken before the member's own times are looked at again.
const INPUTS_IN_A_ROW: usize = 64;
/// Times that a member is woken without sleep in between, when it asks for times that have passed.
const WAKEUPS_IN_A_ROW: u32 = 16;
/// How long it sleeps then.
const BREATH: Duration = Duration::from_millis(1);
/// Troubles of one kind are reported together, so often at most.
const TROUBLE_PERIOD: Duration = Duration::from_secs(1);

/// What a member did while it ran.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Summary {
    /// Frames that it said.
    pub frames_said: u64,
    /// Frames that it heard, copies included.
    pub frames_heard: u64,
    /// Further copies of frames, over another path than the first one.
    #[serde(default)]
    pub second_copies: u64,
    /// Datagrams that were no frames, or did not count.
    pub refused: u64,
    /// Frames that broke a bound of the wire and were not sent.
    pub unsendable: u64,
    /// The latest that it was woken after the time that it had asked for, in nanoseconds.
    pub latest_wakeup_ns: u64,
    /// What the link could not do.
    pub link: LinkCounters,
}

/// One member with everything that it needs of the world.
pub struct Host<'a, M: Machine> {
    /// The member.
    pub machine: &'a mut M,
    /// Carries its frames.
    pub link: &'a mut dyn Link,
    /// Which copy of a frame counts, where the link has several paths.
    pub networks: Option<NetworkReception>,
    /// Closes and opens them.
    pub guard: &'a mut Guard,
    /// Its sensors and actuators.
    pub field: &'a mut dyn FieldDriver,
    /// Writes what it keeps for the time after a power failure; nothing where no folder is given.
    pub retainer: Option<Retainer>,
    /// Takes what it reports.
    pub sink: &'a mut dyn EventSink<M::Event>,
    /// Signs of life for systemd, where systemd asks for them.
    pub watchdog: Option<Watchdog>,
    /// What the operator and the system want of it.
    pub orders: &'a Orders,
    /// Its time.
    pub clock: Clock,
    /// Whether it waits actively within the turn window.
    pub spins: bool,
}

/// What the loop keeps from one round to the next.
#[derive(Debug, Default)]
struct Round {
    received: Vec<u8>,
    encoded: Vec<u8>,
    moment: Moment,
    /// Span of the cycle of `moment`.
    cycle: Option<EnteredSpan>,
    wakeups_in_a_row: u32,
    field_lost: bool,
    field_silence: Silence,
    refused: Refusals,
    duplicates: Duplicates,
    unreceived: Option<Unreceived>,
    unsendable: Unsendable,
    /// What the member says of the order that it was given last.
    obeyed: Obeyed,
    /// When the field was looked at last.
    looked_at: Time,
    reported: Time,
    timing: Timing,
    summary: Summary,
}

impl Round {
    fn moves_on_to(&mut self, moment: Moment) {
        if moment != std::mem::replace(&mut self.moment, moment) {
            // Before the next one begins, which would be within it.
            drop(self.cycle.take());
            let (epoch, cycle) = (moment.epoch.0, moment.cycle.0);
            self.cycle = Some(trace_span!("cycle", epoch, cycle).entered());
        }
    }
}

/// Span of a frame that is received or sent.
fn frame_span(frame: &Frame) -> Span {
    trace_span!("frame", kind = kind(&frame.body), sender = ?frame.header.sender)
}

/// Name of a kind of frame.
fn kind(body: &Body) -> &'static str {
    match body {
        Body::Sync => "sync",
        Body::Sample(_) => "sample",
        Body::Turn(_) => "turn",
        Body::Join(_) => "join",
        Body::Transfer(_) => "transfer",
        Body::Field(_) => "field",
        Body::Actuation(_) => "actuation",
        Body::Pair(_) => "pair",
    }
}

/// Until one of them is readable, or for so long.
fn poll_for(descriptors: &mut [PollFd<'_>], time: Duration) -> Result<(), BusError> {
    match ppoll(descriptors, Some(TimeSpec::from_duration(time)), None) {
        Ok(_) | Err(Errno::EINTR) => Ok(()),
        Err(error) => Err(BusError::system("to sleep until something arrives")(error)),
    }
}

impl<M: Machine> Host<'_, M> {
    /// Runs the member on the calling thread until it is told to stop.
    ///
    /// # Errors
    /// [`BusError::System`] where the system refuses to let it sleep; [`BusError::Outvoted`] where a majority has another configuration.
    pub fn run(mut self) -> Result<Summary, BusError> {
        let mut round = Round::default();
        self.agree();
        self.drain(self.clock.now(), &mut round);
        loop {
            if self.obey(&mut round) || self.machine.outvoted().is_some() {
                break;
            }
            if self.networks.is_some() {
                let unplugged = self.orders.unplugged();
                for via in Via::ALL {
                    self.link.plug(via, !unplugged[via.index()]);
                }
            }
            self.look(&mut round);
            let heard = self.listen(&mut round);
            let now = self.clock.now();
            self.note_silence(now, &mut round);
            let due = self.machine.wakeup();
            if now >= due && round.wakeups_in_a_row < WAKEUPS_IN_A_ROW {
                round.wakeups_in_a_row += 1;
                let late_ns = u64::try_from(now.since(due).as_nanos()).unwrap_or(u64::MAX);
                // What it asks for before its first input is asked of a clock that it has not seen yet.
                if due > Time::default() {
                    round.summary.latest_wakeup_ns = round.summary.latest_wakeup_ns.max(late_ns);
                    round.timing.woken(now.since(due));
                }
                if let Some(watchdog) = &mut self.watchdog {
                    watchdog.woken(now);
                }
                self.machine.handle_input(now, Input::Wakeup);
                self.drain(now, &mut round);
            } else if heard < INPUTS_IN_A_ROW {
                let until = if now >= due { now + BREATH } else { due };
                if let Some(watchdog) = &mut self.watchdog {
                    watchdog.rests(now, until);
                }
                self.sleep(now, until)?;
                round.wakeups_in_a_row = 0;
            }
            self.report_reopenings(now);
            self.report_trouble(now, TROUBLE_PERIOD, &mut round);
            self.report_timing(now, false, &mut round);
        }
        let now = self.clock.now();
        self.report_trouble(now, Duration::ZERO, &mut round);
        self.report_timing(now, true, &mut round);
        if let Some(watchdog) = &self.watchdog {
            watchdog.stopping();
        }
        if let Some(retainer) = self.retainer.take() {
            retainer.finish();
        }
        round.summary.link = self.link.counters();
        let stopped = HostEvent::Stopped(round.summary);
        self.sink.record(now, Noted::Host(stopped));
        match self.machine.outvoted() {
            Some(outvoted) => Err(BusError::Outvoted(outvoted)),
            None => Ok(round.summary),
        }
    }

    /// True where it is to stop.
    fn obey(&mut self, round: &mut Round) -> bool {
        while let Some(given) = self.orders.take() {
            let input = match &given.order {
                Order::Stop => return true,
                // Holds already: it is asked of the orders for each frame.
                Order::Cut(_) => continue,
                Order::Release => Input::RemoteIo(RemoteIoInput::Release),
                Order::Choose(choice) => Input::RemoteIo(RemoteIoInput::Choose(*choice)),
                Order::Force(force) => Input::RemoteIo(RemoteIoInput::Force(force)),
                Order::Unforce(unforce) => Input::RemoteIo(RemoteIoInput::Unforce(unforce)),
                Order::Write(write) => Input::RemoteIo(RemoteIoInput::Write(write)),
                Order::Change(order) => Input::Change(order),
            };
            debug!(order = ?given.order, "an order");
            let now = self.clock.now();
            self.machine.handle_input(now, input);
            self.agree();
            self.drain(now, round);
            given.answer(round.obeyed.take());
        }
        false
    }

    /// Lets what opens frames know which configurations the member has.
    fn agree(&mut self) {
        if let Some(configurations) = self.machine.configurations() {
            self.guard.agree(configurations);
            self.field.agree(configurations);
        }
    }

    /// Looks at the field where that was longer ago than a breath: a member that was suspended while it took its frames would sample the field of
    /// before.
    fn look_again(&mut self, round: &mut Round) {
        if self.clock.now().since(round.looked_at) > BREATH {
            self.look(round);
        }
    }

    /// Tells the member what its field shows, where that comes by another way than the link.
    fn look(&mut self, round: &mut Round) {
        round.looked_at = self.clock.now();
        if let Some(contested) = self.field.contested() {
            let event =
                if contested { HostEvent::FieldContested } else { HostEvent::FieldUncontested };
            self.sink.record(self.clock.now(), Noted::Host(event));
        }
        let Some(look) = self.field.look() else {
            return;
        };
        let now = self.clock.now();
        if let Some(version) = self.field.read_by() {
            let input = Input::RemoteIo(RemoteIoInput::Points(version));
            self.machine.handle_input(now, input);
            self.drain(now, round);
        }
        let (input, event) = match &look {
            Look::Sensors(sensors) => {
                (Input::RemoteIo(RemoteIoInput::Field(sensors)), HostEvent::FieldRegained)
            }
            Look::Lost(reason) => {
                let reason = reason.clone();
                (Input::RemoteIo(RemoteIoInput::FieldLost), HostEvent::FieldLost { reason })
            }
        };
        let lost = matches!(look, Look::Lost(_));
        if lost != std::mem::replace(&mut round.field_lost, lost) {
            self.sink.record(now, Noted::Host(event));
        }
        self.machine.handle_input(now, input);
        self.drain(now, round);
    }

    /// Reports a field that is reached over the link and shows nothing any more. Its last sensors are sampled meanwhile, where no other module reads them.
    fn note_silence(&mut self, now: Time, round: &mut Round) {
        let Some(patience) = self.field.patience() else {
            return;
        };
        let lasted = round.field_silence.lasts(now, patience);
        let limit = self.field.stale_after();
        if let Some(lasted) = lasted {
            let seconds = lasted.as_secs_f64();
            let then = match limit {
                Some(_) => "the modules of the other remote I/O count alone, where it is received",
                None => "the last sensors are sampled",
            };
            let reason = format!("its plant has sent nothing for {seconds:.1} s; {then}");
            self.sink.record(now, Noted::Host(HostEvent::FieldLost { reason }));
        }
        if limit.is_some_and(|limit| round.field_silence.is_stale_after(limit)) {
            self.machine.handle_input(now, Input::RemoteIo(RemoteIoInput::FieldStale));
            self.drain(now, round);
        }
    }

    /// Takes what has arrived, and says how many datagrams that were.
    fn listen(&mut self, round: &mut Round) -> usize {
        for taken in 0..INPUTS_IN_A_ROW {
            let Some(via) = self.link.receive(&mut round.received) else {
                return taken;
            };
            // A frame that is cut from a network has not arrived, so that its copy over the direct link counts.
            if via != Via::Link
                && self.orders.has_cuts()
                && let Some(sender) = self.guard.claimed_sender(&round.received)
                && self.orders.is_cut(sender)
            {
                continue;
            }
            self.look_again(round);
            let now = self.clock.now();
            let datagram =
                self.networks.as_ref().map(|_| NetworkReception::identity(&round.received));
            let opened = self.guard.open(via, &mut round.received);
            if let Some(datagram) = datagram
                && self.is_second_copy(now, via, datagram, &opened)
            {
                round.summary.second_copies += 1;
                continue;
            }
            match opened {
                Ok(Opened::ForAnother | Opened::SecondCopy(_)) => {}
                Ok(Opened::Frame(frame)) => {
                    round.summary.frames_heard += 1;
                    if let Some(unreceived) = &mut round.unreceived
                        && unreceived.shown_by(now, &frame)
                    {
                        self.guard.ask_for_life();
                    }
                    // Which epoch counts is for the member to say, by its own frames; another's Sync only moves it on in that one.
                    let (known, said) = (round.moment, frame.header.moment);
                    let moves_on = said.epoch == known.epoch && said > known;
                    if matches!(frame.body, Body::Sync) && (known == Moment::default() || moves_on)
                    {
                        round.moves_on_to(said);
                    }
                    let _frame = frame_span(&frame).entered();
                    trace!("received");
                    let input = match self.field.sense(&frame) {
                        Some(sensors) => {
                            if round.field_silence.ends() {
                                self.sink.record(now, Noted::Host(HostEvent::FieldRegained));
                            }
                            Input::RemoteIo(RemoteIoInput::Field(sensors))
                        }
                        None => Input::Frame(&frame),
                    };
                    self.machine.handle_input(now, input);
                    self.drain(now, round);
                }
                Err(refused) => {
                    round.summary.refused += 1;
                    debug!(?refused, "a datagram was refused");
                    let now = self.clock.now();
                    if let Some(event) = round.duplicates.note(now, &refused) {
                        self.sink.record(now, Noted::Host(event));
                    }
                    round.refused.note(refused);
                }
            }
        }
        INPUTS_IN_A_ROW
    }

    /// Whether an authentic datagram came over another path before; it is counted for the path that it came over now.
    fn is_second_copy(
        &mut self,
        now: Time,
        via: Via,
        datagram: u64,
        opened: &Result<Opened, Refused>,
    ) -> bool {
        let Some(networks) = &mut self.networks else {
            return false;
        };
        let (sender, is_second) = match opened {
            Ok(Opened::Frame(frame)) => (Some(frame.header.sender), false),
            Ok(Opened::SecondCopy(sender)) => (Some(*sender), true),
            Ok(Opened::ForAnother) => (None, false),
            Err(_) => return false,
        };
        let arrival = networks.note(now, via, datagram);
        let is_second = is_second || matches!(arrival, Arrival::Second { .. });
        // One that is so late that its first copy is forgotten counts for no path.
        if let Some(sender) = sender
            && (arrival != Arrival::First || !is_second)
        {
            networks.count(sender, via, arrival);
        }
        is_second
    }

    fn drain(&mut self, now: Time, round: &mut Round) {
        while let Some(output) = self.machine.poll_output() {
            match output {
                Output::Send(frame) => {
                    round.moves_on_to(frame.header.moment);
                    self.say(&frame, round);
                }
                Output::Drive { outputs, sampled } => {
                    let age = self.clock.now().since(now);
                    if let Some(frame) = self.field.drive(round.moment, &outputs, age) {
                        self.say(&frame, round);
                    }
                    if let Some(sampled) = sampled {
                        round.timing.driven(sampled, self.clock.now());
                    }
                }
                Output::Follow(outputs) => {
                    let age = self.clock.now().since(now);
                    if let Some(frame) = self.field.drive(round.moment, &outputs, age) {
                        self.say(&frame, round);
                    }
                }
                Output::Connect(connects) => self.field.connect(connects),
                Output::EndWith(outputs) => self.field.end_with(&outputs),
                Output::LayOut(version) => self.field.lay_out(version),
                Output::Report(event) => self.sink.record(now, Noted::Member(event)),
                Output::Retain(record) => {
                    if let Some(retainer) = &self.retainer {
                        retainer.keep(*record);
                    }
                }
                Output::Answer(answer) => self.orders.answer(answer),
                Output::Obeyed(obeyed) => round.obeyed = Some(obeyed),
            }
        }
    }

    fn say(&mut self, frame: &Frame, round: &mut Round) {
        // Who sends for the first time says by it who it is.
        let sender = frame.header.sender;
        round.unreceived.get_or_insert_with(|| Unreceived::new(sender));
        round.encoded.clear();
        let encoded = encode(frame, &mut round.encoded).map_err(|error| error.to_string());
        let datagram = encoded.and_then(|()| self.guard.close(frame, &round.encoded));
        match datagram {
            Ok(datagram) => {
                round.summary.frames_said += 1;
                let _frame = frame_span(frame).entered();
                trace!(bytes = datagram.len(), "sent");
                self.link.send(frame, datagram);
            }
            Err(reason) => {
                round.summary.unsendable += 1;
                round.unsendable.note(reason);
            }
        }
    }

    /// Until something arrives; where that may wait, until more has.
    fn sleep(&self, now: Time, until: Time) -> Result<(), BusError> {
        let mut descriptors = [
            PollFd::new(self.orders.readiness(), PollFlags::POLLIN),
            PollFd::new(self.link.readiness(), PollFlags::POLLIN),
        ];
        let window = self.machine.turn_window().min(until);
        if self.spins && now < window {
            while !descriptors.iter().any(|it| it.any() == Some(true)) && self.clock.now() < window
            {
                std::hint::spin_loop();
                poll_for(&mut descriptors, Duration::ZERO)?;
            }
            return Ok(());
        }
        poll_for(&mut descriptors, until.since(now))?;
        let [orders, link] = &mut descriptors;
        let patience = self.machine.patience();
        if patience > Duration::ZERO && link.any() == Some(true) && orders.any() == Some(false) {
            let left = until.since(self.clock.now());
            poll_for(std::slice::from_mut(orders), patience.min(left))?;
        }
        Ok(())
    }
}
