//! Which variables are retentive, by their declarations.

mod running;

use running::{Running, program, read, shown};
use understudy_text::Severity;

/// A function block with each kind of declaration, one with an instance of it, and a structure.
const TYPES: &str = "TYPE pair : STRUCT a : INT; b : BOOL; END_STRUCT; END_TYPE
    FUNCTION_BLOCK inner
      VAR_INPUT i : BOOL; END_VAR VAR_OUTPUT RETAIN o : BOOL; END_VAR
      VAR own : INT; END_VAR VAR RETAIN kept : INT; END_VAR VAR NON_RETAIN lost : INT; END_VAR
      own := own + 1; kept := kept + 1; lost := lost + 1; o := i;
    END_FUNCTION_BLOCK
    FUNCTION_BLOCK outer
      VAR x : inner; END_VAR VAR NON_RETAIN y : inner; END_VAR VAR RETAIN z : inner; END_VAR VAR n : INT; END_VAR
      x(); y(); z(); n := n + 1;
    END_FUNCTION_BLOCK\n";

/// The retentive names of a program with some declarations.
fn names(declarations: &str) -> String {
    let text = format!("{TYPES}PROGRAM main {declarations} END_PROGRAM");
    program(&text).retentive_names().join(" ")
}

#[test]
fn declarations_tell_what_is_retentive() {
    let cases = [
        ("VAR a : INT; END_VAR", ""),
        ("VAR RETAIN a, b : INT; END_VAR VAR c : INT; END_VAR", "a b"),
        ("VAR PERSISTENT a : INT; END_VAR VAR RETAIN PERSISTENT b : INT; END_VAR", "a b"),
        ("VAR NON_RETAIN a : INT; END_VAR VAR_OUTPUT RETAIN q : BOOL; END_VAR", "q"),
        ("VAR_STAT RETAIN s : INT; END_VAR VAR_STAT t : INT; END_VAR", "s"),
        ("VAR RETAIN a : pair; b : ARRAY [1..3] OF pair; c : STRING[9]; END_VAR", "a b c"),
        ("VAR RETAIN t : TON; END_VAR VAR u : TON; END_VAR", "t"),
        (
            "VAR RETAIN q AT %QX0.0 : BOOL; m AT %MW3 : INT; END_VAR VAR r AT %QX0.1 : BOOL; END_VAR",
            "q m",
        ),
        // The innermost block of declarations that says something decides.
        ("VAR x : inner; END_VAR", "x.o x.kept"),
        ("VAR RETAIN x : inner; END_VAR", "x.i x.o x.own x.kept"),
        ("VAR NON_RETAIN x : inner; END_VAR", "x.o x.kept"),
        ("VAR x : ARRAY [2..3] OF inner; END_VAR", "x[2].o x[2].kept x[3].o x[3].kept"),
        ("VAR x : outer; END_VAR", "x.x.o x.x.kept x.y.o x.y.kept x.z.i x.z.o x.z.own x.z.kept"),
        (
            "VAR RETAIN x : outer; END_VAR",
            "x.x.i x.x.o x.x.own x.x.kept x.y.o x.y.kept x.z.i x.z.o x.z.own x.z.kept x.n",
        ),
    ];
    for (declarations, wanted) in cases {
        assert_eq!(names(declarations), wanted, "{declarations}");
    }
}

#[test]
fn global_variables_and_whole_programs_are_retentive() {
    let text = "PROGRAM one VAR_INPUT i : BOOL; END_VAR VAR a : INT; END_VAR VAR NON_RETAIN b : INT; END_VAR a := a + 1; END_PROGRAM
        CONFIGURATION c VAR_GLOBAL RETAIN g : INT; END_VAR VAR_GLOBAL h : INT; END_VAR
        RESOURCE r ON plc TASK t(INTERVAL := T#10ms, PRIORITY := 0);
        PROGRAM RETAIN p WITH t : one; PROGRAM q WITH t : one; END_RESOURCE END_CONFIGURATION";
    assert_eq!(program(text).retentive_names(), ["g", "p.a"]);
    let alone = read(text, Some("one")).0.program.expect("a program");
    assert_eq!(alone.retentive_names(), ["g", "a"]);
    // Variables at addresses are memory of the controller, and declared by the program all the same.
    let text = "PROGRAM one VAR k AT %QD0 : INT; m AT %MW2 : INT; i AT %IX0.0 : BOOL; END_VAR VAR NON_RETAIN n AT %MW4 : INT; END_VAR
        k := k + 1; m := m + 1; n := n + 1; END_PROGRAM
        CONFIGURATION c RESOURCE r ON plc TASK t(INTERVAL := T#10ms, PRIORITY := 0);
        PROGRAM RETAIN p WITH t : one; END_RESOURCE END_CONFIGURATION";
    assert_eq!(program(text).retentive_names(), ["k", "m"]);
}

#[test]
fn a_program_without_retentive_variables_keeps_nothing() {
    let program =
        program("PROGRAM main VAR a : INT; t : TON; END_VAR a := a + 1; t(); END_PROGRAM");
    assert!(!program.is_retentive());
    assert!(program.retentive_mask().iter().all(|word| *word == 0));
}

/// A state of a warm start: what is retentive goes on, and so does a timer in the time that it had.
#[test]
fn a_warm_start_goes_on_with_what_is_retentive() {
    let text = "PROGRAM main VAR_OUTPUT RETAIN n : INT; END_VAR VAR_OUTPUT m, is_over : INT; END_VAR VAR RETAIN t : TON; END_VAR
        n := n + 1; m := m + 1; t(IN := TRUE, PT := T#100ms); IF t.Q THEN is_over := 1; ELSE is_over := 0; END_IF; END_PROGRAM";
    let mut running = Running::new(program(text));
    for scan in 1..=6 {
        assert_eq!(running.scan(&[]), [scan, scan, 0]);
    }
    running.restart();
    for scan in 7..=14 {
        assert_eq!(running.scan(&[]), [scan, scan - 6, u64::from(scan > 10)]);
    }
}

#[test]
fn retain_that_has_no_effect_is_told() {
    let message = |declared: &str| {
        let text = format!("PROGRAM main VAR n : INT; END_VAR {declared} n := n + 1; END_PROGRAM");
        shown(&text, &read(&text, None).1, Severity::Warning)
    };
    for (declared, reason) in [
        ("VAR_TEMP RETAIN a : INT; END_VAR", "VAR_TEMP begins with its initial value in each call"),
        ("VAR_INPUT RETAIN a : INT; END_VAR", "an input is sampled in each scan"),
        ("VAR RETAIN a AT %IX0.0 : BOOL; END_VAR", "an input is sampled in each scan"),
        ("VAR CONSTANT RETAIN a : INT := 3; END_VAR", "a constant is never written"),
    ] {
        let found = message(declared);
        let wanted = format!("RETAIN of `a` has no effect: {reason}");
        assert!(found.contains(&wanted), "{declared}: {found}");
    }
    assert_eq!(message("VAR RETAIN a : INT; END_VAR"), "");
}

#[test]
fn the_parts_of_a_data_block_say_what_is_kept() {
    let text = |block: &str| {
        format!(
            "DATA_BLOCK \"d\" {block} VAR a : INT; END_VAR VAR RETAIN b : INT; END_VAR VAR NON_RETAIN c : INT; END_VAR BEGIN END_DATA_BLOCK
            ORGANIZATION_BLOCK \"Main\" BEGIN \"d\".a := \"d\".a + 1; \"d\".b := \"d\".b + 1; \"d\".c := \"d\".c + 1; %QW0 := \"d\".a; END_ORGANIZATION_BLOCK"
        )
    };
    assert_eq!(program(&text("")).retentive_names(), ["d.a", "d.b"]);
    assert_eq!(program(&text("NON_RETAIN")).retentive_names(), ["d.b"]);
}

#[test]
fn retain_and_non_retain_contradict_each_other() {
    let errors = |text: &str| shown(text, &read(text, None).1, Severity::Error);
    for declared in
        ["VAR RETAIN NON_RETAIN", "VAR NON_RETAIN PERSISTENT", "VAR NON_RETAIN CONSTANT RETAIN"]
    {
        let text = format!("PROGRAM main {declared} n : INT; END_VAR n := n + 1; END_PROGRAM");
        let found = errors(&text);
        assert!(found.contains("U1035") && found.contains("not both"), "{declared}: {found}");
    }
    for declared in ["VAR RETAIN PERSISTENT", "VAR RETAIN RETAIN"] {
        let text = format!("PROGRAM main {declared} n : INT; END_VAR n := n + 1; END_PROGRAM");
        assert_eq!(errors(&text), "", "{declared}");
    }
}

/// A variable of a routine that keeps its value between calls.
#[test]
fn static_variables_of_routines_are_listed() {
    let text = "FUNCTION count : INT VAR_STAT RETAIN n : INT; END_VAR VAR_STAT m : INT; END_VAR n := n + 1; m := m + 1; count := n; END_FUNCTION
        FUNCTION_BLOCK b METHOD up : INT VAR_INST RETAIN k : INT; END_VAR k := k + 1; up := k; END_METHOD END_FUNCTION_BLOCK
        PROGRAM main VAR x : INT; own : b; END_VAR x := count() + own.up(); END_PROGRAM";
    assert_eq!(program(text).retentive_names(), ["count.n", "b.up.k"]);
}
