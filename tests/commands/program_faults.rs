//! Program faults of every kind as an operator sees them: with the line of the program's text and the values, until the release.

use std::fs;
use std::path::PathBuf;

use crate::{empty_folder, understudy_in};

const PROGRAM: &str = "PROGRAM mixer
  VAR_INPUT divisor : DINT; place : DINT; factor : REAL; passes : DINT; END_VAR
  VAR_OUTPUT valve : REAL; motor : DINT; END_VAR
  VAR amounts : ARRAY [1..3] OF REAL := [1.0, 2.0, 1.5]; n : DINT; END_VAR
  valve := amounts[place] * 10.0 * factor;
  motor := 2100 / divisor;
  n := 0;
  WHILE n < passes DO
    n := n + 1;
  END_WHILE;
END_PROGRAM
";

const CLUSTER: &str = r#"
[cluster]
name = "mixing"
period = "20ms"

[[controller]]
name = "mixer"
ladder = "mixer.st"

[[remote_io]]
controller = "mixer"

[remote_io.inputs]
divisor = { operator = "setpoint", low = 0, high = 10, initial = 4 }
place = { operator = "setpoint", low = 0, high = 5, initial = 1 }
factor = { operator = "setpoint", low = 0.0, high = 3.0e38, initial = 1.0 }
passes = { operator = "setpoint", low = 0, high = 2000000000, initial = 3 }
"#;

/// A run in which an operator's value stops the program, and another one with a release lets it run again.
fn run(name: &str, input: &str, bad: &str, good: &str) -> PathBuf {
    let folder = empty_folder(name);
    let step = |at: u32, action: &str, more: &str| {
        format!("[[step]]\nat = {at}\naction = \"{action}\"\nstation = \"mixer-io\"\n{more}\n")
    };
    let write = |value: &str| format!("input = \"{input}\"\nvalue = {value}");
    let scenario = [
        "title = \"A program fault\"\ncycles = 120\n".to_owned(),
        step(20, "write", &write(bad)),
        step(60, "write", &write(good)),
        step(80, "release", ""),
    ];
    fs::write(folder.join("mixer.st"), PROGRAM).expect("written");
    fs::write(folder.join("cluster.toml"), CLUSTER).expect("written");
    fs::write(folder.join("scenario.toml"), scenario.concat()).expect("written");
    let arguments =
        ["simulate", "cluster.toml", "--scenario", "scenario.toml", "--seed", "1", "--out", "runs"];
    let answer = understudy_in(&folder, &arguments);
    assert_eq!(answer.status, 0, "{}", answer.shown());
    folder
}

#[track_caller]
fn check(name: &str, [input, bad, good]: [&str; 3], line: u32, told: &str, causes: &[&str]) {
    let folder = run(name, input, bad, good);
    let journal = understudy_in(&folder, &["journal"]).output;
    assert!(journal.contains(told), "{journal}");
    let top = understudy_in(&folder, &["top", "--once", "--json"]).json();
    let alarms = top["result"]["alarms"].to_string();
    assert!(alarms.contains(told), "{alarms}");
    assert_eq!(top["result"]["programs"][0]["source"], "direct", "{top:#}");

    let why = understudy_in(&folder, &["why", "mixer.valve", "--at", "40"]).output;
    let lines: Vec<&str> = why.lines().collect();
    assert!(lines.len() < 40, "{why}");
    assert!(why.contains(&format!("[line {line} \"")), "{why}");
    for cause in causes {
        assert!(why.contains(cause), "{cause}: {why}");
    }
    let after = understudy_in(&folder, &["why", "mixer.valve", "--at", "110", "--json"]).json();
    assert_eq!(after["result"]["source"], "direct", "{after:#}");
}

#[test]
fn a_division_by_zero_is_told_with_its_line() {
    let told = "program fault in mixer: mixer, line 6: division of 2100 by zero";
    check("fault_division", ["divisor", "0", "3"], 6, told, &["divisor = 0: input"]);
}

#[test]
fn an_index_out_of_range_is_told_with_its_line() {
    let told = "program fault in mixer: mixer, line 5: index 4 is outside the array, whose last index is 3";
    check("fault_index", ["place", "4", "2"], 5, told, &["place = 4: input"]);
}

#[test]
fn an_output_that_is_not_finite_is_told_with_the_line_that_assigned_it() {
    let told = "program fault in mixer: output valve is INF, which is not a finite number, assigned in line 5";
    let causes = ["amounts[1] = 1.0: its initial value", "factor = 3e+38: input"];
    check("fault_infinity", ["factor", "3.0e38", "1.0"], 5, told, &causes);
}

#[test]
fn an_exceeded_budget_is_told_with_its_line_and_explained_shortly() {
    let told = "program fault in mixer: mixer, line 8: the loops of one scan exceed the budget of 1000000 operations";
    let causes = ["passes = 2000000000: input", "n = "];
    check("fault_budget", ["passes", "2000000000", "1"], 8, told, &causes);
}
