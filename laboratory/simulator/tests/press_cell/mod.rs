//! The press cell of section V as parts of a simulation, from the ladders that the demo runs.
#![allow(dead_code, reason = "each test uses a part of it")]

use std::sync::Arc;
use std::time::Duration;

use understudy_cycle::{Agreement, Mode, Schedule};
use understudy_ladder::parse;
use understudy_logic::Circuit;
use understudy_plant::{ModelKind, Plant, PressParameters, RobotParameters, Signals};
use understudy_simulator::Parts;
use understudy_wire::{
    ClusterHash, ConfigurationHash, Epoch, Image, ProgramHash, ProgramId, StationId,
};

pub(crate) const PERIOD: Duration = Duration::from_millis(10);
pub(crate) const HOLD_CYCLES: u32 = 3;

/// Two programs, `understudies` understudies, two copies of each frame.
pub(crate) fn parts(mode: Mode, understudies: usize) -> Parts {
    line(2, mode, understudies)
}

/// A robot, the press that it feeds, a robot, and so on: `programs` in all.
pub(crate) fn line(programs: usize, mode: Mode, understudies: usize) -> Parts {
    let ladders = [
        include_str!("../../../../examples/press-cell/robot.ladder"),
        include_str!("../../../../examples/press-cell/press.ladder"),
    ];
    let circuits: Vec<Circuit> = (0..programs)
        .map(|program| circuit(ladders[program % 2]))
        .collect();
    let agreement = Arc::new(Agreement {
        cluster: ClusterHash(1),
        configuration: ConfigurationHash(2),
        schedule: Schedule::new(PERIOD, circuits.len(), understudies, 2).expect("within bounds"),
        mode,
        history: 8,
        flag_after: 3,
        shadow_cycles: 3,
        listen_cycles: 4,
    });
    let programs: Arc<[understudy_node::Program]> = circuits
        .iter()
        .zip(1..)
        .map(|(circuit, hash)| understudy_node::Program {
            hash: ProgramHash(hash),
            executable: circuit.into(),
        })
        .collect();
    let generated = (mode == Mode::Paper).then(|| {
        let generated =
            understudy_parity::generate(&circuits).expect("programs of different names");
        Arc::new(generated.circuit().into())
    });
    let stations = (0..circuits.len() + understudies).map(|rank| understudy_node::Settings {
        station: StationId(rank as u8),
        agreement: Arc::clone(&agreement),
        programs: Arc::clone(&programs),
        generated: generated.clone(),
        epoch: Epoch(0),
    });
    let remote_ios =
        programs
            .iter()
            .zip(0..)
            .map(|(program, index)| understudy_remote_io::Settings {
                program: ProgramId(index),
                agreement: Arc::clone(&agreement),
                hash: program.hash,
                inputs: program.executable.input_count(),
                channels: Vec::new(),
                stop: None,
                diagnosis: None,
                hold_cycles: HOLD_CYCLES,
                fail_safe: Image::zero(program.executable.output_count()),
                release: understudy_remote_io::Release::Automatic,
                value_fault: understudy_remote_io::ValueFault::Hold,
                stale_state: understudy_remote_io::StaleState::Operator,
            });
    let kinds = [
        ModelKind::Robot(RobotParameters::default()),
        ModelKind::Press(PressParameters::default()),
    ];
    let plants = circuits.iter().enumerate().map(|(program, circuit)| {
        let fed = program % 2 == 1;
        Plant::new(&kinds[program % 2], &circuit.into(), &Signals::new(), fed).0
    });
    let fed_by = (0..circuits.len() as u8).map(|program| match program % 2 {
        0 => None,
        _ => Some(ProgramId(program - 1)),
    });
    Parts {
        follows: vec![Vec::new(); circuits.len()],
        stations: stations.collect(),
        remote_ios: remote_ios.collect(),
        plants: plants.collect(),
        fed_by: fed_by.collect(),
    }
}

fn circuit(text: &str) -> Circuit {
    let parsed = parse(text);
    let program = parsed.into_result().expect("a ladder without errors").0;
    program.lower(PERIOD).expect("it lowers")
}
