//! The tables of standard functions and blocks of IEC 61131-3, one by one.

mod running;

use std::fmt::Write as _;

use running::{check, read, shown};
use understudy_text::Severity;

const NUMBERS: [&str; 14] = [
    "SINT", "INT", "DINT", "LINT", "USINT", "UINT", "UDINT", "ULINT", "BYTE", "WORD", "DWORD",
    "LWORD", "REAL", "LREAL",
];

const TIMES: [&str; 4] = ["TIME", "DATE", "TIME_OF_DAY", "DATE_AND_TIME"];

/// What is wrong with a program of one statement, or with the output that it has after one scan.
fn wrong(variables: &str, body: &str) -> String {
    let text = format!("PROGRAM main VAR {variables} END_VAR {body} END_PROGRAM");
    let (_, found) = read(&text, None);
    let errors = shown(&text, &found, Severity::Error);
    match errors.is_empty() {
        true => errors,
        false => format!("{body} {errors}"),
    }
}

#[test]
fn every_conversion_is_there() {
    let mut table = String::new();
    let all = || NUMBERS.iter().chain(&TIMES).chain(&["BOOL", "STRING"]);
    for from in all() {
        for to in all().filter(|to| *to != from) {
            let variables = format!("a : {from}; b : {to};");
            for body in [format!("b := {from}_TO_{to}(a);"), format!("b := TO_{to}(a);")] {
                table += &wrong(&variables, &body);
            }
        }
    }
    for from in ["REAL", "LREAL"] {
        for to in &NUMBERS[..8] {
            let variables = format!("a : {from}; b : {to};");
            for body in [
                format!("b := {from}_TRUNC_{to}(a);"),
                "b := TRUNC(a);".to_owned(),
                format!("b := TRUNC_{to}(a);"),
            ] {
                table += &wrong(&variables, &body);
            }
        }
    }
    for bits in ["BYTE", "WORD", "DWORD", "LWORD"] {
        for number in ["USINT", "UINT", "UDINT", "ULINT"] {
            let variables = format!("a : {bits}; b : {number};");
            for body in [
                format!("b := {bits}_BCD_TO_{number}(a);"),
                format!("a := {number}_TO_BCD_{bits}(b);"),
                format!("b := BCD_TO_{number}(a);"),
                format!("a := TO_BCD_{bits}(b);"),
            ] {
                table += &wrong(&variables, &body);
            }
        }
    }
    for text in ["WSTRING", "STRING"] {
        for number in NUMBERS {
            let variables = format!("a : {text}; b : {number};");
            table += &wrong(&variables, &format!("a := {number}_TO_{text}(b);"));
            table += &wrong(&variables, &format!("b := {text}_TO_{number}(a);"));
        }
    }
    for (short, long) in [("TIME", "LTIME"), ("DATE", "LDATE"), ("TOD", "LTOD"), ("DT", "LDT")] {
        let variables = format!("a : {short}; b : {long};");
        table += &wrong(&variables, &format!("b := {short}_TO_{long}(a);"));
        table += &wrong(&variables, &format!("a := {long}_TO_{short}(b);"));
    }
    for (from, to) in [
        ("DT", "DATE"),
        ("DT", "TOD"),
        ("LDT", "LDATE"),
        ("LDT", "LTOD"),
        ("LDT", "TOD"),
        ("DT", "LTOD"),
        ("LDT", "DATE"),
        ("DATE_AND_TIME", "TIME_OF_DAY"),
        ("DATE_AND_TIME", "DATE"),
    ] {
        let variables = format!("a : {from}; b : {to};");
        table += &wrong(&variables, &format!("b := {from}_TO_{to}(a);"));
    }
    assert!(table.is_empty(), "{table}");
}

#[test]
fn every_function_of_the_tables_is_there() {
    let mut table = String::new();
    let mut each = |types: &[&str], body: &str| {
        for of in types {
            let variables = format!(
                "a : {of}; b : {of}; c : {of}; n : INT; g : BOOL; r : REAL; w : DWORD; s : STRING; z : STRING; t : TIME; d : DATE; o : TOD; e : DT;"
            );
            let body = body.replace("TYPE", of);
            let _ = write!(table, "{}", wrong(&variables, &body));
        }
    };
    let reals = ["REAL", "LREAL"];
    for function in ["ABS", "SQRT", "LN", "LOG", "EXP", "SIN", "COS", "TAN", "ASIN", "ACOS", "ATAN"]
    {
        each(&reals, &format!("a := {function}(b);"));
        each(&reals, &format!("a := {function}(IN := b);"));
        each(&reals, &format!("a := {function}_TYPE(b);"));
    }
    each(&NUMBERS[..8], "a := ABS(b);");
    each(&reals, "a := ATAN2(b, c); a := ATAN2(Y := b, X := c);");
    for function in ["ADD", "MUL", "MAX", "MIN"] {
        each(&NUMBERS, &format!("a := {function}(a, b, c); a := {function}(IN1 := a, IN2 := b);"));
        each(&NUMBERS[..8], &format!("a := {function}_TYPE(a, b);"));
    }
    for function in ["SUB", "DIV"] {
        each(&NUMBERS, &format!("a := {function}(a, b);"));
        each(&NUMBERS[..8], &format!("a := {function}_TYPE(a, b);"));
    }
    each(&NUMBERS[..8], "a := MOD(a, b); a := a MOD b;");
    each(&reals, "a := EXPT(a, b); a := EXPT(a, n); a := a ** n;");
    let bits = ["BYTE", "WORD", "DWORD", "LWORD"];
    each(&bits, "a := SHL(b, n); a := SHR(IN := b, N := n); a := ROL(b, 3); a := ROR(b, n);");
    each(&bits, "a := AND(a, b, c); a := OR(a, b); a := XOR(a, b, c); a := NOT(a); a := a & b;");
    each(&["BOOL"], "a := AND(a, b, c); a := OR(a, b); a := XOR(a, b); a := NOT a;");
    let every: Vec<&str> = NUMBERS.into_iter().chain(TIMES).chain(["BOOL", "STRING"]).collect();
    each(&every, "a := MOVE(b); a := SEL(g, a, b); a := SEL(G := g, IN0 := a, IN1 := b);");
    each(&every, "a := MUX(n, a, b, c); a := MUX(K := n, IN0 := a, IN1 := b);");
    each(
        &every,
        "a := MAX(a, b, c); a := MIN(a, b); a := LIMIT(a, b, c); a := LIMIT(MN := a, IN := b, MX := c);",
    );
    each(
        &every,
        "g := GT(a, b, c); g := GE(a, b); g := EQ(a, b); g := LE(a, b); g := LT(a, b); g := NE(a, b);",
    );
    each(
        &["INT"],
        "n := LEN(s); s := LEFT(s, n); s := RIGHT(IN := s, L := n); s := MID(s, n, 1); s := CONCAT(s, z, s);
         s := INSERT(s, z, n); s := DELETE(s, n, 1); s := REPLACE(s, z, n, 1); n := FIND(s, z);",
    );
    each(
        &["INT"],
        "t := ADD(t, t); t := ADD_TIME(t, t); o := ADD(o, t); o := ADD_TOD_TIME(o, t); e := ADD_DT_TIME(e, t);
         t := SUB_TIME(t, t); t := SUB_DATE_DATE(d, d); o := SUB_TOD_TIME(o, t); t := SUB_TOD_TOD(o, o);
         e := SUB_DT_TIME(e, t); t := SUB_DT_DT(e, e); t := MUL(t, n); t := MUL_TIME(t, r); t := MULTIME(t, n);
         t := DIV(t, n); t := DIV_TIME(t, r); t := DIVTIME(t, n); e := CONCAT_DATE_TOD(d, o); d := CONCAT_DATE(n, n, n);
         o := CONCAT_TOD(n, n, n, n); e := CONCAT_DT(n, n, n, n, n, n, n); n := DAY_OF_WEEK(d);",
    );
    assert!(table.is_empty(), "{table}");
}

#[test]
fn every_block_of_the_tables_is_there() {
    let mut table = String::new();
    for block in ["SR", "RS", "R_TRIG", "F_TRIG", "SEMA"] {
        table += &wrong(&format!("b : {block};"), "b();");
    }
    for of in ["", "_INT", "_DINT", "_LINT", "_UINT", "_UDINT", "_ULINT"] {
        let number = of.strip_prefix('_').unwrap_or("INT");
        for (block, body) in [
            ("CTU", "b(CU := TRUE, R := FALSE, PV := v); q := b.Q; v := b.CV;"),
            ("CTD", "b(CD := TRUE, LD := FALSE, PV := v); q := b.Q; v := b.CV;"),
            (
                "CTUD",
                "b(CU := TRUE, CD := q, R := q, LD := q, PV := v); q := b.QU OR b.QD; v := b.CV;",
            ),
        ] {
            table += &wrong(&format!("b : {block}{of}; v : {number}; q : BOOL;"), body);
        }
    }
    for block in ["TP", "TON", "TOF"] {
        for of in ["", "_TIME", "_LTIME"] {
            table += &wrong(
                &format!("b : {block}{of}; t : TIME; q : BOOL;"),
                "b(IN := q, PT := T#1s); q := b.Q; t := b.ET;",
            );
        }
    }
    assert!(table.is_empty(), "{table}");
    let clock = wrong("b : RTC;", "b();");
    assert!(clock.contains("the type RTC is not supported"), "{clock}");
}

#[test]
fn functions_of_one_type_calculate_in_it() {
    check(
        "PROGRAM main VAR_OUTPUT a : DINT; b : DINT; c : REAL; d : WORD; e : BOOL; END_VAR
         VAR n : INT := 30000; x : BYTE := 16#80; END_VAR
           a := ADD_DINT(n, n); b := MUL_DINT(IN1 := n, IN2 := n); c := SQRT_REAL(16.0); d := SHL_WORD(x, 1); e := GT_SINT(3, 2);
         END_PROGRAM",
        &[(&[], "60000 900000000 4 256 1")],
    );
    let narrow = wrong("a : INT; r : REAL;", "a := ADD_INT(a, r);");
    assert!(narrow.contains("expected INT, found REAL"), "{narrow}");
    let times = wrong("t : TIME; n : INT;", "t := ADD_TIME(t, n);");
    assert!(times.contains("U1043"), "{times}");
}

#[test]
fn texts_are_selected() {
    check(
        "PROGRAM main VAR_INPUT n : INT; END_VAR VAR_OUTPUT a : INT; b : INT; c : INT; END_VAR VAR s : STRING[5] := 'xy'; END_VAR
           a := LEN(MUX(n, 'a', 'bcd', s)); b := LEN(LIMIT('b', s, 'ccc')); c := FIND(STR1 := 'abc', STR2 := 'c');
         END_PROGRAM",
        &[(&[0], "1 3 3"), (&[1], "3 3 3"), (&[2], "2 3 3")],
    );
    let text = "PROGRAM main VAR_INPUT n : INT; END_VAR VAR s : STRING[5]; END_VAR s := MUX(n, 'a', 'b'); END_PROGRAM";
    let mut running = running::Running::new(running::program(text));
    running.scan(&[2]);
    assert!(running.fault().is_some());
}

#[test]
fn bits_and_reals_are_transferred_and_numbers_converted() {
    check(
        "PROGRAM main
         VAR_INPUT d : DWORD; END_VAR
         VAR_OUTPUT a : BOOL; b : DWORD; c : DWORD; e : BOOL; f : LWORD; g : BOOL; h : DWORD; i : BOOL; END_VAR
           a := DWORD_TO_REAL(d) = 1.0; b := REAL_TO_DWORD(-2.0); c := REAL_TO_DWORD(DWORD_TO_REAL(d));
           e := LWORD_TO_LREAL(16#3FF8_0000_0000_0000) = 1.5; f := LREAL_TO_LWORD(1.0);
           g := TO_REAL(d) = 1.0; h := TO_DWORD(REAL#1.0); i := UDINT_TO_REAL(TO_UDINT(d)) > 1.0E9;
         END_PROGRAM",
        &[
            (&[0x3F80_0000], "1 3221225472 1065353216 1 4607182418800017408 1 1065353216 1"),
            (&[1], "0 3221225472 1 1 4607182418800017408 0 1065353216 0"),
        ],
    );
}

#[test]
fn a_text_beyond_its_type_is_the_nearest_number() {
    for (text, int, uint, dint, lint, byte) in [
        ("40000", 32767, 40000, 40000, "40000", 255),
        ("-40000", -32768, 0, -40000, "-40000", 0),
        ("99999999999999999999", 32767, 65535, i32::MAX, "9223372036854775807", 255),
        ("-99999999999999999999", -32768, 0, i32::MIN, "-9223372036854775808", 0),
        ("16#fF", 255, 255, 255, "255", 255),
        ("2#101", 5, 5, 5, "5", 5),
        ("-8#17", -15, 0, -15, "-15", 0),
        ("42 m", 42, 42, 42, "42", 42),
        ("m", 0, 0, 0, "0", 0),
        ("", 0, 0, 0, "0", 0),
    ] {
        let program = format!(
            "PROGRAM main
             VAR_OUTPUT a : INT; b : UINT; c : DINT; d : LINT; e : BYTE; END_VAR
             VAR t : STRING; END_VAR
               t := '{text}';
               a := STRING_TO_INT(t); b := STRING_TO_UINT(t); c := STRING_TO_DINT(t); d := STRING_TO_LINT(t); e := STRING_TO_BYTE(t);
             END_PROGRAM"
        );
        check(&program, &[(&[], &format!("{int} {uint} {dint} {lint} {byte}"))]);
    }
}

#[test]
fn conversions_have_the_values_of_the_standard() {
    check(
        "PROGRAM main
         VAR_OUTPUT a : INT; b : SINT; c : UDINT; d : DINT; e : BYTE; f : UINT; g : BOOL; h : DINT; i : WORD; END_VAR
           a := REAL_TO_INT(2.5); b := INT_TO_SINT(200); c := DINT_TO_UDINT(-1); d := TRUNC(-2.9); e := USINT_TO_BCD_BYTE(42);
           f := WORD_BCD_TO_UINT(16#1234); g := INT_TO_BOOL(2); h := TIME_TO_DINT(T#1s5ms); i := BOOL_TO_WORD(TRUE);
         END_PROGRAM",
        &[(&[], "2 -56 4294967295 -2 66 1234 1 1005 1")],
    );
}
