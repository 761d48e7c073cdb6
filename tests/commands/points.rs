//! A point is what its author declared, in each language and at each place that shows it: the same INT, DINT, TIME, LTIME, DATE, enumeration, subrange,
//! BOOL array and structure, written in text, as a chart and as an instruction list, and as documents of PLCopen with each of their bodies.

use std::fs;
use std::path::Path;

use serde_json::Value;

use crate::{empty_folder, understudy_in};

/// A point of each kind, in the order of the declarations.
struct Row {
    /// Its name as an input; the output has `q` in front.
    name: &'static str,
    /// Its type, as every place shows it.
    of: &'static str,
    /// A value as a file of scans, a cluster file and every view of a run have it.
    scan: &'static str,
    file: &'static str,
    shown: &'static str,
    /// A value that it does not have.
    wrong: &'static str,
    /// The least value of an output, as a cluster file has it.
    safe: &'static str,
}

const fn row(
    name: &'static str,
    of: &'static str,
    [scan, file, shown, wrong, safe]: [&'static str; 5],
) -> Row {
    Row { name, of, scan, file, shown, wrong, safe }
}

const POINTS: [Row; 16] = [
    row("n", "INT", ["20", "20", "20", "40000", "0"]),
    row("d", "DINT", ["-70000", "-70000", "-70000", "3000000000", "0"]),
    row("t", "TIME", ["T#1s500ms", "\"1.5s\"", "1s500ms", "1.5", "\"0ms\""]),
    row("lt", "LTIME", ["LT#4us", "\"4us\"", "4us", "D#1970-01-01", "\"0ms\""]),
    row("day", "DATE", ["D#2024-02-29", "\"2024-02-29\"", "2024-02-29", "T#1s", "\"1970-01-01\""]),
    row("m", "Mode", ["Auto", "\"Auto\"", "Auto", "Fast", "\"Off\""]),
    row("s", "INT (3..9)", ["5", "5", "5", "10", "3"]),
    row("bits[0]", "BOOL", ["1", "true", "1", "2", "false"]),
    row("bits[1]", "BOOL", ["0", "false", "0", "x", "false"]),
    row("bits[2]", "BOOL", ["1", "true", "1", "-1", "false"]),
    row("mot.run", "BOOL", ["1", "true", "1", "T#1s", "false"]),
    row("mot.speed", "INT", ["-7", "-7", "-7", "fast", "0"]),
    row("mot.wait", "TIME", ["T#20ms", "\"20ms\"", "20ms", "Auto", "\"0ms\""]),
    row("mot.mode", "Mode", ["Manual", "\"Manual\"", "Manual", "3.0", "\"Off\""]),
    row("mot.steps[1]", "INT (1..4)", ["4", "4", "4", "0", "1"]),
    row("mot.steps[2]", "INT (1..4)", ["1", "1", "1", "5", "1"]),
];

const DECLARED: &str = "TYPE
  Mode : (Off, Manual := 3, Auto := 7);
  Motor : STRUCT run : BOOL; speed : INT; wait : TIME; mode : Mode; steps : ARRAY [1..2] OF INT (1..4); END_STRUCT;
END_TYPE
PROGRAM one
  VAR_INPUT n : INT; d : DINT; t : TIME; lt : LTIME; day : DATE; m : Mode; s : INT (3..9); bits : ARRAY [0..2] OF BOOL; mot : Motor; END_VAR
  VAR_OUTPUT qn : INT; qd : DINT; qt : TIME; qlt : LTIME; qday : DATE; qm : Mode; qs : INT (3..9); qbits : ARRAY [0..2] OF BOOL; qmot : Motor; END_VAR
";

/// The program with its name in each language.
fn programs(folder: &Path) -> Vec<&'static str> {
    let lines = |line: &dyn Fn(&str) -> String| {
        POINTS.iter().map(|point| line(point.name)).collect::<String>()
    };
    let statements = lines(&|name| format!("  q{name} := {name};\n"));
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

/// A program whose operator sets every input, with an alarm on every output.
fn cluster(program: &str) -> String {
    let mut text = format!(
        "[cluster]\nname = \"cell\"\n[[controller]]\nname = \"one\"\nladder = {program:?}\n[[understudy]]\nname = \"u\"\n[[remote_io]]\ncontroller = \"one\"\n[remote_io.fail_safe]\n"
    );
    for Row { name, file, .. } in &POINTS {
        text += &format!("\"q{name}\" = {file}\n");
    }
    text += "[remote_io.inputs]\n";
    for Row { name, of, file, .. } in &POINTS {
        let kind = match *of {
            "BOOL" => "operator = \"level\"".to_owned(),
            _ => format!("operator = \"setpoint\", low = {file}, high = {file}"),
        };
        text += &format!("\"{name}\" = {{ {kind}, initial = {file} }}\n");
    }
    for Row { name, of, file, .. } in &POINTS {
        let condition = match *of {
            "BOOL" | "Mode" => "when",
            _ => "above",
        };
        text += &format!(
            "[[alarm]]\nsignal = \"one.q{name}\"\n{condition} = {file}\ntext = \"q{name}\"\n"
        );
    }
    text
}

#[test]
fn a_point_is_what_its_author_declared() {
    let folder = empty_folder("points");
    let scan = joined(|row| row.scan.to_owned(), " ");
    let names = joined(|row| row.name.to_owned(), " ");
    fs::write(folder.join("inputs.txt"), format!("# {names}\n{scan}\n")).expect("written");
    for program in programs(&folder) {
        run(&folder, &["check", program]);
        // Scans, in text and as JSON.
        let scanned = run(&folder, &["scan", program, "--inputs", "inputs.txt"]);
        assert_eq!(scanned, format!("{scan} -> {scan}\n"), "{program}");
        let answer = understudy_in(&folder, &["scan", program, "--inputs", "inputs.txt", "--json"]);
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
        for (place, row) in POINTS.iter().enumerate() {
            let mut words: Vec<&str> = scan.split(' ').collect();
            words[place] = row.wrong;
            fs::write(folder.join("wrong.txt"), words.join(" ")).expect("written");
            let answer = understudy_in(&folder, &["scan", program, "--inputs", "wrong.txt"]);
            let told = format!("`{}`", row.name);
            assert!(answer.errors.contains("U0439"), "{program}: {}", answer.shown());
            for word in [row.of, row.wrong, &told] {
                assert!(answer.errors.contains(word), "{program} {word}: {}", answer.shown());
            }
            assert_eq!(answer.errors.matches("error[").count(), 1, "{}", answer.shown());
        }
        proved_and_drawn(&folder, program);
        drafted(&folder, program);
        of_a_run(&folder, program);
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
    let _ = fs::remove_dir_all(folder.join("draft"));
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
    run(folder, &["simulate", "draft/cluster.toml", "--cycles", "30", "--seed", "1"]);
}

fn joined(of: impl Fn(&Row) -> String, between: &str) -> String {
    POINTS.iter().map(of).collect::<Vec<String>>().join(between)
}

/// A run shows every value as its cluster file has it.
fn of_a_run(folder: &Path, program: &str) {
    fs::write(folder.join("cell.toml"), cluster(program)).expect("written");
    run(folder, &["check", "cell.toml"]);
    for Row { name, of, wrong, .. } in POINTS.iter().filter(|row| row.of != "BOOL") {
        // A value of another type, in the place of the fail-safe value.
        let right = POINTS.iter().find(|row| row.name == *name).expect("it").file;
        let text = cluster(program).replacen(
            &format!("\"q{name}\" = {right}\n"),
            &format!("\"q{name}\" = {wrong:?}\n"),
            1,
        );
        fs::write(folder.join("wrong.toml"), text).expect("written");
        let answer = understudy_in(folder, &["check", "wrong.toml"]);
        let told = format!("`q{name}` is {of}: ");
        assert!(answer.errors.contains(&told), "{program}: {}", answer.shown());
    }
    let _ = fs::remove_dir_all(folder.join("runs"));
    run(folder, &["simulate", "cell.toml", "--cycles", "40", "--seed", "1", "--out", "runs"]);
    let sampled = joined(|row| format!("{} = {}", row.name, row.shown), ", ");
    let driven = joined(|row| format!("q{} = {}", row.name, row.shown), ", ");
    let journal = run(folder, &["journal", "runs/latest", "--all", "--from", "20", "--to", "20"]);
    for line in [format!("samples {sampled}"), format!("drives {driven}, direct")] {
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
}
