//! What texts become, and that they do what they say.

use understudy_ladder::print;
use understudy_logic::Running;

use understudy_structured_text::parse;
use understudy_typed::Points;

use crate::execution::{check, typed};
use crate::support::{PERIOD, findings, program};

#[test]
fn a_text_as_a_ladder() {
    insta::assert_snapshot!(print(&program(include_str!("texts/rungs.st"))));
}

/// What rungs do not hold is refused, and never left out: each declaration with each use of it, alone and in a configuration.
#[test]
fn rungs_do_what_the_text_does_or_there_are_none() {
    let declared = [
        "VAR x : BOOL; END_VAR",
        "VAR x : BOOL := TRUE; END_VAR",
        "VAR x : BOOL := BOOL#1; END_VAR",
        "VAR x : BOOL := NOT FALSE; END_VAR",
        "VAR CONSTANT k : BOOL := TRUE; END_VAR VAR x : BOOL := k; END_VAR",
        "VAR CONSTANT k : BOOL := NOT TRUE; x : BOOL := NOT k AND TRUE; END_VAR",
        "VAR RETAIN x : BOOL := TRUE; END_VAR",
        "VAR_TEMP x : BOOL; END_VAR",
        "VAR_OUTPUT x : BOOL := TRUE; END_VAR",
        "VAR_INPUT x : BOOL := TRUE; END_VAR",
        "VAR_INPUT x : BOOL R_EDGE; END_VAR",
        "VAR x AT %QX3.1 : BOOL := TRUE; again AT %QX3.1 : BOOL; END_VAR",
        "VAR x AT %MX3.1 : BOOL := TRUE; END_VAR",
        "VAR x AT %IX3.1 : BOOL; END_VAR",
        "VAR_EXTERNAL x : BOOL; END_VAR",
        "VAR x : flag; END_VAR",
        "VAR t : TON := (PT := T#200ms); x : BOOL; END_VAR",
        "VAR t : TON := (IN := TRUE, PT := T#200ms); x : BOOL; END_VAR",
        "VAR c : CTU := (CV := 3); x : BOOL; END_VAR",
        "VAR c : CTU := (PV := 2); x : BOOL; END_VAR",
        "VAR r : R_TRIG; s : SR; x : BOOL; END_VAR",
        "VAR w AT %QW3 : WORD; x AT %QX6.1 : BOOL; END_VAR",
        "VAR x AT %I* : BOOL; y AT %I* : BOOL; END_VAR",
        "VAR x AT %Q* : BOOL := TRUE; y AT %Q* : BOOL; END_VAR",
        "VAR x AT %M* : BOOL := TRUE; END_VAR",
        "VAR_OUTPUT n : INT := 5; x : BOOL; END_VAR",
        "VAR_INPUT n : INT; x : BOOL; END_VAR",
        "VAR_OUTPUT x : ARRAY [0..1] OF BOOL; END_VAR",
        "VAR c : CTU; x : BOOL; END_VAR VAR CONSTANT two : INT := 2; END_VAR",
    ];
    let uses = [
        "q := x; x := a;",
        "x := a OR x; q := x;",
        "IF a THEN x := b; END_IF; q := x XOR b;",
        "q := t.Q; t(IN := a); q := q AND t.Q OR x;",
        "t(IN := a, PT := T#300ms); q := t.Q;",
        "IF b THEN t(IN := a); END_IF; q := t.Q;",
        "c(CU := a); q := c.Q; p := c.CV >= 2;",
        "c(CU := a, R := b, PV := 4); c.PV := 3; q := c.Q;",
        "c(a, b, 3); q := c.CV < 3;",
        "c(CU := a, R := b, PV := two); q := c.CV >= two;",
        "t(EN := b, IN := a, PT := T#100ms); q := t.Q;",
        "t(IN := a, PT := T#2400h1s); q := t.Q;",
        "IF a THEN q := TRUE; (* at the end *) END_IF; p := y OR x; (* below *)",
        "r(CLK := a); s(S1 := r.Q, R := b); q := s.Q1; p := NOT r.Q;",
        "q := r.Q AND x;",
        "x := TRUE; q := %QX3.1; %QX7.0 := a; p := %QX7.0;",
        "q := MAX(BOOL_TO_INT(a), 0) > 0;",
        "q := SEL(a, b, x);",
        "RETURN; q := a;",
        "q := x; WHILE q AND a DO q := FALSE; END_WHILE;",
    ];
    let configurations = [
        "",
        "CONFIGURATION c RESOURCE r ON plc TASK t(INTERVAL := T#100ms); PROGRAM i WITH t : p0; END_RESOURCE END_CONFIGURATION",
        "CONFIGURATION c VAR_GLOBAL go : BOOL; END_VAR RESOURCE r ON plc TASK t(SINGLE := go); PROGRAM i WITH t : p0; END_RESOURCE END_CONFIGURATION",
        "CONFIGURATION c VAR_GLOBAL go AT %QX9.0 : BOOL; END_VAR RESOURCE r ON plc TASK t(INTERVAL := T#100ms); PROGRAM i WITH t : p0(q => go); END_RESOURCE END_CONFIGURATION",
        "FUNCTION_BLOCK R_TRIG VAR_INPUT CLK : BOOL; END_VAR VAR_OUTPUT Q : BOOL; END_VAR Q := NOT CLK; END_FUNCTION_BLOCK",
    ];
    let (mut held, mut refused) = (0, 0);
    for declared in declared {
        for body in uses {
            for around in configurations {
                let text = format!(
                    "TYPE flag : BOOL := TRUE; END_TYPE VAR_GLOBAL x : BOOL := TRUE; END_VAR {around}
                     PROGRAM p0 VAR_INPUT a, b : BOOL; END_VAR VAR_OUTPUT q, p : BOOL; END_VAR {declared} {body} END_PROGRAM"
                );
                let (file, _) = parse(&text);
                let Some(typed) = typed(&text, &file) else {
                    continue;
                };
                match crate::support::read(&text).program {
                    Some(ladder) => {
                        check(&text, &program(&text), &typed, 5);
                        let points =
                            |points: &Points| points.iter().filter(|it| it.slot != 0).count();
                        assert_eq!(ladder.inputs.len(), points(&typed.inputs), "{text}");
                        assert_eq!(ladder.outputs.len(), points(&typed.outputs), "{text}");
                        let printed = print(&ladder);
                        let comments = ["at the end", "below"];
                        let mut comments = comments.iter().filter(|it| text.contains(**it));
                        assert!(comments.all(|comment| printed.contains(comment)), "{printed}");
                    }
                    None => refused += 1,
                }
                held += 1;
            }
        }
    }
    assert!(held > 500 && refused > 200, "{held} programs, {refused} refused");
}

/// A ladder has words of its own, which become other names, and says so.
#[test]
fn words_of_the_ladder_are_renamed_with_a_warning() {
    let text = "PROGRAM rung VAR_INPUT input : BOOL; END_VAR VAR_OUTPUT memory : BOOL; END_VAR memory := input; END_PROGRAM";
    let found = findings(text, crate::support::read(text).diagnostics);
    assert_eq!(
        found,
        "1:24: U1067 Warning: `input` is `input_2` in the ladder\n1:57: U1067 Warning: `memory` is `memory_2` in the ladder\n"
    );
    let again = understudy_ladder::parse(&print(&program(text)));
    assert!(!understudy_text::has_errors(&again.diagnostics), "{:?}", again.diagnostics);
}

#[test]
fn two_names_of_one_address_are_one_bit() {
    let text =
        "PROGRAM p VAR a AT %IX0.0 : BOOL; again AT %IX0.0 : BOOL; y AT %QX0.0 : BOOL; END_VAR
y := a AND NOT again; END_PROGRAM";
    let reading = crate::support::read(text);
    let found = findings(text, reading.diagnostics);
    assert_eq!(
        found,
        "1:35: U1055 Warning: `again` as a second name of `a`, whose address it has, is not kept\n"
    );
    let program = program(text);
    assert_eq!(program.inputs.len(), 1);
    let mut running = Running::new(&program.lower(PERIOD).expect("a circuit"));
    assert_eq!(running.step(&[true]), [false]);
}
