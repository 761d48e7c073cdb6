//! The next step that commands name when they end well.

use std::fs;
use std::path::Path;

use crate::{empty_folder, understudy_in};

/// The commands that were named.
fn named(errors: &str) -> Vec<Vec<String>> {
    let lines = errors.lines().filter_map(|line| {
        let line = line.strip_prefix("next:").or(line.strip_prefix("     "))?;
        line.trim().strip_prefix("understudy ")
    });
    let words = lines.map(|line| line.split(' ').map(str::to_owned).collect());
    words.collect()
}

/// Runs a command and every command that it names, except those of `unrun`, which need a machine of their own.
fn follow(folder: &Path, command: &[&str], unrun: &[&str]) -> usize {
    let answer = understudy_in(folder, command);
    assert_eq!(answer.status, 0, "{command:?}: {}", answer.shown());
    let steps = named(&answer.errors);
    for step in &steps {
        if unrun.contains(&step[0].as_str()) {
            continue;
        }
        let step: Vec<&str> = step.iter().map(String::as_str).collect();
        let next = understudy_in(folder, &step);
        assert_eq!(next.status, 0, "{command:?}, then {step:?}: {}", next.shown());
    }
    steps.len()
}

#[test]
fn the_next_steps_of_a_command_are_commands_that_run() {
    let folder = empty_folder("next");
    let lab = &["lab", "campaign"][..];
    assert_eq!(follow(&folder, &["init", "cell"], lab), 2);
    let cluster = "cell/cluster.toml";
    let simulate = ["simulate", cluster, "--scenario", "cell/kill.toml", "--seed", "1"];
    assert_eq!(follow(&folder, &["check", cluster, "cell/kill.toml"], lab), 2);
    assert_eq!(follow(&folder, &["check", cluster], lab), 2);
    assert_eq!(follow(&folder, &["check", "cell/kill.toml"], lab), 1);
    assert_eq!(follow(&folder, &simulate, lab), 2);
    assert_eq!(follow(&folder, &["verify", cluster], lab), 1);
    assert_eq!(follow(&folder, &["resources", cluster], lab), 1);
    assert_eq!(follow(&folder, &["convert", "cell/tank.ladder", "tank.xml"], lab), 1);
    assert_eq!(follow(&folder, &["parity", cluster, "--output", "p.txt"], lab), 1);
    let other = empty_folder("next_ladder");
    fs::copy(folder.join("tank.xml"), other.join("tank.xml")).expect("copied");
    assert_eq!(follow(&other, &["check", "tank.xml"], lab), 2);
    // Processes have no spare that wakes by its rule.
    fs::write(folder.join("spare.toml"), "title = \"spare\"\ncycles = 50\nspare_after = 20\n")
        .expect("it is ours");
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let line = root.join("examples/shared-spare/line-1/cluster.toml");
    let line = line.to_str().expect("a path");
    let simulate = ["simulate", line, "--scenario", "spare.toml", "--seed", "1"];
    assert_eq!(follow(&folder, &simulate, lab), 1);
    let campaign = ["campaign", cluster, "--runs", "2", "--seed", "1", "--jobs", "1"];
    assert_eq!(follow(&folder, &campaign, &["model-check"]), 1);
}

#[test]
fn what_a_machine_reads_names_no_next_step() {
    let folder = empty_folder("next_machine");
    assert_eq!(understudy_in(&folder, &["init", "."]).status, 0);
    for command in [
        &["check", "cluster.toml", "--json"][..],
        &["convert", "tank.ladder"],
        &["draw", "tank.ladder"],
        &["parity", "cluster.toml", "--as", "st"],
        &["schema", "cluster"],
        &["completions", "bash"],
        &["explain"],
    ] {
        let answer = understudy_in(&folder, command);
        assert_eq!(answer.status, 0, "{command:?}: {}", answer.shown());
        assert!(!answer.shown().contains("next:"), "{command:?}: {}", answer.shown());
    }
    // A command that did not end well has something else to say.
    fs::write(folder.join("tank.ladder"), "program tank\n/\n").expect("written");
    let wrong = understudy_in(&folder, &["check", "cluster.toml"]);
    assert_eq!(wrong.status, 2);
    assert!(!wrong.shown().contains("next:"), "{}", wrong.shown());
}
