//! Bodies in FBD and SFC: what is written is valid, and is executed as the program that it was written from.

use std::fmt::Write as _;

use understudy_interchange::{
    Bodies, Format, Wanted, WriteError, Written, draw_typed, listing, typed_text,
};
use understudy_testing::random::Dice;

use crate::support::xmllint;

fn written(name: &str, text: &str, bodies: Bodies) -> Result<Written, WriteError> {
    let (written, found) = typed_text(name, text, Wanted::default(), Format::PlcOpen, bodies)?;
    Ok(written.unwrap_or_else(|| panic!("{found:#?}")))
}

/// Writes a program as a document, which is compared with it over scans; the document is valid and can be written again.
fn document(file: &str, name: &str, text: &str, bodies: Bodies) -> Written {
    let first = written(name, text, bodies).unwrap_or_else(|error| panic!("{error}\n{text}"));
    assert_eq!(first.compared.scans, 2_000);
    if let Some(valid) = xmllint(file, &first.text) {
        assert!(valid, "{}", first.text);
    }
    let again = written("again.xml", &first.text, Bodies::AsRead);
    let again = again.unwrap_or_else(|error| panic!("{error}\n{}", first.text));
    let body = |text: &str| text.split_once("<body>").map(|(_, body)| body.to_owned());
    assert!(body(&again.text).is_some());
    first
}

const LEVEL: &str = "
(* Level control with an alarm. *)
PROGRAM level
  VAR_INPUT raw AT %IW20 : INT; auto AT %IX0.0 : BOOL; setpoint AT %ID12 : REAL; END_VAR
  VAR_OUTPUT valve AT %QD8 : REAL; alarm AT %QX0.0 : BOOL; late AT %QX0.1 : BOOL; n AT %QW20 : INT; END_VAR
  VAR scaled : REAL; error : REAL; t : TON; c : CTU; latch : SR; last : BOOL; END_VAR
  (* scale to percent *)
  scaled := INT_TO_REAL(raw) * 100.0 / 27648.0;
  error := setpoint - scaled;
  valve := LIMIT(0.0, SEL(auto, valve, 2.5 * error + 10.0 - scaled / 4.0), 100.0);
  t(IN := scaled > 90.0 AND NOT last, PT := T#100ms);
  latch(S1 := t.Q, R := NOT auto);
  alarm := latch.Q1;
  late := t.ET > T#50ms;
  IF auto THEN n := n + 1; END_IF;
  IF NOT auto AND n > 7 THEN n := -n MOD 5; END_IF;
  c(CU := alarm, R := NOT auto, PV := 3, Q => last);
  IF c.CV > 2 THEN late := TRUE; END_IF;
  IF c.CV > 4 THEN last := FALSE; END_IF;
END_PROGRAM
";

#[test]
fn statements_are_function_blocks() {
    let found = document("level", "level.st", LEVEL, Bodies::Blocks);
    assert!(found.text.contains("<FBD>") && !found.text.contains("<ST>"), "{}", found.text);
    assert_eq!(found.losses, []);
    // A block is connected to what reads its output, and stays so.
    let again = written("again.xml", &found.text, Bodies::AsRead).expect("a document");
    for text in [&found.text, &again.text] {
        assert!(text.contains(r#"formalParameter="Q1""#));
        assert!(text.contains(r#"formalParameter="R" negated="true""#));
        assert!(text.contains("scale to percent"));
    }
    assert!(written("level.st", LEVEL, Bodies::AsRead).expect("a document").text.contains("<ST>"));
}

/// An output is connected once: what reads it again in one statement names it.
#[test]
fn an_output_is_connected_once() {
    let text = "PROGRAM main
  VAR_INPUT a AT %IX0.0 : BOOL; END_VAR
  VAR_OUTPUT y AT %QL0 : TIME; END_VAR
  VAR t : TON; END_VAR
  t(IN := a, PT := T#50ms);
  y := t.ET + (t.ET + t.PT) - t.ET;
END_PROGRAM";
    let found = document("once", "once.st", text, Bodies::Blocks);
    assert_eq!(found.text.matches(r#"formalParameter="ET">"#).count(), 2, "{}", found.text);
    assert_eq!(found.text.matches("<expression>t.ET</expression>").count(), 2);
}

#[test]
fn what_no_network_holds_stays_text_and_is_named() {
    let text = "PROGRAM main
  VAR_INPUT a AT %IW0 : INT; END_VAR
  VAR_OUTPUT y AT %QW0 : INT; END_VAR
  VAR i : INT; END_VAR
  FOR i := 0 TO 3 DO y := y + a; END_FOR;
END_PROGRAM";
    let found = document("loop", "loop.st", text, Bodies::Blocks);
    assert!(found.text.contains("<ST>"), "{}", found.text);
    let messages: Vec<&str> = found.losses.iter().map(|it| it.message.as_str()).collect();
    assert_eq!(messages.len(), 1);
    assert!(messages[0].contains("`main` has a loop"), "{messages:?}");
}

/// A value whose operators have more bits than their boxes is written as it is; all else of the body stays boxes.
#[test]
fn an_intermediate_result_keeps_its_bits() {
    let cases = [
        ("x := raw * 100 / 4095;", false),
        ("d := raw * 100;", false),
        ("y := raw + raw > 20000;", false),
        ("r := raw * 3;", false),
        ("x := -raw MOD 5;", false),
        ("c(CU := raw + raw > 0, PV := 3);", false),
        ("IF raw * 2 > 20000 THEN x := 1; END_IF;", false),
        ("x := raw * 2 - x;", true),
        ("x := MAX(raw + x, 3);", true),
        ("d := d * 3 / 4;", true),
        ("y := raw MOD 3 = 0;", true),
    ];
    for (at, (statement, is_drawn)) in cases.into_iter().enumerate() {
        let text = format!(
            "PROGRAM main\n  VAR_INPUT raw AT %IW0 : INT; END_VAR\n  VAR_OUTPUT x AT %QW0 : INT; d AT %QD1 : DINT; r AT %QD2 : REAL; y AT %QX0.0 : BOOL; z AT %QX0.1 : BOOL; END_VAR\n  VAR c : CTU; END_VAR\n  {statement}\n  z := y AND raw > 0;\nEND_PROGRAM"
        );
        let found = document(&format!("bits-{at}"), "bits.st", &text, Bodies::Blocks);
        assert!(found.text.contains("<FBD>") && found.losses.is_empty(), "{statement}");
        let has_box = ["ADD", "SUB", "MUL", "DIV", "MOD", "MAX"]
            .iter()
            .any(|word| found.text.contains(&format!("typeName=\"{word}\"")));
        assert_eq!(has_box, is_drawn, "{statement}\n{}", found.text);
    }
}

const BATCH: &str = "
PROGRAM batch
  VAR_INPUT start AT %IX0.0 : BOOL; stop AT %IX0.1 : BOOL; level AT %IW0 : INT; END_VAR
  VAR_OUTPUT valve AT %QX0.0 : BOOL; mixer AT %QX0.1 : BOOL; heat AT %QX0.2 : BOOL; count AT %QW0 : INT; END_VAR
  VAR n : INT; END_VAR
  INITIAL_STEP Idle: END_STEP
  STEP Fill: valve(N); Count(P1); END_STEP
  STEP Mix: mixer(D, T#50ms); END_STEP
  STEP Heating: heat(L, T#100ms); END_STEP
  STEP Mixed: END_STEP
  STEP Heated: END_STEP
  STEP Drain: mixer(R); Note(P0); END_STEP
  STEP Abort: Clear(P); END_STEP
  TRANSITION FROM Idle TO Fill := start AND NOT stop; END_TRANSITION
  TRANSITION FROM Fill TO (Mix, Heating) := level > 100; END_TRANSITION
  TRANSITION FROM Fill TO Abort := stop; END_TRANSITION
  TRANSITION FROM Mix TO Mixed := Mix.T > T#100ms; END_TRANSITION
  TRANSITION FROM Heating TO Heated := Heating.T > T#150ms OR level > 200; END_TRANSITION
  TRANSITION FROM (Mixed, Heated) TO Drain := TRUE; END_TRANSITION
  TRANSITION FROM Drain TO Idle := level < 10; END_TRANSITION
  TRANSITION FROM Abort TO Idle := NOT stop; END_TRANSITION
  ACTION Count: n := n + 1; count := n; END_ACTION
  ACTION Note: IF n > 100 THEN n := 0; END_IF; END_ACTION
  ACTION Clear: n := 0; count := 0; END_ACTION
END_PROGRAM
";

#[test]
fn a_chart_is_a_chart() {
    let found = document("batch", "batch.st", BATCH, Bodies::AsRead);
    let words = [
        "<SFC>",
        "<selectionDivergence",
        "<simultaneousDivergence",
        "<simultaneousConvergence",
        "<jumpStep",
        r#"qualifier="P0""#,
        r#"duration="T#100ms""#,
    ];
    for word in words {
        assert!(found.text.contains(word), "{word}: {}", found.text);
    }
}

/// A chart whose steps lead to each other at random, with all qualifiers.
fn random_chart(dice: &mut Dice) -> String {
    let count = 2 + dice.below(6);
    let mut text = String::from(
        "PROGRAM main\n  VAR_INPUT a AT %IX0.0 : BOOL; b AT %IX0.1 : BOOL; n AT %IW0 : INT; END_VAR\n  VAR_OUTPUT y AT %QX0.0 : BOOL; z AT %QX0.1 : BOOL; m AT %QW0 : INT; END_VAR\n",
    );
    for step in 0..count {
        let word = if step == 0 { "INITIAL_STEP" } else { "STEP" };
        let _ = write!(text, "  {word} S{step}: ");
        for _ in 0..dice.below(3) {
            let action = dice.pick(&["y", "z", "Add", "Double"]);
            let timed = dice.pick(&["L", "D", "SD", "DS", "SL"]);
            let plain = dice.pick(&["N", "R", "S", "P", "P0", "P1"]);
            let _ = match dice.below(3) {
                0 => write!(text, "{action}({timed}, T#{}ms); ", 10 * (1 + dice.below(5))),
                _ => write!(text, "{action}({plain}); "),
            };
        }
        text += "END_STEP\n";
    }
    let condition = ["a", "NOT b", "a AND b", "n > 0", "S0.T > T#30ms", "S1.X OR a"];
    for _ in 0..2 + dice.below(10) {
        let mut some = || {
            let several = if dice.below(4) == 0 { 1 + dice.below(3) } else { 1 };
            let mut all: Vec<usize> = (0..several).map(|_| dice.below(count)).collect();
            all.sort_unstable();
            all.dedup();
            let all: Vec<String> = all.iter().map(|step| format!("S{step}")).collect();
            match all.as_slice() {
                [one] => one.clone(),
                all => format!("({})", all.join(", ")),
            }
        };
        let (from, to) = (some(), some());
        let priority = match dice.below(3) {
            0 => format!("(PRIORITY := {}) ", 1 + dice.below(4)),
            _ => String::new(),
        };
        let condition = dice.pick(&condition);
        let _ = writeln!(
            text,
            "  TRANSITION {priority}FROM {from} TO {to} := {condition}; END_TRANSITION"
        );
    }
    text += "  ACTION Add: m := m + 1; END_ACTION\n  ACTION Double: m := m * 2 + n; END_ACTION\nEND_PROGRAM\n";
    text
}

#[test]
fn random_charts_are_executed_as_they_were() {
    for seed in 0..60 {
        let text = random_chart(&mut Dice::new(seed));
        document(&format!("chart-{seed}"), "chart.st", &text, Bodies::AsRead);
    }
}

const LADDER: &str = include_str!("ladder-with-numbers.xml");

/// Bodies in LD with boxes of numbers stay such bodies.
#[test]
fn a_ladder_with_boxes_is_a_ladder() {
    let found = document("ladder", "ladder.xml", LADDER, Bodies::AsRead);
    let count = |text: &str| found.text.matches(text).count();
    assert_eq!((count("<LD>"), count("<FBD>"), count("<ST>")), (1, 0, 0));
    assert_eq!((count("<leftPowerRail"), count("<rightPowerRail")), (1, 1));
    let marks = [r#"storage="set""#, r#"storage="reset""#, r#"typeName="GT""#];
    assert_eq!(marks.map(count), [1, 1, 1], "{}", found.text);
    let negated = |what: &str| {
        let tags = found.text.split(what).skip(1);
        let tags = tags.filter_map(|text| text.split_once('>'));
        tags.filter(|(tag, _)| tag.contains(r#"negated="true""#)).count()
    };
    assert_eq!((negated("<contact "), negated("<coil ")), (2, 1));

    let (svg, diagnostics) = draw_typed("ladder.xml", LADDER, Wanted::default(), Bodies::AsRead);
    let svg = svg.expect("a picture");
    assert!(diagnostics.is_empty(), "{diagnostics:#?}");
    // Signs of coils, and names once for each contact.
    assert!(svg.contains(">S</text>") && svg.contains(">R</text>") && svg.contains(">/</text>"));
    assert_eq!(svg.matches(">auto</text>").count(), 3);
}

/// A Boolean value of contacts, comparisons and blocks.
fn random_power(dice: &mut Dice, depth: usize) -> String {
    let inner = |dice: &mut Dice| random_power(dice, depth - 1);
    match dice.below(if depth == 0 { 4 } else { 9 }) {
        0 => dice.pick(&["a", "b", "y", "z"]).to_owned(),
        1 => format!("NOT {}", dice.pick(&["a", "b", "y"])),
        2 => dice.pick(&["n > 3", "m <= n", "t.Q", "t.ET > T#20ms"]).to_owned(),
        3 => dice.pick(&["TRUE", "FALSE", "a", "t.Q"]).to_owned(),
        4 | 5 => format!("({} AND {})", inner(dice), inner(dice)),
        6 => format!("({} OR {})", inner(dice), inner(dice)),
        7 => format!("({} XOR {})", inner(dice), inner(dice)),
        _ => format!("NOT ({} OR {} AND {})", inner(dice), inner(dice), inner(dice)),
    }
}

/// Random statements, read as a ladder: what is written is a ladder, valid, and executed as the statements.
#[test]
fn random_ladders_with_numbers_are_executed_as_they_were() {
    for seed in 0..60 {
        let dice = &mut Dice::new(seed);
        let mut text = String::from(
            "PROGRAM main\n  VAR_INPUT a AT %IX0.0 : BOOL; b AT %IX0.1 : BOOL; n AT %IW0 : INT; END_VAR\n  VAR_OUTPUT y AT %QX0.0 : BOOL; z AT %QX0.1 : BOOL; m AT %QW0 : INT; END_VAR\n  VAR t : TON; END_VAR\n",
        );
        for _ in 0..1 + dice.below(6) {
            let power = random_power(dice, 3);
            let target = dice.pick(&["y", "z"]);
            let _ = match dice.below(6) {
                0 => writeln!(text, "  t(IN := {power}, PT := T#30ms);"),
                1 => writeln!(text, "  IF {power} THEN {target} := TRUE; END_IF;"),
                2 => writeln!(text, "  IF {power} THEN {target} := FALSE; END_IF;"),
                3 => writeln!(text, "  IF {power} THEN m := m + n; END_IF;"),
                _ => writeln!(text, "  {target} := {power};"),
            };
        }
        text += "END_PROGRAM\n";
        let blocks = document(&format!("blocks-{seed}"), "main.st", &text, Bodies::Blocks);
        let ladder = blocks.text.replace("FBD>", "LD>");
        let found = document(&format!("ladder-{seed}"), "main.xml", &ladder, Bodies::AsRead);
        assert!(found.text.contains("<LD>"), "{text}");
    }
}

#[test]
fn pictures_show_every_name() {
    let (svg, found) = draw_typed("level.st", LEVEL, Wanted::default(), Bodies::Blocks);
    let svg = svg.expect("a picture");
    assert!(found.is_empty(), "{found:#?}");
    for word in ["PROGRAM level", ">TON<", ">latch<", ">27648.0<", ">valve<", "scale to percent"] {
        assert!(svg.contains(word), "{word}");
    }
    let (svg, _) = draw_typed("batch.st", BATCH, Wanted::default(), Bodies::AsRead);
    let svg = svg.expect("a picture");
    for word in [">Heating<", ">L T#100ms<", ">level &lt; 10<", "ACTION Note"] {
        assert!(svg.contains(word), "{word}");
    }
    // Text is its own picture.
    let (svg, _) = draw_typed("level.st", LEVEL, Wanted::default(), Bodies::AsRead);
    assert!(svg.expect("a picture").contains("error := setpoint - scaled;"));
    let (text, _) = listing("level.st", LEVEL, Wanted::default());
    assert!(text.expect("a text").contains("END_PROGRAM"));
}
