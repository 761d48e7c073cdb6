//! Warm starts in any scans: the circuit that can be restarted does what the program does that is restarted.

use proptest::prelude::*;
use understudy_bits::{Exact, Inexact, POWER_RETURNS, Shown};
use understudy_logic::{Circuit, Running};
use understudy_structured_text::parse;
use understudy_testing::random::Dice;
use understudy_typed::{Fault, Interpreter, Program};

use crate::execution::typed;
use crate::random::text;

const RESTARTING: Shown<'_> =
    Shown { variables: &[], compared: &[], keeps_all: false, restarts: true };

/// Compares the scans of a circuit with those of a program that is restarted warm where the last input is TRUE; how often that changed its state.
fn check(what: &str, circuit: &Circuit, typed: &Program, seed: u64) -> usize {
    let width = circuit.inputs().len() - 1;
    assert_eq!(circuit.inputs()[width], POWER_RETURNS, "{what}");
    let names = typed.inputs.bit_names();
    let outputs = typed.outputs.bit_names();
    let into = circuit.inputs()[..width].iter();
    let into = into.map(|name| names.iter().position(|it| it == name).expect("an input"));
    let into: Vec<usize> = into.collect();
    let interpreter = Interpreter::new(typed);
    let mut state = interpreter.initial().to_vec();
    let mut running = Running::new(circuit);
    let mut dice = Dice::new(seed);
    let mut bits = dice.bits(width);
    let mut changed = 0;
    for scan in 0..300 {
        // Inputs stay for a while, so that timers run out.
        if scan % 7 == 0 || scan > 200 {
            bits = dice.bits(width);
        }
        let restarts = dice.rarely(9);
        if restarts {
            let restarted = typed.restarted(&state);
            changed += usize::from(restarted != state);
            state = restarted;
            assert_eq!(Fault::read(&state), None, "a fault is not retentive");
        }
        let mut image = vec![0; typed.inputs.width().div_ceil(64)];
        for (place, bit) in into.iter().zip(&bits) {
            image[place / 64] |= u64::from(*bit) << (place % 64);
        }
        let mut found = bits.clone();
        found.push(restarts);
        let found = running.step(&found);
        let mut expected = vec![0; typed.outputs.width().div_ceil(64)];
        interpreter.step(&mut state, &image, &mut expected);
        for (output, found) in circuit.outputs().iter().zip(found) {
            let place = outputs.iter().position(|it| *it == output.name).expect("an output");
            let expected = expected[place / 64] >> (place % 64) & 1 == 1;
            assert_eq!(found, expected, "`{}` in scan {scan}: {what}", output.name);
        }
    }
    changed
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 100, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn a_circuit_restarts_as_its_program(seed: u64) {
        let mut dice = Dice::new(seed);
        let source = text::Text::random(&mut dice).to_string();
        let mut typed = typed(&source, &parse(&source).0).expect("a sound program");
        let inputs: Vec<u32> = typed.inputs.iter().map(|point| point.slot).collect();
        let mut kept = Vec::new();
        for variable in typed.variables.clone() {
            if !inputs.contains(&variable.slot) && dice.rarely(2) {
                typed.retain(variable.slot..variable.slot + variable.of.slots() as u32);
                kept.push(variable.name);
            }
        }
        prop_assume!(typed.is_retentive());
        match Exact::new(&typed, RESTARTING) {
            Ok(exact) => {
                check(&format!("retentive {kept:?}\n{source}"), &exact.circuit, &typed, seed);
            }
            Err(Inexact::Unsupported(_)) => prop_assume!(false),
            Err(gaps) => panic!("{gaps}\n{source}"),
        }
    }
}

/// Timers and moments that are and are not retentive, in one program.
#[test]
fn times_go_on_over_a_restart() {
    let text = "PROGRAM main
      VAR_INPUT a, b : BOOL; END_VAR
      VAR_OUTPUT y, z, w, q, r : BOOL; END_VAR
      VAR RETAIN kept : TON; since : TIME; n : INT (0..3); END_VAR
      VAR lost : TON; begun : TIME; m : INT (0..3); end; END_VAR
      kept(IN := a, PT := T#1s); lost(IN := a, PT := T#1s);
      y := kept.Q; z := lost.Q;
      IF b THEN since := TIME(); begun := TIME(); END_IF;
      w := TIME() - since >= T#700ms; q := TIME() - begun >= T#500ms;
      r := n > m;
      IF a THEN n := (n + 1) MOD 4; m := (m + 1) MOD 4; END_IF;
    END_PROGRAM"
        .replace(" end;", "");
    let (file, _) = parse(&text);
    let typed = typed(&text, &file).expect("a program");
    assert_eq!(typed.retentive_names(), ["kept", "since", "n"]);
    let exact = Exact::new(&typed, RESTARTING).expect("a circuit");
    for seed in 0..20 {
        assert!(check(&text, &exact.circuit, &typed, seed) > 5);
    }
}
