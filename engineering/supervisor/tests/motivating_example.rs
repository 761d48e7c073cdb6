//! The motivating example of the thesis: its tables row by row, its ladder, and the proof of both modes.

use understudy_ladder::{Program, check, parse, print};
use understudy_supervisor::ladder::{
    Conversion, InputOutputMap, Mode, Modules, Partition, convert, omega, read_map, table,
};
use understudy_supervisor::proof::{Deviation, ProofSettings, Verdict, prove};
use understudy_supervisor::{Automaton, read_ads};

fn example() -> (Automaton, InputOutputMap) {
    let automaton = read_ads(include_str!("../../../examples/motivating-example/supervisor.ADS"));
    assert_eq!(automaton.diagnostics, []);
    let map = read_map(include_str!("../../../examples/motivating-example/map.toml"));
    assert_eq!(map.diagnostics, []);
    let map = map.map.expect("a map without findings");
    let automaton = automaton.automaton.expect("an automaton without findings");
    (map.name_events(automaton), map)
}

fn conversion(mode: Mode) -> Conversion {
    let (automaton, map) = example();
    convert(&Modules::supervisor(&automaton), &map, mode).expect("the map fits")
}

fn rows(mode: Mode) -> String {
    let (automaton, map) = example();
    let partition = Partition::new(&map, &Modules::supervisor(&automaton)).expect("it fits");
    table(&automaton, &omega(&automaton, &map, &partition, mode))
}

fn verdict(program: &Program, conversion: &Conversion, mode: Mode) -> Verdict {
    let (automaton, map) = example();
    let settings = ProofSettings { mode, ..ProofSettings::default() };
    let modules = Modules::supervisor(&automaton);
    prove(program, &modules, &map, &conversion.correspondence, settings).expect("a verdict")
}

#[test]
fn table_3_1() {
    insta::assert_snapshot!(rows(Mode::Automatic));
}

#[test]
fn table_3_2_replaces_rungs_4_and_5() {
    insta::assert_snapshot!(rows(Mode::Manual));
}

#[test]
fn the_ladder_reads_like_the_table() {
    insta::assert_snapshot!(print(&conversion(Mode::Manual).program));
}

#[test]
fn the_ladder_is_one_without_warnings() {
    for mode in [Mode::Automatic, Mode::Manual, Mode::Requested] {
        let program = conversion(mode).program;
        assert_eq!(check(&program), []);
        assert_eq!(parse(&print(&program)).into_result().map(|(again, _)| again), Ok(program));
    }
}

/// Where the PLC acts by itself it never rests in the states 2, 6 and 8, which its next command leaves in the same scan.
#[test]
fn every_mode_is_proved() {
    for (mode, states) in [(Mode::Automatic, 7), (Mode::Manual, 8), (Mode::Requested, 10)] {
        let conversion = conversion(mode);
        match verdict(&conversion.program, &conversion, mode) {
            Verdict::Proved(proof) => {
                assert_eq!(proof.joint_states, states);
                let events = if mode == Mode::Automatic { 8 } else { 9 };
                assert_eq!(proof.events.len(), events, "{:?}", proof.events);
            }
            Verdict::Refuted(counterexample) => panic!("{mode:?}:\n{counterexample}"),
        }
    }
}

/// The thesis's own rungs, in the order of Table 3.1 and without anything against the avalanche effect: b goes from state 1 by
/// way of two commands to state 5, and the plant has not seen either command when it is taken for the answer to them.
#[test]
fn the_rungs_of_the_thesis_run_away() {
    let conversion = conversion(Mode::Automatic);
    let mut program = conversion.program.clone();
    for rung in &mut program.rungs {
        rung.network.retain(|element| !format!("{element:?}").contains("commanded"));
    }
    program.rungs.sort_by_key(|rung| {
        let title = rung.title.clone().unwrap_or_default();
        title.split(':').next().and_then(|number| number.parse().ok()).unwrap_or(0_u32)
    });
    let Verdict::Refuted(counterexample) = verdict(&program, &conversion, Mode::Automatic) else {
        panic!("proved");
    };
    assert_eq!(counterexample.deviation, Deviation::NotAllowed);
    insta::assert_snapshot!(counterexample);
}
