//! `understudy check` finds everything that is wrong in one run.

use std::fs;

use insta::assert_snapshot;

use crate::{empty_folder, understudy, understudy_in};

#[test]
fn the_files_of_the_project_are_right() {
    let answer = understudy(&[
        "check",
        "examples/press-cell/cluster.toml",
        "scenarios/table-two.toml",
        "scenarios/kill-each.toml",
        "scenarios/double-kill.toml",
        "scenarios/paper-double-kill.toml",
        "scenarios/stop-and-continue.toml",
        "scenarios/remote-io-restart.toml",
        "scenarios/lossy.toml",
    ]);
    assert_snapshot!(answer.shown());
}

#[test]
fn everything_that_is_wrong_is_found_at_once() {
    let folder = empty_folder("everything_wrong");
    let write = |name: &str, text: &str| fs::write(folder.join(name), text).expect("written");
    write(
        "cluster.toml",
        "[cluster]\nname = \"cell\"\nperod = \"10ms\"\n\n[[controller]]\nname = \"pump\"\nladder = \"pump.ladder\"\n",
    );
    write("pump.ladder", "program pump\ninput full\noutput run\nrung \"run\"\n  /ful ( run )\n");
    write(
        "kill.toml",
        "title = \"Kill\"\ncycles = 10\n[[step]]\nat = 20\naction = \"kill\"\nstation = \"pump\"\n",
    );
    let files = ["check", "cluster.toml", "kill.toml", "absent.ladder"];
    assert_snapshot!(understudy_in(&folder, &files).shown());
    let json = understudy_in(&folder, &[&files[..], &["--json"]].concat());
    assert_eq!((json.status, json.errors.as_str()), (2, ""));
    let document = json.json();
    assert_eq!(document["command"], "check");
    assert_eq!(document["status"], 2);
    let codes: Vec<&str> = document["diagnostics"]
        .as_array()
        .expect("a list")
        .iter()
        .filter_map(|diagnostic| diagnostic["code"].as_str())
        .collect();
    assert!(codes.contains(&"U0305") && codes.contains(&"U0306"), "{codes:?}");
    assert_eq!(document["failures"][0]["code"], "U0601");
}

#[test]
fn a_scenario_is_checked_against_the_cluster_beside_it() {
    let folder = empty_folder("beside");
    let written = understudy_in(&folder, &["init", "."]);
    assert_eq!(written.status, 0, "{}", written.errors);
    let text = fs::read_to_string(folder.join("kill.toml")).expect("a scenario");
    fs::write(folder.join("other.toml"), text.replace("\"tank\"", "\"tnk\"")).expect("written");
    assert_eq!(understudy_in(&folder, &["check", "kill.toml"]).status, 0);
    let answer = understudy_in(&folder, &["check", "other.toml"]);
    assert_eq!(answer.status, 2);
    assert!(answer.errors.contains("did you mean `tank`?"), "{}", answer.errors);
}

#[test]
fn a_plant_file_is_checked_with_its_groups() {
    let right = understudy(&["check", "--json", "examples/shared-spare/plant.toml"]).json();
    assert_eq!(right["result"]["files"][0]["kind"], "plant");
    assert_eq!(right["result"]["errors"], 0);
    let folder = empty_folder("plant_file");
    let plant = "[[group]]\nname = \"a\"\ncluster = \"cluster.toml\"\n[[spare]]\nname = \"x\"\ngroups = { b = \"spare\" }\n";
    fs::write(folder.join("plant.toml"), plant).expect("written");
    fs::write(folder.join("cluster.toml"), "[cluster]\n").expect("written");
    let wrong = understudy_in(&folder, &["check", "plant.toml"]);
    assert_eq!(wrong.status, 2);
    for code in ["U0231", "U0209"] {
        assert!(wrong.errors.contains(code), "{code}: {}", wrong.errors);
    }
    let schema = understudy(&["schema", "plant"]).output;
    assert!(schema.contains("retire_after"), "{schema}");
}
