//! Subranges: a constant outside one is an error, an expression that can leave one is a warning, and an output is within its own.

mod running;

use running::{Running, program, read, shown};
use understudy_text::Severity;

const UNITS: &str = "
TYPE digit : INT (0..9); pair : STRUCT one : INT (0..9); any : INT; END_STRUCT; END_TYPE
FUNCTION_BLOCK block
  VAR_INPUT given : INT (0..9); END_VAR
  VAR_OUTPUT taken : INT (0..99); END_VAR
  taken := given * 11;
END_FUNCTION_BLOCK
FUNCTION same : INT (0..9)
  VAR_INPUT given : INT (0..9); END_VAR
  VAR_OUTPUT taken : INT (0..99); END_VAR
  same := given; taken := given;
END_FUNCTION
FUNCTION_BLOCK writer
  VAR_IN_OUT all : INT; END_VAR
  all := 12;
END_FUNCTION_BLOCK
FUNCTION_BLOCK careful
  VAR_IN_OUT own : INT (0..9); END_VAR
  IF own > 0 THEN own := own - 1; END_IF;
END_FUNCTION_BLOCK
";

/// The codes of what is found in a body, in the order of the text.
fn codes(variables: &str, body: &str) -> String {
    let text = format!(
        "{UNITS}PROGRAM main
         VAR_INPUT s : INT (0..9); a : INT; END_VAR
         VAR p : INT (0..9); d : digit; z : pair; t : ARRAY [0..3] OF digit; b : block; w : writer; c : careful; n : INT; {variables} END_VAR
         {body} END_PROGRAM"
    );
    let (_, found) = read(&text, None);
    assert!(!found.iter().any(|found| found.span.end <= UNITS.len()), "{found:?}");
    let codes = found.iter().map(|found| match found.severity {
        Severity::Error => format!("{}!", found.code),
        Severity::Warning => found.code.to_owned(),
    });
    codes.collect::<Vec<_>>().join(" ")
}

/// Every way to store a number where a subrange is declared.
const STORES: [&str; 9] = [
    "p := @;",
    "d := @;",
    "z.one := @;",
    "t[2] := @;",
    "t[s MOD 4] := @;",
    "b.given := @;",
    "b(given := @);",
    "n := same(given := @);",
    "FOR p := 0 TO @ DO n := p; END_FOR;",
];

#[test]
fn a_constant_outside_is_an_error_wherever_it_is_stored() {
    for store in STORES {
        for (value, expected) in [
            ("0", ""),
            ("9", ""),
            ("10", "U1043!"),
            ("-1", "U1043!"),
            ("4 + 5", ""),
            ("4 + 6", "U1043!"),
            ("16#FF", "U1043!"),
        ] {
            assert_eq!(codes("", &store.replace('@', value)), expected, "{store} {value}");
        }
    }
    for (declared, expected) in [
        ("x : INT (0..9) := 10;", "U1036!"),
        ("x : digit := -1;", "U1036!"),
        ("x : ARRAY [0..2] OF digit := [1, 2, 10];", "U1036!"),
        ("x : ARRAY [0..2] OF INT (0..9) := [1, 2(10)];", "U1036!"),
        ("x : pair := (one := 10, any := 10);", "U1036!"),
        ("x : ARRAY [0..1] OF pair := [(one := 9), (one := 10)];", "U1036!"),
        ("x : block := (given := 10);", "U1036!"),
        ("x : pair := (one := 9, any := 10);", ""),
    ] {
        assert_eq!(codes(declared, "p := 1;"), expected, "{declared}");
    }
}

#[test]
fn an_expression_that_can_leave_is_a_warning_wherever_it_is_stored() {
    for store in STORES {
        for (value, expected) in [
            ("s", ""),
            ("d", ""),
            ("t[1]", ""),
            ("z.one", ""),
            ("same(s)", ""),
            ("9 - s", ""),
            ("a MOD 10", "U1054"),
            ("s + 1", "U1054"),
            ("s - 1", "U1054"),
            ("a", "U1054"),
            ("z.any", "U1054"),
            ("b.taken", "U1054"),
            ("LIMIT(0, a, 9)", ""),
            ("MIN(s + 1, 9)", ""),
            ("SEL(a > 3, s, 7)", ""),
            ("SEL(a > 3, s, 12)", "U1054"),
            ("s * 100 / 100", ""),
        ] {
            assert_eq!(codes("", &store.replace('@', value)), expected, "{store} {value}");
        }
    }
    for (body, expected) in [
        ("b(given := s, taken => n);", ""),
        ("b(given := s, taken => p);", "U1054"),
        ("n := same(given := s, taken => p);", "U1054"),
        ("w(all := n);", ""),
        ("w(all := p);", "U1054"),
        ("c(own := p);", ""),
        ("c(own := n);", "U1054"),
        ("p.3 := TRUE;", "U1054"),
        // What is known of a variable at a place.
        ("IF p < 9 THEN p := p + 1; END_IF;", ""),
        ("IF p <= 9 THEN p := p + 1; END_IF;", "U1054"),
        ("IF p = 9 THEN p := 0; ELSE p := p + 1; END_IF;", ""),
        (
            "IF NOT (9 > p) THEN p := 0; ELSIF a > 3 AND p > 3 THEN p := p - 4; ELSE p := p + 1; END_IF;",
            "",
        ),
        ("IF p >= 9 OR a > 3 THEN p := 0; ELSE p := p + 1; END_IF;", ""),
        ("IF p >= 9 OR_ELSE a > 3 THEN p := 0; ELSE p := p + 1; END_IF;", ""),
        ("IF p < 9 OR a > 3 THEN p := p + 1; END_IF;", "U1054"),
        ("IF p < 9 THEN b(given := s); p := p + 1; END_IF;", "U1054"),
        ("IF p < 9 THEN p := 9; p := p + 1; END_IF;", "U1043!"),
        ("IF a > 0 AND a < 9 THEN p := a; END_IF; p := a;", "U1054"),
        ("CASE p OF 0..3: p := p + 1; 4: p := 7; ELSE p := p - 1; END_CASE;", "U1054"),
        ("CASE a OF 0, 4..8: p := a + 1; 10: p := 1; END_CASE;", ""),
        ("n := LIMIT(0, a, 9); p := n;", ""),
        ("n := LIMIT(0, a, 9); IF a > 3 THEN n := a; END_IF; p := n;", "U1054"),
        ("n := 3; WHILE n < 30 DO n := n + 1; p := n; END_WHILE;", "U1054"),
        ("n := 3; REPEAT p := n; n := n + 1; UNTIL n > 4 END_REPEAT;", "U1054"),
        ("FOR n := 0 TO 9 DO p := n; END_FOR;", ""),
        ("FOR n := 9 TO 0 BY -1 DO p := n; END_FOR;", ""),
        ("FOR n := 0 TO 10 DO p := n; END_FOR;", "U1054"),
        ("FOR n := 0 TO 9 DO n := n + 1; p := n; END_FOR;", "U1054"),
        // One warning for one value.
        ("p := n * 1000;", "U1054"),
    ] {
        assert_eq!(codes("", body), expected, "{body}");
    }
}

/// Where nothing is found, a variable never leaves its subrange, whatever the inputs are.
#[test]
fn what_is_not_warned_of_stays_within() {
    let conditions = [
        "p < 5",
        "p >= s",
        "a = p",
        "a <> 9",
        "p > 0 AND s < 9",
        "NOT (p < 9 OR s = 3)",
        "q <= -1",
        "a > p OR_ELSE s > 7",
        "p + 1 > 4",
    ];
    let values = [
        "p + 1",
        "s",
        "p - s",
        "a",
        "q * q",
        "LIMIT(0, a, 9)",
        "9 - p",
        "MIN(p, s) + 1",
        "SEL(a > 3, p, s - 1)",
        "q + 4",
        "s / 2",
        "-q",
        "s MOD 3 + p MOD 7",
        "ABS(q)",
    ];
    let mut seed = 0x9e37_79b9_7f4a_7c15_u64;
    let mut below = |bound: usize| {
        seed ^= seed << 13;
        seed ^= seed >> 7;
        seed ^= seed << 17;
        (seed % bound as u64) as usize
    };
    let (mut quiet, mut warned) = (0, 0);
    for _ in 0..3_000 {
        let statement = |below: &mut dyn FnMut(usize) -> usize| {
            format!("{} := {};", ["p", "q", "a2"][below(3)], values[below(values.len())])
        };
        let mut body = String::new();
        for _ in 0..1 + below(3) {
            let one = statement(&mut below);
            let other = statement(&mut below);
            let condition = conditions[below(conditions.len())];
            body += &match below(5) {
                0 => one,
                1 => format!("IF {condition} THEN {one} {other} END_IF;"),
                2 => format!("IF {condition} THEN {one} ELSE {other} END_IF;"),
                3 => format!("CASE p OF 0..4: {one} 9: {other} ELSE p := 3; END_CASE;"),
                _ => format!("FOR a2 := 1 TO 3 DO {one} END_FOR; {other}"),
            };
        }
        let text = format!(
            "PROGRAM main VAR_INPUT s : INT (0..9); a : INT; END_VAR
             VAR_OUTPUT shown_p : INT; shown_q : INT; END_VAR
             VAR p : INT (0..9) := 4; q : INT (-5..5); a2 : INT; END_VAR
             {body} shown_p := p; shown_q := q; END_PROGRAM"
        );
        let (_, found) = read(&text, None);
        if !found.is_empty() {
            warned += 1;
            continue;
        }
        quiet += 1;
        let mut running = Running::new(program(&text));
        for scan in 0..40_u64 {
            let a = [0_i64, 3, 9, 10, -1, -32_768, 32_767, 5][below(8)];
            let found = running.scan(&[(scan * 7 + scan / 10) % 10, a as u64 & 0xffff]);
            let found: Vec<i16> = found.iter().map(|value| *value as i16).collect();
            assert!(
                (0..=9).contains(&found[0]) && (-5..=5).contains(&found[1]),
                "{found:?} {text}"
            );
        }
    }
    assert!(quiet > 200 && warned > 200, "{quiet} quiet, {warned} warned");
}

/// For every value of an input: an output beyond its subrange becomes the end of it, and no other number.
#[test]
fn an_output_is_within_its_subrange() {
    let text = "TYPE pair : STRUCT one : SINT (-3..3); two : USINT; END_STRUCT; END_TYPE
        PROGRAM main
        VAR_INPUT a : INT; END_VAR
        VAR_OUTPUT low : INT (-2..3); up : UINT (7..9); w : WORD (16#10..16#20); z : pair; END_VAR
        VAR t AT %QW5 : ARRAY [0..1] OF INT (0..9); END_VAR
        low := a; up := INT_TO_UINT(a); w := INT_TO_WORD(a); z.one := INT_TO_SINT(a); t[1] := a;
        IF a > 5 THEN RETURN; END_IF;
        low := low;
        END_PROGRAM";
    let (_, found) = read(text, None);
    assert_eq!(shown(text, &found, Severity::Error), "");
    assert_eq!(found.iter().filter(|found| found.code == "U1054").count(), 5, "{found:?}");
    let mut running = Running::new(program(text));
    let names: Vec<String> = running.outputs().iter().map(|point| point.name.clone()).collect();
    for a in (i16::MIN..=i16::MAX).step_by(13).chain(-40..40) {
        let stored = a as u16;
        let found = running.scan(&[stored.into()]);
        let expected = |name: &str| match name {
            "low" => a.clamp(-2, 3) as u16,
            "up" => stored.clamp(7, 9),
            "w" => stored.clamp(16, 32),
            "z.one" => u16::from((a as i8).clamp(-3, 3) as u8),
            "t[1]" => a.clamp(0, 9) as u16,
            _ => 0,
        };
        for (name, found) in names.iter().zip(found) {
            assert_eq!(found, u64::from(expected(name)), "{name} of {a}");
        }
    }
}
