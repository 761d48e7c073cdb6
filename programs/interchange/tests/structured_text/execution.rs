//! A ladder does what its typed program does, scan by scan.

use std::path::{Path, PathBuf};

use understudy_interchange::{Bodies, Format, Wanted, WriteError, plcopen, read, typed_text};
use understudy_ladder::Program as Ladder;
use understudy_logic::{Circuit, Running};
use understudy_structured_text::syntax::File;
use understudy_structured_text::{Options, lower, parse};
use understudy_testing::random::Dice;
use understudy_typed::{Interpreter, Program};

use crate::support::PERIOD;

/// Bits of the points of a ladder: its names, and where each stands in the image of the typed program.
fn places(names: &[&str], points: &understudy_typed::Points) -> Vec<usize> {
    let known: Vec<String> = points.bit_names().iter().map(|name| shaped(name)).collect();
    let place = |name: &&str| {
        let found = known.iter().position(|known| *known == shaped(name));
        found.unwrap_or_else(|| panic!("no bit `{name}` in {known:?}"))
    };
    names.iter().map(place).collect()
}

/// The name of a point as a ladder has it: that of `%QX1.1` is `QX1.1`, that of `lamps[0]` is `lamps.0`.
fn shaped(name: &str) -> String {
    name.trim_start_matches('%').replace('[', ".").replace(']', "")
}

/// The typed program of a file.
pub(crate) fn typed(text: &str, file: &File) -> Option<Program> {
    let options =
        Options { text, period: i64::try_from(PERIOD.as_nanos()).ok(), ..Options::default() };
    lower(file, &options).program
}

/// Compares the scans of a ladder with those of its program.
pub(crate) fn check(what: &str, ladder: &Ladder, typed: &Program, seed: u64) {
    let shown = format!("{what}\n{}", understudy_ladder::print(ladder));
    let circuit = ladder.lower(PERIOD).unwrap_or_else(|error| panic!("{error:?}: {shown}"));
    compare(&shown, &circuit, typed, seed);
}

/// Compares the scans of a circuit with those of a program, for each bit that the circuit has; whether the program stopped by a fault.
fn compare(what: &str, circuit: &Circuit, typed: &Program, seed: u64) -> bool {
    let inputs: Vec<&str> = circuit.inputs().iter().map(String::as_str).collect();
    let outputs: Vec<&str> = circuit.outputs().iter().map(|it| it.name.as_str()).collect();
    let mut running = Running::new(circuit);
    let (into, from) = (places(&inputs, &typed.inputs), places(&outputs, &typed.outputs));
    let interpreter = Interpreter::new(typed);
    let mut state = interpreter.initial().to_vec();
    let mut dice = Dice::new(seed);
    let mut bits = dice.bits(inputs.len());
    let mut stopped = false;
    for scan in 0..400 {
        // Inputs stay for a while, so that timers run out.
        if scan % 7 == 0 || scan > 250 {
            bits = dice.bits(inputs.len());
        }
        let found = running.step(&bits);
        let mut image = vec![0; typed.inputs.width().div_ceil(64)];
        for (place, bit) in into.iter().zip(&bits) {
            image[place / 64] |= u64::from(*bit) << (place % 64);
        }
        let mut image_out = vec![0; typed.outputs.width().div_ceil(64)];
        interpreter.step(&mut state, &image, &mut image_out);
        for ((name, place), found) in outputs.iter().zip(&from).zip(found) {
            let expected = image_out[place / 64] >> (place % 64) & 1 == 1;
            assert_eq!(found, expected, "`{name}` in scan {scan}: {what}");
        }
        stopped |= understudy_typed::Fault::read(&state).is_some();
    }
    stopped
}

/// An output beyond its subrange is the end of it from the end of the scan on, in the program too.
#[test]
fn circuits_keep_outputs_within_their_subranges() {
    for body in [
        "IF go THEN n := n + 2; END_IF; q := n = 11;",
        "q := n > 8; IF go THEN n := n + m; ELSE n := n - 3; END_IF;",
        "n := m; IF go THEN m := m - 1; ELSE m := m + 5; END_IF; q := m > 0;",
    ] {
        let text = format!(
            "PROGRAM p VAR_INPUT go : BOOL; END_VAR VAR_OUTPUT n : INT (0..9); m : INT (-2..20) := 1; q : BOOL; END_VAR {body} END_PROGRAM"
        );
        let typed = typed(&text, &parse(&text).0).expect("a sound program");
        let circuit = understudy_bits::exact(&typed).expect("a circuit");
        check_bits(&text, &circuit, &typed, 3);
    }
}

/// Many branches are followed one after the other, few each within the one before: conditions that change something, branches that leave, and an ELSE.
#[test]
fn branches_of_every_number_are_followed() {
    for count in [1, 15, 16, 17, 40] {
        let branch = |place: usize| {
            let left = if place % 7 == 6 { "RETURN;" } else { "" };
            format!(
                "ELSIF Taken(i := (a XOR b) AND n = {place}, c := n) OR (b AND n = {}) THEN q := NOT q; n := n + 2; m := {place}; {left}\n",
                place + 3
            )
        };
        let branches: String = (0..count).map(branch).collect();
        let text = format!(
            "FUNCTION Taken : BOOL VAR_INPUT i : BOOL; END_VAR VAR_IN_OUT c : USINT; END_VAR
             IF c < 250 THEN c := c + 1; ELSE c := 0; END_IF; Taken := i; END_FUNCTION
             PROGRAM p VAR_INPUT a, b : BOOL; END_VAR VAR_OUTPUT q : BOOL; n, m : USINT; END_VAR
             IF a AND b AND n > 40 THEN n := 0; {branches} ELSE n := n - 1; END_IF; m := m + 1; END_PROGRAM"
        );
        let (file, found) = parse(&text);
        assert!(!understudy_text::has_errors(&found), "{found:#?}");
        let typed = typed(&text, &file).unwrap_or_else(|| panic!("no program: {text}"));
        check_bits(&text, &understudy_bits::exact(&typed).expect("a circuit"), &typed, 11);
    }
}

/// A number that is chosen by two conditions of which one compares BOOLs: the circuit has both of its values.
#[test]
fn conditions_on_equal_bools_decide_nothing_of_them() {
    let conditions =
        ["x", "a", "b", "NOT x", "x = b", "x <> b", "x AND b", "x OR b", "x = (a <> b)"];
    for outer in conditions {
        for inner in conditions {
            for body in [
                format!("IF {outer} THEN IF {inner} THEN v := 0; END_IF; END_IF;"),
                format!("IF {outer} THEN ; ELSIF {inner} THEN v := 0; END_IF;"),
                format!(
                    "IF {outer} THEN IF {inner} THEN v := v + 1; END_IF; ELSIF {inner} THEN v := 0; END_IF;"
                ),
            ] {
                let text = format!(
                    "PROGRAM p VAR_INPUT a, b : BOOL; END_VAR VAR_OUTPUT v : INT := 3; END_VAR VAR x : BOOL; END_VAR x := a AND NOT x; {body} END_PROGRAM"
                );
                let typed = typed(&text, &parse(&text).0).expect("a sound program");
                let circuit = understudy_bits::exact(&typed).expect("a circuit");
                check_bits(&text, &circuit, &typed, 3);
            }
        }
    }
}

/// Timers of each kind with presets from 0 on, whatever else the program has.
#[test]
fn timers_of_every_preset_are_followed() {
    for kind in ["TON", "TOF", "TP"] {
        for preset in [0, 50, 100, 150, 200, 300] {
            for (more, body) in [("", ""), ("o : TON;", "o(IN := b, PT := T#200ms);")] {
                let text = format!(
                    "PROGRAM p VAR_INPUT a, b : BOOL; END_VAR VAR_OUTPUT q, r : BOOL; v : INT := 3; END_VAR VAR t : {kind}; {more} END_VAR
                     {body} t(IN := a, PT := T#{preset}ms); q := t.Q; r := t.ET > T#0ms; IF t.Q AND b THEN v := 0; ELSIF b THEN v := 3; END_IF; END_PROGRAM"
                );
                let typed = typed(&text, &parse(&text).0).expect("a sound program");
                for seed in 0..4 {
                    let circuit = understudy_bits::exact(&typed).expect("a circuit");
                    check_bits(&text, &circuit, &typed, seed);
                }
            }
        }
    }
}

/// An output that only an address names is driven as every other one, by the ladder and by the file as it is read.
#[test]
fn outputs_that_only_an_address_names_are_driven() {
    let blocks = "
        FUNCTION_BLOCK Lamp VAR_INPUT i : BOOL; END_VAR VAR_OUTPUT o : BOOL; END_VAR o := NOT i; END_FUNCTION_BLOCK
        FUNCTION_BLOCK Wired VAR_INPUT i : BOOL; END_VAR VAR o AT %QX0.3 : BOOL; END_VAR o := NOT i; END_FUNCTION_BLOCK
        FUNCTION Shown : BOOL VAR_INPUT i : BOOL; END_VAR %QX2.0 := NOT i; Shown := i; END_FUNCTION";
    for (variables, body) in [
        ("", "%QX1.1 := NOT a;"),
        ("", "IF a AND b THEN %QX1.1 := TRUE; ELSIF b THEN %QX1.1 := FALSE; END_IF;"),
        ("", "%QX1.1 := %QX1.2 XOR a; %QX1.2 := %QX1.1 OR b;"),
        ("", "q := %IX0.4 AND a; %QX1.1 := %IX0.5;"),
        ("lamps AT %QX0.0 : ARRAY [0..1] OF BOOL;", "lamps[0] := a; lamps[1] := NOT b;"),
        ("lamps AT %QX0.0 : ARRAY [0..1] OF BOOL;", "q := lamps[1]; lamps[0] := NOT a;"),
        ("l : Lamp;", "l(i := a, o => %QX1.1);"),
        ("w : Wired;", "w(i := a);"),
        ("", "q := Shown(a);"),
        ("t : TON;", "t(IN := a, PT := T#300ms, Q => %QX1.1); q := t.Q;"),
    ] {
        let text = format!(
            "{blocks} PROGRAM p VAR_INPUT a : BOOL; b : BOOL; END_VAR VAR_OUTPUT q : BOOL; END_VAR VAR {variables} END_VAR {body} END_PROGRAM"
        );
        outputs_are_driven(&text);
    }
    for body in ["LDN a\nST %QX1.1", "LD a\nS %QX1.1\nLD b\nR %QX1.1", "LD a\nST lamps[1]"] {
        let text = format!(
            "PROGRAM p VAR_INPUT a : BOOL; b : BOOL; END_VAR VAR_EXTERNAL lamps : ARRAY [0..1] OF BOOL; END_VAR\n{body}\nEND_PROGRAM
            CONFIGURATION c VAR_GLOBAL lamps AT %QX4.0 : ARRAY [0..1] OF BOOL; END_VAR
            RESOURCE r ON PLC TASK t(INTERVAL := T#100ms, PRIORITY := 1); PROGRAM x WITH t : p; END_RESOURCE END_CONFIGURATION"
        );
        outputs_are_driven(&text);
    }
}

/// The circuit of a text drives all outputs of its program, as its rungs do where they hold it; read as a source, it has its points under their names.
fn outputs_are_driven(text: &str) {
    let (file, found) = parse(text);
    assert!(!understudy_text::has_errors(&found), "{found:#?}\n{text}");
    let typed = typed(text, &file).unwrap_or_else(|| panic!("no program: {text}"));
    check_bits(text, &understudy_bits::exact(&typed).expect("a circuit"), &typed, 7);
    if let Some(ladder) = read(Format::StructuredText, "p.st", text, None).program {
        let wanted = typed.outputs.iter().filter(|point| point.slot != 0);
        let mut wanted: Vec<String> = wanted.map(|point| shaped(&point.name)).collect();
        let mut found: Vec<String> = ladder.outputs.iter().map(|it| it.name.to_string()).collect();
        wanted.sort();
        found.sort();
        assert_eq!(found, wanted, "{text}");
        check(text, &ladder, &typed, 7);
    }
    let wanted = Wanted { period: Some(PERIOD), program: None };
    let source = understudy_interchange::read_source("p.st", text, wanted).source;
    let Some(understudy_interchange::Source::Program(program)) = source else {
        panic!("read as {source:?}: {text}");
    };
    let names = |program: &Program| {
        let outputs = program.outputs.iter();
        outputs.map(|point| point.name.clone()).collect::<Vec<String>>()
    };
    assert_eq!(names(&program), names(&typed), "{text}");
}

/// Compares the scans of an exact circuit with those of its program, bit by bit.
pub(crate) fn check_bits(what: &str, circuit: &Circuit, typed: &Program, seed: u64) {
    // A program that never stops has neither reset nor fault.
    let stops = circuit.outputs().iter().any(|output| output.name == Program::FAULT);
    let named = |points: &understudy_typed::Points| {
        let own = points.iter().filter(|point| stops || point.slot != 0);
        own.map(|point| point.of.bits() as usize).sum::<usize>()
    };
    assert_eq!(circuit.inputs().len(), named(&typed.inputs), "{what}");
    assert_eq!(circuit.outputs().len(), named(&typed.outputs), "{what}");
    let stopped = compare(what, circuit, typed, seed);
    assert!(stops || !stopped, "{what}");
}

fn files(folder: &Path, found: &mut Vec<PathBuf>) {
    let Ok(entries) = std::fs::read_dir(folder) else {
        return;
    };
    for entry in entries.flatten() {
        let path = entry.path();
        if path.is_dir() {
            files(&path, found);
        } else {
            found.push(path);
        }
    }
}

/// Circuits do what their programs do, and rungs where they hold them; whatever is written as rungs has a circuit.
#[test]
fn circuits_and_rungs_of_public_texts_do_what_their_programs_do() {
    let mut found = Vec::new();
    let own = concat!(env!("CARGO_MANIFEST_DIR"), "/../../examples");
    files(Path::new(own), &mut found);
    files(Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/tests")), &mut found);
    // Those of the project alone are few.
    let mut least = (5, 2);
    if let Some(folder) = std::env::var_os("UNDERSTUDY_DATA") {
        files(Path::new(&folder), &mut found);
        least = (40, 10);
    }
    found.sort();
    let (mut circuits, mut rungs) = (0, 0);
    for path in found {
        let ending = path.extension().and_then(|ending| ending.to_str());
        let Ok(text) = std::fs::read_to_string(&path) else {
            continue;
        };
        let (format, (file, _)) = match ending {
            Some("st" | "ST") => (Format::StructuredText, parse(&text)),
            Some("xml") => (Format::PlcOpen, plcopen::read_typed(&text)),
            _ => continue,
        };
        let name = path.display().to_string();
        let Some(typed) = typed(&text, &file).filter(|typed| typed.tasks.len() == 1) else {
            continue;
        };
        let circuit = understudy_bits::exact(&typed);
        if let Some(ladder) = read(format, &name, &text, None).program {
            check(&name, &ladder, &typed, 7);
            rungs += 1;
            assert!(circuit.is_ok(), "{name}: {circuit:?}");
        }
        if let Ok(circuit) = circuit {
            check_bits(&name, &circuit, &typed, 7);
            circuits += 1;
        }
    }
    assert!(circuits >= least.0 && rungs >= least.1, "{circuits} circuits, {rungs} as rungs");
}

/// Programs with numbers, of the project and of others where they are there, written as Structured Text and as PLCopen XML: each text does what the
/// program does, or [`typed_text`] says so; and what the XML does not hold is named.
#[test]
fn programs_with_numbers_are_written_as_they_are() {
    let mut found = Vec::new();
    let own = concat!(env!("CARGO_MANIFEST_DIR"), "/../../examples");
    files(Path::new(own), &mut found);
    if let Some(folder) = std::env::var_os("UNDERSTUDY_DATA") {
        files(&Path::new(&folder).join("programs"), &mut found);
    }
    found.sort();
    let (mut written, mut drawn) = (0, 0);
    for path in found {
        let ending = path.extension().and_then(|ending| ending.to_str());
        if !ending.is_some_and(|ending| ["st", "ST", "xml", "TcPOU"].contains(&ending)) {
            continue;
        }
        let Ok(text) = std::fs::read_to_string(&path) else {
            continue;
        };
        let name = path.display().to_string();
        let form = Format::StructuredText;
        let wanted = Wanted::default;
        let result = typed_text(&name, &text, wanted(), form, Bodies::AsRead);
        let (found, diagnostics) = result.unwrap_or_else(|error| panic!("{name}: {error}"));
        let Some(found) = found else {
            continue;
        };
        written += 1;
        // What is written can be read, and written again.
        let again = typed_text("again.st", &found.text, wanted(), form, Bodies::AsRead);
        let (again, found) = again.unwrap_or_else(|error| panic!("{name}: {error}"));
        assert!(again.is_some(), "{name}: {found:?}, {diagnostics:?}");
        for bodies in [Bodies::AsRead, Bodies::Blocks] {
            match typed_text(&name, &text, wanted(), Format::PlcOpen, bodies) {
                Ok((found, _)) => {
                    let found = found.expect("it was written as text");
                    drawn += 1;
                    let again = typed_text(
                        "again.xml",
                        &found.text,
                        wanted(),
                        Format::PlcOpen,
                        Bodies::AsRead,
                    );
                    let (again, found) = again.unwrap_or_else(|error| panic!("{name}: {error}"));
                    assert!(again.is_some(), "{name}: {found:?}");
                }
                Err(WriteError::NotHeld(_)) => {}
                Err(error) => panic!("{name} {bodies:?}: {error}"),
            }
        }
    }
    assert!(written >= 10, "{written} programs");
    assert!(drawn * 10 >= written * 18, "{drawn} documents of {written}");
}
