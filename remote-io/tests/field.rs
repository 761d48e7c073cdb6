//! What the plant shows and what a remote I/O makes of it: sensors that cannot be seen, and signals that the operator forces.

use std::sync::Arc;
use std::time::Duration;

use understudy_cycle::{Agreement, Input, Machine, Mode, Output, RemoteIoInput, Schedule};
use understudy_remote_io::{Event, Missing, Release, RemoteIo, Settings, StaleState, ValueFault};
use understudy_wire::{
    Body, ClusterHash, ConfigurationHash, Cycle, Epoch, Force, Frame, Header, Image, Join, Lineage,
    Member, Moment, ProgramHash, ProgramId, ProgramSet, SignalPlace, Source, StationId, Time,
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
            self.remote_io.handle_input(self.start(), Input::Frame(&frame));
        }
        let mut said: Vec<Output<Event>> = self.drain();
        let deadline = self.start() + agreement.schedule.deadline();
        self.remote_io.handle_input(deadline, Input::Wakeup);
        said.extend(self.drain());
        said
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
    assert!(started.is_some(), "it starts cold where nobody holds a state");
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
    let genesis = started.expect("it starts cold where nobody holds a state");
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
