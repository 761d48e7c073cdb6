//! Two programs, one understudy, two remote I/Os: every schedule of a few faults over a few cycles.

use std::sync::Arc;
use std::time::Duration;

use understudy_logic::{Circuit, CircuitBuilder, Scan};
use understudy_model_checking::{ALL, Budget, Model, Step, check};
use understudy_plant::{ModelKind, Plant, Signals};
use understudy_remote_io::{Release, ValueFault};
use understudy_simulator::{Parts, Tally};
use understudy_wire::{
    Agreement, ClusterHash, ConfigurationHash, Epoch, Image, Mode, ProgramHash, ProgramId,
    Schedule, StationId,
};

const PERIOD: Duration = Duration::from_millis(10);

/// x(t+1) = (x₁ ⊕ u, x₀), y = x₁ ⊕ u; or with another first state. Each input changes all that follows.
fn program(first: bool) -> Circuit {
    let mut builder = CircuitBuilder::new("program");
    let u = builder.input("u");
    let (older, was) = builder.register("x1", first);
    let (newer, is) = builder.register("x0", !first);
    let mixed = builder.graph().xor(was, u);
    builder.set_next(newer, mixed);
    builder.set_next(older, is);
    builder.output("y", mixed);
    builder.finish().expect("a circuit")
}

/// A plant that toggles, once for each time that it is driven with 1 too; it shows all of its state.
fn plant() -> Circuit {
    let mut builder = CircuitBuilder::new("plant");
    let y = builder.input("y");
    let (register, p) = builder.register("p", false);
    let flipped = builder.graph().xor(p, y);
    let next = builder.graph().not(flipped);
    builder.set_next(register, next);
    builder.output("u", next);
    builder.finish().expect("a circuit")
}

/// The limits of the protocol are as low as they can be, so that a few cycles pass all of them.
fn parts(understudies: usize) -> Parts {
    let circuits = [program(false), program(true)];
    let agreement = Arc::new(Agreement {
        cluster: ClusterHash(1),
        configuration: ConfigurationHash(2),
        schedule: Schedule::new(PERIOD, circuits.len(), understudies, 1).expect("within bounds"),
        mode: Mode::Full,
        history: 2,
        flag_after: 1,
        shadow_cycles: 1,
        listen_cycles: 1,
    });
    let programs: Arc<[understudy_node::Program]> = circuits
        .iter()
        .zip(1..)
        .map(|(circuit, hash)| understudy_node::Program {
            hash: ProgramHash(hash),
            scan: Scan::new(circuit),
        })
        .collect();
    let stations = (0..circuits.len() + understudies).map(|rank| understudy_node::Settings {
        station: StationId(rank as u8),
        agreement: Arc::clone(&agreement),
        programs: Arc::clone(&programs),
        epoch: Epoch(0),
    });
    let remote_ios = programs.iter().zip(0..);
    let remote_ios = remote_ios.map(|(program, index)| understudy_remote_io::Settings {
        program: ProgramId(index),
        agreement: Arc::clone(&agreement),
        hash: program.hash,
        inputs: 1,
        channels: Vec::new(),
        diagnosis: None,
        hold_cycles: 1,
        fail_safe: Image::zero(1),
        release: Release::Automatic,
        value_fault: ValueFault::Hold,
    });
    let plants = circuits.iter().map(|circuit| {
        let kind = ModelKind::Ladder(Box::new(plant()));
        Plant::new(&kind, circuit, &Signals::new(), false).0
    });
    Parts {
        stations: stations.collect(),
        remote_ios: remote_ios.collect(),
        plants: plants.collect(),
        fed_by: vec![None; circuits.len()],
        follows: vec![Vec::new(); circuits.len()],
    }
}

/// All that can be done once, and nothing of anything.
const ONE: Budget = Budget {
    losses: 1,
    delays: 1,
    duplicates: 1,
    crashes: 1,
    stops: 1,
    total: 1,
    cycles: 4,
};
const NONE: Budget = Budget {
    losses: 0,
    delays: 0,
    duplicates: 0,
    crashes: 0,
    stops: 0,
    total: 0,
    cycles: 0,
};

/// Everything within the budget holds, in so many states.
fn check_all(understudies: usize, budget: Budget, states: usize) {
    let model = Model::new(parts(understudies), budget, &ALL).expect("it comes into step");
    let verdict = check(model, 2);
    assert_eq!(verdict.counterexamples, []);
    assert_eq!(
        verdict.states, states,
        "a protocol that has changed has other states"
    );
}

#[test]
fn one_of_each_in_four_cycles() {
    check_all(1, ONE, 22_876);
}

#[test]
fn one_of_each_with_two_understudies() {
    check_all(2, Budget { cycles: 3, ..ONE }, 16_095);
}

#[test]
fn two_losses_in_two_cycles() {
    let budget = Budget {
        losses: 2,
        total: 2,
        cycles: 2,
        ..NONE
    };
    check_all(1, budget, 10_395);
}

#[test]
fn a_crash_and_a_stop_in_two_cycles() {
    let budget = Budget {
        crashes: 1,
        stops: 1,
        total: 2,
        cycles: 2,
        ..NONE
    };
    check_all(1, budget, 410_228);
}

#[test]
fn a_crash_and_a_loss_in_two_cycles() {
    let budget = Budget {
        losses: 1,
        crashes: 1,
        total: 2,
        cycles: 2,
        ..NONE
    };
    check_all(1, budget, 75_083);
}

/// Without an understudy a lost station does cost a cycle: the checker finds it, and the simulator replays what it found.
#[test]
fn a_counterexample_is_found_and_replayed() {
    let model = || Model::new(parts(0), ONE, &ALL).expect("it comes into step");
    let verdict = check(model(), 1);
    let [example] = &verdict.counterexamples[..] else {
        panic!("{:?}", verdict.counterexamples);
    };
    assert_eq!(example.property, "one lost station costs no cycle");
    assert!(matches!(example.steps[0], Step::Crash(_) | Step::Stop(_)));
    let mut simulation = model().replay(&example.faults);
    simulation.go_to(10, 0.0, &mut |_, _, _, _| {});
    let untrue = |tally: &Tally| tally.held + tally.fail_safe > 0;
    assert!(simulation.tallies().iter().any(untrue));
    assert_eq!(simulation.violations(), []);
}
