//! Points that change with the program: what the device shows, what is held and what is forced, from the cycle of the change on.

use std::sync::Arc;

use understudy_cycle::{
    ChangeOrder, Conversion, FallbackChange, Input, Layout, Moved, OnlineChange, OperatorInput,
    OperatorInputKind, Output, PointPlace, PointsChange, Program, ProgramChange, RemoteIoInput,
};
use understudy_logic::CircuitBuilder;
use understudy_remote_io::{Event, Fallback, ForceEnd, RemoteIo, Settings};
use understudy_typed::Elementary;
use understudy_wire::{
    Body, ClusterHash, ConfigurationHash, Configurations, Cycle, Force, Frame, Header, Holding,
    Image, Lineage, Moment, Note, PointsHash, ProgramHash, ProgramSet, Recalled, Role, Sample,
    SamplesReceived, SignalPlace, Source, StationSet, Turn, Unforce, Word, Write, WriteAnswer,
    WriteId, WriteOutcome,
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
    change_between(settings(1).layout, Layout::booleans(3, 2))
}

/// The same with these layouts.
fn change_between(old: Arc<Layout>, new: Layout) -> Arc<OnlineChange> {
    let before = settings(1);
    let known_by = [old.hash, new.hash];
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
                before: old,
                after: Arc::new(new),
                inputs: vec![moved(0, 2), moved(1, 0)],
                outputs: vec![moved(0, 1)],
            })),
            known_by,
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
        let recalled = self.sample.as_ref().map(|(sample, moment)| Recalled {
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

    /// Runs; `one` is shown, and `y` was driven.
    fn running() -> Self {
        let mut plant = Self::new();
        plant.show(&[true, false]);
        let started = (0..60).any(|_| !plant.cycle(Some(&[true]), None).inputs.is_empty());
        assert!(started, "it starts cold");
        plant
    }

    /// The same, has loaded the change, and is told to switch.
    fn about_to_switch() -> (Self, Arc<OnlineChange>) {
        let (mut plant, change) = (Self::running(), change());
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

/// An input that goes from the operator to the device, or back, keeps its newest value until the first one from there: also while the device is still read
/// by the points before.
#[test]
fn an_input_with_another_source_keeps_its_newest_value() {
    let level = OperatorInput {
        place: PointPlace { bit: 0, of: Elementary::Bool },
        kind: OperatorInputKind::Level,
        role: Role::Operator,
        initial: 0,
        retains: false,
    };
    let old = Arc::new(Layout { operator_inputs: vec![level], ..Layout::booleans(2, 1) });
    let change = change_between(Arc::clone(&old), Layout::booleans(3, 2));
    let settings = Settings { layout: Arc::clone(&old), ..settings(1) };
    let mut plant = Plant { bench: Bench::new(settings, 100), sample: None };
    plant.show(&[false, false]);
    assert!((0..60).any(|_| !plant.cycle(Some(&[true]), None).inputs.is_empty()), "it starts");
    let (owner, reason) = ("anna".to_owned(), "a test".to_owned());
    let id = WriteId { session: 1, number: 1 };
    let (value, role, points) = (true.into(), Role::Operator, Some(old.hash));
    let write = Write { id, input: 0, value, role, owner, reason, points };
    plant.bench.tell(RemoteIoInput::Write(&write));
    plant.order(&ChangeOrder::Prepare(Arc::clone(&change)));
    for _ in 0..3 {
        assert_eq!(plant.cycle(Some(&[true]), Some(AFTER)).inputs, [true, false]);
    }
    plant.order(&ChangeOrder::Switch(change.name(), NEW));
    assert_eq!(plant.cycle(Some(&[true, false]), Some(AFTER)).inputs, [false, false, true]);
    plant.show(&[false, true]);
    assert_eq!(plant.cycle(None, Some(AFTER)).inputs, [true, false, true]);
    plant.bench.tell(RemoteIoInput::Points(NEW));
    assert_eq!(plant.cycle(None, Some(AFTER)).inputs, [true, false, true]);
    for shown in [false, true] {
        plant.show(&[false, false, shown]);
        assert_eq!(plant.cycle(None, Some(AFTER)).inputs, [false, false, shown]);
    }
    // Back to the operator: what the device showed last, until it is written.
    plant.order(&ChangeOrder::Switch(change.name(), OLD));
    assert_eq!(plant.cycle(None, Some(AFTER)).inputs, [true, false]);
    plant.show(&[false, false, false]);
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
        let points = Some(settings(1).layout.hash);
        let force = Force { signal, value: true.into(), seconds: 60, owner, reason, points };
        plant.bench.tell(RemoteIoInput::Force(&force));
        let seen = plant.cycle(Some(&[false, false]), Some(AFTER));
        let ended = |event: &Event| matches!(event, Event::Unforced { signal: of, by: ForceEnd::OnlineChange, .. } if *of == signal);
        assert_eq!(seen.events.iter().filter(|event| ended(event)).count(), 1, "{is_input}");
        assert_eq!(seen.inputs, [false, false, true]);
        let driven =
            seen.events.iter().any(|event| matches!(event, Event::Applied { driven: Some(_), .. }));
        assert!(!driven, "{is_input}");
    }
}

/// What became of an order for a signal that was found by these points: a force of the first output, its end, and a write of the first input.
fn orders_by(plant: &mut Plant, points: Option<PointsHash>) -> [String; 3] {
    let signal = SignalPlace::Output(0);
    let (owner, reason) = ("anna".to_owned(), "a test".to_owned());
    let (id, role) = (WriteId { session: 1, number: 1 }, Role::Operator);
    let write = Write {
        id,
        input: 0,
        value: true.into(),
        role,
        owner: owner.clone(),
        reason: reason.clone(),
        points,
    };
    let force = Force { signal, value: true.into(), seconds: 60, owner, reason, points };
    let unforce = Unforce { signal, points };
    let orders = [
        RemoteIoInput::Force(&force),
        RemoteIoInput::Unforce(&unforce),
        RemoteIoInput::Write(&write),
    ];
    orders.map(|order| {
        let said = plant.bench.tell(order);
        let outcome = said.iter().find_map(|output| match output {
            Output::Obeyed(Ok(())) => Some("done".to_owned()),
            Output::Obeyed(Err(refusal)) => Some(refusal.code().to_owned()),
            Output::Answer(WriteAnswer { outcome: WriteOutcome::Refused { refusal }, .. }) => {
                Some(refusal.code().to_owned())
            }
            _ => None,
        });
        outcome.unwrap_or_else(|| panic!("{said:?}"))
    })
}

/// An order names its signal by a bit, which is of another signal after the change: only that of the points that count is taken, and without a word of points
/// none as long as a change could replace them.
#[test]
fn an_order_is_for_the_points_by_which_its_signal_was_found() {
    let [old, new] = [settings(1).layout.hash, Layout::booleans(3, 2).hash];
    // The layouts have no operator inputs.
    let [taken, refused] =
        [["done", "done", "U0640"], ["U0638", "U0638", "U0638"]].map(|it| it.map(str::to_owned));
    let check = |plant: &mut Plant, expected: [bool; 3]| {
        for (points, is_taken) in [Some(old), Some(new), None].into_iter().zip(expected) {
            let expected = if is_taken { &taken } else { &refused };
            assert_eq!(orders_by(plant, points), *expected, "{points:?}");
        }
    };
    check(&mut Plant::running(), [true, false, true]);
    let (mut plant, change) = Plant::about_to_switch();
    check(&mut plant, [true, false, false]);
    plant.cycle(Some(&[true, false]), Some(AFTER));
    check(&mut plant, [false, true, false]);
    plant.order(&ChangeOrder::Run(change.name(), AFTER));
    check(&mut plant, [false, true, false]);
    plant.order(&ChangeOrder::Switch(change.name(), OLD));
    plant.cycle(Some(&[true]), Some(AFTER));
    check(&mut plant, [true, false, false]);
}

/// A change that leaves the points, and names a value of an enumeration in another way: who has either file means them. When it is over, who has the old
/// one does not know what his values mean.
#[test]
fn points_that_stay_are_known_by_both_files() {
    let mut plant = Plant::running();
    let (old, new) = (settings(1).layout.hash, PointsHash(99));
    let mut change = OnlineChange::clone(&change());
    change.fallbacks.clear();
    let changed = &mut change.programs[0];
    changed.after = program(NEW, &["one", "two"], &["y"]);
    (changed.points, changed.known_by) = (None, [old, new]);
    let name = change.name();
    let check = |plant: &mut Plant, expected: [bool; 4]| {
        let points = [None, Some(old), Some(new), Some(PointsHash(5))];
        let found = points.map(|points| orders_by(plant, points)[0] == "done");
        assert_eq!(found, expected);
    };
    check(&mut plant, [true, true, false, false]);
    plant.order(&ChangeOrder::Prepare(Arc::new(change)));
    check(&mut plant, [true, true, true, false]);
    plant.cycle(Some(&[true]), Some(AFTER));
    plant.order(&ChangeOrder::Switch(name, NEW));
    for _ in 0..6 {
        plant.cycle(Some(&[true]), Some(AFTER));
        check(&mut plant, [true, true, true, false]);
    }
    plant.order(&ChangeOrder::Run(name, AFTER));
    plant.order(&ChangeOrder::Forget(name, AFTER));
    check(&mut plant, [true, false, true, false]);
}

/// A force of a signal that moved is not ended by who knows the place that another one had before.
#[test]
fn only_who_knows_the_points_ends_a_force() {
    let (mut plant, _) = Plant::about_to_switch();
    plant.cycle(Some(&[true, false]), Some(AFTER));
    let signal = SignalPlace::Output(0);
    let [old, new] = [settings(1).layout.hash, Layout::booleans(3, 2).hash].map(Some);
    let (owner, reason) = ("anna".to_owned(), "a test".to_owned());
    let force = Force { signal, value: true.into(), seconds: 60, owner, reason, points: new };
    plant.bench.tell(RemoteIoInput::Force(&force));
    let driven = |seen: &Seen| {
        let mut driven = seen.events.iter().filter_map(|event| match event {
            Event::Applied { driven, .. } => driven.as_ref(),
            _ => None,
        });
        driven.next().map(|image| image.bits().collect::<Vec<_>>())
    };
    for (points, expected) in
        [(None, Some(vec![true, false])), (old, Some(vec![true, false])), (new, None)]
    {
        plant.bench.tell(RemoteIoInput::Unforce(&Unforce { signal, points }));
        let seen = plant.cycle(Some(&[false, false]), Some(AFTER));
        assert_eq!(driven(&seen), expected, "{points:?}");
    }
}

/// The newest note is of a third program: the value of an input that keeps it was taken over to the points of one version of the change, and is found by
/// those of the version that starts, wherever they are.
#[test]
fn a_value_of_a_third_program_is_found_by_the_points_that_count() {
    let keeps = |bit| OperatorInput {
        place: PointPlace { bit, of: Elementary::Bool },
        kind: OperatorInputKind::Level,
        role: Role::Operator,
        initial: 0,
        retains: true,
    };
    let of = |bit, inputs, outputs| Layout {
        operator_inputs: vec![keeps(bit)],
        ..Layout::booleans(inputs, outputs)
    };
    let (old, new) = (Arc::new(of(0, 2, 1)), of(2, 3, 2));
    let change = change_between(Arc::clone(&old), new);
    let (by_old, by_new) = (&[true, false][..], &[false, false, true][..]);
    for (noted_by, inputs) in [(OLD, by_old), (NEW, by_new)] {
        for (own, expected) in [(ConfigurationHash(2), by_old), (AFTER, by_new)] {
            let settings = Settings { layout: Arc::clone(&old), ..settings(1) };
            let mut plant = Plant { bench: Bench::new(settings, 100), sample: None };
            let note = Note {
                cluster: ClusterHash(1),
                configuration: own,
                hash: ProgramHash(77),
                is_retentive: false,
                number: 5,
                lineage: Lineage(3),
                begun: None,
                recalled: Recalled {
                    program: PROGRAM,
                    sampled: Moment::default(),
                    received: SamplesReceived::Later,
                    applied: None,
                    excluded: StationSet::EMPTY,
                    accounted_for: StationSet::EMPTY,
                    writes: Default::default(),
                    pulses: Default::default(),
                    inputs: Image::from_bits(inputs.iter().copied()),
                    version: Some(noted_by),
                },
            };
            let prepared = Some(if own == AFTER { ConfigurationHash(2) } else { AFTER });
            let remote_io =
                plant.bench.remote_io.changed(&change, Configurations { own, prepared });
            plant.bench.remote_io = remote_io.noting(Some(note), false);
            plant.show(if own == AFTER { &[false; 3] } else { &[false; 2] });
            let seen = (0..60).map(|_| plant.cycle(None, Some(AFTER)));
            let seen = seen.into_iter().find(|seen| !seen.inputs.is_empty()).expect("a sample");
            assert_eq!(seen.inputs, expected, "{noted_by:?} {own:?}");
        }
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
