//! The table of a remote I/O: each reachable named state, with each input, and the state that follows.
//!
//! The states are found from a remote I/O that has just started, breadth first. The drawing in
//! `docs/pictures/remote-io.dot` is made from the same table.

use std::sync::Arc;
use std::time::Duration;

use understudy_cycle::{
    Agreement, Fallback, Input, Layout, Machine, Mode, Output, Release, RemoteIoInput, Schedule,
    SharedOutputs, StaleState, ValueFault,
};
use understudy_testing::states::Table;
use understudy_wire::{
    Body, ClusterHash, ConfigurationHash, Cycle, Digest, Epoch, Frame, Header, Holding, Image,
    Join, Lineage, Member, Moment, ProgramHash, ProgramId, ProgramSet, Recalled, Sample,
    SamplesReceived, StateChoice, StationId, StationSet, Time, Turn, Word,
};

use super::RemoteIo;
use super::arbiter::{Arbiter, Authority, Question};
use super::knowledge::Knowledge;
use crate::settings::Settings;

const PERIOD: Duration = Duration::from_millis(10);
const PROGRAM: ProgramId = ProgramId(0);
/// Cycles of one input: more than any patience of the remote I/O.
const CYCLES: u64 = 16;

/// A remote I/O of a program with one input and one output, a controller and an understudy.
pub(super) fn settings() -> Settings {
    let agreement = Agreement {
        cluster: ClusterHash(1),
        configuration: ConfigurationHash(2),
        schedule: Schedule::new(PERIOD, 1, 1, 1).expect("within the bounds"),
        mode: Mode::Full,
        history: 4,
        flag_after: 3,
        shadow_cycles: 1,
        listen_cycles: 2,
    };
    Settings {
        program: PROGRAM,
        agreement: Arc::new(agreement),
        hash: ProgramHash(1),
        layout: Arc::new(Layout::booleans(1, 1)),
        diagnosis: None,
        fallback: Fallback {
            hold_cycles: 2,
            trial_cycles: 0,
            fail_safe: Image::zero(1),
            ramps: Vec::new(),
            release: Release::Operator,
            value_fault: ValueFault::FailSafe,
            stale_state: StaleState::Operator,
            restart: None,
        },
        pair: None,
        paired_inputs: Vec::new(),
        shared_outputs: SharedOutputs::default(),
    }
}

/// What happens to a remote I/O whose program has a controller and an understudy.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Happening {
    /// No station is received.
    NoStation,
    /// Both stations are received, and hold no state.
    NoState,
    /// Both prove the output of this history; after a restart both hold the state of the newest applied sample.
    OnHistory,
    /// Both hold an older state.
    OlderState,
    /// They hold different states of one cycle.
    DifferentStates,
    /// They prove different outputs of this history.
    ValueFault,
    /// The operator releases.
    Release,
    /// The operator chooses a cold start.
    ChooseCold,
    /// The operator chooses the newest state.
    ChooseNewest,
}

use Happening::*;

const ALL: [(Happening, &str); 9] = [
    (NoStation, "no station is received"),
    (NoState, "stations hold no state"),
    (OnHistory, "stations are on the history"),
    (OlderState, "stations hold an older state"),
    (DifferentStates, "stations hold different states"),
    (ValueFault, "stations prove different outputs"),
    (Release, "operator: release"),
    (ChooseCold, "operator: choose cold"),
    (ChooseNewest, "operator: choose newest"),
];

fn moment(cycle: u64) -> Moment {
    Moment { epoch: Epoch(1), cycle: Cycle(cycle) }
}

#[derive(Debug, Clone)]
struct Bench {
    remote_io: RemoteIo,
    cycle: u64,
}

impl Bench {
    fn new() -> Self {
        Self { remote_io: RemoteIo::new(Time(0), settings()), cycle: 100 }
    }

    fn happens(&mut self, happening: Happening) {
        let operator = |choice| Input::RemoteIo(RemoteIoInput::Choose(choice));
        match happening {
            Release => self.give(Input::RemoteIo(RemoteIoInput::Release)),
            ChooseCold => self.give(operator(StateChoice::Cold)),
            ChooseNewest => self.give(operator(StateChoice::Newest { cycle: None })),
            _ => (0..CYCLES).for_each(|_| self.pass(happening)),
        }
        self.sample();
    }

    fn now(&self) -> Time {
        Time(0) + PERIOD * self.cycle as u32
    }

    fn give(&mut self, input: Input<'_>) {
        let now = self.now() + PERIOD * 9 / 10;
        self.remote_io.handle_input(now, input);
    }

    /// One cycle.
    fn pass(&mut self, happening: Happening) {
        self.cycle += 1;
        let deadline = self.now() + PERIOD * 65 / 100;
        if happening != NoStation {
            self.receive(0, Body::Sync);
            let sample = self.sample();
            for rank in [0, 1] {
                let body = self.body(happening, rank, sample.as_ref());
                self.receive(rank, body);
            }
        }
        self.remote_io.handle_input(deadline, Input::Wakeup);
    }

    fn receive(&mut self, rank: u8, body: Body) {
        let frame = Frame {
            header: Header {
                cluster: ClusterHash(1),
                configuration: ConfigurationHash(2),
                prepared: None,
                moment: moment(self.cycle),
                sender: Member::Station(StationId(rank)),
                alone: false,
            },
            body,
        };
        let now = self.now();
        self.remote_io.handle_input(now, Input::Frame(&Arc::new(frame)));
    }

    /// The sample that was sent; takes all other outputs away.
    fn sample(&mut self) -> Option<Sample> {
        let outputs = std::iter::from_fn(|| self.remote_io.poll_output());
        outputs
            .filter_map(|output| match output {
                Output::Send(frame) => match &frame.body {
                    Body::Sample(sample) => Some(sample.clone()),
                    _ => None,
                },
                _ => None,
            })
            .last()
    }

    fn body(&self, happening: Happening, rank: u8, sample: Option<&Sample>) -> Body {
        let holding = |lineage: Lineage, stepped: Moment| Holding {
            program: PROGRAM,
            born: moment(1),
            lineage,
            stepped,
            digest: Digest(0),
            version: None,
        };
        let held = match (happening, sample) {
            (OnHistory | ValueFault, Some(sample)) => {
                let here = holding(sample.after, moment(self.cycle));
                let output = happening == ValueFault && rank == 1;
                return turn(here, output);
            }
            (OnHistory, None) => Some(holding(Lineage(7), moment(50))),
            (OlderState, _) => Some(holding(Lineage(6), moment(30))),
            (DifferentStates, _) => Some(holding(Lineage(8 + u64::from(rank)), moment(50))),
            _ => None,
        };
        let recalled = Recalled {
            program: PROGRAM,
            sampled: moment(50),
            received: SamplesReceived::Later,
            applied: Some(moment(50)),
            excluded: StationSet::EMPTY,
            accounted_for: StationSet::EMPTY,
            writes: Default::default(),
            pulses: Default::default(),
            inputs: Image::zero(1),
            version: None,
        };
        Body::Join(Join {
            wants: ProgramSet::EMPTY,
            holdings: held.into_iter().collect(),
            retained: Default::default(),
            recalled: vec![recalled],
            lacks: ProgramSet::EMPTY,
            partial: Vec::new(),
        })
    }

    /// The name of its state.
    fn state(&self) -> String {
        let Arbiter { knowledge, question, authority, .. } = &self.remote_io.arbiter;
        let mut name = match knowledge {
            Knowledge::Listening { .. } => "Listening",
            Knowledge::ColdStarted { .. } => "ColdStarted",
            Knowledge::Known { .. } => "Known",
        }
        .to_owned();
        if *authority == Authority::Operator {
            name.push_str(", awaits release");
        }
        match question {
            Some(Question::Disputed) => name.push_str(", states disputed"),
            Some(Question::StateLost { .. }) => name.push_str(", state lost"),
            Some(Question::ConfigurationDisputed) => name.push_str(", configuration disputed"),
            None => {}
        }
        name
    }
}

fn turn(holding: Holding, output: bool) -> Body {
    Body::Turn(Turn {
        heard: StationSet::EMPTY,
        holdings: [holding].into_iter().collect(),
        words: [Word { mask: ProgramSet::only(PROGRAM), sum: Image::from_bits([output]) }]
            .into_iter()
            .collect(),
        recalled: Vec::new(),
        lacks: ProgramSet::EMPTY,
        relayed: Vec::new(),
    })
}

fn table() -> Table {
    Table::explore(Bench::new(), &ALL, Bench::happens, Bench::state)
}

#[test]
fn each_state_answers_each_input() {
    insta::assert_snapshot!(table().text());
}

#[test]
fn the_drawing_is_the_table() {
    let drawing = table().drawing("remote I/O", "remote-io/src/remote_io/states.rs");
    let drawn = include_str!("../../../docs/pictures/remote-io.dot");
    assert!(drawing == drawn, "docs/pictures/remote-io.dot should be\n{drawing}");
}
