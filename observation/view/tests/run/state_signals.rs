//! Variables by name, against the naive scan of a ladder and the trace of a program of statements.

use std::collections::BTreeSet;

use serde_json::{Value, json};
use understudy_cluster::{Overrides, read_with};
use understudy_ladder::{Element, Interpreter, Reading, visit};
use understudy_scenarios::Scenario;
use understudy_view::StateSignal;
use understudy_wire::ProgramId;

use crate::support::{KILL_EACH, example, model, scenario, shuttles};

fn quiet(cycles: u64) -> Scenario {
    Scenario { title: "quiet".into(), cycles, ..Scenario::default() }
}

#[test]
fn the_state_of_a_ladder_is_that_of_the_naive_scan() {
    let cluster = example("assembly-cell");
    let model = model(&cluster, &quiet(300), 1);
    let period = cluster.agreement().schedule.period();
    let (mut kinds, mut moved) = (BTreeSet::new(), BTreeSet::new());
    for (place, controller) in cluster.controllers().iter().enumerate() {
        let program = ProgramId(place as u8);
        let ladder = controller.ladder().expect("a ladder");
        let signals = model.state_signals(program);
        let mut naive = Interpreter::new(ladder, period).expect("a right program");
        let mut all = Vec::new();
        for step in model.history(program).expect("it is there").steps() {
            let Some(sampled) = &step.sampled else {
                continue;
            };
            let inputs: Vec<bool> = sampled.inputs.bits().collect();
            let scan = naive.scan_observed(&inputs);
            let reading = |name: &str| {
                let rungs = ladder.rungs.iter().zip(&scan.rungs);
                rungs.into_iter().find_map(|(rung, flow)| {
                    let mut names = Vec::new();
                    visit(&rung.network, &mut |element| {
                        names.push(match element {
                            Element::Block(block) => block.name.to_string(),
                            _ => String::new(),
                        });
                    });
                    let place = names.iter().position(|own| own == name)?;
                    Some(flow.elements[place].reading)
                })
            };
            // Memory bits, and what blocks count: all else in a block is no signal of the ladder.
            let expected = |signal: &StateSignal| match signal.name.rsplit_once('.') {
                None => Some(("memory", Value::from(naive.value(&signal.name)))),
                Some((block, "ET" | "CV")) => match reading(block)? {
                    Reading::Time(elapsed) => Some(("timer", (elapsed.as_nanos() as u64).into())),
                    Reading::Number(number) => Some(("counter", number.into())),
                    _ => None,
                },
                Some(_) => None,
            };
            let found = model.state_values(program, step.cycle, &signals);
            let found = found.expect("it is known");
            for (signal, value) in signals.iter().zip(&found) {
                let Some((kind, expected)) = expected(signal) else {
                    continue;
                };
                let at = (&controller.name, &signal.name, step.cycle);
                assert_eq!(*value, expected, "{at:?}");
                kinds.insert(kind);
                if !matches!(value, Value::Bool(false)) && *value != 0 {
                    moved.insert(kind);
                }
            }
            all.push((step.cycle, found));
        }
        assert!(all.len() >= 300, "{}", all.len());
        let trend = model.state_trend(program, (10, 200), &signals, usize::MAX);
        let expected: Vec<_> =
            all.into_iter().filter(|(cycle, _)| (10..=200).contains(cycle)).collect();
        assert_eq!(trend, expected);
        let newest = model.state_trend(program, (10, 200), &signals, 7);
        assert_eq!(newest, expected[expected.len() - 7..]);
    }
    let expected = BTreeSet::from(["counter", "memory", "timer"]);
    assert_eq!((&kinds, &moved), (&expected, &expected), "none stays at 0");
}

#[test]
fn the_variables_of_a_program_with_numbers_are_those_of_its_trace() {
    let cluster = shuttles();
    let model = model(&cluster, &scenario(&cluster, STARTED), 1);
    let program = ProgramId(0);
    let signals = model.state_signals(program);
    let names: Vec<&str> = signals.iter().map(|signal| signal.name.as_str()).collect();
    assert_eq!(names, ["forward", "granted", "may_enter"], "no input and no output");
    let mut seen = BTreeSet::new();
    for cycle in 10..680 {
        let (lines, error) = model.text_at(program, cycle).expect("a text");
        assert!(error.is_none(), "cycle {cycle}");
        let values = model.state_values(program, cycle, &signals).expect("known");
        for (name, value) in names.iter().zip(values) {
            let mut shown = lines.iter().flat_map(|line| &line.values);
            let traced = shown.find(|shown| shown.name == *name);
            assert_eq!(Some(&value), traced.map(|shown| &shown.value), "cycle {cycle}");
            seen.insert((*name, value.as_bool()));
        }
    }
    assert!(seen.contains(&("forward", Some(false))), "it came to the end of its track: {seen:?}");
    assert!(model.state_values(program, 9999, &signals).is_err());
}

/// The left shuttle is started.
const STARTED: &str = "\
title = \"started\"
cycles = 700

[[step]]
at = 20
action = \"write\"
station = \"left-io\"
input = \"start\"
value = true
";

#[test]
fn a_failure_changes_no_state() {
    let cell = example("press-cell");
    let program = ProgramId(0);
    let of = |scenario: &Scenario| {
        let model = model(&cell, scenario, 1);
        let signals = model.state_signals(program);
        assert!(signals.len() > 5);
        model.state_trend(program, (0, 250), &signals, usize::MAX)
    };
    assert_eq!(of(&quiet(300)), of(&scenario(&cell, KILL_EACH)));
}

const DECLARED: &str = "\
TYPE
  Mode : (Off, Manual := 3, Auto := 7);
  Stage : STRUCT pause : LTIME; parts : INT (1..4); mode : Mode; END_STRUCT;
END_TYPE
FUNCTION_BLOCK Count
  VAR_INPUT go : BOOL; END_VAR
  VAR since : LTIME; steps : INT (0..5); END_VAR
  IF go THEN since := since + LT#3ms; steps := MIN(steps + 1, 5); END_IF;
END_FUNCTION_BLOCK
PROGRAM pump
  VAR_OUTPUT y : BOOL; END_VAR
  VAR c : Count; total : LTIME; plain : TIME; recipe : ARRAY [0..1] OF Stage := [2((parts := 2))]; moment : LDT; bounded : INT (-3..3) := 1; END_VAR
  c(go := TRUE);
  total := total + LT#1ms;
  recipe[1].mode := Manual;
  y := TRUE;
END_PROGRAM
";

/// Each has its declared type, whatever it is stored as.
#[test]
fn a_signal_of_a_state_has_its_declared_type() {
    let text = "[cluster]\nname = \"cell\"\n[[controller]]\nname = \"pump\"\nladder = \"pump.st\"\n[[remote_io]]\ncontroller = \"pump\"\n";
    let read = read_with("cell.toml", text, Overrides::default(), &mut |_| Ok(DECLARED.into()));
    let cluster = read.cluster.unwrap_or_else(|| panic!("{:?}", read.reports));
    let model = model(&cluster, &quiet(30), 1);
    let signals = model.state_signals(ProgramId(0));
    let values = model.state_values(ProgramId(0), 20, &signals).expect("known");
    let found = |name: &str| {
        let place = signals.iter().position(|signal| signal.name == name);
        let place = place.unwrap_or_else(|| panic!("no {name}: {signals:?}"));
        (signals[place].of.as_str(), signals[place].shown(values[place].clone()))
    };
    // The first scan is in the cycle before the origin.
    let scans = 22;
    for (name, of, value) in [
        ("total", "LTIME", json!(scans * 1_000_000)),
        ("plain", "TIME", json!(0)),
        ("bounded", "INT (-3..3)", json!(1)),
        ("moment", "LDATE_AND_TIME", json!("1970-01-01-00:00:00")),
        ("recipe[0].pause", "LTIME", json!(0)),
        ("recipe[1].parts", "INT (1..4)", json!(2)),
        ("recipe[1].mode", "Mode", json!("Manual")),
        ("c.since", "LTIME", json!(scans * 3_000_000)),
        ("c.steps", "INT (0..5)", json!(5)),
    ] {
        assert_eq!(found(name), (of, value), "{name}");
        let typed = model.why(name, Some(20)).expect("known").of.map(|of| of.to_string());
        assert_eq!(typed.as_deref(), Some(of), "{name}");
    }
}
