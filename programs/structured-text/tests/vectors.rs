//! Scans that another compiler made: matiec and gcc, bit for bit.

mod running;

use std::path::PathBuf;

use serde_json::Value;

use running::{Running, program, stored, written};

/// Functions in `trigonometry` that may differ by two units in the last place, and what is made of them.
const TRANSCENDENTAL: [&str; 6] = ["s", "c", "e", "l", "a", "h"];

fn data(path: &str) -> Option<PathBuf> {
    let Some(data) = std::env::var_os("UNDERSTUDY_DATA") else {
        understudy_testing::skip("UNDERSTUDY_DATA is not set");
        return None;
    };
    Some(PathBuf::from(data).join(path))
}

fn text(path: PathBuf) -> String {
    std::fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

#[test]
fn numbers_are_those_of_another_compiler() {
    let Some(folder) = data("numbers") else {
        return;
    };
    let vectors: Value = serde_json::from_str(&text(folder.join("vectors.json"))).expect("JSON");
    let mut scans = 0;
    for (name, vector) in vectors.as_object().expect("an object") {
        let mut running = Running::new(program(&text(folder.join(format!("{name}.st")))));
        let (inputs, outputs) = (running.inputs(), running.outputs());
        for (scan, line) in vector["scans"].as_array().expect("scans").iter().enumerate() {
            let line = line.as_str().expect("a line");
            let (given, expected) = line.split_once(" -> ").expect("inputs -> outputs");
            let given: Vec<&str> = given.split(' ').collect();
            assert_eq!(given.len(), inputs.len(), "{name}");
            let values = inputs.iter().zip(&given);
            let values: Vec<u64> = values.map(|(point, text)| stored(point.of, text)).collect();
            let found = running.scan(&values);
            assert_eq!(running.fault(), None, "{name}");
            for ((point, found), expected) in outputs.iter().zip(found).zip(expected.split(' ')) {
                let may_differ =
                    name == "trigonometry" && TRANSCENDENTAL.contains(&point.name.as_str());
                let is_equal = match may_differ {
                    true => found.abs_diff(stored(point.of, expected)) <= 2,
                    false => written(point.of, found) == expected,
                };
                let shown = written(point.of, found);
                assert!(is_equal, "{name} scan {scan} {}: {shown} is not {expected}", point.name);
            }
            scans += 1;
        }
    }
    assert_eq!(scans, 3_600);
}

#[test]
fn standard_blocks_are_those_of_another_compiler() {
    let Some(folder) = data("ladder/vectors") else {
        return;
    };
    let vectors: Value = serde_json::from_str(&text(folder.join("blocks.json"))).expect("JSON");
    let mut running = Running::new(program(&text(folder.join("blocks.st"))));
    let scans = vectors["scans"].as_array().expect("scans");
    assert_eq!(scans.len(), 2_000);
    for (scan, line) in scans.iter().enumerate() {
        let line = line.as_str().expect("a line");
        let (given, expected) = line.split_once(' ').expect("inputs and outputs");
        let values: Vec<u64> = given.bytes().map(|bit| u64::from(bit == b'1')).collect();
        let found = running.scan(&values);
        let found: String = found.iter().map(|bit| bit.to_string()).collect();
        assert_eq!(found, expected, "scan {scan}");
    }
}
