//! Model checking as a person meets it.

use std::fs;

use serde_json::json;

use crate::{empty_folder, understudy};

#[test]
fn the_press_cell_survives_every_crash_in_a_cycle() {
    let cluster = "examples/press-cell/cluster.toml";
    let answer =
        understudy(&["model-check", cluster, "--cycles", "1", "--kinds", "crash", "--json"]);
    assert_eq!(answer.status, 0, "{}", answer.shown());
    let result = &answer.json()["result"];
    assert!(result["states"].as_u64() > Some(100), "{result}");
    let properties = result["properties"].as_array().expect("properties");
    assert_eq!(properties.len(), 6);
    for property in properties {
        assert_eq!(property["holds"], json!(true), "{property}");
    }
}

/// Without an understudy a crash costs cycles: what the checker found is a scenario, and simulating it shows the same.
#[test]
fn a_broken_property_is_a_scenario_that_is_replayed() {
    let folder = empty_folder("model-check");
    let press = fs::read_to_string("examples/press-cell/press.ladder").expect("an example");
    fs::write(folder.join("press.ladder"), press).expect("written");
    let text = "understudy = []\n[cluster]\nname = \"alone\"\n\
                [[controller]]\nname = \"press\"\nladder = \"press.ladder\"\n";
    let path = |name: &str| folder.join(name).display().to_string();
    let (cluster, scenario) = (path("cluster.toml"), path("found.toml"));
    fs::write(&cluster, text).expect("written");
    let answer = understudy(&[
        "model-check",
        &cluster,
        "--cycles",
        "1",
        "--kinds",
        "crash",
        "--scenario",
        &scenario,
    ]);
    assert_eq!(answer.status, 1, "{}", answer.shown());
    assert!(answer.output.contains("BROKEN  one lost station costs no cycle"));
    let replayed = understudy(&["simulate", &cluster, "--scenario", &scenario, "--json"]);
    assert_eq!(replayed.status, 1, "{}", replayed.shown());
}

#[test]
fn a_run_may_begin_with_members_that_have_restarted() {
    let cluster = "examples/press-cell/cluster.toml";
    let common = ["model-check", cluster, "--cycles", "1", "--kinds", "crash"];
    let ask = |start: &[&str]| understudy(&[&common[..], start, &["--json"]].concat());
    let answer = ask(&["--restarted", "all"]);
    assert_eq!(answer.status, 0, "{}", answer.shown());
    let wrong = ask(&["--restarted", "robt,arm", "--behind", "nobody"]);
    assert_eq!(wrong.status, 2, "{}", wrong.shown());
    let failures = wrong.json()["failures"].clone();
    let codes: Vec<_> = failures.as_array().into_iter().flatten().collect();
    assert_eq!(codes.len(), 3, "{failures:#}");
    assert!(codes.iter().all(|failure| failure["code"] == "U0605"));
}
