//! A point is what its author declared, in each language and at each place that shows it: the same INT, DINT, TIME, LTIME, DATE, enumeration, subrange,
//! BOOL array and structure, written in text, as a chart and as an instruction list, and as documents of PLCopen with each of their bodies.

mod places;

use std::fs;
use std::path::Path;

use serde_json::Value;
use understudy_testing::points::{DECLARED, MODE, POINTS, Row, cluster_file, statements, writes};

use crate::{empty_folder, understudy_in};

/// The program with its name in each language.
fn programs(folder: &Path) -> Vec<&'static str> {
    let lines = |line: &dyn Fn(&str) -> String| {
        POINTS.iter().map(|point| line(point.name)).collect::<String>()
    };
    let statements = statements();
    let chart = format!(
        "  INITIAL_STEP Pass: Copy(N); END_STEP\n  ACTION Copy:\n{statements}  END_ACTION\n"
    );
    let list = lines(&|name| format!("  LD {name}\n  ST q{name}\n"));
    let mut all = Vec::new();
    for (name, body) in [("text.st", statements), ("chart.st", chart), ("list.st", list)] {
        fs::write(folder.join(name), format!("{DECLARED}{body}END_PROGRAM\n")).expect("written");
        all.push(name);
    }
    for (from, to, document, tag) in [
        ("text.st", "plcopen", "text.xml", "<ST>"),
        ("text.st", "plcopen-fbd", "blocks.xml", "<FBD>"),
        ("chart.st", "plcopen", "chart.xml", "<SFC>"),
        ("list.st", "plcopen", "list.xml", "<IL>"),
    ] {
        run(folder, &["convert", from, document, "--to", to]);
        let text = fs::read_to_string(folder.join(document)).expect("a document");
        assert!(text.contains(tag), "{document}: {text}");
        all.push(document);
    }
    // The same boxes in a ladder.
    let blocks = fs::read_to_string(folder.join("blocks.xml")).expect("a document");
    let ladder = blocks.replace("<FBD>", "<LD>").replace("</FBD>", "</LD>");
    fs::write(folder.join("ladder.xml"), ladder).expect("written");
    all.push("ladder.xml");
    all
}

#[track_caller]
fn run(folder: &Path, arguments: &[&str]) -> String {
    let answer = understudy_in(folder, arguments);
    assert_eq!(answer.status, 0, "{arguments:?}: {}", answer.shown());
    answer.output
}

#[test]
fn a_point_is_what_its_author_declared() {
    let folder = empty_folder("points");
    let programs = programs(&folder);
    // Each in a folder of its own.
    std::thread::scope(|scope| {
        for program in programs {
            let own = folder.join(program.replace('.', "-"));
            fs::create_dir(&own).expect("a folder");
            fs::copy(folder.join(program), own.join(program)).expect("copied");
            scope.spawn(move || {
                run(&own, &["check", program]);
                scanned(&own, program);
                proved_and_drawn(&own, program);
                drafted(&own, program);
                of_a_run(&own, program);
            });
        }
    });
}

fn joined(of: &dyn Fn(&Row) -> String, between: &str) -> String {
    POINTS.iter().map(of).collect::<Vec<String>>().join(between)
}

/// Scans, in text and as JSON.
fn scanned(folder: &Path, program: &str) {
    let scan = joined(&|row| row.scan.to_owned(), " ");
    let names = joined(&|row| row.name.to_owned(), " ");
    fs::write(folder.join("inputs.txt"), format!("# {names}\n{scan}\n")).expect("written");
    let scanned = run(folder, &["scan", program, "--inputs", "inputs.txt"]);
    assert_eq!(scanned, format!("{scan} -> {scan}\n"), "{program}");
    let answer = understudy_in(folder, &["scan", program, "--inputs", "inputs.txt", "--json"]);
    for (side, before) in [("inputs", ""), ("outputs", "q")] {
        let points = answer.json()["result"][side].as_array().expect("a list").clone();
        let expected = POINTS.iter().map(|row| (format!("{before}{}", row.name), row.of));
        let points = points.iter().map(|point| {
            let text = |key: &str| point[key].as_str().unwrap_or_default().to_owned();
            (text("name"), text("type"))
        });
        let expected: Vec<(String, String)> =
            expected.map(|(name, of)| (name, of.to_owned())).collect();
        assert_eq!(points.collect::<Vec<_>>(), expected, "{program}");
    }
    // In each line another value is wrong.
    let wrong = POINTS.iter().enumerate().map(|(place, row)| {
        let mut words: Vec<&str> = scan.split(' ').collect();
        words[place] = row.wrong;
        words.join(" ") + "\n"
    });
    fs::write(folder.join("wrong.txt"), wrong.collect::<String>()).expect("written");
    let answer = understudy_in(folder, &["scan", program, "--inputs", "wrong.txt"]);
    let errors: Vec<&str> = answer.errors.split("error[").skip(1).collect();
    assert_eq!(errors.len(), POINTS.len(), "{program}: {}", answer.shown());
    for (error, row) in errors.iter().zip(&POINTS) {
        for word in ["U0439]", row.of, row.wrong, &format!("`{}`", row.name)] {
            assert!(error.contains(word), "{program} {word}: {error}");
        }
    }
}

/// Proofs name values as the program does, pictures show the declarations, and what has no rungs or no bits is named as it is declared.
fn proved_and_drawn(folder: &Path, program: &str) {
    let properties = "always (qm = Auto <-> m = Auto)\nalways (qs >= 9 <-> s >= 9)\nalways (qn < -3 <-> n < -3)\nalways (qt > 1.5s <-> t > 1.5s)\nalways (qmot.mode = Off <-> mot.mode = Off)\nalways (qbits[1] <-> bits[1])\n";
    fs::write(folder.join("properties.txt"), properties).expect("written");
    let proved = run(folder, &["verify", program, "--properties", "properties.txt"]);
    assert_eq!(proved.matches("  proved ").count(), 6, "{program}: {proved}");
    let drawn = run(folder, &["draw", program]);
    for declared in ["m : Mode;", "s : INT (3..9);", "bits : ARRAY [0..2] OF BOOL;", "mot : Motor;"]
    {
        assert!(drawn.contains(declared), "{program}: {drawn}");
    }
    let ladder = understudy_in(folder, &["convert", program, "rungs.ladder"]);
    assert_eq!(ladder.status, 2, "{program}: {}", ladder.shown());
    let resources = understudy_in(folder, &["resources", program]);
    for word in ["U0438", "`t` : TIME (one, line "] {
        assert!(resources.errors.contains(word), "{program}: {}", resources.shown());
    }
}

/// A draft has a fail-safe value of the declaration for each output, and a plant with the inputs and outputs as they are declared.
fn drafted(folder: &Path, program: &str) {
    run(folder, &["init", "draft", "--from", program]);
    let text = |name: &str| fs::read_to_string(folder.join("draft").join(name)).expect("drafted");
    let (draft, plant) = (text("cluster.toml"), text("one-plant.st"));
    for Row { name, safe, .. } in &POINTS {
        let lines = [format!("q{name} = {safe}\n"), format!("\"q{name}\" = {safe}\n")];
        assert!(lines.iter().any(|line| draft.contains(line)), "{program} {name}: {draft}");
    }
    for line in [
        "qs : INT (3..9);",
        "qt : TIME;",
        "qlt : LTIME;",
        "qday : DATE;",
        "qm : INT;  // Mode: Off = 0, Manual = 3, Auto = 7",
        "  // Auto, else Off",
    ] {
        assert!(plant.contains(line), "{program} {line}: {plant}");
    }
    run(folder, &["check", "draft/cluster.toml"]);
    let simulated = ["simulate", "draft/cluster.toml", "--cycles", "30", "--seed", "1", "--out"];
    run(folder, &[&simulated[..], &["drafted"]].concat());
    // A plant has the sensors as the program declares them.
    let only = ["--all", "--event", "stepped", "--from", "20", "--to", "20"];
    let stepped = run(folder, &[&["journal", "drafted/latest"][..], &only].concat());
    let (_, sensors) = stepped.split_once("sensors ").expect("the sensors");
    let sensors: Vec<&str> = sensors.split(", ").take(POINTS.len()).collect();
    for (row, shown) in POINTS.iter().zip(sensors) {
        let (name, value) = shown.split_once(" = ").expect("a value");
        let is_right = match row.of {
            "TIME" | "LTIME" => value.ends_with('s'),
            "DATE" => value.matches('-').count() == 2,
            "Mode" => MODE.iter().any(|(name, _)| *name == value),
            _ => value.parse::<i64>().is_ok(),
        };
        assert!(name == row.name && is_right, "{program} {}: {stepped}", row.name);
    }
}

/// A run shows every value as its cluster file has it.
fn of_a_run(folder: &Path, program: &str) {
    fs::write(folder.join("cell.toml"), cluster_file(program)).expect("written");
    run(folder, &["check", "cell.toml"]);
    // Values of other types, in the places of the fail-safe values.
    let mut text = cluster_file(program);
    let numbers: Vec<&Row> = POINTS.iter().filter(|row| !row.is_bool()).collect();
    for Row { name, file, wrong, .. } in &numbers {
        let (right, wrong) =
            (format!("\"q{name}\" = {file}\n"), format!("\"q{name}\" = {wrong:?}\n"));
        text = text.replacen(&right, &wrong, 1);
    }
    fs::write(folder.join("wrong.toml"), text).expect("written");
    let answer = understudy_in(folder, &["check", "wrong.toml"]);
    for Row { name, of, .. } in numbers {
        let told = format!("`q{name}` is {of}: ");
        assert!(answer.errors.contains(&told), "{program}: {}", answer.shown());
    }
    fs::write(folder.join("writes.toml"), writes(40)).expect("written");
    let scenario = ["--scenario", "writes.toml", "--seed", "1", "--out", "runs"];
    run(folder, &[&["simulate", "cell.toml"][..], &scenario].concat());
    let sampled = joined(&|row| format!("{} = {}", row.name, row.shown), ", ");
    let driven = joined(&|row| format!("q{} = {}", row.name, row.shown), ", ");
    let journal = run(folder, &["journal", "runs/latest", "--all", "--from", "20", "--to", "20"]);
    for line in [
        format!("samples {sampled}"),
        format!("publishes one {driven}\n"),
        format!("drives {driven}, direct"),
    ] {
        assert!(journal.contains(&line), "{program} {line}: {journal}");
    }
    for Row { name, of, shown, .. } in &POINTS {
        let arguments = ["why", &format!("q{name}"), "runs/latest", "--at", "20"];
        let why = run(folder, &arguments);
        let first = format!("one.q{name} is {shown} in cycle 20");
        assert_eq!(why.lines().next(), Some(first.as_str()), "{program}: {why}");
        // The statement that assigned it, and the input that this read.
        let statement = why.lines().find(|line| line.starts_with(&format!("q{name} = {shown}: ")));
        let list = program.starts_with("list");
        let written =
            if list { format!("\"ST q{name}\"]") } else { format!("\"q{name} := {name};\"]") };
        assert!(statement.is_some_and(|line| line.ends_with(&written)), "{program}: {why}");
        assert!(why.contains(&format!(" {name} = {shown}: input, ")), "{program}: {why}");
        let typed = understudy_in(folder, &[&arguments[..], &["--json"]].concat()).json();
        assert_eq!(typed["result"]["type"], Value::from(*of), "{program} {name}");
    }
    run(folder, &["animate", "runs/latest", "--program", "one", "--from", "5", "--to", "30"]);
    let film = fs::read_to_string(folder.join("animation.svg")).expect("a picture");
    assert!(film.contains("; 4 more outputs are not shown"), "{program}: {film}");
    for Row { name, of, shown, .. } in &POINTS[..12] {
        assert!(film.contains(&format!(">q{name}</text>")), "{program}: {film}");
        assert!(*of == "BOOL" || film.contains(&format!(">{shown}</text>")), "{program}: {film}");
    }
    let registers = run(folder, &["gateway", "registers", "runs/latest"]);
    for (name, of) in [
        ("one.qn ", "INT: output"),
        ("one.qd ", "DINT: output"),
        ("one.qt ", "TIME in nanoseconds: output"),
        ("one.qlt ", "LTIME in nanoseconds: output"),
        ("one.qday ", "DATE in nanoseconds: output"),
        ("one.qm ", "INT, 0 Off, 3 Manual, 7 Auto: output"),
        ("one.qs ", "INT (3..9): output"),
        ("one.qbits[2] ", "output"),
        ("one.qmot.mode ", "INT, 0 Off, 3 Manual, 7 Auto: output"),
    ] {
        let line = registers.lines().find(|line| line.contains(name));
        assert!(line.is_some_and(|line| line.contains(of)), "{program} {name}: {registers}");
    }
    places::at_every_place(folder, program);
}

/// Programs whose values are finite, in each language: a BOOL takes a digital terminal, also in an array or a structure, and every number an analog one.
#[test]
fn a_point_takes_a_terminal_of_its_type() {
    const TYPES: &str = "TYPE Mode : (Off := 0, Manual := 3, Auto := 7); Motor : STRUCT mode : Mode; on : BOOL; END_STRUCT; END_TYPE\n";
    const POINTS: &str =
        "n : INT (-5..9); m : Mode; bits : ARRAY[0..2] OF BOOL; mot : Motor; b : BOOL; END_VAR\n";
    let folder = empty_folder("terminals");
    let names = ["n", "m", "bits", "mot", "b"];
    let outputs = names.iter().fold(POINTS.to_owned(), |points, name| {
        points.replacen(&format!("{name} : "), &format!("q{name} : "), 1)
    });
    let lines = |line: &dyn Fn(&str) -> String| names.map(line).concat();
    let head = format!("{TYPES}PROGRAM one\nVAR_INPUT {POINTS}VAR_OUTPUT {outputs}");
    for (file, body) in [
        ("text.st", lines(&|name| format!("q{name} := {name};\n"))),
        ("list.st", lines(&|name| format!("LD {name}\nST q{name}\n"))),
    ] {
        fs::write(folder.join(file), format!("{head}{body}END_PROGRAM\n")).expect("written");
    }
    run(&folder, &["convert", "text.st", "text.xml", "--to", "plcopen"]);
    run(&folder, &["convert", "text.st", "blocks.xml", "--to", "plcopen-fbd"]);
    for program in ["text.st", "list.st", "text.xml", "blocks.xml"] {
        let counted = understudy_in(&folder, &["resources", program, "--json"]).json();
        let counted = &counted["result"]["programs"][0];
        for (key, expected) in
            [("inputs", 5), ("outputs", 5), ("analog_inputs", 3), ("analog_outputs", 3)]
        {
            assert_eq!(counted[key], expected, "{program} {key}: {counted}");
        }
        let allocated = understudy_in(&folder, &["allocate", program, "--json"]).json();
        let items = allocated["result"]["items"].as_array().expect("an item");
        let candidates = items[0]["candidates"].as_array().expect("candidates");
        let mut findings = candidates
            .iter()
            .flat_map(|candidate| candidate["findings"].as_array().cloned().unwrap_or_default());
        for (criterion, need) in
            [("digital_inputs", 5), ("digital_outputs", 5), ("analog_in", 3), ("analog_out", 3)]
        {
            let is_it = |finding: &Value| finding["criterion"] == criterion;
            let finding = findings.find(is_it).expect("each terminal is looked at");
            assert_eq!(finding["need"], need, "{program} {criterion}");
        }
    }
}
