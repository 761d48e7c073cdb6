//! Scenario steps that set inputs of the field: the same in the simulator and on real processes.

use std::fs;
use std::path::Path;

use serde_json::Value;

use super::shared::{answer, empty_folder, some_at_a_time};

/// From the upper mark the pump runs until the water is below the lower mark. The plant shows `low` from its cycle 5 on, as it rises.
const SCENARIO: &str = r#"
title = "the upper mark is reached"
cycles = 90

[[step]]
at = 15
action = "set"
station = "pump-io"
input = "high"
value = true

[[step]]
at = 15
action = "set"
station = "pump-io"
input = "low"
value = true

[[step]]
at = 40
action = "release"
station = "pump-io"
input = "high"

[[step]]
at = 65
action = "set"
station = "pump-io"
input = "low"
value = false

[expect]
wrong = 0
"#;

/// The output of the pump in a cycle, with its explanation.
fn motor(run: &str, cycle: &str) -> (bool, Value) {
    let (status, why, errors) = answer(&["why", "pump.motor", run, "--at", cycle]);
    assert_eq!(status, 0, "{errors}");
    let value = why["result"]["value"].as_bool().expect("a BOOL");
    (value, why)
}

#[test]
fn inputs_are_set_and_released_in_both_worlds() {
    let _one = some_at_a_time();
    let folder = empty_folder("set_inputs");
    let path = |name: &str| folder.join(name).display().to_string();
    let cell = path("cell");
    let (status, _, errors) = answer(&["init", &cell, "--template", "minimal"]);
    assert_eq!(status, 0, "{errors}");
    let scenario = path("set.toml");
    fs::write(&scenario, SCENARIO).expect("written");
    let cluster = Path::new(&cell).join("cluster.toml").display().to_string();
    let out = path("runs");
    let with = ["--scenario", &scenario, "--out", &out];
    let simulated = [&["simulate", &cluster, "--seed", "1"], &with[..]].concat();
    let real = [&["lab", &cluster, "--period", "50ms"], &with[..]].concat();
    for command in [simulated, real] {
        let (status, document, errors) = answer(&command);
        assert_eq!(status, 0, "{errors}\n{document:#}");
        let run = format!("{out}/latest");
        assert!(!motor(&run, "10").0, "nothing is set yet");
        let (is_on, why) = motor(&run, "30");
        assert!(is_on, "{why:#}");
        let (stays_on, why) = motor(&run, "55");
        assert!(stays_on, "it runs down to the lower mark: {why:#}");
        let (is_on, why) = motor(&run, "80");
        assert!(!is_on, "{why:#}");
    }
}
