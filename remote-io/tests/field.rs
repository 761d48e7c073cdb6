//! What the plant shows and what a remote I/O makes of it: sensors that cannot be seen, and signals that the operator forces.

use std::sync::Arc;
use std::time::Duration;

use understudy_cycle::{Agreement, Input, Machine, Mode, Output, RemoteIoInput, Schedule};
use understudy_remote_io::{
    Event, Missing, OperatorInput, OperatorInputKind, PointPlace, Release, RemoteIo, Settings,
    StaleState, ValueFault,
};
use understudy_typed::Elementary;
use understudy_wire::{
    Body, ClusterHash, ConfigurationHash, Cycle, Epoch, Force, Frame, Header, Image, Join, Lineage,
    Member, Moment, OrderRefusal, PointValue, ProgramHash, ProgramId, ProgramSet, Role,
    SignalPlace, Source, StateChoice, StationId, Time, Write, WriteAnswer, WriteId, WriteOutcome,
    WriteRefusal,
};

const PERIOD: Duration = Duration::from_millis(10);

fn agreement() -> Arc<Agreement> {
    Arc::new(Agreement {
        cluster: ClusterHash(7),
        configuration: ConfigurationHash(8),
        schedule: Schedule::new(PERIOD, 1, 1, 1).expect("within the bounds"),
        mode: Mode::Full,
        history: 4,
        flag_after: 3,
        shadow_cycles: 1,
        listen_cycles: 10,
    })
}

/// A remote I/O and the cycle that it is in.
struct Bench {
    remote_io: RemoteIo,
    cycle: u32,
}

impl Bench {
    fn start(&self) -> Time {
        Time::default() + PERIOD * self.cycle
    }

    /// One cycle from its Sync to its deadline: the base of what was sampled, what was driven, and why it was not true.
    fn cycle(&mut self) -> (Option<Lineage>, Source, Option<Missing>) {
        let said = self.said();
        let sampled = said.iter().find_map(|output| match output {
            Output::Send(frame) => match &frame.body {
                Body::Sample(sample) => Some(sample.base),
                _ => None,
            },
            _ => None,
        });
        let applied = said.iter().rev().find_map(|output| match output {
            Output::Report(Event::Applied { source, missing, .. }) => Some((*source, *missing)),
            _ => None,
        });
        let (source, missing) = applied.expect("it drives at every deadline");
        (sampled, source, missing)
    }

    /// All that it says in one cycle.
    fn said(&mut self) -> Vec<Output<Event>> {
        self.cycle += 1;
        self.sync(self.start());
        let mut said: Vec<Output<Event>> = self.drain();
        let deadline = self.start() + agreement().schedule.deadline();
        self.remote_io.handle_input(deadline, Input::Wakeup);
        said.extend(self.drain());
        said
    }

    /// The frames of a station in this cycle, which arrive at `now`.
    fn sync(&mut self, now: Time) {
        let agreement = agreement();
        let header = Header {
            cluster: agreement.cluster,
            configuration: agreement.configuration,
            moment: Moment { epoch: Epoch(1), cycle: Cycle(u64::from(self.cycle)) },
            sender: Member::Station(StationId(0)),
            alone: false,
        };
        let join = Join {
            wants: ProgramSet::first(1),
            holdings: Default::default(),
            recalled: Vec::new(),
            lacks: ProgramSet::EMPTY,
            partial: Vec::new(),
        };
        for body in [Body::Sync, Body::Join(join)] {
            let frame = Arc::new(Frame { header, body });
            self.remote_io.handle_input(now, Input::Frame(&frame));
        }
    }

    fn drain(&mut self) -> Vec<Output<Event>> {
        std::iter::from_fn(|| self.remote_io.poll_output()).collect()
    }

    /// Something after the deadline of a cycle.
    fn tell(&mut self, input: Input<'_>) {
        let now = self.start() + PERIOD * 9 / 10;
        self.remote_io.handle_input(now, input);
    }
}

fn settings() -> Settings {
    Settings {
        program: ProgramId(0),
        agreement: agreement(),
        hash: ProgramHash(9),
        undriven: Image::zero(2),
        input_points: PointPlace::booleans(2),
        output_points: PointPlace::booleans(1),
        operator_inputs: Vec::new(),
        signals: Vec::new(),
        signal_sources: Vec::new(),
        channels: Vec::new(),
        stop: None,
        diagnosis: None,
        hold_cycles: 2,
        fail_safe: Image::zero(1),
        ramps: Vec::new(),
        release: Release::Automatic,
        value_fault: ValueFault::default(),
        stale_state: StaleState::Operator,
    }
}

#[test]
fn a_forced_signal_is_sampled_and_driven_so_until_its_time_is_over() {
    let mut bench = Bench { remote_io: RemoteIo::new(Time::default(), settings()), cycle: 0 };
    bench.tell(Input::RemoteIo(RemoteIoInput::Field(&Image::from_bits([true, false]))));
    let started = (0..60).find_map(|_| bench.cycle().0);
    assert!(started.is_some(), "it starts cold where no station holds a state");
    let force = |signal, value: bool, seconds| Force {
        signal,
        value: value.into(),
        seconds,
        owner: "anna".to_owned(),
        reason: "a test".to_owned(),
    };
    let (input, output) = (SignalPlace::Input(1), SignalPlace::Output(0));
    bench.tell(Input::RemoteIo(RemoteIoInput::Force(&force(input, true, 1))));
    bench.tell(Input::RemoteIo(RemoteIoInput::Force(&force(output, true, 1))));
    // None of these is a force.
    bench.tell(Input::RemoteIo(RemoteIoInput::Force(&force(SignalPlace::Input(2), true, 1))));
    bench.tell(Input::RemoteIo(RemoteIoInput::Force(&force(SignalPlace::Output(1), true, 1))));
    bench.tell(Input::RemoteIo(RemoteIoInput::Force(&force(SignalPlace::Input(0), false, 0))));
    let said = bench.drain();
    assert_eq!(forced_and_ended(&said), (2, 0), "{said:?}");
    let frames = |bench: &mut Bench| {
        let said = bench.said();
        let sampled = said.iter().find_map(|output| match output {
            Output::Report(Event::Sampled { inputs, .. }) => Some(inputs.clone()),
            _ => None,
        });
        let driven = said.iter().find_map(|output| match output {
            Output::Drive(outputs) => Some(outputs.clone()),
            _ => None,
        });
        let applied = said.iter().find_map(|output| match output {
            Output::Report(Event::Applied { outputs, .. }) => Some(outputs.clone()),
            _ => None,
        });
        let ended = forced_and_ended(&said).1;
        (sampled, driven, applied, ended)
    };
    let image = |bits: &[bool]| Some(Image::from_bits(bits.iter().copied()));
    let (fail_safe, forced) = (image(&[false]), image(&[true]));
    let both = (image(&[true, true]), forced.clone(), fail_safe.clone(), 0);
    assert_eq!(frames(&mut bench), both);
    bench.tell(Input::RemoteIo(RemoteIoInput::Unforce(output)));
    bench.tell(Input::RemoteIo(RemoteIoInput::Unforce(output)));
    assert_eq!(forced_and_ended(&bench.drain()), (0, 1), "taken back once");
    let one = (image(&[true, true]), fail_safe.clone(), fail_safe.clone(), 0);
    assert_eq!(frames(&mut bench), one);
    // A second later.
    bench.cycle += 100;
    let none = (image(&[true, false]), fail_safe.clone(), fail_safe, 1);
    assert_eq!(frames(&mut bench), none);
}

/// The outcomes of orders.
fn obeyed(said: &[Output<Event>]) -> Vec<Result<(), OrderRefusal>> {
    let obeyed = said.iter().filter_map(|output| match output {
        Output::Obeyed(obeyed) => Some(*obeyed),
        _ => None,
    });
    obeyed.collect()
}

/// Signals of 1, 16 and 32 bits: every place and every width, as whole signals are, and nothing else.
#[test]
fn a_force_is_of_a_whole_signal_and_of_a_value_that_it_can_have() {
    let points = [
        (0, Elementary::Bool),
        (16, Elementary::Int),
        (32, Elementary::Real),
        (64, Elementary::Lreal),
    ];
    let points: Vec<_> = points.into_iter().map(|(bit, of)| PointPlace { bit, of }).collect();
    let settings = Settings {
        undriven: Image::zero(128),
        input_points: points.clone(),
        output_points: points.clone(),
        fail_safe: Image::zero(128),
        ..settings()
    };
    let mut bench = Bench { remote_io: RemoteIo::new(Time::default(), settings), cycle: 0 };
    let values = [0, 1, 0x7f80_0000, 0x7fc0_0000, 0x4148_0000, 0x7ff8_0000_0000_0000, u64::MAX];
    let mut taken = 0;
    for bit in 0..130 {
        for signal in [SignalPlace::Input(bit), SignalPlace::Output(bit)] {
            for (width, stored) in
                [1, 8, 16, 32, 64].into_iter().flat_map(|width| values.map(|value| (width, value)))
            {
                let value = PointValue::new(width, stored);
                let (owner, reason) = ("anna".to_owned(), "a test".to_owned());
                let force = Force { signal, value, seconds: 1, owner, reason };
                let is_number = match width {
                    32 => f32::from_bits(stored as u32).is_finite(),
                    64 => f64::from_bits(stored).is_finite(),
                    _ => true,
                };
                let point = points.iter().find(|point| point.bit == bit);
                let is_whole = point.is_some_and(|point| point.of.bits() == width);
                let expected = force.check().is_ok() && is_whole && is_number;
                bench.tell(Input::RemoteIo(RemoteIoInput::Force(&force)));
                let said = bench.drain();
                let outcomes = obeyed(&said);
                assert_eq!(
                    (outcomes.len(), outcomes[0].is_ok()),
                    (1, expected),
                    "{force:?}: {outcomes:?}"
                );
                let is_recorded = said.iter().any(|output| match output {
                    Output::Report(Event::Forced { .. }) => expected,
                    Output::Report(Event::ForceRefused { .. }) => !expected,
                    _ => false,
                });
                assert!(is_recorded, "{force:?}: {said:?}");
                taken += usize::from(expected);
            }
        }
    }
    assert!(taken > 30, "{taken}");
}

/// No station publishes: a value would be in effect when one does, long after its caller has given up.
#[test]
fn a_write_is_refused_while_no_station_computes_the_program() {
    let level = OperatorInput {
        place: PointPlace { bit: 1, of: Elementary::Bool },
        kind: OperatorInputKind::Level,
        initial: 0,
        role: Role::Operator,
    };
    let settings = Settings { operator_inputs: vec![level], ..settings() };
    let mut bench = Bench { remote_io: RemoteIo::new(Time::default(), settings), cycle: 0 };
    let started = (0..60).find_map(|_| bench.cycle().0);
    assert!(started.is_some(), "it starts cold where no station holds a state");
    assert_eq!(bench.cycle().1, Source::FailSafe);
    let write = Write {
        id: WriteId { session: 1, number: 1 },
        input: 1,
        value: true.into(),
        role: Role::Operator,
        owner: "anna".to_owned(),
        reason: "a test".to_owned(),
    };
    bench.tell(Input::RemoteIo(RemoteIoInput::Write(&write)));
    let said = bench.drain();
    let refused = WriteOutcome::Refused { refusal: WriteRefusal::NotRunning };
    assert!(
        matches!(&said[..], [
            Output::Report(Event::WriteRefused { .. }),
            Output::Answer(WriteAnswer { outcome, .. }),
        ] if *outcome == refused),
        "{said:?}"
    );
}

#[test]
fn an_order_that_changes_nothing_is_refused() {
    let mut bench = Bench { remote_io: RemoteIo::new(Time::default(), settings()), cycle: 0 };
    let output = SignalPlace::Output(0);
    let no_choice = Err(OrderRefusal::NoChoice);
    for (input, expected) in [
        (RemoteIoInput::Unforce(output), Err(OrderRefusal::NotForced)),
        (RemoteIoInput::Choose(StateChoice::Cold), no_choice),
        (RemoteIoInput::Choose(StateChoice::Newest { cycle: Some(Cycle(5)) }), no_choice),
        (RemoteIoInput::Release, Ok(())),
    ] {
        bench.tell(Input::RemoteIo(input));
        assert_eq!(obeyed(&bench.drain()), [expected], "{input:?}");
    }
}

/// The host suspends the remote I/O in each part of a cycle, for each number of cycles; the frames of these cycles wait in its buffer.
#[test]
fn a_deadline_that_was_slept_through_is_neither_driven_nor_recorded() {
    for (asleep, at_once) in (0..40).flat_map(|asleep| [false, true].map(|once| (asleep, once))) {
        let mut bench = Bench { remote_io: RemoteIo::new(Time::default(), settings()), cycle: 0 };
        for _ in 0..60 {
            bench.said();
        }
        let first = bench.cycle + 1;
        let now = Time::default() + PERIOD * (first + asleep) + PERIOD / 3;
        let mut said = Vec::new();
        for cycle in first..=first + asleep {
            // In the first of them the sync may have come before the host suspended it.
            let at = if cycle == first && at_once { Time::default() + PERIOD * first } else { now };
            bench.cycle = cycle;
            bench.sync(at);
            said.extend(bench.drain());
        }
        let late = bench.remote_io.wakeup().max(now);
        bench.remote_io.handle_input(late, Input::Wakeup);
        said.extend(bench.drain());
        let driven = said.iter().filter(|it| matches!(it, Output::Drive(_))).count();
        let applied: Vec<u64> = said
            .iter()
            .filter_map(|output| match output {
                Output::Report(Event::Applied { moment, .. }) => Some(moment.cycle.0),
                _ => None,
            })
            .collect();
        // The cycle in which it was suspended, late, and the present one.
        let (first, last) = (u64::from(first), u64::from(first + asleep));
        let mut expected = vec![last];
        if at_once && asleep > 0 {
            expected.insert(0, first);
        }
        assert_eq!(applied, expected, "{asleep} cycles, {at_once}");
        assert_eq!(driven, expected.len());
    }
}

/// How many forces began and ended.
fn forced_and_ended(said: &[Output<Event>]) -> (usize, usize) {
    let count = |test: &dyn Fn(&Event) -> bool| {
        let reports = said.iter().filter(|output| match output {
            Output::Report(event) => test(event),
            _ => false,
        });
        reports.count()
    };
    (
        count(&|event| matches!(event, Event::Forced { .. })),
        count(&|event| matches!(event, Event::Unforced { .. })),
    )
}

#[test]
fn without_sensors_nothing_is_sampled_and_the_program_stands_still() {
    let mut bench = Bench { remote_io: RemoteIo::new(Time::default(), settings()), cycle: 0 };
    let sensors = Image::from_bits([true, false]);
    bench.tell(Input::RemoteIo(RemoteIoInput::Field(&sensors)));
    // It listens first whether somebody holds a state.
    let started = (0..60).find_map(|_| bench.cycle().0);
    let genesis = started.expect("it starts cold where no station holds a state");
    bench.tell(Input::RemoteIo(RemoteIoInput::FieldLost));
    for _ in 0..5 {
        let (sampled, source, missing) = bench.cycle();
        assert_eq!(sampled, None);
        assert_eq!(source, Source::FailSafe, "nothing was true before");
        assert_eq!(missing, Some(Missing::BadQuality));
    }
    bench.tell(Input::RemoteIo(RemoteIoInput::Field(&sensors)));
    let (sampled, _, missing) = bench.cycle();
    assert_eq!(sampled, Some(genesis), "the history goes on where it was");
    assert_ne!(missing, Some(Missing::BadQuality));
}
