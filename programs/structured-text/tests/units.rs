//! The units of a library that other people wrote, one by one: how many have no error.
//!
//! `UNDERSTUDY_OSCAT=FOLDER cargo test -p understudy-structured-text --test units -- --nocapture`, where the folder is a checkout of the
//! public repository `PLC-lang/oscat`.

mod running;

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;
use std::fs;
use std::path::PathBuf;

use running::read;
use understudy_structured_text::parse;
use understudy_text::{Lines, Severity, decode};

#[test]
fn nine_of_ten_units_of_oscat_are_taken() {
    let Some(folder) = std::env::var_os("UNDERSTUDY_OSCAT") else {
        understudy_testing::skip("UNDERSTUDY_OSCAT is not set");
        return;
    };
    let folder = PathBuf::from(folder);
    let mut text = String::new();
    for name in ["stubs.st", "oscat.st"] {
        let bytes = fs::read(folder.join(name)).expect("a readable file");
        text += &decode(bytes).expect("a text");
        text.push('\n');
    }
    let (file, _) = parse(&text);
    let (_, found) = read(&text, None);
    let lines = Lines::new(&text);
    let mut refused: BTreeMap<&str, BTreeSet<String>> = BTreeMap::new();
    for error in found.iter().filter(|found| found.severity == Severity::Error) {
        let place = error.span.start;
        let mut units = file.units.iter();
        if let Some(unit) = units.find(|unit| unit.span.contains(&place)) {
            let line = format!("{} {} {}", lines.position(place), error.code, error.message);
            refused.entry(unit.name.as_str()).or_default().insert(line);
        }
    }
    let mut table = String::new();
    for (unit, errors) in &refused {
        let _ = writeln!(table, "{unit}");
        for error in errors.iter().take(3) {
            let _ = writeln!(table, "    {error}");
        }
    }
    let (all, taken) = (file.units.len(), file.units.len() - refused.len());
    let _ = writeln!(table, "{taken} of {all} units taken");
    std::io::Write::write_all(&mut std::io::stdout(), table.as_bytes()).expect("an output");
    assert!(taken * 100 >= all * 95, "{taken} of {all}");
}

/// For each value: an enumeration as a number of each width and back, by the names of both types.
#[test]
fn an_enumeration_is_converted_by_the_names_of_its_types() {
    let body = "TYPE COLOUR : (red, green := 5, blue, far := 300); END_TYPE TYPE A_TO_B : (low := -2, high) SINT; END_TYPE
        PROGRAM main VAR_INPUT k : INT; END_VAR VAR_OUTPUT a, b, c, d, e, f : DINT; r : REAL; same : BOOL; END_VAR
        VAR colour : COLOUR; other : A_TO_B; END_VAR
        CASE k OF 0: colour := red; 1: colour := green; 2: colour := blue; ELSE colour := far; END_CASE;
        other := SEL(k > 0, A_TO_B#low, A_TO_B#high);
        a := COLOUR_TO_INT(colour); b := colour_to_dint(COLOUR#blue); c := COLOUR_TO_USINT(colour); d := A_TO_B_TO_INT(other);
        e := TO_INT(colour); f := ANY_TO_DINT(colour); r := COLOUR_TO_REAL(colour);
        same := INT_TO_COLOUR(COLOUR_TO_INT(colour)) = colour AND TO_COLOUR(e) = colour AND INT_TO_A_TO_B(DINT_TO_INT(d)) = other; END_PROGRAM";
    let real = |value: f32| format!("{}", value.to_bits());
    for (k, value, other) in [(0, 0, -2), (1, 5, -1), (2, 6, -1), (3, 300, -1)] {
        let low = value & 0xff;
        let wanted = format!("{value} 6 {low} {other} {value} {value} {} 1", real(value as f32));
        let mut running = running::Running::new(running::program(body));
        let found = running.scan(&[k]);
        let found: Vec<String> = found
            .iter()
            .zip(running.outputs())
            .map(|(value, point)| match point.of {
                understudy_typed::Elementary::Real => value.to_string(),
                of => of.signed(*value).to_string(),
            })
            .collect();
        assert_eq!(found.join(" "), wanted, "{k}");
    }
    let errors = |line: &str| {
        let text = body.replace("a := COLOUR_TO_INT(colour);", line);
        running::shown(&text, &running::read(&text, None).1, Severity::Error)
    };
    assert!(errors("a := COLOUR_TO_INT(other);").starts_with("U1043"));
    assert!(errors("a := COLOR_TO_INT(colour);").starts_with("U1041"));
    assert!(errors("a := COLOUR_TO_COLOUR(colour);").starts_with("U1041"));
}

#[test]
fn a_variable_of_an_interface_is_told_as_one() {
    let text = "INTERFACE Moves METHOD go : BOOL END_METHOD END_INTERFACE
        FUNCTION_BLOCK Motor IMPLEMENTS Moves METHOD PUBLIC go : BOOL go := TRUE; END_METHOD END_FUNCTION_BLOCK
        PROGRAM main VAR m : Motor; any : Moves; END_VAR m.go(); END_PROGRAM";
    let found = running::shown(text, &running::read(text, None).1, Severity::Error);
    assert!(
        found.starts_with("U1040")
            && found.contains("INTERFACE `Moves`")
            && found.contains("`Motor`"),
        "{found}"
    );
}

#[test]
fn a_list_stands_in_front_of_its_constants_and_variables() {
    running::check(
        "VAR_GLOBAL CONSTANT last : INT := 3; END_VAR VAR_GLOBAL count : INT := 2; END_VAR
        PROGRAM main VAR_OUTPUT x : INT; y : BOOL; END_VAR VAR t : ARRAY [0..GVL.last] OF INT := [3(1), 9]; END_VAR
        x := t[GVL.last] + GVL.count; y := GVL.last.0; END_PROGRAM",
        &[(&[], "11 1")],
    );
}
