//! One box of a redundant pair.
//!
//! In a *hot-standby* pair one box is active: it scans, drives, and sends its state to the other one in every cycle, which is its
//! heartbeat too. The standby takes over after so many cycles without one. In an *active-active* pair both scan and drive, and the
//! remote I/O takes what comes first.
//!
//! The pair is a generous one: the standby takes over within the cycle of the last heartbeat that it misses, and drives in it; a box
//! that lacked a sample takes the other's state instead of going on without; a box that hears from a newer active one steps down
//! at once. What no such pair can do is to tell a silent partner from a lost frame.

use std::collections::VecDeque;
use std::sync::Arc;

use smallvec::smallvec;
use understudy_cycle::{Agreement, Copies, Input, Machine, Output};
use understudy_executable::{Executable, Scratch};
use understudy_wire::{
    Body, Cycle, Digest, Epoch, Frame, Header, Holding, Image, Lineage, Member, Moment,
    ProgramHash, ProgramId, ProgramSet, Segment, StationId, StationSet, Time, Transfer, Turn, Word,
};

/// How two boxes share one program.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Redundancy {
    /// One drives; the other takes over after so many cycles without a heartbeat.
    HotStandby {
        /// From 1 on.
        misses: u32,
    },
    /// Both drive.
    ActiveActive,
}

/// Cycles without the other box after which one of an active-active pair that is out of date goes on alone, and after which a
/// box that has just started does so.
const PATIENCE_CYCLES: u32 = 5;

/// What a box is told.
#[derive(Debug, Clone)]
pub(crate) struct Settings {
    /// 0 or 1.
    pub(crate) rank: u8,
    pub(crate) redundancy: Redundancy,
    pub(crate) agreement: Arc<Agreement>,
    pub(crate) program: ProgramId,
    pub(crate) scan: Arc<Executable>,
}

/// What a box reports.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Event {
    /// It drives from now on, with a state that lacks so many samples that were acted upon.
    TookOver {
        /// Samples that no state holds any more.
        forgotten: u64,
    },
    /// It drives no more, for the other one does.
    SteppedDown,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Standing {
    Listening { cycles: u32 },
    Standby,
    Active,
}

/// One box. See [`Machine`] for how it is driven.
#[derive(Debug)]
pub(crate) struct Partner {
    settings: Settings,
    standing: Standing,
    /// Raised by each take-over; the active box of the higher term is the right one.
    term: u64,
    state: Image,
    /// The cycle of the last sample in the state.
    stepped: u64,
    cycle: u64,
    began: Time,
    sample: Option<Image>,
    /// Whether this cycle's sample is in the state.
    done: bool,
    checked: bool,
    /// Whether the other one was heard in this cycle, and cycles in a row in which it was not.
    heard: bool,
    silent: u32,
    copies: Copies,
    scratch: Scratch,
    outbox: VecDeque<Output<Event>>,
}

impl Partner {
    /// A box of a pair that is just switched on: the first one drives.
    pub(crate) fn first(now: Time, settings: Settings) -> Self {
        let drives = settings.rank == 0 || settings.redundancy == Redundancy::ActiveActive;
        let standing = if drives { Standing::Active } else { Standing::Standby };
        Self::new(now, settings, standing)
    }

    /// A box that was repaired: it listens for the other's state.
    pub(crate) fn repaired(now: Time, settings: Settings) -> Self {
        Self::new(now, settings, Standing::Listening { cycles: 0 })
    }

    fn new(now: Time, settings: Settings, standing: Standing) -> Self {
        let scan = &settings.scan;
        let state = Image::from_words(scan.state_count(), scan.initial());
        Self {
            standing,
            term: 0,
            state: state.unwrap_or_else(|_| Image::zero(scan.state_count())),
            stepped: 0,
            cycle: 0,
            began: now,
            sample: None,
            done: false,
            checked: true,
            heard: false,
            silent: 0,
            copies: Copies::default(),
            scratch: Scratch::default(),
            outbox: VecDeque::new(),
            settings,
        }
    }

    /// Whether it drives.
    pub(crate) fn drives(&self) -> bool {
        self.standing == Standing::Active
    }

    fn is_pair_of_equals(&self) -> bool {
        self.settings.redundancy == Redundancy::ActiveActive
    }

    fn begin(&mut self, began: Time, cycle: u64) {
        self.cycle = cycle;
        self.began = began;
        self.sample = None;
        self.done = false;
        self.checked = false;
        self.heard = false;
    }

    /// Whether the state is what the last cycle left. One of equals that is behind has to take the other's; an active box with a
    /// standby has nobody to take it from.
    fn is_current(&self) -> bool {
        !self.is_pair_of_equals() || self.stepped + 1 >= self.cycle
    }

    /// Scans with this cycle's sample and drives, once it may.
    fn scan(&mut self, now: Time) {
        let Some(inputs) = &self.sample else {
            return;
        };
        if self.done || !self.drives() || !self.is_current() {
            return;
        }
        let scan = &self.settings.scan;
        let mut outputs = Image::zero(scan.output_count());
        scan.step(&mut self.scratch, self.state.words_mut(), inputs.words(), outputs.words_mut());
        self.done = true;
        self.stepped = self.cycle;
        let program = self.settings.program;
        let turn = Turn {
            heard: StationSet::EMPTY,
            holdings: smallvec![Holding {
                program,
                born: self.moment(0),
                lineage: Lineage::genesis(ProgramHash::default(), self.moment(0)),
                stepped: self.moment(self.stepped),
                digest: Digest::of(&self.state),
                version: None
            }],
            words: smallvec![Word { mask: ProgramSet::only(program), sum: outputs }],
            recalled: Vec::new(),
            lacks: ProgramSet::EMPTY,
            relayed: Vec::new(),
        };
        self.send(now, Body::Turn(turn));
        self.give_state(now);
    }

    /// A cycle of this term.
    fn moment(&self, cycle: u64) -> Moment {
        Moment { epoch: Epoch(self.term), cycle: Cycle(cycle) }
    }

    /// The state for the other one; also the heartbeat.
    fn give_state(&mut self, now: Time) {
        let transfer = Transfer {
            to: StationId(1 - self.settings.rank),
            program: self.settings.program,
            hash: ProgramHash::default(),
            born: self.moment(0),
            lineage: Lineage::genesis(ProgramHash::default(), self.moment(0)),
            stepped: self.moment(self.stepped),
            digest: Digest::of(&self.state),
            state: Segment::single(&self.state),
        };
        self.send(now, Body::Transfer(transfer));
    }

    fn send(&mut self, now: Time, body: Body) {
        let agreement = &self.settings.agreement;
        let frame = Arc::new(Frame {
            header: Header {
                cluster: agreement.cluster,
                configuration: agreement.configuration,
                prepared: None,
                moment: self.moment(self.cycle),
                sender: Member::Station(StationId(self.settings.rank)),
                alone: false,
            },
            body,
        });
        self.copies.sent(now, &frame, &agreement.schedule);
        self.outbox.push_back(Output::Send(frame));
    }

    fn receive(&mut self, now: Time, frame: &Frame) {
        let cycle = frame.header.moment.cycle.0;
        if cycle < self.cycle {
            return;
        }
        if cycle > self.cycle {
            self.begin(now, cycle);
        }
        match &frame.body {
            Body::Sample(sample) => {
                self.sample = sample.history.last().map(|step| step.inputs.clone());
            }
            Body::Transfer(transfer) => self.hear(frame.header.moment.epoch.0, transfer),
            _ => {}
        }
        self.scan(now);
    }

    /// The other one's heartbeat.
    fn hear(&mut self, term: u64, transfer: &Transfer) {
        self.heard = true;
        self.silent = 0;
        let stepped = transfer.stepped.cycle.0;
        let other_is_first = self.settings.rank == 1;
        let takes = match (self.standing, self.settings.redundancy) {
            (Standing::Active, Redundancy::HotStandby { .. }) => {
                let outranked = term > self.term || (term == self.term && other_is_first);
                if outranked {
                    self.standing = Standing::Standby;
                    self.outbox.push_back(Output::Report(Event::SteppedDown));
                }
                outranked
            }
            (Standing::Active, Redundancy::ActiveActive) => {
                let differs = transfer.state.part != self.state;
                stepped > self.stepped || (stepped == self.stepped && differs && other_is_first)
            }
            (_, redundancy) => {
                self.standing = match redundancy {
                    Redundancy::ActiveActive => Standing::Active,
                    Redundancy::HotStandby { .. } => Standing::Standby,
                };
                true
            }
        };
        if takes {
            self.term = self.term.max(term);
            self.state.clone_from(&transfer.state.part);
            self.stepped = stepped;
            self.done = stepped == self.cycle;
        }
    }

    /// The turns of a cycle are over: whoever was silent missed his.
    fn check(&mut self, now: Time) {
        self.checked = true;
        if !self.heard {
            self.silent += 1;
        }
        let patience = match (self.standing, self.settings.redundancy) {
            (Standing::Standby, Redundancy::HotStandby { misses }) => misses,
            (Standing::Listening { cycles }, _) => {
                self.standing = Standing::Listening { cycles: cycles + 1 };
                PATIENCE_CYCLES
            }
            (Standing::Active, Redundancy::ActiveActive) if !self.is_current() => PATIENCE_CYCLES,
            _ => {
                // Nothing was scanned without a sample; the heartbeat comes all the same.
                if !self.done {
                    self.give_state(now);
                }
                return;
            }
        };
        if self.silent >= patience {
            let forgotten = self.cycle.saturating_sub(self.stepped + 1);
            self.standing = Standing::Active;
            self.term += 1;
            self.stepped = self.cycle.saturating_sub(1);
            self.outbox.push_back(Output::Report(Event::TookOver { forgotten }));
            self.scan(now);
            if !self.done {
                self.give_state(now);
            }
        }
    }
}

impl Machine for Partner {
    type Event = Event;

    fn handle_input(&mut self, now: Time, input: Input<'_>) {
        match input {
            Input::Frame(frame) => self.receive(now, frame),
            Input::Wakeup => {
                let schedule = &self.settings.agreement.schedule;
                while let Some(frame) = self.copies.take_due(now, schedule) {
                    self.outbox.push_back(Output::Send(frame));
                }
                let (last_call, period) = (schedule.last_call(), schedule.period());
                let overdue = self.began + period + schedule.guard();
                if !self.checked && self.began + last_call <= now {
                    self.check(now);
                }
                if overdue <= now {
                    self.begin(self.began + period, self.cycle + 1);
                }
            }
            _ => {}
        }
    }

    fn poll_output(&mut self) -> Option<Output<Event>> {
        self.outbox.pop_front()
    }

    fn wakeup(&self) -> Time {
        let schedule = &self.settings.agreement.schedule;
        let next = if self.checked {
            self.began + schedule.period() + schedule.guard()
        } else {
            self.began + schedule.last_call()
        };
        self.copies.wakeup().map_or(next, |copy| copy.min(next))
    }
}
