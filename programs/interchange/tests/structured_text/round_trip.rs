//! What this project writes as Structured Text reads back as the same circuit.

use proptest::prelude::*;
use understudy_ladder::circuit_as_structured_text;
use understudy_logic::{Circuit, CircuitBuilder};

use crate::support::{PERIOD, program};
use understudy_logic::Running;
use understudy_testing::random::Dice;

/// A circuit with all operations and registers that read each other.
fn random_circuit(seed: u64) -> Circuit {
    let mut dice = Dice::new(seed);
    let mut builder = CircuitBuilder::new("circuit");
    let mut values = Vec::new();
    for index in 0..1 + dice.below(4) {
        values.push(builder.input(format!("in_{index}")));
    }
    let mut registers = Vec::new();
    for index in 0..dice.below(6) {
        let (register, value) = builder.register(format!("state.{index}"), dice.below(2) == 1);
        registers.push(register);
        values.push(value);
    }
    for _ in 0..dice.below(40) {
        let (left, right) = (values[dice.below(values.len())], values[dice.below(values.len())]);
        let graph = builder.graph();
        values.push(match dice.below(9) {
            0 => graph.constant(left < right),
            1 | 2 => graph.not(left),
            3 | 4 => graph.and(left, right),
            5 | 6 => graph.or(left, right),
            _ => graph.xor(left, right),
        });
    }
    for register in registers {
        let next = values[dice.below(values.len())];
        builder.set_next(register, next);
    }
    for index in 0..1 + dice.below(4) {
        let value = values[dice.below(values.len())];
        builder.output(format!("out_{index}"), value);
    }
    builder.finish().expect("names are unique")
}

fn check(circuit: &Circuit, seed: u64) {
    let text = circuit_as_structured_text(circuit, PERIOD);
    let again = program(&text);
    let names: Vec<&str> = again.inputs.iter().map(|signal| signal.name.as_str()).collect();
    assert_eq!(names, circuit.inputs());
    let lowered = again.lower(PERIOD).expect("a sound program");
    // What is read back remembers no more than what was written.
    assert!(lowered.registers().len() <= circuit.registers().len(), "{text}");
    let mut original = Running::new(circuit);
    let mut copy = Running::new(&lowered);
    let mut dice = Dice::new(seed);
    for scan in 0..32 {
        let inputs = dice.bits(circuit.inputs().len());
        assert_eq!(copy.step(&inputs), original.step(&inputs), "scan {scan}\n{text}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 150, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn random_circuits_come_back(seed: u64) {
        check(&random_circuit(seed), seed);
    }

    #[test]
    fn random_ladders_come_back(seed: u64) {
        let ladder = understudy_testing::random::random_program(seed, 6);
        check(&ladder.lower(PERIOD).expect("a sound program"), seed);
    }
}

#[test]
fn the_ladders_of_the_examples_come_back() {
    let ladders = [
        include_str!("../../../../examples/press-cell/robot.ladder"),
        include_str!("../../../../examples/press-cell/press.ladder"),
        include_str!("../../../../examples/boiler/main.ladder"),
        include_str!("../../../../examples/filling-line/filling-line.ladder"),
    ];
    for ladder in ladders {
        let (ladder, _) = understudy_ladder::parse(ladder).into_result().expect("a sound program");
        check(&ladder.lower(PERIOD).expect("a sound program"), 5);
    }
}
