//! Memory of a remote I/O: it keeps nothing of a cycle, however long it runs and whatever fails, and what it allocates in a cycle does not grow.
//!
//! The test is a program of its own, since it counts the allocations of the whole process.

#[path = "remote_io/bench.rs"]
#[allow(dead_code, reason = "other tests use more of it")]
mod bench;

use std::alloc::System;
use std::sync::Arc;

use bench::{Bench, PERIOD, held_after, join, settings, turn};
use stats_alloc::{INSTRUMENTED_SYSTEM, StatsAlloc};
use understudy_cycle::{Input, Machine, Output, RemoteIoInput};
use understudy_remote_io::{
    Event, Fallback, Layout, OperatorInput, OperatorInputKind, PointPlace, Settings,
};
use understudy_typed::Elementary;
use understudy_wire::{
    Body, Force, Holding, Image, PointValue, Role, Sample, SignalPlace, Source, StateChoice, Time,
    Unforce, Write, WriteId,
};

#[global_allocator]
static ALLOCATOR: &StatsAlloc<System> = &INSTRUMENTED_SYSTEM;

/// Cycles of one round of faults.
const ROUND: u64 = 1_000;

/// Rounds; the buffers have their largest size after the first ones.
const ROUNDS: u64 = 100;
const FIRST_ROUNDS: u64 = 3;

/// A program with this number of inputs and outputs.
fn with(width: u16) -> Settings {
    let bits = usize::from(width);
    let operator_input = OperatorInput {
        place: PointPlace { bit: 1, of: Elementary::Bool },
        kind: OperatorInputKind::Level,
        initial: 0,
        role: Role::Operator,
        retains: false,
    };
    Settings {
        layout: Arc::new(Layout {
            operator_inputs: vec![operator_input],
            ..Layout::booleans(width, width)
        }),
        fallback: Fallback { fail_safe: Image::zero(bits), ..settings(1).fallback },
        ..settings(1)
    }
}

/// The remote I/O among its controller and its understudy.
struct Plant {
    bench: Bench,
    width: usize,
    /// What the stations hold.
    held: Option<Holding>,
    /// Allocations of the remote I/O so far.
    allocations: usize,
    /// Bytes before it was made, and the most since the last look with all that is on its way to it and from it.
    before: isize,
    peak: isize,
}

/// Bytes that are allocated now.
fn live() -> isize {
    let stats = ALLOCATOR.stats();
    stats.bytes_allocated as isize - stats.bytes_deallocated as isize
}

impl Plant {
    fn new(width: u16) -> Self {
        let before = live();
        let bench = Bench::new(with(width), 100);
        Self { bench, width: width.into(), held: None, allocations: 0, before, peak: 0 }
    }

    /// Gives it one thing, and looks at what it puts out.
    fn give(&mut self, now: Time, input: Input<'_>, look: &mut dyn FnMut(&Output<Event>)) {
        let before = ALLOCATOR.stats();
        self.bench.remote_io.handle_input(now, input);
        let mut next = || {
            let output = self.bench.remote_io.poll_output();
            self.peak = self.peak.max(live() - self.before);
            output
        };
        while let Some(output) = next() {
            look(&output);
        }
        let after = ALLOCATOR.stats();
        self.allocations += after.allocations - before.allocations;
        self.allocations += after.reallocations - before.reallocations;
    }

    /// One cycle of a round; answers with the source of the outputs.
    fn cycle(&mut self, at: u64, write: &Write) -> Option<Source> {
        self.bench.cycle += 1;
        let (mut source, mut sampled) = (None, None);
        let moment = self.bench.moment();
        let start = self.bench.start();
        let (field, force) = (Image::zero(self.width), force());
        let unforce = Unforce { signal: force.signal, points: None };
        let order = match at {
            300 => Some(RemoteIoInput::FieldLost),
            310 => Some(RemoteIoInput::Field(&field)),
            400 => Some(RemoteIoInput::Force(&force)),
            450 => Some(RemoteIoInput::Unforce(&unforce)),
            500 => Some(RemoteIoInput::Write(write)),
            620 | 730 => Some(RemoteIoInput::Release),
            740 => Some(RemoteIoInput::Choose(StateChoice::Cold)),
            _ => None,
        };
        if let Some(order) = order {
            self.give(start, Input::RemoteIo(order), &mut |_| {});
        }
        if !(200..220).contains(&at) {
            let sync = self.bench.frame(0, false, Body::Sync);
            self.give(start, Input::Frame(&sync), &mut |output| {
                sampled = own_sample(output).map(|sample| held_after(sample, moment)).or(sampled);
                source = applied(output).or(source);
            });
            self.held = sampled.or(self.held);
            for rank in 0..2 {
                // A failed controller.
                if rank > 0 || !(100..110).contains(&at) {
                    let frame = self.bench.frame(rank, false, self.of_station(rank, at));
                    self.give(start + PERIOD / 10, Input::Frame(&frame), &mut |output| {
                        source = applied(output).or(source);
                    });
                }
            }
        }
        self.give(start + PERIOD * 65 / 100, Input::Wakeup, &mut |output| {
            source = applied(output).or(source);
        });
        source
    }

    /// What a station sends.
    fn of_station(&self, rank: u8, at: u64) -> Body {
        let has_lost_its_states = (700..720).contains(&at);
        let Some(held) = self.held.filter(|_| !has_lost_its_states) else {
            return join(None, None);
        };
        let mut body = turn(held);
        if let Body::Turn(turn) = &mut body {
            for word in &mut turn.words {
                word.sum = Image::zero(self.width);
                // A value fault of the understudy.
                word.sum.set(0, rank == 1 && (600..602).contains(&at));
            }
        }
        body
    }
}

fn own_sample(output: &Output<Event>) -> Option<&Sample> {
    match output {
        Output::Send(frame) => match &frame.body {
            Body::Sample(sample) => Some(sample),
            _ => None,
        },
        _ => None,
    }
}

fn applied(output: &Output<Event>) -> Option<Source> {
    match output {
        Output::Report(Event::Applied { source, .. }) => Some(*source),
        _ => None,
    }
}

/// Input 0 is forced.
fn force() -> Force {
    let signal = SignalPlace::Input(0);
    let value = PointValue::Bit(true);
    Force {
        signal,
        value,
        seconds: 3600,
        owner: "anna".into(),
        reason: "a test".into(),
        points: None,
    }
}

/// Input 1 is written.
fn write(number: u32) -> Write {
    Write {
        id: WriteId { session: 1, number },
        input: 1,
        value: PointValue::Bit(number % 2 == 1),
        role: Role::Operator,
        owner: "anna".into(),
        reason: "a test".into(),
        points: None,
    }
}

/// 100,000 cycles with a failed controller, no station, a lost field, forces, writes, a value fault and lost states in each 1,000 of them: the remote I/O
/// holds as much at the end as after the first rounds, and its peak does not grow.
#[test]
fn nothing_of_a_cycle_is_kept() {
    for (width, most_bytes, most_allocations) in [(64, 8_000, 3), (4_096, 50_000, 20)] {
        let mut plant = Plant::new(width);
        let mut after_first = None;
        for round in 0..ROUNDS {
            let write = write(round as u32 + 1);
            let mut proved = 0;
            for at in 0..ROUND {
                let source = plant.cycle(at, &write);
                proved += u64::from(matches!(source, Some(Source::Direct | Source::Reconstructed)));
            }
            assert!(proved > 900, "{width}, round {round}: {proved} cycles with a proved output");
            let now = (live() - plant.before, std::mem::take(&mut plant.peak));
            if round + 1 == FIRST_ROUNDS {
                after_first = Some(now);
            }
            if let Some((live, peak)) = after_first {
                assert!(
                    now.0 <= live && now.1 <= peak,
                    "{width}, round {round}: {now:?}, {live} {peak}"
                );
            }
        }
        let before = plant.allocations;
        for _ in 0..100 {
            assert_eq!(plant.cycle(999, &write(1)), Some(Source::Direct));
        }
        let each = (plant.allocations - before) / 100;
        let (live, peak) = after_first.expect("there are more rounds");
        assert!(
            peak <= most_bytes && each <= most_allocations,
            "{width}: {live} bytes, peak {peak}, {each} allocations in a cycle"
        );
    }
}
