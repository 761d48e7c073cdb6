//! A remote I/O whose sensors cannot be seen: nobody steps its program meanwhile, and what it drives is held, and then fail-safe.

use std::sync::Arc;
use std::time::Duration;

use understudy_remote_io::{Event, Missing, Release, RemoteIo, Settings, ValueFault};
use understudy_wire::{
    Agreement, Body, ClusterHash, ConfigurationHash, Cycle, Epoch, Frame, Header, Image, Input,
    Join, Lineage, Machine, Mode, Moment, Output, Party, ProgramHash, ProgramId, ProgramSet,
    Schedule, Source, StationId, Time,
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
        self.cycle += 1;
        let agreement = agreement();
        let header = Header {
            cluster: agreement.cluster,
            configuration: agreement.configuration,
            moment: Moment {
                epoch: Epoch(1),
                cycle: Cycle(u64::from(self.cycle)),
            },
            sender: Party::Station(StationId(0)),
            alone: false,
        };
        let join = Join {
            wants: ProgramSet::first(1),
            holdings: Default::default(),
        };
        for body in [Body::Sync, Body::Join(join)] {
            let frame = Arc::new(Frame { header, body });
            self.remote_io
                .handle_input(self.start(), Input::Frame(&frame));
        }
        let mut said: Vec<Output<Event>> = self.drain();
        let deadline = self.start() + agreement.schedule.deadline();
        self.remote_io.handle_input(deadline, Input::Wakeup);
        said.extend(self.drain());
        let sampled = said.iter().find_map(|output| match output {
            Output::Send(frame) => match &frame.body {
                Body::Sample(sample) => Some(sample.base),
                _ => None,
            },
            _ => None,
        });
        let applied = said.iter().rev().find_map(|output| match output {
            Output::Report(Event::Applied {
                source, missing, ..
            }) => Some((*source, *missing)),
            _ => None,
        });
        let (source, missing) = applied.expect("it drives at every deadline");
        (sampled, source, missing)
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

#[test]
fn without_sensors_nothing_is_sampled_and_the_program_stands_still() {
    let settings = Settings {
        program: ProgramId(0),
        agreement: agreement(),
        hash: ProgramHash(9),
        inputs: 2,
        channels: Vec::new(),
        hold_cycles: 2,
        fail_safe: Image::zero(1),
        release: Release::Automatic,
        value_fault: ValueFault::default(),
    };
    let mut bench = Bench {
        remote_io: RemoteIo::new(Time::default(), settings),
        cycle: 0,
    };
    let sensors = Image::from_bits([true, false]);
    bench.tell(Input::Field(&sensors));
    // It listens first whether somebody holds a state.
    let started = (0..60).find_map(|_| bench.cycle().0);
    let genesis = started.expect("it starts cold where nobody holds a state");
    bench.tell(Input::FieldLost);
    for _ in 0..5 {
        let (sampled, source, missing) = bench.cycle();
        assert_eq!(sampled, None);
        assert_eq!(source, Source::FailSafe, "nothing was true before");
        assert_eq!(missing, Some(Missing::BadQuality));
    }
    bench.tell(Input::Field(&sensors));
    let (sampled, _, missing) = bench.cycle();
    assert_eq!(sampled, Some(genesis), "the history goes on where it was");
    assert_ne!(missing, Some(Missing::BadQuality));
}
