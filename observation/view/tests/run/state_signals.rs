//! Memory, timers, counters and variables by name, against the naive scan of a ladder and the trace of a program with numbers.

use std::collections::BTreeSet;

use serde_json::Value;
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
            let expected = |signal: &StateSignal| match reading(&signal.name) {
                Some(Reading::Time(elapsed)) => Value::from(elapsed.as_nanos() as u64),
                Some(Reading::Number(number)) => Value::from(number),
                _ => naive.value(&signal.name).into(),
            };
            let expected: Vec<Value> = signals.iter().map(expected).collect();
            let found = model.state_values(program, step.cycle, &signals);
            let found = found.expect("it is known");
            assert_eq!(found, expected, "{} in cycle {}", controller.name, step.cycle);
            for (signal, value) in signals.iter().zip(&found) {
                kinds.insert(signal.kind.word());
                if !matches!(value, Value::Bool(false)) && *value != 0 {
                    moved.insert(signal.kind.word());
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
