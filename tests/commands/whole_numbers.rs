//! A whole number at an input or an output is a number for every command, with the type and the range of its declaration.

use std::fs;

use crate::{empty_folder, understudy_in};

/// A type, its registers in a device, none where it has none there, and two of its values.
struct Row {
    of: &'static str,
    register: &'static str,
    low: Shown,
    high: Shown,
    /// What is 0 in a scan.
    zero: &'static str,
}

/// A value in a cluster file and in a file of scans.
#[derive(Clone, Copy)]
struct Shown {
    file: &'static str,
    scan: &'static str,
}

const fn number(text: &'static str) -> Shown {
    Shown { file: text, scan: text }
}

const fn row(of: &'static str, register: &'static str, low: Shown, high: Shown) -> Row {
    Row { of, register, low, high, zero: "0" }
}

const TYPES: [Row; 14] = [
    row("SINT", "int", number("-128"), number("127")),
    row("INT", "int", number("-2"), number("32767")),
    row("DINT", "dint", number("-70000"), number("5")),
    row("LINT", "lint", number("-5000000000"), number("0")),
    row("USINT", "uint", number("200"), number("255")),
    row("UINT", "uint", number("3"), number("65535")),
    row("UDINT", "udint", number("4000000000"), number("4294967295")),
    row("BYTE", "uint", number("255"), number("255")),
    row("WORD", "uint", number("32768"), number("65535")),
    row("INT (-3..12)", "int", number("-3"), number("12")),
    Row {
        of: "Mode",
        register: "int",
        low: Shown { file: "\"Manual\"", scan: "Manual" },
        high: Shown { file: "\"Auto\"", scan: "Auto" },
        zero: "Off",
    },
    Row {
        of: "TIME",
        register: "",
        low: Shown { file: "\"20ms\"", scan: "T#20ms" },
        high: Shown { file: "\"1500ms\"", scan: "T#1s500ms" },
        zero: "T#0s",
    },
    Row {
        of: "DATE",
        register: "",
        low: Shown { file: "\"1970-01-01\"", scan: "D#1970-01-01" },
        high: Shown { file: "\"2024-02-29\"", scan: "D#2024-02-29" },
        zero: "D#1970-01-01",
    },
    Row {
        of: "TOD",
        register: "",
        low: Shown { file: "\"00:00:01\"", scan: "TOD#00:00:01" },
        high: Shown { file: "\"12:34:56.5\"", scan: "TOD#12:34:56.5" },
        zero: "TOD#00:00:00",
    },
];

const PERIOD: &str = "10ms";

/// A program that gives back what an operator sets, with a device, and one that reads it.
fn cluster(row: &Row) -> Vec<(&'static str, String)> {
    let Row { of, register, .. } = row;
    let (low, high) = (row.low.file, row.high.file);
    let mode = "TYPE Mode : (Off, Manual := 3, Auto := 7); END_TYPE\n";
    let one = format!(
        "{mode}PROGRAM one\n  VAR_INPUT n : {of}; m : {of}; END_VAR\n  VAR_OUTPUT q : {of}; END_VAR\n  q := n;\nEND_PROGRAM\n"
    );
    let two = format!(
        "{mode}PROGRAM two\n  VAR_INPUT n : {of}; END_VAR\n  VAR_OUTPUT q : {of}; END_VAR\n  q := n;\nEND_PROGRAM\n"
    );
    let head = "[cluster]\nname = \"cell\"\n[[controller]]\nname = \"one\"\nladder = \"one.st\"\n";
    let setpoint = format!(
        "[[remote_io]]\ncontroller = \"one\"\nfail_safe = {{ q = {high} }}\n[remote_io.inputs]\nn = {{ operator = \"setpoint\", low = {low}, high = {high}, initial = {low} }}\n"
    );
    let condition = if *of == "Mode" { "when" } else { "below" };
    let alarm = format!("[[alarm]]\nsignal = \"one.q\"\n{condition} = {high}\ntext = \"low\"\n");
    let signals = format!(
        "{head}[[controller]]\nname = \"two\"\nladder = \"two.st\"\n[[understudy]]\nname = \"u\"\n{setpoint}[[remote_io]]\ncontroller = \"two\"\n[remote_io.inputs]\nn = {{ from = \"one.q\", default = {high}, stale_after = 5 }}\n{alarm}"
    );
    let mut files = vec![("one.st", one), ("two.st", two), ("signals.toml", signals)];
    if !register.is_empty() {
        let field = format!(
            "{head}{setpoint}[remote_io.field]\nmodbus = \"127.0.0.1:1502\"\ninputs = {{ m = \"input:0 {register}\" }}\noutputs = {{ q = \"holding:0 {register}\" }}\n{alarm}"
        );
        files.push(("field.toml", field));
    }
    files
}

impl Row {
    fn inputs(&self) -> String {
        let Self { low, high, zero, .. } = self;
        format!("{} {zero}\n{} 0\n", low.scan, high.scan)
    }

    fn scanned(&self) -> String {
        let Self { low, high, zero, .. } = self;
        let (low, high) = (low.scan, high.scan);
        format!("{low} {zero} -> {low}\n{high} {zero} -> {high}\n")
    }
}

#[test]
fn every_command_has_a_value_as_its_type_writes_it() {
    for (place, row) in TYPES.iter().enumerate() {
        let Row { of, low, .. } = row;
        let folder = empty_folder(&format!("whole_numbers_{place}"));
        for (name, text) in cluster(row) {
            fs::write(folder.join(name), text).expect("written");
        }
        let run = |arguments: &[&str]| {
            let answer = understudy_in(&folder, arguments);
            assert_eq!(answer.status, 0, "{of}: {}", answer.shown());
            answer.output
        };
        if !row.register.is_empty() {
            run(&["check", "field.toml"]);
        }
        run(&["check", "signals.toml"]);
        fs::write(folder.join("inputs.txt"), row.inputs()).expect("written");
        let scanned = run(&["scan", "one.st", "--inputs", "inputs.txt", "--period", PERIOD]);
        assert_eq!(scanned, row.scanned(), "{of}");
        run(&["simulate", "signals.toml", "--cycles", "40", "--seed", "1", "--out", "runs"]);
        for controller in ["one", "two"] {
            let output = format!("{controller}.q");
            let why = run(&["why", &output, "runs/latest", "--at", "30"]);
            let first = format!("{output} is {} in cycle 30", low.file.trim_matches('"'));
            assert_eq!(why.lines().next(), Some(first.as_str()), "{of}: {why}");
        }
    }
}

/// A draft has the fail-safe values and the stand-in plants of every type, and is right but for what a person has to fill in.
#[test]
fn a_draft_is_right_for_every_type() {
    for (place, row) in TYPES.iter().enumerate() {
        let folder = empty_folder(&format!("whole_numbers_drafted_{place}"));
        for (name, text) in cluster(row) {
            fs::write(folder.join(name), text).expect("written");
        }
        for arguments in [
            &["init", "cell", "--from", "one.st", "--from", "two.st"][..],
            &["check", "cell/cluster.toml"],
            &["simulate", "cell/cluster.toml", "--cycles", "40", "--seed", "1"],
        ] {
            let answer = understudy_in(&folder, arguments);
            assert_eq!(answer.status, 0, "{}: {}", row.of, answer.shown());
        }
    }
}

/// Where nothing is said, an output is driven with a value that its declaration has.
#[test]
fn a_fail_safe_value_is_one_of_the_declaration() {
    let folder = empty_folder("whole_numbers_safe");
    let text = "TYPE Door : (open := 3, shut := 4); END_TYPE\nPROGRAM one\n  VAR_INPUT n : BOOL; END_VAR\n  VAR_OUTPUT d : Door; r : INT (4..9); s : INT (-9..-4); END_VAR\n  d := shut; r := 5; s := -5;\nEND_PROGRAM\n";
    let other = "PROGRAM two\n  VAR_INPUT d : Door; END_VAR\n  VAR_OUTPUT q : BOOL; END_VAR\n  q := d = shut;\nEND_PROGRAM\n";
    fs::write(folder.join("one.st"), text).expect("written");
    let head = "[cluster]\nname = \"cell\"\n[[controller]]\nname = \"one\"\nladder = \"one.st\"\n";
    fs::write(folder.join("one.toml"), format!("{head}[[understudy]]\nname = \"u\"\n"))
        .expect("written");
    let run = |arguments: &[&str]| {
        let answer = understudy_in(&folder, arguments);
        assert_eq!(answer.status, 0, "{}", answer.shown());
        answer.output
    };
    let scenario = "title = \"Both stations are killed\"\ncycles = 40\n[[step]]\nat = 10\naction = \"crash\"\nstation = \"one\"\n[[step]]\nat = 10\naction = \"crash\"\nstation = \"u\"\n";
    fs::write(folder.join("down.toml"), scenario).expect("written");
    run(&["simulate", "one.toml", "--scenario", "down.toml", "--seed", "1", "--out", "runs"]);
    for (output, value) in [("d", "open"), ("r", "4"), ("s", "-4")] {
        let why = run(&["why", output, "runs/latest", "--at", "35"]);
        assert!(why.starts_with(&format!("one.{output} is {value} ")), "{why}");
    }
    // A receiver with other numbers for the names has another value.
    let signal = "[[controller]]\nname = \"two\"\nladder = \"two.st\"\n[[understudy]]\nname = \"u\"\n[[remote_io]]\ncontroller = \"two\"\n[remote_io.inputs]\nd = { from = \"one.d\", default = \"open\" }\n";
    fs::write(folder.join("two.toml"), format!("{head}{signal}")).expect("written");
    for (door, status) in [("open := 3, shut := 4", 0), ("shut := 3, open := 4", 2)] {
        let text = format!("TYPE Door : ({door}); END_TYPE\n{other}");
        fs::write(folder.join("two.st"), text).expect("written");
        let answer = understudy_in(&folder, &["check", "two.toml"]);
        assert_eq!(answer.status, status, "{door}: {}", answer.shown());
    }
}

/// What is written keeps the numbers, and is drafted, as what was read.
#[test]
fn conversions_keep_whole_numbers() {
    for (place, row) in TYPES.iter().enumerate() {
        let of = row.of;
        let folder = empty_folder(&format!("whole_numbers_converted_{place}"));
        let files = cluster(row);
        let (name, text) = &files[0];
        fs::write(folder.join(name), text).expect("written");
        fs::write(folder.join("inputs.txt"), row.inputs()).expect("written");
        for written in ["one.xml", "again.st"] {
            let answer = understudy_in(&folder, &["convert", name, written]);
            assert_eq!(answer.status, 0, "{of}: {}", answer.shown());
            let answer = understudy_in(&folder, &["scan", written, "--inputs", "inputs.txt"]);
            assert_eq!(answer.output, row.scanned(), "{of}: {}", answer.shown());
        }
        // A ladder has no numbers.
        let answer = understudy_in(&folder, &["convert", name, "one.ladder"]);
        assert_eq!(answer.status, 2, "{of}: {}", answer.shown());
        assert!(answer.errors.contains("U1056"), "{of}: {}", answer.shown());
    }
}

/// A program whose points are BOOLs and that counts inside is the same program in every command: its variables have the names and types of their
/// declarations, and a command that needs a circuit derives one.
#[test]
fn numbers_inside_a_boolean_program_stay_numbers() {
    let folder = empty_folder("whole_numbers_inside");
    let counter = "PROGRAM parts\n  VAR_INPUT part : BOOL; clear : BOOL; END_VAR\n  VAR_OUTPUT full : BOOL; END_VAR\n  VAR count : INT; edge : R_TRIG; pause : TON; END_VAR\n  edge(CLK := part);\n  IF clear THEN count := 0; ELSIF edge.Q AND count < 5 THEN count := count + 1; END_IF;\n  pause(IN := count = 5, PT := T#30ms);\n  full := pause.Q;\nEND_PROGRAM\n";
    let lamp = "program lamp\ninput key\noutput light\nrung\n    key ( light )\n";
    let cluster = "[cluster]\nname = \"cell\"\n[[controller]]\nname = \"parts\"\nladder = \"parts.st\"\n[[controller]]\nname = \"lamp\"\nladder = \"lamp.ladder\"\n[[understudy]]\nname = \"u\"\n[[remote_io]]\ncontroller = \"parts\"\n[remote_io.inputs]\npart = { operator = \"pulse\" }\nclear = { operator = \"pulse\" }\n[[remote_io]]\ncontroller = \"lamp\"\n[remote_io.inputs]\nkey = { operator = \"pulse\" }\n";
    let real = "PROGRAM level\n  VAR_INPUT part : BOOL; END_VAR\n  VAR_OUTPUT full : BOOL; END_VAR\n  VAR level : REAL; END_VAR\n  IF part THEN level := level + 0.5; END_IF;\n  full := level > 3.0;\nEND_PROGRAM\n";
    for (name, text) in [
        ("parts.st", counter),
        ("lamp.ladder", lamp),
        ("cell.toml", cluster),
        ("level.st", real),
        ("inputs.txt", "1 0\n0 1\n"),
    ] {
        fs::write(folder.join(name), text).expect("written");
    }
    let run = |arguments: &[&str]| {
        let answer = understudy_in(&folder, arguments);
        assert_eq!(answer.status, 0, "{}", answer.shown());
        answer.output
    };
    assert!(run(&["check", "parts.st", "cell.toml"]).contains("operations a scan"));
    // It cannot stop, so it has neither a fault nor a reset.
    assert_eq!(run(&["scan", "parts.st", "--inputs", "inputs.txt"]), "1 0 -> 0\n0 1 -> 0\n");
    let property = "never program.fault";
    let proved = run(&["verify", "parts.st", "--property", property, "--property", "EF edge.Q"]);
    assert!(proved.contains("full can always be switched on and off again"), "{proved}");
    let proved = run(&["verify", "cell.toml"]);
    assert!(proved.contains("the understudy equals the sum of its members"), "{proved}");
    assert!(run(&["parity", "cell.toml"]).contains("parts.count.2"));
    let counted = understudy_in(&folder, &["resources", "cell.toml", "--json"]).json();
    let programs = counted["result"]["programs"].as_array().expect("a list");
    let names: Vec<&str> = programs.iter().filter_map(|found| found["name"].as_str()).collect();
    assert_eq!(names, ["parts", "lamp", "understudy"]);
    assert_eq!(
        (programs[0]["inputs"].as_u64(), programs[0]["outputs"].as_u64()),
        (Some(2), Some(1))
    );
    run(&["simulate", "cell.toml", "--cycles", "30", "--seed", "1", "--out", "runs"]);
    let why = run(&["why", "parts.full", "runs/latest", "--at", "20"]);
    assert!(why.contains("full := pause.Q"), "{why}");
    // What has no bits is named.
    for command in [&["resources", "level.st"][..], &["verify", "level.st", "--smv", "scan"]] {
        let answer = understudy_in(&folder, command);
        assert_eq!(answer.status, 2, "{}", answer.shown());
        assert!(answer.errors.contains("U0438"), "{}", answer.shown());
        assert!(answer.errors.contains("level"), "{}", answer.shown());
    }
}
