//! A machine that sends the frames of a cycle and does nothing else.

use std::collections::VecDeque;
use std::sync::Arc;
use std::time::Duration;

use understudy_cycle::{Input, Machine, Output};
use understudy_wire::{
    Body, ClusterHash, ConfigurationHash, Cycle, Digest, Epoch, Frame, Header, Holding, Image,
    Lineage, Member, Moment, ProgramId, ProgramSet, Sample, StationId, StationSet, Step, Time,
    Turn, Word,
};

use super::meter::{Exchange, Meter};

/// Stations of the pattern: three controllers and their understudy.
pub(super) const STATIONS: u8 = 4;
/// Programs, and remote I/Os, in the pattern.
pub(super) const PROGRAMS: u8 = 3;
/// The cycle master, which measures.
pub(super) const CYCLE_MASTER: Member = Member::Station(StationId(0));
/// Bits of each sample and of each output.
const WIDTH: usize = 8;

/// One member of the pattern. The cycle master sends a Sync every period, whether or not the last cycle was complete, and reports the
/// exchange once enough cycles are measured.
#[derive(Debug)]
pub(crate) struct Pattern {
    own: Member,
    period: Duration,
    due: Time,
    moment: Moment,
    sampled: ProgramSet,
    published: StationSet,
    outputs: VecDeque<Output<Exchange>>,
    /// Until it has reported; in the cycle master.
    meter: Option<Meter>,
}

impl Pattern {
    /// The part of `own`: a station below [`STATIONS`] or a remote I/O below [`PROGRAMS`].
    pub(crate) fn new(own: Member, period: Duration, meter: Meter) -> Self {
        Self {
            own,
            period,
            due: Time::default(),
            // As long as a real epoch is on the wire.
            moment: Moment { epoch: Epoch(u64::MAX), cycle: Cycle(0) },
            sampled: ProgramSet::EMPTY,
            published: StationSet::EMPTY,
            outputs: VecDeque::new(),
            meter: (own == CYCLE_MASTER).then_some(meter),
        }
    }

    fn is_cycle_master(&self) -> bool {
        self.own == CYCLE_MASTER
    }

    fn begin(&mut self, moment: Moment) {
        self.moment = moment;
        self.sampled = ProgramSet::EMPTY;
        self.published = StationSet::EMPTY;
    }

    fn send(&mut self, now: Time, body: Body) {
        let frame = frame(self.own, self.moment, body);
        self.measure(now, &frame);
        self.outputs.push_back(Output::Send(Arc::new(frame)));
    }

    fn measure(&mut self, now: Time, frame: &Frame) {
        let Some(meter) = &mut self.meter else {
            return;
        };
        meter.frame(now, frame.header.moment.cycle.0, turn_of(frame));
        if let Some(exchange) = meter.result() {
            self.meter = None;
            self.outputs.push_back(Output::Report(exchange));
        }
    }

    /// Takes the turn of this station where it has the token: station 0 after its sample, the others after their predecessor.
    fn take_turn(&mut self, now: Time) {
        let Member::Station(own) = self.own else {
            return;
        };
        let has_token = match own.0.checked_sub(1) {
            None => self.sampled.contains(ProgramId(0)),
            Some(before) => self.published.contains(StationId(before)),
        };
        if has_token && own.0 < STATIONS && !self.published.contains(own) {
            self.published.insert(own);
            self.send(now, turn(own));
        }
    }
}

impl Machine for Pattern {
    type Event = Exchange;

    fn handle_input(&mut self, now: Time, input: Input<'_>) {
        match input {
            Input::Wakeup if self.is_cycle_master() && now >= self.due => {
                self.due = now + self.period;
                self.begin(self.moment.plus(1));
                self.send(now, Body::Sync);
            }
            Input::Frame(frame) => {
                self.measure(now, frame);
                match (&frame.body, frame.header.sender) {
                    (Body::Sync, _) if frame.header.moment > self.moment => {
                        self.begin(frame.header.moment);
                        if matches!(self.own, Member::RemoteIo(program) if program.0 < PROGRAMS) {
                            self.send(now, sample());
                        }
                    }
                    (Body::Sample(_), Member::RemoteIo(program))
                        if frame.header.moment == self.moment =>
                    {
                        self.sampled.insert(program);
                    }
                    (Body::Turn(_), Member::Station(station))
                        if frame.header.moment == self.moment =>
                    {
                        self.published.insert(station);
                    }
                    _ => return,
                }
                self.take_turn(now);
            }
            _ => {}
        }
    }

    fn poll_output(&mut self) -> Option<Output<Exchange>> {
        self.outputs.pop_front()
    }

    fn wakeup(&self) -> Time {
        if self.is_cycle_master() { self.due } else { Time(u64::MAX) }
    }
}

/// The station whose turn a frame is.
pub(super) fn turn_of(frame: &Frame) -> Option<StationId> {
    match (&frame.body, frame.header.sender) {
        (Body::Turn(_), Member::Station(station)) => Some(station),
        _ => None,
    }
}

fn frame(sender: Member, moment: Moment, body: Body) -> Frame {
    Frame {
        header: Header {
            // As long as real hashes are on the wire.
            cluster: ClusterHash(u64::MAX),
            configuration: ConfigurationHash(u64::MAX),
            prepared: None,
            moment,
            sender,
            alone: false,
        },
        body,
    }
}

/// Eight samples, as a remote I/O with the default history sends them.
fn sample() -> Body {
    Body::Sample(Sample {
        born: moment(),
        base: Lineage(u64::MAX),
        before: Lineage(u64::MAX),
        after: Lineage(u64::MAX),
        history: (0..8).map(|_| Step::of(Image::zero(WIDTH))).collect(),
        applied: None,
        excluded: StationSet::EMPTY,
        gone: StationSet::EMPTY,
        drives: true,
        writes: Default::default(),
        pulses: Default::default(),
        unforced: None,
        version: None,
    })
}

/// A controller holds its own program, the understudy all.
fn turn(own: StationId) -> Body {
    let mask: ProgramSet = if own.0 < PROGRAMS {
        ProgramSet::only(own.controlled())
    } else {
        ProgramSet::first(usize::from(PROGRAMS))
    };
    let holding = |program| Holding {
        program,
        born: moment(),
        lineage: Lineage(u64::MAX),
        stepped: moment(),
        digest: Digest(u64::MAX),
        version: None,
    };
    Body::Turn(Turn {
        heard: StationSet::first(usize::from(own.0)),
        holdings: mask.iter().map(holding).collect(),
        words: [Word { mask, sum: Image::zero(WIDTH) }].into_iter().collect(),
        recalled: Vec::new(),
        lacks: ProgramSet::EMPTY,
        relayed: Vec::new(),
    })
}

fn moment() -> Moment {
    Moment { epoch: Epoch(u64::MAX), cycle: Cycle(1_000_000) }
}

/// The frames of one cycle in the order in which they are sent, for the yardstick, which carries the same number of bytes.
pub(super) fn frames_of_a_cycle() -> Vec<Frame> {
    let station = |rank| Member::Station(StationId(rank));
    let samples = (0..PROGRAMS).map(|program| (Member::RemoteIo(ProgramId(program)), sample()));
    let turns = (0..STATIONS).map(|rank| (station(rank), turn(StationId(rank))));
    std::iter::once((CYCLE_MASTER, Body::Sync))
        .chain(samples)
        .chain(turns)
        .map(|(sender, body)| frame(sender, moment(), body))
        .collect()
}
