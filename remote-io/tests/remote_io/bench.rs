//! One remote I/O of a cluster of one program, in the time and with the frames of a test.

use std::sync::Arc;
use std::time::Duration;

use understudy_cycle::{Agreement, Input, Machine, Mode, Output, RemoteIoInput, Schedule};
use understudy_remote_io::{
    Event, Fallback, Layout, Release, RemoteIo, Settings, SharedOutputs, StaleState, ValueFault,
};
use understudy_wire::{
    Body, ClusterHash, ConfigurationHash, Cycle, Digest, Epoch, Frame, Header, Holding, Image,
    Join, Member, Moment, ProgramHash, ProgramId, ProgramSet, Recalled, Sample, SamplesReceived,
    StationId, StationSet, Time, Turn, Word,
};

pub(crate) const PERIOD: Duration = Duration::from_millis(10);
pub(crate) const PROGRAM: ProgramId = ProgramId(0);
pub(crate) const HISTORY: usize = 3;
pub(crate) const FLAG_AFTER: u32 = 3;

/// What a remote I/O has put out.
pub(crate) type Said = Vec<Output<Event>>;

/// The settings of a program with two BOOL inputs and one BOOL output, a controller and so many understudies.
pub(crate) fn settings(understudies: usize) -> Settings {
    let agreement = Agreement {
        cluster: ClusterHash(1),
        configuration: ConfigurationHash(2),
        schedule: Schedule::new(PERIOD, 1, understudies, 1).expect("within the bounds"),
        mode: Mode::Full,
        history: HISTORY,
        flag_after: FLAG_AFTER,
        shadow_cycles: 1,
        listen_cycles: 2,
    };
    Settings {
        program: PROGRAM,
        agreement: Arc::new(agreement),
        hash: ProgramHash(1),
        layout: Arc::new(Layout::booleans(2, 1)),
        diagnosis: None,
        fallback: Fallback {
            hold_cycles: 3,
            trial_cycles: 0,
            fail_safe: Image::zero(1),
            ramps: Vec::new(),
            release: Release::Automatic,
            value_fault: ValueFault::Hold,
            stale_state: StaleState::Operator,
            restart: None,
        },
        pair: None,
        paired_inputs: Vec::new(),
        shared_outputs: SharedOutputs::default(),
    }
}

/// The same, with who releases the outputs after a cold start.
pub(crate) fn releasing(mut settings: Settings, release: Release) -> Settings {
    settings.fallback.release = release;
    settings
}

/// A remote I/O and the cycle that it is in.
#[derive(Clone)]
pub(crate) struct Bench {
    pub(crate) remote_io: RemoteIo,
    pub(crate) epoch: u64,
    pub(crate) cycle: u64,
}

impl Bench {
    /// Its remote I/O starts in the cycle before `cycle`.
    pub(crate) fn new(settings: Settings, cycle: u64) -> Self {
        let mut bench = Self {
            remote_io: RemoteIo::new(Time(0), settings.clone()),
            epoch: 1,
            cycle: cycle.saturating_sub(1),
        };
        bench.remote_io = RemoteIo::new(bench.start(), settings);
        bench
    }

    pub(crate) fn moment(&self) -> Moment {
        Moment { epoch: Epoch(self.epoch), cycle: Cycle(self.cycle) }
    }

    /// When the cycle began.
    pub(crate) fn start(&self) -> Time {
        Time(0) + PERIOD * self.cycle as u32
    }

    /// Gives it something at `now`.
    pub(crate) fn give(&mut self, now: Time, input: Input<'_>) -> Said {
        self.remote_io.handle_input(now, input);
        std::iter::from_fn(|| self.remote_io.poll_output()).collect()
    }

    /// A frame of the station `rank` in this cycle, which arrives at `now`.
    pub(crate) fn receive(&mut self, now: Time, rank: u8, alone: bool, body: Body) -> Said {
        self.give(now, Input::Frame(&self.frame(rank, alone, body)))
    }

    /// A frame of the station `rank` in this cycle.
    pub(crate) fn frame(&self, rank: u8, alone: bool, body: Body) -> Arc<Frame> {
        let header = Header {
            cluster: ClusterHash(1),
            configuration: ConfigurationHash(2),
            prepared: None,
            moment: self.moment(),
            sender: Member::Station(StationId(rank)),
            alone,
        };
        Arc::new(Frame { header, body })
    }

    /// The deadline of this cycle.
    pub(crate) fn decide(&mut self) -> Said {
        self.give(self.start() + PERIOD * 65 / 100, Input::Wakeup)
    }

    /// An order, or what the field shows, after the deadline of this cycle.
    pub(crate) fn tell(&mut self, input: RemoteIoInput<'_>) -> Said {
        self.give(self.start() + PERIOD * 9 / 10, Input::RemoteIo(input))
    }
}

/// A station that asks to join, with what it holds and recalls.
pub(crate) fn join(holding: Option<Holding>, recalled: Option<Recalled>) -> Body {
    Body::Join(Join {
        wants: ProgramSet::EMPTY,
        holdings: holding.into_iter().collect(),
        retained: Default::default(),
        recalled: recalled.into_iter().collect(),
        lacks: ProgramSet::EMPTY,
        partial: Vec::new(),
    })
}

/// A station that publishes FALSE from the state that it holds.
pub(crate) fn turn(holding: Holding) -> Body {
    turn_with(holding, [false])
}

/// The same with these outputs.
pub(crate) fn turn_with(holding: Holding, outputs: [bool; 1]) -> Body {
    Body::Turn(Turn {
        heard: StationSet::EMPTY,
        holdings: [holding].into_iter().collect(),
        words: [Word { mask: ProgramSet::only(PROGRAM), sum: Image::from_bits(outputs) }]
            .into_iter()
            .collect(),
        recalled: Vec::new(),
        lacks: ProgramSet::EMPTY,
        relayed: Vec::new(),
    })
}

/// What a station recalls of a sample.
pub(crate) fn recalled_of(sample: &Sample, sampled: Moment) -> Recalled {
    Recalled {
        program: PROGRAM,
        sampled,
        received: SamplesReceived::Later,
        applied: sample.applied,
        excluded: sample.excluded,
        accounted_for: sample.gone,
        writes: sample.writes.clone(),
        pulses: sample.pulses.clone(),
        inputs: sample.without_forces().expect("it has the inputs of its cycle").clone(),
        version: None,
    }
}

/// The state that a station holds which has followed a sample.
pub(crate) fn held_after(sample: &Sample, stepped: Moment) -> Holding {
    Holding {
        program: PROGRAM,
        born: sample.born,
        lineage: sample.after,
        stepped,
        digest: Digest(0),
        version: None,
    }
}

/// The sample among what was put out.
pub(crate) fn sample_of(said: &Said) -> Option<&Sample> {
    said.iter().find_map(|output| match output {
        Output::Send(frame) => match &frame.body {
            Body::Sample(sample) => Some(sample),
            _ => None,
        },
        _ => None,
    })
}
