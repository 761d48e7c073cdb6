//! Arrays at addresses: each element is a point.

mod running;

use running::{Running, check, once, program, read, shown};
use understudy_text::Severity;
use understudy_typed::Elementary;

/// For every type: what an input array is given is in its elements, and what is written into an output array is at its points.
#[test]
fn each_element_of_an_array_at_an_address_is_a_point() {
    for of in Elementary::ALL {
        if of.is_time() || of.is_real() {
            continue;
        }
        let size = match of.bits() {
            1 => "X",
            8 => "B",
            16 => "W",
            32 => "D",
            _ => "L",
        };
        let dot = if size == "X" { "0." } else { "" };
        for length in [1_usize, 3, 8, 13] {
            let last = length + 1;
            let text = format!(
                "PROGRAM main VAR given AT %I{size}{dot}0 : ARRAY [2..{last}] OF {of}; out AT %Q{size}{dot}0 : ARRAY [0..{}] OF {of}; i : INT; END_VAR
                FOR i := 2 TO {last} DO out[{last} - i] := given[i]; END_FOR; END_PROGRAM",
                length - 1
            );
            let program = program(&text);
            assert_eq!(program.tasks.len(), 1);
            let mut running = Running::new(program);
            let names: Vec<String> =
                running.inputs().iter().map(|point| point.name.clone()).collect();
            let wanted: Vec<String> = (2..=last).map(|at| format!("given[{at}]")).collect();
            assert_eq!(names, wanted);
            for scan in 0..20_u64 {
                let values: Vec<u64> = (0..length as u64)
                    .map(|at| (at + scan).wrapping_mul(0x9e37_79b9_7f4a_7c15) & of.mask())
                    .collect();
                let reversed: Vec<u64> = values.iter().rev().copied().collect();
                assert_eq!(running.scan(&values), reversed, "{text}");
            }
        }
    }
}

#[test]
fn arrays_at_addresses_are_points_whatever_runs() {
    // A global one, initial values, several programs, and a task that runs every other time.
    let text = "VAR_GLOBAL lamps AT %QX0.0 : ARRAY [0..2] OF BOOL := [TRUE, 2(FALSE)]; END_VAR
        PROGRAM one VAR_INPUT a : BOOL; END_VAR lamps[1] := a; END_PROGRAM
        PROGRAM two lamps[2] := NOT lamps[2]; END_PROGRAM
        CONFIGURATION c RESOURCE r ON plc TASK f(INTERVAL := T#10ms, PRIORITY := 0); TASK s(INTERVAL := T#20ms, PRIORITY := 1);
        PROGRAM p WITH f : one; PROGRAM q WITH s : two; END_RESOURCE END_CONFIGURATION";
    check(text, &[(&[1], "1 1 1"), (&[0], "1 0 1"), (&[1], "1 1 0"), (&[1], "1 1 0")]);
    once("x : INT;", "w AT %QW4 : ARRAY [0..1] OF INT;", "w[1] := 7; x := w[1]; RETURN;", "0 7 7");
}

/// Two variables never are one output without a word.
#[test]
fn an_element_is_at_no_other_address() {
    let errors = |declared: &str, body: &str| {
        let text = format!("PROGRAM main VAR x : BOOL; {declared} END_VAR {body} END_PROGRAM");
        shown(&text, &read(&text, None).1, Severity::Error)
    };
    let lamps = "lamps AT %QX1.2 : ARRAY [0..7] OF BOOL;";
    for taken in ["%QX1.2", "%QX1.7", "%QX2.1", "%Q2.1", "%QX5.2"] {
        for declared in [
            format!("{lamps} other AT {taken} : BOOL;"),
            format!("other AT {taken} : BOOL; {lamps}"),
        ] {
            let found = errors(&declared, "");
            assert!(
                found.starts_with("U1083") && found.lines().count() == 1,
                "{declared}: {found}"
            );
        }
        assert_ne!(errors(lamps, &format!("{taken} := x;")), "", "{taken}");
    }
    for free in ["%QX1.1", "%QX2.3", "%IX1.2", "%QX1.10.2"] {
        assert_eq!(errors(&format!("{lamps} other AT {free} : BOOL;"), ""), "", "{free}");
    }
    let words = "w AT %QW4 : ARRAY [0..3] OF INT;";
    assert!(errors(&format!("{words} v AT %QW7 : INT;"), "").starts_with("U1083"));
    assert!(errors(&format!("{words} v AT %QW6 : ARRAY [0..3] OF INT;"), "").starts_with("U1083"));
    assert_eq!(errors(&format!("{words} v AT %QW8 : INT;"), ""), "");
    for wrong in [
        "%QB4 : ARRAY [0..3] OF INT",
        "%QX0.0 : ARRAY [0..3] OF BYTE",
        "%QX0.0 : ARRAY [0..2000] OF BOOL",
        "%QX0.0 : ARRAY [0..1, 0..1] OF BOOL",
    ] {
        assert!(errors(&format!("w AT {wrong};"), "").starts_with("U1083"), "{wrong}");
    }
}
