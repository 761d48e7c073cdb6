//! The plan of an online change: which outputs can differ.

mod ladders;

use std::fs;
use std::path::Path;

use serde_json::Value;

use crate::{empty_folder, understudy, understudy_in};

const OLD: &str = "examples/online-change/cluster.toml";
const NEW: &str = "examples/online-change/new/cluster.toml";

/// The verdict about an output of the only program that changes.
fn verdict<'a>(json: &'a Value, output: &str) -> &'a Value {
    let outputs = json["result"]["differences"][0]["outputs"].as_array();
    let mut outputs = outputs.into_iter().flatten();
    outputs.find(|told| told["output"] == output).unwrap_or_else(|| panic!("{output}: {json}"))
}

fn write(folder: &Path, name: &str, text: &str) {
    write_with(folder, name, text, "");
}

/// With settings of the remote I/O.
fn write_with(folder: &Path, name: &str, text: &str, settings: &str) {
    let cluster = "[cluster]\nname = \"cell\"\nperiod = \"10ms\"\nsecurity = \"off\"\n\n[[controller]]\nname = \"one\"\nladder = \"one.st\"\n\n\
         [[remote_io]]\ncontroller = \"one\"\n";
    let folder = folder.join(name);
    fs::create_dir_all(&folder).expect("a folder");
    let cluster = format!("{cluster}{settings}\n");
    fs::write(folder.join("cluster.toml"), cluster).expect("a cluster");
    fs::write(folder.join("one.st"), text).expect("a program");
}

#[test]
fn the_plan_shows_a_run_in_which_an_output_differs() {
    let answer = understudy(&["change", OLD, NEW, "--json"]);
    assert_eq!(answer.status, 0, "{}", answer.errors);
    let json = answer.json();
    let running = verdict(&json, "running");
    assert_eq!(running["verdict"], "differs", "{json}");
    let signals = &running["run"]["signals"];
    let last = running["run"]["differs_in_scan"].as_u64().expect("a scan") as usize;
    assert_ne!(signals["old.running"][last], signals["new.running"][last], "{running}");
    assert_eq!(signals["stop"][last], true, "{running}");
    let text = understudy(&["change", OLD, NEW]).output;
    assert!(text.contains("`running` can differ"), "{text}");
}

#[test]
fn what_is_equal_is_proved_and_a_longer_delay_differs_only_later() {
    let folder = empty_folder("change_equal");
    let program = |condition: &str, delay: &str| {
        format!(
            "PROGRAM one\n VAR_INPUT start, stop : BOOL; END_VAR\n VAR_OUTPUT valve, lamp : BOOL; END_VAR\n VAR wait : TON; END_VAR\n\
             wait(IN := start, PT := {delay});\n valve := {condition};\n lamp := wait.Q AND NOT stop;\nEND_PROGRAM\n"
        )
    };
    write(&folder, "old", &program("start AND NOT stop", "T#50ms"));
    write(&folder, "same", &program("NOT (NOT start OR stop)", "T#50ms"));
    write(&folder, "longer", &program("start AND NOT stop", "T#70ms"));
    let json =
        understudy_in(&folder, &["change", "old/cluster.toml", "same/cluster.toml", "--json"])
            .json();
    for output in ["valve", "lamp"] {
        assert_eq!(verdict(&json, output)["verdict"], "equal", "{json}");
    }
    let json =
        understudy_in(&folder, &["change", "old/cluster.toml", "longer/cluster.toml", "--json"])
            .json();
    assert_eq!(verdict(&json, "valve")["verdict"], "equal", "{json}");
    let lamp = verdict(&json, "lamp");
    assert_eq!(lamp["verdict"], "differs", "{json}");
    assert_eq!(
        lamp["run"]["differs_in_scan"], 5,
        "the old delay is over in the sixth scan: {lamp}"
    );
}

#[test]
fn what_is_not_followed_is_undecided_with_the_variable() {
    let folder = empty_folder("change_numbers");
    let program = |factor: &str| {
        format!(
            "PROGRAM one\n VAR_INPUT level : REAL; END_VAR\n VAR_OUTPUT high, low : BOOL; END_VAR\n VAR mean : REAL; END_VAR\n\
             mean := mean * 0.9 + level * {factor};\n high := mean > 80.0;\n low := level < 10.0;\nEND_PROGRAM\n"
        )
    };
    write(&folder, "old", &program("0.1"));
    write(&folder, "new", &program("0.10001"));
    let answer = understudy_in(
        &folder,
        &["change", "old/cluster.toml", "new/cluster.toml", "--json", "--budget", "5s"],
    );
    assert_eq!(answer.status, 0, "{}", answer.errors);
    let json = answer.json();
    assert_eq!(verdict(&json, "low")["verdict"], "equal", "{json}");
    let high = verdict(&json, "high");
    assert_ne!(high["verdict"], "equal", "{json}");
    if high["verdict"] == "undecided" {
        assert!(high["reason"].as_str().is_some_and(|why| why.contains("level")), "{high}");
    }
}

/// A value that cannot be followed through the switch takes nothing from the proof of the outputs that do not depend on it.
#[test]
fn a_value_that_is_not_followed_leaves_the_rest_proved() {
    let folder = empty_folder("change_any_value");
    let program = |of: &str, last: u32| {
        format!(
            "PROGRAM one\n VAR_INPUT start, stop : BOOL; END_VAR\n VAR_OUTPUT valve, full : BOOL; END_VAR\n VAR parts : {of}; wait : TON; END_VAR\n\
             IF start THEN parts := parts + 1; END_IF;\n IF stop OR parts > {last} THEN parts := 0; END_IF;\n\
             wait(IN := start, PT := T#50ms);\n valve := wait.Q AND NOT stop;\n full := parts = {last};\nEND_PROGRAM\n"
        )
    };
    write(&folder, "old", &program("DINT", 5));
    write(&folder, "new", &program("INT", 5));
    let json =
        understudy_in(&folder, &["change", "old/cluster.toml", "new/cluster.toml", "--json"])
            .json();
    assert_eq!(verdict(&json, "valve")["verdict"], "equal", "{json}");
    let full = verdict(&json, "full");
    assert_eq!(full["verdict"], "undecided", "{json}");
    let why = full["reason"].as_str().unwrap_or_default();
    assert!(why.contains("`parts` has another type"), "{full}");
}

/// A value goes on in a type that has all values, and the proof follows it: the counter is equal up to its reset, and a longer count is another one.
#[test]
fn a_value_in_a_wider_type_is_followed_through_the_switch() {
    let folder = empty_folder("change_wider");
    let program = |of: &str, last: u32| {
        format!(
            "PROGRAM one\n VAR_INPUT start, stop : BOOL; END_VAR\n VAR_OUTPUT full, half : BOOL; END_VAR\n VAR parts : {of}; END_VAR\n\
             IF start THEN parts := parts + 1; END_IF;\n IF stop OR parts > {last} THEN parts := 0; END_IF;\n\
             full := parts = 5;\n half := parts = 2;\nEND_PROGRAM\n"
        )
    };
    for [before, now] in [["INT", "DINT"], ["USINT", "LINT"], ["SINT", "INT"]] {
        write(&folder, "old", &program(before, 5));
        for (last, expected) in [(5, "equal"), (6, "differs")] {
            write(&folder, "new", &program(now, last));
            let asked = ["change", "old/cluster.toml", "new/cluster.toml", "--json"];
            let json = understudy_in(&folder, &asked).json();
            for output in ["full", "half"] {
                let found = &verdict(&json, output)["verdict"];
                assert_eq!(found, expected, "{before} to {now}, {last}, {output}: {json}");
            }
        }
    }
}

#[test]
fn the_plan_lists_settings_and_what_needs_a_stop_beside_them() {
    let folder = empty_folder("change_settings");
    let program = "PROGRAM one\n VAR_INPUT start : BOOL; END_VAR\n VAR_OUTPUT valve : BOOL; END_VAR\n valve := start;\nEND_PROGRAM\n";
    let settings = "hold_cycles = 10\nfail_safe = { valve = true }";
    let twin = "twin = { name = \"second\", wiring = \"exclusive\" }";
    write(&folder, "old", program);
    write_with(&folder, "new", program, settings);
    write_with(&folder, "stop", program, &format!("{settings}\n{twin}"));
    let change = |new: &str, more: &[&str]| {
        let new = format!("{new}/cluster.toml");
        understudy_in(&folder, &[&["change", "old/cluster.toml", &new], more].concat())
    };
    let plan = change("new", &[]);
    assert_eq!(plan.status, 0, "{}", plan.errors);
    assert_eq!(
        plan.output.trim(),
        "From `accept` on, and no sooner:\n  `hold_cycles` of remote I/O `one-io` changes from `3` to `10`\n  `fail_safe.valve` of remote I/O `one-io` changes from `FALSE` to `TRUE`"
    );
    let json = change("new", &["--json"]).json();
    let settings = &json["result"]["settings"];
    assert_eq!(settings[0]["of"], "remote I/O one-io", "{json}");
    assert_eq!(
        (&settings[0]["setting"], &settings[0]["now"]),
        (&"hold_cycles".into(), &"10".into())
    );
    // There is no program to compute with, or to change between two cycles.
    for step in ["rehearse", "switch"] {
        let answer = change("new", &[step]);
        assert_eq!(answer.status, 0, "{}", answer.errors);
        assert!(answer.output.contains("count from `accept` on"), "{}", answer.output);
    }
    let refused = change("stop", &["--json"]);
    let json = refused.json();
    let failures = json["failures"].as_array().expect("failures");
    assert!(failures.iter().all(|failure| failure["code"] == "U0630"), "{json}");
    let last = failures.last().and_then(|failure| failure["message"].as_str());
    assert!(last.is_some_and(|it| it.contains("`twin` of remote I/O `one-io` changes")), "{json}");
    let equal = change("old", &["prepare"]);
    assert_eq!(equal.status, 2, "{}", equal.output);
    assert!(equal.errors.contains("there is nothing to change"), "{}", equal.errors);
}

/// The plan lists inputs and outputs that change, and compares the outputs that both programs have with the same type: `valve` does the same, and `lamp` does
/// not, by an input that only the new program has.
#[test]
fn the_plan_lists_points_and_compares_those_that_stay() {
    let folder = empty_folder("change_points");
    let old = "PROGRAM one\n VAR_INPUT start : BOOL; level : INT; END_VAR\n VAR_OUTPUT valve, lamp : BOOL; shown : INT; END_VAR\n\
               valve := start; lamp := start; shown := level;\nEND_PROGRAM\n";
    let new = "PROGRAM one\n VAR_INPUT more : BOOL; start : BOOL; level : REAL; END_VAR\n VAR_OUTPUT shown : REAL; lamp, valve : BOOL; END_VAR\n\
               valve := start; lamp := start AND more; shown := level;\nEND_PROGRAM\n";
    write(&folder, "old", old);
    write_with(&folder, "new", new, "fail_safe = { shown = 1.5 }");
    let change = ["change", "old/cluster.toml", "new/cluster.toml", "--drop"];
    let answer = understudy_in(&folder, &change);
    assert_eq!(answer.status, 0, "{}", answer.errors);
    for line in [
        "  new        input more  BOOL",
        "  retyped    input level  INT to REAL, its value is not kept",
        "  retyped    output shown  INT to REAL, its value is not kept, fail-safe `1.5`",
        "one: proved equal in `valve`, not in `lamp`, from every state of the old program on",
        "  not compared: `shown` has another type",
    ] {
        assert!(answer.output.lines().any(|it| it == line), "{line}: {}", answer.output);
    }
    let json = understudy_in(&folder, &[&change[..], &["--json"]].concat()).json();
    assert_eq!(verdict(&json, "valve")["verdict"], "equal", "{json}");
    let lamp = verdict(&json, "lamp");
    assert_eq!(lamp["verdict"], "differs", "{json}");
    let last = lamp["run"]["differs_in_scan"].as_u64().expect("a scan") as usize;
    assert_eq!(lamp["run"]["signals"]["more"][last], false, "{lamp}");
    let outputs = json["result"]["differences"][0]["outputs"].as_array().expect("outputs");
    assert!(outputs.iter().all(|output| output["output"] != "shown"), "{json}");
    let points = json["result"]["plan"][0]["points"].as_array().expect("points");
    let shown = points.iter().find(|point| point["point"] == "shown").expect("it is listed");
    assert_eq!((&shown["side"], &shown["fate"]), (&"output".into(), &"retyped".into()), "{json}");
    // Not with a twin.
    let twin = "twin = { name = \"second\", wiring = \"exclusive\" }";
    write_with(&folder, "old", old, twin);
    write_with(&folder, "new", new, twin);
    let refused = understudy_in(&folder, &change);
    assert_eq!(refused.status, 2, "{}", refused.output);
    let why = "error[U0630]: the inputs or outputs of `one` cannot change while it runs: its remote I/O has a twin";
    assert!(refused.errors.contains(why), "{}", refused.errors);
}

/// Outputs with other names are compared by the declared pairs, with the inputs that have other names; those that the two programs do not have in common are
/// named, and nothing is said of all outputs then. An enumeration whose names have other numbers is another point on both sides.
#[test]
fn the_proof_says_which_outputs_it_compares() {
    let folder = empty_folder("change_compared");
    let program = |types: &str, input: &str, outputs: &str, body: &str| {
        format!(
            "{types}PROGRAM one\n VAR_INPUT {input}; END_VAR\n VAR_OUTPUT {outputs} END_VAR\n {body}\nEND_PROGRAM\n"
        )
    };
    let check = |[old, new]: [&str; 2], renamed: &str, told: &[&str], verdicts: &[(&str, &str)]| {
        write(&folder, "old", old);
        write(&folder, "new", new);
        let file = folder.join("new/cluster.toml");
        let text = fs::read_to_string(&file).expect("it was written");
        let pairs = format!("ladder = \"one.st\"\nrenamed = {{ {renamed} }}");
        fs::write(&file, text.replace("ladder = \"one.st\"", &pairs)).expect("written");
        let asked = ["change", "old/cluster.toml", "new/cluster.toml"];
        let text = understudy_in(&folder, &asked).shown();
        for line in told {
            assert!(text.lines().any(|it| it == *line), "{line}: {text}");
        }
        let json = understudy_in(&folder, &[&asked[..], &["--json"]].concat()).json();
        let outputs = json["result"]["differences"][0]["outputs"].as_array().expect("outputs");
        let found: Vec<(&str, &str)> = outputs
            .iter()
            .map(|it| {
                (it["output"].as_str().expect("a name"), it["verdict"].as_str().expect("one"))
            })
            .filter(|(name, _)| *name != "program.fault")
            .collect();
        assert_eq!(found, verdicts, "{json}");
    };
    let from = ", from every state of the old program on";
    let old = program("", "go : BOOL", "valve, lamp : BOOL;", "valve := go; lamp := NOT go;");
    let new = program("", "start : BOOL", "tap, lamp : BOOL;", "tap := start; lamp := start;");
    let pairs = "go = \"start\", valve = \"tap\"";
    let told = [format!("one: proved equal but for `lamp`{from}")];
    let verdicts = [("tap", "equal"), ("lamp", "differs")];
    check([&old, &new], pairs, &told.each_ref().map(String::as_str), &verdicts);
    // Without the pairs there is nothing in common but the lamp.
    let told = ["  not compared: `valve` is removed, `tap` is new"];
    check([&old, &new], "", &told, &[("lamp", "differs")]);
    let only = program("", "start : BOOL", "tap : BOOL;", "tap := start;");
    let none = [format!("one: no output is compared{from}")];
    check([&old, &only], "", &none.each_ref().map(String::as_str), &[]);
    let modes = |values: &str| {
        let types = format!("TYPE Mode : ({values}); END_TYPE\n");
        program(&types, "want : Mode", "is : Mode; on : BOOL;", "is := want; on := want = Auto;")
    };
    let told = [
        "  retyped    input want  Mode (Off 0, Auto 1) to Mode (Auto 0, Off 1), its value is not kept",
        "  not compared: `is` has another type",
    ];
    let both = [modes("Off, Auto"), modes("Auto, Off")];
    check(both.each_ref().map(String::as_str), "", &told, &[("on", "differs")]);
}

/// What differs between the files and no change touches is told, also where nothing else differs; and a first signal of another program is refused.
#[test]
fn the_plan_tells_what_it_leaves() {
    let folder = empty_folder("change_left");
    let program = "PROGRAM one\n VAR_INPUT start : BOOL; END_VAR\n VAR_OUTPUT valve : BOOL; END_VAR\n valve := start;\nEND_PROGRAM\n";
    write_with(&folder, "old", program, "address = \"127.0.0.1:7700\"");
    write_with(&folder, "new", program, "address = \"127.0.0.1:7701\"");
    let other = program.replace(":= start", ":= NOT start");
    write_with(&folder, "other", &other, "address = \"127.0.0.1:7701\"");
    let line =
        "  `address` of remote I/O `one-io` changes from `127.0.0.1:7700` to `127.0.0.1:7701`";
    for new in ["new", "other"] {
        let file = format!("{new}/cluster.toml");
        let answer = understudy_in(&folder, &["change", "old/cluster.toml", &file]);
        assert_eq!(answer.status, 0, "{}", answer.errors);
        assert!(answer.output.lines().any(|it| it == line), "{}", answer.output);
        let nothing = answer.output.contains("there is nothing to change");
        assert_eq!(nothing, new == "new", "{}", answer.output);
        let json = understudy_in(&folder, &["change", "old/cluster.toml", &file, "--json"]).json();
        assert_eq!(json["result"]["later"][0]["setting"], "address", "{json}");
    }
    let prepared =
        understudy_in(&folder, &["change", "old/cluster.toml", "new/cluster.toml", "prepare"]);
    assert_eq!(prepared.status, 2, "{}", prepared.output);
    assert!(prepared.errors.contains("`address` of remote I/O"), "{}", prepared.errors);
}
