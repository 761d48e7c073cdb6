//! What a program reads of one that is not executed is said: it keeps its initial value.

mod running;

use running::read;

/// The names that the warnings list, for a chosen program or for those that the file runs.
fn missing(text: &str, program: Option<&str>) -> Vec<String> {
    let (lowered, found) = read(text, program);
    assert!(lowered.program.is_some(), "{found:#?}");
    let warnings = found.into_iter().filter(|found| found.code == "U1085");
    warnings
        .map(|found| {
            assert!(found.message.contains("which is not executed"), "{}", found.message);
            let end = found.message.find(" read here").expect("what is read");
            found.message[..end].trim_end_matches(" is").trim_end_matches(" are").replace('`', "")
        })
        .collect()
}

const BOTH: &str = "
    VAR_GLOBAL shared : INT; free : INT; own : INT; END_VAR
    FUNCTION_BLOCK writes VAR_EXTERNAL shared : INT; END_VAR shared := shared + 1; END_FUNCTION_BLOCK
    PROGRAM a
      VAR_INPUT go : BOOL; END_VAR
      VAR_OUTPUT x : BOOL; n : INT; k : INT := 5; END_VAR
      VAR t : TON; w : writes; m AT %MX0.0 : BOOL; list : ARRAY [0..3] OF INT; END_VAR
      x := go;
      n := n + 1;
      list[n MOD 4] := n;
      t(IN := go, PT := T#1s);
      m := go;
      w();
    END_PROGRAM
    PROGRAM b
      VAR_INPUT i : BOOL; END_VAR
      VAR_OUTPUT y : BOOL; z : INT; END_VAR
      VAR_EXTERNAL shared : INT; free : INT; own : INT; END_VAR
      BODY
    END_PROGRAM";

#[test]
fn what_a_program_misses_of_another_one_is_named() {
    for (body, expected) in [
        ("y := i;", None),
        // Nothing writes these, or the program itself.
        ("z := a.k + free;", None),
        ("own := own + 1; z := own;", None),
        ("y := a.x;", Some("a.x")),
        ("IF a.n > 3 THEN y := a.x; END_IF;", Some("a.n, a.x")),
        ("z := a.list[2];", Some("a.list[2]")),
        ("y := a.t.Q;", Some("a.t.Q")),
        ("z := shared;", Some("shared")),
        ("y := %MX0.0;", Some("%MX0.0")),
        ("z := MAX(a.n, shared);", Some("a.n, shared")),
    ] {
        let text = BOTH.replace("BODY", body);
        let names = missing(&text, Some("b"));
        match expected {
            None => assert!(names.is_empty(), "{body}: {names:?}"),
            Some(expected) => assert_eq!(names, [expected], "{body}"),
        }
        // Together nothing is missing; nor is it where a task runs both.
        assert!(missing(&text, None).is_empty(), "{body}");
        let tasks = "CONFIGURATION c RESOURCE r ON plc TASK t(INTERVAL := T#10ms, PRIORITY := 1); PROGRAMS END_RESOURCE END_CONFIGURATION";
        let run = |programs: &str| format!("{text} {}", tasks.replace("PROGRAMS", programs));
        let both = run("PROGRAM p WITH t : a; PROGRAM q WITH t : b;");
        assert!(missing(&both, None).is_empty(), "{body}");
        // A configuration leaves one out as an option does.
        let one = missing(&run("PROGRAM q WITH t : b;"), None);
        assert_eq!(one, expected.map(str::to_owned).as_slice(), "{body}");
    }
}

/// A program that is called is executed, and errors of one that is not chosen are not of this program.
#[test]
fn what_is_called_is_executed() {
    let text = "PROGRAM a VAR x : BOOL; END_VAR x := NOT x; END_PROGRAM
        PROGRAM b VAR_OUTPUT y : BOOL; END_VAR a(); y := a.x; END_PROGRAM";
    assert!(missing(text, Some("b")).is_empty());
    let broken = "PROGRAM a VAR x : BOOL; END_VAR x := 3; unknown := x; END_PROGRAM
        PROGRAM b VAR_OUTPUT y : BOOL; END_VAR y := TRUE; END_PROGRAM";
    assert!(missing(broken, Some("b")).is_empty());
}
