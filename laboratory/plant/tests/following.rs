//! A plant that follows what its neighbour shows, over a network that loses, repeats and reorders.

use std::sync::Arc;
use std::time::Duration;

use proptest::prelude::*;
use understudy_cycle::{Agreement, Input, Machine, Mode, Output, Schedule, SharedOutputs};
use understudy_logic::{Circuit, CircuitBuilder};
use understudy_plant::{
    BindingProblem, Event, Followed, ModelKind, Plant, PlantMachine, Settings, Signals,
    WATCHDOG_CYCLES,
};
use understudy_wire::{
    Actuation, Body, ClusterHash, ConfigurationHash, Cycle, Epoch, Field, Frame, Header, Image,
    Member, Moment, ProgramId, Time,
};

const PERIOD: Duration = Duration::from_millis(10);
const OWN: ProgramId = ProgramId(1);
const PILOT: ProgramId = ProgramId(0);

/// One input and one output of that name each.
fn circuit(name: &str, inputs: &[&str], output: &str) -> Circuit {
    let mut builder = CircuitBuilder::new(name);
    let inputs: Vec<_> = inputs.iter().map(|input| builder.input(*input)).collect();
    let all = inputs.into_iter().reduce(|all, input| builder.graph().and(all, input));
    builder.output(output, all.expect("an input"));
    builder.finish().expect("a circuit")
}

fn controller() -> Circuit {
    circuit("main", &["main_flame"], "gas")
}

/// Gas burns over the pilot flame.
fn burner() -> ModelKind {
    let burner = circuit("burner", &["gas", "pilot_flame"], "main_flame");
    ModelKind::Program(Box::new((&burner).into()))
}

fn following(signals: &Signals, follows: &[&str]) -> (Option<Plant>, Vec<BindingProblem>) {
    let follows: Vec<String> = follows.iter().map(|&name| name.into()).collect();
    Plant::following(&burner(), &(&controller()).into(), signals, &follows, false)
}

fn plant() -> Plant {
    let (plant, problems) = following(&Signals::new(), &["pilot_flame"]);
    assert_eq!(problems, []);
    plant.expect("it fits")
}

#[test]
fn a_terminal_that_follows_is_not_the_controllers() {
    let mut plant = plant();
    let on = Image::from_bits([true]);
    assert!(!plant.step(&on, 0).sensors.get(0), "not seen yet");
    plant.see(0, &[true]);
    assert!(plant.step(&on, 0).sensors.get(0));
    assert!(plant.step(&on, 0).sensors.get(0), "it stays");
    plant.see(0, &[false]);
    assert!(!plant.step(&on, 0).sensors.get(0));
    plant.see(1, &[true]);
    assert!(!plant.step(&on, 0).sensors.get(0), "nothing has number 1");
}

#[test]
fn what_cannot_follow_is_named() {
    let (plant, problems) = following(&Signals::new(), &["pilot", "main_flame", "pilot_flame"]);
    assert!(plant.is_none());
    let names = |problem: &BindingProblem| match problem {
        BindingProblem::UnknownTerminal { terminal, known } => {
            assert_eq!(known[..], ["gas", "pilot_flame"]);
            terminal.clone()
        }
        other => format!("{other:?}"),
    };
    let found: Vec<String> = problems.iter().map(names).collect();
    assert_eq!(found, ["pilot", "main_flame"]);

    let signals = Signals::from([("pilot_flame".into(), "gas".into())]);
    let (plant, problems) = following(&signals, &["pilot_flame"]);
    assert!(plant.is_none());
    let terminal = "pilot_flame".into();
    assert_eq!(problems, [BindingProblem::FollowsTwo { terminal }]);
}

fn machine() -> PlantMachine {
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
    PlantMachine::new(
        Settings {
            program: OWN,
            agreement: Arc::new(agreement),
            plant: plant(),
            fed_by: None,
            follows: vec![Followed { from: PILOT, sensor: 2, bits: 1 }],
            fail_safe: Image::zero(1),
            watchdog_cycles: WATCHDOG_CYCLES,
            has_two_modules: false,
            shared_outputs: SharedOutputs::default(),
        },
        Time(0),
    )
}

fn frame(epoch: u64, cycle: u64, sender: Member, body: Body) -> Arc<Frame> {
    let header = Header {
        cluster: ClusterHash(1),
        configuration: ConfigurationHash(2),
        prepared: None,
        moment: Moment { epoch: Epoch(epoch), cycle: Cycle(cycle) },
        sender,
        alone: false,
    };
    Arc::new(Frame { header, body })
}

fn shows(epoch: u64, cycle: u64, sender: ProgramId, flame: bool) -> Arc<Frame> {
    let body = Body::Field(Field {
        sensors: Image::from_bits([!flame, true, flame]),
        handed_over: 0,
        finished: 0,
        plant_faults: 0,
        positions: Default::default(),
    });
    frame(epoch, cycle, Member::Plant(sender), body)
}

/// Opens the gas in this cycle: whether it burns.
fn burns(machine: &mut PlantMachine, cycle: u64) -> bool {
    let outputs = Image::from_bits([true]);
    let body = Body::Actuation(Actuation { outputs });
    let actuation = frame(9, cycle, Member::RemoteIo(OWN), body);
    let now = Time(0) + PERIOD * cycle as u32;
    machine.handle_input(now, Input::Frame(&actuation));
    let mut burns = None;
    while let Some(output) = machine.poll_output() {
        if let Output::Report(Event::Stepped { field, .. }) = output {
            burns = Some(field.sensors.get(0));
        }
    }
    burns.expect("a new actuation is a step")
}

fn hear(machine: &mut PlantMachine, frame: &Arc<Frame>) {
    machine.handle_input(Time(0), Input::Frame(frame));
}

#[test]
fn the_newest_frame_of_the_neighbour_counts() {
    let mut machine = machine();
    assert!(!burns(&mut machine, 1));
    hear(&mut machine, &shows(5, 10, PILOT, true));
    assert!(burns(&mut machine, 2));
    hear(&mut machine, &shows(5, 9, PILOT, false));
    assert!(burns(&mut machine, 3), "a frame that was overtaken");
    hear(&mut machine, &shows(5, 11, ProgramId(3), false));
    assert!(burns(&mut machine, 4), "a plant that it does not follow");
    hear(&mut machine, &shows(5, 10, PILOT, false));
    assert!(!burns(&mut machine, 5), "a second step in the same cycle");
    hear(&mut machine, &shows(4, 3, PILOT, true));
    assert!(burns(&mut machine, 6), "an epoch was given up");
    hear(&mut machine, &shows(0, 0, PILOT, false));
    assert!(!burns(&mut machine, 7), "the neighbour has just started");
}

proptest! {
    /// Whatever is lost, repeated or overtaken: what is followed is the newest that was heard.
    #[test]
    fn loss_and_reordering_cost_time_only(frames in prop::collection::vec((1..20_u64, any::<bool>()), 1..40)) {
        let mut machine = machine();
        let flame = |cycle: u64| !cycle.is_multiple_of(3);
        let mut newest = 0;
        for (step, (cycle, lost)) in (1..).zip(frames) {
            if !lost {
                hear(&mut machine, &shows(5, cycle, PILOT, flame(cycle)));
                newest = newest.max(cycle);
            }
            prop_assert_eq!(burns(&mut machine, step), newest > 0 && flame(newest));
        }
    }
}
