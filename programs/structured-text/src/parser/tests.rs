use super::*;
use crate::print;
use crate::syntax::{Class, Retention, StatementKind, UnitKind};

fn whole(text: &str) -> File {
    let (file, found) = parse(text);
    assert!(found.is_empty(), "{text}: {found:?}");
    file
}

/// The statements of a body as they are printed, on one line.
fn statements(text: &str) -> String {
    let (found, diagnostics) = parse_statements(text);
    assert!(diagnostics.is_empty(), "{text}: {diagnostics:?}");
    let printed = print::statements(&found);
    printed.split_whitespace().collect::<Vec<_>>().join(" ")
}

fn codes(text: &str) -> Vec<&'static str> {
    parse(text).1.iter().map(|found| found.code).collect()
}

fn codes_of_body(text: &str) -> Vec<&'static str> {
    parse_body(text).1.iter().map(|found| found.code).collect()
}

#[test]
fn statements_of_every_kind() {
    let same = [
        "a := b;",
        "a.b[3, i + 1].c^.4 := w.%B1;",
        "f(a, IN := b, Q => c.d, NOT Q => e);",
        "IF a THEN b := 1; ELSIF c THEN d(); ELSE e := 2; END_IF;",
        "CASE n OF 1, 2..5: a := 1; E#red: ; -3: b := 1; ELSE c := 1; END_CASE;",
        "FOR a.i := 1 TO n BY -2 DO EXIT; CONTINUE; END_FOR;",
        "WHILE a AND NOT b DO RETURN; END_WHILE;",
        "REPEAT a := a + 1; UNTIL a > 5 END_REPEAT;",
        "%QX0.1 := %IW3 > 5;",
        "SUPER^.step(a); THIS^.b := c;",
        "t[3](IN := TRUE);",
        "a := (b OR c) AND d XOR e = f + g * h ** 2;",
        "a := b - (c - d) - e / f MOD g;",
        "a := -b + (-c) * NOT d;",
        "a := b AND_THEN c OR_ELSE d;",
        "s := 'it$'s'; t := T#1m30s; d := D#2026-11-23; x := WORD#16#FF;",
        "a := AND(b, c);",
    ];
    for text in same {
        let expected = text.replace("NOT d;", "(NOT d);");
        let expected = if text.contains("* NOT") { expected } else { text.into() };
        assert_eq!(statements(text), expected);
    }
}

#[test]
fn rules_of_other_compilers() {
    let check = |text, expected: &str| assert_eq!(statements(text), expected);
    check("IF a THEN b := 1; END_IF c := 2;", "IF a THEN b := 1; END_IF; c := 2;");
    check("a += 2; b -= c;", "a := a + 2; b := b - c;");
    check("a S= b;", "IF b THEN a := TRUE; END_IF;");
    check("a R= b;", "IF b THEN a := FALSE; END_IF;");
    check("f(IN := , PT := T#1s, Q => );", "f(PT := T#1s);");
    check(";; a := 1;;", "a := 1;");
    check("REGION one two\n #a := #\"b\" DIV 2; END_REGION", "(* one two *) a := b / 2;");
    check("#a := NOT #b = #c;", "a := NOT (b = c);");
    check("REPEAT a(); UNTIL b; END_REPEAT", "REPEAT a(); UNTIL b END_REPEAT;");
}

#[test]
fn variables_and_types() {
    let text = "VAR_INPUT a, b : INT := 5; e : BOOL R_EDGE; END_VAR VAR RETAIN PERSISTENT c AT %MW3 : STRING[20] := 'x'; END_VAR
        VAR CONSTANT d : ARRAY [0..3, 1..n] OF REAL := [1.0, 2(0.5), 3([1, 2])]; END_VAR VAR_TEMP s : P := (x := 1, y := [1, 2]); END_VAR
        VAR_STAT r : INT (-5..5); q : ARRAY [*] OF BOOL; p : POINTER TO INT; o : (red, green := 4) BYTE; END_VAR
        VAR old : ARRAY [0..4] OF INT := 1, 2, 3(0); RETAIN : BOOL; END_VAR";
    let (found, diagnostics) = parse_variables(text);
    assert!(diagnostics.is_empty(), "{diagnostics:?}");
    assert_eq!(found.len(), 12);
    assert_eq!(found[2].edge, Some(true));
    assert!(found[3].retention == Retention::Retained && !found[3].constant && found[4].constant);
    assert_eq!(found[3].address.as_ref().map(Name::as_str), Some("%MW3"));
    assert_eq!(found[6].class, Class::Static);
    let printed = print::declarations(&found);
    assert!(printed.contains("o : (red, green := 4) BYTE;"), "{printed}");
    assert!(printed.contains("old : ARRAY [0..4] OF INT := [1, 2, 3(0)];"), "{printed}");
    let types = whole(
        "TYPE a : STRUCT x : INT; END_STRUCT; b : (on, off) := on; c : INT (0..9) := 3; d : UINT (r := 1, g) END_TYPE",
    );
    assert_eq!(types.types.len(), 4);
}

#[test]
fn units_members_and_configurations() {
    let text = "NAMESPACE a.b USING c; FUNCTION_BLOCK ABSTRACT F EXTENDS a.G IMPLEMENTS I, J VAR x : INT; END_VAR
        METHOD PUBLIC step : BOOL VAR_INPUT n : INT; END_VAR step := n > x; END_METHOD
        x := 1; ACTION more: x := 2; END_ACTION END_FUNCTION_BLOCK
        FUNCTION TIME : TIME TIME := T#0s; END_FUNCTION END_NAMESPACE
        PROGRAM P END_PROGRAM
        CONFIGURATION C VAR_GLOBAL g : INT; END_VAR RESOURCE R ON PLC TASK T1 (INTERVAL := T#10ms, PRIORITY := 1);
        PROGRAM i WITH T1 : P (a := g, b => g); END_RESOURCE END_CONFIGURATION";
    let file = whole(text);
    assert_eq!(file.units.len(), 3);
    assert_eq!(file.units[0].methods.len(), 2);
    assert_eq!(file.units[0].methods[1].kind, UnitKind::Method);
    assert_eq!(file.units[0].extends.as_ref().map(Name::as_str), Some("G"));
    assert_eq!(file.units[0].implements.len(), 2);
    assert_eq!(file.tasks[0].interval, Some(10_000_000));
    assert_eq!(file.instances[0].connections.len(), 2);
    assert_eq!(file.globals[0].class, Class::Global);
    let (file, found) = parse_declarations(
        "FUNCTION_BLOCK FB_X EXTENDS Y\nVAR a : INT; END_VAR\nVAR_OUTPUT b : INT; END_VAR\n",
    );
    assert!(found.is_empty() && file.units[0].declarations.len() == 2, "{found:?}");
    let (file, found) = parse_declarations("METHOD PRIVATE go : BOOL VAR_INPUT a : INT; END_VAR");
    assert!(found.is_empty() && file.units[0].kind == UnitKind::Method, "{found:?}");
}

#[test]
fn siemens_texts() {
    let text = "FUNCTION_BLOCK \"Motor 1\"\n{ S7_Optimized_Access := 'TRUE' }\nAUTHOR : x\nVERSION : 0.1\n VAR_INPUT\n Start { S7_SetPoint := 'True'} : Bool;\n \"my timer\" : TON_TIME; END_VAR
        VAR DB_SPECIFIC t : \"Type\"; END_VAR\nBEGIN\n REGION Main\n #t.a := \"Data\".b;\n END_REGION\nEND_FUNCTION_BLOCK
        DATA_BLOCK \"Data\"\nVERSION : 0.1\nNON_RETAIN\nVAR b : Int; END_VAR\nBEGIN\n b := 1;\nEND_DATA_BLOCK
        TYPE \"Type\" VERSION : 0.1\n STRUCT a : Int; END_STRUCT; END_TYPE
        ORGANIZATION_BLOCK \"Main\" TITLE = \"x y\"\nBEGIN \"Motor\"(Start := TRUE); END_ORGANIZATION_BLOCK";
    let (file, found) = parse(text);
    let codes: Vec<_> = found.iter().map(|found| found.code).collect();
    assert_eq!(codes, ["U1067", "U1067", "U1055"], "{found:?}");
    assert_eq!(file.units[0].name.as_str(), "Motor_1");
    assert_eq!(file.units[1].kind, UnitKind::Program);
    assert_eq!((file.globals.len(), file.types.len()), (1, 1));
}

#[test]
fn charts() {
    let text = "INITIAL_STEP Start: END_STEP STEP b: go(L, T#3s); stop(N); more; END_STEP TRANSITION t1 (PRIORITY := 2) FROM Start TO (b, c) := x AND NOT y; END_TRANSITION
        STEP c: END_STEP TRANSITION FROM (b, c) TO Start := b.T > T#5s; END_TRANSITION ACTION go: z := 1; END_ACTION";
    let (body, found) = parse_body(text);
    assert!(found.is_empty(), "{found:?}");
    let Body::Chart(chart) = body else { panic!("{body:?}") };
    assert_eq!((chart.steps.len(), chart.transitions.len(), chart.actions.len()), (3, 2, 1));
    assert_eq!(chart.steps[1].associations.len(), 3);
    assert!(chart.steps[1].associations[0].duration.is_some());
    assert_eq!(chart.transitions[0].to.len(), 2);
}

#[test]
fn instruction_lists() {
    let text = "LD a\nAND x\nANDN( b\nOR c\n)\nST d\nnext:\nCAL t(IN := d, PT := T#1s, Q => e)\nLD 3\nADD 4, x\nGT(5)\nJMPC next\nR1 f.g\nRET\n";
    let (body, found) = parse_body(text);
    assert!(found.is_empty(), "{found:?}");
    let Body::Instructions(list) = body else { panic!("{body:?}") };
    let operators: Vec<&str> = list.iter().map(|line| line.operator.as_str()).collect();
    let expected =
        ["LD", "AND", "ANDN(", "OR", ")", "ST", "", "CAL", "LD", "ADD", "GT", "JMPC", "R1", "RET"];
    assert_eq!(operators, expected);
    assert_eq!(list[7].operands.len(), 4);
    assert_eq!(list[9].operands.len(), 2);
    for text in ["S(IN := a);", "LD := 3;", "R.x := 1;", "ST[3] := 1;"] {
        assert!(matches!(parse_body(text).0, Body::Statements(_)), "{text}");
    }
}

#[test]
fn what_is_not_supported_is_named() {
    for text in [
        "p REF= x;",
        "p ?= x;",
        "p := __NEW(T);",
        "a := b := c;",
        "JMP x;",
        "x: a := 1;",
        "a := f(1).b;",
        "a := .b;",
        "__TRY a(); __ENDTRY",
    ] {
        assert!(codes_of_body(text).iter().all(|code| *code == "U1040"), "{text}");
        assert!(!codes_of_body(text).is_empty(), "{text}");
    }
    let block = |text: &str| codes(&format!("FUNCTION_BLOCK a {text} END_FUNCTION_BLOCK"));
    assert_eq!(block("PROPERTY x : INT GET x := 1; END_GET END_PROPERTY"), ["U1040"]);
    assert_eq!(
        block("VAR a AT b : INT; c : FB(1); d : UNION x : INT; END_UNION; END_VAR"),
        ["U1040"; 3]
    );
    assert_eq!(codes("INTERFACE I METHOD a END_METHOD END_INTERFACE"), ["U1055"]);
    assert_eq!(codes("TYPE a EXTENDS b : STRUCT x : INT; END_STRUCT END_TYPE"), ["U1040"]);
}

#[test]
fn one_run_shows_every_error() {
    let text = "PROGRAM a VAR x INT; y : ; END_VAR x = 1; y := ; z := 1\nw := 2; IF a b := 1; END_IF; END_PROGRAM PROGRAM c x := (1; END_PROGRAM";
    let (file, found) = parse(text);
    assert!(found.iter().all(|found| found.code == "U1034"), "{found:?}");
    assert_eq!(found.len(), 7, "{found:?}");
    assert_eq!(file.units.len(), 2);
}

#[test]
fn hostile_texts_are_bounded() {
    let deep = |text: &str, close: &str| format!("{}1{}", text.repeat(3_000), close.repeat(3_000));
    let mut texts = vec![
        format!("a := {};", deep("(", ")")),
        format!("a := {};", deep("NOT ", "")),
        format!("a := {};", deep("-", "")),
        format!("a := {};", deep("f(", ")")),
        format!("a := {};", deep("b[", "]")),
        deep("IF a THEN ", " END_IF;"),
        deep("CASE a OF 1: ", ""),
        format!("PROGRAM p VAR x : {} INT; END_VAR END_PROGRAM", "ARRAY [1..2] OF ".repeat(3_000)),
        format!("TYPE x : {}", "STRUCT y : ".repeat(3_000)),
        format!("VAR x : INT := {}", deep("[", "]")),
        format!("VAR {}a : INT; END_VAR", "a, ".repeat(10_000)),
        format!(
            "VAR {}a : STRUCT {} END_STRUCT; END_VAR",
            "a, ".repeat(5_000),
            "b : INT; ".repeat(1_000)
        ),
        "(* ".repeat(10_000),
        "(*(**)".repeat(5_000),
        "a ".repeat(30_000),
        "a\n".repeat(30_000),
        "a : ".repeat(10_000),
        format!("CASE a OF {}", "a\n".repeat(20_000)),
        "REGION ".repeat(10_000),
        "{x} ".repeat(1_000),
        "'".repeat(1_000),
        "ACTION a ".repeat(1_000),
        "METHOD a ".repeat(1_000),
        "LD a(".repeat(1_000),
    ];
    let legal = "PROGRAM a VAR x : INT; END_VAR x := x + 1; IF x > 3 THEN x := f(a := 1); END_IF; END_PROGRAM";
    texts.extend((0..legal.len()).map(|length| legal[..length].to_owned()));
    for text in texts {
        let bound = 2 * understudy_text::MAXIMUM_FINDINGS + 8;
        assert!(parse(&text).1.len() <= bound, "{}", &text[..text.len().min(20)]);
        assert!(parse_body(&text).1.len() <= bound);
        assert!(parse_declarations(&text).1.len() <= bound);
        assert!(parse_instructions(&text).1.len() <= bound);
        assert!(parse_initializer(&text).1.len() <= bound);
    }
}

#[test]
fn an_empty_branch_is_no_label() {
    let (found, _) = parse_statements("CASE a OF 1: b := 1; c.d: e := 2; END_CASE;");
    let StatementKind::Case(_, branches, _) = &found[0].kind else { panic!("{found:?}") };
    assert_eq!(branches.len(), 2);
}
