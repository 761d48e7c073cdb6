//! Warm starts in any scans: the circuit that can be restarted does what the program does that is restarted.

use proptest::prelude::*;
use understudy_bits::{Exact, Inexact, POWER_RETURNS, Shown};
use understudy_logic::{Circuit, Running};
use understudy_structured_text::parse;
use understudy_testing::random::Dice;
use understudy_typed::{Fault, Interpreter, Program};

use crate::execution::typed;
use crate::random::{is_outside, text};
use crate::support::found;

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
        prop_assume!(!found(&source).iter().any(is_outside));
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

/// Blocks, structures and instances of instances with retentive parts at random, in Structured Text and in PLCopen XML and back: the same parts are
/// retentive.
#[test]
fn retentive_parts_come_back_from_every_form() {
    use understudy_interchange::{Bodies, Format, Source, Wanted, read_source, typed_text};

    let names = |name: &str, text: &str| {
        let found = read_source(name, text, Wanted::default());
        match found.source {
            Some(Source::Program(program)) => {
                let mut names = program.retentive_names();
                names.sort_unstable();
                names
            }
            other => panic!("{other:?} {:?}\n{text}", found.diagnostics),
        }
    };
    let mut different = std::collections::BTreeSet::new();
    for seed in 0..60 {
        let mut dice = Dice::new(seed);
        let word = |dice: &mut Dice| dice.pick(&["", " RETAIN", " NON_RETAIN", " PERSISTENT"]);
        let [a, b, c, d, e, f, g, h] = std::array::from_fn(|_| word(&mut dice));
        let text = format!(
            "TYPE pair : STRUCT x : REAL; z : BOOL; END_STRUCT; END_TYPE
             FUNCTION_BLOCK inner VAR_INPUT i : BOOL; END_VAR VAR_OUTPUT{a} o : REAL; END_VAR
               VAR{b} t : TON; END_VAR VAR{c} n : INT; END_VAR
               t(IN := i, PT := T#1s); n := n + 1; o := INT_TO_REAL(n); END_FUNCTION_BLOCK
             FUNCTION_BLOCK outer VAR_INPUT i : BOOL; END_VAR VAR{d} one, two : inner; END_VAR
               one(i := i); two(i := NOT i); END_FUNCTION_BLOCK
             PROGRAM p VAR_INPUT i : BOOL; END_VAR VAR_OUTPUT{e} y : REAL; END_VAR
               VAR{f} all : outer; s : pair; END_VAR VAR{g} k : ARRAY [1..2] OF INT; END_VAR
               VAR_EXTERNAL w : INT; END_VAR
               all(i := i); k[1] := k[1] + 1; w := w + k[1]; s.x := s.x + 1.0;
               y := all.one.o + s.x + INT_TO_REAL(w); END_PROGRAM
             CONFIGURATION q VAR_GLOBAL{h} w : INT; END_VAR
               RESOURCE r ON plc TASK t(INTERVAL := T#10ms, PRIORITY := 0); PROGRAM p1 WITH t : p;
               END_RESOURCE END_CONFIGURATION"
        );
        let wanted = names("p.st", &text);
        let mut now = ("p.st", text);
        for (to, name) in [
            (Format::PlcOpen, "p.xml"),
            (Format::StructuredText, "p.st"),
            (Format::StructuredText, "p.st"),
            (Format::PlcOpen, "p.xml"),
        ] {
            let written = typed_text(now.0, &now.1, Wanted::default(), to, Bodies::AsRead);
            let (written, found) = written.unwrap_or_else(|error| panic!("{error}\n{}", now.1));
            now = (name, written.unwrap_or_else(|| panic!("{found:?}\n{}", now.1)).text);
            assert_eq!(names(now.0, &now.1), wanted, "{}", now.1);
        }
        different.insert(wanted);
    }
    assert!(different.len() > 40, "{}", different.len());
}

/// What files of TwinCAT declare.
#[test]
fn files_of_twincat_say_what_is_retentive() {
    use understudy_interchange::{Joined, Source, Wanted, read_source};

    let object = |kind: &str, name: &str, declaration: &str, body: &str| {
        format!(
            "<TcPlcObject><{kind} Name=\"{name}\"><Declaration><![CDATA[{declaration}]]></Declaration>\
             <Implementation><ST><![CDATA[{body}]]></ST></Implementation></{kind}></TcPlcObject>"
        )
    };
    let files = vec![
        (
            "MAIN.TcPOU".to_owned(),
            object(
                "POU",
                "MAIN",
                "PROGRAM MAIN\nVAR RETAIN\n a : INT;\nEND_VAR\nVAR PERSISTENT\n b : INT;\nEND_VAR\nVAR\n c : INT;\nEND_VAR",
                "a := a + 1; b := b + 1; c := c + 1; GVL.g := a; GVL.h := b;",
            ),
        ),
        (
            "GVL.TcGVL".to_owned(),
            "<TcPlcObject><GVL Name=\"GVL\"><Declaration><![CDATA[VAR_GLOBAL PERSISTENT RETAIN\n g : INT;\nEND_VAR\n\
             VAR_GLOBAL\n h : INT;\nEND_VAR]]></Declaration></GVL></TcPlcObject>"
                .to_owned(),
        ),
    ];
    let joined = Joined::of(files).expect("files of TwinCAT");
    let found = read_source("plant.plcproj", &joined.text, Wanted::default());
    let Some(Source::Program(program)) = found.source else {
        panic!("{:?}", found.diagnostics);
    };
    let mut names = program.retentive_names();
    names.sort_unstable();
    assert_eq!(names, ["a", "b", "g"]);
}

/// Timers and moments that are and are not retentive, in one program.
#[test]
fn times_go_on_over_a_restart() {
    let text = "PROGRAM main
      VAR_INPUT a, b : BOOL; END_VAR
      VAR_OUTPUT y, z, w, q, r : BOOL; END_VAR
      VAR RETAIN kept : TON; since : TIME; n : INT (0..3); END_VAR
      VAR lost : TON; begun : TIME; m : INT (0..3); END_VAR
      kept(IN := a, PT := T#1s); lost(IN := a, PT := T#1s);
      y := kept.Q; z := lost.Q;
      IF b THEN since := TIME(); begun := TIME(); END_IF;
      w := TIME() - since >= T#700ms; q := TIME() - begun >= T#500ms;
      r := n > m;
      IF a THEN n := (n + 1) MOD 4; m := (m + 1) MOD 4; END_IF;
    END_PROGRAM";
    let (file, _) = parse(text);
    let typed = typed(text, &file).expect("a program");
    assert_eq!(typed.retentive_names(), ["kept", "since", "n"]);
    let exact = Exact::new(&typed, RESTARTING).expect("a circuit");
    for seed in 0..20 {
        assert!(check(text, &exact.circuit, &typed, seed) > 5);
    }
}
