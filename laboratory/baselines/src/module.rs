//! The remote I/O of a pair: it paces the cycles, says what it samples, and drives what comes first from any box that drives.

use std::collections::VecDeque;
use std::sync::Arc;

use smallvec::smallvec;
use understudy_cycle::{Agreement, Copies, Input, Machine, Output, RemoteIoInput};
use understudy_wire::{
    Body, Cycle, Epoch, Frame, Header, Image, Lineage, Member, Moment, ProgramHash, ProgramId,
    Sample, StationSet, Step, Time,
};

/// A deadline.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Deadline {
    /// Boxes that drove in this cycle.
    pub(crate) drivers: usize,
    /// Whether they drove different things.
    pub(crate) differ: bool,
}

/// One remote I/O. See [`Machine`] for how it is driven.
#[derive(Debug)]
pub(crate) struct Module {
    program: ProgramId,
    agreement: Arc<Agreement>,
    field: Image,
    outputs: Image,
    cycle: u64,
    began: Time,
    decided: bool,
    /// What came in this cycle, in the order in which it came.
    driven: Vec<(Member, Image)>,
    copies: Copies,
    outbox: VecDeque<Output<Deadline>>,
}

impl Module {
    /// One that starts its first cycle a period after `now`.
    pub(crate) fn new(
        now: Time,
        program: ProgramId,
        agreement: &Arc<Agreement>,
        inputs: usize,
        outputs: usize,
    ) -> Self {
        Self {
            program,
            agreement: Arc::clone(agreement),
            field: Image::zero(inputs),
            outputs: Image::zero(outputs),
            cycle: 0,
            began: now,
            decided: true,
            driven: Vec::new(),
            copies: Copies::default(),
            outbox: VecDeque::new(),
        }
    }

    fn sample(&mut self, now: Time) {
        self.cycle += 1;
        self.began = now;
        self.decided = false;
        self.driven.clear();
        let moment = Moment { epoch: Epoch(0), cycle: Cycle(self.cycle) };
        let lineage = Lineage::genesis(ProgramHash::default(), moment);
        let frame = Arc::new(Frame {
            header: Header {
                cluster: self.agreement.cluster,
                configuration: self.agreement.configuration,
                prepared: None,
                moment,
                sender: Member::RemoteIo(self.program),
                alone: false,
            },
            body: Body::Sample(Sample {
                born: moment,
                base: lineage,
                before: lineage,
                after: lineage.after(&self.field),
                history: smallvec![Step::of(self.field.clone())],
                applied: None,
                excluded: StationSet::EMPTY,
                gone: StationSet::EMPTY,
                drives: true,
                writes: Default::default(),
                pulses: Default::default(),
                unforced: None,
                version: None,
            }),
        });
        self.copies.sent(now, &frame, &self.agreement.schedule);
        self.outbox.push_back(Output::Send(frame));
    }

    /// Drives what came first, or keeps what it drove.
    fn decide(&mut self) {
        self.decided = true;
        if let Some((_, outputs)) = self.driven.first() {
            self.outputs.clone_from(outputs);
        }
        let differ = self.driven.iter().any(|(_, outputs)| *outputs != self.outputs);
        self.outbox.push_back(Output::Drive { outputs: self.outputs.clone(), sampled: None });
        self.outbox.push_back(Output::Report(Deadline { drivers: self.driven.len(), differ }));
    }
}

impl Machine for Module {
    type Event = Deadline;

    fn handle_input(&mut self, now: Time, input: Input<'_>) {
        match input {
            Input::Frame(frame) => {
                let in_time = frame.header.moment.cycle.0 == self.cycle && !self.decided;
                let sender = frame.header.sender;
                if let (true, Body::Turn(turn)) = (in_time, &frame.body)
                    && let Some(word) = turn.words.first()
                    && self.driven.iter().all(|(driver, _)| *driver != sender)
                {
                    self.driven.push((sender, word.sum.clone()));
                }
            }
            Input::RemoteIo(RemoteIoInput::Field(sensors)) => self.field.clone_from(sensors),
            Input::Wakeup => {
                while let Some(frame) = self.copies.take_due(now, &self.agreement.schedule) {
                    self.outbox.push_back(Output::Send(frame));
                }
                if self.decided {
                    if self.began + self.agreement.schedule.period() <= now {
                        self.sample(now);
                    }
                } else if self.began + self.agreement.schedule.deadline() <= now {
                    self.decide();
                }
            }
            _ => {}
        }
    }

    fn poll_output(&mut self) -> Option<Output<Deadline>> {
        self.outbox.pop_front()
    }

    fn wakeup(&self) -> Time {
        let schedule = &self.agreement.schedule;
        let next = if self.decided {
            self.began + schedule.period()
        } else {
            self.began + schedule.deadline()
        };
        self.copies.wakeup().map_or(next, |copy| copy.min(next))
    }
}
