//! Two programs with plants, as small as they can be.

use std::sync::Arc;
use std::time::Duration;

use understudy_cycle::{
    Agreement, Conversion, FallbackChange, Layout, Mode, Moved, OnlineChange, PointsChange,
    Program, ProgramChange, Schedule, Turns,
};
use understudy_logic::{Circuit, CircuitBuilder};
use understudy_plant::{ModelKind, Plant, Signals};
use understudy_remote_io::{
    Fallback, PairSettings, PairedInput, PointPlace, Release, SharedOutputs, StaleState,
    ValueFault, Wiring,
};
use understudy_simulator::Parts;
use understudy_typed::Elementary;
use understudy_wire::{
    ClusterHash, ConfigurationHash, Image, Moment, ProgramHash, ProgramId, ProgramSet, StationId,
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

/// [`program`] with an output of eight bits, of which one changes.
fn number() -> Circuit {
    let mut builder = CircuitBuilder::new("program");
    let u = builder.input("u");
    let (older, was) = builder.register("x1", false);
    let (newer, is) = builder.register("x0", true);
    let mixed = builder.graph().xor(was, u);
    builder.set_next(newer, mixed);
    builder.set_next(older, is);
    let never = builder.graph().constant(false);
    for bit in 0..8 {
        match bit {
            2 => builder.output("y", mixed),
            _ => builder.output(format!("y{bit}"), never),
        }
    }
    builder.finish().expect("a circuit")
}

/// [`program`] with the output negated, and with one more register that is set.
fn changed() -> Circuit {
    negated(false)
}

/// [`changed`], and where it has more points one more input and one more output, which are the first ones: each point of before has another place.
fn negated(has_more_points: bool) -> Circuit {
    let mut builder = CircuitBuilder::new("program");
    let v = has_more_points.then(|| builder.input("v"));
    let u = builder.input("u");
    let (older, was) = builder.register("x1", false);
    let (newer, is) = builder.register("x0", true);
    let (more, set) = builder.register("x2", false);
    let mixed = builder.graph().xor(was, u);
    builder.set_next(newer, mixed);
    builder.set_next(older, is);
    builder.set_next(more, set);
    let negated = builder.graph().xor(mixed, set);
    if let Some(v) = v {
        let other = builder.graph().xor(is, v);
        builder.output("w", other);
    }
    builder.output("y", negated);
    builder.finish().expect("a circuit")
}

/// Sets the register that the changed program has more, or leaves it out.
#[derive(Debug)]
struct MoreRegisters(bool);

impl Conversion for MoreRegisters {
    fn release(&self, _: &mut [u64], _: &[u64]) {}

    fn convert(&self, state: &[u64]) -> Vec<u64> {
        vec![state[0] & 0b11 | u64::from(self.0) << 2]
    }
}

/// The change of the first program, and of the hold time and the fail-safe value of its remote I/O.
fn change(before: &Program, configuration: ConfigurationHash) -> OnlineChange {
    let after = Program { hash: ProgramHash(3), executable: (&changed()).into() };
    let program = ProgramChange {
        program: ProgramId(0),
        before: before.clone(),
        after,
        forward: Arc::new(MoreRegisters(true)),
        back: Arc::new(MoreRegisters(false)),
        points: None,
        known_by: [Layout::booleans(1, 1).hash; 2],
    };
    let after = Fallback { hold_cycles: 2, fail_safe: Image::from_bits([true]), ..fallback() };
    let fallback = FallbackChange { program: ProgramId(0), before: fallback(), after };
    OnlineChange {
        before: configuration,
        after: ConfigurationHash(4),
        programs: vec![program],
        fallbacks: vec![fallback],
    }
}

/// What both remote I/Os do where nothing is proved, before the change.
fn fallback() -> Fallback {
    Fallback {
        hold_cycles: 1,
        trial_cycles: 0,
        fail_safe: Image::zero(1),
        ramps: Vec::new(),
        release: Release::Automatic,
        value_fault: ValueFault::Hold,
        stale_state: StaleState::Operator,
        restart: None,
    }
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

/// One program with two remote I/Os, a controller and an understudy.
pub(crate) fn paired(wiring: Wiring) -> Parts {
    let mut parts = cell(&[program(false)], (1, 0), Turns::Token);
    for remote_io in &mut parts.remote_ios {
        remote_io.pair = Some(PairSettings { wiring, ..PairSettings::exclusive(1) });
        remote_io.paired_inputs = PairedInput::exact(&remote_io.layout.input_points);
    }
    parts
}

/// The same with a direct link between the two.
pub(crate) fn linked(wiring: Wiring) -> Parts {
    Parts { direct_links: ProgramSet::first(1), ..paired(wiring) }
}

/// The same as [`paired`] where the output is a number that modules of both drive together: 4 or 0, so that two halves are 4, and anything more is found.
pub(crate) fn sharing() -> Parts {
    let mut parts = cell(&[number()], (1, 0), Turns::Token);
    parts.change = None;
    for remote_io in &mut parts.remote_ios {
        let wiring = Wiring::Parallel { discrepancy_cycles: 2 };
        remote_io.pair = Some(PairSettings { wiring, ..PairSettings::exclusive(1) });
        remote_io.paired_inputs = PairedInput::exact(&remote_io.layout.input_points);
        let places = vec![PointPlace { bit: 0, of: Elementary::Usint }];
        Arc::make_mut(&mut remote_io.layout).output_points.clone_from(&places);
        remote_io.shared_outputs = SharedOutputs { places, delay: 0 };
        remote_io.fallback.fail_safe = Image::zero(8);
    }
    parts
}

/// Two programs.
pub(crate) fn parts(understudies: usize, turns: Turns) -> Parts {
    parts_with_spares(understudies, 0, turns)
}

/// Two programs, of which the first one has no plant, and other points after the change.
pub(crate) fn repointing() -> Parts {
    let mut parts = parts(1, Turns::Token);
    parts.plants[0] = None;
    let mut change = OnlineChange::clone(parts.change.as_ref().expect("a change"));
    let place = |bit| PointPlace { bit, of: Elementary::Bool };
    let moved = vec![Moved { before: place(0), after: place(1) }];
    let program = &mut change.programs[0];
    program.after.executable = (&negated(true)).into();
    program.points = Some(Arc::new(PointsChange {
        before: Arc::clone(&parts.remote_ios[0].layout),
        after: Arc::new(Layout::booleans(2, 2)),
        inputs: moved.clone(),
        outputs: moved,
    }));
    change.fallbacks[0].after.fail_safe = Image::from_bits([true, true]);
    parts.change = Some(Arc::new(change));
    parts
}

/// Two programs with slots of spares, which are understudies of the last ranks.
pub(crate) fn parts_with_spares(understudies: usize, spares: usize, turns: Turns) -> Parts {
    cell(&[program(false), program(true)], (understudies, spares), turns)
}

/// The limits of the protocol are as low as they can be, so that a few cycles pass all of them.
fn cell(circuits: &[Circuit], (understudies, spares): (usize, usize), turns: Turns) -> Parts {
    let first_slot = circuits.len() + understudies;
    let stations = first_slot + spares;
    let slots = (first_slot..stations).map(|rank| StationId(rank as u8)).collect();
    let agreement = Arc::new(Agreement {
        cluster: ClusterHash(1),
        configuration: ConfigurationHash(2),
        schedule: Schedule::new(PERIOD, circuits.len(), understudies + spares, 1)
            .expect("within bounds")
            .with_turns(turns)
            .with_spare_slots(slots),
        mode: Mode::Full,
        history: 2,
        flag_after: 1,
        shadow_cycles: 1,
        listen_cycles: 1,
    });
    let programs: Arc<[Program]> = circuits
        .iter()
        .zip(1..)
        .map(|(circuit, hash)| Program { hash: ProgramHash(hash), executable: circuit.into() })
        .collect();
    let stations = (0..stations).map(|rank| understudy_node::Settings {
        station: StationId(rank as u8),
        agreement: Arc::clone(&agreement),
        programs: Arc::clone(&programs),
        generated: None,
        founds: Moment::default(),
    });
    let remote_ios = programs.iter().zip(0..);
    let remote_ios = remote_ios.map(|(program, index)| understudy_remote_io::Settings {
        program: ProgramId(index),
        agreement: Arc::clone(&agreement),
        hash: program.hash,
        layout: Arc::new(Layout::booleans(1, 1)),
        diagnosis: None,
        fallback: fallback(),
        pair: None,
        paired_inputs: Vec::new(),
        shared_outputs: SharedOutputs::default(),
    });
    let plants = circuits.iter().map(|circuit| {
        let kind = ModelKind::Program(Box::new((&plant()).into()));
        Plant::new(&kind, &circuit.into(), &Signals::new(), false).0
    });
    Parts {
        stations: stations.collect(),
        remote_ios: remote_ios.collect(),
        plants: plants.collect(),
        fed_by: vec![None; circuits.len()],
        follows: vec![Vec::new(); circuits.len()],
        has_two_networks: false,
        direct_links: ProgramSet::EMPTY,
        change: Some(Arc::new(change(&programs[0], agreement.configuration))),
    }
}
