//! A rehearsal of an online change: what the new program would have done with the samples of a run.

use std::fs;
use std::path::PathBuf;

use serde_json::Value;

use crate::{empty_folder, understudy_in};

/// A simulated run of the press cell, and beside its files those of a cell whose press has `new` in the place of `old`.
fn cells(name: &str, (old, new): (&str, &str)) -> PathBuf {
    let folder = empty_folder(&format!("rehearsal_{name}"));
    for part in ["old", "new"] {
        fs::create_dir(folder.join(part)).expect("a folder");
        for file in ["cluster.toml", "press.ladder", "robot.ladder"] {
            let from = format!("{}/examples/press-cell/{file}", env!("CARGO_MANIFEST_DIR"));
            let text = fs::read_to_string(from).expect("a file of the example");
            let changed = text.replace(old, new);
            let is_changed = (part, file) == ("new", "press.ladder");
            assert!(!is_changed || changed != text, "nothing is replaced");
            fs::write(folder.join(part).join(file), if is_changed { changed } else { text })
                .expect("written");
        }
    }
    let run = ["simulate", "old/cluster.toml", "--cycles", "900", "--seed", "1", "--out", "runs"];
    let answer = understudy_in(&folder, &run);
    assert_eq!(answer.status, 0, "{}", answer.shown());
    folder
}

/// What a rehearsal says of a changed press, and how it ends.
fn rehearsed(name: &str, change: (&str, &str), more: &[&str]) -> (i32, Value) {
    let folder = cells(name, change);
    let rehearse = ["change", "runs/latest", "new/cluster.toml", "rehearse", "--json"];
    let answer = understudy_in(&folder, &[&rehearse[..], more].concat());
    let document = answer.json();
    let found = document["result"]["rehearsed"][0].clone();
    assert_eq!(found["program"], "press", "{}", answer.shown());
    (answer.status, found)
}

#[test]
fn a_program_that_does_the_same_has_no_difference() {
    // The ram is never up and down at once, so this differs in no cycle of the run.
    let interlock = (
        "pressing /ram_down ] /stop ( pressing )",
        "pressing /ram_down ] [ /ram_up | /ram_down ] /stop ( pressing )",
    );
    let (exit, found) = rehearsed("interlock", interlock, &["--cycles", "800"]);
    assert_eq!((exit, &found["differing"]), (0, &Value::from(0)), "{found:#}");
    assert!(found["cycles"].as_u64() >= Some(700), "{found:#}");
}

#[test]
fn an_output_that_differs_at_once_is_told_from_one_that_drifts() {
    // A negated output differs in every cycle, and from every state.
    let negated = ("    pressing /stop ( move_down )", "    pressing /stop ( /move_down )");
    let (exit, found) = rehearsed("negated", negated, &[]);
    let down = &found["outputs"]["move_down"];
    assert_eq!(exit, 1, "{found:#}");
    assert_eq!(found["differing"], found["cycles"], "{found:#}");
    assert_eq!((&down["cycles"], &down["at_once"]), (&found["cycles"], &found["cycles"]));
    assert_eq!(found["first"]["scans"], 0, "{found:#}");
    // A press that never raises its ram drives what the old one does from each of its states, until its own memory is another one.
    let kept =
        ("[ ram_down | raising /ram_up ] /stop ( raising )", "raising /ram_up /stop ( raising )");
    let (exit, found) = rehearsed("drift", kept, &["--renew", "50"]);
    let up = &found["outputs"]["move_up"];
    assert_eq!((exit, &up["at_once"]), (1, &Value::from(0)), "{found:#}");
    assert!(up["cycles"].as_u64() > Some(0), "{found:#}");
    assert!(found["first"]["scans"].as_u64() > Some(0), "{found:#}");
}

#[test]
fn a_rehearsal_needs_a_run() {
    let negated = ("    pressing /stop ( move_down )", "    pressing /stop ( /move_down )");
    let folder = cells("no_run", negated);
    let answer =
        understudy_in(&folder, &["change", "old/cluster.toml", "new/cluster.toml", "rehearse"]);
    assert_eq!(answer.status, 2, "{}", answer.shown());
    assert!(answer.errors.contains("U0614"), "{}", answer.shown());
}

/// The new program has the samples at the places of its own inputs, and an output that only one of the two programs has is not compared.
#[test]
fn a_program_with_other_points_is_rehearsed_by_those_that_stay() {
    let folder = empty_folder("rehearsal_points");
    let cluster = "[cluster]\nname = \"cell\"\nperiod = \"10ms\"\nsecurity = \"off\"\n[[controller]]\nname = \"one\"\nladder = \"one.st\"\n\
                   [[remote_io]]\ncontroller = \"one\"\n";
    let program = |inputs: &str, outputs: &str, body: &str| {
        format!(
            "PROGRAM one\nVAR_INPUT {inputs} END_VAR\nVAR_OUTPUT {outputs} END_VAR\nVAR count : INT; END_VAR\ncount := count + 1;\n{body}\nEND_PROGRAM\n"
        )
    };
    let old =
        program("level : INT := 3;", "shown : INT; sum : INT;", "shown := count; sum := level;");
    let outputs = "extra : LREAL; sum : INT; shown : INT;";
    let inputs = "more : REAL; level : INT := 3;";
    let same = program(inputs, outputs, "extra := 1.0; shown := count; sum := level;");
    let other = program(inputs, outputs, "extra := 1.0; shown := count + 1; sum := level;");
    let lone = program(inputs, "extra : LREAL; shown : LREAL;", "extra := 1.0;");
    for (name, text) in [("old", &old), ("same", &same), ("other", &other), ("lone", &lone)] {
        fs::create_dir(folder.join(name)).expect("a folder");
        fs::write(folder.join(name).join("cluster.toml"), cluster).expect("written");
        fs::write(folder.join(name).join("one.st"), text).expect("written");
    }
    let run = ["simulate", "old/cluster.toml", "--cycles", "100", "--seed", "1", "--out", "runs"];
    let answer = understudy_in(&folder, &run);
    assert_eq!(answer.status, 0, "{}", answer.shown());
    let rehearsed = |new: &str| {
        let file = format!("{new}/cluster.toml");
        let answer =
            understudy_in(&folder, &["change", "runs/latest", &file, "rehearse", "--json"]);
        let found = answer.json()["result"]["rehearsed"][0].clone();
        assert!(found["cycles"].as_u64() >= Some(50), "{}", answer.shown());
        (answer.status, found)
    };
    let (exit, found) = rehearsed("same");
    assert_eq!((exit, &found["differing"]), (0, &Value::from(0)), "{found:#}");
    assert_eq!(found["compared"], serde_json::json!(["shown", "sum"]), "{found:#}");
    assert_eq!(found["not_compared"], serde_json::json!(["extra"]), "{found:#}");
    let told = understudy_in(&folder, &["change", "runs/latest", "same/cluster.toml", "rehearse"]);
    assert!(told.output.contains("equal in shown, sum\n  not compared: extra"), "{}", told.output);
    let none = understudy_in(&folder, &["change", "runs/latest", "lone/cluster.toml", "rehearse"]);
    assert!(none.status == 2 && none.errors.contains("no output of `one`"), "{}", none.shown());
    let (exit, found) = rehearsed("other");
    let outputs: Vec<&String> = found["outputs"].as_object().expect("outputs").keys().collect();
    assert_eq!((exit, &outputs[..]), (1, &[&"shown".to_owned()][..]), "{found:#}");
}
