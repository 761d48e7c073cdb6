//! `understudy reconfigure` on the filling line.

use std::fs;
use std::path::Path;

use insta::assert_snapshot;

use crate::{empty_folder, understudy, understudy_in};

const PROJECT: &str = "examples/filling-line/reconfiguration.toml";

#[test]
fn the_report_says_what_each_failed_channel_means() {
    let answer = understudy(&["reconfigure", PROJECT, "--simultaneous", "1"]);
    assert_snapshot!(answer.shown());
}

#[test]
fn the_example_runs_what_is_generated() {
    let folder = empty_folder("reconfigure_all");
    let out = folder.to_str().expect("text");
    let channels = ["--channels", "ps1,Filling_done"];
    let answer =
        understudy(&[&["reconfigure", PROJECT, "-o", out, "--json"], &channels[..]].concat());
    assert_eq!(answer.status, 0, "{}", answer.shown());
    let document = answer.json();
    assert_eq!(document["result"]["states"].as_array().map(Vec::len), Some(12));
    assert_eq!(document["result"]["minimum_channels"][0], "ps1");
    for file in [
        "report.md",
        "feedback.md",
        "programs.md",
        "module-2.ladder",
        "automaton.svg",
        "mega-controller.dot",
        "result.json",
    ] {
        assert!(folder.join(file).exists(), "{file}");
    }
    let generated = fs::read_to_string(folder.join("combined.ladder")).expect("a ladder");
    let diagnosis = fs::read_to_string(folder.join("diagnosis.ladder")).expect("a ladder");
    let examples = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/filling-line");
    for (name, generated) in [("reconfigured.ladder", generated), ("diagnosis.ladder", diagnosis)] {
        let kept = fs::read_to_string(examples.join(name)).expect("a ladder");
        assert!(generated == kept, "examples/filling-line/{name} is another one");
    }
}

#[test]
fn trimming_is_an_option_with_the_states_before_and_after() {
    let sorter = "examples/filling-line/sorter.toml";
    let plain = understudy(&["reconfigure", sorter, "--json"]).json();
    let before = &plain["result"]["trimming"];
    assert_eq!(before["before"], serde_json::json!({ "states": 19, "dangling": 2 }));
    assert!(before["after"].is_null(), "{before}");
    let trimmed = understudy(&["reconfigure", sorter, "--trim", "--json"]).json();
    let after = &trimmed["result"]["trimming"];
    assert_eq!(after["before"], before["before"]);
    assert_eq!(after["after"], serde_json::json!({ "states": 17, "dangling": 0 }));
    assert_eq!(after["prevented"], before["prevented"]);
    let told = understudy(&["reconfigure", sorter, "--trim"]);
    let said = "2 transitions lead there, of which outputs now prevent 2. Before trimming 19 states could be reached, 2 of them";
    assert!(told.output.contains(said), "{}", told.shown());
}

/// Sensors that flicker and stick, nobody who says so, and a controller or the remote I/O that is killed meanwhile.
#[test]
fn the_diagnosed_line_needs_nobody() {
    for scenario in ["silent-sensors-and-kills", "restart-while-a-sensor-sticks"] {
        let scenario = format!("examples/filling-line/{scenario}.toml");
        let cluster = "examples/filling-line/diagnosed.toml";
        let arguments = ["simulate", cluster, "--scenario", &scenario, "--seed", "1"];
        let answer = understudy(&arguments);
        assert_eq!(answer.status, 0, "{scenario}: {}", answer.shown());
    }
}

#[test]
fn a_wrong_project_writes_nothing() {
    let folder = empty_folder("reconfigure_wrong");
    fs::write(folder.join("p.toml"), "[project]\nladder = \"absent.ladder\"\n").expect("written");
    let answer = understudy_in(&folder, &["reconfigure", "p.toml", "-o", "out"]);
    assert_eq!(answer.status, 2);
    for code in ["U1203", "U1208"] {
        assert!(answer.errors.contains(code), "{code}: {}", answer.errors);
    }
    assert!(!folder.join("out").exists());
    let unknown = understudy(&["reconfigure", PROJECT, "--channels", "ps3"]);
    assert_eq!(unknown.status, 2);
    assert!(unknown.errors.contains("U1205"), "{}", unknown.errors);
}
