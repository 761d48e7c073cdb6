//! The last word of a run is what happened, whatever was expected of it.

use std::fs;

use crate::{Answer, empty_folder, understudy_in};

const CLUSTER: &str = "[cluster]\nname = \"tank\"\n\n[[controller]]\nname = \"fill\"\nladder = \"fill.st\"\n\n\
                       [[remote_io]]\ncontroller = \"fill\"\nfail_safe = { valve = false }\n\n\
                       [[plant]]\nname = \"tank\"\ncontroller = \"fill\"\nladder = \"tank.st\"\n";

const FILL: &str = "PROGRAM fill\n  VAR_INPUT full : BOOL; END_VAR\n  VAR_OUTPUT valve : BOOL; END_VAR\n  \
                    valve := NOT full;\nEND_PROGRAM\n";

/// A tank that stays full, or that runs over.
fn tank(limit: u32) -> String {
    format!(
        "PROGRAM tank\n  VAR_INPUT valve : BOOL; END_VAR\n  VAR_OUTPUT full : BOOL; plant_fault : BOOL; END_VAR\n  \
         VAR level : INT (0..1000); END_VAR\n  IF valve AND level < 1000 THEN level := level + 1; END_IF\n  \
         full := level > 50;\n  plant_fault := level > {limit};\nEND_PROGRAM\n"
    )
}

fn simulated(name: &str, limit: u32, scenario: Option<&str>) -> Answer {
    let folder = empty_folder(name);
    let files = [("cluster.toml", CLUSTER), ("fill.st", FILL), ("tank.st", &tank(limit))];
    for (name, text) in files {
        fs::write(folder.join(name), text).expect("written");
    }
    let mut arguments = vec!["simulate", "cluster.toml", "--seed", "1", "--cycles", "200"];
    if let Some(scenario) = scenario {
        fs::write(folder.join("scenario.toml"), scenario).expect("written");
        arguments.extend(["--scenario", "scenario.toml"]);
    }
    understudy_in(&folder, &arguments)
}

fn check(answer: &Answer, status: i32, wanted: &[&str]) {
    assert_eq!(answer.status, status, "{}", answer.shown());
    for text in wanted {
        assert!(answer.output.contains(text), "{text}: {}", answer.shown());
    }
}

#[test]
fn a_run_without_a_scenario_fails_where_its_plant_is_not_functional() {
    let functional = ["functional throughout", "\npassed: all expectations were met\n"];
    check(&simulated("outcome_functional", 1000, None), 0, &functional);
    let wanted =
        ["NOT FUNCTIONAL", "NOT MET: tank functional; found ", " plant faults", "\nFAILED\n"];
    let faulty = simulated("outcome_faulty", 30, None);
    check(&faulty, 1, &wanted);
    assert!(!faulty.output.contains("passed"), "{}", faulty.shown());
}

#[test]
fn a_scenario_that_expects_nothing_of_a_plant_says_that_it_was_not_functional() {
    let scenario = "title = \"Fill\"\ncycles = 200\n[expect]\nheld = 0\n";
    let wanted = ["passed: all expectations were met; not functional: tank\n"];
    check(&simulated("outcome_allowed", 30, Some(scenario)), 0, &wanted);
    let silent = simulated("outcome_silent", 1000, Some(scenario));
    check(&silent, 0, &["passed: all expectations were met\n"]);
}
