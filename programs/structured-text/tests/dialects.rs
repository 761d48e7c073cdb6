//! What other compilers take besides the standard: pointers into one variable, narrower types, C code, memory at addresses.

mod running;

use running::{Running, check, once, program, read, shown};
use understudy_text::Severity;

/// The errors of a text contain these words.
fn refused(text: &str, words: &[&str]) {
    let (_, found) = read(text, None);
    let errors = shown(text, &found, Severity::Error);
    for word in words {
        assert!(errors.contains(word), "{word} in {errors}");
    }
}

fn warned(text: &str, word: &str) {
    let (lowered, found) = read(text, None);
    let warnings = shown(text, &found, Severity::Warning);
    let errors = shown(text, &found, Severity::Error);
    assert!(lowered.program.is_some(), "{errors}");
    assert!(warnings.contains(word), "{word} in {warnings}");
}

#[test]
fn pointers_into_one_variable_are_distances() {
    // The number in a text, as libraries for CODESYS read it.
    check(
        "FUNCTION DECIMAL : INT
         VAR_INPUT digits : STRING[10]; END_VAR
         VAR pt : POINTER TO BYTE; i : INT; x : BYTE; END_VAR
           pt := ADR(digits);
           FOR i := 1 TO LEN(digits) DO
             x := pt^;
             IF x > 47 AND x < 58 THEN DECIMAL := DECIMAL * 10 + x - 48; END_IF;
             pt := pt + 1;
           END_FOR;
         END_FUNCTION
         PROGRAM main VAR_OUTPUT y : INT; z : INT; END_VAR
           y := DECIMAL('4a7'); z := DECIMAL('');
         END_PROGRAM",
        &[(&[], "47 0")],
    );
    once(
        "x : BYTE; y : BYTE;",
        "s : STRING[5] := 'abc'; p : REF_TO ARRAY[1..5] OF BYTE;",
        "p := REF(s); x := p^[2]; y := p^[4];",
        "98 0",
    );
    once(
        "x : DWORD; y : REAL;",
        "r : REAL := 1.0; p : POINTER TO DWORD;",
        "p := ADR(r); x := p^; p^ := p^ - 8388608; y := r;",
        "1065353216 0.5",
    );
    once(
        "x : INT; y : INT;",
        "t : ARRAY[3..5] OF INT := [10, 20, 30]; p : POINTER TO INT;",
        "p := ADR(t) + SIZEOF(INT); x := p^; p := p + 2; y := p^;",
        "20 30",
    );
}

#[test]
fn a_pointer_that_leaves_its_variable_is_a_fault() {
    for body in [
        "p := ADR(t) + 6; x := p^;",
        "p := ADR(t) - 2; x := p^;",
        "p := ADR(t) + 1; x := p^;",
        "IF x = 1 THEN p := ADR(t); END_IF; x := p^;",
    ] {
        let text = format!(
            "PROGRAM main VAR_OUTPUT x : INT; END_VAR
             VAR t : ARRAY[0..2] OF INT; p : POINTER TO INT; END_VAR {body} END_PROGRAM"
        );
        let mut running = Running::new(program(&text));
        running.scan(&[]);
        assert!(running.fault().is_some(), "{body}");
    }
    for body in ["p := ADR(s) + 9; x := p^;", "p := ADR(s) - 1; x := p^;"] {
        let text = format!(
            "PROGRAM main VAR_OUTPUT x : BYTE; END_VAR
             VAR s : STRING[8]; p : POINTER TO BYTE; END_VAR {body} END_PROGRAM"
        );
        let mut running = Running::new(program(&text));
        running.scan(&[]);
        assert!(running.fault().is_some(), "{body}");
    }
}

#[test]
fn an_input_that_is_only_followed_is_an_in_out() {
    check(
        "FUNCTION DOUBLED : BOOL
         VAR_INPUT p : POINTER TO INT; times : INT; END_VAR
           p^ := p^ * times; DOUBLED := TRUE;
         END_FUNCTION
         PROGRAM main VAR_OUTPUT y : INT := 3; z : BOOL; END_VAR
           z := DOUBLED(ADR(y), 2); z := DOUBLED(p := ADR(y), times := 10);
         END_PROGRAM",
        &[(&[], "60 1")],
    );
}

#[test]
fn other_pointers_are_refused_by_name() {
    let body = |variables: &str, body: &str| {
        format!("PROGRAM main VAR x : INT; y : INT; {variables} END_VAR {body} END_PROGRAM")
    };
    for (variables, statements) in [
        ("p : POINTER TO INT;", "p := ADR(x); p := ADR(y);"),
        ("p : POINTER TO INT;", "IF p = 0 THEN x := 1; END_IF;"),
        ("p : POINTER TO INT; q : POINTER TO INT;", "p := ADR(x); q := p;"),
        ("p : POINTER TO INT;", "p := ADR(x); x := SIZEOF(p);"),
    ] {
        refused(&body(variables, statements), &["U1040", "pointers"]);
    }
    refused(
        &body("s : STRING; p : POINTER TO BYTE;", "p := ADR(s); p^ := 65;"),
        &["U1040", "points into STRING"],
    );
}

#[test]
fn narrower_types_keep_the_low_bits_with_a_warning() {
    once("x : SINT; y : BYTE;", "d : DINT := 70000;", "x := a + 300; y := d;", "51 112");
    warned(
        "PROGRAM main VAR x : INT; y : DINT; END_VAR x := y; END_PROGRAM",
        "DINT becomes INT, which is narrower",
    );
    refused(
        "PROGRAM main VAR x : INT; y : REAL; END_VAR x := y; x := 70000; END_PROGRAM",
        &["expected INT, found REAL", "70000 is not an INT"],
    );
}

#[test]
fn the_standard_function_is_meant_where_that_of_the_file_does_not_fit() {
    check(
        "FUNCTION SEL : BOOL VAR_INPUT a, b, c : BOOL; END_VAR SEL := b OR c; END_FUNCTION
         PROGRAM main VAR_OUTPUT x : INT; y : BOOL; END_VAR
           x := SEL(TRUE, 3, x + 5); y := SEL(FALSE, FALSE, TRUE);
         END_PROGRAM",
        &[(&[], "5 1"), (&[], "10 1")],
    );
}

#[test]
fn memory_at_addresses_that_overlap_is_refused() {
    let two = |first: &str, second: &str| {
        format!("PROGRAM main VAR a AT {first}; b AT {second}; END_VAR END_PROGRAM")
    };
    for (first, second) in [
        ("%MW0 : WORD", "%MX0.3 : BOOL"),
        ("%MD0 : DWORD", "%MW1 : INT"),
        // By size they are apart, by bytes they are not.
        ("%MD4 : DINT", "%MW6 : INT"),
        ("%MB2 : BYTE", "%MX2.7 : BOOL"),
        ("%MW0 : ARRAY[0..3] OF INT", "%MW2 : INT"),
        ("%ML1 : LREAL", "%MD3 : REAL"),
    ] {
        refused(&two(first, second), &["U1083", "share a part of the memory"]);
    }
    for (first, second) in [
        ("%MW0 : WORD", "%MW1 : WORD"),
        ("%MW0 : WORD", "%MX9.3 : BOOL"),
        ("%MX0.0 : BOOL", "%MX0.1 : BOOL"),
        ("%MW1.0 : WORD", "%MX2.0.3 : BOOL"),
        ("%MD0 : DINT", "%MD0 : DINT"),
    ] {
        let text = two(first, second);
        let (lowered, found) = read(&text, None);
        let errors = shown(&text, &found, Severity::Error);
        assert!(lowered.program.is_some(), "{first} and {second}: {errors}");
    }
    refused(
        "PROGRAM main VAR a AT %MW0 : WORD; END_VAR %MX1.0 := TRUE; END_PROGRAM",
        &["U1083", "`a` share a part"],
    );
}

/// Inputs and outputs of every pair of sizes at every small address: those that share bits of the process image, by the count of the standard or by
/// that of bytes, have a warning with both places, or an error where they have one size. No other pair has one.
#[test]
fn inputs_and_outputs_that_share_bits_are_named() {
    const SIZES: [(char, &str, u64); 5] = [
        ('X', "BOOL", 1),
        ('B', "BYTE", 8),
        ('W', "WORD", 16),
        ('D', "DWORD", 32),
        ('L', "LWORD", 64),
    ];
    // The address, its bits by size and by bytes.
    let places = |(letter, _, bits): (char, &str, u64)| {
        (0..5_u64).map(move |at| match letter {
            'X' => (format!("X{}.{}", at / 2, 3 * (at % 2)), [at / 2 * 8 + 3 * (at % 2); 2]),
            _ => (format!("{letter}{at}"), [at * bits, at * 8]),
        })
    };
    for area in ['I', 'Q', 'M'] {
        for (first, second) in SIZES.iter().flat_map(|a| SIZES.iter().map(move |b| (*a, *b))) {
            for ((one, begins), (other, starts)) in
                places(first).flat_map(|a| places(second).map(move |b| (a.clone(), b)))
            {
                let meet = |by: usize| {
                    begins[by] < starts[by] + second.2 && starts[by] < begins[by] + first.2
                };
                let same_size = first.0 == second.0;
                let shares = one != other && (meet(0) || !same_size && meet(1));
                let text = format!(
                    "PROGRAM main VAR a AT %{area}{one} : {}; END_VAR END_PROGRAM
                     PROGRAM more VAR b AT %{area}{other} : {}; END_VAR END_PROGRAM",
                    first.1, second.1
                );
                let (_, found) = read(&text, None);
                let found: Vec<_> = found.iter().filter(|found| found.code == "U1083").collect();
                assert_eq!(found.len(), usize::from(shares), "{text}: {found:?}");
                for found in found {
                    let is_error = found.severity == Severity::Error;
                    assert_eq!(is_error, area == 'M' || same_size, "{text}");
                    assert!(found.message.contains(&format!("%{area}{one}")), "{}", found.message);
                    assert!(
                        found.message.contains(&format!("%{area}{other}")),
                        "{}",
                        found.message
                    );
                    assert_eq!(found.related.len(), 1, "both places");
                }
            }
        }
    }
    // One warning for a word, whichever is declared first.
    for variables in [
        "w AT %QW0 : WORD; a AT %QX0.0 : BOOL; b AT %QX0.1 : BOOL; c AT %QX1.7 : BOOL;",
        "a AT %QX0.0 : BOOL; b AT %QX0.1 : BOOL; c AT %QX1.7 : BOOL; w AT %QW0 : WORD;",
        "w AT %QW0 : WORD; a AT %QX0.0 : ARRAY[0..9] OF BOOL;",
    ] {
        let text = format!("PROGRAM main VAR {variables} END_VAR END_PROGRAM");
        let (lowered, found) = read(&text, None);
        assert!(lowered.program.is_some());
        assert_eq!(
            shown(&text, &found, Severity::Warning).matches("share bits").count(),
            1,
            "{text}"
        );
    }
    refused(
        "TYPE pair : STRUCT one : INT; two : INT; END_STRUCT; END_TYPE
         PROGRAM main VAR p AT %QW0 : pair; x AT %QW1 : INT; END_VAR END_PROGRAM",
        &["U1083", "share a part of the memory"],
    );
}

#[test]
fn a_structure_at_an_address_has_a_point_for_each_part() {
    check(
        "TYPE axis : STRUCT speed : INT; on : BOOL; END_STRUCT; END_TYPE
         TYPE cell : STRUCT axes : ARRAY[1..2] OF axis; count : DINT; END_STRUCT; END_TYPE
         PROGRAM main
           VAR given AT %I3.0 : cell; told AT %Q3.0 : cell; END_VAR
           told := given; told.count := given.axes[2].speed + 1;
         END_PROGRAM",
        &[(&[7, 1, -8, 0, 5], "7 1 -8 0 -7")],
    );
    refused(
        "TYPE named : STRUCT name : STRING; END_STRUCT; END_TYPE
         PROGRAM main VAR given AT %I3.0 : named; END_VAR END_PROGRAM",
        &["U1083", "a structure of them"],
    );
}

#[test]
fn c_code_is_refused_unless_it_writes_nothing() {
    check(
        "PROGRAM main VAR_OUTPUT y : INT; END_VAR
           y := y + 1;
           {{ printf(\"y is %d\\n\", GetFbVar(Y)); }}
         END_PROGRAM",
        &[(&[], "1"), (&[], "2")],
    );
    warned(
        "PROGRAM main {{ printf(\"hello\"); }} {extern int f();} END_PROGRAM",
        "this C code is not executed",
    );
    for code in [
        "{{ SetFbVar(Y, 3); }}",
        "{if (Ready()) __SET_VAR(data__->,Y, 2)}",
        "{extern void f(MAIN*);f(data__);}",
    ] {
        let text = format!("PROGRAM main VAR y : INT; END_VAR y := 1; {code} END_PROGRAM");
        refused(&text, &["U1040", "C code"]);
    }
    // Blocks that no program has are not executed: OpenPLC writes those of Python into each file.
    check(
        "FUNCTION_BLOCK python_eval VAR_INPUT a : BOOL; END_VAR {extern void f(PYTHON_EVAL*);f(data__);} END_FUNCTION_BLOCK \
         PROGRAM main VAR_OUTPUT y : INT; END_VAR y := 3; END_PROGRAM",
        &[(&[], "3")],
    );
    refused(
        "FUNCTION_BLOCK b VAR_INPUT a : BOOL; END_VAR {{ SetFbVar(A, 1); }} END_FUNCTION_BLOCK \
         PROGRAM main VAR f : b; END_VAR f(); END_PROGRAM",
        &["U1040", "C code"],
    );
    // The time of the scan, as matiec's own blocks read it.
    check(
        "PROGRAM main VAR_OUTPUT y : TIME; END_VAR {__SET_VAR(data__->,y,,__CURRENT_TIME)} END_PROGRAM",
        &[(&[], "0"), (&[], "10000000")],
    );
}

/// A text is not a point: the program keeps it, with a warning.
#[test]
fn inputs_and_outputs_that_are_no_points_are_kept_with_a_warning() {
    let text = "PROGRAM main VAR_INPUT name : STRING := 'ab'; u : INT; END_VAR \
                VAR_OUTPUT said : STRING; n : INT; END_VAR \
                said := name; n := u + LEN(said); END_PROGRAM";
    check(text, &[(&[5], "7")]);
    warned(text, "`name` is STRING");
    warned(text, "`said` is STRING");
    let parts = "TYPE pair : STRUCT low : INT; high : INT; END_STRUCT; END_TYPE \
                 PROGRAM main VAR_INPUT p : pair; END_VAR VAR_OUTPUT n : INT; END_VAR \
                 n := p.low + 10 * p.high; END_PROGRAM";
    check(parts, &[(&[1, 2], "21")]);
}

#[test]
fn results_of_lists_go_on_behind_labels() {
    let list = "LD a
         JMPC clear
         LD n
         ADD 1
         JMP done
         clear:
         LD 0
         done:
         ST n
         GT 3
         ST y";
    check(
        &format!(
            "PROGRAM main VAR_INPUT a : BOOL; END_VAR VAR_OUTPUT n : INT; y : BOOL; END_VAR
             {list}
             END_PROGRAM"
        ),
        &[(&[0], "1 0"), (&[0], "2 0"), (&[0], "3 0"), (&[0], "4 1"), (&[1], "0 0")],
    );
    refused(
        "PROGRAM main VAR a : BOOL; n : INT; r : REAL; END_VAR
           LD r
           JMP done
           LD n
           done:
           ST n
         END_PROGRAM",
        &["U1017", "different types"],
    );
    refused(
        "PROGRAM main VAR a : BOOL; END_VAR
           JMP done
           done:
           ST a
         END_PROGRAM",
        &["U1017", "no result yet"],
    );
}

#[test]
fn a_value_behind_a_named_one_is_for_the_input_at_its_place() {
    check(
        "FUNCTION LESS : INT VAR_INPUT a, b : INT; END_VAR LESS := a - b; END_FUNCTION
         PROGRAM main VAR_OUTPUT x : INT; y : INT; END_VAR VAR s : T_MaxString := 'a.b'; END_VAR
           x := LESS(a := 7, 2); y := FIND(STR1 := s, '.');
         END_PROGRAM",
        &[(&[], "5 2")],
    );
    refused(
        "FUNCTION LESS : INT VAR_INPUT a, b : INT; END_VAR LESS := a - b; END_FUNCTION
         PROGRAM main VAR x : INT; END_VAR x := LESS(b := 7, 2); END_PROGRAM",
        &["U1049", "given twice"],
    );
    refused(
        "PROGRAM main VAR p : PYTHON_EVAL; END_VAR END_PROGRAM",
        &["U1040", "PYTHON_EVAL is not supported"],
    );
}

#[test]
fn an_event_runs_a_task() {
    let text = |task: &str| {
        format!(
            "PROGRAM counting VAR_EXTERNAL n : INT; END_VAR n := n + 1; END_PROGRAM
             PROGRAM main VAR_INPUT go : BOOL; END_VAR VAR_OUTPUT y : INT; END_VAR VAR_EXTERNAL begin : BOOL; n : INT; END_VAR
               begin := go; y := n;
             END_PROGRAM
             CONFIGURATION c VAR_GLOBAL begin : BOOL; n : INT; END_VAR
               RESOURCE r ON plc
                 TASK event({task}PRIORITY := 1); TASK cyclic(INTERVAL := T#10ms, PRIORITY := 0);
                 PROGRAM p WITH event : counting; PROGRAM q WITH cyclic : main;
               END_RESOURCE
             END_CONFIGURATION"
        )
    };
    check(
        &text("SINGLE := begin, "),
        &[
            (&[0], "0"),
            (&[1], "0"),
            (&[1], "1"),
            (&[1], "1"),
            (&[0], "1"),
            (&[1], "1"),
            (&[0], "2"),
        ],
    );
    refused(
        &text("SINGLE := begin, INTERVAL := T#20ms, "),
        &["U1084", "has an INTERVAL and an event"],
    );
    refused(&text("SINGLE := unknown, "), &["U1041", "unknown"]);
}
