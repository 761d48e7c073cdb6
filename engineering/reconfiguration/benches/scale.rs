//! How large a line may be: `cargo bench -p understudy-reconfiguration`.

use std::fmt::Write as _;
use std::time::Duration;

use understudy_ladder::{Program, parse};
use understudy_reconfiguration::command::Objective;
use understudy_reconfiguration::explore::{Bounds, explore};
use understudy_reconfiguration::{
    Analysis, Bits, Controller, Event, MegaController, Question, Relation, Row, Signals, State,
    analyse, project,
};

fn main() {
    divan::main();
}

/// The filling line from its files to the proof, two channels failed at once.
#[divan::bench(sample_count = 3)]
fn filling_line() {
    let open = |name: &str| {
        let text = match name {
            "plant.ladder" => include_str!("../../../examples/filling-line/plant.ladder"),
            _ => include_str!("../../../examples/filling-line/filling-line.ladder"),
        };
        Ok(text.to_owned())
    };
    let text = include_str!("../../../examples/filling-line/reconfiguration.toml");
    let project = project::read("p", text, &mut { open }).project.expect("it is right");
    assert!(analyse(&project).is_ok());
}

/// A ring of `states` states: in state k output k mod `channels` makes input k mod `channels` change.
fn ring(states: usize, channels: usize) -> (Controller, Relation) {
    let names = |letter: &str| (0..channels).map(|number| format!("{letter}{number}")).collect();
    let signals = Signals { inputs: names("i"), outputs: names("o") };
    let mut inputs = vec![false; channels];
    let mut all = Vec::new();
    for state in 0..states {
        let mut outputs = vec![false; channels];
        outputs[state % channels] = true;
        all.push(State {
            inputs: Bits(inputs.clone()),
            outputs: Bits(outputs),
            memory: Vec::new(),
            sibling: (state / (2 * channels)) as u32,
        });
        inputs[state % channels] ^= true;
    }
    let moves = (0..states).map(|state| (state, (state + 1) % states));
    let controller = Controller::new(signals, Vec::new(), all, moves);
    let mut relation = Relation::new(states);
    for state in 0..states {
        for output in 0..channels {
            let mut row = vec![None; channels];
            row[output] = Some(true);
            for event in [Event::Rises(output), Event::Falls(output)] {
                relation.set(state, event, [Row(row.clone())].into());
            }
        }
    }
    (controller, relation)
}

/// 2,000 states, 8 channels, any two of them failed.
#[divan::bench(sample_count = 1)]
fn a_line_of_two_thousand_states() {
    let (controller, relation) = ring(2000, 8);
    let question = Question {
        channels: (0..8).collect(),
        simultaneous: 2,
        analysis: Analysis::Late,
        objective: Objective::Fewest,
        maximum_states: 1_000_000,
    };
    let mega = MegaController::build(&controller, &relation, &question).expect("commands");
    assert!(mega.states.len() > 2000 * 37);
}

/// 64 stations in a ring, each with a sensor, a drive, and 31 rungs that count, interlock and pass the part on.
fn long_program() -> (Program, Program) {
    const STATIONS: usize = 64;
    let mut ladder = String::from("program long\n");
    let mut plant = String::from("program plant\n");
    for station in 0..STATIONS {
        let _ = writeln!(
            ladder,
            "input s{station}\noutput y{station}\nmemory step{station} = {}",
            u8::from(station == 0)
        );
        let _ = writeln!(plant, "input y{station}\noutput s{station}");
        for place in 0..28 {
            let _ = writeln!(ladder, "memory m{station}.{place} = 0");
        }
    }
    for station in 0..STATIONS {
        let next = (station + 1) % STATIONS;
        let _ =
            writeln!(ladder, "rung\n  step{station} s{station} (S step{next}) (R step{station})");
        let _ = writeln!(ladder, "rung\n  step{station} /s{station} ( m{station}.0 )");
        for place in 1..28 {
            let _ = writeln!(
                ladder,
                "rung\n  [ m{station}.{} | s{next} step{next} ] ( m{station}.{place} )",
                place - 1
            );
        }
        let _ = writeln!(
            ladder,
            "rung\n  m{station}.27 {{TON t{station} 50ms}}\nrung\n  t{station}.Q step{station} ( y{station} )"
        );
        let _ = writeln!(plant, "rung\n  y{station} {{TON d{station} 100ms}} ( s{station} )");
    }
    (parse(&ladder).into_result().expect("right").0, parse(&plant).into_result().expect("right").0)
}

/// 2,000 rungs and 64 inputs, explored as far as the plant goes.
#[divan::bench(sample_count = 1)]
fn a_ladder_of_two_thousand_rungs() {
    let (ladder, plant) = long_program();
    assert!(ladder.rungs.len() >= 1984);
    let period = Duration::from_millis(10);
    let memory: Vec<String> = ladder.memory.iter().map(|signal| signal.name.to_string()).collect();
    let explored = explore(
        &ladder.lower(period).expect("a circuit"),
        &plant.lower(period).expect("a circuit"),
        &memory,
        Bounds::default(),
    );
    let explored = explored.expect("it is explored");
    assert!(explored.controller.states().len() >= 3 * 64);
}
