//! A program that is written and read again is the same circuit, and its file is by the schema.

use std::collections::{BTreeMap, HashSet};
use std::time::Duration;

use understudy_interchange::plcopen::{read, write};
use understudy_ladder::{Program, from_circuit, parse};
use understudy_logic::Circuit;

use crate::support::{PERIOD, findings, outputs, program, xmllint};
use understudy_logic::Running;
use understudy_testing::random::random_program;

fn check(original: &Program, seed: u64) {
    let text = write(original, PERIOD);
    let reading = read(&text, None);
    let found = findings(&text, &reading);
    let off: Vec<&String> = found.iter().filter(|line| line.contains("U10")).collect();
    assert!(off.is_empty(), "seed {seed}: {off:#?}");
    assert_eq!(reading.period, Some(PERIOD), "seed {seed}");
    let again = reading.program.unwrap_or_else(|| panic!("seed {seed}: {found:#?}"));
    let names = |program: &Program| (program.inputs.len(), program.outputs.len());
    assert_eq!(names(original), names(&again), "seed {seed}");
    let addresses = |program: &Program| -> Vec<String> {
        let signals = program.inputs.iter().chain(program.writable());
        signals.filter_map(|signal| signal.address.as_ref().map(ToString::to_string)).collect()
    };
    assert_eq!(addresses(original), addresses(&again), "seed {seed}");
    let before = original.lower(PERIOD).expect("a sound program");
    let after = again.lower(PERIOD).expect("a sound program");
    for run in 0..4 {
        let expected = outputs(&before, seed ^ run, 60);
        let actual = outputs(&after, seed ^ run, 60);
        let scan = expected.iter().zip(&actual).position(|(left, right)| left != right);
        assert_eq!(scan, None, "seed {seed}, run {run}: a scan differs");
    }
    // What was read is written as it was: nothing grows from file to file.
    let third = program(&write(&again, PERIOD));
    let blocks = |program: &Program| -> BTreeMap<String, usize> {
        let mut counts = BTreeMap::new();
        for block in program.blocks() {
            *counts.entry(format!("{:?}", block.kind)).or_default() += 1;
        }
        counts
    };
    assert_eq!(
        blocks(original),
        blocks(&third),
        "seed {seed}\n{}\n{}",
        understudy_ladder::print(original),
        understudy_ladder::print(&again)
    );
}

#[test]
fn random_programs_come_back() {
    for seed in 0..150 {
        check(&random_program(seed, 6), seed);
    }
}

#[test]
fn the_examples_come_back() {
    for name in ["press-cell/robot", "press-cell/press", "boiler/main", "filling-line/plant"] {
        let path = format!("{}/../../examples/{name}.ladder", env!("CARGO_MANIFEST_DIR"));
        let text = std::fs::read_to_string(&path).expect("an example");
        let program = parse(&text).into_result().expect("an example is right").0;
        check(&program, 7);
        // Whatever circuit there is has a file: the understudy's too.
        let circuit = program.lower(PERIOD).expect("an example is right");
        check(&from_circuit(&circuit), 8);
    }
}

#[test]
fn what_is_written_is_by_the_schema() {
    for seed in [1, 2, 3] {
        let text = write(&random_program(seed, 12), Duration::from_micros(1500));
        if let Some(valid) = xmllint(&format!("written-{seed}"), &text) {
            assert!(valid, "seed {seed}");
        }
    }
}

#[test]
fn names_become_names_of_the_standard() {
    let text = "program and
input robot.holding
input a__b
input A_B
output 1st_
";
    let text = text.replace("1st_", "true_");
    let mut original = parse(&text).program;
    original.inputs[0].description = Some("]]> & <a>".into());
    let text = write(&original, PERIOD);
    let again = program(&text);
    let names: Vec<&str> = again.inputs.iter().map(|signal| signal.name.as_str()).collect();
    assert_eq!(names, ["robot_holding", "a_b", "A_B_2"]);
    assert_eq!(again.inputs[0].description.as_deref(), Some("]]> & <a>"));
    assert_eq!(again.outputs[0].name.as_str(), "true_2");
}

/// Every input in every state that the two reach together; `None` where there are more than `most`.
fn equal_in_every_state(one: &Circuit, other: &Circuit, most: usize) -> Option<bool> {
    let (mut one, mut other) = (Running::new(one), Running::new(other));
    let width = one.input_count();
    let start = (one.state().to_vec(), other.state().to_vec());
    let mut seen = HashSet::from([start.clone()]);
    let mut waiting = vec![start];
    while let Some((left, right)) = waiting.pop() {
        for pattern in 0..1_usize << width {
            let inputs: Vec<bool> = (0..width).map(|input| pattern >> input & 1 == 1).collect();
            one.go_to(&left);
            other.go_to(&right);
            if one.step(&inputs) != other.step(&inputs) {
                return Some(false);
            }
            let next = (one.state().to_vec(), other.state().to_vec());
            if seen.insert(next.clone()) {
                if seen.len() > most {
                    return None;
                }
                waiting.push(next);
            }
        }
    }
    Some(true)
}

#[test]
fn small_programs_come_back_the_same_in_every_state() {
    let mut proved = 0;
    for seed in 1000..1120 {
        let original = random_program(seed, 2);
        let again = program(&write(&original, PERIOD));
        let before = original.lower(PERIOD).expect("a sound program");
        let after = again.lower(PERIOD).expect("a sound program");
        // Timers and counters may have more states than are looked at here.
        if let Some(equal) = equal_in_every_state(&before, &after, 400) {
            assert!(equal, "seed {seed}");
            proved += 1;
        }
    }
    assert!(proved > 40, "{proved}");
}
