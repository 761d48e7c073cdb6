//! The plant as a member: paced by its remote I/O, by time where that is silent, fed by another plant over a lossy network.

use std::sync::Arc;
use std::time::Duration;

use understudy_cycle::{
    Agreement, ChangeOrder, Fallback, FallbackChange, Input, Machine, Mode, OnlineChange, Output,
    Release, Schedule, SharedOutputs, StaleState, ValueFault,
};
use understudy_logic::{Circuit, CircuitBuilder};
use understudy_plant::{
    BindingProblem, Direction, Event, ModelKind, Pace, Plant, PlantMachine, PressParameters,
    Settings, Signals, WATCHDOG_CYCLES,
};
use understudy_wire::{
    Actuation, Body, ClusterHash, ConfigurationHash, Configurations, Cycle, Epoch, Field, Frame,
    Header, Image, Member, Moment, ProgramId, Time, decode, encode,
};

const PERIOD: Duration = Duration::from_millis(10);
const PRESS: ProgramId = ProgramId(1);
const FEEDER: ProgramId = ProgramId(0);

fn controller() -> Circuit {
    let mut builder = CircuitBuilder::new("press");
    for name in ["part_present", "ram_up", "ram_down"] {
        builder.input(name);
    }
    let zero = builder.graph().constant(false);
    builder.output("move_down", zero);
    builder.output("move_up", zero);
    builder.finish().expect("a circuit")
}

fn machine() -> PlantMachine {
    machine_with(false)
}

fn machine_with(has_two_modules: bool) -> PlantMachine {
    let agreement = Agreement {
        cluster: ClusterHash(1),
        configuration: ConfigurationHash(2),
        schedule: Schedule::new(PERIOD, 2, 1, 2).expect("in bounds"),
        mode: Mode::Full,
        history: 8,
        flag_after: 3,
        shadow_cycles: 3,
        listen_cycles: 4,
    };
    let kind = ModelKind::Press(PressParameters::default());
    let (plant, problems) = Plant::new(&kind, &(&controller()).into(), &Signals::new(), true);
    assert_eq!(problems, []);
    PlantMachine::new(
        Settings {
            program: PRESS,
            agreement: Arc::new(agreement),
            plant: plant.expect("it fits"),
            fed_by: Some(FEEDER),
            follows: Vec::new(),
            fail_safe: Image::from_bits([false, true]),
            watchdog_cycles: WATCHDOG_CYCLES,
            has_two_modules,
            shared_outputs: SharedOutputs::default(),
        },
        Time(0),
    )
}

fn at(cycle: u64) -> Moment {
    Moment { epoch: Epoch(1), cycle: Cycle(cycle) }
}

fn frame(moment: Moment, sender: Member, body: Body) -> Arc<Frame> {
    let header = Header {
        cluster: ClusterHash(1),
        configuration: ConfigurationHash(2),
        prepared: None,
        moment,
        sender,
        alone: false,
    };
    Arc::new(Frame { header, body })
}

fn actuation(cycle: u64, down: bool) -> Arc<Frame> {
    let outputs = Image::from_bits([down, false]);
    frame(at(cycle), Member::RemoteIo(PRESS), Body::Actuation(Actuation { outputs }))
}

fn feeder(moment: Moment, handed_over: u64) -> Arc<Frame> {
    frame(
        moment,
        Member::Plant(FEEDER),
        Body::Field(Field {
            sensors: Image::zero(0),
            handed_over,
            finished: 0,
            plant_faults: 0,
            positions: Default::default(),
        }),
    )
}

/// Each step as its pace and cycle; every frame that is said has to be a frame that can be sent.
fn drain(machine: &mut PlantMachine) -> (Vec<Field>, Vec<(Pace, u64)>) {
    let (mut fields, mut steps) = (Vec::new(), Vec::new());
    while let Some(output) = machine.poll_output() {
        match output {
            Output::Send(frame) => {
                let mut bytes = Vec::new();
                encode(&frame, &mut bytes).expect("it keeps its promises");
                assert_eq!(decode(&bytes).as_ref(), Ok(&*frame));
                let Body::Field(field) = &frame.body else {
                    panic!("a plant says its field only");
                };
                fields.push(field.clone());
            }
            Output::Report(Event::Stepped { moment, pace, .. }) => {
                steps.push((pace, moment.cycle.0));
            }
            other => panic!("unexpected: {other:?}"),
        }
    }
    (fields, steps)
}

fn hear(machine: &mut PlantMachine, now: Time, frame: &Arc<Frame>) -> Vec<(Pace, u64)> {
    machine.handle_input(now, Input::Frame(frame));
    drain(machine).1
}

/// Wakes it whenever it asks for it, up to and with `until`.
fn wake(machine: &mut PlantMachine, until: Time) -> Vec<(Pace, u64)> {
    let mut steps = Vec::new();
    while machine.wakeup() <= until {
        machine.handle_input(machine.wakeup(), Input::Wakeup);
        steps.extend(drain(machine).1);
    }
    steps
}

fn periods(count: u64) -> Time {
    Time(count * PERIOD.as_nanos() as u64)
}

#[test]
fn it_shows_its_sensors_each_period_until_it_is_driven() {
    let mut machine = machine();
    for period in 0..5 {
        assert_eq!(machine.wakeup(), periods(period));
        machine.handle_input(periods(period), Input::Wakeup);
        let (fields, steps) = drain(&mut machine);
        assert_eq!((fields.len(), steps.len()), (1, 0));
        assert!(fields[0].sensors.get(1), "the ram is up");
    }
}

#[test]
fn one_actuation_steps_once_and_an_older_one_never() {
    let mut machine = machine();
    let now = periods(1);
    assert_eq!(hear(&mut machine, now, &actuation(7, true)), [(Pace::Driven, 7)]);
    assert_eq!(hear(&mut machine, now, &actuation(7, true)), []);
    assert_eq!(hear(&mut machine, now, &actuation(6, true)), []);
    assert_eq!(hear(&mut machine, now, &actuation(8, true)), [(Pace::Driven, 8)]);
    assert_eq!(machine.field().positions[0], 250);
}

#[test]
fn without_actuations_it_goes_on_and_then_falls_safe() {
    let mut machine = machine();
    for cycle in 1..=6 {
        hear(&mut machine, periods(cycle), &actuation(cycle, true));
    }
    let steps = wake(&mut machine, periods(10));
    // At 7.5 and 8.5 periods the last outputs hold; from 9 periods on the watchdog has run out.
    let expected = [(Pace::Alone, 6), (Pace::Alone, 6), (Pace::Watchdog, 6)];
    assert_eq!(steps, expected);
    assert_eq!(machine.field().positions[0], 875, "down twice more, then up once");
    // Whoever drives now is believed, even one who counts anew.
    let steps = hear(&mut machine, periods(10), &actuation(1, true));
    assert_eq!(steps, [(Pace::Driven, 1)]);
}

#[test]
fn a_stalled_host_does_not_make_it_run_after_lost_time() {
    let mut machine = machine();
    hear(&mut machine, periods(1), &actuation(1, true));
    machine.handle_input(periods(500), Input::Wakeup);
    assert_eq!(drain(&mut machine).1, [(Pace::Watchdog, 1)]);
    assert_eq!(machine.wakeup(), periods(501));
}

/// Frames of the feeding plant as moment and count, and how many parts the press has seen in the end.
fn check_feed(frames: &[(u64, u64)], expected: u64) {
    let mut machine = machine();
    for (index, &(cycle, handed_over)) in frames.iter().enumerate() {
        let moment = if cycle == 0 { Moment::default() } else { at(cycle) };
        machine.handle_input(periods(1), Input::Frame(&feeder(moment, handed_over)));
        machine.handle_input(periods(1), Input::Frame(&actuation(index as u64 + 1, false)));
    }
    let field = machine.field();
    let seen = u64::from(field.sensors.get(0)) + field.plant_faults;
    assert_eq!(seen, expected, "{frames:?}");
}

#[test]
fn parts_survive_loss_duplication_reordering_and_the_feeders_restart() {
    check_feed(&[], 0);
    check_feed(&[(1, 0), (2, 1), (3, 1)], 1);
    check_feed(&[(1, 0), (9, 3)], 3);
    check_feed(&[(2, 1), (2, 1), (1, 0), (3, 1)], 1);
    check_feed(&[(2, 2), (0, 0), (8, 1)], 3);
    // A moment of an epoch that was given up does not close the ear for good.
    check_feed(&[(9, 1), (3, 2)], 2);
    check_feed(&[(2, 2), (8, 1)], 3);
}

#[test]
fn another_configuration_is_refused_once_and_another_cluster_without_a_word() {
    let mut machine = machine();
    let mut other = (*actuation(1, true)).clone();
    other.header.configuration = ConfigurationHash(9);
    let other = Arc::new(other);
    let mut refused = 0;
    for _ in 0..3 {
        machine.handle_input(periods(1), Input::Frame(&other));
        while let Some(output) = machine.poll_output() {
            assert!(matches!(output, Output::Report(Event::Refused { .. })));
            refused += 1;
        }
    }
    assert_eq!(refused, 1);
    let mut foreign = (*actuation(1, true)).clone();
    foreign.header.cluster = ClusterHash(3);
    assert_eq!(hear(&mut machine, periods(1), &Arc::new(foreign)), []);
    let stranger = frame(
        at(1),
        Member::RemoteIo(FEEDER),
        Body::Actuation(Actuation { outputs: Image::from_bits([true, false]) }),
    );
    assert_eq!(hear(&mut machine, periods(1), &stranger), []);
}

#[test]
fn every_misfit_between_a_model_and_its_controller_is_named_in_one_run() {
    let kind = ModelKind::Press(PressParameters::default());
    let signals: Signals = [("ram_up", "ram_upp"), ("move_up", "rise"), ("ramp", "ram_up")]
        .map(|(terminal, signal)| (terminal.to_owned(), signal.to_owned()))
        .into();
    let (plant, problems) = Plant::new(&kind, &(&controller()).into(), &signals, true);
    assert!(plant.is_none());
    let found: Vec<_> = problems
        .iter()
        .map(|problem| match problem {
            BindingProblem::UnknownTerminal { terminal, .. } => format!("terminal {terminal}"),
            BindingProblem::UnknownSignal { direction: Direction::Sensor, signal, .. } => {
                format!("input {signal}")
            }
            BindingProblem::UnknownSignal { signal, .. } => format!("output {signal}"),
            other => format!("{other:?}"),
        })
        .collect();
    assert_eq!(found, ["terminal ramp", "input ram_upp", "output rise"]);
}

/// A tank as a ladder would lower to: full three scans after it is being filled, and each filling is counted.
#[test]
fn a_program_can_be_a_plant() {
    let mut controller = CircuitBuilder::new("filler");
    controller.input("full");
    controller.input("lid_closed");
    let zero = controller.graph().constant(false);
    controller.output("fill", zero);
    controller.output("lamp", zero);
    let controller = controller.finish().expect("a circuit");

    let mut tank = CircuitBuilder::new("tank");
    let fill = tank.input("fill");
    let arrives = tank.input("part_arrives");
    let levels = [1, 2, 3].map(|level| tank.register(format!("level_{level}"), false));
    let mut below = fill;
    for (register, level) in levels {
        let reached = tank.graph().and(fill, below);
        tank.set_next(register, reached);
        below = level;
    }
    tank.output("full", below);
    tank.output("handed_over", below);
    tank.output("plant_fault", arrives);
    let tank = tank.finish().expect("a circuit");

    let kind = ModelKind::Program(Box::new((&tank).into()));
    assert!(kind.takes_parts() && kind.hands_over());
    let (plant, problems) = Plant::new(&kind, &(&controller).into(), &Signals::new(), true);
    let expected = [
        BindingProblem::InputNotDriven { input: "lid_closed".into() },
        BindingProblem::OutputHasNoEffect { output: "lamp".into() },
    ];
    assert_eq!(problems, expected);
    let mut plant = plant.expect("warnings only");
    let on = Image::from_bits([true, true]);
    let off = Image::zero(2);
    let full: Vec<bool> = (0..5).map(|_| plant.step(&on, 0).sensors.get(0)).collect();
    assert_eq!(full, [false, false, false, true, true]);
    assert_eq!((plant.field().finished, plant.field().handed_over), (1, 1));
    plant.step(&off, 0);
    plant.step(&off, 2);
    assert_eq!(plant.field().plant_faults, 1);
    plant.step(&off, 0);
    assert_eq!(plant.step(&off, 0).plant_faults, 2, "each part is an edge");
}

#[test]
fn events_are_read_back_as_they_were_written() {
    let event = Event::Stepped {
        moment: at(3),
        pace: Pace::Alone,
        outputs: Image::from_bits([true, false]),
        field: machine().field(),
    };
    let text = serde_json::to_string(&event).expect("it is plain data");
    assert!(text.starts_with(r#"{"event":"stepped""#), "{text}");
    assert_eq!(serde_json::from_str::<Event>(&text).expect("the same"), event);
}

/// An actuation of one of two remote I/Os, and what the actuators get then.
fn drive(
    machine: &mut PlantMachine,
    now: Time,
    cycle: u64,
    sender: Member,
    bits: [bool; 2],
) -> Vec<[bool; 2]> {
    let outputs = Image::from_bits(bits);
    let frame = frame(at(cycle), sender, Body::Actuation(Actuation { outputs }));
    machine.handle_input(now, Input::Frame(&frame));
    stepped(machine)
}

fn stepped(machine: &mut PlantMachine) -> Vec<[bool; 2]> {
    let outputs = std::iter::from_fn(|| machine.poll_output());
    let steps = outputs.filter_map(|output| match output {
        Output::Report(Event::Stepped { outputs, .. }) => Some([outputs.get(0), outputs.get(1)]),
        _ => None,
    });
    steps.collect()
}

/// An actuator is on where one of two modules drives it; a module without an actuation for `watchdog_cycles` drives nothing.
#[test]
fn two_modules_drive_one_actuator_through_diodes() {
    let (first, twin) = (Member::RemoteIo(PRESS), Member::Twin(PRESS));
    let mut machine = machine_with(true);
    let [on, off] = [[true, false], [false, false]];
    assert_eq!(drive(&mut machine, periods(1), 1, first, on), [on]);
    assert_eq!(drive(&mut machine, periods(1), 1, twin, on).len(), 0, "one step in a cycle");
    // One of them is a cycle late.
    assert_eq!(drive(&mut machine, periods(2), 2, first, off), [on]);
    assert!(drive(&mut machine, periods(2), 2, twin, off).is_empty());
    assert_eq!(drive(&mut machine, periods(3), 3, first, on), [on]);
    // An older frame counts no more.
    assert_eq!(drive(&mut machine, periods(4), 4, twin, off), [on]);
    assert!(drive(&mut machine, periods(4), 3, twin, on).is_empty());
    // The first one has ended: its module drives for `watchdog_cycles` periods, and the other one alone after that.
    assert_eq!(drive(&mut machine, periods(5), 5, twin, off), [on]);
    assert_eq!(drive(&mut machine, periods(6), 6, twin, off), [off]);
    assert_eq!(drive(&mut machine, periods(7), 7, twin, on), [on]);
    // Both have.
    let mut last = Vec::new();
    while machine.wakeup() <= periods(12) {
        machine.handle_input(machine.wakeup(), Input::Wakeup);
        last.extend(stepped(&mut machine));
    }
    // What is configured; of two modules it is 0, which the cluster file sees to.
    assert_eq!((last.first(), last.last()), (Some(&on), Some(&[false, true])), "{last:?}");
}

/// What the actuators get when the watchdog has run out.
fn falls_to(machine: &mut PlantMachine, now: Time) -> [bool; 2] {
    drive(machine, now, 1, Member::RemoteIo(PRESS), [true, false]);
    let mut last = [true, false];
    for period in 1..10 {
        machine.handle_input(now + PERIOD * period, Input::Wakeup);
        last = stepped(machine).pop().unwrap_or(last);
    }
    last
}

/// The values of its watchdog are those of its own configuration in an online change, also where it starts in the middle; modules are released always.
#[test]
fn the_watchdog_has_the_fail_safe_values_of_its_configuration() {
    let [own, other] = [ConfigurationHash(2), ConfigurationHash(3)];
    let fallback = |bits: [bool; 2]| Fallback {
        hold_cycles: 3,
        trial_cycles: 0,
        fail_safe: Image::from_bits(bits),
        ramps: Vec::new(),
        release: Release::Automatic,
        value_fault: ValueFault::Hold,
        stale_state: StaleState::Operator,
        restart: None,
    };
    let [old, new] = [[false, true], [true, true]];
    let changed = FallbackChange { program: PRESS, before: fallback(old), after: fallback(new) };
    let change = Arc::new(OnlineChange {
        before: own,
        after: other,
        programs: Vec::new(),
        fallbacks: vec![changed],
    });
    let run = |configuration| ChangeOrder::Run(change.name(), configuration);
    let orders = [ChangeOrder::Prepare(Arc::clone(&change)), run(other), run(own)];
    for (count, wanted) in [(0, old), (1, old), (2, new), (3, old)] {
        let mut machine = machine();
        for order in orders.iter().take(count) {
            machine.handle_input(Time(0), Input::Change(order));
        }
        assert_eq!(falls_to(&mut machine, Time(0)), wanted, "{count} orders");
    }
    for (configurations, wanted) in [
        (Configurations { own, prepared: Some(other) }, old),
        (Configurations { own: other, prepared: Some(own) }, new),
    ] {
        let mut alone = machine().changed(&change, configurations);
        assert_eq!(falls_to(&mut alone, Time(0)), wanted);
        let mut modules = machine_with(true).changed(&change, configurations);
        assert_eq!(falls_to(&mut modules, Time(0)), [false, true], "as it was made");
    }
}
