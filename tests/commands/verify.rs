//! Proofs of ladders as a person meets them.

use std::fs;
use std::path::Path;

use insta::assert_snapshot;
use serde_json::json;

use crate::{empty_folder, understudy, understudy_in};

const PRESS: &str = "examples/press-cell/press.ladder";

#[test]
fn what_is_proved_and_what_fails_with_a_run() {
    let answer = understudy(&[
        "verify",
        PRESS,
        "--property",
        "move_down only while stop",
        "--property",
        "AG EF move_down",
        "--property",
        "pressing is followed by raising",
    ]);
    assert_snapshot!(answer.shown());
}

#[test]
fn a_ladder_alone_and_a_cluster_are_asked_what_all_are_asked() {
    let ladder = understudy(&["verify", PRESS]);
    assert_eq!(ladder.status, 0, "{}", ladder.shown());
    let cluster = understudy(&["verify", "examples/press-cell/cluster.toml", "--json"]);
    assert_eq!(cluster.status, 0, "{}", cluster.shown());
    let result = &cluster.json()["result"];
    assert_eq!(result["proved"], json!(true));
    assert_eq!(result["programs"].as_array().map(Vec::len), Some(2));
}

#[test]
fn every_wrong_line_of_a_file_is_said_and_nothing_is_proved() {
    let folder = empty_folder("verify");
    let file = folder.join("press.properties");
    fs::write(&file, "AG (move_dwn\nright: AG EF move_down\nnever oops and stop\nfair: AG stop\n")
        .expect("written");
    let answer = understudy(&["verify", PRESS, "--properties", &file.display().to_string()]);
    let shown = answer.shown().replace(&folder.display().to_string(), "FOLDER");
    assert_snapshot!(shown);
}

#[test]
fn a_bound_that_is_too_small_leaves_it_to_other_methods() {
    let check = |property: &str| {
        let robot = "examples/press-cell/robot.ladder";
        let few = ["verify", robot, "--nodes", "20", "--json", "--property"];
        let answer = understudy(&[&few[..], &[property]].concat());
        answer.json()["result"]["programs"][0]["properties"][0]["verdict"].clone()
    };
    assert_eq!(check("never move_down and stop"), json!("holds"));
    assert_eq!(check("AG (move_up -> EF (grip & EF move_left))"), json!("holds"));
}

#[test]
fn what_is_not_decided_in_time_is_said_to_be_undecided() {
    let property = "AG EF gas_valve_high";
    let boiler = "examples/boiler/complete.ladder";
    let asked = ["verify", boiler, "--budget", "1ms", "--property", property];
    let answer = understudy(&[&asked[..], &["--json"]].concat());
    assert_eq!(answer.status, 1, "{}", answer.shown());
    let program = &answer.json()["result"]["programs"][0];
    let found = &program["properties"][0];
    assert_eq!(found["verdict"], json!("undecided"));
    let message = found["message"].as_str().expect("why");
    assert!(message.contains("the time for it was over"), "{message}");
    assert_eq!(program["switches"][0]["verdict"], json!("undecided"));
}

/// A light whose button sets and resets it by the same edge, as a vendor's example does.
const STAIRS: &str = "\
program stairs
input button
output light
rung
    +button /light (S light)
rung
    +button light (R light)
";

#[test]
fn an_edge_that_undoes_itself_is_remarked_on_and_drawn() {
    let folder = empty_folder("verify_remarks");
    let (ladder, page) = (folder.join("stairs.ladder"), folder.join("runs.html"));
    fs::write(&ladder, STAIRS).expect("written");
    let [ladder, page] = [ladder, page].map(|path| path.display().to_string());
    let answer = understudy(&["verify", &ladder, "--draw", &page, "--json"]);
    assert_eq!(answer.status, 1, "{}", answer.shown());
    let result = &answer.json()["result"];
    assert_eq!(result["programs"][0]["remarks"][0]["code"], json!("U0445"), "{result}");
    assert_eq!(result["programs"][0]["switches"][0]["verdict"], json!("never-on"));
    let drawn = fs::read_to_string(&page).expect("the page");
    assert!(drawn.contains("light") && drawn.contains("class=\"live\""));
    let both = understudy(&["verify", &ladder, "--draw", &page, "--smv", "scan"]);
    assert_eq!(both.status, 2, "{}", both.output);
}

const SHUTTLES: &str = "examples/two-shuttles/cluster.toml";

#[test]
fn two_programs_that_read_each_other_are_proved_together() {
    let property = "never left.inside and right.inside";
    let answer = understudy(&["verify", SHUTTLES, "--property", property]);
    assert_eq!(answer.status, 0, "{}", answer.shown());
    assert_snapshot!(answer.shown());
}

/// Changes one text of the example; each change breaks the interlock.
#[test]
fn every_broken_interlock_is_found_with_a_run() {
    let changes = [
        // The right shuttle counts as outside while that is not known.
        (
            "cluster.toml",
            "right_inside = { from = \"right.inside\", default = true",
            "right_inside = { from = \"right.inside\", default = false",
        ),
        // A grant is kept after it was lost.
        (
            "cluster.toml",
            "granted = { from = \"left.grant\", default = false, stale_after = 0",
            "granted = { from = \"left.grant\", default = false, stale_after = 50",
        ),
        // The left shuttle does not wait for the cycle in which its grant may still arrive.
        (
            "left.st",
            "may_enter := NOT grant AND NOT granted AND NOT right_inside",
            "may_enter := NOT grant AND NOT right_inside",
        ),
        (
            "left.st",
            "may_enter := NOT grant AND NOT granted AND NOT right_inside",
            "may_enter := NOT grant AND NOT granted",
        ),
    ];
    for (place, (file, from, to)) in changes.into_iter().enumerate() {
        let folder = empty_folder(&format!("verify_interlock_{place}"));
        for entry in fs::read_dir("examples/two-shuttles").expect("the example") {
            let path = entry.expect("an entry").path();
            let name = path.file_name().expect("a name");
            fs::copy(&path, folder.join(name)).expect("copied");
        }
        let changed = folder.join(file);
        let text = fs::read_to_string(&changed).expect("a text");
        assert!(text.contains(from), "{file} has `{from}`");
        fs::write(&changed, text.replace(from, to)).expect("written");
        let cluster = folder.join("cluster.toml").display().to_string();
        let property = "never left.inside and right.inside";
        let answer = understudy(&["verify", &cluster, "--json", "--property", property]);
        let found = &answer.json()["result"]["programs"][0]["properties"][0];
        assert_eq!(found["verdict"], json!("fails"), "change {place}: {found}");
        let last = |name: &str| {
            let values = found["scans"]["signals"][name].as_array();
            values.and_then(|values| values.last()).cloned()
        };
        assert_eq!(last("left.inside"), Some(json!(1)), "{found}");
        assert_eq!(last("right.inside"), Some(json!(1)), "{found}");
    }
}

#[test]
fn a_program_with_numbers_is_proved_or_its_run_has_the_numbers() {
    let folder = empty_folder("verify_numbers");
    let file = folder.join("tank.st");
    let text = "PROGRAM tank
  VAR_INPUT level : REAL; parts : INT; END_VAR
  VAR_OUTPUT inlet : BOOL; outlet : BOOL; share : INT; END_VAR
  inlet := level < 40.0;
  outlet := level > 60.0;
  share := 100 / parts;
END_PROGRAM
";
    fs::write(&file, text).expect("written");
    let file = file.display().to_string();
    let answer = understudy(&[
        "verify",
        &file,
        "--property",
        "never inlet and outlet",
        "--property",
        "never program.fault",
        "--property",
        "always inlet | outlet",
    ]);
    assert_eq!(answer.status, 1);
    let shown = answer.shown();
    assert_snapshot!(shown.replace(&folder.display().to_string(), "FOLDER"));
}

/// Writes files into a folder and answers with the path of the first one.
fn written(folder: &str, files: &[(&str, &str)]) -> String {
    let folder = empty_folder(folder);
    for (name, text) in files {
        fs::write(folder.join(name), text).expect("written");
    }
    folder.join(files[0].0).display().to_string()
}

const RANGED: &str = "PROGRAM tank
  VAR_INPUT x : INT (10..100); END_VAR
  VAR_OUTPUT high : BOOL; half : BOOL; END_VAR
  high := x > 100 OR x < 10;
  half := x > 50;
END_PROGRAM
";

/// A proof is of the program that stations execute, whose inputs are numbers of their declarations: alone, in a cluster and together.
#[test]
fn inputs_are_values_of_their_declarations() {
    let cluster =
        "[cluster]\nname = \"cell\"\n[[controller]]\nname = \"tank\"\nladder = \"tank.st\"\n";
    let file = written("verify_ranges", &[("tank.st", RANGED), ("cluster.toml", cluster)]);
    let cluster = file.replace("tank.st", "cluster.toml");
    for (file, name) in [(&file, ""), (&cluster, "tank.")] {
        let properties = [format!("never {name}high"), format!("never {name}half")];
        let answer = understudy(&[
            "verify",
            file,
            "--json",
            "--property",
            &properties[0],
            "--property",
            &properties[1],
        ]);
        let found = &answer.json()["result"]["programs"][0]["properties"];
        assert_eq!(found[0]["verdict"], json!("holds"), "{found}");
        assert_eq!(found[1]["verdict"], json!("fails"), "{found}");
        let x = found[1]["scans"]["numbers"][format!("{name}x")][0].as_str();
        let x: i64 = x.expect("it is shown").parse().expect("a number");
        assert!((51..=100).contains(&x), "{found}");
    }
    // Beyond its subrange an input is the end of it, in `scan` as in a station; a file of inputs is refused.
    let undriven = understudy(&["check", &cluster]);
    assert!(undriven.errors.contains("it keeps its initial value 10"), "{}", undriven.shown());
}

#[test]
fn the_understudy_of_programs_with_numbers_is_proved_or_left_out() {
    let cluster = "[cluster]\nname = \"cell\"\n[[controller]]\nname = \"tank\"\nladder = \"tank.st\"\n[[controller]]\nname = \"other\"\nladder = \"other.st\"\n";
    let other = "PROGRAM other VAR_INPUT go : BOOL; END_VAR VAR_OUTPUT n : INT (0..9); END_VAR IF go AND n < 9 THEN n := n + 1; END_IF; END_PROGRAM";
    let real = "PROGRAM other VAR_INPUT t : REAL; END_VAR VAR_OUTPUT hot : BOOL; END_VAR hot := t > 90.0; END_PROGRAM";
    for (other, verdict, line) in [
        (other, "proved", "\nproved: the understudy equals the sum of its members: "),
        (real, "left-out", "\nLEFT OUT: no parity controller is generated and compared"),
    ] {
        let files = [("cluster.toml", cluster), ("tank.st", RANGED), ("other.st", other)];
        let file = written(&format!("verify_understudy_{verdict}"), &files);
        let answer = understudy(&["verify", &file]);
        assert_eq!(answer.status, 0, "{}", answer.shown());
        assert!(answer.output.contains(line), "{}", answer.shown());
        let result = &understudy(&["verify", &file, "--json"]).json()["result"];
        assert_eq!(result["understudy_verdict"], json!(verdict), "{result}");
    }
}

/// What a chosen program reads of another one keeps its initial value: nothing is proved of it, and `scan` warns.
#[test]
fn a_program_that_misses_another_one_is_not_proved() {
    let text =
        "PROGRAM a VAR_INPUT go : BOOL; END_VAR VAR_OUTPUT x : BOOL; END_VAR x := go; END_PROGRAM
PROGRAM b VAR_INPUT i : BOOL; END_VAR VAR_OUTPUT y : BOOL; END_VAR y := a.x; END_PROGRAM
";
    let file = written("verify_missing", &[("two.st", text), ("inputs.txt", "0\n1\n")]);
    let answer = understudy(&["verify", &file, "--program", "b", "--property", "never y"]);
    assert_eq!(answer.status, 2, "{}", answer.shown());
    assert!(answer.errors.contains("error[U1085]: `a.x` is read here"), "{}", answer.shown());
    let together = understudy(&["verify", &file, "--property", "never b.y"]);
    assert_eq!(together.status, 1, "{}", together.shown());
    let inputs = file.replace("two.st", "inputs.txt");
    let answer = understudy(&["scan", &file, "--program", "b", "--inputs", &inputs]);
    assert_eq!(answer.status, 0, "{}", answer.shown());
    assert!(answer.errors.contains("warning[U1085]"), "{}", answer.shown());
    let answer = understudy(&["convert", &file, "--unit", "b", "--to", "ladder"]);
    assert!(answer.errors.contains("U1085"), "{}", answer.shown());
}

#[test]
fn numbers_are_compared_and_inputs_assumed() {
    let folder = empty_folder("verify-numbers");
    let program = folder.join("level.st");
    let text = "\
PROGRAM level
  VAR_INPUT raw : INT; up : BOOL; down : BOOL; END_VAR
  VAR_OUTPUT metres : REAL; valve : BOOL; END_VAR
  VAR pause : TON; END_VAR
  metres := INT_TO_REAL(raw) * 0.001 - 0.5;
  pause(IN := metres > 2.0, PT := T#50ms);
  valve := pause.Q AND NOT up;
END_PROGRAM
";
    fs::write(&program, text).expect("written");
    let properties = folder.join("level.properties");
    let text = "\
assume: raw >= 0        # what the card delivers
assume: raw <= 4095
full: never metres > 3.6
slow: valve only while pause.ET >= T#50ms   # a comment
within 60ms of valve: metres < 2.0
never up & down
";
    fs::write(&properties, text).expect("written");
    let program = program.display().to_string();
    let asked = ["verify", &program, "--properties", &properties.display().to_string()];
    let more = ["--property", "never metres > 3.5", "--assume", "!(up & down)"];
    let answer = understudy(&[&asked[..], &more].concat());
    assert_snapshot!(answer.shown());
    let without = understudy(&["verify", &program, "--property", "never metres > 3.6"]);
    assert_eq!(without.status, 1, "{}", without.shown());
    let inputs = ["verify", &program, "--property", "never up & down", "--json"];
    let message = &understudy(&inputs).json()["result"]["programs"][0]["properties"][0]["message"];
    assert!(message.as_str().is_some_and(|told| told.contains("inputs alone")), "{message}");
    // The text for NuSMV is about the same runs.
    let scan = ["verify", "protocol/cluster/template/minimal/sump.ladder", "--smv", "scan"];
    let asked = ["--property", "never level.CV > 8", "--assume", "!motor"];
    let smv = understudy(&[&scan[..], &asked].concat());
    assert_eq!(smv.status, 0, "{}", smv.shown());
    assert_snapshot!(smv.output.lines().rev().take(3).collect::<Vec<&str>>().join("\n"));
}

/// The verdicts of all properties.
fn verdicts(arguments: &[&str]) -> Vec<String> {
    let answer = understudy(&[&["verify", "--json"], arguments].concat());
    let json = answer.json();
    let properties = json["result"]["programs"][0]["properties"].as_array();
    let properties = properties.unwrap_or_else(|| panic!("{}", answer.shown()));
    let verdict = |property: &serde_json::Value| property["verdict"].as_str().map(str::to_owned);
    properties.iter().filter_map(verdict).collect()
}

#[test]
fn conditions_that_no_run_keeps_prove_nothing() {
    let asked = ["--property", "never move_down", "--property", "always move_down"];
    for (option, condition) in
        [("--fair", "stop & !stop"), ("--fair", "FALSE"), ("--assume", "stop & !stop")]
    {
        let more = [PRESS, option, condition];
        assert_eq!(verdicts(&[&asked[..], &more].concat()), ["undecided"; 2], "{condition}");
    }
    let both = [PRESS, "--assume", "stop", "--fair", "!stop"];
    assert_eq!(verdicts(&[&asked[..], &both].concat()), ["undecided"; 2]);
}

#[test]
fn what_one_run_reaches_can_be_reached() {
    let folder = empty_folder("verify-reached");
    let program = folder.join("once.st");
    let text = "\
PROGRAM once
  VAR_INPUT auto : BOOL; END_VAR
  VAR_OUTPUT run : BOOL; END_VAR
  VAR over : BOOL; END_VAR
  run := auto AND NOT over;
  over := TRUE;
END_PROGRAM
";
    fs::write(&program, text).expect("written");
    let program = program.display().to_string();
    let asked = ["--property", "run can be reached", "--property", "never run"];
    assert_eq!(verdicts(&[&asked[..], &[&program]].concat()), ["holds", "fails"]);
    let without = [&program, "--assume", "!auto"];
    assert_eq!(verdicts(&[&asked[..], &without].concat()), ["fails", "holds"]);
}

#[test]
fn counts_and_blocks_of_ladders_in_a_cluster_have_names() {
    let asked = [
        "examples/assembly-cell/cluster.toml",
        "--property",
        "never packer.parts.CV > 4",
        "--property",
        "packer.parts.Q only while packer.parts.CV = 4",
        "--property",
        "packer.parts.CV = 2 can be reached",
    ];
    assert_eq!(verdicts(&asked), ["holds"; 3]);
}

#[test]
fn a_count_is_compared_with_what_it_can_be() {
    let folder = empty_folder("verify-counts");
    let reset = "program p\ninput a\noutput y\nrung a {CTU c 2 R=a} ( y )\n";
    let held = "program p\ninput a\noutput y\nrung a {CTU c 3 R=[ a | /a ]} ( y )\n";
    for (name, text) in [("reset", reset), ("held", held)] {
        let file = format!("{name}.ladder");
        fs::write(folder.join(&file), text).expect("written");
        let ask =
            |property: &str| understudy_in(&folder, &["verify", &file, "--property", property]);
        // An INT has no such value, whatever the counter does.
        for property in ["never c.CV >= 40000", "c.CV >= 32768 can be reached"] {
            let answer = ask(property);
            assert_eq!(answer.status, 2, "{}", answer.shown());
            assert!(answer.errors.contains("U0435"), "{}", answer.shown());
        }
        for property in ["never c.CV > 3", "always c.CV < 32767"] {
            let answer = ask(property);
            let proved = format!("proved    {property}");
            assert!(answer.output.contains(&proved), "{}", answer.shown());
        }
    }
}

/// A counterexample of a cluster is a scenario in which the simulator drives the same outputs.
#[test]
fn a_counterexample_is_a_scenario() {
    let folder = empty_folder("verify_scenario");
    let examples = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples");
    let cell = examples.join("press-cell/cluster.toml");
    let cell = cell.to_str().expect("text");
    let property = "never press.move_up and press.move_down";
    let asked = ["verify", cell, "--property", property, "--scenario", "fails.toml"];
    let failed = understudy_in(&folder, &asked);
    assert_eq!(failed.status, 1, "{}", failed.shown());
    let simulate = ["simulate", cell, "--scenario", "fails.toml", "--seed", "1", "--out", "runs"];
    assert_eq!(understudy_in(&folder, &simulate).status, 0);
    let journal = ["journal", "runs/latest", "--event", "applied", "--from", "599", "--to", "602"];
    let applied = understudy_in(&folder, &journal).output;
    let drives = |cycle: u64| {
        let mut lines = applied.lines().map(str::trim_start);
        let line =
            lines.find(|line| line.starts_with(&format!("{cycle} ")) && line.contains("press-io"));
        line.unwrap_or_default().to_owned()
    };
    assert!(drives(600).contains("drives 00"), "{applied}");
    assert!(drives(601).contains("drives 11"), "{applied}");
    // Nothing fails, nothing to fail, or programs that read each other: no scenario, and why.
    let shuttles = examples.join("two-shuttles/cluster.toml");
    let shuttles = shuttles.to_str().expect("text");
    for (cluster, property, said) in [
        (cell, "always press.move_up | !press.move_up", "no property fails"),
        (cell, "never press.move_up and press.stop", "`press` misses a sample"),
        (shuttles, "never left.grant", "reads signals of other programs"),
    ] {
        let asked = ["verify", cluster, "--property", property, "--scenario", "none.toml"];
        let answer = understudy_in(&folder, &asked);
        assert!(answer.output.contains(said), "{}", answer.shown());
        assert!(!folder.join("none.toml").exists());
    }
    let alone = examples.join("press-cell/press.ladder");
    let alone = alone.to_str().expect("text");
    let asked = ["verify", alone, "--property", "never stop", "--scenario", "none.toml"];
    assert!(understudy_in(&folder, &asked).errors.contains("U0437"));
}
