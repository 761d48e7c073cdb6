//! A member that is measured while it does its part.

use std::process;
use std::time::{Duration, Instant};

use serde::{Deserialize, Serialize};
use understudy_bus::Distribution;
use understudy_cycle::{Input, Machine, Output, Outvoted};
use understudy_wire::{Body, Frame, Member, StationId, Time};

use crate::exchange::meter::Meter;

/// When a member measures, on its own clock.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
pub(super) struct Window {
    /// It begins so long after the first cycle that was complete for this member.
    pub(super) settling: Duration,
    /// It begins so long after the first input at the latest, whatever the cycles are like.
    pub(super) starts_within: Duration,
    /// It lasts so long.
    pub(super) lasts: Duration,
}

impl Window {
    /// Longer than any member of the cluster measures, from its first input on.
    pub(super) fn longest(self) -> Duration {
        self.starts_within + self.lasts
    }
}

/// After the longest window a member ends by itself: one that has all of a processor in real time may keep the process that would end it from
/// running.
const ENDS_AFTER: Duration = Duration::from_secs(4);

/// What one member measured.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct Measured {
    /// How late it was woken.
    pub(super) wakeups: Distribution,
    /// From the first frame of a cycle to the last turn; at the understudy, which receives all.
    pub(super) exchange: Distribution,
    /// Cycles in which a turn was not received; at the understudy.
    pub(super) incomplete_cycles: u64,
    /// From the sample to the outputs that are proved for it; at a remote I/O.
    pub(super) sample_to_output: Distribution,
    /// Deadlines of a remote I/O at which no output was proved.
    pub(super) missed: u64,
    /// Deadlines of a remote I/O.
    pub(super) deadlines: u64,
}

/// A member of which only the measurement is reported.
pub(super) struct Observed<M> {
    machine: M,
    window: Window,
    /// Exchange of each cycle at the understudy.
    meter: Option<(Member, Meter)>,
    measured: Measured,
    /// Time of the first input.
    started: Option<Time>,
    begins: Option<Time>,
    /// The last input: when it came on the clock of the member, and on that of this process.
    input: (Time, Instant),
    incomplete_before: u64,
    reported: bool,
}

impl<M: Machine> Observed<M> {
    /// `understudy`: the number of stations where this member is the understudy.
    pub(super) fn new(machine: M, own: Member, understudy: Option<usize>, window: Window) -> Self {
        Self {
            machine,
            window,
            meter: understudy.map(|stations| (own, Meter::new(stations, 0, 0))),
            measured: Measured::default(),
            started: None,
            begins: None,
            input: (Time::default(), Instant::now()),
            incomplete_before: 0,
            reported: false,
        }
    }

    /// The time of the member, as it is now.
    fn now(&self) -> Time {
        let (at, instant) = self.input;
        at + instant.elapsed()
    }

    /// Whether what happens at `now` is measured.
    fn measures(&self, now: Time) -> bool {
        self.begins.is_some_and(|begins| begins <= now && now < begins + self.window.lasts)
    }

    /// The first complete cycle of this member, where it is that.
    fn complete(&mut self, now: Time) {
        self.begins.get_or_insert(now + self.window.settling);
    }

    fn meter(&mut self, now: Time, frame: &Frame) {
        let is_measured = self.measures(now);
        let Some((_, meter)) = &mut self.meter else {
            return;
        };
        let turn = match (&frame.body, frame.header.sender) {
            (Body::Turn(_), Member::Station(station)) => Some(station),
            _ => None,
        };
        let duration = meter.frame(now, frame.header.moment.cycle.0, turn);
        let incomplete = meter.incomplete();
        if is_measured {
            self.measured.incomplete_cycles = incomplete - self.incomplete_before;
        } else {
            self.incomplete_before = incomplete;
        }
        if let Some(duration) = duration {
            self.complete(now);
            if is_measured {
                self.measured.exchange.note(duration);
            }
        }
    }

    fn note_output(&mut self, output: &Output<M::Event>) {
        match output {
            Output::Send(frame) if self.meter.is_some() => {
                let now = self.now();
                self.meter(now, frame);
            }
            // A controller begins with its first turn.
            Output::Send(frame) if matches!(frame.body, Body::Turn(_)) => self.complete(self.now()),
            Output::Drive { sampled, .. } => {
                let now = self.now();
                if sampled.is_some() {
                    self.complete(now);
                }
                if self.measures(now) {
                    self.measured.deadlines += 1;
                    match sampled {
                        Some(sampled) => self.measured.sample_to_output.note(now.since(*sampled)),
                        None => self.measured.missed += 1,
                    }
                }
            }
            _ => {}
        }
    }
}

impl<M: Machine> Machine for Observed<M> {
    type Event = Measured;

    fn handle_input(&mut self, now: Time, input: Input<'_>) {
        self.input = (now, Instant::now());
        let started = *self.started.get_or_insert(now);
        if now.since(started) > self.window.longest() + ENDS_AFTER {
            process::exit(0);
        }
        if now.since(started) > self.window.starts_within {
            self.begins.get_or_insert(now);
        }
        match input {
            Input::Wakeup if self.measures(now) => {
                self.measured.wakeups.note(now.since(self.machine.wakeup()));
            }
            Input::Frame(frame) => self.meter(now, frame),
            _ => {}
        }
        self.machine.handle_input(now, input);
    }

    fn poll_output(&mut self) -> Option<Output<Measured>> {
        loop {
            let Some(output) = self.machine.poll_output() else {
                break;
            };
            self.note_output(&output);
            return Some(match output {
                Output::Report(_) => continue,
                Output::Send(frame) => Output::Send(frame),
                Output::Drive { outputs, sampled } => Output::Drive { outputs, sampled },
                Output::Follow(outputs) => Output::Follow(outputs),
                Output::Connect(connects) => Output::Connect(connects),
                Output::EndWith(outputs) => Output::EndWith(outputs),
                Output::LayOut(version) => Output::LayOut(version),
                Output::Retain(record) => Output::Retain(record),
                Output::Answer(answer) => Output::Answer(answer),
                Output::Obeyed(obeyed) => Output::Obeyed(obeyed),
            });
        }
        let (now, _) = self.input;
        let over = self.begins.is_some_and(|begins| now >= begins + self.window.lasts);
        if !over || std::mem::replace(&mut self.reported, true) {
            return None;
        }
        Some(Output::Report(std::mem::take(&mut self.measured)))
    }

    fn wakeup(&self) -> Time {
        self.machine.wakeup()
    }

    fn outvoted(&self) -> Option<Outvoted> {
        self.machine.outvoted()
    }

    fn turn_window(&self) -> Time {
        self.machine.turn_window()
    }

    fn patience(&self) -> Duration {
        self.machine.patience()
    }
}

/// The stations of a cluster with one understudy, where `own` is that one.
pub(super) fn stations_of_understudy(own: Member, controllers: usize) -> Option<usize> {
    let understudy = Member::Station(StationId(controllers as u8));
    (own == understudy).then_some(controllers + 1)
}
