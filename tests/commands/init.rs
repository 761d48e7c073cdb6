//! `understudy init`: templates, and clusters of programs that exist.

use std::fs;
use std::path::Path;

use serde_json::Value;

use crate::{Answer, empty_folder, understudy_in};

fn example(name: &str) -> String {
    format!("{}/examples/{name}", env!("CARGO_MANIFEST_DIR"))
}

/// `init` into the folder `cell` of `folder`.
fn init(folder: &Path, from: &[&str]) -> Answer {
    understudy_in(folder, &[&["init", "cell", "--from"], from].concat())
}

/// What was written runs: `check` reminds of nothing but two marks for each program, and the scenario passes.
fn check_it_runs(folder: &Path, controllers: &[&str]) {
    let checked = ["check", "cell/cluster.toml", "cell/kill.toml", "--json"];
    let checked = understudy_in(folder, &checked);
    assert_eq!(checked.status, 0, "{}", checked.shown());
    let document = checked.json();
    let found = document["diagnostics"].as_array().expect("a list");
    let drafted = found.iter().filter(|found| {
        let file = found["file"].as_str().unwrap_or_default();
        file == "cell/cluster.toml" || file == "cell/kill.toml" || file.ends_with("-plant.ladder")
    });
    let codes: Vec<&Value> = drafted.map(|found| &found["code"]).collect();
    assert!(codes.iter().all(|code| *code == "U0255"), "{document}");
    assert_eq!(codes.len(), 2 * controllers.len(), "{document}");
    let run = ["simulate", "cell/cluster.toml", "--scenario"];
    let run = [&run[..], &["cell/kill.toml", "--seed", "1", "--json"]].concat();
    let answer = understudy_in(folder, &run);
    assert_eq!(answer.status, 0, "{}", answer.shown());
    let summary = &answer.json()["result"]["summary"];
    let remote_ios = summary["remote_ios"].as_array().expect("a list");
    let names: Vec<&str> =
        remote_ios.iter().map(|remote_io| remote_io["name"].as_str().expect("a name")).collect();
    let expected: Vec<String> = controllers.iter().map(|name| format!("{name}-io")).collect();
    assert_eq!(names, expected);
    for remote_io in remote_ios {
        let reconstructed = remote_io["counts"]["reconstructed"].as_u64();
        assert!(reconstructed.is_some_and(|cycles| cycles > 0), "{remote_io}");
    }
}

#[test]
fn a_program_of_every_form_becomes_a_cluster_that_runs() {
    for (name, file, controller) in [
        ("plcopen", "plcopen/pump.xml", "pump"),
        ("st", "other-tools/press.st", "press"),
        ("ldmicro", "other-tools/light.ld", "light"),
        ("digraph", "other-tools/vents.xml", "vents"),
        ("ladder", "filling-line/filling-line.ladder", "filling_line"),
    ] {
        let folder = empty_folder(&format!("init_from_{name}"));
        let answer = init(&folder, &[&example(file)]);
        assert_eq!(answer.status, 0, "{file}: {}", answer.shown());
        check_it_runs(&folder, &[controller]);
    }
}

#[test]
fn programs_of_several_forms_share_one_understudy() {
    let folder = empty_folder("init_from_several");
    for (from, to) in [
        ("plcopen/pump.xml", "pump.xml"),
        ("other-tools/press.st", "press.st"),
        ("press-cell/robot.ladder", "robot.ladder"),
    ] {
        fs::copy(example(from), folder.join(to)).expect("copied");
    }
    let answer = init(&folder, &["pump.xml", "south=press.st", "robot.ladder"]);
    insta::assert_snapshot!(answer.shown());
    let text = |name: &str| fs::read_to_string(folder.join("cell").join(name)).expect("written");
    insta::assert_snapshot!(text("cluster.toml"));
    insta::assert_snapshot!(text("pump-plant.ladder"));
    insta::assert_snapshot!(text("kill.toml"));
    assert_eq!(
        fs::read(folder.join("press.st")).expect("read"),
        fs::read(folder.join("cell/south.st")).expect("copied")
    );
    check_it_runs(&folder, &["pump", "south", "robot"]);
}

/// Two programs, each with a timer, that two tasks run.
const TWO_PROGRAMS: &str = "\
PROGRAM fill
VAR_INPUT low : BOOL; END_VAR
VAR_OUTPUT valve : BOOL; END_VAR
VAR wait : TON; END_VAR
wait(IN := low, PT := T#100ms);
valve := wait.Q;
END_PROGRAM

PROGRAM drain
VAR_INPUT high : BOOL; END_VAR
VAR_OUTPUT pump : BOOL; END_VAR
pump := high;
END_PROGRAM

CONFIGURATION plant
  RESOURCE controller ON PLC
    TASK slow(INTERVAL := T#20ms, PRIORITY := 0);
    PROGRAM first WITH slow : fill;
    PROGRAM second WITH slow : drain;
  END_RESOURCE
END_CONFIGURATION
";

/// A program that nothing runs is no part of the cluster, and the draft says so, whatever number of others the file has.
#[test]
fn a_program_that_no_task_runs_is_named() {
    for (number, text) in [
        TWO_PROGRAMS.to_owned(),
        // One of the two runs.
        TWO_PROGRAMS
            .lines()
            .filter(|line| !line.contains(": drain;"))
            .collect::<Vec<_>>()
            .join("\n"),
    ]
    .into_iter()
    .enumerate()
    {
        let folder = empty_folder(&format!("init_from_idle_{number}"));
        let idle = "PROGRAM spare VAR_INPUT a : BOOL; END_VAR VAR_OUTPUT b : BOOL; END_VAR b := a; END_PROGRAM\n";
        fs::write(folder.join("plant.st"), format!("{idle}{text}\n")).expect("written");
        let answer = init(&folder, &["plant.st"]);
        assert_eq!(answer.status, 0, "{}", answer.shown());
        let named = answer.output.matches("U1055: nothing runs the PROGRAM `spare`").count();
        assert_eq!(named, 1, "{}", answer.shown());
        assert!(!folder.join("cell/spare.st").exists());
        let drains = answer.output.contains("nothing runs the PROGRAM `drain`");
        assert_eq!(drains, number == 1, "{}", answer.shown());
    }
}

/// Programs that share a part of the memory by addresses of different sizes do something else apart.
#[test]
fn programs_that_share_bits_at_addresses_stay_together() {
    let two = |one: &str, other: &str| {
        format!(
            "PROGRAM fill VAR_INPUT a : BOOL; END_VAR VAR_OUTPUT q : BOOL; END_VAR VAR w AT {one}; END_VAR q := a; w := w; END_PROGRAM
             PROGRAM drain VAR_INPUT b : BOOL; END_VAR VAR_OUTPUT r : BOOL; END_VAR VAR v AT {other}; END_VAR r := b; v := v; END_PROGRAM
             CONFIGURATION c RESOURCE r ON plc TASK t(INTERVAL := T#20ms, PRIORITY := 1);
             PROGRAM f WITH t : fill; PROGRAM d WITH t : drain; END_RESOURCE END_CONFIGURATION\n"
        )
    };
    for (number, (one, other, status, together)) in [
        ("%MW0 : WORD", "%MX0.3 : BOOL", 2, false),
        ("%MW0 : ARRAY[0..3] OF INT", "%MD1 : DINT", 2, false),
        ("%QW0 : WORD", "%QX0.3 : BOOL", 0, true),
        ("%QX0.3 : BOOL", "%QW0 : WORD", 0, true),
        ("%QW1 : WORD", "%QX0.3 : BOOL", 0, false),
    ]
    .into_iter()
    .enumerate()
    {
        let folder = empty_folder(&format!("init_from_overlap_{number}"));
        fs::write(folder.join("plant.st"), two(one, other)).expect("written");
        let answer = init(&folder, &["plant.st"]);
        assert_eq!(answer.status, status, "{one} and {other}: {}", answer.shown());
        assert_eq!(answer.errors.contains("U1083"), status == 2, "{}", answer.shown());
        let cluster = fs::read_to_string(folder.join("cell/cluster.toml")).unwrap_or_default();
        let controllers = cluster.matches("[[controller]]").count();
        let wanted = match (status, together) {
            (2, _) => 0,
            (_, true) => 1,
            _ => 2,
        };
        assert_eq!(controllers, wanted, "{one} and {other}: {cluster}");
    }
}

#[test]
fn each_program_of_a_file_gets_a_controller() {
    let folder = empty_folder("init_from_two_in_one");
    fs::write(folder.join("plant.st"), TWO_PROGRAMS).expect("written");
    let answer = init(&folder, &["plant.st"]);
    assert_eq!(answer.status, 0, "{}", answer.shown());
    check_it_runs(&folder, &["fill", "drain"]);
    let cluster = fs::read_to_string(folder.join("cell/cluster.toml")).expect("written");
    assert!(cluster.contains("period = \"20ms\""), "{cluster}");
    // A name on the command line is a prefix then.
    let other = ["init", "other", "--from", "north=plant.st"];
    assert_eq!(understudy_in(&folder, &other).status, 0);
    assert!(folder.join("other/north-drain.st").exists());
}

#[test]
fn each_program_that_a_task_of_a_project_runs_gets_a_controller() {
    let folder = empty_folder("init_from_project");
    let pump = fs::read_to_string(example("plcopen/pump.xml")).expect("an example");
    let start = pump.find("<pou ").expect("a unit");
    let end = pump.find("</pou>").expect("its end") + "</pou>".len();
    let twin = pump[start..end].replacen("\"pump\"", "\"twin\"", 1);
    assert_ne!(twin, pump[start..end], "the unit is named pump");
    // Its own outputs: programs that write one output stay together.
    let twin = twin.replace("%QX0.", "%QX1.");
    let mut project = pump.clone();
    project.insert_str(end, &twin);
    let instance = project.find("<pouInstance ").expect("a task runs it");
    let close = instance + project[instance..].find("/>").expect("its end") + 2;
    let second = project[instance..close]
        .replace("typeName=\"pump\"", "typeName=\"twin\"")
        .replacen("name=\"", "name=\"second_", 1);
    project.insert_str(close, &second);
    fs::write(folder.join("plc.xml"), project).expect("written");
    let answer = init(&folder, &["plc.xml"]);
    assert_eq!(answer.status, 0, "{}", answer.shown());
    check_it_runs(&folder, &["pump", "twin"]);
}

#[test]
fn names_of_signals_that_mean_something_else_in_a_plant_are_kept_apart() {
    let folder = empty_folder("init_from_names");
    let text = "\
program odd
input  plant_fault
input  tick
input  level
input  level.failed
output part_arrives
output finished
rung
    plant_fault tick ( part_arrives )
rung
    level /level.failed ( finished )
";
    fs::write(folder.join("odd.ladder"), text).expect("written");
    let answer = init(&folder, &["odd.ladder"]);
    assert_eq!(answer.status, 0, "{}", answer.shown());
    check_it_runs(&folder, &["odd"]);
}

#[test]
fn bad_programs_are_all_said_and_nothing_is_written() {
    let folder = empty_folder("init_from_bad");
    let write = |name: &str, text: &str| fs::write(folder.join(name), text).expect("written");
    let pump = "program pump\ninput full\noutput run\nrung\n    /full ( run )\n";
    write("pump.ladder", pump);
    write("again.ladder", pump);
    write("wrong.ladder", &pump.replace("/full", "/ful"));
    write("dry.ladder", "program dry\ninput full\nmemory seen\nrung\n    full ( seen )\n");
    write("taken.ladder", &pump.replace("program pump", "program understudy"));
    write("dotted.ladder", &pump.replace("program pump", "program _pump"));
    write("notes.txt", "buy a pump\n");
    write("cluster.toml", "[cluster]\nname = \"cell\"\n");
    fs::write(folder.join("bytes.st"), [0xff, 0xfe, 0x00]).expect("written");
    let long = format!("program {}", "p".repeat(43));
    write("long.ladder", &pump.replace("program pump", &long));
    let check = |from: &[&str], codes: &[&str]| {
        let answer =
            understudy_in(&folder, &[&["init", "cell", "--json", "--from"], from].concat());
        assert_eq!(answer.status, 2, "{from:?}: {}", answer.shown());
        let document = answer.json();
        let lists = ["diagnostics", "failures"].into_iter();
        let found = lists.flat_map(|list| document[list].as_array().expect("a list"));
        let found: Vec<&str> = found
            .filter(|found| found["severity"] != "warning")
            .map(|found| found["code"].as_str().expect("a code"))
            .collect();
        assert_eq!(found, codes, "{from:?}: {document}");
        assert!(!folder.join("cell").exists(), "{from:?}");
    };
    check(&["wrong.ladder", "gone.ladder"], &["U0104", "U0601"]);
    check(&["notes.txt", "pump.ladder"], &["U0619"]);
    check(&["cluster.toml"], &["U0616"]);
    check(&["bytes.st"], &["U0618"]);
    check(&["."], &["U0601"]);
    check(&["dry.ladder", "pump.ladder"], &["U0622"]);
    check(&["dotted.ladder", "long.ladder"], &["U0623", "U0623"]);
    check(&["1pump=pump.ladder"], &["U0623"]);
    check(&["pump.ladder", "again.ladder"], &["U0624"]);
    check(&["taken.ladder"], &["U0624"]);
    check(&["pump.ladder", "pump-io=again.ladder"], &["U0624"]);
    let many: Vec<String> = (0..65).map(|number| format!("p{number}=pump.ladder")).collect();
    let many: Vec<&str> = many.iter().map(String::as_str).collect();
    check(&many, &["U0625"]);
    check(
        &["dry.ladder", "wrong.ladder", "pump.ladder", "again.ladder"],
        &["U0104", "U0622", "U0624"],
    );
    let said = init(&folder, &["pump.ladder", "again.ladder"]);
    insta::assert_snapshot!(said.shown());
    let both =
        understudy_in(&folder, &["init", "cell", "--template", "cell", "--from", "pump.ladder"]);
    assert!(both.errors.starts_with("error[U0600]"), "{}", both.errors);
}

#[test]
fn files_that_exist_stay_as_they_are() {
    let folder = empty_folder("init_from_existing");
    fs::copy(example("other-tools/press.st"), folder.join("press.st")).expect("copied");
    fs::create_dir(folder.join("cell")).expect("a folder");
    fs::write(folder.join("cell/kill.toml"), "mine").expect("written");
    fs::write(folder.join("cell/press.st"), "mine").expect("written");
    let answer = init(&folder, &["press.st"]);
    assert_eq!(answer.status, 2, "{}", answer.shown());
    for part in ["U0603", "cell/kill.toml", "cell/press.st"] {
        assert!(answer.errors.contains(part), "{}", answer.errors);
    }
    assert!(!folder.join("cell/cluster.toml").exists());
    // A program that is in the folder already is used where it is.
    let here = understudy_in(&folder, &["init", ".", "--from", "press.st"]);
    assert_eq!(here.status, 0, "{}", here.shown());
    assert_eq!(understudy_in(&folder, &["check", "cluster.toml"]).status, 0);
}

#[test]
fn every_template_is_right_and_comes_out_as_its_scenario_expects() {
    for template in ["minimal", "cell", "modbus"] {
        let folder = empty_folder(&format!("init_template_{template}"));
        let written = understudy_in(&folder, &["init", "cell", "--template", template]);
        assert_eq!(written.status, 0, "{}", written.shown());
        assert_eq!(written.output.contains("device.py"), template == "modbus");
        let files = ["cell/cluster.toml", "cell/kill.toml"];
        let checked = understudy_in(&folder, &["check", files[0], files[1]]);
        assert_eq!(checked.status, 0, "{}", checked.shown());
        assert!(!checked.output.contains("warning"), "{}", checked.output);
        let run = ["simulate", files[0], "--scenario", files[1], "--seed", "1"];
        let run = understudy_in(&folder, &run);
        assert_eq!(run.status, 0, "{template}: {}", run.shown());
    }
}
