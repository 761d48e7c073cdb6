//! A whole number at an input or an output is a number for every command, with the type and the range of its declaration.

use std::fs;

use crate::{empty_folder, understudy_in};

/// Type, register, and two values: what is written and the end of a range.
const TYPES: [(&str, &str, i64, i64); 10] = [
    ("SINT", "int", -128, 127),
    ("INT", "int", -2, 32_767),
    ("DINT", "dint", -70_000, 5),
    ("LINT", "lint", -5_000_000_000, 0),
    ("USINT", "uint", 200, 255),
    ("UINT", "uint", 3, 65_535),
    ("UDINT", "udint", 4_000_000_000, 4_294_967_295),
    ("BYTE", "uint", 255, 255),
    ("WORD", "uint", 32_768, 65_535),
    ("INT (-3..12)", "int", -3, 12),
];

const PERIOD: &str = "10ms";

/// A program that gives back what an operator sets, beside a device, and one that reads it.
fn cluster(of: &str, register: &str, low: i64, high: i64) -> [(&'static str, String); 4] {
    let one = format!(
        "PROGRAM one\n  VAR_INPUT n : {of}; m : {of}; END_VAR\n  VAR_OUTPUT q : {of}; END_VAR\n  q := n;\nEND_PROGRAM\n"
    );
    let two = format!(
        "PROGRAM two\n  VAR_INPUT n : {of}; END_VAR\n  VAR_OUTPUT q : {of}; END_VAR\n  q := n;\nEND_PROGRAM\n"
    );
    let head = "[cluster]\nname = \"cell\"\n[[controller]]\nname = \"one\"\nladder = \"one.st\"\n";
    let setpoint = format!(
        "[[remote_io]]\ncontroller = \"one\"\nfail_safe = {{ q = {high} }}\n[remote_io.inputs]\nn = {{ operator = \"setpoint\", low = {low}, high = {high}, initial = {low} }}\n"
    );
    let alarm = format!("[[alarm]]\nsignal = \"one.q\"\nbelow = {high}\ntext = \"low\"\n");
    let field = format!(
        "{head}{setpoint}[remote_io.field]\nmodbus = \"127.0.0.1:1502\"\ninputs = {{ m = \"input:0 {register}\" }}\noutputs = {{ q = \"holding:0 {register}\" }}\n{alarm}"
    );
    let signals = format!(
        "{head}[[controller]]\nname = \"two\"\nladder = \"two.st\"\n[[understudy]]\nname = \"u\"\n{setpoint}[[remote_io]]\ncontroller = \"two\"\n[remote_io.inputs]\nn = {{ from = \"one.q\", default = {high}, stale_after = 5 }}\n{alarm}"
    );
    [("one.st", one), ("two.st", two), ("field.toml", field), ("signals.toml", signals)]
}

#[test]
fn every_command_has_whole_numbers_as_numbers() {
    for (place, (of, register, low, high)) in TYPES.into_iter().enumerate() {
        let folder = empty_folder(&format!("whole_numbers_{place}"));
        for (name, text) in cluster(of, register, low, high) {
            fs::write(folder.join(name), text).expect("written");
        }
        let run = |arguments: &[&str]| {
            let answer = understudy_in(&folder, arguments);
            assert_eq!(answer.status, 0, "{of}: {}", answer.shown());
            answer.output
        };
        run(&["check", "field.toml"]);
        run(&["check", "signals.toml"]);
        fs::write(folder.join("inputs.txt"), format!("{low} 0\n{high} 0\n")).expect("written");
        let scanned = run(&["scan", "one.st", "--inputs", "inputs.txt", "--period", PERIOD]);
        assert_eq!(scanned, format!("{low} 0 -> {low}\n{high} 0 -> {high}\n"), "{of}");
        run(&["simulate", "signals.toml", "--cycles", "40", "--seed", "1", "--out", "runs"]);
        for controller in ["one", "two"] {
            let output = format!("{controller}.q");
            let why = run(&["why", &output, "runs/latest", "--at", "30"]);
            let first = format!("{output} is {low} in cycle 30");
            assert_eq!(why.lines().next(), Some(first.as_str()), "{of}: {why}");
        }
    }
}

/// What is written keeps the numbers, and is drafted, as what was read.
#[test]
fn conversions_keep_whole_numbers() {
    for (place, (of, _, low, high)) in TYPES.into_iter().enumerate() {
        let folder = empty_folder(&format!("whole_numbers_converted_{place}"));
        let [(name, text), ..] = cluster(of, "int", low, high);
        fs::write(folder.join(name), text).expect("written");
        fs::write(folder.join("inputs.txt"), format!("{low} 0\n{high} 0\n")).expect("written");
        for written in ["one.xml", "again.st"] {
            let answer = understudy_in(&folder, &["convert", name, written]);
            assert_eq!(answer.status, 0, "{of}: {}", answer.shown());
            let answer = understudy_in(&folder, &["scan", written, "--inputs", "inputs.txt"]);
            let expected = format!("{low} 0 -> {low}\n{high} 0 -> {high}\n");
            assert_eq!(answer.output, expected, "{of}: {}", answer.shown());
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
