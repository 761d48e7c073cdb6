//! The code does what the scan does, bit for bit.

use std::time::Duration;

use proptest::prelude::*;
use understudy_ladder::Interpreter;
use understudy_logic::{Circuit, CircuitBuilder, Expression, Graph, Scan, Scratch};
use understudy_native::{Machine, sample};

#[path = "../../ladder/tests/ladder/random.rs"]
#[allow(dead_code, reason = "made for the tests of another crate")]
mod random;

use random::{Dice, random_program};

const PERIOD: Duration = Duration::from_millis(100);

/// 64 runs of `steps` steps by the machine and by [`Scan`]; answers with the inputs and outputs of each step.
fn check(circuit: &Circuit, dice: &mut Dice, steps: usize) -> Vec<(Vec<u64>, Vec<u64>)> {
    let machine = Machine::new(circuit).expect("a code generator for this processor");
    let scan = Scan::new(circuit);
    let mut frame = machine.frame();
    let mut scratch = Scratch::default();
    let initial = circuit.registers().iter();
    let mut state: Vec<u64> = initial
        .map(|register| u64::from(register.initial).wrapping_neg())
        .collect();
    let mut outputs = vec![0; circuit.outputs().len()];
    let mut told = Vec::new();
    for step in 0..steps {
        let inputs: Vec<u64> = circuit.inputs().iter().map(|_| dice.next()).collect();
        frame.inputs().copy_from_slice(&inputs);
        machine.step(&mut frame);
        scan.step_lanes(&mut scratch, &mut state, &inputs, &mut outputs);
        assert_eq!(frame.outputs(), outputs, "outputs of step {step}");
        assert_eq!(frame.registers(), state, "registers after step {step}");
        assert_eq!(frame.inputs(), inputs, "inputs are left alone");
        told.push((inputs, outputs.clone()));
    }
    told
}

proptest! {
    #[test]
    fn ladders(seed: u64) {
        let program = random_program(seed, 8);
        let circuit = program.lower(PERIOD).expect("a sound program");
        let told = check(&circuit, &mut Dice::new(seed), 24);
        for lane in [0, 17, 63] {
            let mut interpreter = Interpreter::new(&program, PERIOD).expect("a sound program");
            let bits = |words: &[u64]| -> Vec<bool> { words.iter().map(|word| word >> lane & 1 == 1).collect() };
            for (inputs, outputs) in &told {
                prop_assert_eq!(interpreter.scan(&bits(inputs)), bits(outputs));
            }
        }
    }

    #[test]
    fn circuits(seed: u64, operations in 0_usize..120) {
        let mut dice = Dice::new(seed);
        let circuit = random_circuit(&mut dice, operations);
        check(&circuit, &mut dice, 8);
    }
}

/// Any operations on anything, and roots that may be constants, inputs, other registers, or each other's negation.
fn random_circuit(dice: &mut Dice, operations: usize) -> Circuit {
    let mut builder = CircuitBuilder::new("random");
    let mut values: Vec<Expression> = Vec::new();
    for constant in [false, true] {
        values.push(builder.graph().constant(constant));
    }
    for input in 0..dice.below(4) {
        values.push(builder.input(format!("u{input}")));
    }
    let mut registers = Vec::new();
    for register in 0..dice.below(6) {
        let (register, value) = builder.register(format!("x{register}"), dice.rarely(2));
        registers.push(register);
        values.push(value);
    }
    for _ in 0..operations {
        let (left, right) = (dice.pick(&values), dice.pick(&values));
        let graph = builder.graph();
        values.push(match dice.below(4) {
            0 => graph.not(left),
            1 => graph.and(left, right),
            2 => graph.or(left, right),
            _ => graph.xor(left, right),
        });
    }
    for register in registers {
        let next = dice.pick(&values);
        builder.set_next(register, next);
    }
    for output in 0..dice.below(5) {
        let value = dice.pick(&values);
        builder.output(format!("y{output}"), value);
    }
    builder.finish().expect("names are numbered")
}

/// Every pair of next-state functions from a list, with one of the functions as output: which old value is overwritten when is all there is to it.
#[test]
fn two_registers() {
    type Function = fn(&mut Graph, [Expression; 3]) -> Expression;
    let functions: [Function; 9] = [
        |graph, _| graph.constant(true),
        |_, [u, _, _]| u,
        |_, [_, a, _]| a,
        |_, [_, _, b]| b,
        |graph, [_, a, _]| graph.not(a),
        |graph, [_, _, b]| graph.not(b),
        |graph, [u, a, _]| graph.or(u, a),
        |graph, [_, a, b]| graph.xor(a, b),
        |graph, [u, a, b]| {
            let both = graph.and(a, b);
            let none = graph.not(both);
            graph.and(none, u)
        },
    ];
    for first in functions {
        for second in functions {
            for shown in functions {
                let mut builder = CircuitBuilder::new("two");
                let u = builder.input("u");
                let (a, a_value) = builder.register("a", false);
                let (b, b_value) = builder.register("b", true);
                let values = [u, a_value, b_value];
                let [first, second, shown] =
                    [first, second, shown].map(|function| function(builder.graph(), values));
                builder.set_next(a, first);
                builder.set_next(b, second);
                builder.output("y", shown);
                let circuit = builder.finish().expect("different names");
                // Lanes hold every sequence of six inputs.
                let machine = Machine::new(&circuit).expect("a code generator");
                let mut frame = machine.frame();
                let mut state = [0, u64::MAX];
                let scan = Scan::new(&circuit);
                let mut scratch = Scratch::default();
                for step in 0..6 {
                    let word = (0..64).fold(0, |word, lane: u64| word | (lane >> step & 1) << lane);
                    let mut output = [0];
                    frame.inputs()[0] = word;
                    machine.step(&mut frame);
                    scan.step_lanes(&mut scratch, &mut state, &[word], &mut output);
                    assert_eq!(frame.registers(), state);
                    assert_eq!(frame.outputs(), output);
                }
            }
        }
    }
}

#[test]
fn many_rungs() {
    let circuit = sample::program(&sample::rungs(700, 1));
    check(&circuit, &mut Dice::new(7), 20);
}

#[test]
fn a_rung_of_many_contacts() {
    let mut builder = CircuitBuilder::new("long");
    let inputs: Vec<Expression> = (0..5_000)
        .map(|input| builder.input(format!("u{input}")))
        .collect();
    let sum = builder.graph().sum(inputs.iter().copied());
    let any = builder.graph().any(inputs.iter().rev().copied());
    let not_any = builder.graph().not(any);
    builder.output("sum", sum);
    builder.output("none", not_any);
    let circuit = builder.finish().expect("names are numbered");
    check(&circuit, &mut Dice::new(3), 3);
}

#[test]
fn nothing_to_do() {
    let circuit = CircuitBuilder::new("empty").finish().expect("no names");
    check(&circuit, &mut Dice::new(0), 2);
}

#[test]
fn machines_come_and_go() {
    let circuit = sample::program(&sample::rungs(20, 5));
    for seed in 0..50 {
        check(&circuit, &mut Dice::new(seed), 2);
    }
}
