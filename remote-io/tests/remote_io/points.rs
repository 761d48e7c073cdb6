//! Points that change with the program: what the device shows, what is held and what is forced, from the cycle of the change on.

use std::sync::Arc;

use understudy_cycle::{
    ChangeOrder, Conversion, FallbackChange, Input, Layout, Moved, OnlineChange, Output,
    PointPlace, PointsChange, Program, ProgramChange, RemoteIoInput,
};
use understudy_logic::CircuitBuilder;
use understudy_remote_io::{Event, Fallback, RemoteIo};
use understudy_typed::Elementary;
use understudy_wire::{
    Body, ConfigurationHash, Cycle, Force, Frame, Header, Holding, Image, Moment, ProgramHash,
    ProgramSet, Sample, SignalPlace, Source, Turn, Word,
};

use crate::bench::{
    Bench, PERIOD, PROGRAM, Said, held_after, join, recalled_of, sample_of, settings,
};

const AFTER: ConfigurationHash = ConfigurationHash(3);
const OLD: ProgramHash = ProgramHash(1);
const NEW: ProgramHash = ProgramHash(5);

#[derive(Debug)]
struct Same;

impl Conversion for Same {
    fn convert(&self, state: &[u64]) -> Vec<u64> {
        state.to_vec()
    }

    fn release(&self, _state: &mut [u64], _inputs: &[u64]) {}
}

fn program(hash: ProgramHash, inputs: &[&str], outputs: &[&str]) -> Program {
    let mut builder = CircuitBuilder::new("program");
    let nodes: Vec<_> = inputs.iter().map(|name| builder.input(*name)).collect();
    outputs.iter().for_each(|name| builder.output(*name, nodes[0]));
    Program { hash, executable: (&builder.finish().expect("a circuit")).into() }
}

fn moved(before: u16, after: u16) -> Moved {
    let place = |bit| PointPlace { bit, of: Elementary::Bool };
    Moved { before: place(before), after: place(after) }
}

/// `one`, `two` and the output `y` become `two`, `more`, `one` and the outputs `z`, `y`; the new fail-safe values are TRUE.
fn change() -> Arc<OnlineChange> {
    let before = settings(1);
    let after = Fallback { fail_safe: Image::from_bits([true; 2]), ..before.fallback.clone() };
    Arc::new(OnlineChange {
        before: ConfigurationHash(2),
        after: AFTER,
        programs: vec![ProgramChange {
            program: PROGRAM,
            before: program(OLD, &["one", "two"], &["y"]),
            after: program(NEW, &["two", "more", "one"], &["z", "y"]),
            forward: Arc::new(Same),
            back: Arc::new(Same),
            points: Some(Arc::new(PointsChange {
                before: before.layout,
                after: Arc::new(Layout::booleans(3, 2)),
                inputs: vec![moved(0, 2), moved(1, 0)],
                outputs: vec![moved(0, 1)],
            })),
        }],
        fallbacks: vec![FallbackChange { program: PROGRAM, before: before.fallback, after }],
    })
}

/// A remote I/O and the controller that follows it.
struct Plant {
    bench: Bench,
    /// The newest sample, and its cycle.
    sample: Option<(Sample, Moment)>,
}

/// What was seen in one cycle.
#[derive(Debug, Default)]
struct Seen {
    inputs: Vec<bool>,
    version: Option<ProgramHash>,
    events: Vec<Event>,
    laid_out: Vec<ProgramHash>,
    applied: Option<(Source, Vec<bool>)>,
}

impl Seen {
    fn note(&mut self, said: Said) {
        for output in said {
            match output {
                Output::LayOut(version) => self.laid_out.push(version),
                Output::Report(event) => {
                    if let Event::Applied { outputs, source, .. } = &event {
                        self.applied = Some((*source, outputs.bits().collect()));
                    }
                    self.events.push(event);
                }
                _ => {}
            }
        }
    }
}

impl Plant {
    fn new() -> Self {
        Self { bench: Bench::new(settings(1), 100), sample: None }
    }

    fn holding(&self) -> Option<Holding> {
        let (sample, moment) = self.sample.as_ref()?;
        Some(Holding { version: sample.version, ..held_after(sample, *moment) })
    }

    fn receive(&mut self, body: Body, prepared: Option<ConfigurationHash>) -> Said {
        let frame = self.bench.frame(0, false, body);
        let Frame { header, body } = Arc::unwrap_or_clone(frame);
        let frame = Arc::new(Frame { header: Header { prepared, ..header }, body });
        self.bench.give(self.bench.start(), Input::Frame(&frame))
    }

    /// A cycle, in which the controller publishes these outputs where it is given any, and has loaded the change where it runs.
    fn cycle(&mut self, outputs: Option<&[bool]>, prepared: Option<ConfigurationHash>) -> Seen {
        self.bench.cycle += 1;
        let mut seen = Seen::default();
        let recalled = self.sample.as_ref().map(|(sample, moment)| understudy_wire::Recalled {
            version: sample.version,
            ..recalled_of(sample, *moment)
        });
        let said = self.receive(join(self.holding(), recalled), prepared);
        if let Some(sample) = sample_of(&said) {
            seen.inputs = sample.history.last().expect("a step").inputs.bits().collect();
            seen.version = sample.version;
            self.sample = Some((sample.clone(), self.bench.moment()));
        }
        seen.note(said);
        if let (Some(outputs), Some(holding)) = (outputs, self.holding()) {
            let sum = Image::from_bits(outputs.iter().copied());
            let turn = Turn {
                heard: Default::default(),
                holdings: [holding].into_iter().collect(),
                words: [Word { mask: ProgramSet::only(PROGRAM), sum }].into_iter().collect(),
                recalled: Vec::new(),
                lacks: ProgramSet::EMPTY,
                relayed: Vec::new(),
            };
            let said = self.receive(Body::Turn(turn), prepared);
            seen.note(said);
        }
        let said = self.bench.decide();
        seen.note(said);
        seen
    }

    fn order(&mut self, order: &ChangeOrder) {
        let now = self.bench.start() + PERIOD * 9 / 10;
        let said = self.bench.give(now, Input::Change(order));
        let taken = said.iter().any(|output| matches!(output, Output::Obeyed(Ok(()))));
        assert!(taken, "{order:?}: {said:?}");
    }

    fn show(&mut self, sensors: &[bool]) {
        self.bench.tell(RemoteIoInput::Field(&Image::from_bits(sensors.iter().copied())));
    }

    /// Runs, has loaded the change, and is told to switch; `one` is shown, and `y` was driven.
    fn about_to_switch() -> (Self, Arc<OnlineChange>) {
        let (mut plant, change) = (Self::new(), change());
        plant.show(&[true, false]);
        let started = (0..60).any(|_| !plant.cycle(Some(&[true]), None).inputs.is_empty());
        assert!(started, "it starts cold");
        plant.order(&ChangeOrder::Prepare(Arc::clone(&change)));
        for _ in 0..3 {
            let seen = plant.cycle(Some(&[true]), Some(AFTER));
            assert_eq!(seen.applied, Some((Source::Direct, vec![true])));
            assert_eq!((&seen.inputs[..], seen.version), (&[true, false][..], Some(OLD)));
        }
        plant.order(&ChangeOrder::Switch(change.name(), NEW));
        (plant, change)
    }
}

/// The device is read by the points before until it says that it is read by the new ones: inputs that stay are as fresh as before, and a new one has its
/// initial value until it is read first. So it is on the way back.
#[test]
fn inputs_are_read_by_the_points_of_the_program() {
    let (mut plant, change) = Plant::about_to_switch();
    let seen = plant.cycle(Some(&[true, false]), Some(AFTER));
    assert_eq!((&seen.inputs[..], seen.version), (&[false, false, true][..], Some(NEW)));
    assert_eq!(seen.laid_out, [NEW]);
    assert_eq!(seen.applied, Some((Source::Direct, vec![true, false])));
    let changed = |event: &Event| matches!(event, Event::PointsChanged { from: OLD, to: NEW, .. });
    assert_eq!(seen.events.iter().filter(|event| changed(event)).count(), 1);
    // Still by the old points.
    plant.show(&[false, true]);
    assert_eq!(plant.cycle(None, Some(AFTER)).inputs, [true, false, false]);
    plant.bench.tell(RemoteIoInput::Points(NEW));
    // What is on its way by the old points has another width.
    plant.show(&[true, false]);
    assert_eq!(plant.cycle(None, Some(AFTER)).inputs, [true, false, false]);
    plant.show(&[false, true, false]);
    assert_eq!(plant.cycle(None, Some(AFTER)).inputs, [false, true, false]);
    plant.order(&ChangeOrder::Switch(change.name(), OLD));
    plant.show(&[true, true, false]);
    let seen = plant.cycle(None, Some(AFTER));
    assert_eq!((&seen.inputs[..], seen.version), (&[false, true][..], Some(OLD)));
    assert_eq!(seen.laid_out, [OLD]);
    plant.show(&[false, true, true]);
    assert_eq!(plant.cycle(None, Some(AFTER)).inputs, [true, false]);
}

/// Outputs that are not proved in the cycle of the change: one that stays is held where it is then, and a new one has its fail-safe value. Settings are
/// those of the configuration before, with the new fail-safe value of the new output.
#[test]
fn what_is_held_and_fail_safe_moves_with_the_points() {
    let (mut plant, change) = Plant::about_to_switch();
    for _ in 0..3 {
        let seen = plant.cycle(None, Some(AFTER));
        assert_eq!(seen.applied, Some((Source::Held, vec![true, true])));
    }
    let seen = plant.cycle(None, Some(AFTER));
    assert_eq!(seen.applied, Some((Source::FailSafe, vec![true, false])));
    plant.order(&ChangeOrder::Run(change.name(), AFTER));
    let seen = plant.cycle(None, Some(AFTER));
    assert_eq!(seen.applied, Some((Source::FailSafe, vec![true, true])));
    // The outputs before, with the settings after.
    plant.order(&ChangeOrder::Switch(change.name(), OLD));
    let seen = plant.cycle(None, Some(AFTER));
    assert_eq!(seen.applied, Some((Source::FailSafe, vec![true])));
}

#[test]
fn forces_end_with_the_points_that_they_are_of() {
    for (signal, is_input) in [(SignalPlace::Input(1), true), (SignalPlace::Output(0), false)] {
        let (mut plant, _) = Plant::about_to_switch();
        let (owner, reason) = ("anna".to_owned(), "a test".to_owned());
        let force = Force { signal, value: true.into(), seconds: 60, owner, reason };
        plant.bench.tell(RemoteIoInput::Force(&force));
        let seen = plant.cycle(Some(&[false, false]), Some(AFTER));
        let ended = |event: &Event| matches!(event, Event::Unforced { signal: of, expired: false, .. } if *of == signal);
        assert_eq!(seen.events.iter().filter(|event| ended(event)).count(), 1, "{is_input}");
        assert_eq!(seen.inputs, [false, false, true]);
        let driven =
            seen.events.iter().any(|event| matches!(event, Event::Applied { driven: Some(_), .. }));
        assert!(!driven, "{is_input}");
    }
}

/// A remote I/O that has lost the change with its disk samples nothing, whatever it is asked, until it has loaded the change again; then it continues by the
/// points of the state that the station holds.
#[test]
fn nothing_is_sampled_by_points_that_are_not_known() {
    let (mut plant, change) = Plant::about_to_switch();
    for _ in 0..5 {
        plant.cycle(Some(&[true, true]), Some(AFTER));
    }
    let (_, newest) = plant.sample.clone().expect("a sample");
    plant.bench.remote_io = RemoteIo::new(plant.bench.start(), settings(1));
    let mut unknown = 0;
    for _ in 0..60 {
        let seen = plant.cycle(None, Some(AFTER));
        assert_eq!(seen.inputs, [false; 0]);
        assert_eq!(seen.applied, Some((Source::FailSafe, vec![false])));
        let is_unknown =
            |event: &&Event| matches!(event, Event::PointsUnknown { version: NEW, .. });
        unknown += seen.events.iter().filter(is_unknown).count();
    }
    assert_eq!(unknown, 1);
    plant.order(&ChangeOrder::Prepare(change));
    let seen = (0..60).map(|_| plant.cycle(None, Some(AFTER)));
    let seen = seen.into_iter().find(|seen| !seen.inputs.is_empty()).expect("a sample");
    assert_eq!((seen.inputs.len(), seen.version, &seen.laid_out[..]), (3, Some(NEW), &[NEW][..]));
    let adopted = |event: &Event| matches!(event, Event::AdoptedLineage { .. });
    assert!(seen.events.iter().any(adopted), "{:?}", seen.events);
    assert!(newest < plant.bench.moment() && newest.cycle > Cycle(0));
}
