//! Ladders and Structured Text made from circuits.

use proptest::prelude::*;
use understudy_ladder::{circuit_as_structured_text, from_circuit, parse, print, structured_text};
use understudy_logic::{Circuit, CircuitBuilder};

use crate::structured_text_reader::StructuredText;
use crate::support::{PERIOD, program};
use understudy_logic::Running;
use understudy_testing::random::{Dice, random_program};

/// A circuit with all operations and registers that read each other.
fn random_circuit(seed: u64) -> Circuit {
    let mut dice = Dice::new(seed);
    let mut builder = CircuitBuilder::new("Random circuit");
    let mut values = Vec::new();
    for index in 0..1 + dice.below(4) {
        values.push(builder.input(format!("in.{index}")));
    }
    let mut registers = Vec::new();
    for index in 0..dice.below(6) {
        let (register, value) = builder.register(format!("in.{index}"), dice.rarely(2));
        registers.push(register);
        values.push(value);
    }
    for _ in 0..dice.below(40) {
        let (left, right) = (dice.pick(&values), dice.pick(&values));
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
        builder.set_next(register, dice.pick(&values));
    }
    for index in 0..1 + dice.below(4) {
        builder.output(format!("{index} out__"), dice.pick(&values));
    }
    builder.finish().expect("names are unique")
}

fn check(circuit: &Circuit, seed: u64) {
    let ladder = from_circuit(circuit);
    let text = print(&ladder);
    let parsed = parse(&text);
    assert!(!understudy_text::has_errors(&parsed.diagnostics), "{:#?}\n{text}", parsed.diagnostics);
    assert_eq!(parsed.program, ladder, "{text}");
    let lowered = ladder.lower(PERIOD).expect("a sound program");
    let source = circuit_as_structured_text(circuit, PERIOD);
    let mut assignments = StructuredText::read(&source);
    let mut original = Running::new(circuit);
    let mut again = Running::new(&lowered);
    let mut dice = Dice::new(seed);
    for scan in 0..24 {
        let inputs = dice.bits(circuit.inputs().len());
        let expected = original.step(&inputs);
        assert_eq!(again.step(&inputs), expected, "scan {scan}\n{text}");
        assert_eq!(assignments.execute(&inputs), expected, "execution {scan}\n{source}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 300, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn random_circuits_come_back(seed: u64) {
        check(&random_circuit(seed), seed);
    }

    #[test]
    fn random_programs_come_back_through_their_circuits(seed: u64) {
        check(&random_program(seed, 6).lower(PERIOD).expect("a sound program"), seed);
    }
}

fn robot() -> Circuit {
    program(include_str!("../../../../examples/press-cell/robot.ladder"))
        .lower(PERIOD)
        .expect("a sound program")
}

#[test]
fn the_robot_as_a_generated_ladder() {
    let ladder = from_circuit(&robot());
    insta::assert_snapshot!(print(&ladder));
    let lowered = ladder.lower(PERIOD).expect("a sound program");
    let names = |circuit: &Circuit| -> Vec<String> {
        let registers = circuit.registers().iter();
        registers.map(|register| register.name.clone()).collect()
    };
    assert_eq!(names(&lowered), names(&robot()));
}

#[test]
fn the_robot_as_structured_text() {
    let program = program(include_str!("../../../../examples/press-cell/robot.ladder"));
    insta::assert_snapshot!(structured_text(&program, PERIOD));
}

/// Two registers that exchange their values, and a third that adds them up.
fn exchange() -> Circuit {
    let mut builder = CircuitBuilder::new("exchange");
    let load = builder.input("Load");
    let (first, a) = builder.register("a", true);
    let (second, b) = builder.register("b", false);
    let (third, sum) = builder.register("sum", false);
    let graph = builder.graph();
    let both = graph.xor(a, b);
    let total = graph.xor(both, sum);
    let next = graph.or(load, b);
    builder.set_next(first, next);
    builder.set_next(second, a);
    builder.set_next(third, total);
    builder.output("LOAD", total);
    builder.output("or", both);
    builder.finish().expect("names are unique")
}

#[test]
fn registers_that_read_each_other_are_held() {
    check(&exchange(), 7);
    insta::assert_snapshot!(print(&from_circuit(&exchange())));
    insta::assert_snapshot!(circuit_as_structured_text(&exchange(), PERIOD));
}

#[test]
fn long_expressions_are_cut_and_lines_are_short() {
    let mut builder = CircuitBuilder::new("long");
    let inputs: Vec<_> = (0..500)
        .map(|index| builder.input(format!("a_rather_long_name_of_an_input_{index}")))
        .collect();
    let sum = builder.graph().sum(inputs.iter().copied());
    let product = builder.graph().all(inputs.iter().copied());
    builder.output("sum", sum);
    builder.output("product", product);
    let circuit = builder.finish().expect("names are unique");
    check(&circuit, 1);
    let text = circuit_as_structured_text(&circuit, PERIOD);
    let longest = text.lines().map(str::len).max();
    assert!(longest <= Some(100), "{longest:?}");
    let ladder = print(&from_circuit(&circuit));
    let longest = ladder.lines().map(str::len).max();
    assert!(longest <= Some(110), "{longest:?}");
}
