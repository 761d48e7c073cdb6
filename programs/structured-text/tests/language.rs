//! The meaning of the language, by small programs whose outputs are known.

mod running;

use running::{check, once, program, read, shown};
use understudy_text::Severity;
use understudy_typed::{Points, Program};

#[test]
fn literals_take_the_type_of_what_stands_beside_them() {
    once("x : REAL;", "r : REAL := 0.1;", "x := r * 10;", "1");
    once("x : REAL;", "", "x := 1.0 / 3.0;", "0.33333334");
    once("x : LREAL;", "", "x := 1.0 / 3.0;", "0.3333333333333333");
    once("x : LREAL;", "", "x := a * 0.5 + b;", "0.5");
    once("x : DINT;", "", "x := 70000 + a;", "70007");
    once("x : WORD; y : BYTE;", "", "x := 16#FF00 OR 3; y := NOT 16#F0;", "65283 15");
    once("x : LREAL;", "", "x := 1 / 2 + 1.0 / 2;", "0.5");
    once("x : BOOL; y : BOOL;", "", "x := 3 > 2.5; y := a = 7 AND b <> 7;", "1 1");
    once("x : REAL;", "", "x := SQRT(2.0);", "1.4142135");
}

#[test]
fn integers_are_promoted_and_compared_by_their_values() {
    once("x : DINT;", "d : DINT := 100000;", "x := a * d;", "700000");
    once("x : BOOL;", "u : UINT := 65535;", "x := b < u;", "1");
    once("x : BOOL;", "u : USINT := 200; s : SINT := -1;", "x := s < u;", "1");
    once("x : INT;", "u : UINT := 3;", "x := a + u;", "10");
    once("x : INT; y : INT;", "", "x := b / 2; y := b MOD 2;", "-1 -1");
    once("x : WORD;", "w : WORD := 16#00F0;", "x := SHL(w, 4) OR SHR(w, 4);", "3855");
    once("x : INT; y : UINT;", "", "x := -a; y := INT_TO_UINT(b);", "-7 65533");
}

#[test]
fn conversions_are_exact() {
    once(
        "x : INT; y : INT; z : INT;",
        "",
        "x := REAL_TO_INT(2.5); y := REAL_TO_INT(3.5); z := TRUNC(-2.9);",
        "2 4 -2",
    );
    once(
        "x : SINT; y : USINT;",
        "",
        "x := LREAL_TO_SINT(1000.0); y := INT_TO_USINT(b);",
        "127 253",
    );
    once(
        "x : DINT; y : TIME;",
        "",
        "x := TIME_TO_DINT(T#1s500ms); y := INT_TO_TIME(a);",
        "1500 7000000",
    );
    once(
        "x : LINT; y : LREAL;",
        "",
        "x := LTIME_TO_LINT(T#1us); y := TIME_TO_LREAL(T#250us);",
        "1000 0.25",
    );
    once(
        "x : WORD; y : UINT;",
        "",
        "x := UINT_TO_BCD_WORD(1234); y := WORD_BCD_TO_UINT(16#0987);",
        "4660 987",
    );
    once(
        "x : INT; y : BOOL; z : REAL;",
        "s : STRING[10] := '42';",
        "x := STRING_TO_INT(s); y := TO_BOOL(a); z := STRING_TO_REAL('1.5');",
        "42 1 1.5",
    );
    once(
        "x : INT;",
        "s : STRING;",
        "s := CONCAT(INT_TO_STRING(a), '-', INT_TO_STRING(b)); x := LEN(s);",
        "4",
    );
    once(
        "x : DINT; y : DINT;",
        "",
        "x := DATE_TO_DINT(D#1970-01-02); y := TOD_TO_DINT(DT_TO_TOD(DT#1999-12-31-00:00:01));",
        "86400 1000",
    );
    once(
        "x : INT; y : BOOL;",
        "",
        "x := DAY_OF_WEEK(D#2026-11-23); y := CONCAT_DATE(2026, 11, 23) = D#2026-11-23;",
        "1 1",
    );
}

#[test]
fn standard_functions_take_what_they_are_given() {
    once(
        "x : INT; y : INT; z : INT;",
        "",
        "x := MAX(a, b, 5); y := MIN(IN1 := a, IN2 := b); z := LIMIT(MN := 0, IN := b, MX := 10);",
        "7 -3 0",
    );
    once("x : INT; y : INT;", "", "x := SEL(a > b, 1, 2); y := MUX(1, a, b, 3);", "2 -3");
    once(
        "x : INT; y : BOOL; z : BOOL;",
        "",
        "x := ADD(a, b, 1); y := GT(a, 5, b); z := AND(a = 7, TRUE, b < 0);",
        "5 1 1",
    );
    once("x : LREAL; y : LREAL;", "", "x := EXPT(2.0, a); y := 2.0 ** 3;", "128 8");
    once("x : LREAL;", "", "x := ATAN2(1.0, -1.0);", "2.356194490192345");
    once(
        "x : INT; y : INT; z : BOOL;",
        "s : STRING[20] := 'abcdef';",
        "x := FIND(s, 'cd'); y := LEN(DELETE(s, 2, 1)); z := MID(s, 2, 3) = 'cd';",
        "3 4 1",
    );
    once(
        "x : BOOL; y : BOOL;",
        "s : STRING[20];",
        "s := REPLACE('abcdef', 'XY', 3, 2); x := s = 'aXYef'; y := INSERT('ab', 'c', 1) = 'acb';",
        "1 1",
    );
    once(
        "x : DINT;",
        "t : ARRAY [1..3, 0..4] OF INT;",
        "x := SIZEOF(t) + UPPER_BOUND(t, 2);",
        "34",
    );
    once(
        "x : TIME; y : TIME;",
        "t : TIME := T#1s;",
        "x := t * 2 + T#1ms; y := t / 4 - MULTIME(t, 0.5);",
        "2001000000 -250000000",
    );
}

#[test]
fn en_and_eno_permit_a_call() {
    let text = "PROGRAM main VAR_INPUT e : BOOL; a : INT; END_VAR VAR_OUTPUT x : INT; ok : BOOL; n : INT; END_VAR
        VAR c : CTU_INT; END_VAR
        x := ADD(EN := e, IN1 := a, IN2 := 1, ENO => ok); c(EN := e, CU := a > 0, PV := 3, CV => n); END_PROGRAM";
    check(text, &[(&[0, 5], "0 0 0"), (&[1, 5], "6 1 1"), (&[0, 9], "6 0 1")]);
}

#[test]
fn arrays_structures_and_bits_are_memory() {
    once(
        "x : INT; y : INT;",
        "t : ARRAY [1..2, -1..1] OF INT := [1, 2, 3, 3(9)];",
        "x := t[1, 0]; t[2, b + 3] := 4; y := t[2, 0] + t[2, 1];",
        "2 13",
    );
    once(
        "x : INT;",
        "t : ARRAY [0..1] OF ARRAY [0..2] OF INT := [[1, 2, 3], [4, 5, 6]];",
        "x := t[1][2] * 10 + t[0, 1];",
        "62",
    );
    let text = "TYPE point : STRUCT x : INT := 3; y : ARRAY [0..3] OF BOOL; END_STRUCT; END_TYPE
        PROGRAM main VAR_INPUT k : INT; END_VAR VAR_OUTPUT a : INT; b : BOOL; c : BOOL; END_VAR
        VAR p : ARRAY [0..2] OF point := [(x := 5), 2((y := [FALSE, TRUE]))]; q : point; END_VAR
        a := p[0].x * 10 + p[1].x; b := p[k].y[k]; q := p[1]; q.y[k + 1] := TRUE; c := q.y[2]; END_PROGRAM";
    check(text, &[(&[1], "53 1 1")]);
    once(
        "x : WORD; y : BOOL; z : BYTE;",
        "w : WORD := 16#8001; d : DWORD;",
        "y := w.15; w.1 := a > 0; x := w; d.%B2 := 16#AB; z := d.%B2;",
        "32771 1 171",
    );
    once("x : INT;", "i : INT;", "i.0 := TRUE; i.3 := TRUE; x := i;", "9");
}

#[test]
fn enumerations_are_named() {
    let text = "TYPE colour : (red, green := 5, blue); END_TYPE
        PROGRAM main VAR_INPUT a : INT; END_VAR VAR_OUTPUT x : INT; y : BOOL; z : INT; END_VAR
        VAR c : colour := blue; s : (idle, run); END_VAR
        IF a > 0 THEN c := colour#green; s := run; END_IF;
        CASE c OF red: x := 1; green: x := 2; colour.blue: x := 3; END_CASE;
        y := s = run; z := c; END_PROGRAM";
    check(text, &[(&[0], "3 0 6"), (&[1], "2 1 5")]);
}

#[test]
fn a_value_of_an_enumeration_is_declared_once() {
    let text = "TYPE colour : (red, green, RED); END_TYPE
        PROGRAM main VAR_OUTPUT x : colour; END_VAR x := green; END_PROGRAM";
    let (_, found) = read(text, None);
    let errors = shown(text, &found, Severity::Error);
    assert!(errors.starts_with("U1042 1:28 the value `RED` is declared twice"), "{errors}");
    assert_eq!(errors.lines().count(), 1, "{errors}");
}

#[test]
fn elements_of_arrays_are_points() {
    let text = "PROGRAM main
        VAR_INPUT on : ARRAY[1..3] OF BOOL := [TRUE, FALSE, TRUE]; n : ARRAY[0..1,0..1] OF INT; END_VAR
        VAR_OUTPUT off : ARRAY[1..3] OF BOOL; sum : INT; END_VAR
        VAR i : INT; END_VAR
        FOR i := 1 TO 3 DO off[i] := NOT on[i]; END_FOR;
        sum := n[0,0] + 10 * n[0,1] + 100 * n[1,0] + 1000 * n[1,1]; END_PROGRAM";
    let found = program(text);
    let names: Vec<&str> = found.inputs.names().collect();
    let inputs =
        ["on[1]", "on[2]", "on[3]", "n[0,0]", "n[0,1]", "n[1,0]", "n[1,1]", "program.reset"];
    assert_eq!(names, inputs);
    let initials: Vec<u64> = found.inputs.iter().take(3).map(|point| point.initial).collect();
    assert_eq!(initials, [1, 0, 1]);
    check(text, &[(&[1, 0, 0, 1, 2, 3, 4], "0 1 1 4321"), (&[0, 1, 1, 0, 0, 0, 1], "1 0 0 1000")]);
}

#[test]
fn loops_and_cases_end_where_they_must() {
    once(
        "x : INT;",
        "i : INT;",
        "FOR i := 0 TO 10 BY 3 DO IF i = 3 THEN CONTINUE; END_IF; x := x + i; END_FOR;",
        "15",
    );
    once(
        "x : INT; y : INT;",
        "i : INT;",
        "FOR i := 3 TO 1 BY -1 DO x := x * 10 + i; IF i = 2 THEN EXIT; END_IF; END_FOR; y := i;",
        "32 2",
    );
    once("x : INT;", "i : BYTE;", "FOR i := 250 TO 255 DO x := x + 1; END_FOR;", "6");
    once("x : INT;", "", "CASE a OF 1..3, 9: x := 1; 4..8: x := 2; ELSE x := 3; END_CASE;", "2");
    once(
        "x : INT;",
        "",
        "REPEAT x := x + 1; UNTIL x >= a END_REPEAT; WHILE x > 5 DO x := x - 1; END_WHILE;",
        "5",
    );
    once("x : BOOL;", "t : ARRAY [0..1] OF BOOL;", "x := a > 9 AND_THEN t[a] OR_ELSE TRUE;", "1");
}

#[test]
fn functions_have_outputs_defaults_and_references() {
    let text = "FUNCTION f : INT VAR_INPUT a : INT; b : INT := 10; END_VAR VAR_OUTPUT twice : INT; END_VAR VAR_IN_OUT n : INT; END_VAR
          VAR k : INT := 1; END_VAR k := k + 1; n := n + k; twice := a * 2; f := a + b; END_FUNCTION
        PROGRAM main VAR_INPUT a : INT; END_VAR VAR_OUTPUT x : INT; y : INT; z : INT; END_VAR VAR n : INT; t : INT; END_VAR
        x := f(a := a, n := n, twice => t) + f(1, 2, n); y := t; z := n; END_PROGRAM";
    check(text, &[(&[5], "18 10 4"), (&[6], "19 12 8")]);
    let text = "FUNCTION sum : DINT VAR_IN_OUT v : ARRAY [*] OF INT; END_VAR VAR i : DINT; END_VAR
          FOR i := LOWER_BOUND(v, 1) TO UPPER_BOUND(v, 1) DO sum := sum + v[i]; END_FOR; END_FUNCTION
        PROGRAM main VAR_OUTPUT x : DINT; y : DINT; END_VAR VAR p : ARRAY [1..3] OF INT := [1, 2, 3]; q : ARRAY [-1..0] OF INT := [10, 20]; END_VAR
        x := sum(p); y := sum(v := q); END_PROGRAM";
    check(text, &[(&[], "6 30")]);
}

#[test]
fn blocks_are_extended_and_have_methods() {
    let text = "FUNCTION_BLOCK base VAR_INPUT a : INT := 2; END_VAR VAR n : INT; END_VAR VAR_OUTPUT q : INT; END_VAR
          METHOD weight : INT weight := 1; END_METHOD
          METHOD add : INT VAR_INPUT more : INT; END_VAR n := n + more * weight(); add := n; END_METHOD
          q := THIS^.add(more := a); END_FUNCTION_BLOCK
        FUNCTION_BLOCK other EXTENDS base VAR extra : INT := 100; END_VAR
          METHOD weight : INT weight := 10 + SUPER^.weight(); END_METHOD
          SUPER^(); q := q + extra; END_FUNCTION_BLOCK
        PROGRAM main VAR_OUTPUT x : INT; y : INT; z : INT; END_VAR VAR b : base; m : other := (a := 3); END_VAR
        b(); m(); x := b.q; y := m.q; z := b.add(5); END_PROGRAM";
    check(text, &[(&[], "2 133 7"), (&[], "9 166 14")]);
    let text = "FUNCTION_BLOCK count VAR_INPUT c : BOOL R_EDGE; d : BOOL F_EDGE; END_VAR VAR_OUTPUT n : INT; m : INT; END_VAR
          IF c THEN n := n + 1; END_IF; IF d THEN m := m + 1; END_IF; END_FUNCTION_BLOCK
        PROGRAM main VAR_INPUT a : BOOL; END_VAR VAR_OUTPUT x : INT; y : INT; END_VAR VAR f : ARRAY [0..1] OF count; END_VAR
        f[1](c := a, d := a, n => x, m => y); END_PROGRAM";
    check(text, &[(&[0], "0 1"), (&[1], "1 1"), (&[1], "1 1"), (&[0], "1 2"), (&[1], "2 2")]);
}

#[test]
fn globals_addresses_and_tasks() {
    let text = "VAR_GLOBAL CONSTANT size : INT := 2 * half; half : INT := 3; END_VAR VAR_GLOBAL g : INT := size; END_VAR
        PROGRAM fast VAR_EXTERNAL g : INT; END_VAR VAR_OUTPUT x : INT; END_VAR VAR_INPUT i : INT; END_VAR g := g + i; x := g; END_PROGRAM
        PROGRAM slow VAR_OUTPUT y : INT; END_VAR VAR t : ARRAY [1..size] OF INT; m AT %MW3 : INT; n AT %MW3 : INT; END_VAR m := m + 1; y := n * 100 + UPPER_BOUND(t, 1); END_PROGRAM
        CONFIGURATION c RESOURCE r ON plc TASK a(INTERVAL := T#10ms, PRIORITY := 1); TASK b(INTERVAL := T#20ms, PRIORITY := 2);
        PROGRAM p WITH a : fast; PROGRAM s WITH b : slow; END_RESOURCE END_CONFIGURATION";
    check(text, &[(&[1], "7 106"), (&[1], "8 106"), (&[1], "9 206")]);
    let program = program(text);
    let names: Vec<&str> = program.inputs.iter().map(|point| point.name.as_str()).collect();
    assert_eq!(names, ["p.i", "program.reset"]);
    assert_eq!(program.period, 10_000_000);
    let text = "PROGRAM main VAR a AT %IX0.1 : BOOL; q AT %QW0 : WORD; END_VAR q.0 := a OR %IX0.2; q.1 := %IX0.1; END_PROGRAM";
    check(text, &[(&[1, 0], "3"), (&[0, 1], "1")]);
}

/// A program of BOOL points has the fault and the reset where one of its statements can stop it, and a program of other points always.
#[test]
fn only_a_program_that_can_stop_has_a_fault() {
    let check = |declared: &str, body: &str, expected: bool| {
        let text = format!(
            "FUNCTION half : INT VAR_INPUT x : INT; END_VAR half := x / 2; END_FUNCTION
            FUNCTION ratio : INT VAR_INPUT x : INT; END_VAR ratio := 100 / x; END_FUNCTION
            PROGRAM main VAR_INPUT a : BOOL; END_VAR VAR_OUTPUT q : BOOL; END_VAR VAR n : INT; i : INT; t : TON; r : REAL; s : STRING[3];
            w : ARRAY [0..7] OF BOOL; {declared} END_VAR {body} END_PROGRAM"
        );
        let program = program(&text);
        assert_eq!(program.can_fault(), expected, "{body}");
        let has = |points: &Points, name: &str| points.find(name).is_some();
        let found = has(&program.outputs, Program::FAULT);
        assert_eq!(found, expected, "{body}");
        assert_eq!(has(&program.inputs, Program::RESET), found, "{body}");
    };
    for (body, expected) in [
        ("q := a; t(IN := a, PT := T#1s); q := t.Q AND t.ET > T#200ms;", false),
        ("n := n + 1; q := n / 2 MOD 3 = 1;", false),
        ("q := half(n) > 1;", false),
        ("q := ratio(n) > 1;", true),
        ("n := n / i;", true),
        ("r := 1.0 / r; q := r > 0.5;", false),
        ("w[2] := a; q := w[1];", false),
        ("w[n] := a;", true),
        ("q := w[n];", true),
        ("FOR i := 0 TO 7 DO w[i] := a; END_FOR;", false),
        ("FOR i := 0 TO 6 DO w[i + 1] := w[i]; END_FOR; q := w[7];", false),
        ("FOR i := 7 TO 1 BY -1 DO w[i] := w[i - 1]; END_FOR;", false),
        ("FOR i := 0 TO 8 DO w[i] := a; END_FOR;", true),
        ("FOR i := 0 TO 7 DO w[i + 1] := a; END_FOR;", true),
        ("FOR i := 0 TO 7 DO w[i] := a; i := i + 1; END_FOR;", true),
        ("FOR i := 0 TO 7 DO ; END_FOR; w[i] := a;", true),
        ("FOR i := 0 TO n DO q := a; END_FOR;", true),
        ("WHILE a DO q := a; END_WHILE;", true),
        ("n := MUX(n, 1, 2);", true),
        ("s := 'abc'; q := s = 'b';", false),
        ("s := CONCAT(s, 'b');", true),
    ] {
        check("", body, expected);
    }
    let text = "PROGRAM main VAR_INPUT n : INT; END_VAR VAR_OUTPUT q : BOOL; END_VAR q := n > 1; END_PROGRAM";
    let program = program(text);
    assert!(!program.can_fault() && program.outputs.find(Program::FAULT).is_some());
}

#[test]
fn a_connected_program_reads_and_writes_globals() {
    let text = "PROGRAM double VAR_INPUT i : INT; END_VAR VAR_OUTPUT o : INT; END_VAR o := 2 * i; END_PROGRAM
        CONFIGURATION c VAR_GLOBAL u AT %IW0 : INT; y AT %QW0 : INT; END_VAR RESOURCE r ON plc TASK t(INTERVAL := T#10ms, PRIORITY := 1);
        PROGRAM p WITH t : double(i := u, o => y); END_RESOURCE END_CONFIGURATION";
    check(text, &[(&[21], "42")]);
}

#[test]
fn charts_follow_the_standard() {
    let text = "PROGRAM main VAR_INPUT go : BOOL; END_VAR VAR_OUTPUT n : BOOL; p : INT; s : BOOL; l : BOOL; d : BOOL; at : BOOL; END_VAR
        INITIAL_STEP start: END_STEP
        TRANSITION FROM start TO work := go; END_TRANSITION
        STEP work: n(N); pulse(P); s(S); l(L, T#20ms); d(D, T#20ms); END_STEP
        TRANSITION FROM work TO last := NOT go; END_TRANSITION
        STEP last: s(R); END_STEP
        TRANSITION FROM last TO start := last.T >= T#10ms; END_TRANSITION
        ACTION pulse: p := p + 1; END_ACTION
        END_PROGRAM";
    // A variable `at` is a keyword: the name is another one.
    let text = text.replace(" at : BOOL;", " z : BOOL;");
    let expected: [(&[i64], &str); 8] = [
        (&[0], "0 0 0 0 0 0"),
        (&[1], "1 1 1 1 0 0"),
        (&[1], "1 1 1 1 0 0"),
        (&[1], "1 1 1 0 1 0"),
        (&[0], "0 1 0 0 0 0"),
        (&[0], "0 1 0 0 0 0"),
        (&[1], "1 2 1 1 0 0"),
        (&[0], "0 2 0 0 0 0"),
    ];
    check(&text, &expected);
}

#[test]
fn charts_diverge_by_priority_and_in_parallel() {
    let text = "PROGRAM main VAR_INPUT a : BOOL; b : BOOL; END_VAR VAR_OUTPUT x : BOOL; y : BOOL; z : BOOL; w : BOOL; END_VAR
        INITIAL_STEP s0: END_STEP STEP s1: x(N); END_STEP STEP s2: y(N); END_STEP STEP s3: z(N); END_STEP STEP s4: w(N); END_STEP
        TRANSITION (PRIORITY := 2) FROM s0 TO s1 := a; END_TRANSITION
        TRANSITION (PRIORITY := 1) FROM s0 TO (s2, s3) := b; END_TRANSITION
        TRANSITION FROM (s2, s3) TO s4 := a; END_TRANSITION
        TRANSITION FROM s1 TO s0 := b; END_TRANSITION
        END_PROGRAM";
    check(
        text,
        &[(&[1, 1], "0 1 1 0"), (&[0, 0], "0 1 1 0"), (&[1, 0], "0 0 0 1"), (&[1, 1], "0 0 0 1")],
    );
    check(text, &[(&[1, 0], "1 0 0 0"), (&[0, 1], "0 0 0 0"), (&[0, 1], "0 1 1 0")]);
}

#[test]
fn stored_and_delayed_actions_last() {
    let text = "PROGRAM main VAR_INPUT a : BOOL; END_VAR VAR_OUTPUT sd : BOOL; sl : BOOL; ds : BOOL; p0 : INT; END_VAR
        INITIAL_STEP s0: END_STEP STEP s1: sd(SD, T#20ms); sl(SL, T#20ms); ds(DS, T#20ms); leave(P0); END_STEP STEP s2: sd(R); sl(R); ds(R); END_STEP
        TRANSITION FROM s0 TO s1 := a; END_TRANSITION TRANSITION FROM s1 TO s2 := NOT a; END_TRANSITION TRANSITION FROM s2 TO s0 := a; END_TRANSITION
        ACTION leave: p0 := p0 + 1; END_ACTION END_PROGRAM";
    let text = text.replace("sd(R); sl(R); ds(R);", "ds(N);");
    let on: (&[i64], &str) = (&[1], "0 1 0 0");
    check(&text, &[on, on, (&[1], "1 0 1 0"), (&[0], "1 0 1 1"), (&[0], "1 0 1 1")]);
}

#[test]
fn instruction_lists_calculate_call_and_jump() {
    let text = "PROGRAM main VAR_INPUT a : INT; b : INT; END_VAR VAR_OUTPUT x : INT; y : BOOL; z : INT; n : INT; END_VAR VAR c : CTU; k : INT; END_VAR
        LD a\nADD( b\nMUL 2\n)\nST x\nGT 3\nANDN y\nST y\nCAL c(CU := y, PV := 9)\nLD c.CV\nST n\nLD 0\nST z\nST k\nagain:\nLD z\nADD k\nST z\nLD k\nADD 1\nST k\nLE 4\nJMPC again\nLD z\nMAX 3, a\nST z\nEND_PROGRAM";
    check(text, &[(&[2, 3], "8 1 10 1"), (&[2, 0], "2 0 10 1"), (&[20, 0], "20 1 20 2")]);
}

#[test]
fn an_unknown_program_is_answered_with_those_of_the_file() {
    let text = "PROGRAM fill END_PROGRAM PROGRAM drain END_PROGRAM";
    let check = |chosen: Option<&str>, expected: &str| {
        let found = read(text, chosen).1;
        let helps: Vec<&str> = found.iter().filter_map(|of| of.help.as_deref()).collect();
        assert!(found.iter().all(|of| of.code == "U1013"), "{found:?}");
        assert_eq!(helps, [expected], "{chosen:?}");
    };
    check(Some("pump"), "known: fill, drain");
    check(Some("fil"), "did you mean `fill`?");
    check(None, "choose one with --program, of fill, drain");
    let (lowered, found) = read(text, None);
    assert!(lowered.program.is_some() && found.len() == 1, "{found:?}");
}

/// The findings of one severity in a program of these variables and statements.
fn findings(variables: &str, body: &str, severity: Severity) -> String {
    let text = format!(
        "PROGRAM main VAR_INPUT a : INT; END_VAR VAR_OUTPUT y : INT; END_VAR
         VAR {variables} END_VAR {body} END_PROGRAM"
    );
    shown(&text, &read(&text, None).1, severity)
}

#[test]
fn a_value_of_case_has_one_label() {
    let warnings = |body: &str| findings("", body, Severity::Warning);
    for (body, words) in [
        ("CASE a OF 1: y := 1; 1: y := 2; END_CASE;", "the value 1"),
        ("CASE a OF 2..4, 7: y := 1; 3..9: y := 2; END_CASE;", "a value of 3..9"),
        ("CASE a OF 5: y := 1; 1..9: y := 2; END_CASE;", "a value of 1..9"),
    ] {
        let found = warnings(body);
        assert!(found.contains("U1036") && found.contains(words), "{found}");
    }
    let found = warnings("CASE a OF 2..4, 7: y := 1; 1, 5..6, 8: y := 2; END_CASE;");
    assert!(!found.contains("U1036"), "{found}");
    once("x : INT;", "", "CASE a OF 7: x := 1; 5..9: x := 2; END_CASE;", "1");
}

#[test]
fn literals_and_initial_values_stay_in_their_ranges() {
    for (variables, words) in [
        ("x : REAL := 1.0E50;", "is not a REAL"),
        ("x : REAL := REAL#1.0E50;", "is not a REAL"),
        ("x : LREAL := 1.0E500;", "too large for LREAL"),
        ("x : INT (0..10) := 20;", "outside the range 0..10"),
        ("x : INT (-5..5) := -6;", "outside the range -5..5"),
    ] {
        let found = findings(variables, "y := a;", Severity::Error);
        assert!(found.contains(words), "{variables} {found}");
    }
    for variables in [
        "x : REAL := 3.4E38;",
        "x : LREAL := 1.0E50;",
        "x : INT (0..10) := 10;",
        "x : INT (-5..5) := -5;",
    ] {
        let found = findings(variables, "y := a;", Severity::Error);
        assert!(found.is_empty(), "{variables} {found}");
    }
}
