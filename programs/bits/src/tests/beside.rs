//! A circuit that is wrong on purpose is found before it is used.

use std::collections::BTreeSet;

use understudy_logic::{Circuit, CircuitBuilder};
use understudy_typed::Program;

use super::lowered;
use crate::program::Member;
use crate::system::Source;
use crate::{Compared, Derivation, Disagreement, Exact, Shown, System, beside};

/// The program whose remainder by 0 was once derived as a fault of no consequence, and the same with what the derivation made of it.
const REMAINDER: [&str; 2] = [
    "PROGRAM p VAR_INPUT a : INT; b : INT; END_VAR VAR_OUTPUT y : BOOL; END_VAR y := b <> 0 AND a MOD b = 0; END_PROGRAM",
    "PROGRAM p VAR_INPUT a : INT; b : INT; END_VAR VAR_OUTPUT y : BOOL; END_VAR y := b = 0 OR a MOD b = 0; END_PROGRAM",
];

/// What the circuit of one program does beside another one with the same points.
fn beside_another(texts: [&str; 2], shown: Shown<'_>) -> Result<(), Box<Disagreement>> {
    let [program, other] = texts.map(lowered);
    let circuit = Exact::new(&other, shown).expect("a circuit").circuit;
    let system = System::comparing(&program, BTreeSet::new(), shown.restarts).expect("followed");
    beside::exact(&system, &program, &circuit, &shown)
}

fn text(inputs: &str, outputs: &str, variables: &str, body: &str) -> String {
    format!(
        "TYPE colour : (red := 7, green := 4711, blue := -3); END_TYPE
         PROGRAM p VAR_INPUT {inputs} END_VAR VAR_OUTPUT {outputs} END_VAR {variables} {body} END_PROGRAM"
    )
}

/// Circuits that differ from their programs for one value among all of a type.
#[test]
fn a_difference_at_a_corner_is_found() {
    for (inputs, wrong) in [
        ("x : DINT;", "x = 0"),
        ("x : DINT;", "x = 1"),
        ("x : DINT;", "x = -1"),
        ("x : DINT;", "x = -2147483648"),
        ("x : DINT;", "x = 2147483647"),
        ("x : UDINT;", "x = 4294967295"),
        ("x : DINT (-70000..123456);", "x >= 123456"),
        ("x : DINT (-70000..123456);", "x <= -70000"),
        ("x : DWORD;", "x = 16#FFFFFFFF"),
        ("x : colour;", "x = green"),
        ("x : colour;", "x = blue"),
    ] {
        let [right, wrong] =
            ["FALSE", wrong].map(|value| text(inputs, "y : BOOL;", "", &format!("y := {value};")));
        let found = beside_another([&right, &wrong], Shown::default());
        let found = found.expect_err(&wrong);
        assert_eq!(
            (found.name.as_str(), found.program.last()),
            ("y", Some(&"FALSE".into())),
            "{wrong}"
        );
        assert_eq!(found.circuit.last().map(String::as_str), Some("TRUE"), "{wrong}");
        let same = beside_another([&wrong, &wrong], Shown::default());
        assert_eq!(same, Ok(()), "{wrong}");
    }
}

/// Remainders by 0 are 0 here as on the machine; a circuit that decides otherwise is found.
#[test]
fn a_wrong_remainder_is_found() {
    let found = beside_another(REMAINDER, Shown::default()).expect_err("they differ where b is 0");
    let shown = found.to_string();
    assert!(shown.starts_with("an internal error: in scan "), "{shown}");
    assert!(shown.contains("\n  b: "), "{shown}");
    assert!(shown.contains("\n  y, program: ") && shown.contains("\n  y, circuit: "), "{shown}");
}

/// What is shown of a program is compared too, and numbers, timers and warm starts are.
#[test]
fn all_that_a_circuit_tells_is_compared() {
    let variables = ["k".to_owned(), "t.Q".to_owned()];
    let compared = Compared {
        name: "n >= 3".into(),
        number: "n".into(),
        comparison: understudy_typed::Comparison::GreaterOrEqual,
        stored: 3,
    };
    let compared = [compared];
    let shown =
        Shown { variables: &variables, compared: &compared, restarts: true, keeps_all: true };
    let of = |retain: &str, other: &str, step: i64, time: i64| {
        let memory = format!("VAR {retain} n : INT (0..9); END_VAR VAR k : BOOL; t : TON; END_VAR");
        let body = format!(
            "k := a {other} b; t(IN := a, PT := T#{time}ms);
             IF a THEN n := n + {step}; END_IF; IF n > 5 THEN n := 0; END_IF; y := a;"
        );
        text("a : BOOL; b : BOOL;", "y : BOOL;", &memory, &body)
    };
    let right = of("RETAIN", "AND", 1, 30);
    assert_eq!(beside_another([&right, &right], shown), Ok(()));
    for (wrong, name) in [
        (of("RETAIN", "OR", 1, 30), "k"),
        (of("RETAIN", "AND", 2, 30), "n >= 3"),
        (of("RETAIN", "AND", 1, 40), "t.Q"),
    ] {
        let found = beside_another([&right, &wrong], shown).expect_err(name);
        assert_eq!(found.name, name);
    }
}

/// The circuit with one output negated.
fn negated(circuit: &Circuit, wrong: usize) -> Circuit {
    let mut builder = CircuitBuilder::like(circuit);
    let values = builder.copy_functions(circuit, |graph, variable| graph.variable(variable));
    for (place, (output, value)) in circuit.outputs().iter().zip(values).enumerate() {
        let value = if place == wrong { builder.graph().not(value) } else { value };
        builder.output(&output.name, value);
    }
    builder.finish().expect("a circuit")
}

const TANK: &str = "PROGRAM p
   VAR_INPUT level : REAL; go : BOOL; END_VAR
   VAR_OUTPUT open : BOOL; flow : REAL; END_VAR VAR sum : REAL; END_VAR
   sum := sum * 0.5 + level; flow := MIN(sum, 100.0); open := go AND flow * flow > 2.0;
 END_PROGRAM";

/// Programs whose numbers are not followed are compared with the values that they have, on both sides of the terms.
#[test]
fn what_has_gaps_is_compared_too() {
    let program = lowered(TANK);
    let system = || System::within_subranges(&program, BTreeSet::new()).expect("followed");
    let right = system();
    let mut derivation = Derivation::new(&right).expect("a circuit");
    assert_eq!(derivation.beside(&right, &[&program]), Ok(()));
    let open = right.observed.iter().position(|(name, _)| name == "open").expect("an output");
    derivation.circuit = negated(&derivation.circuit, open);
    let found = derivation.beside(&right, &[&program]).expect_err("negated");
    assert_eq!((found.name.as_str(), found.scan), ("open", 0));
    let other = lowered(&TANK.replace("100.0", "99.0"));
    let derivation = Derivation::new(&right).expect("a circuit");
    let found = derivation.beside(&right, &[&other]).expect_err("another limit");
    assert_eq!(found.name, "flow");
}

/// The programs of a cluster: what one reads of another arrives late or not at all, and none is compared while it does not run.
#[test]
fn the_programs_of_a_cluster_are_compared() {
    let texts = [
        "PROGRAM one VAR_INPUT go : BOOL; END_VAR VAR_OUTPUT n : INT (0..9); END_VAR
           IF go THEN n := n + 1; END_IF; IF n > 8 THEN n := 0; END_IF; END_PROGRAM",
        "PROGRAM two VAR_INPUT n : INT; END_VAR VAR_OUTPUT y : BOOL; END_VAR VAR RETAIN m : INT; END_VAR
           y := n > m; m := n; END_PROGRAM",
    ];
    let programs: Vec<Program> = texts.iter().map(|text| lowered(text)).collect();
    let signal = Source::Signal { program: 0, output: "n".into(), default: 3, stale_after: 2 };
    let sources = [vec![Source::Any(None)], vec![signal]];
    let members = programs.iter().zip(sources).zip(["one", "two"]);
    let members =
        members.map(|((program, sources), name)| Member { name: name.into(), program, sources });
    let members: Vec<Member<'_>> = members.collect();
    let system = System::of_cluster("cell", &members, BTreeSet::new()).expect("followed");
    let derivation = Derivation::new(&system).expect("a circuit");
    let [one, two] = [&programs[0], &programs[1]];
    assert_eq!(derivation.beside(&system, &[one, two]), Ok(()));
    let wrong = lowered(&texts[1].replace("n > m", "n >= m"));
    let found = derivation.beside(&system, &[one, &wrong]).expect_err("another program");
    assert_eq!(found.name, "two.y");
}
