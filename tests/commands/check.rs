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

/// The file itself has no error, and no cluster is made of it.
#[test]
fn a_cluster_with_a_wrong_program_is_not_right() {
    let folder = empty_folder("wrong_program");
    let write = |name: &str, text: &str| fs::write(folder.join(name), text).expect("written");
    let cluster = "[cluster]\nname = \"cell\"\n\n[[controller]]\nname = \"pump\"\nladder = \"pump.ladder\"\n\n[[remote_io]]\ncontroller = \"pump\"\n";
    write("cluster.toml", cluster);
    write("pump.ladder", "program pump\ninput full\noutput run\nrung\n  /ful ( run )\n");
    let answer = understudy_in(&folder, &["check", "cluster.toml"]);
    assert_eq!(answer.status, 2);
    assert!(answer.output.contains("cluster   1 of its programs has errors"), "{}", answer.output);
    let document = understudy_in(&folder, &["check", "cluster.toml", "--json"]).json();
    let files = document["result"]["files"].as_array().expect("files");
    let found = files.iter().map(|file| (&file["errors"], &file["wrong_programs"]));
    let found: Vec<_> = found.map(|(errors, wrong)| (errors.as_u64(), wrong.as_u64())).collect();
    assert_eq!(found, [(Some(0), Some(1)), (Some(1), Some(0))]);
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

/// Names and bits of what a warm start keeps, of a ladder and of a program with numbers; a counterexample shows the restart.
#[test]
fn what_is_retentive_is_listed_and_proved_about() {
    let folder = empty_folder("retentive");
    let write = |name: &str, text: &str| fs::write(folder.join(name), text).expect("written");
    write(
        "latch.ladder",
        "program latch\ninput a\noutput y\nmemory seen = 0\nmemory armed = 0\nretain seen\n\
         rung [ a | seen ] ( seen )\nrung [ a | armed ] ( armed )\nrung seen /armed ( y )\n",
    );
    write(
        "count.st",
        "PROGRAM count VAR_INPUT a : BOOL; END_VAR VAR_OUTPUT RETAIN n : INT; END_VAR\n\
         VAR RETAIN t : TON; END_VAR t(IN := a, PT := T#1s); IF t.Q THEN n := 1; END_IF; END_PROGRAM\n",
    );
    let files = ["check", "latch.ladder", "count.st"];
    let answer = understudy_in(&folder, &files);
    let line = |name: &str| {
        let mut lines = answer.output.lines().filter(|line| line.starts_with(name));
        lines.next().unwrap_or_default().to_owned()
    };
    let latch = line("latch.ladder");
    assert!(latch.ends_with("right; retentive: seen, 1 of 3 state bits"), "{latch}");
    assert!(line("count.st").contains("; retentive: n, t, "), "{}", line("count.st"));
    let json = understudy_in(&folder, &[&files[..], &["--json"]].concat()).json();
    assert_eq!(json["result"]["files"][0]["retained"]["variables"][0], "seen");
    assert_eq!(json["result"]["files"][0]["retained"]["kept_bits"], 1);
    assert_eq!(json["result"]["files"][1]["retained"]["variables"][1], "t");
    let proof = ["verify", "latch.ladder", "--property", "never y", "--json"];
    let proved = understudy_in(&folder, &proof).json();
    let program = &proved["result"]["programs"][0];
    assert_eq!(program["restarted_by"][0], "power.returns");
    let property = &program["properties"][0];
    assert_eq!(property["verdict"], "fails");
    assert_eq!(property["scans"]["signals"]["power.returns"], serde_json::json!([0, 1]));
    // What is assumed not to happen is no assumption that it may.
    for (assumed, restarts) in
        [("!power.returns", 0), ("a & !power.returns", 0), ("!a | !power.returns", 1)]
    {
        let proved = understudy_in(&folder, &[&proof[..], &["--assume", assumed]].concat()).json();
        let restarted = &proved["result"]["programs"][0]["restarted_by"];
        assert_eq!(restarted.as_array().map(Vec::len), Some(restarts), "{assumed}: {proved}");
    }
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
